//! The paper "Identification of Non-Linearities in an Autonomous Robot": its motor model against its own table.

use crate::commands::paper;
use truing_core::gap::tables;
use truing_core::outcome::Outcome;

/// Paragraphs in front of the paper's table in the report.
pub const INTRODUCTION: [&str; 1] = [
    "The paper gives the parameters of its DC motor and, in its Table 3.1, 30 measured steady speeds. The model predicts \
     the table from the parameters alone; what it misses is found, named as far as steady data allow, and added.",
];

/// The gap workflow on the paper's table.
pub fn analyse() -> Outcome {
    tables::run(&paper::motor(), &paper::table(), &[], &[])
}
