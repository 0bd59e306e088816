//! Which voltage drives the motor, phase by phase.

use super::breakaway::MOST_BREAK_AWAY;
use super::{Input, Params, Phase, State};
use crate::identify::estimate::Mechanism;
use crate::identify::regression::Sums;
use crate::identify::slices::Slice;
use crate::identify::solve::Structure;
use crate::identify::spline::{HOPS_PER_WINDOW, Window};
use crate::identify::trust::Check;
use crate::units::{Direction, VoltageQ14};

/// Highest voltage of the linear segments, Q14 of nominal: 0.62, just below the gate's limit.
const HIGH: i32 = 10_158;
/// Low voltage above break-away, Q14: 6 %.
const LOW_ABOVE_BREAK_AWAY: i32 = 983;
/// The same for a slow motor, whose ramp overshoots, Q14: 2.7 %.
const LOW_ABOVE_SLOW: i32 = 450;
/// What the low voltage is raised by when it drives too slowly, Q14: 2 %; and when it does not drive: 6 %.
const RAISE: i32 = 328;
const RAISE_IDLE: i32 = 983;
/// Speeds, in 1/1024 of rated speed, below which the low voltage drives too slowly, and does not drive: 9 %, 3 %.
const LEAST_LOW_1024: i32 = 92;
const IDLE_1024: i32 = 31;
/// Break-away voltage of a slow motor, at most, Q14: 24 %. Its ramp overshoots any level.
pub(super) const SLOW_BREAK_AWAY: i32 = 3_932;
/// Ends of the high and of the low part of a segment, in 1/256. Half of the time at low voltage: the dead zone is an
/// extrapolation from there, and random torque averages out.
const PARTS: (u32, u32) = (72, 220);
/// The same for a motor so slow that it has not shown its time constant: dynamics need their share.
const PARTS_SLOW: (u32, u32) = (110, 190);
/// Its first segment: before its blocks are chosen nothing counts.
const PARTS_SLOW_FIRST: (u32, u32) = (150, 210);
/// Share of rated speed, and counts, from which on a shaft that nothing drives is moved by a load: 1.6 %, 4.
/// Chosen by judgement; not studied.
const DRIFTS: i32 = 64;
const LEAST_DRIFT: i32 = 4;
/// Voltage of the first part of the verification, Q14: 0.44, within the range of the lowest knee that is supported.
const VERIFY: i32 = 7_209;
/// Full voltage, Q14.
const FULL: i32 = VoltageQ14::NOMINAL.0;

impl Params {
    /// Ticks that are waited for rest at most.
    pub(super) fn settle_ticks(&self) -> u32 {
        self.share(3)
    }

    /// Has it come to rest, or was that waited for long enough?
    #[inline]
    pub(super) fn stands(&self, state: &State) -> bool {
        // Which way a shaft starts that ran backwards shows only from rest.
        let longest = if state.course.doubt.is_some() { self.share(32) } else { self.settle_ticks() };
        state.still >= self.share(2) || state.elapsed >= longest
    }

    #[inline]
    pub(super) fn settle(&self, state: &mut State, input: &Input) {
        if state.stroke == 0 {
            state.restless |= input.count.wrapping_sub(state.start_count).saturating_abs() >= 2;
        }
        if !self.stands(state) {
            return;
        }
        // What moves by itself shows that it is seen.
        if self.pulse_test.is_some() && !state.pulses.proved && !state.restless {
            state.enter(Phase::PulseTest, input.count);
        } else if state.break_away[state.direction] == 0 {
            if state.stroke == 0 {
                self.go_with_the_load(state, input.count);
            }
            state.enter(Phase::BreakAway, input.count);
        } else {
            state.direction = self.first;
            state.stroke = 0;
            let shaken = state.pulses.ticks.saturating_sub(self.shaken);
            state.remaining = self.budget.saturating_sub(state.total.saturating_add(shaken));
            state.stroke_ticks = None;
            // An overshooting ramp overestimates; the lower of both directions still drives.
            state.identify.break_away = self
                .break_away_level(state, Direction::Positive)
                .min(self.break_away_level(state, Direction::Negative));
            state.enter(Phase::Learn, input.count);
        }
    }

    /// A load beyond friction turns the shaft without a voltage. The first ramp goes the way of the load: against it the shaft would
    /// run backwards, as behind a reversed encoder.
    #[cold]
    #[inline(never)]
    fn go_with_the_load(&self, state: &mut State, count: i32) {
        let moved = count.wrapping_sub(state.start_count);
        if moved.saturating_abs() >= (self.rated_counts(state.elapsed) / DRIFTS).max(LEAST_DRIFT) {
            state.direction = if moved > 0 { Direction::Positive } else { Direction::Negative };
            state.course.loaded = true;
        }
    }

    #[inline]
    pub(super) fn learn(&self, state: &mut State, input: &Input) {
        let length = self.learn_ticks(state);
        let part = (state.elapsed << 8) / length.max(256);
        let (high_until, low_until) = match state.timescale.found {
            Some(_) => PARTS,
            None if state.stroke == 0 => PARTS_SLOW_FIRST,
            None => PARTS_SLOW,
        };
        state.level = if part < high_until {
            HIGH
        } else if part < low_until {
            self.even_out(state, input);
            self.low(state)
        } else {
            (self.low(state) + HIGH) / 2
        };
        if state.stroke == 0
            && !state.shuttle.turned
            && state.level == HIGH
            && self.shows_time_constant(state, input)
        {
            state.stroke_ticks = None;
            self.choose_block(state);
        }
        if state.elapsed >= length {
            self.begin_coast(state, input);
        }
    }

    /// Within a short travel every stroke may come to its low voltage in the same direction: low voltage drives the one that has
    /// shown less, once a stroke and with a quarter of the travel before it.
    #[inline]
    fn even_out(&self, state: &mut State, input: &Input) {
        if state.shuttle.turned && !state.shuttle.evened {
            self.turn_to_the_other(state, input);
        }
    }

    #[cold]
    #[inline(never)]
    fn turn_to_the_other(&self, state: &mut State, input: &Input) {
        let seen = match &state.whole {
            Some(reading) if state.phase == Phase::Verify => reading.checks.each_ref().map(Check::windows),
            _ => state.identify.sums.each_ref().map(|sums| sums.rows),
        };
        let wanted = state.direction.reversed();
        let [lower, upper] = self.scale.travel_counts;
        if seen[wanted as usize] < seen[state.direction as usize]
            && self.room(state, wanted, input.count) > upper.saturating_sub(lower) / 4
        {
            state.direction = wanted;
            state.shuttle.evened = true;
        }
    }

    /// Has the first step shown something new about the time constant?
    #[inline]
    fn shows_time_constant(&self, state: &mut State, input: &Input) -> bool {
        if state.timescale.found.is_none() && self.is_limited_step(state) {
            return self.limited_step(state, input);
        }
        state.timescale.note(state.elapsed, state.displacement(input.count))
    }

    #[cold]
    #[inline(never)]
    fn begin_coast(&self, state: &mut State, input: &Input) {
        state.identify.relength(self.coast_lengths(state));
        state.voltage.loaded = false;
        state.after_coast = match state.phase {
            Phase::Saturate => Phase::Verify,
            _ => Phase::Learn,
        };
        state.enter(Phase::Coast, input.count);
    }

    #[inline]
    pub(super) fn coast(&self, state: &mut State, input: &Input) {
        if state.elapsed == u32::from(self.scale.config.pwm_delay_ticks) && input.load.0 != 0 {
            // From now on nothing is at the terminals, so windows need not be told from others by a voltage of zero.
            state.identify.relength(self.coast_lengths(state));
            state.voltage.loaded = true;
        }
        let stopped = state.still > self.identify.block_ticks(&state.identify.lengths);
        if state.elapsed < self.coast_ticks(state) && !stopped {
            return;
        }
        state.identify.relength(state.learn_lengths);
        if state.after_coast == Phase::Verify {
            state.solve_for(Structure::Shared);
            return state.enter(Phase::Verify, input.count);
        }
        self.next_stroke(state);
        if state.stroke == 1 {
            state.solve_for(Structure::Single(self.first));
        }
        let next = if state.stroke < self.strokes(state) {
            Phase::Learn
        } else {
            state.solve_for(Structure::Shared);
            state.stroke = 0;
            Phase::Saturate
        };
        self.start_before(state, next, input.count);
    }

    /// Strokes begin in both directions in turn, wherever a short travel has made the last one end.
    #[cold]
    #[inline(never)]
    fn next_stroke(&self, state: &mut State) {
        state.shuttle.evened = false;
        state.stroke = state.stroke.saturating_add(1);
        state.direction = if state.stroke.is_multiple_of(2) { self.first } else { self.first.reversed() };
    }

    /// The ramp of a motor that random torque pushes about may end below its dead zone. The low voltage then does not keep
    /// up the speed: it is raised, and what rows below the dead zone have taught is forgotten.
    #[cold]
    #[inline(never)]
    pub(super) fn heed_low_speed(&self, state: &mut State, window: &Window) {
        let direction = state.direction;
        let low = state.level == self.low(state) && state.level < MOST_BREAK_AWAY;
        if state.phase != Phase::Learn || !low || state.timescale.found.is_none() {
            return;
        }
        if state.raise_pause > 0 {
            state.raise_pause -= 1;
            return;
        }
        let speed = i64::from(window.speed * state.sign()) * 1024;
        let rated = i64::from(self.identify.rated_speed(&state.identify.lengths));
        if speed >= rated * i64::from(LEAST_LOW_1024) {
            return;
        }
        let idle = speed < rated * i64::from(IDLE_1024);
        state.break_away[direction] += if idle { RAISE_IDLE } else { RAISE };
        state.raise_pause = HOPS_PER_WINDOW as u8;
        if idle {
            state.identify.sums[direction] = Sums::default();
            for slice in state.slices.iter_mut().filter(|slice| slice.direction() == direction) {
                *slice = Slice::default();
            }
        }
    }

    /// Low voltage of the direction under way: just above break-away.
    #[inline]
    fn low(&self, state: &State) -> i32 {
        let above = match state.timescale.found {
            Some(_) => LOW_ABOVE_BREAK_AWAY,
            None => LOW_ABOVE_SLOW,
        };
        (self.break_away_level(state, state.direction) + above).min(MOST_BREAK_AWAY)
    }

    #[inline]
    pub(super) fn saturate(&self, state: &mut State, input: &Input) {
        state.level = FULL;
        if state.elapsed < self.saturate_ticks(state) {
            return;
        }
        state.voltage.full |= state.voltage.now;
        // A fast motor stopped before the coast test had its windows; from full speed it coasts longer.
        if state.mechanism == Mechanism::Unclear {
            self.begin_coast(state, input);
        } else {
            state.enter(Phase::Verify, input.count);
        }
    }

    #[inline]
    pub(super) fn verify(&self, state: &mut State, input: &Input) {
        self.even_out(state, input);
        state.level = if state.elapsed < self.verify_middle_ticks(state) { VERIFY } else { self.low(state) };
        if state.elapsed < self.verify_ticks(state) && !self.is_late(state) {
            return;
        }
        self.next_stroke(state);
        let next = if state.stroke < 2 {
            Phase::Saturate
        } else {
            // Once more, with what the verification added.
            state.solve_for(Structure::Shared);
            state.stroke = 0;
            Phase::Decide
        };
        state.enter(next, input.count);
    }
}
