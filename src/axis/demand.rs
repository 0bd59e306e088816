//! Set-point → what the loops ask of the bridge.

use super::state::{Mode, State};
use super::{Bridge, Refusal};
use crate::control::Reference;
use crate::motion::stream::{Flow, Step};
use crate::motion::trajectory::{Cruise, Move};
use crate::record::Limit;
use crate::units::{Position, Speed, Voltage, limited};

/// Half width of the band around a resting target in which the axis is silent, counts.
pub const HOLD_BAND: i32 = 1;

/// What the loops ask of the bridge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    pub bridge: Bridge,
    pub voltage: Voltage,
    pub meaning: Meaning,
}

/// How [`Demand::voltage`] is meant.
#[derive(Clone, Copy, Debug)]
pub(super) enum Meaning {
    /// At the terminals: nothing is compensated.
    Terminal,
    /// Behind the dead zone.
    Linear {
        /// Steady voltage of the reference speed; while it rests, a voltage towards it. `None`: where the voltage says.
        towards: Option<Voltage>,
        /// Position error that the integrator takes in; `None`: frozen.
        error: Option<i32>,
    },
}

impl Demand {
    pub const OPEN: Self = Self { bridge: Bridge::Open, voltage: Voltage::ZERO, meaning: Meaning::Terminal };

    pub const BRAKE: Self = Self { bridge: Bridge::Shorted, ..Self::OPEN };

    #[inline]
    pub fn exciting(bridge: Bridge, voltage: Voltage) -> Self {
        Self { bridge, voltage, meaning: Meaning::Terminal }
    }
}

impl State {
    /// The set-point of this tick.
    #[inline]
    pub(super) fn advance(&mut self) -> Reference {
        let (reference, arrived) = match &mut self.mode {
            Mode::Sine(sine) => (sine.step(), sine.done().then(|| sine.centre())),
            Mode::Move(course) => (course.step(), course.done().then(|| course.target())),
            Mode::Hold(position) => (Reference::rest(*position), None),
            Mode::Cruise(cruise) => (cruise.step(self.encoder.position(), self.design.lead), None),
            Mode::Halt(cruise) => {
                let reference = cruise.step(self.encoder.position(), self.design.lead);
                (reference, cruise.done().then_some(reference.position))
            }
            Mode::Stream(stream) => {
                let step = stream.step();
                return self.streamed(&step);
            }
            Mode::Idle | Mode::Commission(_) | Mode::Drive(_) | Mode::Excite(_) | Mode::Brake => {
                (self.reference, None)
            }
        };
        if let Some(position) = arrived {
            self.arrive(position);
        }
        reference
    }

    /// Stays there, if it is no place beyond the target of a move.
    #[cold]
    #[inline(never)]
    fn arrive(&mut self, position: Position) {
        let back = if let Mode::Move(course) = &self.mode { course.back } else { 0 };
        self.mode = Mode::Hold(position);
        if back != 0 {
            let target = position.plus(i64::from(back) << 32);
            // A way back that cannot be is not made.
            let _ = self.set_out(&Reference::rest(position), target, 0, Voltage::NOMINAL);
        }
    }

    /// A move begins here, with as much voltage as this supply gives, and once it is there goes so many counts back.
    #[inline(never)]
    pub(super) fn set_out(
        &mut self,
        start: &Reference,
        target: Position,
        back: i32,
        supply: Voltage,
    ) -> Result<(), Refusal> {
        let limits = self.design.limits.with_supply(supply);
        let mut course = Move::plan(start, target, &limits).ok_or(Refusal::OutOfRange)?;
        course.back = back;
        self.begin(start);
        self.mode = Mode::Move(course);
        Ok(())
    }

    /// The set-point that a stream gives, and what becomes of the stream.
    #[inline]
    fn streamed(&mut self, step: &Step) -> Reference {
        self.limit = step.limit;
        match step.state {
            Flow::On => {}
            Flow::Arrived(position) => self.mode = Mode::Hold(position),
            Flow::Dry => self.run_dry(&step.reference),
        }
        step.reference
    }

    /// Nobody says how it goes on: to rest within the limits.
    #[cold]
    #[inline(never)]
    fn run_dry(&mut self, from: &Reference) {
        self.mode = Mode::Halt(Cruise::plan(from, Speed(0), &self.design.limits));
        self.dry = true;
    }

    /// Voltage mode: towards the target at a bounded rate.
    #[inline]
    pub(super) fn drive(&mut self, target: Voltage, slew: i32) -> Demand {
        let step = limited(target.minus(self.voltage).0, slew);
        self.voltage = self.voltage.plus(Voltage(step));
        let meaning = Meaning::Linear { towards: None, error: None };
        Demand { bridge: Bridge::Driven, voltage: self.voltage, meaning }
    }

    /// Excitation: the next voltage, and the bridge open behind the last.
    #[cold]
    #[inline(never)]
    pub(super) fn excite(&mut self) -> Demand {
        let next = match &mut self.mode {
            Mode::Excite(excitation) => excitation.step(),
            _ => None,
        };
        let Some(voltage) = next else {
            self.mode = Mode::Idle;
            return Demand::OPEN;
        };
        Demand::exciting(Bridge::Driven, voltage)
    }

    /// Position loop, speed loop, or silence.
    #[inline]
    pub(super) fn follow(&mut self, reference: Reference) -> Demand {
        self.reference = reference;
        self.control.watch(self.count);
        self.holding = reference.rests() && self.in_band(reference.position);
        let (towards, error) = if self.holding {
            self.control.rest();
            self.voltage = self.control.integral();
            (Voltage::ZERO, None)
        } else {
            let error = self.regulate(&reference);
            (self.towards(&reference), error)
        };
        Demand {
            bridge: Bridge::Driven,
            voltage: self.voltage,
            meaning: Meaning::Linear { towards: Some(towards), error },
        }
    }

    /// Both loops. Returns the error that the integrator takes in.
    #[inline]
    fn regulate(&mut self, reference: &Reference) -> Option<i32> {
        let loops = &self.design.loops;
        let error = reference.position.minus(self.encoder.position());
        let (wanted, limited) = loops.position_loop(error, reference.speed, self.design.speed_limit);
        if limited {
            self.limit = Limit::Speed;
        }
        self.voltage = loops.speed_loop(&mut self.control, reference, wanted, self.encoder.speed());
        let integrated = if reference.rests() {
            let sticks = self.design.sticks() || self.load.friction_share() > 0;
            loops.at_rest(&mut self.control, error, sticks)
        } else {
            loops.in_motion(&mut self.control);
            error
        };
        if let Some((bounded, true)) = self.search.as_ref().map(|search| search.bound(self.voltage)) {
            self.voltage = bounded;
            self.limit = Limit::Push;
            return None;
        }
        Some(integrated)
    }

    /// The voltage whose sign tells which way the shaft is to go; beside a voltage drop the back-EMF.
    #[inline]
    fn towards(&self, reference: &Reference) -> Voltage {
        if reference.rests() && !self.design.drops() {
            // By the counter: no estimate's noise reaches this sign, and it stays until the target is crossed.
            let sign = self.short_of(reference.position).signum();
            Voltage(Voltage::NOMINAL.0.saturating_mul(sign))
        } else {
            self.design.loops.steady_voltage(reference.speed)
        }
    }

    /// Counts from here to the target, by the counter itself.
    #[inline]
    fn short_of(&self, target: Position) -> i32 {
        target.count().wrapping_sub(self.count)
    }

    /// Within [`HOLD_BAND`] counts of the target.
    #[inline]
    fn in_band(&self, target: Position) -> bool {
        (-HOLD_BAND..=HOLD_BAND).contains(&self.short_of(target))
    }
}
