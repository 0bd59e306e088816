//! The mistakes that are looked for, each with what it does to the motion and with the line that mends it.

use super::motion::{Base, Motion};
use crate::system::log::{Dynamic, Input};
use crate::system::model::{Kind, Model};
use crate::text::figures::figure;
use std::f64::consts::{PI, TAU};

/// rad/s in one rpm.
const RPM: f64 = TAU / 60.0;
/// rad in a degree.
const DEGREE: f64 = PI / 180.0;

/// A factor that is found lies so near to the one of the list, as a difference of logarithms, besides the tolerance
/// of the model: a fit with friction and a dead zone knows its gain to 3 %. Origin: seven pole pairs are no rpm
/// (9.55), a gear of 7 no turns (6.28).
const NEAR: f64 = 0.03;

/// What a voltage may be logged as, and its full scale.
const SCALES: [(&str, f64); 5] = [
    ("a duty from -1 to 1", 1.0),
    ("a duty in per cent", 100.0),
    ("a PWM of 8 bits", 255.0),
    ("a PWM of 10 bits", 1023.0),
    ("a PWM of 12 bits", 4095.0),
];

/// Scales that a largest input belongs to: it fills a seventh of the range or more, and lies above it by no more than noise. Chosen by
/// judgement; not studied.
pub fn scales(largest: f64) -> impl Iterator<Item = (&'static str, f64)> {
    SCALES.into_iter().filter(move |(_, full)| (0.15 * full..=1.02 * full).contains(&largest))
}

/// A mistake.
#[derive(Clone, Debug)]
pub struct Suspect {
    /// Column or key.
    pub place: String,
    /// What it would be, in words that follow "it looks as if".
    pub what: String,
    /// What mends it.
    pub remedy: String,
    /// By how much the acceleration per unit of input is then larger than the model says.
    pub slope: f64,
    /// By how much the rate is.
    pub rate: f64,
    /// Input and speed stand in each other's place.
    pub swapped: bool,
    /// Only the sign counts.
    pub any_size: bool,
}

impl Suspect {
    pub fn new(place: &str, what: impl Into<String>, mend: impl Into<String>, slope: f64, rate: f64) -> Self {
        let (what, remedy) = (what.into(), mend.into());
        Self { place: place.to_owned(), what, remedy, slope, rate, swapped: false, any_size: false }
    }

    /// The share of the motion that is explained once this is put right; `None` if it is not what the data show.
    pub fn explains(&self, motion: &Motion, base: &Base, model: &Model) -> Option<f64> {
        let swapped = if self.swapped { Some(motion.swapped()?) } else { None };
        let best = swapped.as_ref().unwrap_or(motion).near(base, self.rate)?;
        // Numbers of a data sheet may be off together, but by a tenth a unit is not in doubt. Judgement; not studied.
        let margin = NEAR + model.tolerance("default").min(0.1);
        let meant = Base { slope: base.slope * self.slope, rate: base.rate * self.rate };
        let gain = best.gain_over(&meant);
        (gain > 0.0 && (self.any_size || gain.ln().abs() < margin)).then_some(best.explained)
    }
}

/// Every mistake that can be seen in the motion of this record.
pub fn all(model: &Model, record: &Dynamic, base: &Base) -> Vec<Suspect> {
    let sign = sign(record);
    // The gain of a model that is a fit has taken every factor up.
    if model.fitted_to_log {
        return vec![Suspect { any_size: true, ..sign }];
    }
    let mut all = vec![sign];
    all.extend(of_speed(record));
    all.extend(of_input(model, record));
    all.extend(of_time(record));
    all.extend(of_keys(model, record.input, base));
    let (input, speed) = (record.input.column(), speed_column(record));
    let what = format!("{input} and {speed} stand in each other's place");
    let exchanged = Suspect::new(input, what, record.names.exchanged(input, speed), 1.0, 1.0);
    all.push(Suspect { swapped: true, ..exchanged });
    all
}

/// The column that tells the motion.
pub fn speed_column(record: &Dynamic) -> &'static str {
    let speed = record.runs.iter().any(|run| run.speed.is_some());
    match (speed, record.linear) {
        (true, false) => "omega_rad_s",
        (true, true) => "v_m_s",
        (false, false) => "theta_rad",
        (false, true) => "q_m",
    }
}

fn sign(record: &Dynamic) -> Suspect {
    let (speed, input) = (speed_column(record), record.input.column());
    let what = format!("{speed} or {input} has the wrong sign");
    let otherwise = " (or swap A and B of the encoder, or the motor leads, and log again)";
    Suspect::new(speed, what, record.names.times(speed, -1.0) + otherwise, -1.0, 1.0)
}

/// A column in another unit: what is read makes the acceleration, and the rate, so many times as large.
fn in_unit(record: &Dynamic, column: &str, unit: &str, slope: f64, rate: f64) -> Suspect {
    let factor = if column == speed_column(record) { 1.0 / slope } else { slope };
    Suspect::new(column, format!("{column} is {unit}"), record.names.times(column, factor), slope, rate)
}

/// Units of the motion: what is read is `factor` times what is there.
fn of_speed(record: &Dynamic) -> Vec<Suspect> {
    let column = speed_column(record);
    let units: &[(&str, f64)] = match column {
        "omega_rad_s" => &[("in rpm", 1.0 / RPM), ("in °/s", 1.0 / DEGREE), ("in turns/s", 1.0 / TAU)],
        "theta_rad" => &[("in degrees", 1.0 / DEGREE), ("in turns", 1.0 / TAU)],
        _ => &[("in mm", 1000.0)],
    };
    let quarter = ("a quarter of itself: counts that were not multiplied by four", 0.25);
    let all = units.iter().chain([&quarter]);
    all.map(|(unit, factor)| in_unit(record, column, unit, *factor, 1.0)).collect()
}

/// A factor that no list holds: the side of a gear, counts that are not multiplied by four, counts for radians.
pub fn of_any_size(record: &Dynamic, found: f64) -> Suspect {
    let column = speed_column(record);
    let cause = if found < 1.0 {
        let gear = figure(1.0 / found);
        format!(
            "an encoder on the slow side of a gear of {gear}:1, or counts that were not multiplied by four"
        )
    } else {
        "electrical turns of a motor with pole pairs, an encoder on the fast side of a gear, counts of an encoder for radians, or another unit".into()
    };
    let what = format!("{column} is {} times what the model says: {cause}", figure(found));
    let (mended, input) = (record.names.times(column, 1.0 / found), record.input.column());
    let remedy = format!("{mended} if so; else check the units of {input} and of the model's keys");
    Suspect { any_size: true, ..Suspect::new(column, what, remedy, 1.0, 1.0) }
}

/// Units of the input: the file's number is `factor` times the quantity.
fn of_input(model: &Model, record: &Dynamic) -> Vec<Suspect> {
    let column = record.input.column();
    let inputs = record.runs.iter().flat_map(|run| &run.input);
    let largest = inputs.fold(0.0_f64, |most, input| most.max(input.abs()));
    let milli = match record.input {
        Input::Voltage => "in mV",
        Input::Current => "in mA",
        Input::Torque => "in mN m",
        Input::Force => "in mN",
    };
    let mut units = vec![(milli, 1000.0)];
    if let (Input::Voltage, Some(supply)) = (record.input, model.supply_nominal_v) {
        // The range is a part of the evidence: a PWM of 8 bits ends at 255.
        units.extend(scales(largest).map(|(name, full)| (name, full / supply)));
    }
    units.into_iter().map(|(unit, factor)| in_unit(record, column, unit, 1.0 / factor, 1.0)).collect()
}

/// Units of the time.
fn of_time(record: &Dynamic) -> Vec<Suspect> {
    let unit = |unit: &str, factor: f64| in_unit(record, "t_s", unit, factor, factor);
    let mut all = vec![unit("in ms", 1e-3), unit("in µs", 1e-6)];
    let counted = record.runs.iter().all(|run| run.t_s.windows(2).all(|t| (t[1] - t[0] - 1.0).abs() < 1e-9));
    if counted {
        // A third of an octave apart, from 10 rows a second to 20,000.
        let rates = (0..34).map(|k| 10.0 * 2f64.powf(f64::from(k) / 3.0));
        all.extend(rates.map(|hz| {
            let rows = unit("in rows", 1.0 / hz);
            let what = format!("t_s counts rows, about {hz:.0} of them a second");
            let remedy = format!("{}, or with the time of a row that you know", rows.remedy);
            Suspect { what, remedy, ..rows }
        }));
    }
    all
}

/// Keys of the model in another unit: what is meant is `factor` times what stands there.
fn of_keys(model: &Model, input: Input, base: &Base) -> Vec<Suspect> {
    let mut all = Vec::new();
    let units: &[(&str, &str, f64)] = &[
        ("J_kgm2", "g cm²", 1e-7),
        ("J_kgm2", "kg cm²", 1e-4),
        ("J_kgm2", "g m²", 1e-3),
        ("inertia_kgm2", "g cm²", 1e-7),
        ("inertia_kgm2", "kg cm²", 1e-4),
        ("mass_kg", "g", 1e-3),
        ("R_ohm", "mΩ", 1e-3),
        ("Kt_nm_per_a", "mN m/A", 1e-3),
        ("Kt_nm_per_a", "N cm/A", 1e-2),
        ("Ke_vs_per_rad", "V/krpm", 1e-3 / RPM),
        ("Ke_vs_per_rad", "mV/rpm", 1e-3 / RPM),
        ("Ke_vs_per_rad", "V/rpm", 1.0 / RPM),
        ("gain_rad_s_per_v", "rpm/V", RPM),
        ("time_constant_s", "ms", 1e-3),
    ];
    for (key, unit, factor) in units {
        let Some(&(_, value)) = model.parameters().iter().find(|(own, _)| own == key) else { continue };
        let mut kind = model.kind;
        kind.set(key, value * factor);
        // One of the two constants often stands for both.
        if let Kind::DcMotor { kt_nm_per_a, ke_vs_per_rad, .. } = model.kind
            && (kt_nm_per_a / ke_vs_per_rad - 1.0).abs() < 1e-9
            && (*key == "Kt_nm_per_a" || *key == "Ke_vs_per_rad")
        {
            kind.set("Kt_nm_per_a", value * factor);
            kind.set("Ke_vs_per_rad", value * factor);
        }
        if let Some(meant) = Base::of(&kind, input) {
            let remedy = format!("{key} = {} in the model file", figure(value * factor));
            let rate = if base.rate > 0.0 { meant.rate / base.rate } else { 1.0 };
            let what = format!("{key} is in {unit}");
            all.push(Suspect::new(key, what, remedy, meant.slope / base.slope, rate));
        }
    }
    // The same number by two names is told once.
    all.dedup_by(|a, b| a.remedy == b.remedy);
    all
}
