//! What the firmware may know about its axis before it has moved, in SI units, and the check that every value can be.
//!
//! `Config` (SI) → [`Config::build`] → [`Scale`] (fixed point): the one place where a volt, a radian and a second turn
//! into machine units. Every stage derives its own `Params` from the [`Scale`].

mod field;
mod setting;
mod table;

use crate::units::VoltageQ14;
pub(crate) use field::within;
pub use field::{ConfigError, ScaleError};
pub use setting::{Setting, Value};
pub(crate) use table::LATEST;
pub use table::{Config, Field, SETTINGS};

/// Machine units of one axis. Voltages inside the tick are shares of the nominal supply (see [`crate::units`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The configuration it was built from.
    pub config: Config,
    /// Counts of the encoder per tick at rated speed, Q16 (LSB 2⁻¹⁶ counts per tick).
    pub rated_counts_per_tick_q16: u32,
    /// Supply converter count → voltage.
    pub supply: Supply,
    /// End stops in counts from power-up, `[lower, upper]`; the extremes of `i32` when the axis turns freely.
    pub travel_counts: [i32; 2],
}

impl Scale {
    /// V.
    pub fn volts(&self, voltage: VoltageQ14) -> f32 {
        voltage.0 as f32 * self.config.supply_nominal_v / VoltageQ14::NOMINAL.0 as f32
    }

    /// 1 rad in counts.
    #[must_use]
    pub fn counts_per_rad(&self) -> f32 {
        self.config.counts_per_rev as f32 / TWO_PI
    }

    /// 1 rad/s in counts per tick.
    #[must_use]
    pub fn counts_per_tick(&self) -> f32 {
        self.counts_per_rad() / self.config.tick_hz as f32
    }
}

/// The supply's converter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Supply {
    /// `(raw · this) >> 16` is Q14 of nominal supply.
    per_raw_q16: i32,
}

impl Supply {
    /// Supply in Q14 of nominal from the converter's count; nominal when it is not measured.
    #[inline]
    pub fn voltage(self, vbus_raw: u16) -> VoltageQ14 {
        match vbus_raw {
            crate::sample::Sample::VBUS_NOT_MEASURED => VoltageQ14::NOMINAL,
            // Saturates at twice the nominal supply, where protection has long acted: wrapped, it would turn negative.
            raw => VoltageQ14((i32::from(raw).saturating_mul(self.per_raw_q16)) >> 16),
        }
    }
}

const TWO_PI: f32 = 6.283_185_5;

impl Config {
    /// Checks every field and turns the configuration into machine units.
    pub fn build(&self) -> Result<Scale, ConfigError> {
        self.check()?;
        let counts_per_rad = self.counts_per_rev as f32 / TWO_PI;
        let per_tick = self.rated_speed_rad_s * counts_per_rad / self.tick_hz as f32;
        within(Field::CountsPerTick, per_tick, 0.002, 2000.0)?;
        let stop = |limit: f32| (limit * self.gear_ratio * counts_per_rad) as i32;
        Ok(Scale {
            config: *self,
            rated_counts_per_tick_q16: (per_tick * 65536.0) as u32,
            supply: Supply {
                per_raw_q16: (self.vbus_v_per_lsb / self.supply_nominal_v * 1_073_741_824.0) as i32,
            },
            travel_counts: self.travel_limit_rad.map_or([i32::MIN, i32::MAX], |limit| limit.map(stop)),
        })
    }
}
