//! Truing in a browser: the bytes of files in, texts out. A worker calls it; the page draws.
//!
//! There is one thread here and no clock: the time comes from the page's `told.js`, and progress goes there.

mod gap;
mod look;
mod model;
mod page;

pub use gap::{Answer, Task};
pub use look::{Looked, look};
pub use model::unknown;
