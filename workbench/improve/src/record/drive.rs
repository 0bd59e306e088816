//! Runs a plan on a servo.
//!
//! Segments act as voltages at the terminals: the compensation is off and no loop is closed. Where the travel is limited, every
//! record is asked how far the axis would go if it were braked now; before that is too far, it is braked, and the segment goes on
//! with the opposite sign. End stops of the axis file would forbid the servo any voltage mode, so it is told of none while the host
//! keeps them. Its command time-out is short meanwhile. What was in force before is put back at the end, however that comes; a
//! servo that has lost its host goes back to what it has stored.

use super::watch::{Trip, Watch, Window};
use super::{Part, Plan, RETURN_S, Segment};
use servo::axis::Sample;
use servo::compensate::modelled::Modelled;
use servo::config::Config;
use servo::link::protocol::Command;
use servo::motion::excitation::Waveform;
use servo::optional::Optional;
use servo::record::Activity;
use truing_core::text::input_error::InputError;
use truing_report::console::interrupt;
use truing_servo::device::session::{Kept, Listener, Listening, Session, SessionResult, Start};
use truing_servo::device::setup::Setup;

/// A changing voltage is told anew after so long, s.
const RAMP_STEP_S: f64 = 0.01;
/// A constant one, so that the servo knows its host alive.
const REPEAT_S: f64 = 0.04;
/// The servo stops by itself after such a silence of its host, ms.
const TIMEOUT_MS: u16 = 200;
/// Between two segments on a free axis the bridge is open so long, s.
const PAUSE_S: f64 = 0.05;
/// How late the motor follows is not known yet: protection grants it so many time constants, and no loop is closed meanwhile. Chosen by
/// judgement; not studied.
const UNKNOWN_LAG: f64 = 0.25;
/// Half of the window of the travel may be off by this share of the planned one: the axis did not start in the middle.
const LEAST_ROOM: f64 = 0.9;
/// Less than this share of the room is hardly any motion.
const LEAST_MOTION: f64 = 0.1;
/// Before an open bridge the run-up goes on until the axis passes the middle, no further from it than this share of the room.
const MIDDLE: f64 = 0.5;
/// But no longer than so many units of the scale.
const LONGEST_RUN_UP: f64 = 5.0;

/// What was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// The log, and what ended the session early if anything did.
    pub session: SessionResult,
    /// Electrical energy, J; `None`: the current is not measured.
    pub energy_j: Option<f64>,
    /// Lowest and highest position, rad at the controlled shaft from power-up.
    pub reach_rad: [f64; 2],
    /// The energy was spent before the end of the plan.
    pub spent: bool,
}

impl Recorded {
    /// Where the travel is limited: did the axis use next to nothing of it?
    pub fn hardly_moved(&self, plan: &Plan) -> bool {
        let [lower, upper] = self.reach_rad;
        plan.travel_rad.is_some_and(|room| upper - lower < LEAST_MOTION * room)
    }

    /// The log in format 1, with the plan as comments.
    pub fn to_csv(&self, plan: &Plan) -> String {
        let log = self.session.log.to_csv();
        let (first, rest) = log.split_once('\n').unwrap_or_default();
        let plan: String = plan.text().lines().map(|line| format!("# plan {line}\n")).collect();
        format!("{first}\n{plan}{rest}")
    }
}

/// Runs a plan. In every case the servo is stopped and gets back what was in force before, as long as it can be reached, and what
/// was recorded until then is kept. A servo that knew nothing is left with the axis file.
///
/// # Errors
/// Nothing could be recorded: the servo does not answer, refuses the axis, or does not measure what is to be limited.
pub fn run(
    wire: Box<dyn truing_servo::device::link::Wire>,
    setup: &Setup,
    listening: Listening,
    plan: &Plan,
    progress: &mut Listener,
) -> Result<Recorded, InputError> {
    let _hold = interrupt::hold();
    let mut session = Session::open(wire, Start::Configure(told(setup, plan)), listening)?;
    session.trial(setup.config.tick_hz)?;
    let watch = match watch(&session, plan) {
        Ok(watch) => watch,
        Err(error) => return Err(ended(&mut session, setup, error)),
    };
    let mut recorder = Recorder { session: &mut session, watch, plan, sign: 1.0, begun_s: 0.0 };
    let outcome = recorder.record(progress);
    let watch = recorder.watch;
    let broken = match &outcome {
        Ok(_) => restore(&mut session, setup).err().map(|error| session.halt(error)),
        Err(error) => Some(ended(&mut session, setup, error.clone())),
    };
    let sensed = session.kept.borrow().log.rows.last().and_then(|row| Sample::sensed(row.record.current_raw));
    Ok(Recorded {
        energy_j: sensed.map(|_| watch.spent_j()),
        reach_rad: watch.reach(),
        spent: outcome == Ok(true),
        session: session.close(Vec::new(), broken),
    })
}

/// What the servo is told of the axis while it records.
fn told(setup: &Setup, plan: &Plan) -> Setup {
    let mut told = *setup;
    told.choices.command_timeout_ms = Some(TIMEOUT_MS);
    if plan.travel_rad.is_some() {
        told.config.travel_limit_rad = None;
        // The loops bring the axis back to the middle.
        let hint = plan.scale.tau_s as f32;
        told.config.time_constant_hint_s = told.config.time_constant_hint_s.or(Optional::new(hint));
    }
    told
}

/// Stops after an error, and puts back what was in force; why the recording ended, in words.
fn ended(session: &mut Session, setup: &Setup, error: InputError) -> InputError {
    let InputError(why) = session.halt(error);
    InputError(match restore(session, setup) {
        Ok(()) => why,
        Err(_) => format!(
            "{why}; for a minute the servo still has the settings of the recording, which know no end stops: switch it off and on"
        ),
    })
}

/// Puts back what was in force before; on a servo that knew nothing, what the axis file says. The bridge is open. The log ends here:
/// what follows may be in other units.
fn restore(session: &mut Session, setup: &Setup) -> Result<(), InputError> {
    let (travel_limit_rad, time_constant_hint_s) =
        (setup.config.travel_limit_rad, setup.config.time_constant_hint_s);
    let config = Config { travel_limit_rad, time_constant_hint_s, ..session.config() };
    let own = || Setup { config, ..*setup }.parameters(None);
    let tick = session.command(Command::Restore(session.before.unwrap_or_else(own)))?;
    session.trial(0)?;
    let log = &mut session.kept.get_mut().log;
    log.commands.pop();
    log.rows.retain(|row| row.tick < tick);
    Ok(())
}

/// Looks where the axis is, and whether the sensors see what is to be limited.
fn watch(session: &Session, plan: &Plan) -> Result<Watch, InputError> {
    let kept = session.kept.borrow();
    let here = f64::from(session.here());
    let last = kept.log.rows.last().map(|row| row.record.current_raw);
    if plan.energy_j.is_some() && last.and_then(Sample::sensed).is_none() {
        let what = "a limit of energy needs a measured current, and this servo does not measure it; leave out limits.energy_j and \
                    --energy-j";
        return Err(InputError(what.into()));
    }
    let [lower, upper] = plan.stops_rad.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let window =
        plan.travel_rad.map(|room| Window { lower: lower.max(here - room), upper: upper.min(here + room) });
    let least = plan.travel_rad.map_or(0.0, |room| LEAST_ROOM * room);
    if window.is_some_and(|window| here - window.lower < least || window.upper - here < least) {
        return Err(InputError(format!(
            "the axis stands at {here:.3} rad, too near an end stop to record {:.3} rad to each side: start in the middle, or give \
             a smaller --travel-rad",
            least / LEAST_ROOM
        )));
    }
    Ok(Watch::new(plan, window, &kept.log, session.every))
}

struct Recorder<'a> {
    session: &'a mut Session,
    watch: Watch,
    plan: &'a Plan,
    /// Voltages are multiplied by it: it changes where the travel ends.
    sign: f64,
    /// Length of what is done, s.
    begun_s: f64,
}

impl Recorder<'_> {
    /// True if the energy was spent before the end.
    fn record(&mut self, progress: &mut Listener) -> Result<bool, InputError> {
        self.session.command(Command::Compensation(false))?;
        self.session.command(Command::Adopt(self.plan.known))?;
        if self.plan.travel_rad.is_none() {
            let ticks = self.plan.scale.tau_s * f64::from(self.session.config().tick_hz);
            let lag = (16.0 * UNKNOWN_LAG * ticks) as u16;
            self.session.command(Command::Modelled(Modelled { lag, ..Modelled::default() }))?;
        }
        // What acted before is not in the log, and must have left winding and drive.
        self.session.pause(self.plan.scale.tau_s)?;
        for (place, segment) in self.plan.segments.iter().enumerate() {
            self.sign = 1.0;
            self.session.command(Command::Arm)?;
            if self.segment(segment, progress)? {
                return self.opened().map(|()| true);
            }
            self.back(self.plan.pose(place + 1), progress)?;
        }
        self.opened().map(|()| false)
    }

    /// Opens the bridge, and sees it open.
    fn opened(&mut self) -> Result<(), InputError> {
        self.session.command(Command::Stop)?;
        self.session.pause(PAUSE_S)
    }

    /// True if the energy is spent.
    fn segment(&mut self, segment: &Segment, progress: &mut Listener) -> Result<bool, InputError> {
        for (place, part) in segment.parts.iter().enumerate() {
            let before_open = matches!(segment.parts.get(place + 1), Some(Part::Open { .. }));
            let ended = match part {
                Part::Drive { from_v, to_v, seconds } => {
                    let level = |share: f64| from_v + share * (to_v - from_v);
                    let ended = self.drive(&level, *seconds, segment.name, progress)?;
                    if before_open && ended.is_none() { self.run_up_to_middle(*to_v)? } else { ended }
                }
                Part::Open { seconds } => self.open(*seconds)?,
                Part::Chirp(waveform) => self.chirp(waveform)?,
            };
            self.begun_s += part.seconds();
            if ended == Some(Trip::Energy) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Applies a voltage that changes evenly; turns round where the travel ends.
    fn drive(
        &mut self,
        level: &dyn Fn(f64) -> f64,
        seconds: f64,
        name: &str,
        progress: &mut Listener,
    ) -> Result<Option<Trip>, InputError> {
        let begin = self.now();
        let end = begin + self.session.ticks(seconds).max(1);
        let step_s = if level(0.0) == level(1.0) { REPEAT_S } else { RAMP_STEP_S };
        let step = self.session.ticks(step_s).max(1);
        loop {
            let now = self.now();
            if now >= end {
                return Ok(None);
            }
            let share = f64::from(now - begin) / f64::from(end - begin);
            self.session.command(Command::Voltage((self.sign * level(share)) as f32))?;
            match self.wait((now + step).min(end), false)? {
                Some(Trip::Travel(side)) => {
                    if self.turn(side)? == Some(Trip::Energy) {
                        return Ok(Some(Trip::Energy));
                    }
                    // On with the sign that leads back.
                    let share = f64::from(self.now().min(end) - begin) / f64::from(end - begin);
                    self.sign = if level(share) * f64::from(side) > 0.0 { -1.0 } else { 1.0 };
                }
                Some(Trip::Speed) => {
                    self.session.command(Command::Voltage(0.0))?;
                    return self.wait(end, false).map(|trip| trip.filter(|trip| *trip == Trip::Energy));
                }
                Some(Trip::Energy) => return Ok(Some(Trip::Energy)),
                _ => {}
            }
            let share = (self.begun_s + f64::from(self.now() - begin) / self.rate()) / self.plan.seconds;
            progress(self.session.kept.borrow().progress(name, share.min(1.0), None));
        }
    }

    /// Brakes with the largest voltage until the axis has turned away from the stop.
    fn turn(&mut self, side: i8) -> Result<Option<Trip>, InputError> {
        let side = f64::from(side);
        let brake = Command::Voltage((-side * self.plan.scale.most_v) as f32);
        let end = self.now() + self.session.ticks(LONGEST_RUN_UP * self.plan.scale.unit_s);
        loop {
            self.session.command(brake)?;
            let until = self.now() + self.session.ticks(REPEAT_S).max(1);
            let watch = &self.watch;
            let ended = |kept: &Kept| {
                watch.look(&kept.log, false);
                matches!(watch.trip.get(), Some(Trip::Energy | Trip::Fault)) || watch.turned(&kept.log, side)
            };
            self.session.run_to(until, ended, "turning", &mut |_| {})?;
            let trip = self.checked(self.watch.trip.get())?;
            let turned = self.watch.turned(&self.session.kept.borrow().log, side);
            if trip == Some(Trip::Energy) || turned || self.now() >= end {
                return Ok(trip.filter(|trip| *trip == Trip::Energy));
            }
        }
    }

    /// An open bridge for so long; where it would leave the travel it is braked and opened again.
    fn open(&mut self, seconds: f64) -> Result<Option<Trip>, InputError> {
        let end = self.now() + self.session.ticks(seconds);
        self.session.command(Command::Stop)?;
        while self.now() < end {
            if let Some(Trip::Travel(side)) = self.wait(end, false)? {
                self.session.command(Command::Arm)?;
                if self.turn(side)? == Some(Trip::Energy) {
                    return Ok(Some(Trip::Energy));
                }
                self.session.command(Command::Stop)?;
            }
        }
        self.session.command(Command::Arm)?;
        Ok(None)
    }

    /// The servo plays it from an open bridge; where the travel ends, it is given up.
    fn chirp(&mut self, waveform: &Waveform) -> Result<Option<Trip>, InputError> {
        self.session.command(Command::Stop)?;
        self.session.command(Command::Arm)?;
        let start = self.session.command(Command::Excite(*waveform))?;
        let end = start + self.session.ticks(f64::from(waveform.duration_ms) / 1000.0 + PAUSE_S);
        // Its first record tells that it drives.
        self.session.pause(2.0 / self.rate())?;
        match self.wait(end, true)? {
            Some(Trip::Travel(side)) => {
                self.session.command(Command::Stop)?;
                self.session.command(Command::Arm)?;
                self.turn(side)
            }
            trip => Ok(trip.filter(|trip| *trip == Trip::Energy)),
        }
    }

    /// The run-up goes on until the axis is about in the middle of its travel, so that it has room to coast.
    fn run_up_to_middle(&mut self, volts: f64) -> Result<Option<Trip>, InputError> {
        let Some(window) = self.watch.window else { return Ok(None) };
        let end = self.now() + self.session.ticks(LONGEST_RUN_UP * self.plan.scale.unit_s);
        loop {
            let here = f64::from(self.session.here());
            if (here - window.centre()).abs() < MIDDLE * window.room() || self.now() >= end {
                return Ok(None);
            }
            if self.drive(&|_| volts, RAMP_STEP_S, "run-up", &mut |_| {})? == Some(Trip::Energy) {
                return Ok(Some(Trip::Energy));
            }
        }
    }

    /// Between two segments: an open bridge on a free axis, else by the position loop to where the next one begins.
    fn back(&mut self, pose: f64, progress: &mut Listener) -> Result<(), InputError> {
        let Some(window) = self.watch.window else { return self.opened() };
        self.session.command(Command::Position((window.centre() + pose * window.room()) as f32))?;
        let still = self.session.standstill();
        let end = self.now() + self.session.ticks(RETURN_S);
        let faulted = |kept: &Kept| kept.activity() == Activity::Faulted;
        let stands = |kept: &Kept| kept.activity() == Activity::Holding && kept.stands(still);
        let over = |kept: &Kept| faulted(kept) || stands(kept);
        while self.now() < end && !over(&self.session.kept.borrow()) {
            // Any command tells the servo that its host is alive.
            self.session.command(Command::Compensation(false))?;
            let until = self.now() + self.session.ticks(REPEAT_S);
            self.session.run_to(until, over, "returning", progress)?;
        }
        self.begun_s += RETURN_S;
        let faulted = faulted(&self.session.kept.borrow());
        self.checked(faulted.then_some(Trip::Fault)).map(|_| ())
    }

    /// Lets the servo run up to this tick, or until a limit asks for something. `alone`: or until it has stopped driving.
    fn wait(&mut self, end: u32, alone: bool) -> Result<Option<Trip>, InputError> {
        let watch = &self.watch;
        self.session.run_to(end, |kept| watch.look(&kept.log, alone), "recording", &mut |_| {})?;
        self.checked(self.watch.trip.get())
    }

    fn checked(&self, trip: Option<Trip>) -> Result<Option<Trip>, InputError> {
        match trip {
            Some(Trip::Fault) => Err(InputError("a fault ended the recording".into())),
            other => Ok(other),
        }
    }

    fn now(&self) -> u32 {
        self.session.kept.borrow().now()
    }

    fn rate(&self) -> f64 {
        f64::from(self.session.config().tick_hz)
    }
}
