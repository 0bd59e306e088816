//! An axis from power-up on: before it is configured there is nothing but an open bridge.
//!
//! The control interrupt of the image and the replay on the host both run exactly this, so that commands and samples
//! in the same order give the same bits.

pub use crate::axis::order::{Order, Restored};
use crate::axis::{Axis, Bridge, Command, Output, Refusal, Sample, State};
use crate::commission::Outcome;
use crate::config::{Config, Scale};
use crate::protect::{Condition, Fault};
use crate::pwm::Drive;
use crate::record::{Activity, Record};
use crate::store::{AtRest, AxisParameters};

/// What a tick brought, with the record of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick<'a> {
    /// What the bridge is to do, and the record; the default before the first configuration: bridge open.
    pub output: Output,
    /// A commissioning that ended in this tick.
    pub concluded: Option<&'a Outcome>,
}

/// What a tick brought. [`ServoAxis::record`] tells the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Advance<'a> {
    /// What the bridge is to do; open before the first configuration.
    pub drive: Drive,
    /// A commissioning that ended in this tick.
    pub concluded: Option<&'a Outcome>,
}

/// An axis and its state, before and after its configuration. `P` holds the constants of the axis: the axis itself, or a
/// pointer to it, which is exchanged as a whole.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct ServoAxis<P = Axis> {
    /// `None`: not configured.
    axis: Option<P>,
    /// Fault raised before the first configuration; latched once the axis exists.
    waiting: Fault,
    driven: bool,
    commissioning: bool,
    /// A commissioning ended in the last tick.
    ended: bool,
    /// Of the axis, if there is one. Apart from it, so that a configuration sets it up in place.
    state: State,
}

impl<P> Default for ServoAxis<P> {
    #[inline]
    fn default() -> Self {
        Self {
            axis: None,
            waiting: Fault::default(),
            driven: false,
            commissioning: false,
            ended: false,
            state: State::default(),
        }
    }
}

impl ServoAxis {
    /// Before the first configuration.
    pub fn new() -> Self {
        Self::default()
    }

    /// Executes an order at the start of a tick, before [`ServoAxis::step`]. What a bare configuration keeps is worked out
    /// here; [`ServoAxis::carry_out`] is for whoever has done so before.
    ///
    /// # Errors
    /// Why not. Nothing has changed then.
    pub fn execute(&mut self, order: &Order) -> Result<(), Refusal> {
        match (order, &self.axis) {
            (Order::Install(axis, None), Some(earlier)) if !self.driven => {
                let axis = axis.keeping(earlier).map_err(Refusal::Parameters)?;
                self.carry_out(&Order::Install(axis, None))
            }
            _ => self.carry_out(order),
        }
    }
}

impl<P: AsRef<Axis> + Clone> ServoAxis<P> {
    /// Carries out an order at the start of a tick, before [`ServoAxis::step`]. No constant is computed: a bare configuration
    /// has been through [`Axis::keeping`] with the axis in force.
    ///
    /// # Errors
    /// Why not. Nothing has changed then.
    pub fn carry_out(&mut self, order: &Order<P>) -> Result<(), Refusal> {
        match order {
            Order::Install(..) | Order::Run(Command::Reset) if self.driven => Err(Refusal::BridgeDriven),
            Order::Install(axis, restored) => {
                self.install(axis, restored.as_ref());
                Ok(())
            }
            Order::Run(Command::Reset) => {
                self.waiting = self.fault();
                self.axis = None;
                Ok(())
            }
            Order::Sine(sine) => self.run(|axis, state| axis.command_ahead(state, sine)),
            Order::Run(Command::Stop) if self.axis.is_none() => {
                self.waiting = Fault::None;
                Ok(())
            }
            Order::Run(Command::Arm) if self.axis.is_some() && self.seeks_zero() => {
                Err(Refusal::CurrentZeroSought)
            }
            Order::Run(Command::Adopt(estimates)) => self.run(|axis, state| axis.adopt(state, estimates)),
            Order::Run(command) => self.run(|axis, state| axis.command(state, command)),
        }
    }

    /// After a restart nothing runs, so what an earlier life has found is never refused.
    fn install(&mut self, new: &P, restored: Option<&Restored>) {
        let fault = self.fault();
        let kept = self.axis.is_none() || self.state.compensation;
        let (axis, state) = (&*self.axis.insert(new.clone()), &mut self.state);
        let axis = axis.as_ref();
        axis.restart(state);
        axis.latch(state, fault);
        state.compensation = match restored {
            Some(restored) => {
                Axis::take_over(state, &restored.estimates);
                // It acts once the loops are known, and its zero is.
                state.load.take(&restored.position_load, None, 0);
                state.take(restored.modelled);
                restored.compensation
            }
            None => kept,
        };
    }
}

impl<P: AsRef<Axis>> ServoAxis<P> {
    /// Can this order be executed in this tick without much ado? For some ticks behind a new configuration a motion takes long, for
    /// all that its gains follow from is then computed at once; and a tick in which protection looks, or the splines of the identification are sampled, is long enough.
    /// Whoever can wait asks before [`ServoAxis::execute`].
    #[must_use]
    pub fn is_ready(&self, order: &Order<P>) -> bool {
        let plans = match order {
            Order::Install(..) => false,
            Order::Sine(_) => true,
            Order::Run(command) => command.plans(),
        };
        let free = |axis: &Axis| {
            self.state.is_designed() && !axis.is_look_due(&self.state) && !axis.is_crowded(&self.state)
        };
        !plans || self.constants().is_none_or(free)
    }

    fn run(&mut self, command: impl FnOnce(&Axis, &mut State) -> Result<(), Refusal>) -> Result<(), Refusal> {
        let axis = self.axis.as_ref().ok_or(Refusal::NotConfigured)?;
        command(axis.as_ref(), &mut self.state)
    }

    /// Did the last sample tell that the zero of the current sensor is still looked for? A fault is told first.
    fn seeks_zero(&self) -> bool {
        self.state.seen.sample.current_raw == Sample::CURRENT_ZERO_SOUGHT && self.fault() == Fault::None
    }

    /// The latched fault, or the one that waits for an axis.
    fn fault(&self) -> Fault {
        match self.axis {
            Some(_) => self.state.fault(),
            None => self.waiting,
        }
    }

    /// Reports a condition outside the samples (interlock, overrun, watchdog). Call it after [`ServoAxis::execute`] and
    /// before [`ServoAxis::step`]: a `Stop` in the same tick then cannot clear a condition that persists. The interlock is
    /// a level: report it in every tick. A fault that follows is latched, and kept through a configuration, until
    /// [`Command::Stop`] clears it.
    pub fn raise(&mut self, notice: Condition) {
        match &self.axis {
            Some(axis) => axis.as_ref().raise(&mut self.state, notice),
            None if self.waiting == Fault::None => self.waiting = notice.fault(),
            None => {}
        }
    }

    /// Call this before [`ServoAxis::step`] if the index pulse was high when the count was sampled.
    pub fn index(&mut self) {
        if let Some(axis) = &self.axis {
            axis.as_ref().index(&mut self.state);
        }
    }

    /// Counts may have been lost: positions count from power-up again, absolute targets need a new reference, and no table over the
    /// place acts.
    pub fn lose_reference(&mut self) {
        self.state.lose_reference();
    }

    /// What holds the constants in force; `None`: not configured.
    #[must_use]
    pub fn in_force(&self) -> Option<&P> {
        self.axis.as_ref()
    }

    #[inline]
    fn constants(&self) -> Option<&Axis> {
        self.axis.as_ref().map(P::as_ref)
    }

    /// The configuration in force.
    #[must_use]
    pub fn config(&self) -> Option<&Config> {
        self.constants().map(|axis| &axis.scale().config)
    }

    /// Its machine units.
    #[must_use]
    pub fn scale(&self) -> Option<&Scale> {
        self.constants().map(Axis::scale)
    }

    /// What is in force, as it is stored; `None`: not configured.
    #[must_use]
    pub fn parameters(&self) -> Option<AxisParameters> {
        self.constants().map(|axis| axis.parameters(&self.state))
    }

    /// Was the bridge driven or shorted in the last tick?
    #[must_use]
    pub fn is_driven(&self) -> bool {
        self.driven
    }

    /// Is the bridge open, and does the shaft stand?
    #[must_use]
    pub fn rests(&self) -> Option<AtRest> {
        let stands = self.constants().is_none_or(|axis| axis.stands(&self.state));
        let bridge = if self.driven { Bridge::Driven } else { Bridge::Open };
        AtRest::check(bridge, stands)
    }

    /// One control tick, and what there is to tell about it.
    pub fn step(&mut self, sample: Sample) -> Tick<'_> {
        let drive = self.advance(sample).drive;
        let Drive { bridge, duty } = drive;
        let output = Output { bridge, duty, record: self.record() };
        Tick { output, concluded: self.concluded() }
    }

    /// One control tick. Who wants its record asks for it: it takes a tenth of the tick.
    #[inline]
    pub fn advance(&mut self, sample: Sample) -> Advance<'_> {
        self.ended = false;
        let Some(axis) = self.axis.as_ref().map(P::as_ref) else {
            return Advance { drive: Drive::default(), concluded: None };
        };
        let drive = axis.advance(&mut self.state, sample);
        let commissioning = self.state.is_commissioning();
        self.ended = self.commissioning && !commissioning;
        self.commissioning = commissioning;
        self.driven = drive.bridge != Bridge::Open;
        Advance { drive, concluded: self.concluded() }
    }

    /// The commissioning that ended in the last tick.
    #[inline]
    fn concluded(&self) -> Option<&Outcome> {
        if self.ended { self.state.outcome() } else { None }
    }

    /// What there is to tell about the last tick: before the first configuration nothing but a fault that waits.
    #[must_use]
    pub fn record(&self) -> Record {
        match (&self.axis, self.waiting) {
            (Some(_), _) => self.state.record(),
            (None, Fault::None) => Record::default(),
            (None, fault) => Record { fault, activity: Activity::Faulted, ..Record::default() },
        }
    }
}
