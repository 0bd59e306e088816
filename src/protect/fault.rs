//! What can go wrong, and what only the image can tell.

use crate::identify::estimate::Reason;
use serde::{Deserialize, Serialize};

/// One row a fault: its number, its key, and the reason that a commissioning gives which it has ended. A fault travels by its place
/// too, so the rows stand in the order of their numbers: new ones come last.
macro_rules! faults {
    ($($(#[$doc:meta])+ $name:ident = $number:literal $key:literal, $reason:ident;)+) => {
        /// Why the bridge was switched off (or braked, or held: see [`super::action`]). Numbers as in the record and in the
        /// log; stable.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Fault {
            /// None.
            #[default]
            None = 0,
            $($(#[$doc])+ $name = $number,)+
        }

        impl Fault {
            /// All faults, in the order of their numbers.
            pub const ALL: [Self; [$($number),+].len()] = [$(Self::$name),+];

            /// The key, as `axis.toml` and the tables spell it.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    Self::None => "none",
                    $(Self::$name => $key,)+
                }
            }
        }

        /// What a commissioning that a fault has ended tells.
        impl From<Fault> for Reason {
            #[inline]
            fn from(fault: Fault) -> Self {
                match fault {
                    Fault::None => Reason::Aborted,
                    $(Fault::$name => Reason::$reason,)+
                }
            }
        }
    };
}

faults! {
    /// Voltage is applied, nothing moves: stalled, or the encoder is unplugged; without a current sensor the data are
    /// the same.
    NoMotion = 1 "no_motion", MotionLost;
    /// The motor moves against the voltage: motor or encoder reversed.
    WrongDirection = 2 "wrong_direction", Reversed;
    /// Faster than the speed limit.
    Overspeed = 3 "overspeed", Overspeed;
    /// Winding current above its limit.
    OverCurrent = 4 "over_current", Aborted;
    /// Supply below half of nominal.
    SupplyLow = 5 "supply_low", SupplyTooLow;
    /// Supply above 1.5 times nominal, e.g. while braking into a supply that cannot take it.
    SupplyHigh = 6 "supply_high", SupplyNotNominal;
    /// Voltage is applied, nothing moves, and the current is that of a winding without back-EMF.
    Stalled = 7 "stalled", Stalled;
    /// Voltage is applied, nothing is counted, and the current is that of a motor that turns.
    EncoderUnplugged = 8 "encoder_unplugged", EncoderUnplugged;
    /// Voltage is applied, nothing moves, and no current flows: motor leads, brushes or bridge open.
    MotorDisconnected = 9 "motor_disconnected", MotorDisconnected;
    /// Counts that no shaft can make: lost or invented edges, a coupling that slips.
    SlippingCounts = 10 "slipping_counts", Aborted;
    /// I²t: the winding is as hot as the continuous current makes it.
    Overload = 11 "overload", Aborted;
    /// The supply was measured and is not any more.
    SupplyNotMeasured = 12 "supply_not_measured", Aborted;
    /// No fresh command while a motion without end was under way.
    CommandTimeout = 13 "command_timeout", Aborted;
    /// A control tick did not end before the next one was due.
    TickOverrun = 14 "tick_overrun", Aborted;
    /// The chip comes from a reset by its watchdog.
    WatchdogReset = 15 "watchdog_reset", Aborted;
    /// Parameters were stored, and are damaged.
    ParametersDamaged = 16 "parameters_damaged", Aborted;
    /// The shaft turns faster than the applied voltage can drive it.
    Runaway = 17 "runaway", SpeedContradicts;
    /// The bridge driver reports a fault (over-current, over-temperature, under-voltage).
    BridgeFault = 18 "bridge_fault", Aborted;
    /// The enable (emergency stop) contact is open.
    Disabled = 19 "disabled", Aborted;
}

/// What the lines that may forbid motion say at this moment. A line that cannot be read counts as forbidding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Interlock {
    /// Enable is high and the driver reports no fault.
    #[default]
    Granted = 0,
    /// The user's enable contact is open.
    Disabled = 1,
    /// The bridge driver reports a fault (over-current, over-temperature, under-voltage).
    BridgeFault = 2,
}

/// What the samples of a tick do not show and the image knows; see [`crate::axis::servo_axis::ServoAxis::raise`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Condition {
    /// The lines as read in this tick. Give it in every tick: permission is a level, not an event.
    Interlock(Interlock),
    /// The last control tick did not end before the next one was due.
    TickOverrun,
    /// The watchdog has caused the last reset. Once, after boot.
    WatchdogReset,
    /// The stored parameters are damaged. Once, after boot.
    ParametersDamaged,
}

impl Condition {
    /// The fault that follows; [`Fault::None`] for a permission.
    #[must_use]
    pub const fn fault(self) -> Fault {
        match self {
            Self::Interlock(Interlock::Granted) => Fault::None,
            Self::Interlock(Interlock::Disabled) => Fault::Disabled,
            Self::Interlock(Interlock::BridgeFault) => Fault::BridgeFault,
            Self::TickOverrun => Fault::TickOverrun,
            Self::WatchdogReset => Fault::WatchdogReset,
            Self::ParametersDamaged => Fault::ParametersDamaged,
        }
    }

    /// The notice that must have been given where this fault is found in a log: what a replay gives in its stead.
    #[must_use]
    pub const fn behind(fault: Fault) -> Option<Self> {
        match fault {
            Fault::Disabled => Some(Self::Interlock(Interlock::Disabled)),
            Fault::BridgeFault => Some(Self::Interlock(Interlock::BridgeFault)),
            Fault::TickOverrun => Some(Self::TickOverrun),
            Fault::WatchdogReset => Some(Self::WatchdogReset),
            Fault::ParametersDamaged => Some(Self::ParametersDamaged),
            _ => None,
        }
    }
}
