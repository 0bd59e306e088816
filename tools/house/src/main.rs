//! Prints the figures of the code base: `cargo xtask house`, or `cargo run -p house -- FOLDER` for another checkout.

use anyhow::Result;
use house::arrows::Package;
use house::body;
use house::figures::{Figures, LONG_FILE, functions};
use house::floors::{self, Floors};
use house::parts::Part;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

/// Functions of a part that are named at most.
const LISTED: usize = 5;

fn main() -> Result<()> {
    let root = std::env::args_os().nth(1).map(PathBuf::from);
    let figures = Figures::read(root.as_deref().unwrap_or(house::root()))?;
    let mut lines = parts(&figures);
    lines.extend(long_files(&figures));
    for (folder, package, floors) in figures.packages() {
        lines.extend(rooms(folder, &package, floors));
    }
    match writeln!(std::io::stdout(), "{}", lines.join("\n")) {
        // Nobody reads on.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

fn parts(figures: &Figures) -> Vec<String> {
    let head = "| part | files | code lines | functions | body median / p90 / longest | the longest |";
    let heads = [head.to_owned(), "|---|---|---|---|---|---|".to_owned()];
    let rows = figures.product.iter().chain(&figures.rest).map(row);
    heads.into_iter().chain(rows).collect()
}

fn row(part: &Part) -> String {
    let mut functions = functions(part);
    let spread = body::spread(&functions)
        .map_or("–".into(), |[median, most, longest]| format!("{median} / {most} / {longest}"));
    functions.sort_by_key(|function| std::cmp::Reverse(function.length));
    let longest: Vec<&str> = functions.iter().take(LISTED).map(|one| one.name.as_str()).collect();
    format!(
        "| {} | {} | {} | {} | {spread} | {} |",
        part.name,
        part.sources.len(),
        part.code(),
        functions.len(),
        longest.join(", ")
    )
}

fn long_files(figures: &Figures) -> Vec<String> {
    let long = figures.long_files();
    let head = format!("\nProduct files over {LONG_FILE} lines: {}", long.len());
    let files = long.iter().map(|source| format!("- {} {}", source.path.display(), source.lines));
    std::iter::once(head).chain(files).collect()
}

fn rooms(folder: &str, package: &Package, floors: Floors) -> Vec<String> {
    let names: Vec<&str> = package.rooms.iter().map(String::as_str).collect();
    let arrows = package.arrows.keys().map(|(from, to)| format!("{from} → {to}"));
    let joined = |circles: Vec<Vec<&str>>| circles.iter().map(|circle| circle.join(", ")).collect();
    let lists = [
        ("arrows", arrows.collect()),
        ("upward arrows", floors::upward(package, floors)),
        ("circles between rooms", joined(package.circles())),
        ("circles between files", joined(package.file_circles())),
    ];
    let head = format!("\nRooms of {folder}: {}: {}", names.len(), names.join(", "));
    let lines = lists.into_iter().flat_map(|(what, entries)| list(what, &entries));
    std::iter::once(head).chain(lines).collect()
}

fn list(what: &str, entries: &[String]) -> Vec<String> {
    let head = format!("- {what}: {}", entries.len());
    let entries = entries.iter().map(|entry| format!("  - {entry}"));
    std::iter::once(head).chain(entries).collect()
}
