//! One joint. A control tick is [`Axis::step`], and reads as the flow: encoder → speed → identify → control →
//! compensate → PWM.

pub use crate::answer::{Refusal, Report};
use crate::commission::{self, Outcome, Request};
use crate::config::{Config, ConfigError, Scale};
use crate::control::{self, Reference, Tuning};
use crate::design::{self, Design, Knowledge};
use crate::encoder;
use crate::excitation::Excitation;
use crate::identify::estimate::{Estimates, Reason};
use crate::identify::passive;
use crate::protect::{self, Action, Fault, Means, Notice, Reading, Settings, SettingsError};
use crate::pwm;
use crate::record::{self, Activity, Advisory, Limit, Record};
use crate::referencing::{Finding, Referenced, Search, Sight};
pub use crate::sample::{Bridge, Sample};
use crate::store::AxisParameters;
use crate::trajectory::{Cruise, Move, Sine};
use crate::units::{Position, Speed, Voltage, limited, to_fixed};

/// Half width of the band around a resting target in which the axis is silent, counts.
pub const HOLD_BAND: i32 = 1;

/// Time that the voltage mode takes from zero to the nominal supply, s.
const FULL_SWING_S: f32 = 0.1;

/// What the board does, from the next tick on, and what there is to tell about this one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// Bridge state; [`Bridge::Open`] by default.
    pub bridge: Bridge,
    /// Duty in PWM counts, −`pwm_full_scale` … +`pwm_full_scale`; positive gives positive torque.
    pub duty: i16,
    /// The telemetry record of this tick.
    pub record: Record,
}

/// What the axis is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mode {
    #[default]
    Idle,
    Commission(Request),
    Sine(Sine),
    Move(Move),
    Hold(Position),
    Cruise(Cruise),
    /// Voltage behind the dead zone that is approached at a bounded rate.
    Drive(Voltage),
    /// Sine or chirp of voltage at the terminals; ends by itself.
    Excite(Excitation),
    /// Terminals tied together, the answer to a fault.
    Brake,
}

impl Mode {
    /// Does it go on after the host has died? A sine ends by itself, and a position that is held is where it was to be.
    fn is_endless(&self) -> bool {
        matches!(self, Mode::Drive(_) | Mode::Cruise(_) | Mode::Move(_))
    }
}

/// What the loops ask of the bridge.
#[derive(Clone, Copy, Debug)]
struct Demand {
    bridge: Bridge,
    voltage: Voltage,
    meaning: Meaning,
}

/// How [`Demand::voltage`] is meant.
#[derive(Clone, Copy, Debug)]
enum Meaning {
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
    const OPEN: Self = Self {
        bridge: Bridge::Open,
        voltage: Voltage::ZERO,
        meaning: Meaning::Terminal,
    };

    const BRAKE: Self = Self {
        bridge: Bridge::Shorted,
        ..Self::OPEN
    };

    fn exciting(bridge: Bridge, voltage: Voltage) -> Self {
        Self {
            bridge,
            voltage,
            meaning: Meaning::Terminal,
        }
    }
}

/// A commissioning under way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Commissioning {
    pub(crate) params: commission::Params,
    pub(crate) state: commission::State,
}

/// Who learns from count and voltage. One at a time, so they share their memory.
#[derive(Clone, Copy, Debug, Default)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub(crate) enum Listener {
    /// Nobody yet: the passive identification begins as soon as the design has followed what is known.
    #[default]
    None,
    /// A commissioning, which excites too.
    Commissioning(Commissioning),
    /// Whatever the motion is, it is listened to.
    Passive(passive::State),
}

/// One joint: constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    pub(crate) scale: Scale,
    pub(crate) tuning: Tuning,
    passive: passive::Params,
    pub(crate) pwm: pwm::Params,
    pub(crate) protect: protect::Params,
    pub(crate) protection: Settings,
    /// Change of voltage per tick in voltage mode, Q20 of nominal.
    slew: i32,
}

/// One joint: everything that changes. A value: as many axes as there are states. The default is that of no axis at all;
/// [`Axis::start`] makes one of an axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    pub(crate) tick: u32,
    /// Counter at power-up, once a sample was seen.
    pub(crate) zero: Option<i32>,
    /// Counter at the reference's zero, once the axis is referenced.
    pub(crate) datum: Option<i32>,
    pub(crate) search: Option<Search>,
    /// The last search was in vain.
    pub(crate) missed: bool,
    /// The index pulse is there in this tick.
    index: bool,
    pub(crate) count: i32,
    pub(crate) standstill: encoder::Standstill,
    pub(crate) mode: Mode,
    pub(crate) armed: bool,
    pub(crate) compensation: bool,
    pub(crate) holding: bool,
    pub(crate) limit: Limit,
    pub(crate) reference: Reference,
    /// Voltage behind the dead zone that the loops asked for last.
    pub(crate) voltage: Voltage,
    /// Terminal voltage since the last sample; `None`: bridge open.
    pub(crate) acted: Option<Voltage>,
    pub(crate) listener: Listener,
    pub(crate) outcome: Option<Outcome>,
    /// What is known now, by whomever, trusted or not.
    pub(crate) known: Estimates,
    /// The last trusted value of each of them: what the loops use.
    pub(crate) knowledge: Knowledge,
    pub(crate) design: Design,
    /// What of the design is still to follow the knowledge.
    pub(crate) renewal: design::Stage,
    pub(crate) encoder: encoder::State,
    pub(crate) control: control::State,
    pub(crate) pwm: pwm::State,
    pub(crate) protect: protect::State,
}

impl Axis {
    /// Checks the configuration and turns it into fixed point.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        Self::with_tuning(config, Tuning::default())
    }

    /// … with loops of one's own choice.
    pub fn with_tuning(config: &Config, tuning: Tuning) -> Result<Self, ConfigError> {
        let scale = config.build()?;
        Ok(Self {
            scale,
            tuning,
            passive: passive::Params::new(&scale),
            pwm: pwm::Params::new(&scale),
            // The defaults of protection cannot be refused.
            protect: protect::Params::standard(&scale),
            protection: Settings::default(),
            slew: to_fixed(1.0 / (FULL_SWING_S * config.tick_hz as f32), Voltage::BITS),
        })
    }

    /// From stored parameters.
    pub fn from_parameters(parameters: &AxisParameters) -> Result<Self, SettingsError> {
        parameters.check()?;
        Self::with_tuning(&parameters.config, parameters.tuning)
            .map_err(SettingsError::Value)?
            .protected(&parameters.protection)
    }

    /// … with protection of one's own choice.
    pub fn protected(self, settings: &Settings) -> Result<Self, SettingsError> {
        Ok(Self {
            protect: protect::Params::new(&self.scale, settings)?,
            protection: *settings,
            ..self
        })
    }

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
            zero,
            datum,
            search,
            missed,
            index,
            count,
            standstill,
            mode,
            armed,
            compensation,
            holding,
            limit,
            reference,
            voltage,
            acted,
            listener,
            outcome,
            known,
            knowledge,
            design,
            renewal,
            encoder,
            control,
            pwm,
            protect,
        } = state;
        (*tick, *count) = (0, 0);
        (*zero, *datum, *search, *acted, *outcome) = (None, None, None, None, None);
        (*missed, *index, *armed, *holding) = (false, false, false, false);
        *compensation = true;
        *standstill = encoder::Standstill::default();
        *mode = Mode::Idle;
        *limit = Limit::None;
        *reference = Reference::default();
        *voltage = Voltage::ZERO;
        *listener = Listener::None;
        *known = Estimates::default();
        *knowledge = Knowledge::default();
        *design = Design::new(&self.scale, &self.tuning, knowledge);
        // The last stage once more: what listens begins in the tick after.
        *renewal = design::Stage::Limits;
        *encoder = encoder::State::default();
        *control = control::State::default();
        *pwm = pwm::State::default();
        *protect = protect::State::default();
    }

    /// Machine units of this axis.
    #[must_use]
    pub fn scale(&self) -> &Scale {
        &self.scale
    }

    /// One control tick.
    pub fn step(&self, state: &mut State, sample: Sample) -> Output {
        let mut output = Output::default();
        self.step_into(state, sample, &mut output);
        output
    }

    /// One control tick, top to bottom. The output is written where it is to stay.
    pub fn step_into(&self, state: &mut State, sample: Sample, output: &mut Output) {
        let supply = self.pwm.supply(&mut state.pwm, &sample);
        let acting = self.pwm.acting(&state.pwm);
        let voltage = self.pwm.terminal(acting, supply);
        self.encoder(state, sample.count);
        self.search(state, &sample);
        self.protect(state, &sample, supply);
        self.identify(state, &sample, acting.bridge, voltage, supply);
        let demand = self.control(state);
        let terminal = self.compensate(state, &demand);
        let drive = self.pwm.modulate(&mut state.pwm, demand.bridge, terminal);
        state.acted = (acting.bridge != Bridge::Open).then_some(voltage);
        state.tick = state.tick.wrapping_add(1);
        output.bridge = drive.bridge;
        output.duty = drive.duty;
        output.record = state.record(&sample, acting, drive);
    }

    /// Count → position and speed.
    fn encoder(&self, state: &mut State, count: i32) {
        if state.zero.is_none() {
            state.zero = Some(count);
            state.encoder = encoder::State::at_rest(count);
            state.protect.found_at(count);
        }
        state.count = count;
        state.standstill.watch(count);
        let speed = state.encoder.speed();
        let driving = state
            .acted
            .map(|terminal| state.design.behind_dead_zone(terminal, speed));
        state.design.observer.step(&mut state.encoder, count, driving);
    }

    /// Looks for zero, if that is what the motion is for.
    fn search(&self, state: &mut State, sample: &Sample) {
        let index = core::mem::take(&mut state.index);
        let Some(search) = &mut state.search else { return };
        if !matches!(state.mode, Mode::Cruise(_)) {
            // Stopped, or another motion was asked for.
            return state.search_ends(None);
        }
        let sight = Sight {
            count: sample.count,
            current: (sample.current_raw != Sample::CURRENT_NOT_SENSED).then_some(sample.current_raw),
            index,
            pushing: state.limit == Limit::Push,
        };
        match search.step(&sight) {
            Finding::Searching => {}
            Finding::Found(count) => {
                let datum = count.wrapping_sub(search.position);
                state.search_ends(Some(datum));
                state.settle();
            }
            Finding::Missed => {
                state.search_ends(None);
                state.settle();
            }
        }
    }

    /// The index pulse is there: heeded by the next step, which has to see the count of the same moment.
    pub fn index(&self, state: &mut State) {
        state.index = true;
    }

    /// Opens the bridge on a fault.
    fn protect(&self, state: &mut State, sample: &Sample, supply: Voltage) {
        let reading = Reading {
            count: sample.count,
            current: (sample.current_raw != Sample::CURRENT_NOT_SENSED).then_some(sample.current_raw),
            voltage: state.acted,
        };
        let expectation = &state.design.expectation;
        if let Some(means) = self.protect.tick(&mut state.protect, expectation, &reading) {
            let supply = (sample.vbus_raw != Sample::VBUS_NOT_MEASURED).then_some(supply);
            self.look(state, &reading, means, supply);
        }
        if let Some(action) = state.protect.action() {
            self.answer(state, action);
        }
    }

    /// A look for faults: not in every tick.
    #[inline(never)]
    fn look(&self, state: &mut State, reading: &Reading, means: Means, supply: Option<Voltage>) {
        let design = &state.design;
        let input = protect::Input {
            count: reading.count,
            supply,
            current: reading.current,
            means,
            speed: state.encoder.speed(),
            load: Voltage::ZERO.minus(design.loops.accelerating_voltage(state.encoder.load())),
            holding: state.holding || state.search.as_ref().is_some_and(Search::leans),
            endless: state.mode.is_endless(),
            winding: design.at_winding(means.voltage.unwrap_or_default()),
            swallows: design.swallows(),
        };
        self.protect.look(&mut state.protect, &design.expectation, &input);
    }

    /// What the samples do not show: acts in the next step.
    pub fn heed(&self, state: &mut State, notice: Notice) {
        self.latch(state, notice.fault());
    }

    /// Latches a fault that was found elsewhere.
    pub(crate) fn latch(&self, state: &mut State, fault: Fault) {
        state.protect.latch(fault, self.protect.actions());
    }

    /// Does what the latched fault asks for; in every tick, until it is cleared.
    #[cold]
    #[inline(never)]
    fn answer(&self, state: &mut State, action: Action) {
        let holding = action == Action::Hold && state.closed();
        if holding && state.armed {
            let start = state.present();
            state.begin(
                &start,
                Mode::Cruise(Cruise::plan(&start, Speed(0), &state.design.limits)),
            );
            state.armed = false;
        }
        if !holding {
            state.stop(state.protect.fault().into());
            state.mode = match action {
                Action::Brake => Mode::Brake,
                Action::Hold | Action::Open => Mode::Idle,
            };
        }
    }

    /// Count and acting voltage → what the motor is; and, while it is excited for that, the voltage to try next. What
    /// is new reaches the design in the ticks that follow, one stage each.
    fn identify(
        &self,
        state: &mut State,
        sample: &Sample,
        bridge: Bridge,
        voltage: Voltage,
        supply: Voltage,
    ) {
        let input = commission::Input {
            count: sample.count,
            voltage: voltage.q14(),
            bridge,
            supply: (sample.vbus_raw != Sample::VBUS_NOT_MEASURED).then_some(supply.q14()),
            current_raw: (sample.current_raw != Sample::CURRENT_NOT_SENSED).then_some(sample.current_raw),
        };
        let renewing = state.renewal != design::Stage::Done;
        if renewing {
            self.renew(state);
        }
        match &mut state.listener {
            // Not in the tick in which the design follows: both take long.
            Listener::None if renewing => {}
            Listener::None => self.listen(state),
            Listener::Passive(passive) => {
                if self.passive.step(passive, &mut state.known, &input) {
                    state.learn();
                }
            }
            Listener::Commissioning(_) => state.commission(&input),
        }
    }

    /// One stage of the design. Its constants in single precision stay out of the tick's stack frame, like all that is
    /// rare.
    #[cold]
    #[inline(never)]
    fn renew(&self, state: &mut State) {
        state
            .design
            .renew(&mut state.renewal, &self.scale, &self.tuning, &state.knowledge);
    }

    /// Listens to ordinary motion from this tick on.
    #[cold]
    #[inline(never)]
    fn listen(&self, state: &mut State) {
        state.listener = Listener::Passive(passive::State::new(&self.passive, state.count));
        if let Listener::Passive(passive) = &mut state.listener {
            self.passive.adopt(passive, &state.known);
        }
    }

    /// Set-point → voltage behind the dead zone.
    fn control(&self, state: &mut State) -> Demand {
        state.limit = Limit::None;
        state.holding = false;
        match state.mode {
            Mode::Idle => Demand::OPEN,
            Mode::Brake => Demand::BRAKE,
            Mode::Commission(request) => Demand::exciting(request.bridge, Voltage::from_q14(request.voltage)),
            Mode::Drive(target) => state.drive(target, self.slew),
            Mode::Excite(_) => state.excite(),
            Mode::Sine(_) | Mode::Move(_) | Mode::Hold(_) | Mode::Cruise(_) => {
                let reference = state.advance();
                state.follow(reference)
            }
        }
    }

    /// Dead zone, then the only clip; what the clip takes goes back to the integrator through the inverse.
    fn compensate(&self, state: &mut State, demand: &Demand) -> Voltage {
        let Meaning::Linear { towards, error } = demand.meaning else {
            // Whoever excites looks for the saturation, too: what is known of it must not bound that.
            let (terminal, limit) = self.clip(state, demand.voltage, [Voltage(i32::MAX); 2]);
            state.limit = limit;
            return terminal;
        };
        let compensator = state.compensation.then_some(&state.design.compensator);
        let wanted = compensator.map_or(demand.voltage, |inverse| inverse.apply(demand.voltage, towards));
        let (terminal, limit) = self.clip(state, wanted, state.design.saturation);
        state.limit = limit;
        if let Some(error) = error {
            let clipped = terminal != wanted;
            let taken = if clipped {
                compensator
                    .map_or(terminal, |inverse| inverse.undo(terminal, towards))
                    .minus(demand.voltage)
            } else {
                Voltage::ZERO
            };
            state.design.loops.integrate(&mut state.control, error, taken);
        }
        terminal
    }

    /// The one clip: supply and saturation. Tells which of them acts.
    fn clip(&self, state: &State, wanted: Voltage, saturation: [Voltage; 2]) -> (Voltage, Limit) {
        let ceiling = self.pwm.ceiling(&state.pwm);
        let [positive, negative] = saturation;
        let (level, clipped) = if wanted.0 > 0 {
            let level = positive.min(ceiling);
            (level, wanted.min(level))
        } else {
            let level = negative.min(ceiling);
            (level, wanted.max(Voltage::ZERO.minus(level)))
        };
        let limit = match () {
            () if clipped == wanted => state.limit,
            () if level == ceiling => Limit::Supply,
            () => Limit::Saturation,
        };
        (clipped, limit)
    }
}

impl State {
    /// The loops are to use what is known now, as far as it is trusted.
    pub(crate) fn learn(&mut self) {
        self.renewal = self.renewal.max(self.knowledge.adopt(&self.known));
    }

    /// One tick of a commissioning. A function of its own: in ordinary ticks its stack frame is not there.
    #[inline(never)]
    fn commission(&mut self, input: &commission::Input) {
        let Listener::Commissioning(commissioning) = &mut self.listener else {
            return;
        };
        let request = commissioning.params.step(&mut commissioning.state, input);
        self.mode = Mode::Commission(request);
        if let Some(&outcome) = commissioning.state.outcome() {
            self.conclude(outcome);
        }
    }

    /// The commissioning has ended: bridge open, gains from what is trusted. One that was refused leaves behind what
    /// was known before, but the dead zone must be seen again before it is trusted.
    #[cold]
    #[inline(never)]
    fn conclude(&mut self, outcome: Outcome) {
        self.outcome = Some(outcome);
        self.listener = Listener::None;
        self.mode = Mode::Idle;
        if outcome.refused.is_some() {
            self.known.age();
        } else {
            self.known = outcome.estimates;
        }
        self.learn();
    }

    /// Where positions count from.
    pub(crate) fn origin(&self) -> i32 {
        self.datum.or(self.zero).unwrap_or(0)
    }

    fn search_ends(&mut self, datum: Option<i32>) {
        self.search = None;
        self.missed = datum.is_none();
        self.datum = datum.or(self.datum);
    }

    /// Holds the place where the shaft is, without what was pushed with until now.
    fn settle(&mut self) {
        self.control = control::State::default();
        self.mode = Mode::Hold(Position::of_count(self.count));
    }

    fn referenced(&self) -> Referenced {
        match (&self.search, self.missed, self.datum) {
            (Some(_), _, _) => Referenced::Searching,
            (None, true, _) => Referenced::Missed,
            (None, false, Some(_)) => Referenced::Yes,
            (None, false, None) => Referenced::No,
        }
    }

    /// The commissioning that is running.
    pub(crate) fn commissioning(&self) -> Option<&Commissioning> {
        match &self.listener {
            Listener::Commissioning(commissioning) => Some(commissioning),
            Listener::None | Listener::Passive(_) => None,
        }
    }

    /// Phase of the commissioning: of the running one, or how the last one ended.
    fn phase(&self) -> commission::Phase {
        use commission::Phase;
        match (self.commissioning(), &self.outcome) {
            (Some(commissioning), _) => commissioning.state.phase(),
            (None, Some(outcome)) if outcome.refused.is_some() => Phase::Refused,
            (None, Some(_)) => Phase::Done,
            (None, None) => Phase::Idle,
        }
    }

    /// What should be looked at, though nothing is wrong.
    fn advisory(&self) -> Advisory {
        match &self.listener {
            Listener::Passive(passive) => match passive.worn() {
                [false, false] => Advisory::None,
                _ => Advisory::DeadZoneMoved,
            },
            Listener::None | Listener::Commissioning(_) => Advisory::None,
        }
    }

    /// All that is known of the motor now, with trust and reasons.
    #[must_use]
    pub fn estimates(&self) -> &Estimates {
        &self.known
    }

    /// The set-point of this tick.
    fn advance(&mut self) -> Reference {
        let (reference, arrived) = match &mut self.mode {
            Mode::Sine(sine) => (sine.step(), sine.done().then(|| sine.centre())),
            Mode::Move(course) => (course.step(), course.done().then(|| course.target())),
            Mode::Hold(position) => (Reference::rest(*position), None),
            Mode::Cruise(cruise) => (cruise.step(self.encoder.position(), self.design.lead), None),
            Mode::Idle | Mode::Commission(_) | Mode::Drive(_) | Mode::Excite(_) | Mode::Brake => {
                (self.reference, None)
            }
        };
        if let Some(position) = arrived {
            self.mode = Mode::Hold(position);
        }
        reference
    }

    /// Voltage mode: towards the target at a bounded rate.
    fn drive(&mut self, target: Voltage, slew: i32) -> Demand {
        let step = limited(target.minus(self.voltage).0, slew);
        self.voltage = self.voltage.plus(Voltage(step));
        let meaning = Meaning::Linear {
            towards: None,
            error: None,
        };
        Demand {
            bridge: Bridge::Driven,
            voltage: self.voltage,
            meaning,
        }
    }

    /// Excitation: the next voltage, and the bridge open behind the last.
    #[cold]
    #[inline(never)]
    fn excite(&mut self) -> Demand {
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
    fn follow(&mut self, reference: Reference) -> Demand {
        self.reference = reference;
        self.control.watch(self.count);
        let loops = &self.design.loops;
        self.holding = reference.rests() && self.in_band(reference.position);
        if self.holding {
            self.voltage = self.control.integral();
            let meaning = Meaning::Linear {
                towards: Some(Voltage::ZERO),
                error: None,
            };
            return Demand {
                bridge: Bridge::Driven,
                voltage: self.voltage,
                meaning,
            };
        }
        let error = reference.position.minus(self.encoder.position());
        let (wanted, limited) = loops.position_loop(error, reference.speed, self.design.speed_limit);
        if limited {
            self.limit = Limit::Speed;
        }
        self.voltage = loops.speed_loop(&self.control, &reference, wanted, self.encoder.speed());
        let mut integrated = Some(if reference.rests() {
            loops.at_rest(&mut self.control, error, self.design.sticks())
        } else {
            loops.in_motion(&mut self.control);
            error
        });
        if let Some((bounded, true)) = self.search.as_ref().map(|search| search.bound(self.voltage)) {
            (self.voltage, integrated) = (bounded, None);
            self.limit = Limit::Push;
        }
        let towards = if reference.rests() {
            // By the counter: no estimate's noise reaches this sign, and it stays until the target is crossed.
            Voltage(
                Voltage::NOMINAL
                    .0
                    .saturating_mul(self.short_of(reference.position).signum()),
            )
        } else {
            loops.steady_voltage(reference.speed)
        };
        Demand {
            bridge: Bridge::Driven,
            voltage: self.voltage,
            meaning: Meaning::Linear {
                towards: Some(towards),
                error: integrated,
            },
        }
    }

    /// Counts from here to the target, by the counter itself.
    fn short_of(&self, target: Position) -> i32 {
        target.count().wrapping_sub(self.count)
    }

    /// Within [`HOLD_BAND`] counts of the target.
    fn in_band(&self, target: Position) -> bool {
        (-HOLD_BAND..=HOLD_BAND).contains(&self.short_of(target))
    }

    /// Bridge open, whatever was going on; a commissioning ends with this reason.
    pub(crate) fn stop(&mut self, reason: Reason) {
        if let Listener::Commissioning(commissioning) = &mut self.listener {
            commissioning.state.refuse(reason);
            if let Some(&outcome) = commissioning.state.outcome() {
                self.conclude(outcome);
            }
        }
        self.mode = Mode::Idle;
        self.armed = false;
        self.holding = false;
    }

    /// How the last commissioning ended; `None` before the first, and while one is running.
    #[must_use]
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// What the axis is doing.
    #[must_use]
    pub fn activity(&self) -> Activity {
        match self.mode {
            _ if self.protect.fault() != Fault::None => Activity::Faulted,
            Mode::Idle | Mode::Brake => Activity::Idle,
            Mode::Commission(_) => Activity::Commissioning,
            Mode::Sine(_) | Mode::Move(_) | Mode::Cruise(_) => Activity::Tracking,
            Mode::Hold(_) => Activity::Holding,
            Mode::Drive(_) | Mode::Excite(_) => Activity::Driving,
        }
    }

    /// The latched fault.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.protect.fault()
    }

    fn record(&self, sample: &Sample, acting: pwm::Drive, command: pwm::Drive) -> Record {
        let zero = self.zero.unwrap_or(0);
        Record {
            version: record::VERSION,
            tick: self.tick,
            count: sample.count,
            vbus_raw: sample.vbus_raw,
            current_raw: sample.current_raw,
            bridge: acting.bridge,
            duty: acting.duty,
            command_bridge: command.bridge,
            command_duty: command.duty,
            reference_q8: self.reference.position.relative_q8(zero),
            reference_speed_q20: self.reference.speed.0,
            speed_q20: self.encoder.speed().0,
            activity: self.activity(),
            phase: self.phase() as u8,
            limit: self.limit,
            fault: self.protect.fault(),
            gain_source: self.design.gain_source,
            dead_zone_source: self.design.dead_zone_source,
            compensation: self.compensation,
            advisory: self.advisory(),
            referenced: self.referenced(),
        }
    }
}
