//! The threads of a pool.

pub use rayon::prelude::*;
pub use rayon::{current_num_threads as count, join};

/// Tasks of some milliseconds or more, in their order: each may go to another thread. Left to itself, the thread pool hands them out in
/// bunches, and of a bunch with several long ones nobody can take any away.
pub fn each<T: IntoParallelIterator<Iter: IndexedParallelIterator>>(all: T) -> rayon::iter::MaxLen<T::Iter> {
    all.into_par_iter().with_max_len(1)
}

/// What tasks of some milliseconds or more give, in their order.
pub fn of_each<T, R>(all: T, task: impl Fn(T::Item) -> R + Sync + Send) -> Vec<R>
where
    T: IntoParallelIterator<Iter: IndexedParallelIterator>,
    R: Send,
{
    each(all).map(task).collect()
}
