//! The folder of results: `units/UNIT/SHA-256-OF-THE-LOG.json`, and the model files of which they speak as `models/SHA-256.toml`.
//!
//! A result appears complete or not at all, and holds neither a clock nor an order: the same manifest makes the same bytes.

use crate::moment::Moment;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use truing_core::outcome::Outcome;
use truing_report::report::write_atomically;

/// The schema of a result file.
pub const SCHEMA: &str = "truing-fleet/1";

/// The result from which a task began.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct After {
    /// SHA-256 of its log.
    pub log: String,
    /// SHA-256 of its result file.
    pub result: String,
}

/// What identifies a task and all on which its answer depends.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Key {
    /// `truing-fleet/1`.
    pub schema: String,
    /// The motor's name.
    pub unit: String,
    /// When the log was taken.
    pub at: Moment,
    /// SHA-256 of the log.
    pub log: String,
    /// SHA-256 of the model file.
    pub model: String,
    /// The unit's result whose names were tried first; `None`: there was none. It names its own, and so on: the history of the numbers.
    pub after: Option<After>,
}

/// A result as it is written.
#[derive(Debug, Serialize)]
pub struct Written<'a> {
    /// What it is of.
    #[serde(flatten)]
    pub key: &'a Key,
    /// True if the names of the result before explain this log to its floor, and either no number moved or a search came to the same names.
    pub unchanged: bool,
    /// `truing-gap/1`. Its `runtime_s` is 0: nobody took the time.
    pub outcome: &'a Outcome,
}

/// A result as it is read.
#[derive(Clone, Debug, Deserialize)]
pub struct Kept {
    /// What it is of.
    #[serde(flatten)]
    pub key: Key,
    /// See [`Written::unchanged`].
    pub unchanged: bool,
    /// What fleets need of the outcome.
    pub outcome: Told,
}

/// What fleets need of an outcome.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Told {
    /// `named`, `tie`, `nothing_missing`, `unexplained`, `insufficient_excitation` or `data`.
    pub verdict: String,
    /// The named effects.
    pub effects: Vec<Effect>,
    /// Explanations that could not be told apart.
    #[serde(default)]
    pub ties: Vec<Rivals>,
    /// Numbers of the model file that moved within their tolerances.
    pub within_tolerance: Vec<Shifted>,
}

/// A named effect.
#[derive(Clone, Debug, Deserialize)]
pub struct Effect {
    /// Its name in the library.
    pub name: String,
    /// Its numbers.
    pub parameters: BTreeMap<String, Number>,
}

/// A number with one standard deviation and its unit.
#[derive(Clone, Debug, Deserialize)]
#[allow(missing_docs)] // As in `truing-gap/1`.
pub struct Number {
    pub value: Option<f64>,
    pub std: Option<f64>,
    pub unit: String,
}

/// Sets of names of which any explains the log.
#[derive(Clone, Debug, Deserialize)]
#[allow(missing_docs)] // As in `truing-gap/1`.
pub struct Rivals {
    pub rivals: Vec<Vec<String>>,
}

/// A number of the model file that moved, in per cent.
#[derive(Clone, Debug, Deserialize)]
#[allow(missing_docs)] // As in `truing-gap/1`.
pub struct Shifted {
    pub parameter: String,
    pub shift_percent: Option<f64>,
    pub std_percent: Option<f64>,
}

impl Told {
    /// What fleets need of an outcome, as it will be read.
    pub fn of(outcome: &Outcome) -> Result<Self> {
        let written = serde_json::to_value(outcome).context("the result cannot be serialised")?;
        serde_json::from_value(written).context("the result cannot be read back")
    }

    /// True if the log was good enough to be judged.
    pub fn judged(&self) -> bool {
        !matches!(self.verdict.as_str(), "data" | "insufficient_excitation")
    }

    /// True if the names explain the log to its floor.
    pub fn explained(&self) -> bool {
        matches!(self.verdict.as_str(), "named" | "tie" | "nothing_missing")
    }

    /// The names, in order of the alphabet.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.effects.iter().map(|effect| effect.name.as_str()).collect();
        names.sort_unstable();
        names
    }
}

/// SHA-256 of some bytes, in hexadecimal digits.
pub fn digest(bytes: &[u8]) -> String {
    hexadecimal(Sha256::new_with_prefix(bytes))
}

/// SHA-256 of a file, which is never in memory as a whole.
pub fn digest_of(path: &Path) -> Result<String> {
    let unreadable = || format!("{}: cannot be read; check the path", path.display());
    let mut file = fs::File::open(path).with_context(unreadable)?;
    let (mut sum, mut chunk) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut chunk).with_context(unreadable)? {
            0 => return Ok(hexadecimal(sum)),
            count => sum.update(&chunk[..count]),
        }
    }
}

fn hexadecimal(sum: Sha256) -> String {
    sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A name that can be a folder's: letters, digits, `.`, `_` and `-`, no dot in front.
pub fn unit_name(name: &str) -> Result<&str, String> {
    let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    match !name.is_empty() && !name.starts_with('.') && name.chars().all(good) {
        true => Ok(name),
        false => Err(format!(
            "`{name}` is no name of a unit: use letters, digits, `.`, `_` and `-`, no dot in front"
        )),
    }
}

/// A folder of results.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// The store in a folder, which need not exist.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    fn unit(&self, unit: &str) -> PathBuf {
        self.folder.join("units").join(unit)
    }

    /// Writes a result.
    pub fn write(&self, result: &Written) -> Result<()> {
        let text = serde_json::to_string_pretty(result).context("the result cannot be serialised")? + "\n";
        write_atomically(&self.unit(&result.key.unit).join(format!("{}.json", result.key.log)), &text)
    }

    /// Keeps a model file beside the results that speak of it.
    pub fn keep_model(&self, digest: &str, text: &str) -> Result<()> {
        let path = self.folder.join("models").join(format!("{digest}.toml"));
        if path.exists() { Ok(()) } else { write_atomically(&path, text) }
    }

    /// The results of a unit in the order of time, each with the SHA-256 of its file.
    pub fn of_unit(&self, unit: &str) -> Result<Vec<(Kept, String)>> {
        let files =
            listed(&self.unit(unit))?.into_iter().filter(|path| path.extension() == Some("json".as_ref()));
        let mut results: Vec<(Kept, String)> = files.map(|path| read(&path)).collect::<Result<_>>()?;
        results.sort_by_key(|(kept, _)| kept.key.at);
        Ok(results)
    }

    /// All units in the order of their names, with their results in the order of time.
    pub fn all(&self) -> Result<Vec<(String, Vec<Kept>)>> {
        let folders = listed(&self.folder.join("units"))?.into_iter().filter(|path| path.is_dir());
        let names = folders.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()));
        let unit = |name: String| {
            let results = self.of_unit(&name)?.into_iter().map(|(kept, _)| kept).collect();
            Ok((name, results))
        };
        names.map(unit).collect()
    }
}

/// What is in a folder, sorted; nothing where there is none.
fn listed(folder: &Path) -> Result<Vec<PathBuf>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let unreadable = || format!("{}: cannot be read; check its permissions", folder.display());
    let entries = fs::read_dir(folder).with_context(unreadable)?;
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>().with_context(unreadable)?;
    paths.sort();
    Ok(paths)
}

fn read(path: &Path) -> Result<(Kept, String)> {
    let bytes = fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let kept = serde_json::from_slice(&bytes)
        .with_context(|| format!("{}: is no {SCHEMA} result; remove it and run again", path.display()))?;
    Ok((kept, digest(&bytes)))
}
