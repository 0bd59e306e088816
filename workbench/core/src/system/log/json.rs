//! Tables as JSON: records in a list or line by line, columns by name, or names and rows apart, as pandas writes them.

use super::cells::{Cells, Column, Place};
use super::source::{Bytes, Source};
use super::text::number;
use crate::text::input_error::InputError;
use indexmap::IndexMap;
use serde::Deserialize;
use serde_json::{Deserializer, Number};

/// How the names of such files end.
const ENDINGS: [&str; 3] = [".json", ".jsonl", ".ndjson"];

/// What is said of a file in which no table is found.
const NO_TABLE: &str = "holds no table; expected records, or lists of equal length by name, as pandas writes them \
                        (DataFrame.to_json)";

/// Tables as JSON.
pub struct Json;

/// A value of JSON. Names stay in the order of the file. A number is of a type of `serde_json`: with its feature
/// `arbitrary_precision`, which other crates may switch on, `f64` is not found among several types.
#[derive(Deserialize)]
#[serde(untagged)]
enum Value {
    Number(Number),
    Word(Option<String>),
    Flag(bool),
    List(Vec<Value>),
    Object(IndexMap<String, Value>),
}

impl Value {
    /// What a cell of a text would hold.
    fn cell(&self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Word(word) => word.clone().unwrap_or_default(),
            Self::Flag(flag) => flag.to_string(),
            Self::List(_) | Self::Object(_) => "[…]".into(),
        }
    }

    /// Is it a record, not a table of lists or objects?
    fn has_cells(&self) -> bool {
        let nested = |value: &Self| matches!(value, Self::List(_) | Self::Object(_));
        matches!(self, Self::Object(members) if !members.values().all(nested))
    }

    /// What it holds, without names.
    fn members(self) -> Vec<Self> {
        match self {
            Self::List(members) => members,
            Self::Object(members) => members.into_values().collect(),
            _ => Vec::new(),
        }
    }
}

impl Source for Json {
    fn takes(&self, name: &str, head: &[u8]) -> bool {
        let opens = head.trim_ascii_start().starts_with(b"{") || head.trim_ascii_start().starts_with(b"[");
        opens && ENDINGS.iter().any(|ending| name.to_lowercase().ends_with(ending))
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let wrong = |what: String| InputError::file(bytes.name, what);
        let reader = (bytes.open)().map_err(|error| InputError::unreadable(bytes.name, error))?;
        let (mut table, mut layout, mut cut) = (Table::default(), "records line by line", "");
        for document in Deserializer::from_reader(reader).into_iter::<Value>() {
            match document {
                Ok(record) if record.has_cells() => table.add(record, &[]).map_err(wrong)?,
                Ok(document) if table.rows == 0 => layout = table.take(document).map_err(wrong)?,
                Ok(_) => return Err(wrong("holds more than one table; keep one a file".into())),
                Err(error) if error.is_eof() && table.rows > 0 => cut = ", without a last record that is cut",
                Err(error) => return Err(wrong(format!("is no JSON: {error}; export it once more"))),
            }
        }
        if table.rows < 2 {
            return Err(wrong(NO_TABLE.into()));
        }
        table.columns.values_mut().for_each(|column| filled(column, table.rows));
        let (header, columns): (Vec<String>, Vec<Column>) = table.columns.into_iter().unzip();
        Ok(Cells {
            units: vec![None; header.len()],
            header,
            head: Place { what: "record", number: 1 },
            rows: table.rows,
            written: format!("JSON, {layout}"),
            told: Some(format!("The log is read as JSON, {layout}{cut}.")),
            columns,
            ..Cells::default()
        })
    }
}

/// The columns as they are taken.
#[derive(Default)]
struct Table {
    columns: IndexMap<String, Column>,
    rows: usize,
}

/// A column has nothing in the rows that lack it.
fn filled(column: &mut Column, rows: usize) {
    while column.values.len() < rows {
        column.push("", number);
    }
}

impl Table {
    /// Takes a document that holds all rows, and says how it is laid out.
    fn take(&mut self, document: Value) -> Result<&'static str, String> {
        let (names, rows, layout) = match document {
            Value::Object(mut parts) if ["columns", "data"].iter().all(|part| parts.contains_key(*part)) => {
                let names = parts.swap_remove("columns").map_or(Vec::new(), Value::members);
                let names = names.iter().map(Value::cell).collect();
                (names, parts.swap_remove("data").map_or(Vec::new(), Value::members), "names and rows apart")
            }
            // Records by the number of their row are records as well.
            Value::Object(columns) if !columns.keys().all(|name| name.parse::<u64>().is_ok()) => {
                let (names, columns): (Vec<String>, Vec<_>) =
                    columns.into_iter().map(|(name, column)| (name, column.members())).unzip();
                let rows = columns.iter().map(Vec::len).max().unwrap_or(0);
                let mut columns: Vec<_> = columns.into_iter().map(Vec::into_iter).collect();
                let row = |_| Value::List(columns.iter_mut().filter_map(Iterator::next).collect());
                (names, (0..rows).map(row).collect(), "columns by name")
            }
            records => (Vec::new(), records.members(), "a list of records"),
        };
        rows.into_iter().try_for_each(|row| self.add(row, &names)).map(|()| layout)
    }

    /// Adds a record, or the cells below these names.
    fn add(&mut self, row: Value, names: &[String]) -> Result<(), String> {
        let record: Vec<(String, Value)> = match row {
            Value::Object(record) => record.into_iter().collect(),
            Value::List(cells) if cells.len() == names.len() => names.iter().cloned().zip(cells).collect(),
            _ => return Err(format!("record {} does not hold the cells that others do", self.rows + 1)),
        };
        for (name, value) in record {
            let column = self.columns.entry(name).or_default();
            filled(column, self.rows);
            column.push(&value.cell(), number);
        }
        self.rows += 1;
        Ok(())
    }
}
