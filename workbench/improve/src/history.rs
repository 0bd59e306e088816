//! What was tried on a servo: a line of JSON for each candidate in `history.jsonl`, and what has to be put back if the
//! program is killed meanwhile.

use crate::bench::Moment;
use crate::candidate::known;
use crate::trial::Trial;
use anyhow::anyhow;
use serde::{Deserialize, Serialize};
use servo::store::AxisParameters;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use truing_core::outcome::Outcome;
use truing_core::text::input_error::InputError;
use truing_report::report::write_atomically;
use truing_servo::device::parameters::modelled;
use truing_servo::device::place_load::{PlaceLoad, Sine};

/// One line each.
const FILE: &str = "history.jsonl";
/// While a candidate may be in force: what was in force before.
const PENDING: &str = "pending.json";

/// The gap of a model, rms in `unit`, and its fit in percent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Unit of the rms.
    pub unit: String,
    /// What the verdict was.
    pub verdict: String,
    /// Rms of the model as given, of the extended one, and the noise floor; on data held out. `None`: not tested.
    pub rms: [Option<f64>; 3],
    /// Fit of the model as given and of the extended one, %.
    pub fit_percent: [Option<f64>; 2],
}

impl Gap {
    /// Of an answer of the gap workflow.
    pub fn of(outcome: &Outcome) -> Self {
        let held = &outcome.holdout;
        let told = |number: f64| Some(number).filter(|number| number.is_finite());
        Self {
            unit: outcome.gap_unit.clone(),
            verdict: truing_report::report::grade(outcome).to_string(),
            rms: [held.rmse_before, held.rmse_after, held.noise_floor].map(told),
            fit_percent: [held.fit_percent_before, held.fit_percent_after].map(told),
        }
    }
}

/// One number that the servo uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// What it is.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The number.
    pub value: f64,
    /// Half width of its 95 % interval; 0: not known.
    pub u95: f64,
}

/// One candidate, and what became of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// When, UTC.
    pub date: String,
    /// The same on the servo's clock; `None`: an entry of an earlier version.
    #[serde(default)]
    pub at: Option<Moment>,
    /// Is it in force now?
    pub kept: bool,
    /// Why, or why not.
    pub why: String,
    /// Effects that were named.
    pub names: Vec<String>,
    /// The model's gap, if a log was looked at.
    pub gap: Option<Gap>,
    /// How well the motor followed.
    pub trial: Option<Trial>,
    /// Numbers of the candidate.
    pub numbers: Vec<Known>,
    /// Logs, in the same folder.
    pub logs: Vec<PathBuf>,
    /// In force before; `None`: the axis was not configured.
    pub before: Option<AxisParameters>,
    /// The candidate; `None`: there was none.
    pub after: Option<AxisParameters>,
}

impl Entry {
    /// With the present date.
    pub fn now(before: Option<AxisParameters>) -> Self {
        let date = jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string();
        Self { date, before, ..Self::default() }
    }

    /// With these numbers.
    pub fn with(self, candidate: &AxisParameters) -> Self {
        let found = known(candidate).map(|found| found.numbers().to_vec()).unwrap_or_default();
        let known = |is: &str, of: &str, value, u95| Known { name: is.into(), unit: of.into(), value, u95 };
        let trusted = found.into_iter().filter(|(.., it)| it.trusted);
        let told = trusted.filter_map(|(is, of, it)| Some(known(is, of, it.value?, it.u95.unwrap_or(0.0))));
        let load = PlaceLoad::of(&candidate.position_load, &candidate.config);
        let name = |it: &Sine| format!("load, {} cycles of {} counts", it.cycles, load.period_counts);
        let sine = |it: &Sine| known(&name(it), "V", it.amplitude_v, 0.0);
        let acting = modelled(candidate).filter(|(.., acts)| *acts);
        let model = acting.map(|([_, name, unit], of, _)| known(name, unit, of.into(), 0.0));
        let loops = [known("bandwidth of the loops", "/τ", candidate.tuning.bandwidth.into(), 0.0)];
        let numbers = told.chain(loops).chain(model).chain(load.sines.iter().map(sine)).collect();
        Self { numbers, after: Some(*candidate), ..self }
    }

    /// What became of the candidate.
    pub fn became(&self) -> &'static str {
        match (self.kept, &self.trial) {
            (true, _) => "kept",
            (false, Some(_)) => "rolled back",
            (false, None) => "not tried",
        }
    }

    /// One line for people, and one for each of the figures.
    pub fn text(&self) -> String {
        let names = if self.names.is_empty() { "no name".to_owned() } else { self.names.join(", ") };
        let mut text = format!("{}  {}: {}\n  names     {names}\n", self.date, self.became(), self.why);
        if let Some(Gap { fit_percent: [Some(before), Some(after)], verdict, .. }) = &self.gap {
            let _ = writeln!(text, "  gap       {verdict}, fit {before:.2} → {after:.2} %");
        }
        if let Some(trial) = &self.trial {
            let _ = writeln!(text, "  tracking  {}", trial.text("\n            "));
        }
        text
    }
}

/// All entries of a folder, in the order of time.
pub fn read(folder: &Path) -> anyhow::Result<Vec<Entry>> {
    let path = folder.join(FILE);
    if !path.exists() {
        let what = "is not there; name a folder that `truing improve --out` has written";
        return Err(InputError::file(path.display(), what).into());
    }
    let text = truing_files::text(&path)?;
    let entry = |(number, line): (u64, &str)| {
        let what = |error| format!("is no entry of a history ({error}); take the line out");
        serde_json::from_str(line)
            .map_err(|error| InputError::line(path.display(), number, what(error)).into())
    };
    (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()).map(entry).collect()
}

/// Adds an entry; the file is whole at any time.
pub fn append(folder: &Path, entry: &Entry) -> anyhow::Result<()> {
    let path = folder.join(FILE);
    let mut text = if path.exists() { truing_files::text(&path)? } else { String::new() };
    text += &(serde_json::to_string(entry)? + "\n");
    write_atomically(&path, &text)
}

/// All entries for people, with the numbers that have moved by more than both are sure of.
pub fn text(entries: &[Entry]) -> String {
    let (mut text, mut before) = (String::new(), None::<&Entry>);
    for (number, entry) in (1..).zip(entries) {
        text += &format!("{number}. {}", entry.text());
        for moved in before.map(|before| moved(before, entry)).unwrap_or_default() {
            let _ = writeln!(text, "  moved     {moved}");
        }
        before = Some(entry).filter(|entry| !entry.numbers.is_empty()).or(before);
    }
    text
}

/// Numbers that differ by more than their 95 % intervals together. What a person has chosen has no interval and tells nothing.
fn moved(before: &Entry, after: &Entry) -> Vec<String> {
    let beyond = |now: &Known| {
        let then = before.numbers.iter().find(|then| then.name == now.name)?;
        let sure = now.u95.hypot(then.u95);
        let (name, unit) = (&now.name, &now.unit);
        ((now.value - then.value).abs() > sure && now.u95 > 0.0 && then.u95 > 0.0).then(|| {
            format!("{name} from {:.4} to {:.4} {unit}, more than ± {sure:.4} explain", then.value, now.value)
        })
    };
    after.numbers.iter().filter_map(beyond).collect()
}

/// What may be in force although nobody has kept it, and what was in force before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pending {
    /// `None`: the axis was not configured.
    pub before: Option<AxisParameters>,
    /// Beside it, in RAM alone.
    pub candidate: AxisParameters,
    /// When this was noted, on the host and on the servo.
    pub at: Moment,
}

impl Pending {
    /// Notes it, before the candidate comes into force.
    pub fn begin(&self, folder: &Path) -> anyhow::Result<()> {
        write_atomically(&folder.join(PENDING), &serde_json::to_string(self)?)
    }

    /// The old set is in force again, or the candidate was kept.
    pub fn end(folder: &Path) -> anyhow::Result<()> {
        match std::fs::remove_file(folder.join(PENDING)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(anyhow!("{}: cannot be removed ({error})", folder.join(PENDING).display()))
            }
            _ => Ok(()),
        }
    }

    /// What an earlier command has left because it was killed, or could not reach the servo any more.
    pub fn read(folder: &Path) -> anyhow::Result<Option<Self>> {
        let path = folder.join(PENDING);
        if !path.exists() {
            return Ok(None);
        }
        let what = "is damaged; remove it, and switch the servo off and on";
        let damaged = |_| InputError::file(path.display(), what).into();
        serde_json::from_str(&truing_files::text(&path)?).map_err(damaged)
    }

    /// Does what has to be put back act now? Something else than before is in force in the same life of the servo; one that was
    /// switched off meanwhile has forgotten it.
    pub fn lingers(&self, in_force: &AxisParameters, now: &Moment) -> bool {
        self.before.as_ref() != Some(in_force) && self.at.same_life(now, in_force.config.tick_hz)
    }
}
