//! What the link makes of a command before its tick.

use crate::axis::track_sine::{Ahead, Asked, Units};
use crate::axis::{Axis, Command, Refusal};
use crate::compensate::modelled::Modelled;
use crate::compensate::position_load::PositionLoad;
use crate::config::{Config, ConfigError};
use crate::identify::estimate::Estimates;
use crate::protect::SettingsError;
use crate::store::AxisParameters;

/// What is done at the start of a tick: a command, or what was computed of it ahead. Building an [`Axis`] divides in floating
/// point, so whoever takes commands builds it, and the control interrupt only puts it in place. `P` holds the constants: the
/// axis itself, or a pointer to it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub enum Order<P = Axis> {
    /// Put this axis in place and start anew; with what an earlier life has found and chosen, if it comes along. Without,
    /// the choices of the axis that was there before stay ([`Axis::keeping`]).
    Install(P, Option<Restored>),
    /// [`Command::TrackSine`], computed ahead of the tick.
    Sine(Ahead),
    /// As it came.
    Run(Command),
}

/// What a new life takes over apart from configuration and tuning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restored {
    /// What was identified.
    pub estimates: Estimates,
    /// Use the inverse dead zone in the loops.
    pub compensation: bool,
    /// The load over the place.
    pub position_load: PositionLoad,
    /// What a model tells.
    pub modelled: Modelled,
}

impl Restored {
    /// Of these parameters.
    #[must_use]
    pub fn of(parameters: &AxisParameters) -> Self {
        let AxisParameters { estimates, compensation, position_load, modelled, .. } = *parameters;
        Restored { estimates, compensation, position_load, modelled }
    }
}

impl Order {
    /// Puts a new configuration in force.
    pub fn configure(config: &Config) -> Result<Order, ConfigError> {
        Axis::new(config).map(|axis| Order::Install(axis, None))
    }

    /// Checks what a command brings, and builds its axis.
    ///
    /// # Errors
    /// It brings values that cannot be.
    pub fn of(command: &Command) -> Result<Order, Refusal> {
        Order::built(command, |axis, _| Ok(axis))
    }

    /// Puts stored parameters in force.
    pub fn restore(parameters: &AxisParameters) -> Result<Order, SettingsError> {
        Axis::from_parameters(parameters).map(|axis| Order::Install(axis, Some(Restored::of(parameters))))
    }
}

/// Where constants come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// A configuration. It keeps what was chosen before.
    Bare,
    /// A set of parameters. It brings everything along.
    Whole,
}

impl<P> Order<P> {
    /// Checks what a command brings. `place` gets the constants of an axis that is configured.
    pub(crate) fn built(
        command: &Command,
        place: impl FnOnce(Axis, Origin) -> Result<P, Refusal>,
    ) -> Result<Self, Refusal> {
        match command {
            Command::Configure(config) => Ok(Order::Install(place(Axis::new(config)?, Origin::Bare)?, None)),
            Command::Restore(parameters) => {
                let axis = Axis::from_parameters(parameters).map_err(Refusal::Parameters)?;
                Ok(Order::Install(place(axis, Origin::Whole)?, Some(Restored::of(parameters))))
            }
            other => {
                if let Command::Adopt(estimates) = other {
                    estimates.check()?;
                }
                Ok(Order::Run(*other))
            }
        }
    }

    /// Computes what the units of the axis decide. The order comes to the same, with the same bits, and takes less of its
    /// tick; if the axis has other units by then, it takes as long as if nothing had been computed.
    pub fn ahead(&mut self, units: &Units) {
        if let Order::Run(Command::TrackSine { amplitude_rad, frequency_hz, duration_ms }) = *self {
            *self = Order::Sine(Ahead::new(units, Asked { amplitude_rad, frequency_hz, duration_ms }));
        }
    }
}

impl<P: AsRef<Axis>> Order<P> {
    /// The configuration that the board has to take over, if there is one.
    #[must_use]
    pub fn configuration(&self) -> Option<&Config> {
        match self {
            Order::Install(axis, _) => Some(&axis.as_ref().scale().config),
            _ => None,
        }
    }
}
