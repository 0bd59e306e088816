//! The Python package of the workbench: what the command line does, for tables in memory.
//!
//! Every function takes the arguments of a subcommand as the command line would, and names of logs with what they stand
//! for. So both read, examine and search alike, and their results are the same bytes.

mod given;
mod search;

use clap::Args;
use given::{Given, Logs};
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;
use truing::cli::{gap, look, simulate, start};
use truing::export::made::{Beside, Made};
use truing::export::{commands::export, import};
use truing::fleet::{check::check, manifest::Task, store::Store};
use truing::report::{Exporter, html::Html, json::Json, model_file::ModelFile, terminal::Terminal};
use truing::synthetic::cases;
use truing::system::effects::LIBRARY;
use truing::system::log::{Columns, Dynamic, Log};
use truing::system::model::{self, Model};

create_exception!(
    truing,
    InputError,
    PyValueError,
    "A model, a log or an argument that cannot be used: what is wrong, where, and what mends it."
);

/// What goes wrong is told as the command line tells it.
fn refused(error: impl Into<anyhow::Error>) -> PyErr {
    InputError::new_err(format!("{:#}", error.into()))
}

/// The arguments of a subcommand.
fn arguments<A: Args>(words: Vec<String>) -> PyResult<A> {
    let command = A::augment_args(clap::Command::new("truing").no_binary_name(true).disable_help_flag(true));
    let parsed = command.try_get_matches_from(words).and_then(|matches| A::from_arg_matches(&matches));
    parsed.map_err(|error| {
        let text = error.to_string();
        let sentence = text.strip_prefix("error: ").unwrap_or(&text).split("\n\n").next().unwrap_or(&text);
        InputError::new_err(sentence.trim().to_owned())
    })
}

/// A model: what messages call it, and its text.
type ModelText = (String, String);

/// Compares a model with a log: JSON, page, extended model, text for a terminal.
#[pyfunction]
fn gap_(
    py: Python<'_>,
    words: Vec<String>,
    model: ModelText,
    logs: Vec<(String, Given)>,
    call: String,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String, String, String)> {
    let arguments: gap::Arguments = arguments(words)?;
    let draft = model::parse_draft(&model.0, &model.1).map_err(refused)?;
    let subtitle = format!("{} against {}", model.0, arguments.log.display());
    let origin = arguments.log.display().to_string();
    let (model, outcome) = search::run(py, arguments, draft, Logs::of(logs), progress)?;
    let html = Html { subtitle: &subtitle, command: &call };
    let extended = ModelFile { original: &model.source_text, origin: &origin };
    let texts =
        [Json.export(&outcome), html.export(&outcome), extended.export(&outcome), Terminal.export(&outcome)];
    let [json, html, extended, text] = texts.map(|text| text.map_err(refused));
    Ok((json?, html?, extended?, text?))
}

/// What is seen in a log, as JSON.
#[pyfunction]
fn look_(words: Vec<String>, model: Option<ModelText>, log: (String, Given)) -> PyResult<String> {
    let arguments: look::Arguments = arguments(words)?;
    let draft = model.map(|(name, text)| model::parse_draft(&name, &text)).transpose().map_err(refused)?;
    let columns = arguments.rows.read(draft.as_ref().map(model::Draft::stated)).map_err(refused)?;
    let look = Logs::of(vec![log]).look(&arguments.file, &columns).map_err(refused)?;
    serde_json::to_string(&look).map_err(refused)
}

/// A model file and its notes, from a log and what is printed on a motor.
#[pyfunction]
fn start_(words: Vec<String>, log: Option<(String, Given)>) -> PyResult<(String, Vec<String>)> {
    let arguments: start::Arguments = arguments(words)?;
    let columns = arguments.rows.read(None).map_err(refused)?;
    let logs = Logs::of(log.into_iter().collect());
    let log = arguments.log.as_ref().map(|path| logs.open(path, &columns)).transpose().map_err(refused)?;
    if let complaints @ [_, ..] = &arguments.sheet.complaints()[..] {
        return Err(InputError::new_err(complaints.join("; ")));
    }
    let made = start::Made::from(&arguments, log.as_ref().map(|reading| &reading.log)).map_err(refused)?;
    Ok((made.text, made.notes))
}

/// The simulated record, as CSV.
#[pyfunction]
fn simulate_(py: Python<'_>, columns: String, model: ModelText, input: (String, Given)) -> PyResult<String> {
    let model = model::parse(&model.0, &model.1).map_err(refused)?;
    let record = record(&model, input, &columns).map_err(refused)?;
    Ok(py.detach(|| simulate::simulated(&model, &record)))
}

/// The rows of a log that drive a model.
fn record(model: &Model, input: (String, Given), columns: &str) -> anyhow::Result<Dynamic> {
    let columns = Columns::of(columns, model)?;
    let path = PathBuf::from(&input.0);
    match Logs::of(vec![input]).input(&path, &columns)? {
        Log::Dynamic(record) => Ok(record),
        Log::Table(_) => anyhow::bail!("{}: has no time column; a simulation needs t_s", path.display()),
    }
}

/// An export: the file, those beside it, what is lost.
type Exported = (Vec<u8>, Beside, Vec<String>);

/// A model as a file of another program.
#[pyfunction]
fn export_(words: Vec<String>, model: ModelText, log: Option<(String, Given)>) -> PyResult<Exported> {
    let arguments: export::Arguments = arguments(words)?;
    let model = model::parse(&model.0, &model.1).map_err(refused)?;
    let log = log.map(|log| record(&model, log, &arguments.columns)).transpose().map_err(refused)?;
    let made = Made::of(&model, &arguments.request(log.as_ref())).map_err(refused)?;
    Ok((made.file, made.beside, made.lost))
}

/// A nominal model out of the text of an MJCF or URDF file.
#[pyfunction]
fn import_(name: &str, text: &str) -> PyResult<String> {
    import::model(name, text).map_err(refused)
}

/// The library of effects, as JSON.
#[pyfunction]
fn effects_() -> String {
    let parameter = |p: &truing::system::effects::Parameter| serde_json::json!({"name": p.name, "unit": p.unit, "default": p.default});
    let effect = |effect: &&truing::system::effects::Effect| {
        serde_json::json!({
            "name": effect.name, "summary": effect.summary, "equation": effect.equation,
            "parameters": effect.parameters.iter().map(parameter).collect::<Vec<_>>(),
            "signature": effect.signature, "separated_by": effect.separated_by, "source": effect.source,
            "confusable_with": effect.confusable_with.iter().map(|other| other.name).collect::<Vec<_>>(),
        })
    };
    serde_json::Value::from(LIBRARY.iter().map(effect).collect::<Vec<_>>()).to_string()
}

/// A drawn case: model, log and held-out log as texts, the answer as JSON.
#[pyfunction]
fn case_(
    py: Python<'_>,
    set: &str,
    seed: u32,
    rows: usize,
    current: Option<bool>,
) -> PyResult<(String, String, String, String)> {
    let set = <cases::Set as clap::ValueEnum>::from_str(set, false).map_err(InputError::new_err)?;
    let spec = cases::Spec { rows, current, ..cases::Spec::new(set) };
    let case = py.detach(|| cases::draw(&spec, seed));
    let answer = serde_json::to_string(&case.answer).map_err(refused)?;
    Ok((case.model, case.log.to_csv(), case.holdout.to_csv(), answer))
}

/// Judges one log of a fleet: what `truing fleet check` says of it, in a word. Paths: model, log, folder of results.
#[pyfunction]
fn fleet_check_(py: Python<'_>, unit: String, at: &str, paths: [PathBuf; 3]) -> PyResult<String> {
    let ([model, log, into], at) = (paths, at.parse().map_err(InputError::new_err)?);
    let task = Task { unit, at, model, log };
    let done = py.detach(|| check(&task, &Store::new(&into))).map_err(refused)?;
    Ok(format!("{done:?}").to_lowercase())
}

/// A model as TOML, from JSON: a Python dictionary.
#[pyfunction]
fn toml_(json: &str) -> PyResult<String> {
    let value: serde_json::Value = serde_json::from_str(json).map_err(refused)?;
    let table = entry(value).ok_or_else(|| InputError::new_err("the model holds nothing"))?;
    toml::to_string(&table).map_err(refused)
}

/// By hand: where another crate has `serde_json` keep the digits of numbers, they serialise as something else. What is
/// `None` in Python is left out.
fn entry(value: serde_json::Value) -> Option<toml::Value> {
    use serde_json::Value::*;
    Some(match value {
        Null => return None,
        Bool(flag) => flag.into(),
        Number(number) => match number.as_i64() {
            Some(whole) => whole.into(),
            None => number.as_f64()?.into(),
        },
        String(text) => text.into(),
        Array(members) => toml::Value::Array(members.into_iter().filter_map(entry).collect()),
        Object(members) => {
            let member = |(key, value)| Some((key, entry(value)?));
            toml::Value::Table(members.into_iter().filter_map(member).collect())
        }
    })
}

/// What `truing._truing` holds.
#[pymodule]
mod _truing {
    #[pymodule_export]
    use super::{
        InputError, case_, effects_, export_, fleet_check_, gap_, import_, look_, simulate_, start_, toml_,
    };

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name that Python packages have for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
