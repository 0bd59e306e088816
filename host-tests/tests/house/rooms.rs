//! Rooms of the packages, and who uses whom: downward only. Their order stands in `tools/house/src/floors.rs`.

use crate::figures::{at_most, figures};
use house::floors;

/// Folder, then limit and goal: rooms, upward arrows, circles between rooms, circles between files.
const LIMITS: [(&str, [[usize; 2]; 4]); 8] = [
    ("src", [[18, 20], [0, 0], [0, 0], [0, 0]]),
    ("workbench/core/src", [[4, 10], [0, 0], [0, 0], [0, 0]]),
    ("workbench/core/src/gap", [[18, 18], [0, 0], [0, 0], [0, 0]]),
    ("workbench/files/src", [[2, 10], [0, 0], [0, 0], [0, 0]]),
    ("workbench/report/src", [[2, 10], [0, 0], [0, 0], [0, 0]]),
    ("workbench/servo/src", [[2, 10], [0, 0], [0, 0], [0, 0]]),
    ("workbench/proving/src", [[2, 10], [0, 0], [0, 0], [0, 0]]),
    ("workbench/src", [[1, 10], [0, 0], [0, 0], [0, 0]]),
];

#[test]
fn rooms_are_few_and_lean_on_those_below() {
    let figures = figures();
    for ((folder, package, floors), (name, limits)) in figures.packages().zip(LIMITS) {
        assert_eq!(folder, name);
        let upward = floors::upward(&package, floors);
        let counted = [
            ("rooms", package.rooms.len(), String::new()),
            ("upward arrows", upward.len(), upward.join("; ")),
            ("circles between rooms", package.circles().len(), named(package.circles())),
            ("circles between files", package.file_circles().len(), named(package.file_circles())),
        ];
        for ((what, count, which), [limit, goal]) in counted.into_iter().zip(limits) {
            at_most(&format!("{what} of {folder} {which}"), count, limit, goal);
        }
    }
}

fn named(circles: Vec<Vec<&str>>) -> String {
    let circles: Vec<String> = circles.iter().map(|circle| circle.join(" ↔ ")).collect();
    circles.join("; ")
}
