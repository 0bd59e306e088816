//! What a stranger would see in a log before any model is asked: columns, time, answer of the output to the input, and what
//! is missing for a good comparison.

use super::answer::{Answer, Time, answer, smallest_step};
use super::cells::Cells;
use super::column_plan::Plan;
use super::columns::Columns;
use super::dialect::Dialect;
use super::extent::Extent;
use super::meaning::{Meaning, Sure};
use super::names::name_of;
use super::next_time::ask;
use super::open::cells;
use super::read::Sheet;
use super::source::Bytes;
use super::{Log, Reading};
use crate::text::input_error::InputError;
use serde::Serialize;

/// What is seen in a file.
#[derive(Clone, Debug, Serialize)]
pub struct Look {
    /// `truing-look/1`.
    pub schema: &'static str,
    /// The file.
    pub file: String,
    /// Name of the encoding of a text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoding: Option<&'static str>,
    /// What parts the cells of a text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separator: Option<&'static str>,
    /// True: `0,5` is a half.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimal_comma: Option<bool>,
    /// How the file is written, in some words.
    #[serde(skip)]
    pub written: String,
    /// Rows of the table.
    pub rows: usize,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Why the log cannot be read; none if it can, with `columns_argument` where it is not empty.
    pub refused: Option<String>,
    /// What `--columns` has to say; empty where the names say everything.
    pub columns_argument: String,
    /// What speaks for it, and what in it is guessed.
    pub guessed: Vec<String>,
    /// The time.
    pub time: Option<Time>,
    /// How the output answers the input.
    pub answer: Option<Answer>,
    /// How the file was read, in sentences.
    pub notes: Vec<String>,
    /// What would make the next record better, in sentences.
    pub ask: Vec<String>,
    /// The log, if it can be read.
    #[serde(skip)]
    pub log: Option<Log>,
}

/// One column of the file, in its own unit.
#[derive(Clone, Debug, Serialize)]
pub struct Column {
    /// Its name in the file.
    pub name: String,
    /// What it is taken for: a name of ours, or the quantity if the unit is not known.
    pub seems: Option<String>,
    /// Is it read?
    pub state: State,
    /// Least value.
    pub min: Option<f64>,
    /// Greatest value.
    pub max: Option<f64>,
    /// Smallest difference between two values.
    pub step: Option<f64>,
    /// Cells without a number.
    pub empty: usize,
}

/// Is a column read?
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Yes.
    Read,
    /// With `--columns`.
    Proposed,
    /// No.
    Unused,
}

/// Looks at the bytes of a file.
pub fn look(bytes: Bytes, columns: &Columns) -> Result<Look, InputError> {
    let (source, cells) = (bytes.name, cells(bytes)?);
    let plan = columns.plan(source, &cells, true)?;
    let assumed = columns.with(&plan.items)?;
    let seen = (0..cells.header.len()).map(|index| Column::of(&cells, &plan, index)).collect();
    let (rows, dialect) = (cells.rows, cells.dialect.clone());
    let (written, told) = (cells.written.clone(), cells.told.clone());
    let read = || {
        if plan.missing.is_some() {
            plan.complete(source, &cells)?;
        }
        let plan = assumed.plan(source, &cells, true)?;
        Sheet::of(source, cells, plan, &assumed, true).reading()
    };
    let (log, notes, refused) = match read() {
        Ok(Reading { log, notes }) => (Some(log), notes, None),
        Err(error) => (None, told.into_iter().collect(), Some(error.0)),
    };
    let record = if let Some(Log::Dynamic(record)) = &log { Some(record) } else { None };
    let (time, answer) = (record.map(Time::of), record.and_then(answer));
    Ok(Look {
        schema: "truing-look/1",
        file: source.to_owned(),
        encoding: dialect.as_ref().map(|dialect| dialect.encoding),
        separator: dialect.as_ref().map(Dialect::separated_by),
        decimal_comma: dialect.map(|dialect| dialect.decimal_comma),
        written,
        rows,
        columns: seen,
        guessed: plan.proposals.iter().map(|proposal| proposal.why.clone()).collect(),
        columns_argument: if plan.proposals.is_empty() { String::new() } else { plan.items.clone() },
        ask: record.map_or(Vec::new(), |record| ask(record, &plan, Time::of(record), answer)),
        refused,
        time,
        answer,
        notes,
        log,
    })
}

impl Column {
    fn of(cells: &Cells, plan: &Plan, index: usize) -> Self {
        let used = plan.origins.iter().find(|origin| origin.formula.indices().contains(&index));
        let proposed = plan.proposals.iter().find(|proposal| proposal.column == Some(index));
        let extent = Extent::of(cells.values(index));
        let seems = used.map(|origin| name_of(origin.quantity, origin.unit).to_owned());
        let seems = seems
            .or_else(|| proposed.and_then(|proposal| proposal.item.split('=').next()).map(str::to_owned));
        Self {
            name: cells.header[index].clone(),
            seems: seems.or_else(|| plan.meanings[index].map(|meaning| meaning.in_words())),
            state: match used {
                Some(_) => State::Read,
                None => proposed.map_or(State::Unused, |_| State::Proposed),
            },
            min: extent.map(|extent| extent.min),
            max: extent.map(|extent| extent.max),
            step: smallest_step(cells.values(index).iter().copied()),
            empty: cells.columns[index].empty,
        }
    }
}

impl Meaning {
    /// For the table of columns.
    fn in_words(self) -> String {
        match self.quantity {
            Some((quantity, factor)) if self.sure != Sure::Likely => name_of(quantity, factor).to_owned(),
            Some((quantity, factor)) => format!("{}?", name_of(quantity, factor)),
            None => format!("{:?}?", self.topic).to_lowercase(),
        }
    }
}
