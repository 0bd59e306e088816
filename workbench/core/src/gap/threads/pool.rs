//! The threads of a pool.

pub use rayon::current_num_threads as count;
pub use rayon::prelude::*;

/// Does both, each on a thread of its own where one is free.
pub fn join<A: Send, B: Send>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B + Send) -> (A, B) {
    let (mut first, mut second) = (Some(first), Some(second));
    let (mut one, mut other) = (None, None);
    both(&mut || one = first.take().map(|task| task()), &mut || other = second.take().map(|task| task()));
    (one.expect("done"), other.expect("done"))
}

/// The pool's own, once: for each pair of tasks it would be compiled anew.
#[inline(never)]
fn both(first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
    rayon::join(first, second);
}

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
