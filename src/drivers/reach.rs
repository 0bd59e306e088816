//! How far the sensors of a board reach, and which limits could therefore never act.
//!
//! A reading never exceeds the converter's full scale. A limit at or above it is a limit that nothing can exceed: it is
//! refused, with the largest value that would act.

use crate::config::{Config, ConfigError, Field, within};
use crate::protect::{self, Settings};

/// The largest readings of a board, converter counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// Of the supply.
    pub supply: u16,
    /// Of the winding current, on either side of its zero; 0: not sensed.
    pub current: u16,
}

impl Reach {
    /// What a [`crate::axis::Sample`] can hold.
    pub const WORDS: Self = Self { supply: u16::MAX - 1, current: i16::MAX as u16 };

    /// Refuses a limit that no reading can exceed. `protection`: what was chosen about it, if that is known.
    ///
    /// # Errors
    /// The field, and the largest value of it that can act.
    pub fn allows(&self, config: &Config, protection: Option<&Settings>) -> Result<(), ConfigError> {
        // A limit acts above it: the last count but one is the largest.
        let most = |counts: u16, per_lsb: f32| f32::from(counts.saturating_sub(1)) * per_lsb;
        let (supply, current) =
            (most(self.supply, config.vbus_v_per_lsb), most(self.current, config.current_a_per_lsb));
        within(Field::SupplyNominal, config.supply_nominal_v, 0.0, supply)?;
        let highest = protect::highest_supply_v(config);
        within(Field::SupplyHigh, highest, config.supply_nominal_v, supply)?;
        if let Some(limit) = config.current_limit_a.get() {
            // The axis holds the current at it; what is a fault lies a little above.
            within(Field::CurrentLimit, limit, 0.0, current / protect::OVER_CURRENT)?;
        }
        // Energy is voltage times current.
        if let Some(limit) = config.energy_limit_j.get().filter(|_| self.current == 0) {
            within(Field::EnergyLimit, limit, 0.0, 0.0)?;
        }
        if let Some(thermal) = protection.and_then(|settings| settings.thermal) {
            within(Field::ContinuousCurrent, thermal.continuous_a, 0.0, current)?;
        }
        Ok(())
    }
}
