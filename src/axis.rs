//! One joint. A control tick is [`Axis::step`], and reads as the flow: encoder → speed → identify → control →
//! compensate → PWM.

use crate::commission::{self, CommissionReport, Outcome, Request};
use crate::compensate::Compensator;
use crate::config::{Config, ConfigError, Scale};
use crate::control::{self, Reference, Tuning};
use crate::design::{self, Design, Knowledge};
use crate::encoder;
use crate::identify::estimate::{Estimates, Reason};
use crate::protect::{self, Fault};
use crate::protocol::Command;
use crate::pwm;
use crate::record::{self, Activity, Limit, Record, Source};
use crate::trajectory::Sine;
use crate::units::{Position, Voltage};
use serde::{Deserialize, Serialize};

/// Half width of the band around a resting target in which the axis is silent, counts.
pub const HOLD_BAND: i32 = 1;

/// State of the H-bridge. Numbers as in the log column `bridge`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Bridge {
    /// All switches off: the winding current is zero. The safe state.
    #[default]
    Open = 0,
    /// PWM drives the winding.
    Driven = 1,
    /// Both terminals tied together: 0 V, the motor brakes.
    Shorted = 2,
}

/// The raw integers that the board reads at the start of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sample {
    /// Encoder counter, wraps.
    pub count: i32,
    /// Supply voltage in converter counts, or [`Sample::VBUS_NOT_MEASURED`].
    pub vbus_raw: u16,
    /// Winding current in converter counts, or [`Sample::CURRENT_NOT_SENSED`].
    pub current_raw: i16,
}

impl Sample {
    /// Marks a supply that is not measured: the nominal voltage is used.
    pub const VBUS_NOT_MEASURED: u16 = u16::MAX;
    /// Marks a winding current that is not sensed.
    pub const CURRENT_NOT_SENSED: i16 = i16::MIN;
}

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

/// Why a command was not carried out. Nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// Torque needs `Arm` first.
    NotArmed,
    /// A fault is latched; clear it with `Stop`.
    Faulted,
    /// Gain and time constant are neither identified nor configured: commission, or give `time_constant_hint_s`.
    NotIdentified,
    /// Something else is running: stop it first.
    Busy,
    /// The target lies beyond the end stops.
    BeyondTravel,
    /// Amplitude, frequency or duration cannot be done at this control rate.
    OutOfRange,
    /// Not a command of the axis: the link answers it.
    NotForAxis,
}

/// What the axis is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Mode {
    #[default]
    Idle,
    Commission(Request),
    Sine(Sine),
    Hold(Position),
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
        /// Steady voltage of the reference speed; `None` while it rests.
        reference: Option<Voltage>,
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

    fn exciting(request: &Request) -> Self {
        Self {
            bridge: request.bridge,
            voltage: Voltage::from_q14(request.voltage),
            meaning: Meaning::Terminal,
        }
    }
}

/// A commissioning under way.
#[derive(Clone, Copy, Debug)]
struct Commissioning {
    params: commission::Params,
    state: commission::State,
}

/// What there is to tell about an axis, in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// What it is doing.
    pub activity: Activity,
    /// The latched fault.
    pub fault: Fault,
    /// Progress of the commissioning, 0 … 255; `None` when none is running.
    pub progress: Option<u8>,
    /// How the last commissioning ended.
    pub commissioning: Option<CommissionReport>,
}

/// One joint: constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    scale: Scale,
    tuning: Tuning,
    pwm: pwm::Params,
    protect: protect::Params,
}

/// One joint: everything that changes. A value: as many axes as there are states.
#[derive(Clone, Copy, Debug)]
pub struct State {
    tick: u32,
    /// Counter at power-up, once a sample was seen.
    zero: Option<i32>,
    count: i32,
    mode: Mode,
    armed: bool,
    compensation: bool,
    holding: bool,
    limit: Limit,
    reference: Reference,
    /// Terminal voltage since the last sample; `None`: bridge open.
    acted: Option<Voltage>,
    commission: Option<Commissioning>,
    outcome: Option<Outcome>,
    knowledge: Knowledge,
    design: Design,
    encoder: encoder::State,
    control: control::State,
    pwm: pwm::State,
    protect: protect::State,
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
            pwm: pwm::Params::new(&scale),
            protect: protect::Params::new(&scale),
        })
    }

    /// An axis that was just switched on: bridge open, nothing known.
    #[must_use]
    pub fn start(&self) -> State {
        let knowledge = Knowledge::default();
        State {
            tick: 0,
            zero: None,
            count: 0,
            mode: Mode::Idle,
            armed: false,
            compensation: true,
            holding: false,
            limit: Limit::None,
            reference: Reference::default(),
            acted: None,
            commission: None,
            outcome: None,
            knowledge,
            design: Design::new(&self.scale, &self.tuning, &knowledge),
            encoder: encoder::State::default(),
            control: control::State::default(),
            pwm: pwm::State::default(),
            protect: protect::State::default(),
        }
    }

    /// One control tick, top to bottom.
    pub fn step(&self, state: &mut State, sample: Sample) -> Output {
        let supply = self.pwm.supply(&mut state.pwm, &sample);
        let acting = self.pwm.acting(&state.pwm);
        self.encoder(state, sample.count);
        self.protect(state, &sample, supply);
        self.identify(state, &sample, acting, supply);
        let demand = self.control(state);
        let terminal = self.compensate(state, &demand);
        let drive = self.pwm.modulate(&mut state.pwm, demand.bridge, terminal);
        state.acted = (acting.bridge != Bridge::Open).then(|| self.pwm.terminal(acting, supply));
        state.tick = state.tick.wrapping_add(1);
        Output {
            bridge: drive.bridge,
            duty: drive.duty,
            record: state.record(&sample, acting, drive),
        }
    }

    /// Count → position and speed.
    fn encoder(&self, state: &mut State, count: i32) {
        if state.zero.is_none() {
            state.zero = Some(count);
            state.encoder = encoder::State::at_rest(count);
            state.protect.clear(count);
        }
        state.count = count;
        let speed = state.encoder.speed();
        let driving = state
            .acted
            .map(|terminal| state.design.behind_dead_zone(terminal, speed));
        state.design.observer.step(&mut state.encoder, count, driving);
    }

    /// Opens the bridge on a fault.
    fn protect(&self, state: &mut State, sample: &Sample, supply: Voltage) {
        let input = protect::Input {
            count: sample.count,
            supply: (sample.vbus_raw != Sample::VBUS_NOT_MEASURED).then_some(supply),
            current: (sample.current_raw != Sample::CURRENT_NOT_SENSED).then_some(sample.current_raw),
            speed: state.encoder.speed(),
            voltage: state.acted,
        };
        if self
            .protect
            .step(&mut state.protect, &state.design.expectation, &input)
            != Fault::None
        {
            state.stop(reason_of(state.protect.fault()));
        }
    }

    /// Count and acting voltage → what the motor is; and, while it is excited for that, the voltage to try next.
    fn identify(&self, state: &mut State, sample: &Sample, acting: pwm::Drive, supply: Voltage) {
        let Some(commissioning) = state.commission.as_mut() else {
            return;
        };
        let input = commission::Input {
            count: sample.count,
            voltage: self.pwm.terminal(acting, supply).q14(),
            bridge: acting.bridge,
            supply: supply.q14(),
            current_raw: (sample.current_raw != Sample::CURRENT_NOT_SENSED).then_some(sample.current_raw),
        };
        let request = commissioning.params.step(&mut commissioning.state, &input);
        state.mode = Mode::Commission(request);
        if let Some(&outcome) = commissioning.state.outcome() {
            self.conclude(state, outcome);
        }
    }

    /// The commissioning has ended: bridge open, gains from what is trusted.
    fn conclude(&self, state: &mut State, outcome: Outcome) {
        state.outcome = Some(outcome);
        state.commission = None;
        state.mode = Mode::Idle;
        state.knowledge.adopt(&outcome.estimates);
        state.design = Design::new(&self.scale, &self.tuning, &state.knowledge);
    }

    /// Set-point → voltage behind the dead zone.
    fn control(&self, state: &mut State) -> Demand {
        state.limit = Limit::None;
        if let Mode::Commission(request) = state.mode {
            return Demand::exciting(&request);
        }
        match state.advance() {
            Some(reference) => state.follow(reference),
            None => Demand::OPEN,
        }
    }

    /// Dead zone, then the only clip; what the clip takes goes back to the integrator through the inverse.
    fn compensate(&self, state: &mut State, demand: &Demand) -> Voltage {
        let Meaning::Linear { reference, error } = demand.meaning else {
            return self.clip(state, demand.voltage);
        };
        let compensator = if state.compensation {
            state.design.compensator
        } else {
            Compensator::default()
        };
        let wanted = compensator.apply(demand.voltage, reference);
        let terminal = self.clip(state, wanted);
        if let Some(error) = error {
            let clipped = terminal != wanted;
            let taken = if clipped {
                compensator.undo(terminal, reference).minus(demand.voltage)
            } else {
                Voltage::ZERO
            };
            state.design.loops.integrate(&mut state.control, error, taken);
        }
        terminal
    }

    /// The one clip: supply and identified saturation.
    fn clip(&self, state: &mut State, wanted: Voltage) -> Voltage {
        let ceiling = self.pwm.ceiling(&state.pwm);
        let [positive, negative] = state.design.saturation.map(|level| level.min(ceiling));
        let clipped = Voltage(wanted.0.clamp(negative.0.saturating_neg(), positive.0));
        if clipped != wanted {
            let level = if wanted.0 > 0 { positive } else { negative };
            state.limit = if level == ceiling {
                Limit::Supply
            } else {
                Limit::Saturation
            };
        }
        clipped
    }
}

/// What a commissioning that a fault has ended tells.
fn reason_of(fault: Fault) -> Reason {
    match fault {
        Fault::NoMotion => Reason::MotionLost,
        Fault::WrongDirection => Reason::Reversed,
        Fault::Overspeed => Reason::Overspeed,
        Fault::SupplyLow => Reason::SupplyTooLow,
        Fault::SupplyHigh => Reason::SupplyMoved,
        Fault::None | Fault::OverCurrent => Reason::Aborted,
    }
}

impl State {
    /// Phase of the commissioning: of the running one, or how the last one ended.
    fn phase(&self) -> commission::Phase {
        use commission::Phase;
        match (&self.commission, &self.outcome) {
            (Some(commissioning), _) => commissioning.state.phase(),
            (None, Some(outcome)) if outcome.refused.is_some() => Phase::Refused,
            (None, Some(_)) => Phase::Done,
            (None, None) => Phase::Idle,
        }
    }

    /// The set-point of this tick; `None`: no torque.
    fn advance(&mut self) -> Option<Reference> {
        match &mut self.mode {
            Mode::Idle | Mode::Commission(_) => None,
            Mode::Sine(sine) => {
                let reference = sine.step();
                if sine.done() {
                    self.mode = Mode::Hold(sine.centre());
                }
                Some(reference)
            }
            Mode::Hold(position) => Some(Reference::rest(*position)),
        }
    }

    /// Position loop, speed loop, or silence.
    fn follow(&mut self, reference: Reference) -> Demand {
        self.reference = reference;
        self.control.watch(self.count);
        let loops = self.design.loops;
        self.holding = reference.rests() && self.in_band(reference.position);
        if self.holding {
            let meaning = Meaning::Linear {
                reference: Some(Voltage::ZERO),
                error: None,
            };
            return Demand {
                bridge: Bridge::Driven,
                voltage: self.control.integral(),
                meaning,
            };
        }
        let error = reference.position.minus(self.encoder.position());
        let (wanted, limited) = loops.position_loop(error, reference.speed, self.design.speed_limit);
        if limited {
            self.limit = Limit::Speed;
        }
        let voltage = loops.speed_loop(&self.control, &reference, wanted, self.encoder.speed());
        let integrated = if reference.rests() {
            loops.at_rest(&mut self.control, error, self.design.sticks())
        } else {
            loops.in_motion(&mut self.control);
            error
        };
        let steady = (!reference.rests()).then(|| loops.steady_voltage(reference.speed));
        Demand {
            bridge: Bridge::Driven,
            voltage,
            meaning: Meaning::Linear {
                reference: steady,
                error: Some(integrated),
            },
        }
    }

    /// Within [`HOLD_BAND`] counts of the target, by the counter itself.
    fn in_band(&self, target: Position) -> bool {
        let off = self.count.wrapping_sub(target.count());
        (-HOLD_BAND..=HOLD_BAND).contains(&off)
    }

    /// Bridge open, whatever was going on; a commissioning ends with this reason.
    fn stop(&mut self, reason: Reason) {
        if let Some(mut commissioning) = self.commission.take() {
            commissioning.state.refuse(reason);
            self.outcome = commissioning.state.outcome().copied();
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
            Mode::Idle => Activity::Idle,
            Mode::Commission(_) => Activity::Commissioning,
            Mode::Sine(_) => Activity::Tracking,
            Mode::Hold(_) => Activity::Holding,
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
        }
    }
}

impl Axis {
    /// Carries out a command, or says why not. `Configure` is for the image: it builds a new axis.
    pub fn command(&self, state: &mut State, command: &Command) -> Result<(), Refusal> {
        match *command {
            Command::Stop => self.stop(state),
            Command::Arm => self.arm(state),
            Command::Commission { budget_ms, seed } => self.commission(state, budget_ms, seed),
            Command::Compensation(on) => self.compensation(state, on),
            Command::TrackSine {
                amplitude_rad,
                frequency_hz,
                duration_ms,
            } => self.track_sine(state, amplitude_rad, frequency_hz, duration_ms),
            Command::Position(target_rad) => self.position(state, target_rad),
            Command::Configure(_) | Command::Subscribe { .. } | Command::Adopt(_) => Err(Refusal::NotForAxis),
        }
    }

    /// In SI units; not for the control tick.
    #[must_use]
    pub fn report(&self, state: &State) -> Report {
        let running = state.commission.as_ref();
        Report {
            activity: state.activity(),
            fault: state.protect.fault(),
            progress: running.map(|commissioning| commissioning.state.progress(&commissioning.params)),
            commissioning: state.outcome.map(|outcome| outcome.report(&self.scale)),
        }
    }

    /// Takes trusted estimates over, e.g. stored ones. Refused while something runs: gains do not jump under way.
    pub fn adopt(&self, state: &mut State, estimates: &Estimates) -> Result<(), Refusal> {
        self.idle(state)?;
        state.knowledge.adopt(estimates);
        state.design = Design::new(&self.scale, &self.tuning, &state.knowledge);
        Ok(())
    }

    /// Machine units of this axis.
    #[must_use]
    pub fn scale(&self) -> &Scale {
        &self.scale
    }

    fn stop(&self, state: &mut State) -> Result<(), Refusal> {
        state.stop(Reason::Aborted);
        state.protect.clear(state.count);
        Ok(())
    }

    fn arm(&self, state: &mut State) -> Result<(), Refusal> {
        if state.protect.fault() != Fault::None {
            return Err(Refusal::Faulted);
        }
        state.armed = true;
        Ok(())
    }

    fn commission(&self, state: &mut State, budget_ms: u32, seed: u32) -> Result<(), Refusal> {
        self.permitted(state)?;
        self.idle(state)?;
        let params = commission::Params::new(&self.scale, budget_ms, seed);
        state.commission = Some(Commissioning {
            params,
            state: commission::State::new(&params, state.count),
        });
        state.outcome = None;
        state.mode = Mode::Commission(Request::default());
        Ok(())
    }

    fn compensation(&self, state: &mut State, on: bool) -> Result<(), Refusal> {
        state.compensation = on;
        Ok(())
    }

    fn idle(&self, state: &State) -> Result<(), Refusal> {
        if state.mode == Mode::Idle {
            Ok(())
        } else {
            Err(Refusal::Busy)
        }
    }

    /// May there be torque?
    fn permitted(&self, state: &State) -> Result<(), Refusal> {
        if state.protect.fault() != Fault::None {
            return Err(Refusal::Faulted);
        }
        if !state.armed {
            return Err(Refusal::NotArmed);
        }
        Ok(())
    }

    /// May a loop close now?
    fn ready(&self, state: &State) -> Result<(), Refusal> {
        self.permitted(state)?;
        if state.commission.is_some() {
            return Err(Refusal::Busy);
        }
        if state.design.gain_source == Source::None {
            return Err(Refusal::NotIdentified);
        }
        Ok(())
    }

    fn track_sine(&self, state: &mut State, rad: f32, hertz: f32, ms: u32) -> Result<(), Refusal> {
        self.ready(state)?;
        if matches!(state.mode, Mode::Sine(_)) {
            return Err(Refusal::Busy);
        }
        let config = &self.scale.config;
        let amplitude = rad * design::counts_per_rad(&self.scale);
        let ticks = (u64::from(ms) * u64::from(config.tick_hz) / 1000).min(u64::from(u32::MAX)) as u32;
        self.within_travel(state, state.count, amplitude.abs())?;
        let centre = state.resting_place();
        let sine =
            Sine::plan(centre, amplitude, hertz / config.tick_hz as f32, ticks).ok_or(Refusal::OutOfRange)?;
        state.begin(Mode::Sine(sine));
        Ok(())
    }

    fn position(&self, state: &mut State, rad: f32) -> Result<(), Refusal> {
        self.ready(state)?;
        let counts = rad * design::counts_per_rad(&self.scale);
        let counts = (counts.abs() < 1e9)
            .then_some(counts as i32)
            .ok_or(Refusal::OutOfRange)?;
        let target = state.zero.unwrap_or(0).wrapping_add(counts);
        self.within_travel(state, target, 0.0)?;
        state.begin(Mode::Hold(Position::of_count(target)));
        Ok(())
    }

    /// Is `centre ± swing` between the end stops?
    fn within_travel(&self, state: &State, centre: i32, swing: f32) -> Result<(), Refusal> {
        let from_zero = centre.wrapping_sub(state.zero.unwrap_or(0)) as f32;
        let [lower, upper] = self.scale.travel_counts.map(|stop| stop as f32);
        if from_zero - swing >= lower && from_zero + swing <= upper {
            Ok(())
        } else {
            Err(Refusal::BeyondTravel)
        }
    }
}

impl State {
    /// Where the set-point rests now: the held position, or where the shaft is.
    fn resting_place(&self) -> Position {
        match self.mode {
            Mode::Hold(position) => position,
            _ => Position::of_count(self.count),
        }
    }

    /// Closes the loops without a jump: a fresh integrator when they were open, the running one otherwise.
    fn begin(&mut self, mode: Mode) {
        if self.mode == Mode::Idle {
            self.control = control::State::default();
        }
        self.mode = mode;
    }
}
