//! A session with the firmware: configure, commission, track, and keep the log.

use crate::input_error::InputError;
use crate::motor::{Builtin, Door, Exec, qemu};
use crate::run_log::{Row, RunLog};
use crate::servo_link::{Client, Lockstep, Serial, Wire, found_text};
use crate::setup::Setup;
use crate::waypoints::{self, Waypoint};
use servo::capture::{Extent, Shot, Stage, Trigger};
use servo::commission::Outcome;
use servo::config::Config;
use servo::control::Tuning;
use servo::excitation::Waveform;
use servo::identify::estimate::{Estimates, EstimatesReport};
use servo::protect::Fault;
use servo::protocol::{Command, Message};
use servo::record::{Activity, Advisory};
use servo::referencing::{Referenced, Referencing};
use servo::store::AxisParameters;
use servo::stream::Point;
use std::cell::RefCell;
use std::f32::consts::TAU;

/// Records per second that a real link carries.
const SERIAL_RECORDS_PER_S: u32 = 400;
/// After a motion the axis holds for so long, s; chatter is counted here.
pub const HOLD_S: f64 = 1.0;
/// The bridge is open for so long between two tasks, s.
const PAUSE_S: f64 = 0.3;
/// An axis that holds, and moves no more than these counts for so long, s, stands.
const STILL_COUNTS: i32 = 1;
const STILL_S: f64 = 0.1;
/// After so long, s, a motion begins even if the axis does not stand.
const LONGEST_REST_S: f64 = 10.0;
/// No search for a reference takes longer, s.
const LONGEST_SEARCH_S: f64 = 600.0;
/// Nor does a move.
const LONGEST_MOVE_S: f64 = 600.0;
/// A piece of a capture has arrived after so long, s.
const READ_S: f64 = 0.001;
/// The shortest stretch of the log that counts as a run, s.
const LEAST_RUN_S: f64 = 0.1;
/// Points of a stream are at least so far apart: in lock-step a command takes a few ticks, on a line some milliseconds.
const SPACING_TICKS: u32 = 8;
const SPACING_S: f64 = 0.010;
/// A commissioning that takes longer than its budget by this factor and this time has hung.
const OVERTIME: (f64, f64) = (2.0, 10.0);

/// What to follow.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// `amplitude · sin(2π f t)`, eased in and out.
    Sine {
        /// rad.
        amplitude_rad: f32,
        /// Hz.
        frequency_hz: f32,
        /// s.
        seconds: f32,
    },
    /// A jump.
    Step {
        /// rad, from where the axis is.
        amplitude_rad: f32,
        /// s.
        seconds: f32,
    },
    /// Points in time, streamed with their speeds; the axis goes to the first one beforehand.
    Points(Vec<Waypoint>),
}

/// One thing to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Excite and identify.
    Commission {
        /// Length, s.
        budget_s: f64,
        /// Orders the excitation.
        seed: u32,
    },
    /// Use what an earlier commissioning has found.
    Adopt(Box<Estimates>),
    /// Arm a capture when the next motion begins; what it holds is read out behind it.
    Capture {
        /// What to wait for.
        trigger: Trigger,
        /// Ticks to keep from before it.
        before: u16,
    },
    /// Find out where zero is.
    Reference(Referencing),
    /// Store what is in force, so that it survives a power cut.
    Store,
    /// Go there, and hold.
    Move(Target),
    /// Follow a profile, then hold.
    Track {
        /// What to follow.
        profile: Profile,
        /// With the inverse dead zone or without.
        compensation: bool,
    },
    /// Apply a sine or a chirp of voltage; no loop is closed, nothing need be known.
    Excite(Waveform),
}

/// Where to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Absolute, rad from the reference's zero.
    To(f32),
    /// rad from where the axis is.
    By(f32),
}

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// From the command to the first standstill at the target, s.
    pub seconds: f64,
    /// Position minus target at the end, rad.
    pub error_rad: f32,
    /// The axis held its target to the end, without a fault.
    pub held: bool,
}

/// What a [`Task`] gave.
#[derive(Clone, Debug, PartialEq)]
pub enum Done {
    /// End of a commissioning.
    Commissioned(Box<Outcome>),
    /// Estimates are in use.
    Adopted,
    /// Positions are absolute.
    Referenced,
    /// Parameters are stored.
    Stored,
    /// A capture is armed.
    Armed,
    /// The axis is there, or is not.
    Moved(Arrival),
    /// Ticks of a motion.
    Tracked(Span),
    /// Ticks of an excitation, and what the servo knows behind it.
    Excited(Span, Box<EstimatesReport>),
}

/// What a capture holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Captured {
    /// Where the capture stood when it was read.
    pub stage: Stage,
    /// How long it is and where the trigger fired.
    pub extent: Extent,
    /// Oldest first; the trigger's tick among them.
    pub shots: Vec<Shot>,
}

/// Ticks of a motion, since power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The profile begins.
    pub start: u32,
    /// The profile ends and the hold begins.
    pub hold: u32,
    /// The hold ends.
    pub end: u32,
    /// A fault has ended it early.
    pub faulted: bool,
}

/// The result.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionResult {
    /// Every control tick (on a serial line: one in several).
    pub log: RunLog,
    /// One for each task.
    pub done: Vec<Done>,
    /// The firmware's own log lines.
    pub firmware_log: Vec<String>,
    /// The last capture, if one was armed.
    pub captured: Option<Captured>,
    /// The fault that was latched when the session began; it was cleared.
    pub cleared: Fault,
    /// The loops' tuning in force.
    pub tuning: Tuning,
}

/// How far a session is. Reported about every 512 control ticks.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// Everything so far.
    pub log: &'a RunLog,
    /// What it is doing.
    pub task: &'a str,
    /// 0 … 1 of this task.
    pub share: f64,
    /// What the servo has learned, here or in an earlier life.
    pub estimates: Option<&'a EstimatesReport>,
}

/// Opens the way to the servo. `seed` is the builtin motor's noise.
pub fn connect(
    door: &Door,
    config: &Config,
    seed: u64,
    qemu: &qemu::Options,
) -> Result<Box<dyn Wire>, InputError> {
    Ok(match door {
        Door::Builtin(path) => {
            let motor = Box::new(Builtin::open(path, config, seed)?);
            Box::new(Lockstep::start(qemu, motor, *config)?)
        }
        Door::Exec(command) => {
            let motor = Box::new(Exec::start(command)?);
            Box::new(Lockstep::start(qemu, motor, *config)?)
        }
        Door::Serial(port) => Box::new(Serial::open(port)?),
    })
}

/// One record in how many ticks the way to the servo carries.
pub fn decimation(door: &Door, config: &Config) -> u32 {
    match door {
        Door::Serial(_) => config.tick_hz.div_ceil(SERIAL_RECORDS_PER_S),
        _ => 1,
    }
}

/// What the axis is told at the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is one a session")]
pub enum Start {
    /// This; what was identified before is forgotten, what was chosen before stays where the file is silent.
    Configure(Setup),
    /// Nothing: it goes on with the parameters that it has stored.
    Stored,
}

/// Which axis of the servo, and how it is listened to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listening {
    /// Number on the chip, from 0.
    pub axis: u8,
    /// One record in so many ticks.
    pub every: u32,
}

/// Does all tasks in order on the first axis. A refused commissioning ends it early, so `done` may be shorter than
/// `tasks`.
pub fn run(
    wire: Box<dyn Wire>,
    config: Config,
    every: u32,
    tasks: &[Task],
    progress: &mut dyn FnMut(Progress),
) -> Result<SessionResult, InputError> {
    let listening = Listening { axis: 0, every };
    run_from(wire, Start::Configure(config.into()), listening, tasks, progress)
}

/// The same on any axis, and from what it has stored if need be.
pub fn run_from(
    wire: Box<dyn Wire>,
    start: Start,
    listening: Listening,
    tasks: &[Task],
    progress: &mut dyn FnMut(Progress),
) -> Result<SessionResult, InputError> {
    let mut session = Session::open(wire, start, listening)?;
    let mut done = Vec::new();
    for task in tasks {
        let result = match task {
            Task::Commission { budget_s, seed } => session.commission(*budget_s, *seed, progress)?,
            Task::Adopt(estimates) => session.adopt(estimates)?,
            Task::Reference(how) => session.reference(*how, progress)?,
            Task::Store => session.store(progress)?,
            Task::Move(target) => session.go(*target, progress)?,
            Task::Capture { trigger, before } => {
                session.capture = Some((*trigger, *before));
                Done::Armed
            }
            Task::Track {
                profile,
                compensation,
            } => session.track(profile, *compensation, progress)?,
            Task::Excite(waveform) => session.excite(waveform, progress)?,
        };
        let refused = matches!(&result, Done::Commissioned(outcome) if outcome.refused.is_some());
        done.push(result);
        if refused {
            break;
        }
    }
    session.close(done)
}

/// What the servo has stored.
fn stored(client: &mut Client) -> Result<AxisParameters, InputError> {
    let parameters = client.parameters()?;
    let found = client.hello()?.stored;
    parameters.ok_or_else(|| {
        InputError(format!(
            "this axis has no parameters to go on with ({}); run `truing commission --store` first",
            found_text(found)
        ))
    })
}

/// An open session.
struct Session {
    client: Client,
    kept: RefCell<Kept>,
    every: u32,
    capture: Option<(Trigger, u16)>,
    cleared: Fault,
    tuning: Tuning,
}

/// What has arrived.
struct Kept {
    axis: u8,
    log: RunLog,
    ended: Option<Outcome>,
    captured: Option<Captured>,
    estimates: Option<EstimatesReport>,
    /// The last fault that any telemetry has told, before the first configuration too.
    fault: Fault,
}

impl Kept {
    fn take(&mut self, message: Message) {
        if message.axis().is_some_and(|axis| axis != self.axis) {
            return;
        }
        if let Message::Telemetry { record, .. } = &message {
            self.fault = record.fault;
        }
        match message {
            // Before its configuration an axis has no version.
            Message::Telemetry {
                tick, cost, record, ..
            } if record.version != 0 => {
                self.log.rows.push(Row {
                    tick,
                    cost,
                    motor_flags: 0,
                    record,
                });
            }
            Message::Commissioned { tick, outcome, .. } => {
                self.log.outcomes.push((tick, outcome));
                self.ended = Some(outcome);
                self.learn(&outcome.estimates);
            }
            Message::Parameters {
                parameters: Some(parameters),
                ..
            } => self.learn(&parameters.estimates),
            Message::Captured {
                stage, extent, shots, ..
            } => {
                let captured = self.captured.get_or_insert_default();
                (captured.stage, captured.extent) = (stage, extent);
                captured.shots.extend(shots);
            }
            _ => {}
        }
    }

    fn learn(&mut self, estimates: &Estimates) {
        self.estimates = self.log.config.build().ok().map(|scale| estimates.report(&scale));
    }

    fn now(&self) -> u32 {
        self.log.rows.last().map_or(0, |row| row.tick)
    }

    /// Did the last `still` records show no motion?
    fn stands(&self, still: usize) -> bool {
        let rows = &self.log.rows;
        let recent = rows.iter().rev().take(still).map(|row| row.record.count);
        rows.len() >= still && spread(recent) <= STILL_COUNTS
    }

    fn activity(&self) -> Activity {
        self.log
            .rows
            .last()
            .map_or(Activity::Idle, |row| row.record.activity)
    }
}

impl Session {
    fn open(wire: Box<dyn Wire>, start: Start, listening: Listening) -> Result<Self, InputError> {
        let Listening { axis, every } = listening;
        let mut client = Client::new(wire);
        client.select(axis);
        let (config, known) = match start {
            Start::Configure(setup) => (setup.config, None),
            Start::Stored => {
                let parameters = stored(&mut client)?;
                (parameters.config, Some(parameters))
            }
        };
        let mut session = Session {
            client,
            kept: RefCell::new(Kept {
                axis,
                log: RunLog::new(config),
                ended: None,
                captured: None,
                estimates: None,
                fault: Fault::None,
            }),
            every,
            capture: None,
            cleared: Fault::None,
            tuning: known.map_or_else(Tuning::default, |known| known.tuning),
        };
        if let Some(known) = &known {
            session.kept.get_mut().learn(&known.estimates);
        }
        let before = session.listen(every)?;
        if let Start::Configure(setup) = start {
            session.set_up(&setup, before.as_ref())?;
        }
        while session.kept.borrow().log.rows.is_empty() {
            session.turn()?;
        }
        Ok(session)
    }

    /// Subscribes, and opens the bridge: whoever begins a session has seen to what went before. What is in force.
    fn listen(&mut self, every: u32) -> Result<Option<AxisParameters>, InputError> {
        let subscribe = Command::Subscribe { every };
        let mut heed = |message| self.kept.borrow_mut().take(message);
        self.client.command(subscribe, &mut heed)?;
        // One record at least comes meanwhile.
        let before = self.client.parameters_heeding(&mut heed)?;
        self.cleared = self.kept.borrow().fault;
        self.command(Command::Stop)?;
        Ok(before)
    }

    /// Puts an axis file in force. The log begins here: with the whole set that is in force from now on, or with a bare
    /// configuration where nothing was chosen, it can be replayed.
    fn set_up(&mut self, setup: &Setup, before: Option<&AxisParameters>) -> Result<(), InputError> {
        let parameters = setup.parameters(before);
        let bare = Setup::from(setup.config).parameters(None);
        {
            let log = &mut self.kept.get_mut().log;
            log.config = parameters.config;
            log.commands.clear();
        }
        self.tuning = parameters.tuning;
        let tick = self.command(match parameters == bare {
            true if before.is_none() => Command::Configure(setup.config),
            _ => Command::Restore(parameters),
        })?;
        self.kept.get_mut().log.rows.retain(|row| row.tick >= tick);
        Ok(())
    }

    fn config(&self) -> Config {
        self.kept.borrow().log.config
    }

    fn turn(&mut self) -> Result<(), InputError> {
        self.client
            .turn(&mut |message| self.kept.borrow_mut().take(message))
    }

    /// Sends a command, waits for its answer and keeps it with the tick in which it acted.
    fn command(&mut self, command: Command) -> Result<u32, InputError> {
        let tick = self
            .client
            .command(command, &mut |message| self.kept.borrow_mut().take(message))?;
        self.kept.borrow_mut().log.commands.push((tick, command));
        Ok(tick)
    }

    /// Lets the servo run up to a tick, or until `until` says so; returns the tick reached.
    fn run_to(
        &mut self,
        end: u32,
        until: impl Fn(&Kept) -> bool,
        task: &str,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<u32, InputError> {
        let start = self.kept.borrow().now();
        let length = f64::from(end.saturating_sub(start).max(1));
        loop {
            self.turn()?;
            let kept = self.kept.borrow();
            let now = kept.now();
            if now >= end || until(&kept) {
                return Ok(now);
            }
            if now % 512 < self.every {
                let share = f64::from(now - start) / length;
                progress(Progress {
                    log: &kept.log,
                    task,
                    share,
                    estimates: kept.estimates.as_ref(),
                });
            }
        }
    }

    fn ticks(&self, seconds: f64) -> u32 {
        (seconds * f64::from(self.config().tick_hz)).round() as u32
    }

    fn begin_run(&mut self) {
        let kept = self.kept.get_mut();
        let start = kept.now() + 1;
        let ticks = kept.log.rows.len()
            - kept
                .log
                .rows
                .iter()
                .rposition(|row| Some(&row.tick) == kept.log.run_starts.last())
                .unwrap_or(0);
        // A few ticks before the first motion are no run of their own.
        if ticks as f64 > LEAST_RUN_S * f64::from(kept.log.config.tick_hz) {
            kept.log.run_starts.push(start);
        }
    }

    fn commission(
        &mut self,
        budget_s: f64,
        seed: u32,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Done, InputError> {
        self.command(Command::Arm)?;
        let budget_ms = (budget_s * 1000.0).round() as u32;
        self.kept.get_mut().ended = None;
        let start = self.command(Command::Commission { budget_ms, seed })?;
        let limit = start + self.ticks(OVERTIME.0 * budget_s + OVERTIME.1);
        self.run_to(limit, |kept| kept.ended.is_some(), "commissioning", progress)?;
        let ended = self.kept.get_mut().ended.take();
        let outcome =
            ended.ok_or_else(|| InputError("the commissioning does not end; update the firmware".into()))?;
        self.pause()?;
        Ok(Done::Commissioned(Box::new(outcome)))
    }

    fn adopt(&mut self, estimates: &Estimates) -> Result<Done, InputError> {
        self.command(Command::Adopt(*estimates))?;
        Ok(Done::Adopted)
    }

    fn reference(
        &mut self,
        how: Referencing,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Done, InputError> {
        self.command(Command::Arm)?;
        let start = self.command(Command::Reference(how))?;
        let state = |kept: &Kept| {
            let last = kept.log.rows.last().filter(|row| row.tick > start);
            last.map_or(Referenced::Searching, |row| row.record.referenced)
        };
        let end = start + self.ticks(LONGEST_SEARCH_S);
        let over = |kept: &Kept| state(kept) != Referenced::Searching;
        self.run_to(end, over, "referencing", progress)?;
        let found = state(&self.kept.borrow());
        self.command(Command::Stop)?;
        match found {
            Referenced::Yes => Ok(Done::Referenced),
            _ => Err(InputError(
                "no reference was found: start away from the stop, give a longer way, and check encoder and index".into(),
            )),
        }
    }

    /// An open bridge lets the shaft coast; only when it stands may the flash be written.
    fn store(&mut self, progress: &mut dyn FnMut(Progress)) -> Result<Done, InputError> {
        let still = self.standstill();
        let end = self.kept.borrow().now() + self.ticks(LONGEST_REST_S);
        self.run_to(end, |kept| kept.stands(still), "coming to rest", progress)?;
        self.client.save(&mut |_| {})?;
        Ok(Done::Stored)
    }

    /// Records without motion that make a standstill.
    fn standstill(&self) -> usize {
        (self.ticks(STILL_S) as usize / self.every.max(1) as usize).max(2)
    }

    /// Piece by piece, until one comes back empty.
    fn read_capture(&mut self) -> Result<(), InputError> {
        self.kept.get_mut().captured = Some(Captured::default());
        loop {
            let held = |kept: &Kept| kept.captured.as_ref().map_or(0, |captured| captured.shots.len());
            let from = held(&self.kept.borrow());
            self.command(Command::CaptureRead { from: from as u16 })?;
            // The piece follows its answer.
            self.pause_for(READ_S)?;
            if held(&self.kept.borrow()) == from {
                return Ok(());
            }
        }
    }

    fn track(
        &mut self,
        profile: &Profile,
        compensation: bool,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Done, InputError> {
        self.command(Command::Compensation(compensation))?;
        self.command(Command::Arm)?;
        self.come_to_rest(progress)?;
        let captures = self.arm_capture()?;
        self.begin_run();
        let start = match profile {
            Profile::Sine {
                amplitude_rad,
                frequency_hz,
                seconds,
            } => self.command(Command::TrackSine {
                amplitude_rad: *amplitude_rad,
                frequency_hz: *frequency_hz,
                duration_ms: (seconds * 1000.0).round() as u32,
            })?,
            Profile::Step { amplitude_rad, .. } => {
                self.command(Command::Position(self.here() + amplitude_rad))?
            }
            Profile::Points(points) => self.follow(points, progress)?,
        };
        let hold = start + self.ticks(profile.seconds());
        let end = hold + self.ticks(HOLD_S);
        let faulted = |kept: &Kept| kept.activity() == Activity::Faulted;
        let reached = self.run_to(end, faulted, "tracking", progress)?;
        let faulted = self.stop_motion(captures)?;
        Ok(Done::Tracked(Span {
            start,
            hold: hold.min(reached),
            end: reached,
            faulted,
        }))
    }

    /// The servo opens the bridge by itself; the shaft is watched while it coasts.
    fn excite(
        &mut self,
        waveform: &Waveform,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Done, InputError> {
        self.command(Command::Arm)?;
        let captures = self.arm_capture()?;
        self.begin_run();
        let start = self.command(Command::Excite(*waveform))?;
        let end = start + self.ticks(f64::from(waveform.duration_ms) / 1000.0);
        let over = |kept: &Kept| kept.now() > start && kept.activity() != Activity::Driving;
        let reached = self.run_to(end, over, "excitation", progress)?;
        let faulted = self.stop_motion(captures)?;
        self.command(Command::Parameters)?;
        let learned = self.kept.borrow().estimates;
        let learned = learned
            .ok_or_else(|| InputError("the servo does not tell what it knows; update its firmware".into()))?;
        let span = Span {
            start,
            hold: reached,
            end: reached,
            faulted,
        };
        Ok(Done::Excited(span, Box::new(learned)))
    }

    /// True if there is something to capture.
    fn arm_capture(&mut self) -> Result<bool, InputError> {
        let Some((trigger, before)) = self.capture.take() else {
            return Ok(false);
        };
        self.command(Command::CaptureArm { trigger, before })?;
        // So that there is something from before the motion.
        self.pause()?;
        Ok(true)
    }

    /// Bridge open, and the capture read out. True if a fault was latched.
    fn stop_motion(&mut self, captures: bool) -> Result<bool, InputError> {
        let faulted = self.kept.borrow().activity() == Activity::Faulted;
        self.command(Command::Stop)?;
        self.pause()?;
        if captures {
            self.read_capture()?;
        }
        Ok(faulted)
    }

    fn go(&mut self, target: Target, progress: &mut dyn FnMut(Progress)) -> Result<Done, InputError> {
        self.command(Command::Arm)?;
        self.come_to_rest(progress)?;
        self.begin_run();
        let start = self.command(match target {
            Target::To(rad) => Command::GoTo(rad),
            Target::By(rad) => Command::Position(self.here() + rad),
        })?;
        // The records of the standstill before are none of the arrival.
        let first = start + self.ticks(STILL_S);
        self.run_to(first, |_| false, "moving", progress)?;
        let still = self.standstill();
        let faulted = |kept: &Kept| kept.activity() == Activity::Faulted;
        let over = |kept: &Kept| faulted(kept) || kept.activity() == Activity::Holding && kept.stands(still);
        let arrived = self.run_to(start + self.ticks(LONGEST_MOVE_S), over, "moving", progress)?;
        self.run_to(arrived + self.ticks(HOLD_S), faulted, "holding", progress)?;
        let arrival = Arrival {
            seconds: f64::from(arrived - start) / f64::from(self.config().tick_hz) - STILL_S,
            error_rad: self.off_target(),
            held: self.kept.borrow().activity() == Activity::Holding,
        };
        self.command(Command::Stop)?;
        self.pause()?;
        Ok(Done::Moved(arrival))
    }

    /// Position minus set-point now, rad.
    fn off_target(&self) -> f32 {
        let kept = self.kept.borrow();
        let reference = kept.log.rows.last().map_or(0, |row| row.record.reference_q8);
        let wanted = reference as f32 / 256.0 * TAU / kept.log.config.counts_per_rev as f32;
        drop(kept);
        self.here() - wanted
    }

    /// Holds the position where the axis is now, until it stands: a motor with little friction coasts for long.
    fn come_to_rest(&mut self, progress: &mut dyn FnMut(Progress)) -> Result<(), InputError> {
        let here = self.here();
        self.command(Command::Position(here))?;
        let still = self.standstill();
        let stands = |kept: &Kept| kept.activity() == Activity::Holding && kept.stands(still);
        let end = self.kept.borrow().now() + self.ticks(LONGEST_REST_S);
        // The rows of the commissioning are no standstill of this hold.
        let first = self.kept.borrow().now() + self.ticks(STILL_S);
        self.run_to(first, |_| false, "settling", progress)?;
        let reached = self.run_to(end, stands, "settling", progress)?;
        if reached >= end {
            // The move to the standstill has not ended: give it up and begin from wherever the axis is.
            self.command(Command::Stop)?;
            self.command(Command::Arm)?;
        }
        Ok(())
    }

    /// Streams the points as far ahead of their time as the servo has room; returns the tick in which the first one
    /// counts. A fault, or a stream that runs dry, ends it early.
    fn follow(&mut self, points: &[Waypoint], progress: &mut dyn FnMut(Progress)) -> Result<u32, InputError> {
        let spacing = match self.every {
            0 | 1 => SPACING_TICKS,
            // On a real line.
            _ => self.ticks(SPACING_S).max(SPACING_TICKS),
        };
        let knots = waypoints::knots(points, self.config().tick_hz, spacing);
        let centre = self.here();
        if let Some(first) = knots.first().filter(|first| first.theta_rad != 0.0) {
            self.command(Command::Position(centre + first.theta_rad as f32))?;
            let end = self.kept.borrow().now() + self.ticks(LONGEST_REST_S);
            let begun = self.kept.borrow().now() + self.ticks(STILL_S);
            let arrived = |kept: &Kept| kept.now() > begun && kept.activity() != Activity::Tracking;
            self.run_to(end, arrived, "settling", progress)?;
        }
        let over = |kept: &Kept| {
            let last = kept.log.rows.last().map(|row| row.record);
            kept.activity() == Activity::Faulted
                || last.is_some_and(|record| record.advisory == Advisory::StreamRanDry)
        };
        let mut start = None;
        for next in 1..knots.len() {
            let (before, knot) = (&knots[next - 1], &knots[next]);
            let sent = self.command(Command::Stream(Point {
                position_rad: centre + knot.theta_rad as f32,
                speed_rad_s: knot.omega_rad_s as f32,
                acceleration_rad_s2: knot.alpha_rad_s2.map(|alpha| alpha as f32),
                ticks: knot.tick - before.tick,
            }))?;
            let start = *start.get_or_insert(sent);
            // Only when this one has been reached is there room for the next.
            let due = start + knots[next.saturating_sub(Point::ROOM)].tick;
            if self.kept.borrow().now() <= due {
                self.run_to(due + 1, over, "tracking", progress)?;
            }
            if over(&self.kept.borrow()) {
                break;
            }
        }
        start.ok_or_else(|| {
            InputError("the profile has no two points that are far enough apart in time".into())
        })
    }

    /// Position now, rad from power-up.
    fn here(&self) -> f32 {
        let kept = self.kept.borrow();
        let counts = kept
            .log
            .rows
            .last()
            .map_or(0, |row| row.record.count.wrapping_sub(kept.log.zero()));
        counts as f32 * TAU / kept.log.config.counts_per_rev as f32
    }

    fn pause(&mut self) -> Result<(), InputError> {
        self.pause_for(PAUSE_S)
    }

    fn pause_for(&mut self, seconds: f64) -> Result<(), InputError> {
        let end = self.kept.borrow().now() + self.ticks(seconds).max(2);
        self.run_to(end, |_| false, "pause", &mut |_| {})?;
        Ok(())
    }

    fn close(self, done: Vec<Done>) -> Result<SessionResult, InputError> {
        let (cleared, tuning) = (self.cleared, self.tuning);
        let farewell = self.client.close();
        let Kept {
            mut log, captured, ..
        } = self.kept.into_inner();
        for row in &mut log.rows {
            row.motor_flags = farewell.motor_flags.get(row.tick as usize).copied().unwrap_or(0);
        }
        Ok(SessionResult {
            log,
            done,
            firmware_log: farewell.firmware_log,
            captured,
            cleared,
            tuning,
        })
    }
}

/// Largest minus smallest, wrapping.
fn spread(mut counts: impl Iterator<Item = i32>) -> i32 {
    let Some(first) = counts.next() else { return 0 };
    let (low, high) = counts.fold((0, 0), |(low, high), count| {
        let off = count.wrapping_sub(first);
        (off.min(low), off.max(high))
    });
    high - low
}

impl Profile {
    /// Length, s.
    pub fn seconds(&self) -> f64 {
        match self {
            Profile::Sine { seconds, .. } | Profile::Step { seconds, .. } => f64::from(*seconds),
            Profile::Points(points) => match (points.first(), points.last()) {
                (Some(first), Some(last)) => last.time_s - first.time_s,
                _ => 0.0,
            },
        }
    }
}
