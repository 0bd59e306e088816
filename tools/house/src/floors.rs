//! The order of the rooms, from the ground up. A room may use the rooms of its own floor and of those below.
//!
//! This is the one place that declares it: a new room is entered here.

use crate::arrows::Package;

/// Rooms by floor, lowest first.
pub type Floors = &'static [&'static [&'static str]];

/// The packages with rooms: folder, name, floors. Of the packages each may use those above it in this list; cargo sees to that.
pub const PACKAGES: [(&str, &str, Floors); 8] = [
    ("src", "servo", CHIP),
    ("workbench/core/src", "truing_core", &[&["text"], &["outcome"], &["system"], &["gap"]]),
    ("workbench/core/src/gap", "truing_core::gap", GAP),
    ("workbench/files/src", "truing_files", &[&["log", "model"]]),
    ("workbench/report/src", "truing_report", &[&["console"], &["report"]]),
    ("workbench/servo/src", "truing_servo", &[&["device"], &["commands"]]),
    ("workbench/proving/src", "proving", &[&["synthetic"], &["commands"]]),
    ("workbench/src", "truing", &[&["cli"]]),
];

/// Rooms of the host flow; `run` stands above them.
const GAP: Floors = &[
    &["beam", "data_sheet", "dataset", "options", "order", "residual"],
    &["examine", "fit"],
    &["acceptance", "experiment", "plots", "torque"],
    &["remainder", "search", "tables"],
    &["record", "start_values", "time_base"],
];

/// Rooms of `src`: the library, then the image.
const CHIP: Floors = &[
    &["units", "sample", "optional"],
    &["config", "compensate", "encoder"],
    &["control", "pwm", "identify"],
    &["protect"],
    &["commission", "record", "store"],
    &["motion"],
    &["axis"],
    &["link", "drivers"],
    &["image"],
];

/// Arrows of the package that lead to a higher floor, and rooms that stand on no floor.
pub fn upward(package: &Package, floors: Floors) -> Vec<String> {
    let floor = |room: &str| floors.iter().position(|rooms| rooms.contains(&room));
    let strangers = package.rooms.iter().filter(|room| floor(room).is_none());
    let strangers = strangers.map(|room| format!("{room} stands on no floor"));
    let climbs = package.arrows.iter().filter_map(|((from, to), files)| {
        let up = floor(from)? < floor(to)?;
        up.then(|| format!("{from} → {to}, by {}", list(files)))
    });
    strangers.chain(climbs).collect()
}

fn list(files: &std::collections::BTreeSet<std::path::PathBuf>) -> String {
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    names.join(", ")
}
