//! What a verdict about a table is made of.

use super::fit::Set;
use super::rivals::Replacement;
use super::sets::Search;
use super::study::HeldOut;
use crate::system::log::Table;
use crate::system::plant::physics::Physics;
use nalgebra::DMatrix;

/// Everything that a verdict is made of.
pub struct Case<'a> {
    /// The table.
    pub log: &'a Table,
    /// The search, with the rows that were fitted.
    pub search: Search<'a>,
    /// The plant of the model as given.
    pub given: &'a Physics,
    /// The rows that were not fitted.
    pub held_out: &'a HeldOut<'a>,
    /// True if they come from other files.
    pub separate_files: bool,
}

/// The accepted set, fitted to the chosen rows and to all rows.
pub(super) struct Found<'a> {
    /// The sets on the way to the chosen one, each with one effect more.
    pub(super) growth: Vec<Set<'a>>,
    /// Fitted to the chosen rows: what the gap on the others is measured with.
    pub(super) chosen: Set<'a>,
    /// Fitted to every row: what is reported.
    pub(super) set: Set<'a>,
    pub(super) covariance: Option<DMatrix<f64>>,
    pub(super) plant: Physics,
    pub(super) ties: Vec<(usize, Vec<Replacement<'a>>)>,
    pub(super) rejected: Vec<(usize, Replacement<'a>)>,
}
