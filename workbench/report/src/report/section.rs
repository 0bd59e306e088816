//! What a report can show beside the result of the gap workflow: plots, tables and checked claims.

use truing_core::outcome::Plot;

/// A table of text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Column heads.
    pub header: Vec<String>,
    /// Rows, each as long as the header.
    pub rows: Vec<Vec<String>>,
}

/// A claim, the figure that was found, and whether it holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Check {
    /// What is claimed, with the claimed figure.
    pub claim: String,
    /// What was found.
    pub found: String,
    /// True if the claim holds.
    pub holds: bool,
}

/// Plots, tables and checks under one heading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Heading.
    pub title: String,
    /// Paragraphs in front.
    pub text: Vec<String>,
    /// Figures.
    pub plots: Vec<Plot>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Checked claims.
    pub checks: Vec<Check>,
}
