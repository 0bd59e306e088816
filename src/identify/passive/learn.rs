//! The full regression from whatever the loops do, where nothing was commissioned.
//!
//! A solution follows every [`ROWS_PER_SOLUTION`] rows, and says how long the blocks should be: what was learned with
//! others is forgotten then. Windows are a test of the last solution before they are learned. Once the numbers are
//! trusted and [`MATURE_ROWS`] stand behind them, gain and time constant are frozen and the dead zone is tracked.

use super::{Params, State, Task, Work, moved, publish};
use crate::identify::estimate::{Estimate, Estimates};
use crate::identify::positive::Positive;
use crate::identify::regression::Row;
use crate::identify::slices::Spread;
use crate::identify::solve::{Progress, Structure};
use crate::identify::spline::{Lengths, Window};
use crate::identify::trust::{Check, Evidence, Excitation, Part};
use crate::units::Direction;

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
    /// What is being decided.
    draft: Estimates,
}

impl Default for Learning {
    fn default() -> Self {
        Learning {
            checks: [Check::default(); 2],
            new_rows: 0,
            failures: 0,
            supply_measured: true,
            draft: Estimates::default(),
        }
    }
}

impl Params {
    /// One window: tests the last solution, and is learned. The sums must not change while the solver reads
    /// them.
    pub(super) fn learn(
        &self,
        state: &mut State,
        window: &Window,
        direction: Direction,
        supply_measured: bool,
    ) {
        let Task::Learn(learning) = &mut state.task else {
            return;
        };
        if state.solver.reads() {
            return;
        }
        learning.supply_measured &= supply_measured;
        if state.solved {
            // A window not yet learned is a test of what was learned.
            let solution = state.solver.solution();
            let sample = self.sample(solution, window, direction);
            let check = &mut learning.checks[direction];
            check.note(sample.saturating_sub(solution.dead_zone[direction]));
            check.keep(MOST_CHECKS);
        }
        state.identify.sums[direction].add(&Row::new(window, direction));
        learning.new_rows = learning.new_rows.saturating_add(1);
        if learning.new_rows >= ROWS_PER_SOLUTION && state.work == Work::None {
            learning.new_rows = 0;
            state.solved = false;
            state.solver.start(Structure::Shared);
            state.work = Work::Solve;
        }
    }

    /// One step of the solver.
    #[inline]
    pub(super) fn solve(&self, state: &mut State) {
        let Task::Learn(learning) = &mut state.task else {
            return;
        };
        match state.solver.step(&[&state.identify.sums]) {
            Progress::Solved => {
                learning.failures = 0;
                state.solved = true;
                state.work = Work::Decide(0);
            }
            Progress::Singular => {
                learning.failures = learning.failures.saturating_add(1);
                state.work = Work::None;
                if learning.failures >= MOST_FAILURES {
                    self.start_over(state, self.identify.longer(&state.identify.lengths));
                }
            }
            Progress::Idle | Progress::Busy => {}
        }
    }

    /// Blocks for the time constant found. A factor of two costs little accuracy, forgetting costs all that was learned.
    fn fitting(&self, state: &State) -> Lengths {
        let now = state.identify.lengths;
        let block = Positive::new(u64::from(self.identify.block_ticks(&now)), 0);
        let ticks = state.solver.solution().time_constant.times(block).to_q(0);
        let wanted = self.identify.lengths_for(ticks.max(0) as u32);
        if wanted.block.abs_diff(now.block) > 1 { wanted } else { now }
    }

    #[cold]
    #[inline(never)]
    fn start_over(&self, state: &mut State, lengths: Lengths) {
        state.identify.relength(lengths);
        state.identify.forget();
        state.solved = false;
        state.work = Work::None;
        state.task = Task::Learn(Learning::default());
    }

    /// From a solution to estimates: one number a tick. `true`: `known` has changed.
    #[cold]
    #[inline(never)]
    pub(super) fn decide(&self, state: &mut State, known: &mut Estimates, step: u8) -> bool {
        state.work = Work::Decide(step.wrapping_add(1));
        if step == 0 {
            let lengths = self.fitting(state);
            if lengths != state.identify.lengths {
                self.start_over(state, lengths);
            }
            return false;
        }
        let Task::Learn(learning) = &mut state.task else {
            return false;
        };
        let Some(&part) = Part::ALL.get(usize::from(step).wrapping_sub(1)) else {
            return self.conclude(state, known);
        };
        let evidence = Evidence {
            sums: &[&state.identify.sums],
            spread: &[Spread::default(); 2],
            checks: &learning.checks,
            mechanism: known.mechanism,
            short_of_travel: false,
            starts: &[0; 2],
            supply_measured: learning.supply_measured,
            excitation: Excitation::Ordinary,
        };
        let (lengths, solution) = (&state.identify.lengths, state.solver.solution());
        self.identify.decide(part, &mut learning.draft, lengths, solution, &evidence);
        false
    }

    /// Publishes what is new; begins to track once it is mature.
    #[inline(never)]
    fn conclude(&self, state: &mut State, known: &mut Estimates) -> bool {
        state.work = Work::None;
        let Task::Learn(learning) = &mut state.task else {
            return false;
        };
        // Ordinary motion says nothing about the saturation.
        learning.draft.saturation = known.saturation;
        let estimates = learning.draft;
        let [positive, negative] = &state.identify.sums;
        if positive.rows.saturating_add(negative.rows) >= MATURE_ROWS && self.freeze(state, &estimates) {
            state.work = Work::Track;
            return publish(known, &estimates);
        }
        news(known, &estimates) && publish(known, &estimates)
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
