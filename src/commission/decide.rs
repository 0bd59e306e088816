//! What a window is used for, the solutions, and the decision.

use super::reading::{Comparison, Reading};
use super::{Params, Phase, State};
use crate::identify;
use crate::identify::coast;
use crate::identify::estimate::Reason;
use crate::identify::regression::Row;
use crate::identify::slices::{SLICES, VERIFY_SLICE};
use crate::identify::solve::{Progress, Structure};
use crate::identify::spline::Window;
use crate::identify::trust::{Evidence, Excitation, Part, saturation};
use crate::units::Direction;

/// Time constants that a budget must hold, in quarters: 3.5.
const LEAST_TIME_CONSTANTS_QUARTERS: u64 = 14;

impl Params {
    #[cold]
    #[inline]
    pub(super) fn use_window(&self, state: &mut State) {
        let Some(window) = state.window.take() else {
            return;
        };
        match state.phase {
            Phase::Learn => {
                let slice = self.slice(state);
                self.learn_row(state, &window, slice);
                self.heed_low_speed(state, &window);
            }
            Phase::Coast => self.note_coast(state, &window),
            Phase::Saturate | Phase::Verify => self.test(state, &window),
            _ => {}
        }
    }

    /// Adds the window to the regression and to its time slice, if its gates let it pass.
    #[cold]
    #[inline]
    fn learn_row(&self, state: &mut State, window: &Window, slice: usize) {
        let Some(direction) = self.identify.direction(&state.identify, window) else {
            return;
        };
        let row = Row::new(window, direction);
        let outer = !state.identify.gate.core(direction);
        let set = if outer { &mut state.outer } else { &mut state.identify.sums };
        set[direction].add(&row);
        if let Some(slice) = state.slices.get_mut(slice) {
            slice.add(&row, direction, outer);
        }
    }

    fn note_coast(&self, state: &mut State, window: &Window) {
        let direction = state.direction;
        let gate = &state.identify.gate;
        if !((gate.still() || state.voltage.loaded) && gate.moving(direction)) {
            return;
        }
        // Shorter blocks by 2^k, see the coast test.
        let shift = state.learn_lengths.block - state.identify.lengths.block;
        let sign = state.sign();
        state.coast[direction].note(window, sign, shift);
    }

    /// Full voltage samples the saturation. The verification checks what was learned, and is learned thereafter.
    fn test(&self, state: &mut State, window: &Window) {
        let direction = state.direction;
        let gate = &state.identify.gate;
        if !(gate.moving(direction) || state.identify.follows_input) {
            return;
        }
        if gate.high(direction) {
            self.compare(state, window, Comparison::Saturation);
        } else if gate.linear(direction) && state.phase == Phase::Verify {
            self.compare(state, window, Comparison::Check);
            self.learn_row(state, window, VERIFY_SLICE + direction as usize);
        }
    }

    #[inline]
    pub(super) fn solve(&self, state: &mut State) {
        if let Some(progress) = state.solved.take() {
            return self.use_solution(state, progress);
        }
        if !state.solver.busy() {
            return;
        }
        let (core, outer) = (&state.identify.sums, &state.outer);
        let progress = match state.comparing {
            true => state.solver.step(&[core]),
            false => state.solver.step(&[core, outer]),
        };
        // What comes of it is the next tick's: the solver's last step is long enough.
        let ended = matches!(progress, Progress::Singular | Progress::Solved);
        state.solved = ended.then_some(progress);
    }

    #[cold]
    #[inline]
    fn use_solution(&self, state: &mut State, progress: Progress) {
        match progress {
            Progress::Idle | Progress::Busy => {}
            Progress::Singular | Progress::Solved if state.comparing => self.compared(state, progress),
            // The first direction alone only serves the coast test: later data may still do.
            Progress::Singular if state.solver.structure() != Structure::Shared => {}
            Progress::Singular => state.refuse(self.unsolved(state)),
            Progress::Solved => self.solved(state),
        }
    }

    /// A motor that never showed its time constant was not given the time, or not the counts.
    #[cold]
    #[inline(never)]
    fn unsolved(&self, state: &State) -> Reason {
        match state.timescale.found {
            _ if state.shuttle.turned => Reason::TravelTooShort,
            _ if self.identify.coarse() => Reason::EncoderTooSlow,
            None => state.or_limited(Reason::TooShort),
            Some(_) => state.or_limited(state.not_excited()),
        }
    }

    #[cold]
    #[inline(never)]
    fn solved(&self, state: &mut State) {
        let solution = state.solver.solution();
        state.whole = Some(renewed(state.whole, solution));
        state.follow(coast::mechanism(&state.coast, solution));
        if state.solver.structure() == Structure::Shared && state.timescale.found.is_some() {
            // Once more, with the rows below the core limit alone; a slow motor has too few of them.
            state.comparing = true;
            state.solve_for(Structure::Shared);
        }
    }

    #[cold]
    #[inline(never)]
    fn compared(&self, state: &mut State, progress: Progress) {
        state.comparing = false;
        if progress == Progress::Solved {
            state.core = Some(renewed(state.core, state.solver.solution()));
        }
    }

    /// One step of the decision a tick: which reading holds, then every slice, then every number.
    #[cold]
    #[inline(never)]
    pub(super) fn decide(&self, state: &mut State) {
        if state.solver.busy() || state.solved.is_some() {
            return;
        }
        let step = usize::from(state.stroke);
        state.stroke = state.stroke.saturating_add(1);
        if step == 0 {
            state.low_knee = state.low_knee();
            state.whole = state.reading();
        } else if let Some(slice) = state.slices.get(step.wrapping_sub(1)) {
            if let Some(reading) = &state.whole
                && !(state.low_knee && slice.outer())
                && let Some(residual) = slice.residual(&reading.solution)
            {
                state.spread[slice.direction()].note(residual, slice.rows());
            }
        } else if !self.settled(state, step.wrapping_sub(SLICES + 1)) {
            self.conclude(state);
        }
    }

    /// One number; `false` once there is none left.
    fn settled(&self, state: &mut State, step: usize) -> bool {
        let Some(reading) = &state.whole else {
            state.refuse(state.not_excited());
            return true;
        };
        if step == 0 {
            let mechanism = coast::mechanism(&state.coast, &reading.solution);
            state.follow(mechanism);
            return true;
        }
        let evidence = Evidence {
            sums: &[&state.identify.sums, &state.outer],
            spread: &state.spread,
            checks: &reading.checks,
            mechanism: state.mechanism,
            short_of_travel: state.shuttle.turned,
            supply_measured: !state.voltage.unmeasured,
            starts: &state.course.least_started,
            excitation: Excitation::Chosen,
        };
        let estimates = &mut state.outcome.estimates;
        let step = step.wrapping_sub(1);
        if let Some(&part) = Part::ALL.get(step) {
            let lengths = &state.identify.lengths;
            self.identify.decide(part, estimates, lengths, &reading.solution, &evidence);
            return true;
        }
        let Some(&direction) = Direction::BOTH.get(step.wrapping_sub(Part::ALL.len())) else {
            return false;
        };
        let seen = reading.seen(direction);
        estimates.saturation[direction] = saturation(&seen, direction, estimates, state.shuttle.turned);
        true
    }

    fn conclude(&self, state: &mut State) {
        let estimates = &state.outcome.estimates;
        let time_constant = (estimates.time_constant.value >> identify::estimate::TIME_FRAC) as u64;
        if time_constant * LEAST_TIME_CONSTANTS_QUARTERS > u64::from(self.budget) * 4 {
            return state.refuse(Reason::TooShort);
        }
        state.blame_limit();
        state.outcome.duration_ticks = state.spent();
        state.outcome.travel_counts = state.travel;
        state.phase = Phase::Done;
    }
}

impl State {
    /// Why the speeds cover too little: rated speed is far from what turns, or they did not vary.
    fn not_excited(&self) -> Reason {
        if self.course.lags() { Reason::SpeedContradicts } else { Reason::NotExcited }
    }
}

fn renewed(reading: Option<Reading>, solution: &identify::solve::Solution) -> Reading {
    match reading {
        Some(reading) => reading.renewed(solution),
        None => Reading::new(solution),
    }
}
