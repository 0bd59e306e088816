//! Prints the figures of the code base: `cargo xtask house`, or `cargo run -p house -- FOLDER` for another checkout.

use anyhow::Result;
use house::arrows::Package;
use house::body;
use house::figures::{Figures, LONG_FILE, functions};
use house::floors::{self, Floors};
use house::parts::Part;
use std::path::PathBuf;

/// Functions and arrows that a list names at most.
const LISTED: usize = 5;

fn main() -> Result<()> {
    let root = std::env::args_os().nth(1).map(PathBuf::from);
    let figures = Figures::read(root.as_deref().unwrap_or(house::root()))?;
    parts(&figures);
    long_files(&figures);
    for (folder, package, floors) in figures.packages() {
        rooms(folder, package, floors);
    }
    Ok(())
}

fn parts(figures: &Figures) {
    println!("| part | files | code lines | functions | body median / p90 / longest | the longest |");
    println!("|---|---|---|---|---|---|");
    for part in figures.product.iter().chain(&figures.rest) {
        println!("{}", row(part));
    }
}

fn row(part: &Part) -> String {
    let mut functions = functions(part);
    let spread = body::spread(&functions).map_or("–".into(), |[median, most, longest]| {
        format!("{median} / {most} / {longest}")
    });
    functions.sort_by_key(|function| std::cmp::Reverse(function.length));
    let longest: Vec<&str> = functions
        .iter()
        .take(LISTED)
        .map(|one| one.name.as_str())
        .collect();
    format!(
        "| {} | {} | {} | {} | {spread} | {} |",
        part.name,
        part.sources.len(),
        part.code(),
        functions.len(),
        longest.join(", ")
    )
}

fn long_files(figures: &Figures) {
    let long = figures.long_files();
    println!("\nProduct files over {LONG_FILE} lines: {}", long.len());
    for source in long {
        println!("- {} {}", source.path.display(), source.lines);
    }
}

fn rooms(folder: &str, package: &Package, floors: Floors) {
    let names: Vec<&str> = package.rooms.iter().map(String::as_str).collect();
    println!("\nRooms of {folder}: {}: {}", names.len(), names.join(", "));
    list("arrows", &arrows(package));
    list("upward arrows", &floors::upward(package, floors));
    let joined = |circles: Vec<Vec<&str>>| circles.iter().map(|circle| circle.join(", ")).collect::<Vec<_>>();
    list("circles between rooms", &joined(package.circles()));
    list("circles between files", &joined(package.file_circles()));
}

/// One line a room: whom it uses.
fn arrows(package: &Package) -> Vec<String> {
    let arrows = package.arrows.keys();
    arrows.map(|(from, to)| format!("{from} → {to}")).collect()
}

fn list(what: &str, entries: &[String]) {
    println!("- {what}: {}", entries.len());
    for entry in entries {
        println!("  - {entry}");
    }
}
