//! What the suites share: the option `--results`, which keeps a printed table together with what made it.

mod page;
mod section;

pub use page::{Page, Results};
