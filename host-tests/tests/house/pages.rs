//! The documents stay short, and what follows from other files is as those files say.

use crate::documents::{collect, root, text};
use crate::figures::figures;
use house::body::{self, Function};
use house::figures::functions;
use house::parts::Part;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Most words of all pages in `docs/`; the limit only falls.
const WORDS: usize = 36_000;
/// Folder or page, and most words of all pages in it.
const PARTS: [(&str, usize); 3] =
    [("docs/decisions", 4_100), ("docs/results", 5_000), ("docs/tried.md", 900)];
/// Most decisions, and most words of one of them.
const DECISIONS: [usize; 2] = [25, 150];

fn pages(path: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    if path.ends_with(".md") {
        found.push(PathBuf::from(path));
    } else {
        collect(Path::new(path), &mut found);
    }
    found.sort();
    found
}

fn words(pages: &[PathBuf]) -> usize {
    pages.iter().map(|page| text(page).split_whitespace().count()).sum()
}

#[test]
fn the_documents_stay_short() {
    for (part, most) in PARTS.into_iter().chain([("docs", WORDS)]) {
        let count = words(&pages(part));
        assert!(count <= most, "{part}: {count} words, the limit is {most}");
    }
}

fn decisions() -> Vec<PathBuf> {
    pages("docs/decisions").into_iter().filter(|page| !page.ends_with("README.md")).collect()
}

#[test]
fn decisions_are_few_and_short() {
    let [most, longest] = DECISIONS;
    let decisions = decisions();
    assert!(decisions.len() <= most, "{} decisions, the limit is {most}", decisions.len());
    for page in decisions {
        let count = words(std::slice::from_ref(&page));
        assert!(count <= longest, "{}: {count} words, the limit is {longest}", page.display());
    }
}

#[test]
fn the_index_of_the_decisions_is_that_of_their_titles() {
    let (mut numbers, mut index) = (BTreeSet::new(), String::from("\n"));
    for page in decisions() {
        let name = page.file_name().and_then(|name| name.to_str()).expect("a name");
        let text = text(&page);
        let heading = text.lines().next().expect("a heading");
        let (number, title) =
            heading.trim_start_matches("# ").split_once(": ").expect("a number and a title");
        assert_eq!(number, &name[..4], "{name}: its number is that of its file");
        assert!(numbers.insert(number.to_owned()), "two decisions have the number {number}");
        let _ = writeln!(index, "- [{number}]({name}): {title}");
    }
    index.push('\n');
    holds("docs/decisions/README.md", "index", &index);
}

#[test]
fn cost_tables_are_those_of_the_budget() {
    let budget: toml::Table = toml::from_str(&text(Path::new("docs/cost.toml"))).expect("docs/cost.toml");
    let part = |name: &str| budget[name].as_table().expect("a part");
    let ticks = table(part("instructions"), ", ", &["average", "worst"], "control rate and activity");
    holds("docs/results/cost.md", "instructions", &ticks);
    holds("docs/results/cost.md", "size", &table(part("size"), " ", &["flash", "ram", "stack"], "image"));
}

#[test]
fn the_figures_of_the_map_are_those_of_the_sources() {
    let figures = figures();
    let mut map = String::from("\n| part | lines, k | body |\n|---|---|---|\n");
    let tested = ["tests", "trials", "evaluation", "tools", "xtask"];
    let (tests, doors): (Vec<&Part>, Vec<&Part>) =
        figures.rest.iter().partition(|part| tested.contains(&part.name));
    let rows = figures.product.iter().map(|part| (part.name, vec![part]));
    for (name, parts) in rows.chain([("other crates of `workbench/`", doors), ("tests and tools", tests)]) {
        let lines: usize = parts.iter().map(|part| part.code()).sum();
        let bodies: Vec<Function> = parts.iter().flat_map(|part| functions(part)).collect();
        let [median, most, longest] = body::spread(&bodies).expect("functions");
        let _ = writeln!(map, "| {name} | {:.0} | {median}/{most}/{longest} |", lines as f64 / 1000.0);
    }
    map.push('\n');
    holds("docs/architecture.md", "figures", &map);
}

/// A row for each subject of `figures`, whose keys are a subject, `between` and one of `columns`.
fn table(figures: &toml::Table, between: &str, columns: &[&str], first: &str) -> String {
    let subjects: BTreeSet<&str> =
        figures.keys().filter_map(|key| Some(key.rsplit_once(between)?.0)).collect();
    let mut text =
        format!("\n| {first} | {} |\n|---|{}\n", columns.join(" | "), "---|".repeat(columns.len()));
    for subject in subjects {
        let cell = |column: &&str| {
            figures.get(&format!("{subject}{between}{column}")).map_or("–".into(), ToString::to_string)
        };
        let cells: Vec<String> = columns.iter().map(cell).collect();
        let _ = writeln!(text, "| {subject} | {} |", cells.join(" | "));
    }
    text.push('\n');
    text
}

/// Fails if `page` shows something else than `expected` between its marks `<!-- NAME -->` and `<!-- /NAME -->`; writes it
/// there where `UPDATE_DOCS` is set.
#[track_caller]
fn holds(page: &str, name: &str, expected: &str) {
    let shown = text(Path::new(page));
    let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- /{name} -->"));
    let (before, rest) = shown.split_once(&begin).expect("the mark at its beginning");
    let (now, after) = rest.split_once(&end).expect("the mark at its end");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(root().join(page), format!("{before}{begin}{expected}{end}{after}")).expect("written");
    } else {
        assert_eq!(now, expected, "{page} is old: run this test with UPDATE_DOCS=1");
    }
}
