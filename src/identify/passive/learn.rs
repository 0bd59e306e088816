//! The full regression from whatever the loops do, where nothing was commissioned.
//!
//! A solution follows every [`ROWS_PER_SOLUTION`] rows, and says how long the blocks should be: what was learned with
//! others is forgotten then. Windows are a test of the last solution before they are learned. Once the numbers are
//! trusted and [`MATURE_ROWS`] stand behind them, gain and time constant are frozen and the dead zone is tracked.

use super::{Params, State, Task, moved, publish};
use crate::identify::estimate::{Estimate, Estimates};
use crate::identify::positive::Positive;
use crate::identify::saturation;
use crate::identify::slices::Spread;
use crate::identify::solve::{Progress, Solution, Structure};
use crate::identify::spline::{Lengths, Window};
use crate::identify::trust::{Check, Evidence, Excitation};

/// Rows between two solutions.
const ROWS_PER_SOLUTION: u32 = 64;
/// Windows of verification that count; then the older half is forgotten.
const MOST_CHECKS: u32 = 512;
/// Rows after which more of them tell nothing new: a minute of motion with blocks of 16 ms.
const MATURE_ROWS: u32 = 8_192;
/// Solutions in a row that failed before longer blocks are tried.
const MOST_FAILURES: u8 = 4;
/// Change of a trusted number that is published, in 1/1024: 1 %.
const NEWS_1024: i32 = 10;

/// What learning needs beside the sums.
#[derive(Clone, Copy, Debug)]
pub(super) struct Learning {
    checks: [Check; 2],
    new_rows: u32,
    failures: u8,
    /// The supply was measured in every window.
    supply_measured: bool,
}

impl Default for Learning {
    fn default() -> Self {
        Learning {
            checks: [Check::default(); 2],
            new_rows: 0,
            failures: 0,
            supply_measured: true,
        }
    }
}

impl Params {
    /// One window: tests the last solution, and is learned.
    pub(super) fn learn(&self, state: &mut State, window: &Window, supply_measured: bool) {
        let Task::Learn(mut learning) = state.task else {
            return;
        };
        if state.solver.busy() {
            return;
        }
        self.check(state, &mut learning.checks, window);
        learning.supply_measured &= supply_measured;
        if self.identify.learn(&mut state.identify, window, None) {
            learning.new_rows = learning.new_rows.saturating_add(1);
        }
        if learning.new_rows >= ROWS_PER_SOLUTION {
            learning.new_rows = 0;
            state.solver.start(Structure::Shared);
        }
        state.task = Task::Learn(learning);
    }

    /// A window not yet learned is a test of what was learned.
    fn check(&self, state: &State, checks: &mut [Check; 2], window: &Window) {
        let Some(solution) = &state.solution else { return };
        for (direction, check) in checks.iter_mut().enumerate() {
            if let Some(sample) = self.sample(state, solution, window, direction) {
                check.note(sample.saturating_sub(solution.dead_zone[direction]));
                check.keep(MOST_CHECKS);
            }
        }
    }

    /// One step of the solver. `true`: `known` has changed.
    pub(super) fn solve(&self, state: &mut State, known: &mut Estimates) -> bool {
        let Task::Learn(mut learning) = state.task else {
            return false;
        };
        match state.solver.step(&[&state.identify.core, &state.identify.outer]) {
            Progress::Solved => {
                let solution = *state.solver.solution();
                state.solved(solution);
                learning.failures = 0;
                state.task = Task::Learn(learning);
                let lengths = self.fitting(state, &solution);
                if lengths != state.identify.lengths {
                    self.start_over(state, lengths);
                    return false;
                }
                self.conclude(state, known, &solution)
            }
            Progress::Singular => {
                learning.failures = learning.failures.saturating_add(1);
                state.task = Task::Learn(learning);
                if learning.failures >= MOST_FAILURES {
                    self.start_over(state, self.identify.longer(&state.identify.lengths));
                }
                false
            }
            Progress::Idle | Progress::Busy => false,
        }
    }

    /// Blocks for the time constant found. A factor of two costs little accuracy, forgetting costs all that was learned.
    fn fitting(&self, state: &State, solution: &Solution) -> Lengths {
        let now = state.identify.lengths;
        let block = Positive::new(u64::from(self.identify.block_ticks(&now)), 0);
        let ticks = solution.time_constant.times(block).to_q(0);
        let wanted = self.identify.lengths_for(ticks.max(0) as u32);
        if wanted.block.abs_diff(now.block) > 1 {
            wanted
        } else {
            now
        }
    }

    fn start_over(&self, state: &mut State, lengths: Lengths) {
        state.identify.relength(lengths);
        state.identify.forget();
        state.solution = None;
        state.task = Task::Learn(Learning::default());
    }

    /// Publishes what is new; begins to track once it is mature.
    fn conclude(&self, state: &mut State, known: &mut Estimates, solution: &Solution) -> bool {
        let Task::Learn(learning) = state.task else {
            return false;
        };
        let evidence = Evidence {
            spread: &[Spread::default(); 2],
            saturation: &[saturation::Seen::default(); 2],
            checks: &learning.checks,
            mechanism: known.mechanism,
            short_of_travel: false,
            supply_measured: learning.supply_measured,
            excitation: Excitation::Ordinary,
        };
        // Ordinary motion says nothing about the saturation.
        let estimates = Estimates {
            saturation: known.saturation,
            ..self.identify.estimates(&state.identify, solution, &evidence)
        };
        let rows = state.identify.core.iter().chain(&state.identify.outer);
        let rows = rows.fold(0u32, |rows, sums| rows.saturating_add(sums.rows));
        if rows >= MATURE_ROWS && self.adopt(state, &estimates) {
            return publish(known, estimates);
        }
        news(known, &estimates) && publish(known, estimates)
    }
}

/// Did trust change, or a number by more than 1 %?
fn news(known: &Estimates, new: &Estimates) -> bool {
    let numbers = |e: &Estimates| [e.dead_zone[0], e.dead_zone[1], e.gain, e.time_constant];
    let differs = |(old, new): (Estimate, Estimate)| {
        old.standing != new.standing || moved(new.value, old.value, NEWS_1024)
    };
    numbers(known).into_iter().zip(numbers(new)).any(differs)
}
