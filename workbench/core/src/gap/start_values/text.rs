//! The text of a model file with the numbers that were not known, each with the reason behind it.

use super::split::Split;
use super::{MEASURED, WIDE};
use crate::system::model::{Draft, table};
use toml_edit::{DocumentMut, Item, Table, value};

/// Behind a time constant that stands in for one.
pub const GUESSED: &str = "a guess: settled speeds do not show it";
/// What a measured current shows.
const WINDING: [&str; 2] = ["R_ohm", "Kt_nm_per_a"];
/// Behind a number that was not known.
pub const START: &str = "from the log, fitted with a wide prior";
/// Behind one that the log does not show.
const UNSEEN: &str = "the log does not show it";

/// The same from voltage, current and speed.
const FROM_CURRENT: &str = "estimated from the measured current";

/// The file with every number.
pub fn completed(draft: &Draft, split: &Split) -> String {
    let stated = draft.stated();
    let mut document: DocumentMut = stated.source_text.parse().expect("it has been read");
    if let Some(kind) = split.kind {
        put(&mut document, "model", "kind", value(kind), "the log does not tell R, Kt and J apart");
    }
    if split.fit && !has(&document, "model", "fitted_to_log") {
        put(&mut document, "model", "fitted_to_log", value(true), "every number is the log's own");
    }
    for (key, number) in &split.numbers {
        let section = section_of(&document, key);
        let measured = split.measured_winding && WINDING.contains(key);
        let (origin, tolerance) = match (measured, *key) {
            (true, _) => (FROM_CURRENT, MEASURED),
            (false, "time_constant_s") if split.guessed => (GUESSED, WIDE),
            (false, _) if *number == 0.0 => (UNSEEN, WIDE),
            (false, _) => (START, WIDE),
        };
        put(&mut document, &section, key, value(crate::text::figures::rounded(*number, 3)), origin);
        if !split.fit && !stated.tolerances.contains_key(*key) {
            put(&mut document, "tolerance", key, value(tolerance), "not known before");
        }
    }
    document.to_string()
}

fn has(document: &DocumentMut, section: &str, key: &str) -> bool {
    document.get(section).and_then(|it| it.get(key)).is_some()
}

/// Where a key stands, or belongs.
fn section_of(document: &DocumentMut, key: &str) -> String {
    let own = || table::KEYS.iter().find(|row| row.name == key).map_or("motor", |row| row.section);
    table::BASE.into_iter().find(|section| has(document, section, key)).unwrap_or_else(own).to_owned()
}

/// Sets a key with a comment behind it.
fn put(document: &mut DocumentMut, section: &str, key: &str, mut item: Item, comment: &str) {
    if let Some(value) = item.as_value_mut() {
        value.decor_mut().set_suffix(format!(" # {comment}"));
    }
    let table = document.entry(section).or_insert_with(|| Item::Table(Table::new()));
    if let Some(table) = table.as_table_mut() {
        table.insert(key, item);
    }
}
