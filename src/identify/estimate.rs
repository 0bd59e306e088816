//! What the identifier knows, each number with its uncertainty and with the reason when it must not be used.
//!
//! All numbers are relative: voltages to the nominal supply, speeds to the rated speed of the configuration, times to
//! the control tick. [`Estimates::report`] turns them into SI, outside the control tick.

use crate::config::{ConfigError, Field, Scale, within};
use crate::units::{Direction, limited};
use serde::{Deserialize, Serialize};

/// Why a number is missing or must not be used, or why a whole commissioning was refused. The texts that say what to
/// do live in the workbench; the codes are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Reason {
    /// Nothing was learned yet.
    NotIdentified,
    /// The regression is not solvable, or speed did not vary enough.
    NotExcited,
    /// Half width of the 95 % interval above the trust limit.
    TooUncertain,
    /// The verification segment disagrees with the model, or could not be run.
    NotVerified,
    /// No saturation up to the highest voltage applied.
    NotSeen,
    /// What was learned is older than its life.
    Aged,
    /// The dead zone came out negative: a load pulls, or the encoder misses counts.
    Implausible,
    /// Friction or load moved during commissioning.
    LoadChanged,
    /// The supply moved more than the commissioning tolerates.
    SupplyMoved,
    /// Travel between the end stops is too short for this part.
    TravelTooShort,
    /// Counts per time constant too few.
    EncoderTooSlow,
    /// The time budget is too short for this motor's time constant.
    TooShort,
    /// Voltage was applied, nothing moved: stalled, or encoder unplugged; the data are the same.
    NoMotion,
    /// Positive voltage moves the count down: motor or encoder reversed.
    Reversed,
    /// The motion stopped while driven: stalled, or encoder unplugged.
    MotionLost,
    /// Speed limit reached.
    Overspeed,
    /// Energy budget spent.
    EnergySpent,
    /// Travel limit reached although the excitation turned back.
    TravelExceeded,
    /// Stopped by the user.
    Aborted,
    /// The clip, not the motor, limited the voltage (supply far below nominal).
    SupplyTooLow,
    /// Voltage was applied, nothing moved, and the current was that of a winding without back-EMF.
    Stalled,
    /// Voltage was applied, nothing was counted, and the current was that of a motor that turns.
    EncoderUnplugged,
    /// Voltage was applied, nothing moved, and no current flowed.
    MotorDisconnected,
    /// The current limit held the voltage below what is needed.
    CurrentLimited,
    /// The count moves the same way under both voltages, or to and fro: an encoder channel is missing, or the drive turns one way
    /// whatever its sign.
    ChannelMissing,
    /// The shaft moves under one sign of the voltage alone.
    OneDirection,
    /// The shaft has followed the voltage, and then ran against it.
    DirectionChanged,
    /// The supply was far from nominal from the beginning.
    SupplyNotNominal,
    /// The speed is not the one that rated speed, counts per turn and supply tell.
    SpeedContradicts,
    /// A start takes far more voltage than the line through the moving points tells.
    StartsHigher,
    /// The gains of the directions differ so much that their mean is of no use.
    GainsDiffer,
}

impl Reason {
    /// The code as it stands in JSON.
    pub const fn code(self) -> &'static str {
        match self {
            Reason::NotIdentified => "not_identified",
            Reason::NotExcited => "not_excited",
            Reason::TooUncertain => "too_uncertain",
            Reason::NotVerified => "not_verified",
            Reason::NotSeen => "not_seen",
            Reason::Aged => "aged",
            Reason::Implausible => "implausible",
            Reason::LoadChanged => "load_changed",
            Reason::SupplyMoved => "supply_moved",
            Reason::TravelTooShort => "travel_too_short",
            Reason::EncoderTooSlow => "encoder_too_slow",
            Reason::TooShort => "too_short",
            Reason::NoMotion => "no_motion",
            Reason::Reversed => "reversed",
            Reason::MotionLost => "motion_lost",
            Reason::Overspeed => "overspeed",
            Reason::EnergySpent => "energy_spent",
            Reason::TravelExceeded => "travel_exceeded",
            Reason::Aborted => "aborted",
            Reason::SupplyTooLow => "supply_too_low",
            Reason::Stalled => "stalled",
            Reason::EncoderUnplugged => "encoder_unplugged",
            Reason::MotorDisconnected => "motor_disconnected",
            Reason::CurrentLimited => "current_limited",
            Reason::ChannelMissing => "channel_missing",
            Reason::OneDirection => "one_direction",
            Reason::DirectionChanged => "direction_changed",
            Reason::SupplyNotNominal => "supply_not_nominal",
            Reason::SpeedContradicts => "speed_contradicts",
            Reason::StartsHigher => "starts_higher",
            Reason::GainsDiffer => "gains_differ",
        }
    }
}

/// What causes the dead zone; decides the sign source of the compensation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Mechanism {
    /// Not tested, or neither.
    #[default]
    Unclear,
    /// Friction: it acts against the motion, whatever the voltage. The compensation takes the sign of the speed.
    Friction,
    /// Dead zone at the input: it ignores a small command. The compensation takes the sign of the command.
    InputDeadZone,
    /// A drop of bridge and brushes, or the bridge's dead time: it acts against the current, and a braking motor gets more than what
    /// lies at the terminals. The compensation takes the sign of the current. No commissioning finds it; a model names it.
    VoltageDrop,
}

/// May a number be used?
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Standing {
    /// Yes.
    Trusted,
    /// There is a number, but it must not be used.
    Doubtful(Reason),
    /// There is no number.
    Missing(Reason),
}

/// One number. The unit stands at its field in [`Estimates`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Estimate {
    /// The number; 0 when missing.
    pub value: i32,
    /// Half width of the 95 % interval, same unit; 0 when missing.
    pub u95: i32,
    /// May it be used?
    pub standing: Standing,
}

impl Estimate {
    /// No number, and why.
    pub const fn missing(reason: Reason) -> Self {
        Estimate { value: 0, u95: 0, standing: Standing::Missing(reason) }
    }

    /// The number if it may be used.
    pub fn trusted(&self) -> Option<i32> {
        (self.standing == Standing::Trusted).then_some(self.value)
    }

    /// The number, trusted or not.
    pub fn known(&self) -> Option<i32> {
        (!matches!(self.standing, Standing::Missing(_))).then_some(self.value)
    }

    /// Why it is missing or doubtful.
    pub fn reason(&self) -> Option<Reason> {
        match self.standing {
            Standing::Trusted => None,
            Standing::Doubtful(reason) | Standing::Missing(reason) => Some(reason),
        }
    }
}

impl Default for Estimate {
    fn default() -> Self {
        Estimate::missing(Reason::NotIdentified)
    }
}

/// Fractional bits of voltages (LSB = nominal supply · 2⁻²⁰ ≈ 11 µV at 12 V; range ±2048).
pub const VOLTAGE_FRAC: u32 = 20;
/// Fractional bits of the gain (LSB = 2⁻²⁰ rated speeds per nominal supply).
pub const GAIN_FRAC: u32 = 20;
/// Fractional bits of the time constant (LSB = 2⁻¹² control ticks; up to 524,287 ticks = 26 s at 20 kHz).
pub const TIME_FRAC: u32 = 12;

/// Largest numbers that are stored: a voltage of four nominal supplies, an interval of one of them or of one rated speed, a
/// difference of the gains of 100 %, a gain of 128.
const MOST_VOLTAGE: i32 = (1 << (VOLTAGE_FRAC + 2)) - 1;
const MOST_SHARE: i32 = (1 << VOLTAGE_FRAC) - 1;
const MOST_GAIN: i32 = (1 << (GAIN_FRAC + 7)) - 1;

/// All that is known about one motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Estimates {
    /// Kinetic dead zone, `[positive, negative]` magnitudes, nominal supply, Q20.
    pub dead_zone: [Estimate; 2],
    /// Terminal voltage beyond which more command brings no more speed, `[positive, negative]`, nominal supply, Q20.
    pub saturation: [Estimate; 2],
    /// Slope of speed over voltage beyond the dead zone, rated speeds per nominal supply, Q20.
    pub gain: Estimate,
    /// Half the relative difference between the directions' gains, (K₊ − K₋)/(K₊ + K₋), Q20: the gain of a direction is
    /// `gain · (1 ± gain_skew)`.
    pub gain_skew: i32,
    /// Sum of the linear part's time constants, control ticks, Q12.
    pub time_constant: Estimate,
    /// Friction or input dead zone.
    pub mechanism: Mechanism,
}

impl Estimates {
    /// Can a motor have the numbers that are trusted? They may come over a link or out of a store; the loops are built
    /// from them.
    pub fn check(&self) -> Result<(), ConfigError> {
        let inside = |field, estimate: &Estimate, bits: u32, low, high| match estimate.trusted() {
            Some(value) => within(field, value as f32 / (1u32 << bits) as f32, low, high),
            None => Ok(()),
        };
        for side in Direction::BOTH {
            inside(Field::DeadZone, &self.dead_zone[side], VOLTAGE_FRAC, 0.0, 2.0)?;
            inside(Field::Saturation, &self.saturation[side], VOLTAGE_FRAC, 0.01, 2.0)?;
        }
        inside(Field::Gain, &self.gain, GAIN_FRAC, 0.01, 100.0)?;
        inside(Field::TimeConstant, &self.time_constant, TIME_FRAC, 1.0, 5e5)
    }

    /// What is worth storing: the numbers that are trusted, and of the others the reason. No number is larger than a record
    /// has room for ([`crate::store::RECORD_LEN`]); those of a motor are far smaller.
    #[must_use]
    pub fn to_store(&self) -> Self {
        let voltage = |estimate: &Estimate| estimate.to_store(MOST_VOLTAGE, MOST_SHARE);
        Self {
            dead_zone: [0, 1].map(|side| voltage(&self.dead_zone[side])),
            saturation: [0, 1].map(|side| voltage(&self.saturation[side])),
            gain: self.gain.to_store(MOST_GAIN, MOST_SHARE),
            time_constant: self.time_constant.to_store(i32::MAX, MOST_GAIN),
            gain_skew: limited(self.gain_skew, MOST_SHARE),
            ..*self
        }
    }

    /// Takes a later result over: what it does not trust gives way to what was trusted before.
    pub fn merge(&mut self, later: &Estimates) {
        let newer = |before: Estimate, later: Estimate| match (before.standing, later.standing) {
            (_, Standing::Trusted) => later,
            (Standing::Trusted, _) => before,
            _ => later,
        };
        let pair = |before: [Estimate; 2], later: [Estimate; 2]| {
            [newer(before[0], later[0]), newer(before[1], later[1])]
        };
        if later.gain.standing == Standing::Trusted {
            self.gain_skew = later.gain_skew;
        }
        self.dead_zone = pair(self.dead_zone, later.dead_zone);
        self.saturation = pair(self.saturation, later.saturation);
        self.gain = newer(self.gain, later.gain);
        self.time_constant = newer(self.time_constant, later.time_constant);
        if later.mechanism != Mechanism::Unclear {
            self.mechanism = later.mechanism;
        }
    }
}

/// One number in SI.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reported {
    /// `None`: missing.
    pub value: Option<f32>,
    /// Half width of the 95 % interval; `None`: missing.
    pub u95: Option<f32>,
    /// May it be used?
    pub trusted: bool,
    /// Why it is missing or doubtful.
    pub reason: Option<Reason>,
}

/// [`Estimates`] in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimatesReport {
    /// V.
    pub dead_zone_pos_v: Reported,
    /// V, positive magnitude.
    pub dead_zone_neg_v: Reported,
    /// V.
    pub saturation_pos_v: Reported,
    /// V, positive magnitude.
    pub saturation_neg_v: Reported,
    /// rad/s/V at low speed, at the controlled shaft.
    pub gain_rad_s_per_v: Reported,
    /// s.
    pub time_constant_s: Reported,
    /// Friction or input dead zone.
    pub mechanism: Mechanism,
}

impl Estimates {
    /// A trusted dead zone is not trusted any more until motion has shown it again.
    pub fn age(&mut self) {
        for estimate in &mut self.dead_zone {
            if estimate.standing == Standing::Trusted {
                estimate.standing = Standing::Doubtful(Reason::Aged);
            }
        }
    }

    /// In SI units; not for the control tick (single-precision divisions).
    pub fn report(&self, scale: &Scale) -> EstimatesReport {
        let config = &scale.config;
        let volt = config.supply_nominal_v / (1 << VOLTAGE_FRAC) as f32;
        let gain = config.rated_speed_rad_s / config.supply_nominal_v / (1 << GAIN_FRAC) as f32;
        let second = 1.0 / (config.tick_hz as f32 * (1 << TIME_FRAC) as f32);
        EstimatesReport {
            dead_zone_pos_v: self.dead_zone[Direction::Positive].report(volt),
            dead_zone_neg_v: self.dead_zone[Direction::Negative].report(volt),
            saturation_pos_v: self.saturation[Direction::Positive].report(volt),
            saturation_neg_v: self.saturation[Direction::Negative].report(volt),
            gain_rad_s_per_v: self.gain.report(gain),
            time_constant_s: self.time_constant.report(second),
            mechanism: self.mechanism,
        }
    }
}

impl Estimate {
    fn to_store(self, value: i32, u95: i32) -> Self {
        match self.standing {
            Standing::Trusted => {
                Self { value: limited(self.value, value), u95: limited(self.u95, u95), ..self }
            }
            Standing::Doubtful(reason) | Standing::Missing(reason) => Self::missing(reason),
        }
    }

    fn report(&self, unit: f32) -> Reported {
        Reported {
            value: self.known().map(|value| value as f32 * unit),
            u95: self.known().map(|_| self.u95 as f32 * unit),
            trusted: self.trusted().is_some(),
            reason: self.reason(),
        }
    }
}

/// A share of a number, in 1/1024.
pub(super) fn share(value: i32, of_1024: i32) -> i32 {
    ((i64::from(value) * i64::from(of_1024)) >> 10) as i32
}
