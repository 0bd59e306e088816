//! The telemetry record: what one control tick saw, thought and did. One struct for image, host and tests.

use crate::protect::Fault;
use crate::sample::Bridge;
use serde::{Deserialize, Serialize};

/// Version of [`Record`]; changes whenever a field does.
pub const VERSION: u8 = 2;

/// What the axis is doing. Numbers as in the log column `mode`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Activity {
    /// Bridge open, no torque.
    #[default]
    Idle = 0,
    /// Exciting and identifying.
    Commissioning = 1,
    /// Following a set-point that moves.
    Tracking = 2,
    /// Keeping a position.
    Holding = 3,
    /// A fault is latched; bridge open.
    Faulted = 4,
    /// Voltage mode: no loop is closed.
    Driving = 5,
}

/// What is known about zero. Numbers as in the record; stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Referenced {
    /// Positions count from power-up.
    #[default]
    No = 0,
    /// A search is under way.
    Searching = 1,
    /// Positions are absolute.
    Yes = 2,
    /// The last search ended without a result; positions count as before it.
    Missed = 3,
}

/// The limit that acted in this tick; the first in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Limit {
    /// None.
    #[default]
    None = 0,
    /// The measured supply.
    Supply = 1,
    /// The identified saturation level.
    Saturation = 2,
    /// The speed limit.
    Speed = 3,
    /// What a search for an end stop may push with.
    Push = 4,
    /// The acceleration limit, or the acceleration that the voltage leaves, for a streamed set-point.
    Acceleration = 5,
    /// The voltage limit.
    Voltage = 6,
    /// The current limit.
    Current = 7,
}

/// Where the numbers that the loops use come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Source {
    /// Nothing is known: not used.
    #[default]
    None = 0,
    /// From the configuration (rated speed, hint).
    Configured = 1,
    /// The last trusted value; the present one is not trusted.
    LastTrusted = 2,
    /// The present trusted value.
    Trusted = 3,
    /// Trusted when it was stored; not measured since power-up.
    Stored = 4,
}

impl Source {
    /// The one that promises less: measured now, then before, then in an earlier life, then said by the user.
    #[must_use]
    pub const fn weaker(self, other: Self) -> Self {
        if self.rank() < other.rank() { self } else { other }
    }

    const fn rank(self) -> u8 {
        match self {
            Source::None => 0,
            Source::Configured => 1,
            Source::Stored => 2,
            Source::LastTrusted => 3,
            Source::Trusted => 4,
        }
    }
}

/// What should be looked at, though nothing is wrong. Numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Advisory {
    /// Nothing.
    #[default]
    None = 0,
    /// A dead zone moved by more than a quarter since it was commissioned: wear, temperature or load.
    DeadZoneMoved = 1,
    /// No further point of a streamed motion came in time: the axis has slowed down to rest by itself.
    StreamRanDry = 2,
    /// A table of the load over the place is chosen and trusted, and does not act: its angle is not known since power-up, or it is
    /// too steep for the loops.
    PositionLoadOff = 3,
}

/// One control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record {
    /// [`VERSION`].
    pub version: u8,
    /// Tick number, wraps.
    pub tick: u32,
    /// Raw encoder counter at the start of the tick.
    pub count: i32,
    /// Raw supply.
    pub vbus_raw: u16,
    /// Raw winding current.
    pub current_raw: i16,
    /// Bridge state that acts from this tick to the next: after the PWM's delay.
    pub bridge: Bridge,
    /// Duty that acts from this tick to the next, PWM counts.
    pub duty: i16,
    /// Bridge state computed in this tick; acts `pwm_delay_ticks` later.
    pub command_bridge: Bridge,
    /// Duty computed in this tick, PWM counts; acts `pwm_delay_ticks` later.
    pub command_duty: i16,
    /// Reference position, counts relative to power-up, Q8, modulo 2²⁴ counts; see [`Record::ahead_q8`].
    pub reference_q8: i32,
    /// Reference speed, counts per tick, Q20.
    pub reference_speed_q20: i32,
    /// Estimated speed, counts per tick, Q20.
    pub speed_q20: i32,
    /// What the axis is doing.
    pub activity: Activity,
    /// Phase of the commissioning, as a number.
    pub phase: u8,
    /// The limit that acts.
    pub limit: Limit,
    /// The latched fault.
    pub fault: Fault,
    /// Source of gain and time constant in the loops.
    pub gain_source: Source,
    /// Source of the compensated dead zone, positive and negative.
    pub dead_zone_source: [Source; 2],
    /// Is the compensation switched on?
    pub compensation: bool,
    /// What should be looked at.
    pub advisory: Advisory,
    /// Do positions count from power-up, or are they absolute?
    pub referenced: Referenced,
}

impl Record {
    /// Reference minus measured position, counts, Q8; `zero`: the count at power-up. Exact while they are less than 2²³
    /// counts apart, however far both have gone.
    #[must_use]
    pub const fn ahead_q8(&self, zero: i32) -> i32 {
        ahead_q8(self.reference_q8, self.count, zero)
    }
}

/// [`Record::ahead_q8`] of a reference and a count that stand elsewhere.
#[must_use]
pub const fn ahead_q8(reference_q8: i32, count: i32, zero: i32) -> i32 {
    reference_q8.wrapping_sub(count.wrapping_sub(zero).wrapping_shl(8))
}

/// What starts the end of the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Trigger {
    /// The next tick.
    Now,
    /// A fault is latched.
    Fault,
    /// A limit acts.
    Limit,
    /// The axis begins to do this.
    Activity(Activity),
}
