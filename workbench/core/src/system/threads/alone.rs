//! One thread in the place of a pool.

/// What a pool's iterators know beyond those of the standard library.
pub trait OneByOne: Iterator + Sized {
    /// All that the tasks give, one behind the other.
    fn flat_map_iter<I: IntoIterator>(self, task: impl Fn(Self::Item) -> I) -> impl Iterator<Item = I::Item> {
        self.flat_map(task)
    }
}

impl<I: Iterator> OneByOne for I {}

/// How many threads there are.
pub fn count() -> usize {
    1
}

/// Does both.
pub fn join<A, B>(first: impl FnOnce() -> A, second: impl FnOnce() -> B) -> (A, B) {
    (first(), second())
}

/// Tasks in their order.
pub fn each<T: IntoIterator>(all: T) -> T::IntoIter {
    all.into_iter()
}

/// What tasks give, in their order.
pub fn of_each<T: IntoIterator, R>(all: T, task: impl Fn(T::Item) -> R) -> Vec<R> {
    each(all).map(task).collect()
}
