//! What several threads share. Without the feature `threads` one thread does it all, in the same order and with the same bits.

#[cfg(not(feature = "threads"))]
mod alone;
#[cfg(feature = "threads")]
mod pool;

#[cfg(not(feature = "threads"))]
pub use alone::*;
#[cfg(feature = "threads")]
pub use pool::*;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Threads that simulate at this moment.
static BUSY: AtomicUsize = AtomicUsize::new(0);

/// A simulation under way.
pub struct Busy(());

impl Busy {
    /// Begins.
    pub fn begin() -> Self {
        BUSY.fetch_add(1, Relaxed);
        Self(())
    }

    /// True if not all threads simulate: another one may have nothing to do. It may be wrong; nothing but time may depend on it.
    pub fn helper_is_free(&self) -> bool {
        BUSY.load(Relaxed) < count()
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        BUSY.fetch_sub(1, Relaxed);
    }
}
