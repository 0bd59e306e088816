//! The settings of an axis, one row each: the one place that names field, key, type, unit, range, default, meaning and the layout
//! of the store in which it came. [`Config`], its check, the keys of `axis.toml` and `truing params`, `docs/axis-file.md` and
//! the stored layouts follow from the rows. The rows stand in the order in which the values travel and are stored: new ones
//! come last. The same order, with `others` that are numbers but no settings, is that of [`Field`]: its variants travel by their number.

use super::setting::Kind;
use super::{ConfigError, Setting, Value};
use crate::optional::Optional;
use serde::{Deserialize, Serialize};

/// Shares of the nominal supply between which its thresholds may lie: the duty is computed for an eighth at least, and a
/// measured supply saturates at twice the nominal one.
const LEAST_SUPPLY: f32 = 0.125;
const MOST_SUPPLY: f32 = 1.9;
/// The smallest voltage limit, share of the nominal supply: most dead zones are larger.
const LEAST_VOLTAGE: f32 = 0.1;
/// Full scale of a 12-bit converter.
const CONVERTER_FULL_SCALE: f32 = 4096.0;
/// The supply converter reaches this many times the nominal voltage, so that regeneration does not clip it.
const SUPPLY_HEADROOM: f32 = 2.0;

/// A `limit` survives a new description of the machine that has none; what belongs to the `machine` is replaced.
macro_rules! kept {
    (limit, $own:expr, $earlier:expr) => {
        $own.or($earlier)
    };
    (machine, $own:expr, $earlier:expr) => {
        $own
    };
}

macro_rules! default_words {
    (required) => {
        None
    };
    (default $words:literal $value:expr) => {
        Some($words)
    };
}

macro_rules! fallback {
    ($nominal:ident, required) => {
        None
    };
    ($nominal:ident, default $words:literal $value:expr) => {
        Some($value)
    };
}

/// `$nominal`: the name under which ranges and defaults know the nominal supply, V.
macro_rules! settings {
    ($nominal:ident; $($(
        #[doc = $doc:literal]
        $kind:ident $name:ident: $type:ty {
            field: $field:ident = $key:literal,
            unit: $unit:literal,
            about: $about:literal,
            range: $range:literal $bounds:expr,
            $($default:ident)+ $($words:literal $value:expr)?,
            since: $since:literal,
        }
    )+ others { $($(#[$meaning:meta])+ $other:ident = $other_key:literal,)* })+) => {
        /// A number that arrives from outside: a field of [`Config`] and others that are checked alike.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum Field {
            $(
                $(#[doc = concat!("[`Config::", stringify!($name), "`].")] $field,)+
                $($(#[$meaning])+ $other,)*
            )+
        }

        impl Field {
            /// The key, as `axis.toml` spells it.
            pub const fn name(self) -> &'static str {
                match self {
                    $($(Field::$field => $key,)+ $(Field::$other => $other_key,)*)+
                }
            }
        }

        /// An axis in SI units. The host reads it from `axis.toml`; it reaches the chip in
        /// [`crate::link::protocol::Command::Configure`].
        ///
        /// Single precision: only `+ − × ÷` and comparisons touch it, which round alike on every IEEE 754 machine, so the
        /// fixed-point parameters built from it are the same bits on host and chip.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        pub struct Config {
            $($(#[doc = $doc] pub $name: $type,)+)+
        }

        /// Every setting, in the order in which they travel and are stored.
        pub const SETTINGS: &[Setting] = &[$($(Setting {
            field: Field::$field,
            unit: $unit,
            about: $about,
            range: $range,
            default: default_words!($($default)+ $($words $value)?),
            since: $since,
            get: |config| Kind::value(config.$name),
            set: |config, value| {
                config.$name = Kind::of(value)?;
                Some(())
            },
            #[allow(unused_variables, reason = "few defaults depend on the nominal supply")]
            fallback: |config| {
                let $nominal = config.supply_nominal_v;
                fallback!($nominal, $($default)+ $($words $value)?)
            },
        },)+)+];

        /// Layout of the store in which the latest setting came.
        pub(crate) const LATEST: u16 = SETTINGS[SETTINGS.len() - 1].since;

        impl Config {
            /// Checks every field.
            pub(super) fn check(&self) -> Result<(), ConfigError> {
                let $nominal = self.supply_nominal_v;
                $($(Kind::check(self.$name, Field::$field, $bounds)?;)+)+
                Ok(())
            }

            /// This configuration, with the limits of an earlier one where it has none of its own: limits survive a new
            /// description of the machine.
            #[must_use]
            pub fn keeping_limits(&self, earlier: &Config) -> Self {
                Self {
                    $($($name: kept!($kind, self.$name, earlier.$name),)+)+
                }
            }

            /// Takes a configuration off stored bytes. `layout`: of the record that holds it, at least 4; what came later
            /// keeps its value of `later`.
            pub fn take(layout: u16, bytes: &mut &[u8], later: &Config) -> Option<Self> {
                Some(Self {
                    $($($name: if layout >= $since { take(bytes)? } else { later.$name },)+)+
                })
            }
        }
    };
}

fn take<'a, T: Deserialize<'a>>(bytes: &mut &'a [u8]) -> Option<T> {
    let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
    *bytes = rest;
    Some(value)
}

impl Config {
    /// A small gear motor with a 2,048-count encoder on 12 V, for examples and tests: no limit is set.
    pub const EXAMPLE: Self = Self {
        supply_nominal_v: 12.0,
        counts_per_rev: 2048,
        rated_speed_rad_s: 60.0,
        tick_hz: 10_000,
        time_constant_hint_s: Optional::NONE,
        gear_ratio: 1.0,
        travel_limit_rad: None,
        current_limit_a: Optional::NONE,
        energy_limit_j: Optional::NONE,
        speed_limit_rad_s: Optional::NONE,
        pwm_delay_ticks: 1,
        pwm_full_scale: 4200,
        vbus_v_per_lsb: SUPPLY_HEADROOM * 12.0 / CONVERTER_FULL_SCALE,
        current_a_per_lsb: 40.0 / CONVERTER_FULL_SCALE,
        supply_low_v: Optional::NONE,
        supply_high_v: Optional::NONE,
        acceleration_limit_rad_s2: Optional::NONE,
        jerk_limit_rad_s3: Optional::NONE,
        voltage_limit_v: Optional::NONE,
    };
}

settings! {
    nominal;
    #[doc = "Nominal supply voltage. V, 1 … 80."]
    machine supply_nominal_v: f32 {
        field: SupplyNominal = "supply.nominal_v",
        unit: "V",
        about: "Nominal supply voltage.",
        range: "1 … 80" [1.0, 80.0],
        required,
        since: 1,
    }
    #[doc = "Encoder counts per revolution of the controlled shaft after ×4 decoding. counts, 4 … 1,000,000."]
    machine counts_per_rev: u32 {
        field: CountsPerRev = "encoder.counts_per_rev",
        unit: "counts",
        about: "Encoder counts per revolution of the controlled shaft after ×4 decoding.",
        range: "4 … 1,000,000" [4.0, 1e6],
        required,
        since: 1,
    }
    #[doc = "No-load speed at nominal voltage, right within ±30 %. rad/s, 0.05 … 5,000."]
    machine rated_speed_rad_s: f32 {
        field: RatedSpeed = "axis.rated_speed_rad_s",
        unit: "rad/s",
        about: "No-load speed at nominal voltage, right within ±30 %.",
        range: "0.05 … 5,000" [0.05, 5e3],
        required,
        since: 1,
    }
    #[doc = "Control rate. Hz, 1,000 … 20,000."]
    machine tick_hz: u32 {
        field: TickHz = "axis.tick_hz",
        unit: "Hz",
        about: "Control rate.",
        range: "1,000 … 20,000" [1e3, 2e4],
        default "10,000" Value::Whole(10_000),
        since: 1,
    }
    #[doc = "Time constant of speed, right within a factor of 2. Without it the chip finds the time constant. s, 0.002 … 10."]
    machine time_constant_hint_s: Optional {
        field: TimeConstantHint = "axis.time_constant_hint_s",
        unit: "s",
        about: "Time constant of speed, right within a factor of 2. Without it the chip finds the time constant.",
        range: "0.002 … 10" [2e-3, 10.0],
        default "none" Value::None,
        since: 1,
    }
    #[doc = "Turns of the controlled shaft per turn of the joint. 0.001 … 10,000."]
    machine gear_ratio: f32 {
        field: GearRatio = "axis.gear_ratio",
        unit: "",
        about: "Turns of the controlled shaft per turn of the joint.",
        range: "0.001 … 10,000" [1e-3, 1e4],
        default "1" Value::Number(1.0),
        since: 1,
    }
    #[doc = "End stops at the joint, relative to power-up until the axis is referenced. Without them the axis turns freely. rad, -100,000 … 0 and 0 … 100,000."]
    machine travel_limit_rad: Option<[f32; 2]> {
        field: TravelLimit = "axis.travel_limit_rad",
        unit: "rad",
        about: "End stops at the joint, relative to power-up until the axis is referenced. Without them the axis turns freely.",
        range: "-100,000 … 0 and 0 … 100,000" [-1e5, 1e5],
        default "none" Value::None,
        since: 1,
    }
    #[doc = "The voltage is lowered so that the winding current stays below it; a current far above it switches the bridge off. A, 0.001 … 1,000."]
    limit current_limit_a: Optional {
        field: CurrentLimit = "limits.current_a",
        unit: "A",
        about: "The voltage is lowered so that the winding current stays below it; a current far above it switches the bridge off.",
        range: "0.001 … 1,000" [1e-3, 1e3],
        default "none" Value::None,
        since: 1,
    }
    #[doc = "Electrical energy that one commissioning may spend. J, 0.001 … 1,000,000."]
    limit energy_limit_j: Optional {
        field: EnergyLimit = "limits.energy_j",
        unit: "J",
        about: "Electrical energy that one commissioning may spend.",
        range: "0.001 … 1,000,000" [1e-3, 1e6],
        default "none" Value::None,
        since: 1,
    }
    #[doc = "Speed never to be exceeded: set-points stay below it, and a fault is latched above it. rad/s, 0.001 … 10,000."]
    limit speed_limit_rad_s: Optional {
        field: SpeedLimit = "limits.speed_rad_s",
        unit: "rad/s",
        about: "Speed never to be exceeded: set-points stay below it, and a fault is latched above it.",
        range: "0.001 … 10,000" [1e-3, 1e4],
        default "none" Value::None,
        since: 1,
    }
    #[doc = "Ticks between a command and its effect at the bridge; 1 for a preloaded PWM compare register. ticks, 1 … 3."]
    machine pwm_delay_ticks: u8 {
        field: PwmDelay = "axis.pwm_delay_ticks",
        unit: "ticks",
        about: "Ticks between a command and its effect at the bridge; 1 for a preloaded PWM compare register.",
        range: "1 … 3" [1.0, 3.0],
        default "1" Value::Whole(1),
        since: 1,
    }
    #[doc = "PWM counts of full duty: the timer's reload value. 4,200 is 20 kHz, centre-aligned, at 168 MHz. counts, 100 … 32,767."]
    machine pwm_full_scale: u16 {
        field: PwmFullScale = "axis.pwm_full_scale",
        unit: "counts",
        about: "PWM counts of full duty: the timer's reload value. 4,200 is 20 kHz, centre-aligned, at 168 MHz.",
        range: "100 … 32,767" [100.0, 32767.0],
        default "4,200" Value::Whole(4_200),
        since: 1,
    }
    #[doc = "Volts per count of the supply converter. V, 0.00001 … 1/16 of nominal."]
    machine vbus_v_per_lsb: f32 {
        field: VbusPerLsb = "supply.vbus_v_per_lsb",
        unit: "V",
        about: "Volts per count of the supply converter.",
        range: "0.00001 … 1/16 of nominal" [1e-5, nominal / 16.0],
        default "that of the board; in QEMU, full scale is twice the nominal supply over 12 bits" Value::Number(SUPPLY_HEADROOM * nominal / CONVERTER_FULL_SCALE),
        since: 1,
    }
    #[doc = "Amperes per count of the current converter. A, 0.000001 … 10."]
    machine current_a_per_lsb: f32 {
        field: CurrentPerLsb = "limits.current_a_per_lsb",
        unit: "A",
        about: "Amperes per count of the current converter.",
        range: "0.000001 … 10" [1e-6, 10.0],
        default "that of the board; in QEMU, ±20 A over 12 bits" Value::Number(40.0 / CONVERTER_FULL_SCALE),
        since: 1,
    }
    others {
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
    }
    #[doc = "The bridge is switched off below it, after 5 ms. V, 0.125 … 1 of nominal."]
    limit supply_low_v: Optional {
        field: SupplyLow = "limits.supply_low_v",
        unit: "V",
        about: "The bridge is switched off below it, after 5 ms.",
        range: "0.125 … 1 of nominal" [LEAST_SUPPLY * nominal, nominal],
        default "half the nominal supply" Value::None,
        since: 4,
    }
    #[doc = "The bridge is switched off above it, after 5 ms. V, 1 … 1.9 of nominal."]
    limit supply_high_v: Optional {
        field: SupplyHigh = "limits.supply_high_v",
        unit: "V",
        about: "The bridge is switched off above it, after 5 ms.",
        range: "1 … 1.9 of nominal" [nominal, MOST_SUPPLY * nominal],
        default "one and a half times the nominal supply" Value::None,
        since: 4,
    }
    #[doc = "Largest acceleration of a set-point. rad/s², 0.1 … 10,000,000."]
    limit acceleration_limit_rad_s2: Optional {
        field: AccelerationLimit = "limits.acceleration_rad_s2",
        unit: "rad/s²",
        about: "Largest acceleration of a set-point.",
        range: "0.1 … 10,000,000" [0.1, 1e7],
        default "what the voltage gives" Value::None,
        since: 4,
    }
    #[doc = "Largest jerk of a set-point that the servo plans itself. rad/s³, 0.1 … 10,000,000,000."]
    limit jerk_limit_rad_s3: Optional {
        field: JerkLimit = "limits.jerk_rad_s3",
        unit: "rad/s³",
        about: "Largest jerk of a set-point that the servo plans itself.",
        range: "0.1 … 10,000,000,000" [0.1, 1e10],
        default "none" Value::None,
        since: 4,
    }
    #[doc = "Largest voltage at the terminals. V, 0.1 … 1 of nominal."]
    limit voltage_limit_v: Optional {
        field: VoltageLimit = "limits.voltage_v",
        unit: "V",
        about: "Largest voltage at the terminals.",
        range: "0.1 … 1 of nominal" [LEAST_VOLTAGE * nominal, nominal],
        default "what the supply gives" Value::None,
        since: 4,
    }
    others {
        /// [`crate::compensate::position_load::Load::period_counts`].
        LoadPeriod = "position_load.period_counts",
        /// [`crate::compensate::position_load::Harmonic::cycles`].
        LoadCycles = "position_load.cycles",
        /// [`crate::compensate::position_load::Harmonic::amplitude_v`] of one, or of all together with the constant.
        LoadAmplitude = "position_load.amplitude_v",
        /// [`crate::compensate::position_load::Harmonic::phase_rad`].
        LoadPhase = "position_load.phase_rad",
        /// How many harmonics there are.
        LoadHarmonics = "position_load.harmonics",
    }
}
