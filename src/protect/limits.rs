//! What must stay within bounds: supply, current, speed, and the time since the last command.

use super::expectation::Expectation;
use super::fault::Fault;
use super::looks::looks;
use super::{Input, Settings};
use crate::config::{Config, Scale};
use crate::optional::Optional;
use crate::units::{Speed, Voltage, ticks_in, to_fixed};

/// Conditions of supply and speed must last 1/200 s.
const PERSISTENCE_HZ: f32 = 200.0;
/// The axis keeps the current at its limit by itself, with some ripple: what exceeds it by more than a sixteenth is summed up, at most
/// as much again as the limit in each look. It is a fault once the sum is that of twice the limit during 1/100 s.
const RIPPLE_SHIFT: u32 = 4;
/// Converter counts of noise and rounding that do not count: a low limit is a few counts.
const NOISE: i32 = 2;
/// The least current that is a fault if it lasts, limits.
pub const OVER_CURRENT: f32 = 1.0 + 1.0 / (1u32 << RIPPLE_SHIFT) as f32;
const EXCESS_HZ: f32 = 100.0;
/// Shares of the nominal supply beyond which it is a fault, where nobody asked for others.
const LOWEST_SUPPLY: f32 = 0.5;
const HIGHEST_SUPPLY: f32 = 1.5;

/// The voltage above which the supply is a fault.
pub fn highest_supply_v(config: &Config) -> f32 {
    config.supply_high_v.get().unwrap_or(HIGHEST_SUPPLY * config.supply_nominal_v)
}

/// One row a condition that must last, in the order in which they are named: its fault, and whether it holds. Its bit in
/// [`State::holds`] is its place.
macro_rules! lasting {
    ($params:ident, $state:ident, $expectation:ident, $input:ident; $($fault:ident: $holds:expr,)+) => {
        const LASTING: [Fault; [$(Fault::$fault),+].len()] = [$(Fault::$fault),+];
        // A bit each.
        const _: () = assert!(LASTING.len() <= u8::BITS as usize);

        enum Place {
            $($fault,)+
        }

        impl Params {
            #[inline]
            fn conditions(&self, $state: &State, $expectation: &Expectation, $input: &Input) -> u8 {
                let $params = self;
                0 $(| u8::from($holds) << Place::$fault as u8)+
            }
        }
    };
}

lasting! { params, state, expectation, input;
    SupplyLow: input.supply.is_some_and(|supply| supply < params.lowest_supply),
    SupplyHigh: input.supply.is_some_and(|supply| supply > params.highest_supply),
    SupplyNotMeasured: state.supply_seen && input.supply.is_none(),
    Overspeed: params.highest_speed.is_some_and(|limit| input.speed.0.saturating_abs() > limit.0),
    Runaway: input.speed.0.saturating_abs() > expectation.runaway().0,
}

/// Thresholds of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Params {
    lowest_supply: Voltage,
    highest_supply: Voltage,
    /// `None`: not limited.
    highest_speed: Option<Speed>,
    /// Converter counts; `None`: not limited.
    highest_current: Option<u16>,
    /// Sum of what exceeds it, converter counts · looks.
    most_excess: i32,
    /// Looks.
    persistence: u16,
    /// Looks without a command; 0: any number.
    timeout: u32,
}

/// What is remembered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// What exceeds the current limit, summed up: converter counts · looks.
    excess: i32,
    /// Bit n: condition n of [`LASTING`] holds since `since` looks.
    holds: u8,
    since: u16,
    supply_seen: bool,
    /// Looks since the last command.
    silence: u32,
}

impl State {
    /// A command has arrived.
    pub fn heard(&mut self) {
        self.silence = 0;
    }

    /// Forgets what only looked like a fault.
    pub fn clear(&mut self) {
        *self = Self { supply_seen: self.supply_seen, ..Self::default() };
    }
}

impl Params {
    pub fn new(scale: &Scale, settings: &Settings) -> Self {
        let config = &scale.config;
        let counts = config.counts_per_rev as f32 / (2.0 * core::f32::consts::PI * config.tick_hz as f32);
        let (look_hz, bits) = looks(scale);
        let supply = |limit: Optional, share: f32| {
            let share = limit.get().map_or(share, |limit| limit / config.supply_nominal_v);
            Voltage(to_fixed(share, Voltage::BITS))
        };
        let highest_current =
            config.current_limit_a.get().map(|limit| (limit / config.current_a_per_lsb) as u16);
        let ticks = ticks_in(settings.command_timeout_ms.into(), config.tick_hz);
        Self {
            lowest_supply: supply(config.supply_low_v, LOWEST_SUPPLY),
            highest_supply: supply(config.supply_high_v, HIGHEST_SUPPLY),
            highest_speed: config.speed_limit_rad_s.get().map(|limit| Speed(to_fixed(limit * counts, 20))),
            highest_current,
            most_excess: i32::from(highest_current.unwrap_or(0)).saturating_mul((look_hz / EXCESS_HZ) as i32),
            persistence: (look_hz / PERSISTENCE_HZ) as u16,
            timeout: ticks >> bits,
        }
    }

    /// The first condition that has lasted.
    #[inline]
    pub fn step(&self, state: &mut State, expectation: &Expectation, input: &Input) -> Fault {
        if self.unheard(state, input) {
            return Fault::CommandTimeout;
        }
        if self.exceeds(state, input) {
            return Fault::OverCurrent;
        }
        state.supply_seen |= input.supply.is_some();
        let now = self.conditions(state, expectation, input);
        let before = core::mem::replace(&mut state.holds, now);
        if now == 0 {
            return Fault::None;
        }
        // Another condition that joins does not lengthen the wait for the one that lasts.
        state.since = if now & before == 0 { 1 } else { state.since.saturating_add(1) };
        if state.since < self.persistence {
            return Fault::None;
        }
        let lasting = (now & before).trailing_zeros() as usize;
        LASTING.get(lasting).copied().unwrap_or_default()
    }

    /// Is the current above its limit although the voltage gives way?
    #[inline]
    fn exceeds(&self, state: &mut State, input: &Input) -> bool {
        match (self.highest_current, input.current) {
            (Some(limit), Some(current)) if current.unsigned_abs() > limit || state.excess > 0 => {
                self.sum_excess(state, i32::from(current), i32::from(limit))
            }
            _ => false,
        }
    }

    #[cold]
    #[inline(never)]
    fn sum_excess(&self, state: &mut State, current: i32, limit: i32) -> bool {
        let beyond = current
            .saturating_abs()
            .saturating_sub(limit.saturating_add(limit >> RIPPLE_SHIFT).saturating_add(NOISE));
        state.excess = state.excess.saturating_add(beyond.min(limit).max(limit.saturating_neg())).max(0);
        state.excess > self.most_excess
    }

    /// No command for too long, while a motion goes on that does not end by itself.
    #[inline]
    fn unheard(&self, state: &mut State, input: &Input) -> bool {
        state.silence = if input.endless { state.silence.saturating_add(1) } else { 0 };
        self.timeout != 0 && state.silence > self.timeout
    }
}
