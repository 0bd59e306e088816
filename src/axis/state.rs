//! What an axis remembers, and how it gets from one state of affairs into another.

use super::Axis;
use super::current_limit;
use super::last_trusted::LastTrusted;
use super::load::Load;
use crate::axis::design::{self, Design};
use crate::commission::{self, Outcome, Request};
use crate::compensate::modelled::{Modelled, Told};
use crate::control::{self, Reference};
use crate::encoder;
use crate::identify::estimate::{Estimates, Reason};
use crate::identify::passive;
use crate::motion::excitation::Excitation;
use crate::motion::referencing::Search;
use crate::motion::sine::Sine;
use crate::motion::stream::Stream;
use crate::motion::trajectory::{Cruise, Move};
use crate::protect;
use crate::pwm;
use crate::record::Limit;
use crate::sample::Sample;
use crate::units::{Position, Voltage};

/// What the axis is doing.
///
/// A tag of its own: the compiler would hide it in 64 bits of the largest variant, where every look at it,
/// five a tick, takes six instructions more.
#[derive(Clone, Copy, Debug, Default)]
#[repr(u32)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub(crate) enum Mode {
    #[default]
    Idle,
    Commission(Request),
    Sine(Sine),
    Move(Move),
    Hold(Position),
    Cruise(Cruise),
    Stream(Stream),
    /// Slowing down to rest, and hold where that ends.
    Halt(Cruise),
    /// Voltage behind the dead zone that is approached at a bounded rate.
    Drive(Voltage),
    /// Sine or chirp of voltage at the terminals; ends by itself.
    Excite(Excitation),
    /// Terminals tied together, the answer to a fault.
    Brake,
}

impl Mode {
    /// Is there nothing to be done?
    #[inline]
    pub fn is_idle(&self) -> bool {
        matches!(self, Mode::Idle)
    }

    /// Is the set-point of this tick computed, though not that of every tick is?
    #[inline]
    pub fn is_computing(&self) -> bool {
        matches!(self, Mode::Sine(sine) if sine.is_computing())
    }

    /// Does it go on after the host has died? A sine and a stream end by themselves, and a position that is held is where
    /// it was to be.
    #[inline]
    pub fn is_endless(&self) -> bool {
        matches!(self, Mode::Drive(_) | Mode::Cruise(_) | Mode::Move(_))
    }
}

/// A commissioning that is being set up: its fixed numbers in one tick, its memory in the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub(crate) budget_ms: u32,
    pub(crate) seed: u32,
}

/// Who learns from count and voltage. One at a time, so they share their memory. The tag is its own, as that of [`Mode`].
#[derive(Clone, Copy, Debug, Default)]
#[repr(u32)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub(crate) enum Listener {
    /// Nobody yet: the passive identification begins as soon as the design has followed what is known.
    #[default]
    None,
    /// A commissioning is about to begin.
    Start(Start),
    /// A commissioning, which excites too.
    Commissioning(commission::State),
    /// Whatever the motion is, it is listened to.
    Passive(passive::State),
}

/// What the bridge was told in a tick in which the axis held its place in silence, and what that followed from.
///
/// Until one of these changes, or a command comes, or the design, every further tick would come to the same.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    pub(crate) count: i32,
    pub(crate) supply: Voltage,
    pub(crate) drive: pwm::Drive,
}

/// What the last tick read and drove: all of a record that is kept nowhere else.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub(crate) sample: Sample,
    /// Acts from that tick to the next.
    pub(crate) acting: pwm::Drive,
    /// Computed in that tick.
    pub(crate) command: pwm::Drive,
}

impl Default for Seen {
    fn default() -> Self {
        Self { sample: Sample::NONE, acting: pwm::Drive::default(), command: pwm::Drive::default() }
    }
}

/// All of an axis that changes. A value: as many axes as there are states. The default is that of no axis at all;
/// [`Axis::start`] makes one of an axis.
///
/// In this order, the largest last: an instruction reaches 4,095 bytes beyond an address.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct State {
    pub(crate) tick: u32,
    pub(crate) seen: Seen,
    /// Counter at power-up, once a sample was seen.
    pub(crate) zero: Option<i32>,
    /// Counter at the reference's zero, once the axis is referenced.
    pub(crate) datum: Option<i32>,
    pub(crate) search: Option<Search>,
    /// The last stream has run dry.
    pub(crate) dry: bool,
    /// The last search was in vain.
    pub(crate) missed: bool,
    /// The index pulse is there in this tick.
    pub(super) index: bool,
    pub(crate) count: i32,
    pub(crate) standstill: encoder::Standstill,
    pub(crate) mode: Mode,
    pub(crate) armed: bool,
    /// This tick has begun with an order: what can wait for the next tick waits.
    pub(crate) ordered: bool,
    /// The last tick was one of an axis at rest that nobody drives.
    pub(crate) idle: bool,
    pub(crate) compensation: bool,
    pub(crate) holding: bool,
    pub(crate) limit: Limit,
    pub(crate) reference: Reference,
    /// Voltage behind the dead zone that the loops asked for last.
    pub(crate) voltage: Voltage,
    /// Terminal voltage since the last sample; `None`: bridge open.
    pub(crate) acted: Option<Voltage>,
    pub(crate) outcome: Option<Outcome>,
    /// What is known now, by whomever, trusted or not.
    pub(crate) known: Estimates,
    /// The last trusted value of each of them: what the loops use.
    pub(crate) last_trusted: LastTrusted,
    pub(crate) design: Design,
    /// What of the design is still to follow the last_trusted.
    pub(crate) renewal: design::Stage,
    pub(crate) encoder: encoder::State,
    pub(crate) control: control::State,
    pub(crate) pwm: pwm::State,
    pub(crate) current_limit: current_limit::State,
    pub(crate) protect: protect::State,
    /// `None`: not held in silence, or something has changed.
    pub(crate) held: Option<Held>,
    /// What holds the load over the place.
    pub(crate) load: Load,
    pub(crate) listener: Listener,
    /// Fixed numbers of the commissioning that runs or is being set up. Not a part of the listener: to build one from the other
    /// would copy them, in one tick.
    pub(crate) commissioning: Option<commission::Params>,
}

impl Axis {
    /// An axis that was just switched on: bridge open, nothing known.
    #[must_use]
    pub fn start(&self) -> State {
        let mut state = State::default();
        self.restart(&mut state);
        state
    }

    /// Switches it off and on again. In place: a state is kilobytes, and this happens in a control tick.
    pub fn restart(&self, state: &mut State) {
        // Without `..`, so that no new field is forgotten.
        let State {
            tick,
            // The last sample stays the last one: it may say that the zero of the current sensor is still looked for.
            seen: _,
            zero,
            datum,
            search,
            dry,
            missed,
            index,
            count,
            standstill,
            mode,
            armed,
            ordered,
            idle,
            compensation,
            holding,
            held,
            limit,
            reference,
            voltage,
            acted,
            listener,
            commissioning,
            outcome,
            known,
            load,
            last_trusted,
            design,
            renewal,
            encoder,
            control,
            pwm,
            current_limit,
            protect,
        } = state;
        (*tick, *count) = (0, 0);
        (*zero, *datum, *search, *acted, *outcome, *held, *commissioning) = Default::default();
        (*dry, *missed, *index, *armed, *idle, *holding) = (false, false, false, false, false, false);
        (*compensation, *ordered, *renewal) = (true, true, design::Stage::Motor);
        (*mode, *limit, *listener, *voltage) = (Mode::Idle, Limit::None, Listener::None, Voltage::ZERO);
        (*standstill, *reference) = (encoder::Standstill::default(), Reference::default());
        (*known, *last_trusted, *encoder, *pwm, *current_limit) = Default::default();
        load.forget();
        // It follows in the next ticks, a stage each, or at once when a command asks for it.
        *design = Design::default();
        *control = control::State::new(self.scale.config.pwm_delay_ticks);
        protect.restart();
    }
}

impl State {
    /// This is known of the motor from now on.
    pub(super) fn take(&mut self, modelled: Modelled) {
        let acting = modelled.acting();
        self.load.modelled = modelled;
        self.control.take(acting.lag);
        self.load.told = Some(acting.told()).filter(|told| *told != Told::default());
        self.load.play = acting.play;
        self.design.observer.lag(u32::from(acting.lag));
        self.design.expectation.waits(acting.lag);
    }

    /// The loops are to use what is known now, as far as it is trusted.
    #[inline]
    pub(crate) fn learn(&mut self) {
        self.renewal = self.renewal.max(self.last_trusted.adopt(&self.known));
    }

    /// The memory of a commissioning, kilobytes of it. A function of its own, like all that needs so much of the stack.
    #[cold]
    #[inline]
    pub(super) fn begin_commissioning(&mut self) {
        let origin = self.origin();
        let Some(params) = &self.commissioning else { return };
        self.listener = Listener::Commissioning(commission::State::new(params, self.count));
        if let Listener::Commissioning(state) = &mut self.listener {
            state.measure_from(origin);
        }
    }

    /// One tick of a commissioning. A function of its own: in ordinary ticks its stack frame is not there.
    #[cold]
    #[inline]
    pub(super) fn commission(&mut self, input: &commission::Input, busy: bool) {
        let (Listener::Commissioning(state), Some(params)) = (&mut self.listener, &self.commissioning) else {
            return;
        };
        state.holds_back(self.limit == Limit::Current);
        let request = params.step_beside(state, input, busy);
        self.mode = Mode::Commission(request);
        if let Some(&outcome) = state.outcome() {
            let starts = state.starts();
            self.conclude(outcome);
            if let Some(starts) = starts {
                self.protect.broke_away(starts);
            }
        }
    }

    /// The commissioning has ended: bridge open, gains from what is trusted. One that was refused leaves behind what
    /// was known before, but the dead zone must be seen again before it is trusted.
    #[cold]
    #[inline(never)]
    fn conclude(&mut self, outcome: Outcome) {
        self.outcome = Some(outcome);
        (self.listener, self.commissioning) = (Listener::None, None);
        self.mode = Mode::Idle;
        if outcome.refused.is_some() {
            self.known.age();
        } else {
            self.known = outcome.estimates;
            self.last_trusted.begin_anew();
        }
        self.learn();
    }

    /// Does the next tick what most do not: sample the splines, make use of a window, or compute a set-point? Not the one that
    /// ends a rest, in which nothing is sampled.
    #[cold]
    #[inline(never)]
    pub(super) fn is_crowded(&self) -> bool {
        let listening = match &self.listener {
            Listener::Passive(passive) => passive.is_crowded(),
            Listener::Commissioning(commissioning) => commissioning.is_crowded(),
            Listener::None | Listener::Start(_) => false,
        };
        let turning = matches!(&self.mode, Mode::Move(course) if course.turns());
        !self.idle && (listening || turning || self.mode.is_computing())
    }

    /// Have the gains followed all that is known?
    pub(crate) fn is_designed(&self) -> bool {
        self.renewal == design::Stage::Done
    }

    /// Where positions count from.
    #[inline]
    pub(crate) fn origin(&self) -> i32 {
        self.datum.or(self.zero).unwrap_or(0)
    }

    pub(super) fn search_ends(&mut self, datum: Option<i32>) {
        self.search = None;
        self.missed = datum.is_none();
        self.datum = datum.or(self.datum);
        if let Some(datum) = datum {
            let before = self.load.voltage;
            self.load.refer_to(datum);
            self.control.shift(before.minus(self.load.voltage));
        }
    }

    /// Counts may have been lost.
    pub(super) fn lose_reference(&mut self) {
        self.datum = None;
        self.held = None;
        let before = self.load.voltage;
        self.load.found(None);
        // As at a place that is held: the integrator gives what the table gave.
        self.control.shift(before);
    }

    /// Holds the place where the shaft is, without what was pushed with until now.
    pub(super) fn settle(&mut self) {
        self.control.begin();
        self.mode = Mode::Hold(Position::of_count(self.count));
    }

    /// Is the motion that of a commissioning?
    pub(crate) fn is_commissioning(&self) -> bool {
        matches!(self.mode, Mode::Commission(_))
    }

    /// The commissioning that is running.
    #[inline]
    pub(crate) fn commissioning(&self) -> Option<&commission::State> {
        match &self.listener {
            Listener::Commissioning(commissioning) => Some(commissioning),
            Listener::None | Listener::Start(_) | Listener::Passive(_) => None,
        }
    }

    /// Bridge open, whatever was going on; a commissioning ends with this reason.
    pub(crate) fn stop(&mut self, reason: Reason) {
        match &mut self.listener {
            Listener::Start(_) => self.conclude(Outcome { refused: Some(reason), ..Outcome::default() }),
            Listener::Commissioning(commissioning) => {
                commissioning.refuse(reason);
                if let Some(&outcome) = commissioning.outcome() {
                    self.conclude(outcome);
                }
            }
            Listener::None | Listener::Passive(_) => {}
        }
        self.mode = Mode::Idle;
        self.armed = false;
        self.holding = false;
    }
}
