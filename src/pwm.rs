//! Volts → duty, the supply behind it, and what the bridge really does after the PWM's delay.
//!
//! The compare registers of a timer are preloaded: a duty that is computed in tick k acts from tick k + D on
//! (D = `pwm_delay_ticks`). Whoever learns from voltage and count must be told the voltage that acts, so the commands
//! on their way are kept here, and the acting one is multiplied by the supply of its own tick.

use crate::config::{Scale, Supply};
use crate::sample::{Bridge, Sample};
use crate::units::{Voltage, limited, mul_shift};

/// Longest delay, ticks.
const LONGEST_DELAY: usize = 3;
/// Lowest supply that the duty is computed for, Q14 of nominal: an eighth. Below it protection has switched off.
const LOWEST_SUPPLY: i32 = 1 << 11;
/// The supply for the division is smoothed over 2⁴ ticks.
const SMOOTHING_BITS: u32 = 4;
/// The smoothed supply is followed only once it has moved by 2⁻⁸ of nominal: converter noise would make a resting duty flicker.
const HYSTERESIS: i32 = 1 << 12;
/// Fraction bits of the smoothed supply.
const SUPPLY_BITS: u32 = 20;

/// State of the bridge with its duty in PWM counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drive {
    /// State of the bridge.
    pub bridge: Bridge,
    /// PWM counts, 0 unless driven.
    pub duty: i16,
}

/// What the modulator remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Commands on their way, newest first.
    line: [Drive; LONGEST_DELAY],
    /// Smoothed supply, Q20 of nominal; 0 before the first sample.
    smooth: i32,
    /// The supply that is divided by, Q20 of nominal.
    supply: i32,
}

impl State {
    /// Puts a command on its way.
    #[inline]
    pub fn queue(&mut self, drive: Drive) {
        let [newest, older, _] = self.line;
        self.line = [drive, newest, older];
    }
}

/// Constants of the modulator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    supply: Supply,
    /// PWM counts of full duty.
    full_scale: i32,
    /// 1/full_scale, Q30.
    per_count: i32,
    delay: usize,
}

impl Params {
    /// Constants for an axis.
    #[must_use]
    pub fn new(scale: &Scale) -> Self {
        let full_scale = i32::from(scale.config.pwm_full_scale);
        Self {
            supply: scale.supply,
            full_scale,
            per_count: (1 << 30) / full_scale.max(1),
            delay: usize::from(scale.config.pwm_delay_ticks).clamp(1, LONGEST_DELAY),
        }
    }

    /// Measured supply; the nominal one when it is not measured.
    #[inline]
    pub fn supply(&self, state: &mut State, sample: &Sample) -> Voltage {
        let now = Voltage::from_q14(self.supply.voltage(sample.vbus_raw));
        let step = now.0.saturating_sub(state.smooth) >> SMOOTHING_BITS;
        let first = state.supply == 0;
        state.smooth = if first { now.0 } else { state.smooth.saturating_add(step) };
        if state.smooth.saturating_sub(state.supply).saturating_abs() > HYSTERESIS {
            state.supply = state.smooth;
        }
        now
    }

    /// The command that acts from this tick to the next.
    #[must_use]
    #[inline]
    pub fn acting(&self, state: &State) -> Drive {
        let [newest, older, oldest] = state.line;
        match self.delay {
            1 => newest,
            2 => older,
            _ => oldest,
        }
    }

    /// The command that acted just before the acting one, or that acts just behind it, whichever is remembered.
    #[must_use]
    pub fn beside_acting(&self, state: &State) -> Drive {
        let [_, older, oldest] = state.line;
        if self.delay == 2 { oldest } else { older }
    }

    /// Terminal voltage of a command at this supply.
    #[must_use]
    #[inline]
    pub fn terminal(&self, drive: Drive, supply: Voltage) -> Voltage {
        let ratio = i32::from(drive.duty).saturating_mul(self.per_count);
        Voltage(mul_shift(ratio, supply.0, 30))
    }

    /// Highest terminal voltage that the supply allows.
    #[must_use]
    #[inline]
    pub fn ceiling(&self, state: &State) -> Voltage {
        Voltage(state.supply)
    }

    /// The duty that brings `voltage` (within the ceiling) to the terminals; queued behind the delay.
    #[inline]
    pub fn modulate(&self, state: &mut State, bridge: Bridge, voltage: Voltage) -> Drive {
        let duty = if bridge == Bridge::Driven { self.duty(state, voltage) } else { 0 };
        let drive = Drive { bridge, duty };
        state.queue(drive);
        drive
    }

    /// `voltage / supply · full scale`, rounded to nearest. One 32-bit division.
    #[inline]
    fn duty(&self, state: &State, voltage: Voltage) -> i16 {
        let supply = (state.supply >> (SUPPLY_BITS - 14)).max(LOWEST_SUPPLY) as u32;
        let inverse = ((1u32 << 31) / supply) as i32; // Q17 of 1/nominal
        let ratio = mul_shift(voltage.0, inverse, 17);
        let counts = mul_shift(ratio, self.full_scale, Voltage::BITS);
        limited(counts, self.full_scale) as i16
    }
}
