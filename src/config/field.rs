//! The numbers that arrive from outside, by name, and what is wrong with one.

use serde::{Deserialize, Serialize};

/// Why a [`Config`](super::Config), or another number that arrives, cannot be: names the field as `axis.toml` spells it, and the range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfigError {
    /// The field.
    pub field: Field,
    /// Smallest value allowed.
    pub minimum: f32,
    /// Largest value allowed.
    pub maximum: f32,
}

/// One list of variants and keys. The variants travel by their number: new ones are appended.
macro_rules! fields {
    ($($(#[$doc:meta])+ $variant:ident = $key:literal,)+) => {
        /// A number that arrives from outside: a field of [`super::Config`] and others that are checked alike.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum Field {
            $($(#[$doc])+ $variant,)+
        }

        impl Field {
            /// The key, as `axis.toml` spells it.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Field::$variant => $key,)+
                }
            }
        }
    };
}

fields! {
    /// [`super::Config::supply_nominal_v`].
    SupplyNominal = "supply.nominal_v",
    /// [`super::Config::counts_per_rev`].
    CountsPerRev = "encoder.counts_per_rev",
    /// [`super::Config::rated_speed_rad_s`].
    RatedSpeed = "axis.rated_speed_rad_s",
    /// [`super::Config::tick_hz`].
    TickHz = "axis.tick_hz",
    /// [`super::Config::time_constant_hint_s`].
    TimeConstantHint = "axis.time_constant_hint_s",
    /// [`super::Config::gear_ratio`].
    GearRatio = "axis.gear_ratio",
    /// [`super::Config::travel_limit_rad`].
    TravelLimit = "axis.travel_limit_rad",
    /// [`super::Config::current_limit_a`].
    CurrentLimit = "limits.current_a",
    /// [`super::Config::energy_limit_j`].
    EnergyLimit = "limits.energy_j",
    /// [`super::Config::speed_limit_rad_s`].
    SpeedLimit = "limits.speed_rad_s",
    /// [`super::Config::pwm_delay_ticks`].
    PwmDelay = "axis.pwm_delay_ticks",
    /// [`super::Config::pwm_full_scale`].
    PwmFullScale = "axis.pwm_full_scale",
    /// [`super::Config::vbus_v_per_lsb`].
    VbusPerLsb = "supply.vbus_v_per_lsb",
    /// [`super::Config::current_a_per_lsb`].
    CurrentPerLsb = "limits.current_a_per_lsb",
    /// [`crate::protect::Thermal::continuous_a`].
    ContinuousCurrent = "limits.continuous_current_a",
    /// [`crate::protect::Thermal::time_constant_s`].
    ThermalTimeConstant = "limits.thermal_time_constant_s",
    /// Rated speed × counts per revolution ÷ control rate: counts that one tick sees at rated speed.
    CountsPerTick = "axis.rated_speed_rad_s x encoder.counts_per_rev / axis.tick_hz (counts per tick)",
    /// [`crate::control::Tuning::bandwidth`].
    Bandwidth = "loops.bandwidth",
    /// [`crate::identify::estimate::Estimates::dead_zone`], nominal supplies.
    DeadZone = "identified.dead_zone_pos_v and _neg_v / supply.nominal_v",
    /// [`crate::identify::estimate::Estimates::saturation`], nominal supplies.
    Saturation = "identified.saturation_pos_v and _neg_v / supply.nominal_v",
    /// [`crate::identify::estimate::Estimates::gain`], rated speeds per nominal supply.
    Gain = "identified.gain_rad_s_per_v x supply.nominal_v / axis.rated_speed_rad_s",
    /// [`crate::identify::estimate::Estimates::time_constant`], control ticks.
    TimeConstant = "identified.time_constant_s x axis.tick_hz",
    /// [`crate::motion::excitation::Waveform::amplitude_v`].
    ExcitationAmplitude = "excitation.amplitude_v",
    /// [`crate::motion::excitation::Waveform::from_hz`].
    ExcitationFrom = "excitation.from_hz",
    /// [`crate::motion::excitation::Waveform::to_hz`].
    ExcitationTo = "excitation.to_hz",
    /// [`crate::motion::excitation::Waveform::duration_ms`], s.
    ExcitationDuration = "excitation.duration_s",
    /// [`super::Config::supply_low_v`].
    SupplyLow = "limits.supply_low_v",
    /// [`super::Config::supply_high_v`].
    SupplyHigh = "limits.supply_high_v",
    /// [`super::Config::acceleration_limit_rad_s2`].
    AccelerationLimit = "limits.acceleration_rad_s2",
    /// [`super::Config::jerk_limit_rad_s3`].
    JerkLimit = "limits.jerk_rad_s3",
    /// [`super::Config::voltage_limit_v`].
    VoltageLimit = "limits.voltage_v",
}

/// Refuses a number outside its range; NaN is never within.
pub(crate) fn within(field: Field, value: f32, minimum: f32, maximum: f32) -> Result<(), ConfigError> {
    if value >= minimum && value <= maximum { Ok(()) } else { Err(ConfigError { field, minimum, maximum }) }
}
