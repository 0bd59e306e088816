//! Operating a joint: what a host may ask, what is refused, and how the axis gets from one mode into another.
//!
//! Nothing jumps when the mode changes: the new set-point starts with the position, speed and acceleration of the old
//! one, or with those of the shaft when no loop was closed, and the integrator takes over the voltage that was there.

use crate::axis::answer::{Refusal, Report};
use crate::axis::design::{self, Design};
use crate::axis::track_sine::{Ahead, Asked};
use crate::axis::{Axis, Listener, Mode, Start, State};
use crate::commission::Request;
use crate::compensate::modelled::Modelled;
use crate::compensate::position_load::PositionLoad;
use crate::config::Config;
use crate::identify::estimate::{Estimates, Reason};
use crate::motion::excitation::Waveform;
use crate::motion::referencing::Referencing;
use crate::motion::stream::{Knot, Plan, Point, Stream};
use crate::motion::trajectory::{Cruise, Move};
use crate::protect::Fault;
use crate::record::{Source, Trigger};
use crate::store::{self, AxisParameters};
use crate::units::{Position, SPEED_BITS, Speed, Voltage, to_fixed};
use serde::{Deserialize, Serialize};

/// A shaft that has not moved for 50 ms stands.
pub(super) const STANDING_HZ: u32 = 20;

/// What the host may ask of an axis, as it travels: `postcard` numbers the variants in order, so new ones are appended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub enum Command {
    /// Set the axis up. Refused while the bridge is not open.
    ///
    /// Replaced: the configuration, as a whole. Forgotten: what was identified, the reference, `Arm`. Kept: choices about loops,
    /// compensation and protection; limits that the new one has not; a latched fault. [`Command::Reset`] before it forgets them.
    Configure(Config),
    /// Allow the bridge to be driven.
    Arm,
    /// Switch the bridge off, from any state.
    Stop,
    /// Excite, identify, verify. `seed` orders the excitation.
    Commission {
        /// Length of the excitation, ms.
        budget_ms: u32,
        /// Orders the excitation.
        seed: u32,
    },
    /// Use the inverse dead zone in the loops, or do not.
    Compensation(bool),
    /// Track `amplitude · sin(2π f t)` in position, for a time; smooth start.
    TrackSine {
        /// Amplitude, rad at the controlled shaft.
        amplitude_rad: f32,
        /// Frequency, Hz.
        frequency_hz: f32,
        /// Duration, ms.
        duration_ms: u32,
    },
    /// Hold this position from now on, rad relative to the position at power-up.
    Position(f32),
    /// Send one record in `every` ticks; 0: none.
    Subscribe {
        /// Decimation, ticks.
        every: u32,
    },
    /// Take over what an earlier commissioning has found; what it lacks is forgotten.
    Adopt(Estimates),
    /// Turn at this speed from now on, rad/s at the controlled shaft.
    Speed(f32),
    /// Apply this voltage behind the dead zone from now on, V; no loop is closed.
    Voltage(f32),
    /// Start a capture at full control rate.
    CaptureArm {
        /// What to wait for.
        trigger: Trigger,
        /// Ticks to keep from before it.
        before: u16,
    },
    /// Send ticks of the capture from this one on, oldest 0, as [`crate::link::protocol::Message::Captured`].
    CaptureRead(u16),
    /// Answered with [`crate::link::protocol::Message::Hello`] too.
    Hello,
    /// Answered with [`crate::link::protocol::Message::Parameters`] too.
    Parameters,
    /// Put this whole set in force, as after power-up. Refused while the bridge is not open.
    Restore(#[serde(deserialize_with = "store::deserialize_set")] AxisParameters),
    /// Back to an axis that was never configured. What is stored stays as it is until [`Command::Save`].
    Reset,
    /// Store what is in force, of all axes. Refused while anything moves; [`crate::link::protocol::Message::Store`] tells how it goes on.
    Save,
    /// Find out where zero is.
    Reference(Referencing),
    /// Hold this absolute position from now on, rad from the reference's zero. Refused until there is one.
    GoTo(f32),
    /// Apply a sine or a chirp of voltage at the terminals, then open the bridge; no loop is closed.
    Excite(Waveform),
    /// The next point of a streamed motion, ahead of its time; the first one begins the stream. See [`crate::motion::stream`].
    Stream(Point),
    /// Hold the load over the place with this table from now on, or with none. Refused while something excites.
    PositionLoad(PositionLoad),
    /// Feed forward what a model tells from now on. Refused while something runs.
    Modelled(Modelled),
    /// What is in force is on trial. Once no command has come for so many control ticks, the axis is stopped, and the chip starts anew
    /// with what is stored as soon as no bridge is driven and nothing is being stored. 0: no longer.
    OnTrial(u32),
}

impl Command {
    /// Telemetry, capture and store listen to the axis and do not touch it.
    #[must_use]
    pub const fn listens(&self) -> bool {
        use Command::{CaptureArm, CaptureRead, Hello, Parameters, Save, Subscribe};
        matches!(self, Subscribe { .. } | CaptureArm { .. } | CaptureRead(_) | Hello | Parameters | Save)
    }

    /// Does it need the gains and limits of what is known by now?
    pub(super) const fn plans(&self) -> bool {
        use Command::{Excite, GoTo, Position, PositionLoad, Reference, Speed, Stream, TrackSine, Voltage};
        matches!(
            self,
            TrackSine { .. }
                | Position(_)
                | GoTo(_)
                | Speed(_)
                | Voltage(_)
                | Reference(_)
                | Excite(_)
                | Stream(_)
                | PositionLoad(_)
        )
    }
}

impl Axis {
    /// Carries out a command, or says why not.
    pub fn command(&self, state: &mut State, command: &Command) -> Result<(), Refusal> {
        self.hear(state, command.plans());
        self.carry_out(state, command)?;
        state.protect.heard();
        Ok(())
    }

    /// [`Command::TrackSine`], computed ahead of the tick.
    pub fn command_ahead(&self, state: &mut State, sine: &Ahead) -> Result<(), Refusal> {
        self.hear(state, true);
        self.sine(state, sine)?;
        state.protect.heard();
        Ok(())
    }

    /// A command has come; a motion needs all gains.
    fn hear(&self, state: &mut State, plans: bool) {
        state.ordered = true;
        state.held = None;
        if plans {
            self.design(state);
        }
    }

    fn carry_out(&self, state: &mut State, command: &Command) -> Result<(), Refusal> {
        match *command {
            Command::Stop => self.stop(state),
            Command::Arm => self.arm(state),
            Command::Commission { budget_ms, seed } => self.commission(state, budget_ms, seed),
            Command::Compensation(on) => self.compensation(state, on),
            Command::TrackSine { amplitude_rad, frequency_hz, duration_ms } => {
                self.track_sine(state, &Asked { amplitude_rad, frequency_hz, duration_ms })
            }
            Command::Position(rad) => self.position(state, rad),
            Command::Speed(rad_s) => self.speed(state, rad_s),
            Command::Voltage(volts) => self.voltage(state, volts),
            Command::Adopt(ref estimates) => self.adopt(state, estimates),
            Command::Reference(ref how) => self.reference(state, how),
            Command::GoTo(rad) => self.go_to(state, rad),
            Command::Excite(ref waveform) => self.excite(state, waveform),
            Command::Stream(ref point) => self.stream(state, point),
            Command::PositionLoad(ref load) => self.position_load(state, load),
            Command::Modelled(modelled) => self.modelled(state, modelled),
            // What a restart brings, and what the image answers.
            _ => Err(Refusal::NotForAxis),
        }
    }

    /// The gains in force, once they have followed all that is known. Not for the control tick.
    pub fn design<'a>(&self, state: &'a mut State) -> &'a Design {
        state.held = None;
        while state.renewal != design::Stage::Done {
            self.renew(state);
        }
        &state.design
    }

    /// In SI units; not for the control tick.
    #[must_use]
    pub fn report(&self, state: &State) -> Report {
        let running = state.commissioning().zip(state.commissioning.as_ref());
        Report {
            activity: state.activity(),
            fault: state.fault(),
            progress: running.map(|(commissioning, params)| commissioning.progress(params)),
            commissioning: state.outcome.map(|outcome| outcome.report(&self.scale)),
        }
    }

    /// Takes trusted estimates over, e.g. stored ones. Refused while something runs: gains do not jump under way.
    pub fn adopt(&self, state: &mut State, estimates: &Estimates) -> Result<(), Refusal> {
        self.idle(state)?;
        Self::take_over(state, estimates);
        Ok(())
    }

    /// Of an axis at which nothing runs: it cannot be refused.
    pub(super) fn take_over(state: &mut State, estimates: &Estimates) {
        state.ordered = true;
        state.known = *estimates;
        state.listener = Listener::None;
        state.renewal = state.renewal.max(state.last_trusted.restore(estimates));
    }

    /// Does the shaft stand?
    pub(crate) fn stands(&self, state: &State) -> bool {
        state.standstill.lasts(self.standing)
    }

    /// What is in force, as it is stored.
    #[must_use]
    pub fn parameters(&self, state: &State) -> AxisParameters {
        AxisParameters {
            config: self.scale.config,
            estimates: state.last_trusted.complete(&state.known),
            tuning: self.tuning,
            compensation: state.compensation,
            protection: self.protection,
            position_load: state.load.told(state.datum),
            modelled: state.load.modelled,
        }
    }

    fn stop(&self, state: &mut State) -> Result<(), Refusal> {
        state.stop(Reason::Aborted);
        state.protect.clear(state.count);
        Ok(())
    }

    fn arm(&self, state: &mut State) -> Result<(), Refusal> {
        if state.fault() != Fault::None {
            return Err(Refusal::Faulted);
        }
        state.armed = true;
        Ok(())
    }

    /// Only noted here: what it takes to set it up is spread over the ticks that follow.
    fn commission(&self, state: &mut State, budget_ms: u32, seed: u32) -> Result<(), Refusal> {
        self.permitted(state)?;
        self.idle(state)?;
        state.listener = Listener::Start(Start { budget_ms, seed });
        state.commissioning = None;
        state.outcome = None;
        state.mode = Mode::Commission(Request::default());
        Ok(())
    }

    /// Relative to power-up, whether referenced or not.
    fn position(&self, state: &mut State, rad: f32) -> Result<(), Refusal> {
        self.travel_to(state, state.zero.unwrap_or(0), rad)
    }

    /// Relative to the reference.
    fn go_to(&self, state: &mut State, rad: f32) -> Result<(), Refusal> {
        let datum = state.datum.ok_or(Refusal::NotReferenced)?;
        self.travel_to(state, datum, rad)
    }

    fn travel_to(&self, state: &mut State, origin: i32, rad: f32) -> Result<(), Refusal> {
        self.ready(state)?;
        let target = origin.wrapping_add(self.counts(rad)?);
        self.within_travel(state, target, 0.0)?;
        let start = state.present();
        let back = self.back(state, target, &start);
        let turn = Position::of_count(target.wrapping_sub(back));
        state.set_out(&start, turn, back, self.pwm.ceiling(&state.pwm))
    }

    pub(super) fn counts(&self, rad: f32) -> Result<i32, Refusal> {
        let counts = rad * self.scale.counts_per_rad();
        (counts.abs() < Move::LARGEST_COUNTS).then_some(counts as i32).ok_or(Refusal::OutOfRange)
    }

    /// Endless motion: refused between end stops.
    fn speed(&self, state: &mut State, rad_s: f32) -> Result<(), Refusal> {
        self.ready(state)?;
        let speed = rad_s * self.scale.counts_per_tick();
        let limits = &state.design.limits.with_supply(self.pwm.ceiling(&state.pwm));
        if self.scale.config.travel_limit_rad.is_some() {
            return Err(Refusal::BeyondTravel);
        }
        let fits = speed.abs() <= limits.speed.min(limits.voltage);
        let speed = fits.then(|| Speed(to_fixed(speed, SPEED_BITS))).ok_or(Refusal::OutOfRange)?;
        let start = state.present();
        state.begin(&start);
        state.mode = Mode::Cruise(Cruise::plan(&start, speed, limits));
        Ok(())
    }

    fn voltage(&self, state: &mut State, volts: f32) -> Result<(), Refusal> {
        self.permitted(state)?;
        self.unexcited(state)?;
        let share = volts / self.scale.config.supply_nominal_v;
        let fits = share.abs() <= 1.0
            && to_fixed(share, Voltage::BITS).saturating_abs() <= self.most_voltage.0
            && self.scale.config.travel_limit_rad.is_none();
        let target = fits.then(|| Voltage(to_fixed(share, Voltage::BITS))).ok_or(Refusal::OutOfRange)?;
        state.begin(&state.present());
        state.mode = Mode::Drive(target);
        Ok(())
    }

    /// Nothing bounds the way that a voltage goes: refused between end stops, like every voltage mode.
    #[inline(never)]
    fn excite(&self, state: &mut State, waveform: &Waveform) -> Result<(), Refusal> {
        self.permitted(state)?;
        self.idle(state)?;
        if self.scale.config.travel_limit_rad.is_some() {
            return Err(Refusal::BeyondTravel);
        }
        let excitation = waveform.plan(&self.scale).map_err(Refusal::Value)?;
        state.begin(&state.present());
        state.mode = Mode::Excite(excitation);
        Ok(())
    }

    /// One more point; the first one begins a stream where the set-point is.
    #[inline(never)]
    fn stream(&self, state: &mut State, point: &Point) -> Result<(), Refusal> {
        self.ready(state)?;
        let tick_hz = self.scale.config.tick_hz as f32;
        let zero = state.zero.unwrap_or(0);
        let knot = Knot::of(point, zero, self.scale.counts_per_rad(), tick_hz);
        let knot = knot.ok_or(Refusal::OutOfRange)?;
        let start = state.present();
        let from = match &state.mode {
            Mode::Stream(stream) => *stream.tail(),
            _ => Knot::at(&start),
        };
        let plan = Plan::new(&from, &knot).ok_or(Refusal::OutOfRange)?;
        for count in plan.hull() {
            self.within_travel(state, count, 0.0)?;
        }
        if let Mode::Stream(stream) = &mut state.mode {
            return if stream.push(plan.end) { Ok(()) } else { Err(Refusal::StreamFull) };
        }
        let limits = state.design.limits.with_supply(self.pwm.ceiling(&state.pwm));
        let origin = state.origin();
        let stop = |counts: i32| Position::of_count(origin.wrapping_add(counts));
        let stops = self.scale.travel_counts.map(stop);
        let stops = self.scale.config.travel_limit_rad.map(|_| stops);
        state.begin(&start);
        state.mode = Mode::Stream(Stream::begin(&start, &plan, &limits, stops));
        Ok(())
    }

    pub(super) fn idle(&self, state: &State) -> Result<(), Refusal> {
        if state.mode.is_idle() { Ok(()) } else { Err(Refusal::Busy) }
    }

    /// What excites the motor by itself is not to be disturbed.
    pub(super) fn unexcited(&self, state: &State) -> Result<(), Refusal> {
        if matches!(state.mode, Mode::Commission(_) | Mode::Excite(_)) { Err(Refusal::Busy) } else { Ok(()) }
    }

    /// May there be torque?
    pub(super) fn permitted(&self, state: &State) -> Result<(), Refusal> {
        match (state.fault(), state.armed) {
            (Fault::None, true) => Ok(()),
            (Fault::None, false) => Err(Refusal::NotArmed),
            _ => Err(Refusal::Faulted),
        }
    }

    /// May a loop close now?
    pub(super) fn ready(&self, state: &State) -> Result<(), Refusal> {
        self.permitted(state)?;
        self.unexcited(state)?;
        if state.design.gain_source == Source::None { Err(Refusal::NotIdentified) } else { Ok(()) }
    }

    /// Is `centre ± swing` between the end stops?
    #[inline(never)]
    pub(super) fn within_travel(&self, state: &State, centre: i32, swing: f32) -> Result<(), Refusal> {
        let from_zero = centre.wrapping_sub(state.origin()) as f32;
        let [lower, upper] = self.scale.travel_counts.map(|stop| stop as f32);
        if from_zero - swing >= lower && from_zero + swing <= upper {
            Ok(())
        } else {
            Err(Refusal::BeyondTravel)
        }
    }
}
