//! The table of settings: what follows from it is as the table says.

use servo::config::{Config, SETTINGS, Value};
use servo::store::LAYOUT;
use std::fmt::Write as _;
use std::path::Path;

const BEGIN: &str = "<!-- settings -->\n";
const END: &str = "<!-- /settings -->";

#[test]
fn the_table_of_the_documentation_is_that_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/axis-file.md");
    let text = std::fs::read_to_string(&path).expect("docs/axis-file.md");
    let (before, rest) = text.split_once(BEGIN).expect("the mark at its beginning");
    let (shown, after) = rest.split_once(END).expect("the mark at its end");
    let table = table();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}")).expect("written");
        return;
    }
    assert_eq!(shown, table, "docs/axis-file.md is old: run this test with UPDATE_DOCS=1");
}

fn table() -> String {
    let mut text = String::from("\n| key | unit | range | default | meaning |\n|---|---|---|---|---|\n");
    for row in SETTINGS {
        let default = row.default.unwrap_or("required");
        let unit = if row.unit.is_empty() { "–" } else { row.unit };
        let _ =
            writeln!(text, "| `{}` | {unit} | {} | {default} | {} |", row.field.name(), row.range, row.about);
    }
    text.push('\n');
    text
}

/// The bytes that travel and are stored are those of the rows in their order, whatever the layout that they came in.
#[test]
fn a_stored_configuration_is_read_by_the_rows_of_its_layout() {
    let mut config = Config::EXAMPLE;
    for row in SETTINGS {
        if let Value::None = (row.get)(&config) {
            let _ = (row.set)(&mut config, Value::Number(7.5));
        }
    }
    let bytes = postcard::to_allocvec(&config).expect("bytes");
    let mut rest = &bytes[..];
    assert_eq!(Config::take(LAYOUT, &mut rest, &Config::EXAMPLE), Some(config));
    assert!(rest.is_empty());
}

#[test]
fn no_row_is_newer_than_the_layout_and_rows_are_appended() {
    let since: Vec<u16> = SETTINGS.iter().map(|row| row.since).collect();
    assert!(since.is_sorted(), "{since:?}");
    assert!(since.iter().all(|layout| *layout <= LAYOUT), "{since:?}");
}

#[test]
fn every_value_goes_back_where_it_came_from() {
    let mut other = Config::EXAMPLE;
    for row in SETTINGS {
        let value = (row.get)(&Config::EXAMPLE);
        assert_eq!((row.set)(&mut other, value), Some(()), "{}", row.field.name());
    }
    assert_eq!(other, Config::EXAMPLE);
}

/// Defaults make a configuration that can be built, once the required settings are there.
#[test]
fn defaults_lie_within_their_ranges() {
    let mut config = Config::EXAMPLE;
    for row in SETTINGS {
        assert_eq!(row.default.is_some(), (row.fallback)(&config).is_some());
        if let Some(value) = (row.fallback)(&config) {
            (row.set)(&mut config, value).expect("the type of the setting");
        }
    }
    config.build().expect("within all ranges");
}
