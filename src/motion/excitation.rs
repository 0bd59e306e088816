//! Excitation without a loop: a sine or a chirp of voltage at the terminals.
//!
//! ```text
//! u = A·sin φ      φ̇ = 2π·f      f = f₀ + (f₁ − f₀)·t/T      linear
//!                                f = f₀·(f₁/f₀)^(t/T)         logarithmic: equal time for every octave
//! ```
//!
//! Phase and frequency are integers that grow by addition, so nothing drifts: the frequency is exact to 10⁻⁶ of the
//! span for a linear chirp and 10⁻³ for a logarithmic one. The sine is that of the set-points, [`crate::motion::sine`].
//!
//! A motor without identified gains can be excited; the identification in ordinary motion learns from it. Nothing is
//! compensated: the voltage stands at the terminals.

use crate::config::{ConfigError, Field, Scale, within};
use crate::units::{Voltage, mul_shift_within, sin, to_fixed, whole};
use micromath::F32Ext;
use serde::{Deserialize, Serialize};

/// Smallest amplitude, share of the nominal supply.
const LEAST_AMPLITUDE: f32 = 0.001;
/// Lowest frequency, Hz.
const LOWEST_HZ: f32 = 0.01;
/// Fewest ticks a turn: with fewer the held voltage has little of a sine left.
const FEWEST_TICKS: f32 = 20.0;
/// Length, s.
const SHORTEST_S: f32 = 0.1;
const LONGEST_S: f32 = 3_600.0;

/// How the frequency gets from its first to its last value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sweep {
    /// The same change in every second.
    #[default]
    Linear,
    /// The same factor in every second.
    Logarithmic,
}

/// What to apply.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Waveform {
    /// Amplitude, V. 0.001 of the nominal supply … all of it, or the voltage limit.
    pub amplitude_v: f32,
    /// Frequency at the beginning, Hz. 0.01 … a twentieth of the control rate.
    pub from_hz: f32,
    /// Frequency at the end, Hz; the same for a sine. Range as above.
    pub to_hz: f32,
    /// How it gets there.
    pub sweep: Sweep,
    /// Length, ms. 100 … 3,600,000.
    pub duration_ms: u32,
}

impl Waveform {
    /// Checks every number and turns them into machine units.
    pub fn plan(&self, scale: &Scale) -> Result<Excitation, ConfigError> {
        let (supply, rate) = (scale.config.supply_nominal_v, scale.config.tick_hz as f32);
        let amplitude = self.amplitude_v;
        within(
            Field::ExcitationAmplitude,
            amplitude,
            LEAST_AMPLITUDE * supply,
            scale.config.voltage_limit_v.get().unwrap_or(supply),
        )?;
        let highest = rate / FEWEST_TICKS;
        within(Field::ExcitationFrom, self.from_hz, LOWEST_HZ, highest)?;
        within(Field::ExcitationTo, self.to_hz, LOWEST_HZ, highest)?;
        let seconds = self.duration_ms as f32 / 1000.0;
        within(Field::ExcitationDuration, seconds, SHORTEST_S, LONGEST_S)?;
        let ticks = seconds * rate;
        Ok(Excitation {
            amplitude: to_fixed(amplitude / supply, Voltage::BITS),
            phase: 0,
            increment: turns(self.from_hz / rate),
            change: match self.sweep {
                Sweep::Linear => Change::by_slope((self.to_hz - self.from_hz) / rate / ticks),
                Sweep::Logarithmic => Change::by_ratio(self.from_hz, self.to_hz, ticks),
            },
            left: ticks as u32,
        })
    }
}

/// A waveform under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Excitation {
    /// A, nominal supplies, Q20.
    amplitude: i32,
    /// φ, turns, Q64, wraps.
    phase: u64,
    /// Turns per tick, Q64.
    increment: u64,
    change: Change,
    /// Ticks still to come.
    left: u32,
}

impl Excitation {
    /// The voltage of this tick; `None` behind the last.
    pub fn step(&mut self) -> Option<Voltage> {
        self.left = self.left.checked_sub(1)?;
        let sine = sin((self.phase >> 32) as u32);
        self.phase = self.phase.wrapping_add(self.increment);
        self.increment = self.change.after(self.increment);
        Some(Voltage(mul_shift_within(self.amplitude, sine, 30)))
    }

    /// Frequency of the next tick, turns per tick, Q32.
    #[must_use]
    pub fn frequency(&self) -> u32 {
        (self.increment >> 32) as u32
    }
}

/// What becomes of the frequency from one tick to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    /// So much is added, turns per tick², Q64.
    Slope(i64),
    /// `mantissa · 2^−shift` of it, Q32, is added or taken away.
    Share { mantissa: u32, shift: u32, falls: bool },
}

impl Change {
    fn by_slope(turns_per_tick2: f32) -> Self {
        Change::Slope(whole(turns_per_tick2 * TURN))
    }

    /// (f₁/f₀)^(1/n) − 1. `micromath`'s logarithm is right to 3·10⁻⁴, which is the relative error of the last frequency.
    fn by_ratio(from: f32, to: f32, ticks: f32) -> Self {
        let falls = to < from;
        let ratio = if falls { from / to } else { to / from };
        let exponent = F32Ext::ln(ratio) / ticks;
        let exponent = if falls { -exponent } else { exponent };
        // expm1 by its series: at most 0.12, so that the next term is below 10⁻⁵.
        let mut share = exponent * (1.0 + exponent * (0.5 + exponent / 6.0));
        if falls {
            share = -share;
        }
        let mut shift = 0;
        // As many bits as there are; a chirp over 0.1 % in an hour needs 36 doublings.
        while share < 0.5 && shift < MOST_DOUBLINGS {
            share *= 2.0;
            shift += 1;
        }
        Change::Share { mantissa: (share * 4_294_967_296.0) as u32, shift, falls }
    }

    fn after(self, increment: u64) -> u64 {
        match self {
            Change::Slope(slope) => increment.wrapping_add_signed(slope),
            Change::Share { mantissa, shift, falls } => {
                let high = (increment >> 32).wrapping_mul(u64::from(mantissa));
                let low = (increment & 0xffff_ffff).wrapping_mul(u64::from(mantissa)) >> 32;
                let share = high.wrapping_add(low) >> (shift & 63);
                if falls { increment.wrapping_sub(share) } else { increment.wrapping_add(share) }
            }
        }
    }
}

/// A turn, Q64.
const TURN: f32 = 18_446_744_073_709_551_616.0;
/// Doublings that find the leading bit of a share.
const MOST_DOUBLINGS: u32 = 40;

fn turns(per_tick: f32) -> u64 {
    whole(per_tick * TURN) as u64
}
