//! Rigs whose hidden effects are known, from their builders or from an analysis of their own, and whether an answer of the
//! gap workflow is right.
//!
//! A rig is a folder with a model, a log, held-out records and an `expect.toml`. The expectation is written from what is
//! known of the rig, never from an answer of this program.

use serde::Deserialize;
use std::path::{Path, PathBuf};
use truing_core::outcome::{Outcome, Verdict};
use truing_core::system::effects;
use truing_core::text::input_error::InputError;

/// What is known of a rig: `expect.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// `truing-expect/1`.
    pub schema: String,
    /// The model file.
    #[serde(default = "model_file")]
    pub model: PathBuf,
    /// The log. A path that does not exist in the rig's folder is looked for in the folder of measured data.
    #[serde(default = "log_file")]
    pub log: PathBuf,
    /// The held-out records.
    #[serde(default = "holdout_files")]
    pub holdout: Vec<PathBuf>,
    /// As `--columns` of `truing gap`.
    #[serde(default)]
    pub columns: String,
    /// The first half of the log's rows is the log, the second is held out; `holdout` is then left out.
    #[serde(default)]
    pub halves: bool,
    /// Accepted as the first name.
    #[serde(default)]
    pub first: Vec<String>,
    /// Nothing in the library explains this rig: no name is right.
    #[serde(default)]
    pub unexplained: bool,
    /// Of each of these lists one name is needed.
    #[serde(default)]
    pub needed: Vec<Vec<String>>,
    /// Names that would be wrong.
    #[serde(default)]
    pub wrong: Vec<String>,
    /// Held-out fit to reach, %.
    pub fit_percent: f64,
    /// Best held-out fit that anybody has shown, %.
    pub best_known_percent: f64,
    /// Why the workbench is known to fall short here. The rig is then listed as such, and the expectation stays.
    pub shortfall: Option<String>,
}

fn model_file() -> PathBuf {
    "model.toml".into()
}

fn log_file() -> PathBuf {
    "log.csv".into()
}

fn holdout_files() -> Vec<PathBuf> {
    vec!["holdout.csv".into()]
}

impl Expectation {
    /// Reads the file of a rig.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = std::fs::read_to_string(path).map_err(|error| InputError::file(path.display(), error))?;
        let read: Self = toml::from_str(&text).map_err(|error| InputError::file(path.display(), error))?;
        if read.schema != "truing-expect/1" {
            let what = format!("schema is \"{}\", not \"truing-expect/1\"", read.schema);
            return Err(InputError::file(path.display(), what));
        }
        let names = read.first.iter().chain(read.needed.iter().flatten()).chain(&read.wrong);
        for name in names {
            effects::known(name).map_err(|text| InputError::file(path.display(), text))?;
        }
        Ok(read)
    }

    /// Of a rig of which nothing is known.
    fn nothing() -> Self {
        toml::from_str("schema = \"truing-expect/1\"\nfit_percent = 0.0\nbest_known_percent = 0.0")
            .expect("a constant text")
    }

    /// What is wrong with an answer; empty if it is accepted.
    pub fn faults(&self, outcome: &Outcome) -> Vec<String> {
        let names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
        let mut faults = Vec::new();
        if self.unexplained {
            if !names.is_empty() || outcome.verdict != Verdict::Unexplained {
                faults.push("nothing can be named here, and something is left".to_owned());
            }
            return faults;
        }
        if !matches!(outcome.verdict, Verdict::Named | Verdict::Tie) {
            faults.push("nothing is named".to_owned());
        }
        if let Some(first) = names.first().filter(|name| !contains(&self.first, name)) {
            faults.push(format!("{first} comes first"));
        }
        let missing = |any: &&Vec<String>| !any.iter().any(|name| names.contains(&name.as_str()));
        if !names.is_empty() {
            let lacks = self.needed.iter().filter(missing);
            faults.extend(lacks.map(|any| format!("lacks {}", any.join(" or "))));
        }
        let wrong = names.iter().filter(|name| contains(&self.wrong, name));
        faults.extend(wrong.map(|name| format!("{name} is wrong here")));
        // Fits are read with one decimal.
        let fit = outcome.holdout.fit_percent_after;
        if fit < self.fit_percent - 0.05 {
            faults.push(format!("fit {fit:.1} %, wanted {:.1}", self.fit_percent));
        }
        faults
    }
}

fn contains(names: &[String], name: &str) -> bool {
    names.iter().any(|other| other == name)
}

/// A folder with an `expect.toml`.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Its name: that of the folder.
    pub name: String,
    /// The folder.
    pub folder: PathBuf,
    /// What is known of it.
    pub expectation: Expectation,
}

impl Rig {
    /// The rigs of a folder, in the order of their names; the folder itself may be one.
    pub fn all(folder: &Path) -> Result<Vec<Self>, InputError> {
        if folder.join("expect.toml").is_file() {
            return Ok(vec![Self::open(folder)?]);
        }
        let none = "none of its folders has an expect.toml (docs/measured-data.md describes it)";
        below(folder, "expect.toml", none)?.iter().map(|folder| Self::open(folder)).collect()
    }

    /// The rigs of a folder of which nothing need be known: a model, a log and a held-out record are enough.
    pub fn with_models(folder: &Path) -> Result<Vec<Self>, InputError> {
        let open = |folder: &PathBuf| match folder.join("expect.toml").is_file() {
            true => Self::open(folder),
            false => Ok(Self::named(folder, Expectation::nothing())),
        };
        below(folder, "model.toml", "none of its folders has a model.toml")?.iter().map(open).collect()
    }

    fn open(folder: &Path) -> Result<Self, InputError> {
        Ok(Self::named(folder, Expectation::read(&folder.join("expect.toml"))?))
    }

    fn named(folder: &Path, expectation: Expectation) -> Self {
        let name = folder.file_name().unwrap_or(folder.as_os_str());
        Self { name: name.to_string_lossy().into_owned(), folder: folder.to_owned(), expectation }
    }

    /// A file of the rig: in its folder, or in the folder of measured data.
    pub fn file(&self, relative: &Path, data: Option<&Path>) -> Option<PathBuf> {
        let places = [Some(self.folder.as_path()), data];
        places.into_iter().flatten().map(|place| place.join(relative)).find(|path| path.is_file())
    }
}

/// The folders in a folder that hold an expectation or such a file, in the order of their names.
fn below(folder: &Path, file: &str, none: &str) -> Result<Vec<PathBuf>, InputError> {
    let entries = std::fs::read_dir(folder).map_err(|error| InputError::file(folder.display(), error))?;
    let is_rig = |path: &PathBuf| ["expect.toml", file].iter().any(|file| path.join(file).is_file());
    let mut rigs: Vec<PathBuf> = entries.filter_map(|it| Some(it.ok()?.path())).filter(is_rig).collect();
    rigs.sort();
    if rigs.is_empty() {
        return Err(InputError::file(folder.display(), format!("holds no rig: {none}")));
    }
    Ok(rigs)
}
