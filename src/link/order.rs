//! What a command becomes once it is unpacked: an order to an axis, or a service of the link itself.

use super::capture::Trigger;
use super::protocol::{Command, Refusal};
use crate::axis;
use crate::axis::servo_axis::{self, OrderRefusal, Restored};
use crate::config::ConfigError;
use crate::drivers::scales::ScaleError;

/// An unpacked command. `P` holds the constants of an axis that is configured.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub enum Order<P = axis::Axis> {
    /// For the axis.
    Axis(servo_axis::Order<P>),
    /// For whoever owns link, capture and store.
    Service(Service),
}

/// Where constants come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// A configuration. It keeps what was chosen before.
    Bare,
    /// A set of parameters. It brings everything along.
    Whole,
}

/// What the link offers apart from the axes. The meaning stands at the [`Command`] of the same name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Service {
    /// [`Command::Subscribe`].
    Subscribe {
        /// Decimation, ticks.
        every: u32,
    },
    /// [`Command::CaptureArm`].
    CaptureArm {
        /// What to wait for.
        trigger: Trigger,
        /// Ticks to keep from before it.
        before: u16,
    },
    /// [`Command::CaptureRead`].
    CaptureRead {
        /// First tick wanted, oldest 0.
        from: u16,
    },
    /// [`Command::Hello`].
    Hello,
    /// [`Command::Parameters`].
    Parameters,
    /// [`Command::Save`].
    Save,
}

impl Order {
    /// Unpacks a command; checks what it brings.
    pub fn from_command(command: &Command) -> Result<Order, Refusal> {
        Order::unpacked(command, |axis, _| Ok(axis))
    }
}

impl<P> Order<P> {
    /// Unpacks a command; checks what it brings. `place` gets the constants of an axis that is configured.
    pub(super) fn unpacked(
        command: &Command,
        place: impl FnOnce(axis::Axis, Origin) -> Result<P, Refusal>,
    ) -> Result<Self, Refusal> {
        use axis::Command as Axis;
        let run = match *command {
            Command::Configure(ref config) => {
                let axis = place(axis::Axis::new(config)?, Origin::Bare)?;
                return Ok(Order::Axis(servo_axis::Order::Install(axis, None)));
            }
            Command::Restore(ref parameters) => {
                let axis = axis::Axis::from_parameters(parameters).map_err(Refusal::Parameters)?;
                let axis = place(axis, Origin::Whole)?;
                return Ok(Order::Axis(servo_axis::Order::Install(axis, Some(Restored::of(parameters)))));
            }
            Command::Reset => return Ok(Order::Axis(servo_axis::Order::Reset)),
            Command::Adopt(estimates) => {
                estimates.check()?;
                Axis::Adopt(estimates)
            }
            Command::Arm => Axis::Arm,
            Command::Stop => Axis::Stop,
            Command::Commission { budget_ms, seed } => Axis::Commission { budget_ms, seed },
            Command::Compensation(on) => Axis::Compensation(on),
            Command::TrackSine { amplitude_rad, frequency_hz, duration_ms } => {
                Axis::TrackSine { amplitude_rad, frequency_hz, duration_ms }
            }
            Command::Position(rad) => Axis::Position(rad),
            Command::Speed(rad_s) => Axis::Speed(rad_s),
            Command::Voltage(volts) => Axis::Voltage(volts),
            Command::Reference(how) => Axis::Reference(how),
            Command::GoTo(rad) => Axis::GoTo(rad),
            Command::Excite(waveform) => Axis::Excite(waveform),
            Command::Stream(point) => Axis::Stream(point),
            Command::Subscribe { every } => return Ok(Order::Service(Service::Subscribe { every })),
            Command::CaptureArm { trigger, before } => {
                return Ok(Order::Service(Service::CaptureArm { trigger, before }));
            }
            Command::CaptureRead { from } => return Ok(Order::Service(Service::CaptureRead { from })),
            Command::Hello => return Ok(Order::Service(Service::Hello)),
            Command::Parameters => return Ok(Order::Service(Service::Parameters)),
            Command::Save => return Ok(Order::Service(Service::Save)),
        };
        Ok(Order::Axis(servo_axis::Order::Run(run)))
    }

    /// The order to the axis; a service is refused.
    pub fn for_axis(self) -> Result<servo_axis::Order<P>, Refusal> {
        match self {
            Order::Axis(order) => Ok(order),
            Order::Service(_) => Err(Refusal::Axis(axis::Refusal::NotForAxis)),
        }
    }
}

impl From<ConfigError> for Refusal {
    fn from(error: ConfigError) -> Self {
        Refusal::Config(error)
    }
}

impl From<ScaleError> for Refusal {
    fn from(error: ScaleError) -> Self {
        Refusal::Scale(error)
    }
}

impl From<OrderRefusal> for Refusal {
    fn from(refusal: OrderRefusal) -> Self {
        match refusal {
            OrderRefusal::Config(error) => Refusal::Config(error),
            OrderRefusal::Parameters(error) => Refusal::Parameters(error),
            OrderRefusal::NotConfigured => Refusal::NotConfigured,
            OrderRefusal::BridgeDriven => Refusal::BridgeDriven,
            OrderRefusal::Axis(refusal) => Refusal::Axis(refusal),
        }
    }
}
