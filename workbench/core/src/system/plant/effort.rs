//! How much work a search is: simulations, inner steps and passes, counted exactly. Counts do not depend on the number of threads or
//! on the machine's load, so they are what a budget can hold; see `truing bench`.
//!
//! A simulated run is added once, at its end. The counters belong to the process: of two searches at once they tell the sum.

use derive_more::{Add, Sub};
use std::sync::{Mutex, PoisonError};

/// What the searches of this process computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Add, Sub, serde::Serialize)]
pub struct Work {
    /// Sets of parameters that were simulated, each run of a record for itself.
    pub simulations: u64,
    /// Steps of the plant of one set.
    pub inner_steps: u64,
    /// Steps of a pack of sets that advance together. A pack of one set makes as many passes as inner steps.
    pub passes: u64,
}

static DONE: Mutex<Work> = Mutex::new(Work { simulations: 0, inner_steps: 0, passes: 0 });

/// Adds a pack of sets that advanced together by so many steps.
pub fn simulated(sets: usize, steps: u64) {
    let mut done = DONE.lock().unwrap_or_else(PoisonError::into_inner);
    *done = *done + Work { simulations: sets as u64, inner_steps: sets as u64 * steps, passes: steps };
}

/// What was computed so far.
pub fn done() -> Work {
    *DONE.lock().unwrap_or_else(PoisonError::into_inner)
}
