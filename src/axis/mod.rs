//! One axis. A control tick is [`Axis::step`], and reads as the flow: encoder → speed → identify → control →
//! compensate → PWM.
//!
//! ```
//! # mod motor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/motor/mod.rs")); }
//! # use motor::{CONFIG, Motor};
//! use servo::axis::{Axis, Command};
//!
//! let axis = Axis::new(&CONFIG).expect("every value within its range");
//! let (mut state, mut motor) = (axis.start(), Motor::default());
//! axis.command(&mut state, &Command::Arm).expect("nothing moves");
//! axis.command(&mut state, &Command::Voltage(3.0)).expect("it is armed");
//! for _tick in 0..10_000 {
//!     let output = axis.step(&mut state, motor.sample());
//!     motor.pass(output);
//! }
//! assert!(motor.angle() > 1.0, "3 V are more than its friction");
//! ```

mod answer;
pub mod command;
mod current_limit;
mod demand;
pub mod design;
mod find_zero;
mod idle;
mod last_trusted;
mod load;
pub(crate) mod order;
mod report;
pub mod servo_axis;
mod state;
pub mod track_sine;
mod transition;

use crate::commission;
use crate::config::{Config, ConfigError, Scale};
use crate::control::{Reference, Tuning};
use crate::encoder;
use crate::identify::passive;
use crate::motion::referencing::{Finding, Search, Sight};
use crate::motion::trajectory::Cruise;
use crate::protect::{self, Action, Averages, Condition, Fault, Reading, Settings, SettingsError};
use crate::pwm::{self, Drive};
use crate::record::{Limit, Record};
pub use crate::sample::{Bridge, Sample};
use crate::store::AxisParameters;
use crate::units::{Speed, Voltage, to_fixed};
pub use answer::{Refusal, Report};
pub use command::Command;
pub use demand::HOLD_BAND;
use demand::{Demand, Meaning};
pub use state::State;
use state::{Held, Listener, Mode, Seen, Start};

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

/// The constants of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    pub(crate) scale: Scale,
    pub(crate) tuning: Tuning,
    passive: passive::Params,
    pub(crate) pwm: pwm::Params,
    pub(crate) protect: protect::Params,
    pub(crate) protection: Settings,
    /// Ticks without motion after which the shaft stands.
    standing: u32,
    /// Change of voltage per tick in voltage mode, Q20 of nominal.
    slew: i32,
    /// The voltage limit; the maximum when there is none.
    pub(crate) most_voltage: Voltage,
    /// `None`: the current is not limited.
    current_limit: Option<current_limit::Params>,
}

/// An axis is the simplest place for its constants: see [`servo_axis::ServoAxis`].
impl AsRef<Axis> for Axis {
    #[inline]
    fn as_ref(&self) -> &Axis {
        self
    }
}

impl Axis {
    /// Checks the configuration and turns it into fixed point.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        Self::with_tuning(config, Tuning::default())
    }

    /// Checks the configuration, with loops of one's own choice.
    pub fn with_tuning(config: &Config, tuning: Tuning) -> Result<Self, ConfigError> {
        let scale = config.build()?;
        // The defaults of protection cannot be refused.
        Ok(Self::of(&scale, tuning, protect::Params::standard(&scale), &Settings::default()))
    }

    #[inline(never)]
    fn of(scale: &Scale, tuning: Tuning, protect: protect::Params, protection: &Settings) -> Self {
        let tick_hz = scale.config.tick_hz;
        Self {
            scale: *scale,
            tuning,
            passive: passive::Params::new(scale),
            pwm: pwm::Params::new(scale),
            protect,
            protection: *protection,
            standing: idle::standing(tick_hz),
            slew: to_fixed(1.0 / (FULL_SWING_S * tick_hz as f32), Voltage::BITS),
            most_voltage: design::voltage_limit(scale),
            current_limit: current_limit::Params::new(scale),
        }
    }

    /// With everything of one's own choice.
    #[inline(never)]
    fn chosen(config: &Config, tuning: Tuning, protection: &Settings) -> Result<Self, SettingsError> {
        let scale = config.build().map_err(SettingsError::Value)?;
        Ok(Self::of(&scale, tuning, protect::Params::new(&scale, protection)?, protection))
    }

    /// From stored parameters.
    pub fn from_parameters(parameters: &AxisParameters) -> Result<Self, SettingsError> {
        parameters.within_range().map_err(SettingsError::Value)?;
        Self::chosen(&parameters.config, parameters.tuning, &parameters.protection)
    }

    /// The same axis with protection of one's own choice.
    pub fn protected(mut self, settings: &Settings) -> Result<Self, SettingsError> {
        self.protect = protect::Params::new(&self.scale, settings)?;
        self.protection = *settings;
        Ok(self)
    }

    /// The same axis with what was chosen on an earlier one about loops, protection and, where this one has none, limits. This divides
    /// in floating point: not for the control tick.
    ///
    /// # Errors
    /// The thermal limit lies outside the range of the current that this axis measures, or a limit of voltage outside the
    /// range of its supply.
    pub fn keeping(&self, earlier: &Axis) -> Result<Self, SettingsError> {
        let config = self.scale.config.keeping_limits(&earlier.scale.config);
        Self::chosen(&config, earlier.tuning, &earlier.protection)
    }

    /// Machine units of this axis.
    #[must_use]
    pub fn scale(&self) -> &Scale {
        &self.scale
    }

    /// What was chosen about protection.
    #[must_use]
    pub fn protection(&self) -> &Settings {
        &self.protection
    }

    /// One control tick, and what there is to tell about it.
    #[inline]
    pub fn step(&self, state: &mut State, sample: Sample) -> Output {
        let Drive { bridge, duty } = self.advance(state, sample);
        Output { bridge, duty, record: state.record() }
    }

    /// One control tick, top to bottom: what the bridge is to do. [`State::record`] tells about it, if anybody asks.
    #[inline]
    pub fn advance(&self, state: &mut State, sample: Sample) -> Drive {
        let supply = self.pwm.supply(&mut state.pwm, &sample);
        let acting = self.pwm.acting(&state.pwm);
        let drive = if self.is_idle(state, acting) {
            let bridge = self.rest(state, &sample, supply);
            self.pwm.modulate(&mut state.pwm, bridge, Voltage::ZERO)
        } else {
            self.work(state, &sample, acting, supply)
        };
        state.tick = state.tick.wrapping_add(1);
        state.seen = Seen { sample, acting, command: drive };
        drive
    }

    /// The tick of an axis that moves, or may: the flow from encoder to PWM.
    #[inline(always)]
    fn work(&self, state: &mut State, sample: &Sample, acting: Drive, supply: Voltage) -> Drive {
        if state.idle {
            self.wake(state);
        }
        let voltage = self.pwm.terminal(acting, supply);
        self.encoder(state, sample.count);
        self.search(state, sample);
        let looked = self.protect(state, sample, supply);
        self.identify(state, sample, acting.bridge, voltage, supply, looked);
        state.acted = (acting.bridge != Bridge::Open).then_some(voltage);
        if let Some(drive) = self.hold_still(state) {
            return drive;
        }
        let demand = self.control(state);
        let wanted = self.compensate(state, &demand);
        let terminal = match &self.current_limit {
            Some(limit) if !limit.allows(&state.current_limit, sample.current_raw, state.acted, wanted) => {
                self.hold_current(state, limit, (sample.current_raw, supply), &demand, wanted)
            }
            _ => wanted,
        };
        let drive = self.pwm.modulate(&mut state.pwm, demand.bridge, terminal);
        if state.holding && state.limit != Limit::Current {
            self.hold_on(state, drive);
        }
        drive
    }

    /// The command of the last tick, if the axis holds its place and nothing has changed: what is left of loops and
    /// compensation then is that time passes. The same bits as if all was computed.
    #[inline]
    fn hold_still(&self, state: &mut State) -> Option<Drive> {
        let held = state.held?;
        let same = held.count == state.count && held.supply == self.pwm.ceiling(&state.pwm);
        if !(same && matches!(state.mode, Mode::Hold(_))) {
            state.held = None;
            return None;
        }
        state.control.watch(state.count);
        state.pwm.queue(held.drive);
        Some(held.drive)
    }

    /// This tick has held a place in silence. The next one may repeat it, if it will have the same set-point.
    #[cold]
    #[inline]
    fn hold_on(&self, state: &mut State, drive: Drive) {
        if let Mode::Hold(place) = state.mode
            && state.reference == Reference::rest(place)
        {
            state.held = Some(Held { count: state.count, supply: self.pwm.ceiling(&state.pwm), drive });
        }
    }

    /// Count → position and speed.
    #[inline]
    fn encoder(&self, state: &mut State, count: i32) {
        if state.zero.is_none() {
            state.zero = Some(count);
            state.encoder = encoder::State::at_rest(count);
            state.protect.found_at(count);
        }
        state.count = count;
        state.standstill.watch(count);
        state.load.watch(count);
        let speed = state.encoder.speed();
        let load = state.load.voltage;
        let driving = state.acted.map(|terminal| state.design.behind_dead_zone(terminal, speed).minus(load));
        state.design.observer.step(&mut state.encoder, count, driving);
    }

    /// Looks for zero, if that is what the motion is for.
    #[inline]
    fn search(&self, state: &mut State, sample: &Sample) {
        let index = core::mem::take(&mut state.index);
        let Some(search) = &mut state.search else { return };
        if !matches!(state.mode, Mode::Cruise(_)) {
            // Stopped, or another motion was asked for.
            return state.search_ends(None);
        }
        let sight = Sight {
            count: sample.count,
            current: Sample::sensed(sample.current_raw),
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

    /// Call this before [`Axis::step`] if the index pulse was high when the count was sampled.
    #[inline]
    pub fn index(&self, state: &mut State) {
        state.index = true;
    }

    /// Opens the bridge on a fault. True in a tick that looked for one, unless every tick does, or that took long for it between
    /// two looks.
    #[inline]
    fn protect(&self, state: &mut State, sample: &Sample, supply: Voltage) -> bool {
        // Put together where it is needed: in most ticks it then stays in registers.
        let acted = state.acted;
        let reading =
            || Reading { count: sample.count, current: Sample::sensed(sample.current_raw), voltage: acted };
        let expectation = &state.design.expectation;
        let averages = self.protect.tick(&mut state.protect, expectation, &reading());
        if let Some(averages) = averages {
            let supply = (sample.vbus_raw != Sample::VBUS_NOT_MEASURED).then_some(supply);
            self.look(state, &reading(), averages, supply);
        }
        let beside = averages.is_none() && state.protect.is_due() && self.beside(state);
        if let Some(action) = state.protect.action() {
            self.answer(state, action);
        }
        beside || (averages.is_some() && self.protect.look_ticks() > 1)
    }

    /// What a look has left to the ticks before the next one, in one of them that does little else, if there is one. False: not
    /// in this one.
    #[cold]
    #[inline]
    fn beside(&self, state: &mut State) -> bool {
        if self.is_crowded(state) && !self.is_look_due(state) {
            return false;
        }
        self.protect.between(&mut state.protect);
        true
    }

    /// Does the next tick what most do not? Asked where there are ticks enough between two looks that one of them is free of all
    /// that, and whoever waits for it need not wait for the one after the next look.
    #[cold]
    #[inline(never)]
    pub(crate) fn is_crowded(&self, state: &State) -> bool {
        self.protect.spreads() && state.is_crowded()
    }

    /// Will protection look in the next tick, though it does not in every one?
    pub(crate) fn is_look_due(&self, state: &State) -> bool {
        self.protect.look_ticks() > 1 && self.protect.is_look_due(&state.protect)
    }

    /// A look for faults: not in every tick.
    #[cold]
    #[inline]
    fn look(&self, state: &mut State, reading: &Reading, averages: Averages, supply: Option<Voltage>) {
        let design = &state.design;
        let input = protect::Input {
            count: reading.count,
            supply,
            current: reading.current,
            averages,
            speed: state.standstill.allows(state.encoder.speed()),
            edge_speed: state.standstill.edge_speed(),
            load: Voltage::ZERO.minus(design.loops.accelerating_voltage(state.encoder.load())),
            position_load: state.load.voltage,
            holding: state.holding || state.search.as_ref().is_some_and(Search::leans),
            endless: state.mode.is_endless(),
            commissioning: matches!(state.mode, Mode::Commission(_)),
            winding: design.at_winding(averages.voltage.unwrap_or_default(), state.load.friction_share()),
            input_dead_zone: design.input_dead_zone(),
        };
        self.protect.look(&mut state.protect, &design.expectation, &input);
    }

    /// What the samples do not show: acts in the next step.
    pub fn raise(&self, state: &mut State, notice: Condition) {
        self.latch(state, notice.fault());
    }

    /// Latches a fault that was found elsewhere.
    #[inline]
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
            state.begin(&start);
            state.mode = Mode::Cruise(Cruise::plan(&start, Speed(0), &state.design.limits));
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
    /// is new reaches the design in the ticks that follow, one stage each. `looked`: protection has taken long in this tick.
    #[inline]
    fn identify(
        &self,
        state: &mut State,
        sample: &Sample,
        bridge: Bridge,
        voltage: Voltage,
        supply: Voltage,
        looked: bool,
    ) {
        let load = state.load.q14;
        // Put together where it is needed: in ordinary motion it then stays in registers.
        let input = || commission::Input {
            count: sample.count,
            voltage: voltage.q14(),
            load,
            bridge,
            supply: (sample.vbus_raw != Sample::VBUS_NOT_MEASURED).then_some(supply.q14()),
            current_raw: Sample::sensed(sample.current_raw),
        };
        let ordered = core::mem::take(&mut state.ordered);
        let renewing = state.renewal != design::Stage::Done;
        if renewing && !ordered {
            self.renew(state);
        }
        // Not in the tick in which the design follows, nor with an order: both take long. And so that the splines, which are sampled
        // every so many ticks from then on, are not sampled in ticks in which protection looks.
        let busy = renewing || ordered;
        match &mut state.listener {
            Listener::None | Listener::Start(_) if busy || !self.protect.is_behind_look(&state.protect) => {}
            Listener::None => self.listen(state),
            Listener::Passive(passive) => {
                let busy = looked
                    || ordered
                    || (passive.hopped() && self.protect.spreads() && state.mode.is_computing());
                if self.passive.step_beside(passive, &mut state.known, &input(), busy) {
                    state.learn();
                }
            }
            Listener::Start(_) => self.prepare(state),
            Listener::Commissioning(_) => state.commission(&input(), looked),
        }
    }

    /// One step towards a commissioning.
    #[cold]
    #[inline]
    fn prepare(&self, state: &mut State) {
        let Listener::Start(start) = &state.listener else {
            return;
        };
        match state.commissioning {
            Some(_) => state.begin_commissioning(),
            None => {
                state.commissioning = Some(commission::Params::new(&self.scale, start.budget_ms, start.seed));
            }
        }
    }

    /// One stage of the design. Its constants in single precision stay out of the tick's stack frame, like all that is
    /// rare.
    #[cold]
    #[inline(never)]
    pub(super) fn renew(&self, state: &mut State) {
        state.held = None;
        let loops = state.renewal == design::Stage::Loops;
        state.design.renew(&mut state.renewal, &self.scale, &self.tuning, &state.last_trusted);
        if loops && state.load.is_given() {
            state.load.renew(state.design.loops.per_count());
        }
    }

    /// Listens to ordinary motion from this tick on.
    #[cold]
    #[inline]
    fn listen(&self, state: &mut State) {
        state.listener = Listener::Passive(passive::State::new(&self.passive, state.count));
    }

    /// Set-point → voltage behind the dead zone.
    #[inline]
    fn control(&self, state: &mut State) -> Demand {
        state.limit = Limit::None;
        state.holding = false;
        match state.mode {
            Mode::Idle => Demand::OPEN,
            Mode::Brake => Demand::BRAKE,
            Mode::Commission(request) => Demand::exciting(request.bridge, Voltage::from_q14(request.voltage)),
            Mode::Drive(target) => state.drive(target, self.slew),
            Mode::Excite(_) => state.excite(),
            Mode::Sine(_)
            | Mode::Move(_)
            | Mode::Hold(_)
            | Mode::Cruise(_)
            | Mode::Stream(_)
            | Mode::Halt(_) => {
                let reference = state.advance();
                state.follow(reference)
            }
        }
    }

    /// Dead zone, then the only clip; the integrator is told what the clip takes.
    #[inline]
    fn compensate(&self, state: &mut State, demand: &Demand) -> Voltage {
        let Meaning::Linear { towards, error } = demand.meaning else {
            // Whoever excites looks for the saturation, too: what is known of it must not bound that.
            let (terminal, limit) = self.clip(state, demand.voltage, [Voltage(i32::MAX); 2]);
            state.limit = limit;
            return terminal;
        };
        // Before the inverse: the push through an input dead zone has the sign of the sum.
        let load = if state.load.rest == 0 { state.load.voltage } else { state.steep_load() };
        let linear = demand.voltage.plus(load);
        let (compensator, rests) = (&state.design.compensator, state.reference.rests());
        let wanted = match (towards, &state.load.told) {
            _ if !state.compensation => linear,
            (Some(towards), Some(told)) => compensator.apply_told(told, linear, towards, rests),
            _ => compensator.apply(linear, towards, rests),
        };
        let (terminal, limit) = self.clip(state, wanted, state.design.saturation);
        state.limit = limit;
        if let Some(error) = error {
            let beyond = wanted.minus(terminal);
            state.design.loops.integrate(&mut state.control, error, beyond);
        }
        terminal
    }

    /// The one clip: voltage limit, supply and saturation. Tells which of them acts.
    #[inline]
    fn clip(&self, state: &State, wanted: Voltage, saturation: [Voltage; 2]) -> (Voltage, Limit) {
        let ceiling = self.pwm.ceiling(&state.pwm).min(self.most_voltage);
        let [positive, negative] = saturation;
        let (level, clipped) = if wanted.0 > 0 {
            let level = positive.min(ceiling);
            (level, wanted.min(level))
        } else {
            let level = negative.min(ceiling);
            (level, wanted.max(Voltage::ZERO.minus(level)))
        };
        let limit = if clipped == wanted {
            state.limit
        } else if level == self.most_voltage {
            Limit::Voltage
        } else if level == ceiling {
            Limit::Supply
        } else {
            Limit::Saturation
        };
        (clipped, limit)
    }

    /// The voltage that the current limit leaves; what it takes the integrator does not take in.
    #[cold]
    #[inline(never)]
    fn hold_current(
        &self,
        state: &mut State,
        limit: &current_limit::Params,
        (current_raw, supply): (i16, Voltage),
        demand: &Demand,
        wanted: Voltage,
    ) -> Voltage {
        let emf = state.design.loops.steady_voltage(state.encoder.speed());
        let acts = state.acted.unwrap_or(emf);
        // The mean of two ticks: an inductance would not notice if every second one were higher.
        let beside = self.pwm.beside_acting(&state.pwm);
        let beside = if beside.bridge == Bridge::Driven { self.pwm.terminal(beside, supply) } else { acts };
        let acted = Voltage(acts.0.saturating_add(beside.0) / 2);
        let sensed = Sample::sensed(current_raw).filter(|_| demand.bridge == Bridge::Driven);
        let held = limit.bound(&mut state.current_limit, sensed, acted, emf, wanted);
        if held != wanted {
            let clipped = matches!(state.limit, Limit::Supply | Limit::Voltage | Limit::Saturation);
            if let Meaning::Linear { error: Some(error), .. } = demand.meaning
                && (wanted.minus(held).0 ^ error) >= 0
                && !clipped
            {
                state.design.loops.integrate(&mut state.control, error.saturating_neg(), Voltage::ZERO);
            }
            state.limit = Limit::Current;
        }
        held
    }
}
