//! Tables as JSON: records in a list or line by line, columns by name, or names and rows apart, as pandas writes them.

use super::cells::{Cells, Column, Place};
use super::source::{Bytes, Source};
use super::stream::MARK;
use super::text::number;
use crate::text::input_error::InputError;
use indexmap::IndexMap;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Deserializer;

/// How the names of such files end.
const ENDINGS: [&str; 3] = [".json", ".jsonl", ".ndjson"];

/// Tables as JSON.
pub struct Json;

/// Names and what stands behind them, in the order of the file.
type Object = IndexMap<String, Value>;

/// A value of JSON.
#[derive(Deserialize)]
#[serde(untagged)]
enum Value {
    Number(f64),
    Word(Option<String>),
    Flag(bool),
    List(Vec<Value>),
    Object(Object),
}

impl Value {
    /// What a cell of a text would hold.
    fn cell(&self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Word(word) => word.clone().unwrap_or_default(),
            Self::Flag(flag) => flag.to_string(),
            Self::List(_) => "[…]".into(),
            Self::Object(_) => "{…}".into(),
        }
    }

    fn is_nested(&self) -> bool {
        matches!(self, Self::List(_) | Self::Object(_))
    }
}

impl Source for Json {
    /// Where the name does not say it, lines of JSON among other lines are left to the reader of texts.
    fn takes(&self, name: &str, head: &[u8]) -> bool {
        let head = String::from_utf8_lossy(head);
        let text = head.trim_start_matches(MARK).trim_start();
        let opens = |text: &str| text.trim_start().starts_with(['{', '[']);
        let behind_name = |text: &str| text.split_once(':').is_some_and(|parted| opens(parted.1));
        let nested = match text.strip_prefix('[') {
            Some(inside) => inside.trim_start().starts_with('{'),
            None => text.strip_prefix('{').is_some_and(behind_name),
        };
        let by_line =
            text.split_once('\n').is_some_and(|(line, _)| serde_json::from_str::<IgnoredAny>(line).is_ok());
        let named = ENDINGS.iter().any(|ending| name.to_lowercase().ends_with(ending));
        opens(text) && named || nested && !by_line
    }

    fn table(&self, bytes: &dyn Bytes) -> Result<Cells, InputError> {
        let wrong = |what: String| InputError::file(bytes.name(), what);
        let unreadable = |error| InputError::unreadable(bytes.name(), error);
        let mut reader = bytes.open().map_err(unreadable)?;
        if reader.fill_buf().map_err(unreadable)?.starts_with("\u{feff}".as_bytes()) {
            reader.consume(MARK.len_utf8());
        }
        let (mut table, mut layout, mut cut) = (Table::default(), "records line by line", "");
        for value in Deserializer::from_reader(reader).into_iter() {
            match value {
                Ok(Value::Object(record)) if !record.values().all(Value::is_nested) => table.push(record),
                Ok(document) if table.rows == 0 => (table, layout) = Table::of(document).map_err(wrong)?,
                Ok(_) => return Err(wrong(format!("record {} holds no cells", table.rows + 1))),
                Err(error) if error.is_eof() && table.rows > 0 => {
                    cut = ", without its last record, which is cut";
                    break;
                }
                Err(error) => return Err(wrong(format!("is broken as JSON: {error}; write it anew"))),
            }
        }
        if table.rows < 2 {
            let what = "holds no table; expected records, or lists of equal length by name, as pandas writes them \
                        (DataFrame.to_json)";
            return Err(wrong(what.into()));
        }
        let rows = table.rows;
        table.columns.values_mut().for_each(|column| filled(column, rows));
        let (header, columns): (Vec<String>, Vec<Column>) = table.columns.into_iter().unzip();
        Ok(Cells {
            units: vec![None; header.len()],
            header,
            head: Place { what: "record", number: 1 },
            rows,
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
    /// A document that holds all of it, and how it is laid out.
    fn of(document: Value) -> Result<(Self, &'static str), String> {
        match document {
            Value::List(records) => Ok((Self::of_records(records)?, "a list of records")),
            Value::Object(rows) if rows.keys().all(|key| key.parse::<u64>().is_ok()) => {
                Ok((Self::of_records(rows.into_values())?, "records by number"))
            }
            Value::Object(mut parts) => match (parts.swap_remove("columns"), parts.swap_remove("data")) {
                (Some(Value::List(names)), Some(Value::List(rows))) => {
                    Ok((Self::of_rows(&names, rows)?, "names and rows apart"))
                }
                (None, None) => Ok((Self::of_columns(parts)?, "columns by name")),
                _ => Err("has `columns` or `data` without the other".into()),
            },
            _ => Ok(Default::default()),
        }
    }

    fn of_records(records: impl IntoIterator<Item = Value>) -> Result<Self, String> {
        let mut table = Self::default();
        for record in records {
            match record {
                Value::Object(record) => table.push(record),
                _ => return Err(format!("record {} has no names", table.rows + 1)),
            }
        }
        Ok(table)
    }

    fn of_rows(names: &[Value], rows: Vec<Value>) -> Result<Self, String> {
        let mut table = Self::default();
        for row in rows {
            match row {
                Value::List(cells) if cells.len() == names.len() => {
                    table.push(names.iter().map(Value::cell).zip(cells));
                }
                _ => {
                    let (record, width) = (table.rows + 1, names.len());
                    return Err(format!("record {record} does not hold {width} cells, as `columns` does"));
                }
            }
        }
        Ok(table)
    }

    fn of_columns(columns: Object) -> Result<Self, String> {
        let mut table = Self::default();
        for (name, values) in columns {
            let values: Vec<Value> = match values {
                Value::List(values) => values,
                Value::Object(values) => values.into_values().collect(),
                _ => Vec::new(),
            };
            if !table.columns.is_empty() && values.len() != table.rows {
                let (own, rows) = (values.len(), table.rows);
                return Err(format!(
                    "record {}: `{name}` has {own} values, others have {rows}",
                    own.min(rows) + 1
                ));
            }
            table.rows = values.len();
            let column = table.columns.entry(name).or_default();
            values.iter().for_each(|value| column.push(&value.cell(), number));
        }
        Ok(table)
    }

    fn push(&mut self, record: impl IntoIterator<Item = (String, Value)>) {
        for (name, value) in record {
            let column = self.columns.entry(name).or_default();
            filled(column, self.rows);
            column.push(&value.cell(), number);
        }
        self.rows += 1;
    }
}
