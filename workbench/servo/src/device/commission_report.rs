//! `truing-commission/1`: how a commissioning ended, in SI units, with a text for every reason. And `params.toml`: the
//! same numbers, to be used again.

use crate::device::aftermath::fault_text;
use crate::device::commission_seen as seen;
use crate::device::link::advice;
use crate::device::place_load::PlaceLoad;
use crate::device::run_log::RunLog;
use serde::{Deserialize, Serialize};
use servo::commission::Outcome;
use servo::config::Config;
use servo::identify::estimate::{
    Estimate, Estimates, EstimatesReport, GAIN_FRAC, Mechanism, Reason, Reported, Standing, TIME_FRAC,
    VOLTAGE_FRAC,
};
use servo::protect::Fault;
use std::collections::BTreeMap;
use std::path::Path;
use truing_core::text::input_error::{InputError, line_of};

/// A refusal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refused {
    /// Stable code.
    pub code: &'static str,
    /// What to do.
    pub text: String,
}

/// One number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Number {
    /// `null`: not seen.
    pub value: Option<f64>,
    /// Half width of the 95 % interval.
    pub u95: Option<f64>,
    /// May it be used?
    pub trusted: bool,
    /// Why it is missing or not trusted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<&'static str>,
    /// What to do about that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<&'static str>,
}

impl From<Reported> for Number {
    fn from(reported: Reported) -> Self {
        Number {
            value: reported.value.map(decimal),
            u95: reported.u95.map(decimal),
            trusted: reported.trusted,
            reason: reported.reason.map(Reason::code),
            advice: reported.reason.map(advice),
        }
    }
}

/// Numbers of a report under their own names, one row each: field, and name and unit for people.
macro_rules! numbers {
    ($(#[$about:meta])+ $group:ident: $($(#[$doc:meta])+ $field:ident, $name:literal, $unit:literal;)+) => {
        $(#[$about])+
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
        pub struct $group {
            $($(#[$doc])+ pub $field: Number,)+
        }

        impl $group {
            /// The numbers with names and units, for people.
            pub fn numbers(&self) -> [(&'static str, &'static str, Number); [$($name),+].len()] {
                [$(($name, $unit, self.$field)),+]
            }
        }

        impl From<&EstimatesReport> for $group {
            fn from(report: &EstimatesReport) -> Self {
                $group { $($field: report.$field.into(),)+ }
            }
        }
    };
}
pub(crate) use numbers;

numbers! {
    /// What a commissioning finds.
    Found:
    /// V.
    dead_zone_pos_v, "dead zone, positive", "V";
    /// V, positive magnitude.
    dead_zone_neg_v, "dead zone, negative", "V";
    /// V.
    saturation_pos_v, "saturation, positive", "V";
    /// V, positive magnitude.
    saturation_neg_v, "saturation, negative", "V";
    /// rad/s/V.
    gain_rad_s_per_v, "gain", "rad/s/V";
    /// s.
    time_constant_s, "time constant", "s";
}

/// The f64 that prints like the f32.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// `truing-commission/1`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommissionJson {
    /// `truing-commission/1`.
    pub schema: &'static str,
    /// What was found.
    #[serde(flatten)]
    pub found: Found,
    /// `friction`, `input_dead_zone` or `unclear`.
    pub mechanism: Mechanism,
    /// s.
    pub duration_s: f64,
    /// Turns of the controlled shaft.
    pub travel_rev: f64,
    /// `null`: not refused.
    pub refused: Option<Refused>,
    /// For people: why numbers are not to be used.
    #[serde(skip)]
    pub doubts: Vec<String>,
}

impl CommissionJson {
    /// From what the chip has said.
    pub fn new(outcome: &Outcome, config: &Config) -> Result<Self, InputError> {
        let scale =
            config.build().map_err(|error| InputError(format!("{} is out of range", error.field.name())))?;
        let report = outcome.report(&scale);
        Ok(CommissionJson {
            schema: "truing-commission/1",
            found: (&report.estimates).into(),
            mechanism: report.estimates.mechanism,
            duration_s: decimal(report.duration_s),
            travel_rev: decimal(report.travel_rev),
            refused: report.refused.map(|reason| Refused {
                code: reason.code(),
                text: seen::refusal(reason, outcome, &report, config),
            }),
            doubts: seen::doubts(outcome, &report, config),
        })
    }

    /// With what the log adds: the supply, and the latched fault where "stopped before the end" is no reason.
    #[must_use]
    pub fn beside(mut self, log: &RunLog) -> Self {
        let fault = log.fault();
        if let Some(refused) = &mut self.refused {
            if refused.code == Reason::Aborted.code() && fault != Fault::None {
                refused.text = format!("a fault stopped it: {}", fault_text(log));
            } else if let Some(supply) = seen::supply(refused.code, log.last_supply_v(), &log.config) {
                refused.text.insert_str(0, &supply);
            }
        }
        self
    }
}

impl Number {
    /// The interval that covers the truth in 95 % of cases, as text: `1.5128 … 1.6400 V (95 %)`. A ± would be taken for the
    /// standard deviation that it is in the workbench's own reports.
    pub fn interval(&self, unit: &str) -> Option<String> {
        let (low, high) = (self.value? - self.u95?, self.value? + self.u95?);
        (low.is_finite() && high.is_finite()).then(|| format!("{low:.4} … {high:.4} {unit} (95 %)"))
    }
}

/// One number of `params.toml`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with value, u95 and trusted")]
pub struct Kept {
    /// In the unit of its name.
    pub value: f64,
    /// Half width of its 95 % interval; 0: chosen by a person.
    pub u95: f64,
    /// To be used?
    pub trusted: bool,
}

/// `params.toml`, schema `truing-params/1`. A number that is missing there is missing on the chip.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// `truing-params/1`.
    pub schema: String,
    /// What the encoder gives a turn, where that is not what the axis file says.
    pub counts_per_rev: Option<u32>,
    /// Decides the sign source of the compensation.
    pub mechanism: Mechanism,
    /// V.
    pub dead_zone_pos_v: Option<Kept>,
    /// V, positive magnitude.
    pub dead_zone_neg_v: Option<Kept>,
    /// V.
    pub saturation_pos_v: Option<Kept>,
    /// V, positive magnitude.
    pub saturation_neg_v: Option<Kept>,
    /// rad/s/V.
    pub gain_rad_s_per_v: Option<Kept>,
    /// s.
    pub time_constant_s: Option<Kept>,
    /// What a model tells, by the keys of [`NAMES`](servo::compensate::modelled::NAMES); what is not here stays as it is.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub modelled: BTreeMap<String, Kept>,
    /// The load over the place; nothing: it stays as it is.
    pub position_load: Option<PlaceLoad>,
}

const PARAMS_SCHEMA: &str = "truing-params/1";

impl Params {
    /// Nothing is known.
    pub fn nothing() -> Self {
        Params { schema: PARAMS_SCHEMA.into(), ..Params::default() }
    }

    /// From a commissioning, or what a chip has found.
    pub fn new(mechanism: Mechanism, found: &Found) -> Self {
        let kept = |Number { value, u95, trusted, .. }| Some(Kept { value: value?, u95: u95?, trusted });
        Params {
            mechanism,
            dead_zone_pos_v: kept(found.dead_zone_pos_v),
            dead_zone_neg_v: kept(found.dead_zone_neg_v),
            saturation_pos_v: kept(found.saturation_pos_v),
            saturation_neg_v: kept(found.saturation_neg_v),
            gain_rad_s_per_v: kept(found.gain_rad_s_per_v),
            time_constant_s: kept(found.time_constant_s),
            ..Params::nothing()
        }
    }

    /// As text.
    pub fn text(&self) -> Result<String, InputError> {
        toml::to_string_pretty(self).map_err(|error| InputError(format!("params.toml: {error}")))
    }

    /// As a file.
    pub fn save(&self, path: &Path) -> anyhow::Result<()> {
        truing_report::report::write_atomically(path, &self.text()?)
    }

    /// From a file.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let source = path.display();
        let text = truing_files::text(path)?;
        let params: Params = toml::from_str(&text).map_err(|error| {
            let line = error.span().map_or(1, |span| line_of(&text, span.start));
            InputError::line(&source, line, error.message().replace('\n', " "))
        })?;
        if params.schema != PARAMS_SCHEMA {
            let what = format!(
                "schema is \"{}\", expected \"{PARAMS_SCHEMA}\"; write it with `truing commission --save`",
                params.schema
            );
            return Err(InputError::file(&source, what));
        }
        if params == Params::nothing() {
            let what = "it holds no number: the commissioning that wrote it was refused; commission again";
            return Err(InputError::file(&source, what));
        }
        Ok(params)
    }

    /// In the chip's units.
    pub fn estimates(&self, config: &Config) -> Estimates {
        let nominal = f64::from(config.supply_nominal_v);
        let volt = f64::from(1u32 << VOLTAGE_FRAC) / nominal;
        let gain = f64::from(1u32 << GAIN_FRAC) * nominal / f64::from(config.rated_speed_rad_s);
        let second = f64::from(1u32 << TIME_FRAC) * f64::from(config.tick_hz);
        Estimates {
            dead_zone: [estimate(self.dead_zone_pos_v, volt), estimate(self.dead_zone_neg_v, volt)],
            saturation: [estimate(self.saturation_pos_v, volt), estimate(self.saturation_neg_v, volt)],
            gain_skew: 0,
            gain: estimate(self.gain_rad_s_per_v, gain),
            time_constant: estimate(self.time_constant_s, second),
            mechanism: self.mechanism,
        }
    }
}

fn estimate(kept: Option<Kept>, per_unit: f64) -> Estimate {
    let Some(kept) = kept else {
        return Estimate::missing(Reason::NotIdentified);
    };
    Estimate {
        value: (kept.value * per_unit).round() as i32,
        u95: (kept.u95 * per_unit).round() as i32,
        standing: if kept.trusted { Standing::Trusted } else { Standing::Doubtful(Reason::NotIdentified) },
    }
}
