//! What the firmware may know about its axis before it has moved, in SI units, and the check that every value can be.
//!
//! `Config` (SI) → [`Config::build`] → [`Scale`] (fixed point): the one place where a volt, a radian and a second turn
//! into machine units. Every stage derives its own `Params` from the [`Scale`].

use crate::optional::Optional;
use crate::units::VoltageQ14;
use serde::{Deserialize, Serialize};

/// One joint in SI units. The host reads it from `axis.toml`; it reaches the chip in [`crate::link::protocol::Command::Configure`].
/// Single precision: only `+ − × ÷` and comparisons touch it, which round alike on every IEEE 754 machine, so the
/// fixed-point parameters built from it are the same bits on host and chip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Nominal supply voltage, V. 1 … 80.
    pub supply_nominal_v: f32,
    /// Encoder counts per revolution of the controlled shaft after ×4 decoding. 4 … 1 000 000.
    pub counts_per_rev: u32,
    /// No-load speed at nominal voltage, rad/s, right within ±30 %.
    pub rated_speed_rad_s: f32,
    /// Control rate, Hz. 1,000 … 20,000.
    pub tick_hz: u32,
    /// Time constant of speed, s, right within a factor of 2; `None`: the chip finds it.
    pub time_constant_hint_s: Optional,
    /// Turns of the controlled shaft per turn of the joint.
    pub gear_ratio: f32,
    /// End stops, rad, relative to power-up; `None`: turns freely.
    pub travel_limit_rad: Option<[f32; 2]>,
    /// Current above which the bridge is switched off, A; `None`: no current sensor or no limit.
    pub current_limit_a: Optional,
    /// Electrical energy that one commissioning may spend, J; `None`: no limit.
    pub energy_limit_j: Optional,
    /// Speed never to be exceeded, rad/s; `None`: no limit.
    pub speed_limit_rad_s: Optional,
    /// Ticks between a command and its effect at the bridge, 1 … 3 (1: preloaded PWM compare register).
    pub pwm_delay_ticks: u8,
    /// PWM counts of full duty: the timer's reload value.
    pub pwm_full_scale: u16,
    /// Volts per count of the supply converter.
    pub vbus_v_per_lsb: f32,
    /// Amperes per count of the current converter.
    pub current_a_per_lsb: f32,
    /// Supply below which the bridge is switched off, V; `None`: half the nominal supply.
    #[serde(default)]
    pub supply_low_v: Optional,
    /// … and above which, V; `None`: one and a half times the nominal supply.
    #[serde(default)]
    pub supply_high_v: Optional,
    /// Largest acceleration of a set-point, rad/s²; `None`: what the voltage gives.
    #[serde(default)]
    pub acceleration_limit_rad_s2: Optional,
    /// Largest jerk of a set-point that the chip plans, rad/s³; `None`: no limit.
    #[serde(default)]
    pub jerk_limit_rad_s3: Optional,
    /// Largest voltage at the terminals, V; `None`: what the supply gives.
    #[serde(default)]
    pub voltage_limit_v: Optional,
}

/// Why a [`Config`], or another number that arrives, cannot be: names the field as `axis.toml` spells it, and the range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfigError {
    /// The field.
    pub field: Field,
    /// Smallest value allowed.
    pub minimum: f32,
    /// Largest value allowed.
    pub maximum: f32,
}

/// A number that arrives from outside: a field of [`Config`] and others that are checked alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Field {
    /// [`Config::supply_nominal_v`].
    SupplyNominal,
    /// [`Config::counts_per_rev`].
    CountsPerRev,
    /// [`Config::rated_speed_rad_s`].
    RatedSpeed,
    /// [`Config::tick_hz`].
    TickHz,
    /// [`Config::time_constant_hint_s`].
    TimeConstantHint,
    /// [`Config::gear_ratio`].
    GearRatio,
    /// [`Config::travel_limit_rad`].
    TravelLimit,
    /// [`Config::current_limit_a`].
    CurrentLimit,
    /// [`Config::energy_limit_j`].
    EnergyLimit,
    /// [`Config::speed_limit_rad_s`].
    SpeedLimit,
    /// [`Config::pwm_delay_ticks`].
    PwmDelay,
    /// [`Config::pwm_full_scale`].
    PwmFullScale,
    /// [`Config::vbus_v_per_lsb`].
    VbusPerLsb,
    /// [`Config::current_a_per_lsb`].
    CurrentPerLsb,
    /// [`crate::protect::Thermal::continuous_a`].
    ContinuousCurrent,
    /// [`crate::protect::Thermal::time_constant_s`].
    ThermalTimeConstant,
    /// Rated speed × counts per revolution ÷ control rate: counts that one tick sees at rated speed.
    CountsPerTick,
    /// [`crate::control::Tuning::bandwidth`].
    Bandwidth,
    /// [`crate::identify::estimate::Estimates::dead_zone`], nominal supplies.
    DeadZone,
    /// [`crate::identify::estimate::Estimates::saturation`], nominal supplies.
    Saturation,
    /// [`crate::identify::estimate::Estimates::gain`], rated speeds per nominal supply.
    Gain,
    /// [`crate::identify::estimate::Estimates::time_constant`], control ticks.
    TimeConstant,
    /// [`crate::motion::excitation::Waveform::amplitude_v`].
    ExcitationAmplitude,
    /// [`crate::motion::excitation::Waveform::from_hz`].
    ExcitationFrom,
    /// [`crate::motion::excitation::Waveform::to_hz`].
    ExcitationTo,
    /// [`crate::motion::excitation::Waveform::duration_ms`], s.
    ExcitationDuration,
    /// [`Config::supply_low_v`].
    SupplyLow,
    /// [`Config::supply_high_v`].
    SupplyHigh,
    /// [`Config::acceleration_limit_rad_s2`].
    AccelerationLimit,
    /// [`Config::jerk_limit_rad_s3`].
    JerkLimit,
    /// [`Config::voltage_limit_v`].
    VoltageLimit,
}

impl Field {
    /// The key, as `axis.toml` spells it.
    pub const fn name(self) -> &'static str {
        match self {
            Field::SupplyNominal => "supply.nominal_v",
            Field::CountsPerRev => "encoder.counts_per_rev",
            Field::RatedSpeed => "axis.rated_speed_rad_s",
            Field::TickHz => "axis.tick_hz",
            Field::TimeConstantHint => "axis.time_constant_hint_s",
            Field::GearRatio => "axis.gear_ratio",
            Field::TravelLimit => "axis.travel_limit_rad",
            Field::CurrentLimit => "limits.current_a",
            Field::EnergyLimit => "limits.energy_j",
            Field::SpeedLimit => "limits.speed_rad_s",
            Field::PwmDelay => "axis.pwm_delay_ticks",
            Field::PwmFullScale => "axis.pwm_full_scale",
            Field::VbusPerLsb => "supply.vbus_v_per_lsb",
            Field::CurrentPerLsb => "limits.current_a_per_lsb",
            Field::ContinuousCurrent => "limits.continuous_current_a",
            Field::ThermalTimeConstant => "limits.thermal_time_constant_s",
            Field::CountsPerTick => {
                "axis.rated_speed_rad_s x encoder.counts_per_rev / axis.tick_hz (counts per tick)"
            }
            Field::Bandwidth => "loops.bandwidth",
            Field::DeadZone => "identified.dead_zone_pos_v and _neg_v / supply.nominal_v",
            Field::Saturation => "identified.saturation_pos_v and _neg_v / supply.nominal_v",
            Field::Gain => "identified.gain_rad_s_per_v x supply.nominal_v / axis.rated_speed_rad_s",
            Field::TimeConstant => "identified.time_constant_s x axis.tick_hz",
            Field::ExcitationAmplitude => "excitation.amplitude_v",
            Field::ExcitationFrom => "excitation.from_hz",
            Field::ExcitationTo => "excitation.to_hz",
            Field::ExcitationDuration => "excitation.duration_s",
            Field::SupplyLow => "limits.supply_low_v",
            Field::SupplyHigh => "limits.supply_high_v",
            Field::AccelerationLimit => "limits.acceleration_rad_s2",
            Field::JerkLimit => "limits.jerk_rad_s3",
            Field::VoltageLimit => "limits.voltage_v",
        }
    }
}

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

/// Shares of the nominal supply between which its thresholds may lie: the duty is computed for an eighth at least, and a
/// measured supply saturates at twice the nominal one.
const LEAST_SUPPLY: f32 = 0.125;
const MOST_SUPPLY: f32 = 1.9;
/// The smallest voltage limit, share of the nominal supply: most dead zones are larger.
const LEAST_VOLTAGE: f32 = 0.1;
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
            travel_counts: self
                .travel_limit_rad
                .map_or([i32::MIN, i32::MAX], |limit| limit.map(stop)),
        })
    }

    /// This configuration, with the limits of an earlier one where it has none of its own: limits survive a new description
    /// of the machine.
    #[must_use]
    pub fn keeping_limits(&self, earlier: &Config) -> Self {
        Self {
            current_limit_a: self.current_limit_a.or(earlier.current_limit_a),
            energy_limit_j: self.energy_limit_j.or(earlier.energy_limit_j),
            speed_limit_rad_s: self.speed_limit_rad_s.or(earlier.speed_limit_rad_s),
            supply_low_v: self.supply_low_v.or(earlier.supply_low_v),
            supply_high_v: self.supply_high_v.or(earlier.supply_high_v),
            acceleration_limit_rad_s2: self
                .acceleration_limit_rad_s2
                .or(earlier.acceleration_limit_rad_s2),
            jerk_limit_rad_s3: self.jerk_limit_rad_s3.or(earlier.jerk_limit_rad_s3),
            voltage_limit_v: self.voltage_limit_v.or(earlier.voltage_limit_v),
            ..*self
        }
    }

    fn check(&self) -> Result<(), ConfigError> {
        within(Field::SupplyNominal, self.supply_nominal_v, 1.0, 80.0)?;
        within(Field::CountsPerRev, self.counts_per_rev as f32, 4.0, 1e6)?;
        within(Field::RatedSpeed, self.rated_speed_rad_s, 0.05, 5e3)?;
        within(Field::TickHz, self.tick_hz as f32, 1e3, 2e4)?;
        within(
            Field::TimeConstantHint,
            self.time_constant_hint_s.get().unwrap_or(0.1),
            2e-3,
            10.0,
        )?;
        within(Field::GearRatio, self.gear_ratio, 1e-3, 1e4)?;
        within(Field::PwmDelay, f32::from(self.pwm_delay_ticks), 1.0, 3.0)?;
        within(
            Field::PwmFullScale,
            f32::from(self.pwm_full_scale),
            100.0,
            32767.0,
        )?;
        within(
            Field::VbusPerLsb,
            self.vbus_v_per_lsb,
            1e-5,
            self.supply_nominal_v / 16.0,
        )?;
        within(Field::CurrentPerLsb, self.current_a_per_lsb, 1e-6, 10.0)?;
        let [lower, upper] = self.travel_limit_rad.unwrap_or([-1.0, 1.0]);
        within(Field::TravelLimit, lower, -1e5, 0.0)?;
        within(Field::TravelLimit, upper, 0.0, 1e5)?;
        self.check_limits()
    }

    /// What may be absent.
    fn check_limits(&self) -> Result<(), ConfigError> {
        let nominal = self.supply_nominal_v;
        let [lowest, highest] = [LEAST_SUPPLY, MOST_SUPPLY].map(|share| share * nominal);
        for (field, limit, minimum, maximum) in [
            (Field::CurrentLimit, self.current_limit_a, 1e-3, 1e3),
            (Field::EnergyLimit, self.energy_limit_j, 1e-3, 1e6),
            (Field::SpeedLimit, self.speed_limit_rad_s, 1e-3, 1e4),
            (Field::SupplyLow, self.supply_low_v, lowest, nominal),
            (Field::SupplyHigh, self.supply_high_v, nominal, highest),
            (Field::AccelerationLimit, self.acceleration_limit_rad_s2, 0.1, 1e7),
            (Field::JerkLimit, self.jerk_limit_rad_s3, 0.1, 1e10),
            (
                Field::VoltageLimit,
                self.voltage_limit_v,
                LEAST_VOLTAGE * nominal,
                nominal,
            ),
        ] {
            limit
                .get()
                .map_or(Ok(()), |value| within(field, value, minimum, maximum))?;
        }
        Ok(())
    }
}

/// NaN is never within.
pub(crate) fn within(field: Field, value: f32, minimum: f32, maximum: f32) -> Result<(), ConfigError> {
    if value >= minimum && value <= maximum {
        Ok(())
    } else {
        Err(ConfigError {
            field,
            minimum,
            maximum,
        })
    }
}
