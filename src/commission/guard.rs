//! What must not go on, and where the motor must turn back.

use super::{Input, Params, Phase, State};
use crate::config::Scale;
use crate::identify::estimate::Reason;
use crate::units::{Direction, VoltageQ14, whole};

/// Voltage at which every motor that has broken away keeps turning, Q14: 0.5.
const HARD: i32 = 8_192;
/// The same above twice the voltage of its starts, Q14: 1/16.
const CERTAIN_ABOVE: i32 = 1_024;
/// Counts that a look holds at rated speed.
const LOOK_COUNTS: u32 = 32;
/// Supply outside of which the commissioning means nothing, Q14: 70 % and 140 % of nominal.
const SUPPLY: core::ops::RangeInclusive<i32> = 11_469..=22_938;

/// Where the commissioning must stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    /// Ticks without a count while driven hard.
    still_ticks: u32,
    /// Σ |voltage · current| in Q14 of nominal times converter counts.
    energy: u64,
    /// Time constant to brake with before it is known, ticks.
    time_constant: u32,
    /// Ticks of one speed measurement.
    pub(super) step_ticks: u32,
    /// Of these in a look: it then holds 32 counts at rated speed, or lasts a quarter of a second.
    pub(super) steps: u8,
    /// Counts in it at the speed limit.
    step_counts: u32,
}

/// What a short travel has changed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shuttle {
    /// It was too short for a segment in one go.
    pub(super) turned: bool,
    /// Low voltage has changed its direction in this stroke.
    pub(super) evened: bool,
}

impl Limits {
    pub(super) fn new(scale: &Scale) -> Self {
        let config = &scale.config;
        let joule_ticks = scale.volts(VoltageQ14(1)) * config.current_a_per_lsb / config.tick_hz as f32;
        let step_ticks = (config.tick_hz / 64).max(1);
        let counts_per_tick_per_rad_s =
            scale.rated_counts_per_tick_q16 as f32 / 65_536.0 / config.rated_speed_rad_s;
        let step = |limit: f32| (limit * counts_per_tick_per_rad_s * step_ticks as f32) as u32;
        Limits {
            // Eight counts at 2 % of rated speed, at least 0.2 s: a slow motor lingers while it turns.
            still_ticks: (400 * 65_536 / scale.rated_counts_per_tick_q16.max(1)).max(config.tick_hz / 5),
            energy: config.energy_limit_j.get().map_or(u64::MAX, |limit| whole(limit / joule_ticks) as u64),
            time_constant: (config.time_constant_hint_s.get().unwrap_or(0.1) * 2.0 * config.tick_hz as f32)
                as u32,
            step_ticks,
            steps: (LOOK_COUNTS * 65_536 / scale.rated_counts_per_tick_q16.max(1) / step_ticks + 1).min(16)
                as u8,
            step_counts: config.speed_limit_rad_s.get().map_or(u32::MAX, step),
        }
    }
}

impl Params {
    #[inline]
    fn beyond_travel(&self, state: &State, input: &Input) -> bool {
        let [lower, upper] = self.scale.travel_counts;
        let position = input.count.wrapping_sub(state.zero);
        lower != i32::MIN && (position < lower || position > upper)
    }

    /// What must not go on. Asked in every tick: what is rare hides behind one comparison each.
    #[inline]
    pub(super) fn guard(&self, state: &State, input: &Input) -> Option<Reason> {
        let supply = input.supply.unwrap_or(VoltageQ14::NOMINAL).0;
        if !SUPPLY.contains(&supply) {
            Some(if state.course.supplied { Reason::SupplyMoved } else { Reason::SupplyNotNominal })
        } else if self.beyond_travel(state, input) {
            Some(Reason::TravelExceeded)
        } else if state.still > self.limits.still_ticks && state.elapsed > self.limits.still_ticks {
            self.lost(state, input)
        } else if state.course.has_stepped(self.limits.step_ticks) {
            self.spends(state)
        } else {
            None
        }
    }

    /// A shaft that stands: does it although it is driven hard?
    #[cold]
    #[inline(never)]
    fn lost(&self, state: &State, input: &Input) -> Option<Reason> {
        let level = state.level.min(input.net().0.saturating_abs());
        let driven_hard = level >= HARD.min(self.certain(state))
            && matches!(state.phase, Phase::Learn | Phase::Saturate | Phase::Verify);
        driven_hard.then(|| state.or_limited(Reason::MotionLost))
    }

    /// What ends with a budget or a limit of speed, 64 times a second.
    #[cold]
    #[inline(never)]
    fn spends(&self, state: &State) -> Option<Reason> {
        if state.spent() > self.most {
            Some(Reason::TooShort)
        } else if state.energy > self.limits.energy {
            Some(Reason::EnergySpent)
        } else {
            (state.last_step > self.limits.step_counts).then_some(Reason::Overspeed)
        }
    }

    /// Has the last part to end, so that there is time for the decision?
    #[inline]
    pub(super) fn is_late(&self, state: &State) -> bool {
        state.spent() > self.most - self.scale.config.tick_hz / 8
    }

    /// Voltage at which a shaft that has broken away turns for certain: far above what that took.
    #[inline]
    fn certain(&self, state: &State) -> i32 {
        match state.restless {
            true => HARD,
            false => 2 * state.started[0].max(state.started[1]) + CERTAIN_ABOVE,
        }
    }

    /// Within a limited travel the motor shuttles: direction changes where it would otherwise run into the end.
    #[inline]
    pub(super) fn turn_before_the_stop(&self, state: &mut State, input: &Input) {
        let [lower, _] = self.scale.travel_counts;
        let free =
            lower == i32::MIN || !matches!(state.phase, Phase::Learn | Phase::Saturate | Phase::Verify);
        if free {
            return;
        }
        if self.room(state, state.direction, input.count) < self.stopping_distance(state) {
            state.direction = state.direction.reversed();
            state.shuttle.turned = true;
        }
    }

    /// Counts to the end of the travel in this direction.
    #[inline]
    pub(super) fn room(&self, state: &State, direction: Direction, count: i32) -> i32 {
        let [lower, upper] = self.scale.travel_counts;
        let position = count.wrapping_sub(state.zero);
        match direction {
            Direction::Positive => upper.saturating_sub(position),
            Direction::Negative => position.saturating_sub(lower),
        }
    }

    /// Counts until rest with shorted terminals, speed · time constant, plus what the speed measurement lags behind and
    /// 1/32 of the travel.
    #[inline]
    fn stopping_distance(&self, state: &State) -> i32 {
        let [lower, upper] = self.scale.travel_counts;
        let known = state.timescale.found.unwrap_or(state.timescale.at_least.saturating_mul(2));
        let time_constant = if known > 0 { known } else { self.limits.time_constant };
        let steps = time_constant / self.limits.step_ticks + 2;
        let braking = state.last_step.saturating_mul(steps).min(1 << 30) as i32;
        braking.saturating_add(upper.saturating_sub(lower) / 32)
    }

    /// Counts travelled in the last 1/64 s.
    #[inline]
    pub(super) fn measure_speed(&self, state: &mut State, input: &Input) {
        if state.course.until_step > 0 {
            state.course.until_step -= 1;
        } else {
            state.course.until_step = self.limits.step_ticks - 1;
            state.course.supplied = true;
            state.course.step(self.limits.steps, input.count, state.travel);
            state.last_step = input.count.wrapping_sub(state.step_count).unsigned_abs();
            state.step_count = input.count;
        }
    }
}
