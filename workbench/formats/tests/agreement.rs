//! Value by value what the field's own readers find: `reference/make.py` wrote the files and what is in them.

mod files;

use files::{REFERENCE, cells, names};
use serde_json::Value;
use std::collections::BTreeMap;

/// What a cell holds after the other reader: nothing, a number, or one that is not finite.
fn expected(cell: &Value) -> f64 {
    match cell {
        Value::Number(number) => number.as_f64().unwrap(),
        Value::String(word) => word.parse().unwrap(),
        _ => f64::NAN,
    }
}

fn same(ours: f64, theirs: f64) -> bool {
    ours == theirs || ours.is_nan() && theirs.is_nan()
}

#[test]
fn every_value_is_that_of_the_formats_own_reader() {
    let mut values = 0;
    for name in names() {
        let Ok(text) = std::fs::read_to_string(format!("{REFERENCE}/{name}.json")) else { continue };
        let theirs: BTreeMap<String, Vec<Value>> = serde_json::from_str(&text).unwrap();
        let cells = cells(&name);
        let ours: Vec<&String> = cells.header.iter().collect();
        let mut sorted = ours.clone();
        sorted.sort();
        assert_eq!(sorted, theirs.keys().collect::<Vec<_>>(), "{name}");
        for (column, values_of) in cells.header.iter().zip(&cells.columns) {
            let wanted = &theirs[column];
            assert_eq!(values_of.values.len(), wanted.len(), "{name}, {column}");
            for (row, (value, cell)) in values_of.values.iter().zip(wanted).enumerate() {
                assert!(same(*value, expected(cell)), "{name}, {column}, row {row}: {value} and {cell}");
                values += 1;
            }
        }
    }
    assert!(values > 10_000, "{values} values compared");
}

#[test]
fn an_empty_cell_is_counted_and_an_infinite_one_is_refused() {
    for name in ["kinds.parquet", "kinds.feather"] {
        let cells = cells(name);
        let column = &cells.columns[cells.header.iter().position(|column| column == "f64").unwrap()];
        assert_eq!(column.empty, 1);
        assert_eq!(column.hole, Some((5, "nan".into())));
        assert_eq!(column.refused, Some((9, "inf".into())));
    }
}

#[test]
fn how_a_file_was_read_is_told() {
    for (name, told) in [
        ("lerobot.parquet", "The log is read as Parquet."),
        ("kinds.parquet", "Seconds since the first row: `stamp`."),
        ("kinds.feather", "Left out, because they hold no numbers of a log: `image`."),
        ("times.parquet", "`many`"),
        ("json.mcap", "Left out: `/camera`, its messages are written as protobuf."),
        ("joints.mcap", "The time is that of the messages' own headers"),
        ("mixed.mcap", "no stamp of their own have `/command`, `/everything`."),
        ("motors.mat", "Left out, because they are no vectors of 50 numbers: `title`"),
        ("drive.wpilog", "Left out, because they hold no plain numbers: `pose`."),
        ("arm.json", "Runs: 0 fast-backward, 1 fast-forward, 2 slow-backward, 3 slow-forward."),
        ("elevator.json", "times 0.1397 m."),
    ] {
        let said = cells(name).told.unwrap();
        assert!(said.contains(told), "{name}: {said}");
    }
}
