//! An axis from power-up on: before it is configured there is nothing but an open bridge.
//!
//! The control interrupt of the image and the replay on the host both run exactly this, so that commands and samples
//! in the same order give the same bits.

use crate::axis::{self, Axis, Bridge, Output, Sample, State};
use crate::commission::Outcome;
use crate::config::Config;
use crate::identify::estimate::Estimates;
use crate::link::protocol::{Command, Refusal};
use crate::protect::{Fault, Notice, SettingsError};
use crate::record::Activity;
use crate::store::{AtRest, AxisParameters};

/// What a command becomes once the link has unpacked it. Building an [`Axis`] divides in floating point and so is done
/// by the link task; the control interrupt only puts it in place.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub enum Order {
    /// Put this axis in place and start anew; with what an earlier life has found and chosen, if it comes along. Without,
    /// the choices of the axis that was there before stay (see [`Command::Configure`]).
    Install(Axis, Option<Restored>),
    /// Forget everything.
    Reset,
    /// Pass on to the axis.
    Run(Command),
}

/// What a new life takes over apart from configuration and tuning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restored {
    /// What was identified.
    pub estimates: Estimates,
    /// Use the inverse dead zone in the loops.
    pub compensation: bool,
}

impl Order {
    /// Unpacks a command.
    pub fn from_command(command: &Command) -> Result<Order, Refusal> {
        match command {
            Command::Configure(config) => Axis::new(config)
                .map(|axis| Order::Install(axis, None))
                .map_err(Refusal::Config),
            Command::Restore(parameters) => Order::restore(parameters).map_err(Refusal::Parameters),
            Command::Adopt(estimates) => match estimates.check() {
                Ok(()) => Ok(Order::Run(*command)),
                Err(error) => Err(Refusal::Config(error)),
            },
            Command::Reset => Ok(Order::Reset),
            other => Ok(Order::Run(*other)),
        }
    }

    /// Puts stored parameters in force.
    pub fn restore(parameters: &AxisParameters) -> Result<Order, SettingsError> {
        let restored = Restored {
            estimates: parameters.estimates,
            compensation: parameters.compensation,
        };
        Axis::from_parameters(parameters).map(|axis| Order::Install(axis, Some(restored)))
    }

    /// The configuration that the board has to take over, if there is one.
    #[must_use]
    pub fn configuration(&self) -> Option<&Config> {
        match self {
            Order::Install(axis, _) => Some(&axis.scale().config),
            _ => None,
        }
    }
}

/// What a tick brought.
///
/// Borrowed from the joint, so that nothing large is copied in every tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick<'a> {
    /// What the bridge is to do, and the record; the default before the first configuration: bridge open.
    pub output: &'a Output,
    /// A commissioning that ended in this tick.
    pub concluded: Option<&'a Outcome>,
}

/// One joint.
#[derive(Clone, Debug, Default)]
pub struct Joint {
    /// `None`: not configured.
    axis: Option<Axis>,
    /// Of the axis, if there is one. Apart from it, so that a configuration sets it up in place.
    state: State,
    /// What was found before there was an axis to tell.
    waiting: Fault,
    driven: bool,
    commissioning: bool,
    output: Output,
}

impl Joint {
    /// Before the first configuration.
    pub fn new() -> Self {
        Self::default()
    }

    /// Executes an order at the start of a tick, before [`Joint::step`].
    pub fn execute(&mut self, order: &Order) -> Result<(), Refusal> {
        match (order, &self.axis) {
            (Order::Install(..) | Order::Reset, _) if self.driven => Err(Refusal::BridgeDriven),
            (Order::Install(axis, Some(restored)), _) => {
                self.install(axis);
                axis.restore(&mut self.state, restored).map_err(Refusal::Axis)
            }
            (Order::Install(axis, None), Some(earlier)) => {
                let (axis, compensation) = (
                    axis.keeping(earlier).map_err(Refusal::Parameters)?,
                    self.state.compensation,
                );
                self.install(&axis);
                self.state.compensation = compensation;
                Ok(())
            }
            (Order::Install(axis, None), None) => {
                self.install(axis);
                Ok(())
            }
            (Order::Reset, _) => {
                self.waiting = self.fault();
                self.axis = None;
                Ok(())
            }
            (Order::Run(Command::Arm), Some(_)) if self.seeks_zero() => {
                Err(Refusal::Axis(axis::Refusal::CurrentZeroSought))
            }
            (Order::Run(command), Some(axis)) => execute(axis, &mut self.state, command),
            (Order::Run(Command::Stop), None) => {
                self.waiting = Fault::None;
                Ok(())
            }
            (Order::Run(_), None) => Err(Refusal::NotConfigured),
        }
    }

    fn install(&mut self, axis: &Axis) {
        let fault = self.fault();
        let (axis, state) = (self.axis.insert(*axis), &mut self.state);
        axis.restart(state);
        axis.latch(state, fault);
    }

    /// Did the last sample tell that the zero of the current sensor is still looked for? A fault is told first.
    fn seeks_zero(&self) -> bool {
        self.output.record.current_raw == Sample::CURRENT_ZERO_SOUGHT && self.fault() == Fault::None
    }

    /// The latched fault, or the one that waits for an axis.
    fn fault(&self) -> Fault {
        match self.axis {
            Some(_) => self.state.fault(),
            None => self.waiting,
        }
    }

    /// Takes what the samples do not show: between [`Joint::execute`] and [`Joint::step`] of the same tick, so that a
    /// condition that lasts cannot be cleared. The permission in every tick, everything else when it happens. A fault
    /// that follows is latched, and kept through a configuration, until [`Command::Stop`] clears it.
    pub fn heed(&mut self, notice: Notice) {
        match &self.axis {
            Some(axis) => axis.heed(&mut self.state, notice),
            None if self.waiting == Fault::None => self.waiting = notice.fault(),
            None => {}
        }
    }

    /// The index pulse of the encoder is there in this tick: before [`Joint::step`] with the count of the same moment.
    pub fn index(&mut self) {
        if let Some(axis) = &self.axis {
            axis.index(&mut self.state);
        }
    }

    /// The configuration in force.
    #[must_use]
    pub fn config(&self) -> Option<&Config> {
        self.axis.as_ref().map(|axis| &axis.scale().config)
    }

    /// What is in force, as it is stored; `None`: not configured.
    #[must_use]
    pub fn parameters(&self) -> Option<AxisParameters> {
        self.axis.as_ref().map(|axis| axis.parameters(&self.state))
    }

    /// Is the bridge open, and does the shaft stand?
    #[must_use]
    pub fn rests(&self) -> Option<AtRest> {
        let stands = self.axis.as_ref().is_none_or(|axis| axis.stands(&self.state));
        let bridge = if self.driven { Bridge::Driven } else { Bridge::Open };
        AtRest::check(bridge, stands)
    }

    /// One control tick.
    pub fn step(&mut self, sample: Sample) -> Tick<'_> {
        let Some(axis) = &self.axis else {
            self.output = unconfigured(self.waiting);
            return Tick {
                output: &self.output,
                concluded: None,
            };
        };
        axis.step_into(&mut self.state, sample, &mut self.output);
        let commissioning = self.output.record.activity == Activity::Commissioning;
        let ended = self.commissioning && !commissioning;
        self.commissioning = commissioning;
        self.driven = self.output.bridge != Bridge::Open;
        Tick {
            output: &self.output,
            concluded: if ended { self.state.outcome() } else { None },
        }
    }
}

/// Bridge open; there is nothing to tell but a fault that waits.
fn unconfigured(waiting: Fault) -> Output {
    let mut output = Output::default();
    output.record.fault = waiting;
    if waiting != Fault::None {
        output.record.activity = Activity::Faulted;
    }
    output
}

fn execute(axis: &Axis, state: &mut State, command: &Command) -> Result<(), Refusal> {
    match command {
        Command::Adopt(estimates) => axis.adopt(state, estimates),
        other => axis.command(state, other),
    }
    .map_err(Refusal::Axis)
}
