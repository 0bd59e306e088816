//! All tasks of a manifest on this machine: units at once, the logs of a unit in the order of time.

use crate::check::{Done, check};
use crate::manifest::Task;
use crate::store::Store;
use rayon::prelude::*;
use truing_core::text::input_error::InputError;

/// What became of the tasks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Results that were there.
    pub there: usize,
    /// Logs that the names of the log before explain.
    pub unchanged: usize,
    /// Logs for which the whole library was searched.
    pub searched: usize,
    /// What could not be done, a sentence each, in the order of units and times.
    pub failed: Vec<String>,
}

impl Summary {
    fn and(mut self, other: Self) -> Self {
        self.there += other.there;
        self.unchanged += other.unchanged;
        self.searched += other.searched;
        self.failed.extend(other.failed);
        self
    }

    /// Results that were written.
    pub fn written(&self) -> usize {
        self.unchanged + self.searched
    }
}

/// Does all tasks of some units with so many workers; a log that fails does not keep others from being judged. `say` hears of every
/// task that is done.
pub fn run(
    units: &[Vec<Task>],
    store: &Store,
    workers: usize,
    say: &(dyn Fn(&Task, Done) + Sync),
) -> Result<Summary, InputError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(workers).build();
    let pool =
        pool.map_err(|error| InputError(format!("--workers {workers}: no threads ({error}); take fewer")))?;
    let done = || units.par_iter().map(|tasks| of_unit(tasks, store, say)).collect::<Vec<Summary>>();
    Ok(pool.install(done).into_iter().fold(Summary::default(), Summary::and))
}

fn of_unit(tasks: &[Task], store: &Store, say: &(dyn Fn(&Task, Done) + Sync)) -> Summary {
    let mut summary = Summary::default();
    for task in tasks {
        match check(task, store) {
            Ok(done) => {
                *match done {
                    Done::There => &mut summary.there,
                    Done::Unchanged => &mut summary.unchanged,
                    Done::Searched => &mut summary.searched,
                } += 1;
                say(task, done);
            }
            Err(error) => summary.failed.push(format!("{} at {}: {error:#}", task.unit, task.at)),
        }
    }
    summary
}
