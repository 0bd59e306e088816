//! The table of the keys of a model file: what follows from it is as the table says.

use std::fmt::Write as _;
use std::path::Path;
use truing::system::model::table::{self, KEYS, Key, Need};
use truing::system::model::{parse, parse_draft};

const BEGIN: &str = "<!-- keys -->\n";
const END: &str = "<!-- /keys -->";

#[test]
fn the_tables_of_the_documentation_are_those_of_the_reader() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/model.md");
    let text = std::fs::read_to_string(&path).expect("docs/model.md");
    let (before, rest) = text.split_once(BEGIN).expect("the mark at its beginning");
    let (shown, after) = rest.split_once(END).expect("the mark at its end");
    let tables = tables();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{tables}{END}{after}")).expect("written");
        return;
    }
    assert_eq!(shown, tables, "docs/model.md is old: run this test with UPDATE_DOCS=1");
}

fn tables() -> String {
    let mut text = String::new();
    let sections = std::iter::once("").chain(table::sections()).filter(|name| *name != "known");
    for section in sections {
        let title =
            if section.is_empty() { "Outside of sections".to_owned() } else { format!("`[{section}]`") };
        let _ = write!(text, "\n### {title}\n\n");
        if section == "tolerance" {
            tolerance(&mut text);
            continue;
        }
        text.push_str(
            "| key | kinds | unit | range | default | meaning | example |\n|---|---|---|---|---|---|---|\n",
        );
        for row in KEYS.iter().filter(|row| row.section == section) {
            let _ = writeln!(text, "{}", line(row));
        }
    }
    text.push('\n');
    text
}

fn line(row: &Key) -> String {
    let kinds: Vec<String> = row.kinds.iter().map(|kind| format!("`{kind}`")).collect();
    let kinds = if kinds.is_empty() { "all".to_owned() } else { kinds.join(", ") };
    let unit = if row.unit.is_empty() { "–" } else { row.unit };
    format!(
        "| `{}` | {kinds} | {unit} | {} | {} | {} | `{}` |",
        row.name,
        row.range(),
        row.default(),
        row.about,
        row.example
    )
}

fn tolerance(text: &mut String) {
    let _ = write!(
        text,
        "Relative, one standard deviation: 0.05 is 5 %, 1.0 is a number that is not known. The range is ≥ 0, the default of `default` is \
         0.05, that of every other key is `default`. Example: `J_kgm2 = 1.0`.\n\nKeys: {}.\n",
        table::names("tolerance").iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
    );
}

/// A file with one key, beside what its kind needs.
fn with(row: &Key, example: &str) -> String {
    let kind = row.kinds.first().copied().unwrap_or("dc_motor");
    let (mut root, mut model, mut motor, mut other) =
        (String::new(), String::new(), String::new(), String::new());
    if row.name != "schema" {
        root += "schema = \"truing-model/1\"\n";
    }
    if row.name != "kind" {
        let _ = writeln!(model, "kind = \"{kind}\"");
    }
    match row.section {
        "" => root += &format!("{example}\n"),
        "model" => model += &format!("{example}\n"),
        "motor" => motor += &format!("{example}\n"),
        section => other = format!("[{section}]\n{example}\n"),
    }
    format!("{root}[model]\n{model}[motor]\n{motor}{other}")
}

#[test]
fn every_example_is_read_without_a_word() {
    for row in KEYS {
        let text = with(row, row.example);
        let draft =
            parse_draft("model.toml", &text).unwrap_or_else(|error| panic!("{}: {error}\n{text}", row.name));
        let notes = &draft.stated().notes;
        // A window alone says nothing: the file must say where it lies.
        assert!(notes.is_empty() || row.name == "speed_window_s", "{}: {notes:?}", row.name);
    }
}

/// A number that may be unknown is told as unknown, absent or stated, and nothing else is.
#[test]
fn what_may_be_unknown_is_what_a_fit_may_move() {
    for row in KEYS.iter().filter(|row| !row.unit.is_empty()) {
        let text = with(row, &format!("{} = \"unknown\"", row.name));
        let draft = parse_draft("model.toml", &text);
        let unknown = draft.as_ref().is_ok_and(|draft| {
            let constant = |key: &str| if key == "Ke_vs_per_rad" { "Kt_nm_per_a" } else { key }.to_owned();
            draft.unknown().iter().any(|unknown| unknown.key == constant(row.name))
        });
        assert_eq!(unknown, row.has_tolerance(), "{}: {draft:?}", row.name);
        assert_eq!(draft.is_err(), matches!(row.need, Need::Default(_)), "{}: {draft:?}", row.name);
    }
}

#[test]
fn a_command_without_a_log_is_told_every_number_that_is_missing() {
    let text = "schema = \"truing-model/1\"\n[motor]\nR_ohm = \"unknown\"\nL_h = 0.001\n";
    let said = parse("model.toml", text).unwrap_err().to_string();
    for part in [
        "line 3: [motor] R_ohm is \"unknown\"",
        "line 2: [motor] Kt_nm_per_a (or Ke_vs_per_rad) is missing",
        "J_kgm2 is missing",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert_eq!(said.lines().count(), 3, "{said}");
}
