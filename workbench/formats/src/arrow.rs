//! Tables of Arrow in memory: what a Parquet file, an Arrow file or Python holds, as the columns of a log.

use crate::naming::{self, MOST_MEMBERS};
use arrow_array::cast::AsArray;
use arrow_array::types::*;
use arrow_array::{Array, ArrayRef, ArrowPrimitiveType, RecordBatch};
use arrow_schema::{DataType, TimeUnit};
use truing_core::system::log::cells::{Cells, Column};

/// No value stands there.
const NONE: usize = usize::MAX;

/// The columns of these batches, which are one table. Structures become `a.b`, lists `a_0`, `a_1`; times become seconds since
/// their first one, because a stamp in nanoseconds has more digits than a number.
///
/// # Errors
/// A sentence where the batches are no table of at least two rows.
pub fn cells(batches: &[RecordBatch]) -> Result<Cells, String> {
    written(batches, naming::IN_MEMORY, Vec::new())
}

/// The same, from a file of this format.
pub fn written(batches: &[RecordBatch], format: &str, mut told: Vec<String>) -> Result<Cells, String> {
    let Some(schema) = batches.first().map(RecordBatch::schema) else {
        return Err("holds no rows".into());
    };
    if let Some(k) = batches.iter().position(|batch| batch.schema().fields() != schema.fields()) {
        return Err(format!("batch {} has other columns than those before it; keep one table a file", k + 1));
    }
    let mut table = Table::default();
    for (k, field) in schema.fields().iter().enumerate() {
        let parts = batches.iter().map(|batch| Part::all_rows(batch.column(k).clone()));
        table.add(field.name(), parts.collect());
    }
    if !table.clocks.is_empty() {
        let clocks = naming::some_of(&table.clocks);
        told.push(format!("Seconds since the first row: {clocks}."));
    }
    if !table.left_out.is_empty() {
        let left_out = naming::some_of(&table.left_out);
        told.push(format!("Left out, because they hold no numbers of a log: {left_out}."));
    }
    naming::table(table.columns, format, &told)
}

#[derive(Default)]
struct Table {
    columns: Vec<(String, Column)>,
    clocks: Vec<String>,
    left_out: Vec<String>,
}

/// An array, and which of its values each row holds.
struct Part {
    array: ArrayRef,
    at: Vec<usize>,
}

impl Part {
    fn all_rows(array: ArrayRef) -> Self {
        let at = (0..array.len()).map(|row| if array.is_valid(row) { row } else { NONE }).collect();
        Self { array, at }
    }

    /// Another array that holds what this one points to.
    fn within(&self, array: &ArrayRef, place: impl Fn(usize) -> Option<usize>) -> Self {
        let there = |at: &usize| match *at {
            NONE => NONE,
            at => place(at).filter(|at| *at < array.len() && array.is_valid(*at)).unwrap_or(NONE),
        };
        Self { array: array.clone(), at: self.at.iter().map(there).collect() }
    }

    fn numbers<'a, T: ArrowPrimitiveType>(
        &'a self,
        number: impl Fn(T::Native) -> f64 + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        let values = self.array.as_primitive::<T>().values();
        self.at.iter().map(move |at| if *at == NONE { f64::NAN } else { number(values[*at]) })
    }

    /// First value and length of the list at a place.
    fn list(&self, at: usize) -> Option<(usize, usize)> {
        if at == NONE {
            return None;
        }
        let (from, to) = match self.array.data_type() {
            DataType::FixedSizeList(_, size) => (at * *size as usize, (at + 1) * *size as usize),
            DataType::List(_) => {
                let offsets = self.array.as_list::<i32>().value_offsets();
                (offsets[at] as usize, offsets[at + 1] as usize)
            }
            _ => {
                let offsets = self.array.as_list::<i64>().value_offsets();
                (offsets[at] as usize, offsets[at + 1] as usize)
            }
        };
        Some((from, to.saturating_sub(from)))
    }

    fn members(&self) -> &ArrayRef {
        match self.array.data_type() {
            DataType::FixedSizeList(..) => self.array.as_fixed_size_list().values(),
            DataType::List(_) => self.array.as_list::<i32>().values(),
            _ => self.array.as_list::<i64>().values(),
        }
    }
}

impl Table {
    fn add(&mut self, name: &str, parts: Vec<Part>) {
        use DataType::*;
        let Some(kind) = parts.first().map(|part| part.array.data_type().clone()) else { return };
        match &kind {
            Struct(fields) => {
                for (k, field) in fields.iter().enumerate() {
                    let inner = |part: &Part| part.within(part.array.as_struct().column(k), Some);
                    self.add(&format!("{name}.{}", field.name()), parts.iter().map(inner).collect());
                }
            }
            List(_) | LargeList(_) | FixedSizeList(..) => self.list(name, &parts),
            Dictionary(..) => {
                let inner = |part: &Part| {
                    let dictionary = part.array.as_any_dictionary();
                    let keys = if dictionary.values().is_empty() {
                        Vec::new()
                    } else {
                        dictionary.normalized_keys()
                    };
                    part.within(dictionary.values(), |at| keys.get(at).copied())
                };
                self.add(name, parts.iter().map(inner).collect());
            }
            Utf8 | LargeUtf8 | Utf8View => self.columns.push((name.to_owned(), words(&parts, &kind))),
            Timestamp(..) | Date32 | Date64 | Time32(_) | Time64(_) | Duration(_) => {
                self.clocks.push(name.to_owned());
                self.columns.push((name.to_owned(), naming::clock(seconds(&parts, &kind))));
            }
            _ => match numbers(&parts, &kind) {
                Some(values) => self.columns.push((name.to_owned(), naming::column(values))),
                None => self.left_out.push(name.to_owned()),
            },
        }
    }

    fn list(&mut self, name: &str, parts: &[Part]) {
        let lengths = |part: &Part| part.at.iter().filter_map(|at| Some(part.list(*at)?.1)).max();
        let width = parts.iter().filter_map(lengths).max().unwrap_or(0);
        if width == 0 || width > MOST_MEMBERS {
            self.left_out.push(name.to_owned());
            return;
        }
        for k in 0..width {
            let place = |part: &Part, at| part.list(at).filter(|it| k < it.1).map(|it| it.0 + k);
            let inner = parts.iter().map(|part| part.within(part.members(), |at| place(part, at)));
            let name = if width == 1 { name.to_owned() } else { format!("{name}_{k}") };
            self.add(&name, inner.collect());
        }
    }
}

/// Texts, which may be numbers or times of day.
fn words(parts: &[Part], kind: &DataType) -> Column {
    let mut column = Column::default();
    for part in parts {
        for at in &part.at {
            let cell = match (kind, *at) {
                (_, NONE) => "",
                (DataType::Utf8, at) => part.array.as_string::<i32>().value(at),
                (DataType::LargeUtf8, at) => part.array.as_string::<i64>().value(at),
                (_, at) => part.array.as_string_view().value(at),
            };
            column.push(cell.trim(), naming::number);
        }
    }
    column
}

/// Whole and broken numbers, and flags; `None`: it is something else.
fn numbers(parts: &[Part], kind: &DataType) -> Option<Vec<f64>> {
    use DataType::*;
    let mut values = Vec::with_capacity(parts.iter().map(|part| part.at.len()).sum());
    for part in parts {
        match kind {
            Float64 => values.extend(part.numbers::<Float64Type>(|it| it)),
            Float32 => values.extend(part.numbers::<Float32Type>(f64::from)),
            Float16 => values.extend(part.numbers::<Float16Type>(f64::from)),
            Int8 => values.extend(part.numbers::<Int8Type>(f64::from)),
            Int16 => values.extend(part.numbers::<Int16Type>(f64::from)),
            Int32 => values.extend(part.numbers::<Int32Type>(f64::from)),
            Int64 => values.extend(part.numbers::<Int64Type>(|it| it as f64)),
            UInt8 => values.extend(part.numbers::<UInt8Type>(f64::from)),
            UInt16 => values.extend(part.numbers::<UInt16Type>(f64::from)),
            UInt32 => values.extend(part.numbers::<UInt32Type>(f64::from)),
            UInt64 => values.extend(part.numbers::<UInt64Type>(|it| it as f64)),
            Boolean => {
                let flags = part.array.as_boolean();
                let flag = |at: &usize| if *at == NONE { f64::NAN } else { f64::from(flags.value(*at)) };
                values.extend(part.at.iter().map(flag));
            }
            Decimal32(..) => values.extend(decimals::<Decimal32Type>(part)),
            Decimal64(..) => values.extend(decimals::<Decimal64Type>(part)),
            Decimal128(..) => values.extend(decimals::<Decimal128Type>(part)),
            Decimal256(..) => values.extend(decimals::<Decimal256Type>(part)),
            Null => values.resize(values.len() + part.at.len(), f64::NAN),
            _ => return None,
        }
    }
    Some(values)
}

fn decimals<T: DecimalType>(part: &Part) -> impl Iterator<Item = f64> + '_ {
    let array = part.array.as_primitive::<T>();
    // By way of the text, which is rounded once.
    let number = |at: usize| array.value_as_string(at).parse().unwrap_or(f64::NAN);
    part.at.iter().map(move |at| if *at == NONE { f64::NAN } else { number(*at) })
}

/// Times: seconds since the first one. Lengths of time: seconds.
fn seconds(parts: &[Part], kind: &DataType) -> Vec<f64> {
    let (ticks_a_second, from_first) = match kind {
        DataType::Timestamp(unit, _) | DataType::Time32(unit) | DataType::Time64(unit) => {
            (ticks(*unit), true)
        }
        DataType::Duration(unit) => (ticks(*unit), false),
        DataType::Date64 => (1e3, true),
        // Days.
        _ => (1.0 / 86_400.0, true),
    };
    let whole: Vec<Option<i64>> =
        parts.iter().flat_map(|part| part.at.iter().map(|at| stamp(part, *at))).collect();
    let first = whole.iter().flatten().next().copied().filter(|_| from_first).unwrap_or(0);
    let second = |stamp: i64| (i128::from(stamp) - i128::from(first)) as f64 / ticks_a_second;
    whole.into_iter().map(|stamp| stamp.map_or(f64::NAN, second)).collect()
}

fn stamp(part: &Part, at: usize) -> Option<i64> {
    use DataType::*;
    let array = (at != NONE).then_some(&part.array)?;
    Some(match array.data_type() {
        Timestamp(TimeUnit::Second, _) => array.as_primitive::<TimestampSecondType>().value(at),
        Timestamp(TimeUnit::Millisecond, _) => array.as_primitive::<TimestampMillisecondType>().value(at),
        Timestamp(TimeUnit::Microsecond, _) => array.as_primitive::<TimestampMicrosecondType>().value(at),
        Timestamp(TimeUnit::Nanosecond, _) => array.as_primitive::<TimestampNanosecondType>().value(at),
        Time32(TimeUnit::Second) => array.as_primitive::<Time32SecondType>().value(at).into(),
        Time32(_) => array.as_primitive::<Time32MillisecondType>().value(at).into(),
        Time64(TimeUnit::Microsecond) => array.as_primitive::<Time64MicrosecondType>().value(at),
        Time64(_) => array.as_primitive::<Time64NanosecondType>().value(at),
        Duration(TimeUnit::Second) => array.as_primitive::<DurationSecondType>().value(at),
        Duration(TimeUnit::Millisecond) => array.as_primitive::<DurationMillisecondType>().value(at),
        Duration(TimeUnit::Microsecond) => array.as_primitive::<DurationMicrosecondType>().value(at),
        Duration(_) => array.as_primitive::<DurationNanosecondType>().value(at),
        Date64 => array.as_primitive::<Date64Type>().value(at),
        _ => array.as_primitive::<Date32Type>().value(at).into(),
    })
}

fn ticks(unit: TimeUnit) -> f64 {
    match unit {
        TimeUnit::Second => 1.0,
        TimeUnit::Millisecond => 1e3,
        TimeUnit::Microsecond => 1e6,
        TimeUnit::Nanosecond => 1e9,
    }
}
