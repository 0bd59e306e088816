//! Where model and log disagree, and what is missing: what `truing gap` does, on the bytes of files.

use crate::look::SOURCES;
use crate::page;
use serde::Serialize;
use std::io::{BufRead, Result as Read};
use truing_core::gap::{self, Options, examine, time_base};
use truing_core::outcome::{DataFault, NamedEffect, Outcome, Tie};
use truing_core::system::log::{self, Bytes, Columns, Log, Reading, in_shell};
use truing_core::system::model;
use truing_core::text::input_error::InputError;
use truing_report::report::{Exporter, format, html::Html, json::Json, model_file::ModelFile};
use wasm_bindgen::prelude::{JsError, wasm_bindgen};

/// A file that the browser has read.
struct File {
    name: String,
    bytes: Vec<u8>,
}

/// Model, logs and options.
#[wasm_bindgen]
pub struct Task {
    model: File,
    log: File,
    holdouts: Vec<File>,
    columns: String,
    from_s: Option<f64>,
    to_s: Option<f64>,
    accept_data: bool,
}

/// The result.
#[wasm_bindgen(getter_with_clone)]
pub struct Answer {
    /// What the page tells of it.
    pub told: String,
    /// `truing-gap/1`.
    pub json: String,
    /// The report: a page of its own.
    pub report: String,
    /// The extended model, TOML.
    pub model: String,
}

/// What the page tells of a result.
#[derive(Serialize)]
struct Told {
    verdict: &'static str,
    grade: &'static str,
    headline: String,
    effects: Vec<Effect>,
    ties: Vec<String>,
    faults: Vec<[String; 2]>,
    tested: bool,
    signal: String,
    fit_before: String,
    fit_after: String,
    command: String,
}

/// A name with its numbers.
#[derive(Serialize)]
struct Effect {
    name: String,
    numbers: Vec<[String; 2]>,
    evidence: String,
}

#[wasm_bindgen]
impl Task {
    /// A model and a log; the rest as `truing gap` has it without options.
    #[wasm_bindgen(constructor)]
    pub fn new(model_name: String, model: String, log_name: String, log: Vec<u8>) -> Self {
        let model = File { name: model_name, bytes: model.into_bytes() };
        let log = File { name: log_name, bytes: log };
        let (columns, holdouts) = (String::new(), Vec::new());
        Self { model, log, holdouts, columns, from_s: None, to_s: None, accept_data: false }
    }

    /// As `--columns`.
    pub fn columns(&mut self, columns: String) {
        self.columns = columns;
    }

    /// As `--from` and `--to`, s.
    pub fn crop(&mut self, from_s: Option<f64>, to_s: Option<f64>) {
        (self.from_s, self.to_s) = (from_s, to_s);
    }

    /// One more log as `--holdout`.
    pub fn holdout(&mut self, name: String, bytes: Vec<u8>) {
        self.holdouts.push(File { name, bytes });
    }

    /// As `--accept-data`.
    pub fn accept_data(&mut self) {
        self.accept_data = true;
    }

    /// Analyses and reports.
    pub fn run(&self) -> Result<Answer, JsError> {
        let text = String::from_utf8_lossy(&self.model.bytes);
        let draft = model::parse_draft(&self.model.name, &text)?;
        let whole = Columns::of(&self.columns, draft.stated())?;
        let columns = whole.clone().cropped(self.from_s, self.to_s);
        let Reading { log, mut notes } = self.log.read(&columns)?;
        let model = gap::completed(draft, &log)?;
        let holdouts = self.holdouts.iter().map(|file| file.read(&whole));
        let holdouts: Vec<Reading> = holdouts.collect::<Result<_, InputError>>()?;
        notes
            .extend(holdouts.iter().zip(&self.holdouts).flat_map(|(reading, file)| file.own(&reading.notes)));
        let holdouts: Vec<Log> = holdouts.into_iter().map(|reading| reading.log).collect();
        let elsewhere = |fault: &DataFault| fault.place != "t_s";
        if let Log::Dynamic(record) = &log
            && !examine::faults(&model, &log, &[]).iter().any(elsewhere)
        {
            time_base::check(&model, record, &columns)?;
        }
        let (options, began) = (Options { accept_data: self.accept_data, ..Options::default() }, page::now());
        let mut outcome = gap::run(&model, &log, &holdouts, &options, &page::progress)?;
        outcome.runtime_s = 1e-3 * (page::now() - began);
        outcome.notes.splice(0..0, notes);
        self.answer(&outcome, &text).map_err(|error| JsError::new(&format!("{error:#}")))
    }
}

impl File {
    fn read(&self, columns: &Columns) -> Result<Reading, InputError> {
        let open = || -> Read<Box<dyn BufRead + '_>> { Ok(Box::new(self.bytes.as_slice())) };
        log::reading(Bytes { name: &self.name, open: &open, sources: SOURCES }, columns)
    }

    /// Notes that name this file: the others repeat those of the log.
    fn own(&self, notes: &[String]) -> Vec<String> {
        notes.iter().filter(|note| note.starts_with(&self.name)).cloned().collect()
    }
}

impl Task {
    fn answer(&self, outcome: &Outcome, model: &str) -> anyhow::Result<Answer> {
        let command = self.command();
        let subtitle = format!("{} against {}", self.model.name, self.log.name);
        Ok(Answer {
            json: Json.export(outcome)?,
            report: Html { subtitle: &subtitle, command: &command }.export(outcome)?,
            model: ModelFile { original: model, origin: &self.log.name }.export(outcome)?,
            told: serde_json::to_string(&Told::of(outcome, command))?,
        })
    }

    /// The same on a command line.
    fn command(&self) -> String {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+%@".contains(c);
        let word = |text: &str| if text.chars().all(plain) { text.to_owned() } else { in_shell(text) };
        let mut words = vec!["truing gap --model".into(), word(&self.model.name)];
        words.extend(["--log".into(), word(&self.log.name)]);
        if !self.holdouts.is_empty() {
            words.push("--holdout".into());
            words.extend(self.holdouts.iter().map(|file| word(&file.name)));
        }
        if !self.columns.is_empty() {
            words.extend(["--columns".into(), in_shell(&self.columns)]);
        }
        words.extend(self.from_s.map(|from_s| format!("--from {from_s}")));
        words.extend(self.to_s.map(|to_s| format!("--to {to_s}")));
        words.extend(self.accept_data.then(|| "--accept-data".into()));
        words.extend(["--out".into(), "result".into()]);
        words.join(" ")
    }
}

impl Told {
    fn of(outcome: &Outcome, command: String) -> Self {
        let held = &outcome.holdout;
        let tie = |tie: &Tie| format!("{}: {}", format::rivals(tie), tie.separated_by);
        Self {
            verdict: format::verdict(outcome.verdict),
            grade: format::grade(outcome),
            headline: format::headline(outcome),
            effects: outcome.effects.iter().map(Effect::of).collect(),
            ties: outcome.ties.iter().map(tie).collect(),
            faults: outcome.data.iter().map(|it| [format::fault(it), it.remedy.clone()]).collect(),
            tested: outcome.tested(),
            signal: held.signal.clone(),
            fit_before: format::fit(held.fit_percent_before),
            fit_after: format::fit(held.fit_percent_after),
            command,
        }
    }
}

impl Effect {
    fn of(effect: &NamedEffect) -> Self {
        let numbers = format::readable(effect).into_iter();
        let numbers = numbers.map(|(name, value)| [name.clone(), format::value(value)]).collect();
        Self { name: effect.name.clone(), numbers, evidence: effect.evidence.clone() }
    }
}
