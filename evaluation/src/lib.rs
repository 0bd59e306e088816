//! What the suites share: the option `--results`, which keeps a printed table together with what made it, and what a case hides
//! against what was found.

pub mod answers;
mod page;
mod section;

pub use page::{Page, Results};
