//! What a current limit that holds the voltage back means for a commissioning.
//!
//! Windows are learned with the voltage that acts, so they are as good as any. What was asked for is not what acted, though: ramps
//! are read by the acting voltage, the time constant is not seen in a step that was none, and a shaft that stays where it is may be
//! held by the limit alone.

use super::{Input, NO_CURRENT, Params, State};
use crate::identify::estimate::{Estimates, Reason, Standing};

/// Share of a break-away voltage that friction takes from a shaft that turns, in quarters: 3/4.
const KINETIC_QUARTERS: i32 = 3;
/// Share of the ticks in which the limit has acted from which on it is why something could not be learned, as a shift: 1/16.
const MUCH_SHIFT: u32 = 4;

/// Where the limit acts and where it has, and whether the supply was not measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Conditions {
    /// The supply was not measured in every tick.
    pub unmeasured: bool,
    /// The limit acts: in the last tick.
    pub now: bool,
    /// Ticks in all.
    ticks: u32,
    /// At the end of full voltage, in one of the directions.
    pub full: bool,
    /// In the coast under way nothing is at the terminals any more, and a load over the place is known.
    pub loaded: bool,
    /// Voltage beyond friction since the step began, Q14 · ticks; `None`: the step was not held back.
    step: Option<i64>,
}

impl State {
    /// Call it in every tick, before its step: does the current limit hold the voltage back?
    #[inline]
    pub(crate) fn holds_back(&mut self, acts: bool) {
        self.voltage.now = acts;
        if acts {
            self.voltage.ticks = self.voltage.ticks.wrapping_add(1);
        }
    }

    /// The voltage of a ramp: what was asked for, or what the limit has left of it.
    #[inline]
    pub(super) fn ramp_level(&self, input: &Input) -> i32 {
        let acting = input.net().0.saturating_mul(self.sign());
        if self.voltage.now { self.level.min(acting).max(0) } else { self.level }
    }

    /// Why something is missing: because of the limit, if that has acted for a good part of the time.
    #[cold]
    #[inline(never)]
    pub(super) fn or_limited(&self, reason: Reason) -> Reason {
        if self.voltage.ticks > self.total >> MUCH_SHIFT { Reason::CurrentLimited } else { reason }
    }

    /// Has the limit acted?
    pub(super) fn limited(&self) -> bool {
        self.voltage.ticks > 0
    }

    /// Numbers that are missing or doubtful because the limit has kept the speed from varying, or the voltage from rising.
    #[cold]
    #[inline(never)]
    pub(super) fn blame_limit(&mut self) {
        // A gain that contradicts the axis file rests on speeds that were too low: it shows again, or not, once the limit is raised.
        use Reason::{NotExcited, NotSeen, NotVerified, SpeedContradicts, TooUncertain};
        let much = self.or_limited(Reason::NotExcited) == Reason::CurrentLimited;
        let full = self.voltage.full;
        let Estimates {
            dead_zone: [forwards, backwards], saturation: [high, low], gain, time_constant, ..
        } = &mut self.outcome.estimates;
        for (estimate, limited) in [(forwards, much), (backwards, much), (gain, much), (time_constant, much)]
            .into_iter()
            .chain([(high, full), (low, full)])
        {
            match &mut estimate.standing {
                Standing::Doubtful(reason) | Standing::Missing(reason)
                    if limited
                        && matches!(
                            reason,
                            NotExcited | NotSeen | NotVerified | SpeedContradicts | TooUncertain
                        ) =>
                {
                    *reason = Reason::CurrentLimited;
                }
                _ => {}
            }
        }
    }
}

impl Params {
    /// Mean current that counts as none, converter counts: that of a sensor without current, or half of a limit that is lower than twice that.
    #[cold]
    #[inline(never)]
    pub(super) fn no_current(&self) -> i32 {
        let config = &self.scale.config;
        let limit = config.current_limit_a.get();
        let counts = limit.map_or(i32::MAX, |limit| (limit / config.current_a_per_lsb) as i32);
        (counts / 2).clamp(1, NO_CURRENT)
    }

    /// The time constant of a step that the limit makes a slope, as soon as it can be told; true: it is known from now on.
    ///
    /// ```text
    /// τ·ω = k·∫(v − d)dt − x        ω = 2x/t at a constant current
    /// ```
    #[cold]
    #[inline(never)]
    pub(super) fn limited_step(&self, state: &mut State, input: &Input) -> bool {
        let direction = state.direction;
        let displacement = state.displacement(input.count);
        let friction = state.break_away[direction] / 4 * KINETIC_QUARTERS;
        let drives = i64::from(input.net().0.saturating_mul(state.sign()).saturating_sub(friction).max(0));
        let sum = state.voltage.step.unwrap_or(0).saturating_add(drives);
        state.voltage.step = Some(sum);
        if displacement < LEAST_COUNTS {
            return false;
        }
        // Rated counts a tick are Q16, voltages Q14.
        let given = sum.saturating_mul(i64::from(self.scale.rated_counts_per_tick_q16)) >> 30;
        let given = given.min(1 << 30) as i32;
        let left = given.saturating_sub(displacement).max(displacement >> 3);
        // In single precision: a division of 64 bits would take 900 bytes of the image.
        let ticks = left as f32 * state.elapsed as f32 / (2.0 * displacement as f32);
        state.timescale.is_about((ticks as u32).clamp(1, 1 << 24));
        true
    }

    /// Is the first step one that the limit makes a slope?
    #[inline]
    pub(super) fn is_limited_step(&self, state: &State) -> bool {
        state.voltage.now || state.voltage.step.is_some()
    }
}

/// Counts after which the speed is told well enough.
const LEAST_COUNTS: i32 = 64;
