//! One reading of the rows: a solution, and how the windows that were not learned fit it.
//!
//! Two are kept. The saturation of some motors begins within the range that is learned; rows above it bend the line. What
//! the rows below [`gate::CORE_LIMIT`] say alone then shows a level inside the range, and only that reading holds.

use super::{Params, State};
use crate::identify::estimate::Mechanism;
use crate::identify::gate;
use crate::identify::positive::Positive;
use crate::identify::saturation;
use crate::identify::solve::Solution;
use crate::identify::spline::Window;
use crate::identify::trust::Check;
use crate::units::Direction;

/// A solution under test.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub(super) solution: Solution,
    pub(super) saturation: [saturation::State; 2],
    pub(super) checks: [Check; 2],
}

impl Reading {
    pub(super) fn new(solution: &Solution) -> Self {
        Reading {
            solution: *solution,
            saturation: [saturation::State::default(); 2],
            checks: [Check::default(); 2],
        }
    }

    /// A better solution of the same rows; what was compared stays.
    pub(super) fn renewed(mut self, solution: &Solution) -> Self {
        self.solution = *solution;
        self
    }

    /// Saturation level of a direction as this solution sees it, Q20 of nominal.
    pub(super) fn level(&self, direction: Direction) -> Option<i32> {
        self.saturation[direction].level(&self.solution, direction)
    }

    /// What was seen of the saturation of a direction; `None`: there is no such direction.
    pub(super) fn seen(&self, direction: Direction) -> saturation::Seen {
        self.saturation[direction].seen(self.level(direction))
    }

    /// Applied against needed voltage: above the linear range a sample of the saturation, within it a check.
    fn compare(&mut self, window: &Window, direction: Direction, what: Comparison) {
        let applied = if direction == Direction::Positive { window.voltage } else { -window.voltage };
        let effective = self.solution.effective_voltage(window, direction);
        let needed = effective.saturating_add(self.solution.dead_zone[direction]);
        match what {
            Comparison::Saturation => {
                let sigma = self.solution.dead_zone_sigma[direction];
                self.saturation[direction].note(window, direction, applied, needed, sigma);
            }
            Comparison::Check => self.checks[direction].note(applied.saturating_sub(needed)),
        }
    }
}

/// What a window is compared for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Comparison {
    /// Driven above the linear range.
    Saturation,
    /// Driven within it, not yet learned.
    Check,
}

impl Params {
    /// Compares a window with both readings.
    pub(super) fn compare(&self, state: &mut State, window: &Window, what: Comparison) {
        let direction = state.direction;
        for reading in [&mut state.whole, &mut state.core].into_iter().flatten() {
            reading.compare(window, direction, what);
        }
    }
}

impl State {
    /// Does the saturation begin within the learned range?
    pub(super) fn low_knee(&self) -> bool {
        let (Some(whole), Some(core)) = (&self.whole, &self.core) else {
            return false;
        };
        let within = |level: Option<i32>| level.is_some_and(|level| level < LOW_LEVEL);
        let seen = |reading: &Reading| Direction::BOTH.into_iter().any(|d| within(reading.level(d)));
        let (all, below) = (whole.solution.gain, core.solution.gain);
        // A level that only the whole shows lies near the upper end; a far steeper core is then a poor one.
        let poor = all.times(Positive::of(POOR_CORE_1024, 10)).below(below);
        all.below(below) && (seen(core) || seen(whole) && !poor)
    }

    /// The reading that holds.
    pub(super) fn reading(&self) -> Option<Reading> {
        if !self.low_knee() {
            return self.whole;
        }
        let (whole, mut core) = (self.whole?, self.core?);
        for direction in Direction::BOTH {
            // The core rows alone may be too few to tell a sample of the level from its own uncertainty.
            if core.level(direction).is_none() {
                core.saturation[direction] = whole.saturation[direction];
            }
        }
        Some(core)
    }

    /// The side of an input dead zone follows the voltage.
    pub(super) fn follow(&mut self, mechanism: Mechanism) {
        self.mechanism = mechanism;
        self.identify.follows_input = mechanism == Mechanism::InputDeadZone;
    }
}

/// Saturation below which learned rows lie beyond it, Q20 of nominal: 0.635, the highest learned voltage and a margin.
const LOW_LEVEL: i32 = 665_846;
/// Gain of the core rows over that of all rows beyond which the core is poor, in 1/1024: 1.25.
const POOR_CORE_1024: i32 = 1_280;
const _: () = assert!((gate::CORE_LIMIT as i64) << 6 < LOW_LEVEL as i64);
