//! I²t: how warm the winding is, from its current.
//!
//! ```text
//! τ·ḣ = i² − h        h = i∞² in a steady state; the limit is the square of the continuous current
//! ```
//!
//! The first-order model of IEC 60255-149 without its cold state: power-up counts as cold, so a drive that is switched
//! off and on again while hot is not protected until it has warmed the model up anew.

use super::looks::looks;
use crate::config::{ConfigError, Field, Scale, within};
use serde::{Deserialize, Serialize};

/// Looks over which i² is averaged: a power of two.
const BLOCK_BITS: u32 = 6;

/// What the motor's data sheet says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thermal {
    /// Current that the winding carries for ever, A.
    pub continuous_a: f32,
    /// Time constant of its temperature, s. 1 … 3,600.
    pub time_constant_s: u16,
}

impl Thermal {
    pub(super) fn build(&self, scale: &Scale) -> Result<Params, ConfigError> {
        let config = &scale.config;
        let range = f32::from(i16::MAX) * config.current_a_per_lsb;
        within(Field::ContinuousCurrent, self.continuous_a, config.current_a_per_lsb, range)?;
        let seconds = f32::from(self.time_constant_s);
        within(Field::ThermalTimeConstant, seconds, 1.0, 3600.0)?;
        let raw = self.continuous_a / config.current_a_per_lsb;
        let (look_hz, _) = looks(scale);
        let blocks = seconds * look_hz / (1u32 << BLOCK_BITS) as f32;
        Ok(Params { limit: (raw * raw) as u32, rate: (4_294_967_296.0 / blocks) as u32 })
    }
}

/// The model in machine units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Params {
    /// Square of the continuous current, converter counts².
    limit: u32,
    /// Share of the way to i² in one block, Q32.
    rate: u32,
}

/// What the model remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// Σ i² of this block.
    sum: u64,
    looks: u32,
    /// Converter counts², Q32.
    heat: u64,
}

impl Params {
    /// One look; is the winding too warm?
    pub fn step(&self, state: &mut State, current: i16) -> bool {
        let magnitude = u32::from(current.unsigned_abs());
        state.sum = state.sum.wrapping_add(u64::from(magnitude.wrapping_mul(magnitude)));
        state.looks = state.looks.wrapping_add(1);
        if state.looks >> BLOCK_BITS != 0 {
            let mean = (state.sum >> BLOCK_BITS) as u32;
            let heat = (state.heat >> 32) as u32;
            let step = u64::from(mean.abs_diff(heat)).wrapping_mul(u64::from(self.rate));
            state.heat =
                if mean > heat { state.heat.saturating_add(step) } else { state.heat.saturating_sub(step) };
            (state.sum, state.looks) = (0, 0);
        }
        (state.heat >> 32) as u32 > self.limit
    }
}
