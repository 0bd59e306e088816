//! Everything that is wrong with a model file, and everything in it that is not used, collected while it is read.

use crate::text::input_error::{InputError, line_of, line_of_key};
use std::cell::RefCell;
use toml::Table;

/// The file, with what has been found in it so far.
pub(super) struct File<'a> {
    pub(super) source: &'a str,
    pub(super) text: &'a str,
    complaints: RefCell<Vec<Complaint>>,
    notes: RefCell<Vec<(u64, String)>>,
}

/// A file with more errors of grammar is none of TOML; nor is one of which more than half of the lines are wrong.
/// Chosen by judgement; not studied.
const MANY: usize = 20;

/// One complaint and its place among the others.
struct Complaint {
    /// The kind of the model decides what the other keys mean, so it is told first.
    of_the_kind: bool,
    line: u64,
    error: InputError,
}

impl<'a> File<'a> {
    pub(super) fn new(source: &'a str, text: &'a str) -> Self {
        Self { source, text, complaints: RefCell::default(), notes: RefCell::default() }
    }

    /// The keys of the file. Every defect of its grammar is told, and then nothing else is looked at.
    pub(super) fn table(&self) -> Result<Table, InputError> {
        let (_, errors) = toml::de::DeTable::parse_recoverable(self.text);
        let lines = self.text.lines().filter(|line| !line.trim().is_empty()).count();
        if errors.len() > MANY || errors.len() > 1.max(lines / 2) {
            let first = self.text.lines().next().unwrap_or_default();
            let begins: String = first.chars().take(40).collect();
            let count = errors.len();
            let what =
                format!("is no model file: {count} lines are not TOML (it begins `{begins}`); is it a log?");
            return Err(InputError::file(self.source, what));
        }
        for error in &errors {
            self.syntax(error);
        }
        let root = self.text.parse::<Table>();
        // What the parser recovers from and the reader of values does not, is told by the latter.
        if let (Err(error), true) = (&root, errors.is_empty()) {
            self.syntax(error);
        }
        self.judged()?;
        root.map_err(|error| InputError::file(self.source, error.message()))
    }

    fn syntax(&self, error: &toml::de::Error) {
        let before = error.span().map_or(0, |span| span.start.min(self.text.len()));
        let here = self.text[before..].lines().next().unwrap_or_default().trim();
        let what = format!("is not valid TOML: {} (at `{here}`)", error.message().replace('\n', " "));
        self.complain(false, line_of(self.text, before), what);
    }

    /// The line of `key` in `[section]`, from the text; of the section where the key is empty; 0 when it is not there.
    pub(super) fn line_of(&self, section: &str, key: &str) -> u64 {
        line_of_key(self.text, section, key)
    }

    /// Something is wrong with a key; with the section where the key is empty.
    pub(super) fn wrong(&self, section: &str, key: &str, what: &str) {
        let place = place(section, key);
        let line = self.line_of(section, key);
        self.complain((section, key) == ("model", "kind"), line, format!("{place} {what}"));
    }

    /// A key is missing: told at the line of its section, unless a misspelled key of it has been told.
    pub(super) fn missing(&self, section: &str, key: &str, what: &str) {
        let said = format!("the nearest is {key}");
        let (begin, complaints) = (format!("[{section}] "), self.complaints.borrow());
        let misspelled =
            |complaint: &Complaint| complaint.error.0.contains(&begin) && complaint.error.0.ends_with(&said);
        let told = complaints.iter().any(misspelled);
        drop(complaints);
        if !told {
            let line = self.line_of(section, "");
            self.complain(false, line, format!("{} is missing; {what}", place(section, key)));
        }
    }

    fn complain(&self, of_the_kind: bool, line: u64, what: String) {
        let error = InputError::line(self.source, line, what);
        self.complaints.borrow_mut().push(Complaint { of_the_kind, line, error });
    }

    /// Something that does not stop a run, and that the reader must know.
    pub(super) fn note(&self, section: &str, key: &str, what: &str) {
        let line = self.line_of(section, key);
        let said = InputError::line(self.source, line, format!("{} {what}", place(section, key)));
        self.notes.borrow_mut().push((line, said.0));
    }

    /// All complaints together, that about the kind first and the others by line.
    pub(super) fn judged(&self) -> Result<(), InputError> {
        let mut complaints = self.complaints.take();
        complaints.sort_by_key(|complaint| (!complaint.of_the_kind, complaint.line));
        InputError::all(complaints.into_iter().map(|complaint| complaint.error).collect())
    }

    /// The notes by line.
    pub(super) fn noted(&self) -> Vec<String> {
        let mut notes = self.notes.take();
        notes.sort();
        notes.into_iter().map(|(_, note)| note).collect()
    }
}

fn place(section: &str, key: &str) -> String {
    match section {
        "" => key.to_owned(),
        _ => format!("[{section}] {key}").trim_end().to_owned(),
    }
}
