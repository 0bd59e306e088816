//! The threads of a pool.

pub use rayon::prelude::*;
pub use rayon::{current_num_threads as count, join};

/// Tasks of some milliseconds or more, in their order: each may go to another thread. Left to itself, the thread pool hands them out in
/// bunches, and of a bunch with several long ones nobody can take any away.
pub fn each<T: IntoParallelIterator<Iter: IndexedParallelIterator>>(all: T) -> rayon::iter::MaxLen<T::Iter> {
    bunched(all).with_max_len(1)
}

/// Short tasks, in their order: a thread takes several at once.
pub fn bunched<T: IntoParallelIterator>(all: T) -> T::Iter {
    all.into_par_iter()
}

/// What tasks of some milliseconds or more give, in their order.
pub fn of_each<T, R>(all: T, task: impl Fn(T::Item) -> R + Sync + Send) -> Vec<R>
where
    T: IntoParallelIterator<Iter: IndexedParallelIterator>,
    R: Send,
{
    each(all).map(task).collect()
}

/// On a thread of the pool, which hands on what it can share without being woken first.
pub fn on_pool<R: Send>(task: impl FnOnce() -> R + Send) -> R {
    rayon::scope(|_| task())
}
