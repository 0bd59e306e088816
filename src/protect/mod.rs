//! Protection: faults told apart from duty, count, current and supply alone, latched, and answered.
//!
//! ```text
//! sample → limits   supply, current, speed, jumps of the count, silence of the host
//!        → thermal  I²t
//!        → motion   does the encoder follow? → winding: stalled, unplugged or disconnected?
//! image  → notice   permission lines, overrun, watchdog, damaged parameters
//!                   → fault, latched → action: open, brake, hold
//! ```
//!
//! A latched fault stays until it is cleared explicitly ([`crate::protocol::Command::Stop`]), and is found anew if its
//! cause is still there.

pub mod action;
mod fault;
mod limits;
mod motion;
mod settings;
mod thermal;
mod winding;

use crate::units::{Speed, Voltage};
pub use action::{Action, Actions, Forbidden};
pub use fault::{Fault, Notice, Permit};
pub use motion::{EXPECTED_COUNTS, Expectation, MOVING_MARGIN, REST_MARGIN};
pub use settings::{Settings, SettingsError};
pub use thermal::Thermal;

/// Protection of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Params {
    limits: limits::Params,
    thermal: Option<thermal::Params>,
    /// Ticks over which the winding's equation is integrated.
    block_ticks: u32,
    actions: Actions,
}

/// What protection remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    latched: Fault,
    /// What is done about it; the most severe of all that was found since.
    action: Action,
    limits: limits::State,
    thermal: thermal::State,
    motion: motion::State,
    winding: winding::State,
    /// The winding was learned behind an input dead zone.
    swallows: bool,
}

/// What protection looks at.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// Raw counter.
    pub count: i32,
    /// Measured supply; `None`: not measured.
    pub supply: Option<Voltage>,
    /// Raw current; `None`: not sensed.
    pub current: Option<i16>,
    /// Speed estimate.
    pub speed: Speed,
    /// Terminal voltage that acted since the last tick; `None`: bridge open.
    pub voltage: Option<Voltage>,
    /// What of it reaches the winding: behind the drive's input dead zone, if the drive is known to have one.
    pub winding: Voltage,
    /// Is it known to have one?
    pub swallows: bool,
    /// Terminal voltage that the observed load takes.
    pub load: Voltage,
    /// At rest within the hold band: nothing is to move.
    pub holding: bool,
    /// A motion that does not end by itself: it needs a host that lives.
    pub endless: bool,
}

impl State {
    /// The latched fault.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.latched
    }

    /// Latches a fault, unless one is latched already, and asks for its action, unless a more severe one is in force.
    pub(crate) fn latch(&mut self, fault: Fault, actions: &Actions) {
        if fault == Fault::None {
            return;
        }
        if self.latched == Fault::None {
            self.latched = fault;
            self.action = actions.of(fault);
        }
        self.action = self.action.max(actions.of(fault));
    }

    /// The counter's first reading: nothing has moved.
    pub(crate) fn found_at(&mut self, count: i32) {
        self.motion = motion::State::at(count);
    }

    /// Forgets the fault and all half-grown suspicions; not the heat of the winding, nor what was learned about it.
    pub fn clear(&mut self, count: i32) {
        self.latched = Fault::None;
        self.action = Action::default();
        self.limits.clear();
        self.winding.clear();
        self.motion = motion::State::at(count);
    }

    /// The host lives.
    pub(crate) fn heard(&mut self) {
        self.limits.heard();
    }

    /// Takes what was learned about the winding into use. In single precision: when a command or a commissioning asks
    /// for arithmetic of that kind anyway, not in every tick.
    pub(crate) fn refresh(&mut self) {
        self.winding.solve();
    }
}

impl Params {
    /// Thresholds from the configuration, everything else at its default.
    #[must_use]
    pub fn standard(scale: &crate::config::Scale) -> Self {
        Self {
            limits: limits::Params::new(scale, &Settings::default()),
            thermal: None,
            block_ticks: winding::block_ticks(scale),
            actions: Actions::default(),
        }
    }

    /// Thresholds from configuration and settings.
    pub fn new(scale: &crate::config::Scale, settings: &Settings) -> Result<Self, SettingsError> {
        settings.check()?;
        let thermal = settings.thermal.map(|thermal| thermal.build(&scale.config));
        Ok(Self {
            limits: limits::Params::new(scale, settings),
            thermal: thermal.transpose().map_err(SettingsError::Value)?,
            block_ticks: winding::block_ticks(scale),
            actions: settings.actions,
        })
    }

    /// The table of actions.
    #[must_use]
    pub fn actions(&self) -> &Actions {
        &self.actions
    }

    /// One tick: what is to be done about the latched fault, or about the first that is found now.
    pub fn step(&self, state: &mut State, expectation: &Expectation, input: &Input) -> Option<Action> {
        let found = [
            self.limits.step(&mut state.limits, expectation, input),
            self.overload(state, input),
            self.moves(state, expectation, input),
        ];
        for fault in found {
            state.latch(fault, &self.actions);
        }
        (state.latched != Fault::None).then_some(state.action)
    }

    fn overload(&self, state: &mut State, input: &Input) -> Fault {
        match (&self.thermal, input.current) {
            (Some(thermal), Some(current)) if thermal.step(&mut state.thermal, current) => Fault::Overload,
            _ => Fault::None,
        }
    }

    /// Does the encoder follow, and if not, why?
    fn moves(&self, state: &mut State, expectation: &Expectation, input: &Input) -> Fault {
        let missing = state.motion.step(expectation, input);
        if let Some(current) = input.current {
            if input.swallows != state.swallows {
                state.swallows = input.swallows;
                state.winding.forget();
            }
            let voltage = input.voltage.map(|_| winding::q14(input.winding));
            let fresh = state.motion.fresh();
            state
                .winding
                .step(self.block_ticks, voltage, current, input.count, fresh);
        }
        match (missing, input.current) {
            (None, Some(_)) => state.winding.lasting(),
            (None, None) => Fault::None,
            (Some(missing), _) if missing.reversed => Fault::WrongDirection,
            (Some(missing), Some(current)) => state.winding.judge(&missing, current).unwrap_or_default(),
            (Some(_), None) => Fault::NoMotion,
        }
    }
}
