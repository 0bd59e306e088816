//! What several threads share.

use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Tasks of some milliseconds or more, in their order: each may go to another thread. Left to itself, the thread pool hands them out in
/// bunches, and of a bunch with several long ones nobody can take any away.
pub fn each<T: IntoParallelIterator<Iter: IndexedParallelIterator>>(all: T) -> rayon::iter::MaxLen<T::Iter> {
    all.into_par_iter().with_max_len(1)
}

/// What such tasks give, in their order.
pub fn of_each<T, R>(all: T, task: impl Fn(T::Item) -> R + Sync + Send) -> Vec<R>
where
    T: IntoParallelIterator<Iter: IndexedParallelIterator>,
    R: Send,
{
    each(all).map(task).collect()
}

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
        BUSY.load(Relaxed) < rayon::current_num_threads()
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        BUSY.fetch_sub(1, Relaxed);
    }
}
