//! Protection: faults told apart from duty, count, current and supply alone, latched, and answered.
//!
//! ```text
//! sample → gather   sums over a few ticks; jumps of the count
//!        → limits   supply, current, speed, silence of the host
//!        → thermal  I²t
//!        → motion   does the encoder follow? → winding: stalled, unplugged or disconnected?
//! image  → notice   permission lines, overrun, watchdog, damaged parameters
//!                   → fault, latched → action: open, brake, hold
//! ```
//!
//! A latched fault stays until it is cleared explicitly ([`crate::link::protocol::Command::Stop`]), and is found anew if its
//! cause is still there.

pub mod action;
mod balance;
mod break_away;
mod expectation;
mod fault;
mod gather;
mod limits;
mod looks;
mod motion;
mod settings;
mod thermal;
mod winding;

use crate::units::{Speed, Voltage};
pub use action::{Action, Actions, Forbidden};
pub use expectation::{EXPECTED_COUNTS, Expectation, KINETIC_MARGIN, MOVING_MARGIN, REST_MARGIN};
pub use fault::{Condition, Fault, Interlock};
use gather::Due;
pub use gather::{Averages, Reading};
pub(crate) use limits::{OVER_CURRENT, highest_supply_v};
pub use settings::{Settings, SettingsError};
pub use thermal::Thermal;

/// Protection of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Params {
    gather: gather::Params,
    limits: limits::Params,
    thermal: Option<thermal::Params>,
    winding: winding::Params,
    actions: Actions,
}

/// What protection remembers. In this order, the largest last.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct State {
    latched: Fault,
    /// What is done about it; the most severe of all that was found since.
    action: Action,
    gather: gather::State,
    limits: limits::State,
    thermal: thermal::State,
    motion: motion::State,
    /// The winding was learned behind an input dead zone.
    input_dead_zone: bool,
    winding: winding::State,
}

/// What protection looks at, now and then. By default nothing is sensed, and the shaft stands with the bridge open.
#[derive(Clone, Copy, Debug, Default)]
pub struct Input {
    /// Raw counter.
    pub count: i32,
    /// Measured supply; `None`: not measured.
    pub supply: Option<Voltage>,
    /// Raw current; `None`: not sensed.
    pub current: Option<i16>,
    /// What acted and flowed since the last look.
    pub averages: Averages,
    /// Speed estimate, no more than the counter allows.
    pub speed: Speed,
    /// Speed over the counter's last edge interval.
    pub edge_speed: Speed,
    /// What of that voltage reaches the winding: behind the drive's input dead zone, if the drive is known to have one.
    pub winding: Voltage,
    /// Is it known to have one?
    pub input_dead_zone: bool,
    /// Terminal voltage that the observed load takes.
    pub load: Voltage,
    /// What holds a load that depends on the place and is known: it moves nothing.
    pub position_load: Voltage,
    /// At rest within the hold band: nothing is to move.
    pub holding: bool,
    /// A motion that does not end by itself: it needs a host that lives.
    pub endless: bool,
    /// A commissioning drives. Its ticks are long; so soon after its start the winding is not looked at as closely as else.
    pub commissioning: bool,
}

impl State {
    /// The latched fault.
    #[must_use]
    #[inline]
    pub fn fault(&self) -> Fault {
        self.latched
    }

    /// Latches a fault, unless one is latched already, and asks for its action, unless a more severe one is in force.
    #[inline]
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

    /// As after power-up, in place: it is a good part of an axis, and this happens in a control tick.
    pub(crate) fn restart(&mut self) {
        // Without `..`, so that no new field is forgotten.
        let Self { latched, action, gather, limits, thermal, motion, input_dead_zone, winding } = self;
        (*latched, *action, *input_dead_zone) = (Fault::None, Action::default(), false);
        *gather = gather::State::default();
        *limits = limits::State::default();
        *thermal = thermal::State::default();
        *motion = motion::State::default();
        winding.forget();
    }

    /// The counter's first reading: nothing has moved.
    pub(crate) fn found_at(&mut self, count: i32) {
        self.motion.begin(count);
    }

    /// Forgets the fault and all half-grown suspicions; not the heat of the winding, nor what was learned about it and
    /// about the starts.
    pub fn clear(&mut self, count: i32) {
        self.latched = Fault::None;
        self.action = Action::default();
        self.limits.clear();
        self.winding.clear();
        self.motion.begin(count);
    }

    /// The bridge is open and the shaft stands here: until it is driven, nothing is demanded of it.
    #[inline]
    pub(crate) fn comes_to_rest(&mut self, count: i32) {
        self.motion.begin(count);
        self.winding.rest();
    }

    /// Has the last look left something to the ticks before the next one?
    #[inline]
    pub(crate) fn is_due(&self) -> bool {
        self.winding.is_due()
    }

    /// A commissioning has seen the shaft start: voltage and dead zone by direction.
    pub(crate) fn broke_away(&mut self, starts: [(Voltage, Voltage); 2]) {
        self.motion.broke_away(starts);
    }

    /// The host lives.
    pub(crate) fn heard(&mut self) {
        self.limits.heard();
    }

    /// What is to be done about the latched fault.
    #[must_use]
    #[inline]
    pub fn action(&self) -> Option<Action> {
        (self.latched != Fault::None).then_some(self.action)
    }
}

impl Params {
    /// Thresholds from the configuration, everything else at its default.
    #[must_use]
    pub fn standard(scale: &crate::config::Scale) -> Self {
        Self {
            gather: gather::Params::new(scale),
            limits: limits::Params::new(scale, &Settings::default()),
            thermal: None,
            winding: winding::Params::new(scale),
            actions: Actions::default(),
        }
    }

    /// Thresholds from configuration and settings.
    pub fn new(scale: &crate::config::Scale, settings: &Settings) -> Result<Self, SettingsError> {
        settings.check()?;
        let thermal = settings.thermal.map(|thermal| thermal.build(scale));
        Ok(Self {
            gather: gather::Params::new(scale),
            limits: limits::Params::new(scale, settings),
            thermal: thermal.transpose().map_err(SettingsError::Value)?,
            winding: winding::Params::new(scale),
            actions: settings.actions,
        })
    }

    /// The table of actions.
    #[must_use]
    pub fn actions(&self) -> &Actions {
        &self.actions
    }

    /// One tick. The means since the last look when another one is due.
    #[inline]
    pub fn tick(&self, state: &mut State, expectation: &Expectation, reading: &Reading) -> Option<Averages> {
        match self.gather.step(&mut state.gather, expectation, reading) {
            Due::Nothing => None,
            Due::Look => Some(state.gather.take(self.gather.bits())),
            Due::Bend => {
                if state.gather.jumps(expectation) {
                    state.latch(Fault::SlippingCounts, &self.actions);
                }
                None
            }
        }
    }

    /// A tick between two looks, of an axis that moves or may: what the looks have left to it, if they have.
    #[cold]
    #[inline]
    pub fn between(&self, state: &mut State) {
        self.winding.between(&mut state.winding);
    }

    /// One tick of an axis at rest with its bridge open: what it could do wrong needs neither motion nor current. True when
    /// another look is due.
    #[inline]
    pub fn rest(&self, state: &mut State, count: i32) -> bool {
        let due = self.gather.rest(&mut state.gather, count) == Due::Look;
        if due {
            state.gather.take(self.gather.bits());
        }
        due
    }

    /// A look at an axis at rest with its bridge open: supply, current, heat of the winding.
    #[inline]
    pub fn look_at_rest(&self, state: &mut State, expectation: &Expectation, input: &Input) {
        state.motion.stand();
        for fault in [self.limits.step(&mut state.limits, expectation, input), self.overload(state, input)] {
            state.latch(fault, &self.actions);
        }
    }

    /// Are there at least three ticks between two looks?
    #[inline]
    pub(crate) fn spreads(&self) -> bool {
        self.winding.spreads()
    }

    /// Does this tick follow one with a look? True in every tick where every tick has one.
    #[inline]
    pub(crate) fn is_behind_look(&self, state: &State) -> bool {
        self.gather.is_behind(&state.gather)
    }

    /// Ticks from this one, which was not gathered yet and counts as one, to a later one behind a look.
    pub(crate) fn ticks_behind_look(&self, state: &State) -> u32 {
        self.gather.ticks_behind_look(&state.gather)
    }

    /// Is the next tick one with a look, unless counts jump?
    pub fn is_look_due(&self, state: &State) -> bool {
        self.gather.is_due(&state.gather)
    }

    /// Ticks between two looks.
    #[must_use]
    #[inline]
    pub fn look_ticks(&self) -> u32 {
        1 << (self.gather.bits() & 31)
    }

    /// A look: latches what is found.
    #[inline]
    pub fn look(&self, state: &mut State, expectation: &Expectation, input: &Input) {
        let found = [
            self.limits.step(&mut state.limits, expectation, input),
            self.overload(state, input),
            self.moves(state, expectation, input),
        ];
        for fault in found {
            state.latch(fault, &self.actions);
        }
    }

    #[inline]
    fn overload(&self, state: &mut State, input: &Input) -> Fault {
        match (&self.thermal, input.current) {
            (Some(thermal), Some(current)) if thermal.step(&mut state.thermal, current) => Fault::Overload,
            _ => Fault::None,
        }
    }

    /// Does the encoder follow, and if not, why?
    #[inline]
    fn moves(&self, state: &mut State, expectation: &Expectation, input: &Input) -> Fault {
        let missing = state.motion.step(expectation, input);
        if let Some(current) = input.current {
            if input.input_dead_zone != state.input_dead_zone {
                state.input_dead_zone = input.input_dead_zone;
                state.winding.forget();
            }
            let voltage = input.averages.voltage.map(|_| input.winding);
            let fresh = state.motion.fresh(input);
            let winding = &mut state.winding;
            self.winding.step(winding, &input.averages, voltage, current, input.count, fresh);
        }
        match (missing, input.current) {
            (None, Some(_)) => state.winding.lasting(),
            (Some(missing), Some(current)) => {
                state.winding.judge(&missing, current, input.count).unwrap_or(state.winding.lasting())
            }
            (None, None) => Fault::None,
            (Some(missing), None) if missing.reversed => Fault::WrongDirection,
            (Some(missing), None) if missing.sure > 0 => Fault::NoMotion,
            (Some(_), None) => Fault::None,
        }
    }
}
