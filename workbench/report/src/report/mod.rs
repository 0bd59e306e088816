//! Reports of one [`Outcome`]: terminal, HTML, JSON and the extended model, each behind the [`Exporter`] trait.
//!
//! A report computes nothing; it writes what the outcome says. Every file is written beside its destination and renamed
//! into place, so that an earlier report survives whatever goes wrong.

mod chapters;
mod chart;
pub mod format;
pub mod html;
pub mod json;
pub mod model_file;
#[cfg(feature = "console")]
pub mod pictures;
pub mod plot;
pub mod section;
#[cfg(feature = "console")]
pub mod terminal;

#[cfg(feature = "console")]
pub use crate::console::written::{write_atomically, write_bytes};
pub use format::{figure, gap, grade, verdict};

use anyhow::Result;
use truing_core::outcome::Outcome;

/// Turns an outcome into the text of one format.
pub trait Exporter {
    /// The whole document.
    fn export(&self, outcome: &Outcome) -> Result<String>;

    /// Exports to a file that appears complete or not at all.
    #[cfg(feature = "console")]
    fn write(&self, outcome: &Outcome, path: &std::path::Path) -> Result<()> {
        write_atomically(path, &self.export(outcome)?)
    }
}
