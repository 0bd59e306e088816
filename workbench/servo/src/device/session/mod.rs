//! A session with the firmware: configure, commission, track, and keep the log.

mod kept;
mod learning;
mod motion;
mod task;

pub use super::motion_profile::Profile;
pub use motion::HOLD_S;
pub use task::{Arrival, Captured, Done, Span, Target, Task};

use crate::device::feasible::Shortfall;
use crate::device::link::{Client, Farewell, Lockstep, Serial, Wire, fault_advice};
use crate::device::motor::{Builtin, Door, Exec, Motor, qemu};
use crate::device::run_log::RunLog;
use crate::device::setup::Setup;
pub use kept::Kept;
use learning::stored;
use servo::config::Config;
use servo::control::Tuning;
use servo::identify::estimate::{Estimates, EstimatesReport};
use servo::link::capture::Trigger;
use servo::link::protocol::Command;
use servo::protect::Fault;
use servo::store::AxisParameters;
use std::cell::RefCell;
use truing_core::text::input_error::InputError;
use truing_report::console::interrupt;

/// Records per second that a real link carries.
const SERIAL_RECORDS_PER_S: u32 = 400;
/// The bridge is open for so long between two tasks, s.
const PAUSE_S: f64 = 0.3;
/// What an open bridge lets a load do, and the remedy.
pub const DRIVEN: &str = "the shaft is driven away while the bridge is open: brake it, or take the load off";
/// An axis that does not move for so long, s, stands.
pub const STILL_S: f64 = 0.1;
/// After so long, s, a motion begins even if the axis does not stand.
const LONGEST_REST_S: f64 = 10.0;

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
    /// What ended it before all tasks were done.
    pub broken: Option<InputError>,
    /// What a profile lacked that was scaled for [`Task::Fit`].
    pub fitted: Option<Shortfall>,
}

/// How far a session is. Reported about every 512 control ticks, and when a task is done.
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
    /// What the task has given, once it is done.
    pub done: Option<&'a Done>,
}

/// Is told how far a session is.
pub type Listener<'a> = dyn FnMut(Progress) + 'a;
/// What a task gave, or why it could not be done.
type Performed = Result<Done, InputError>;

/// Opens the way to the servo. `seed` is the builtin motor's noise.
pub fn connect(
    door: &Door,
    config: &Config,
    seed: u64,
    qemu: &qemu::Options,
) -> Result<Box<dyn Wire>, InputError> {
    let motor: Box<dyn Motor> = match door {
        Door::Builtin(path) => Box::new(Builtin::open(path, config, seed)?),
        Door::Exec(command) => Box::new(Exec::start(command)?),
        Door::Serial(port) => return Ok(Box::new(Serial::open(port)?)),
    };
    Ok(Box::new(Lockstep::start(qemu, motor, *config)?))
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

impl SessionResult {
    /// An error if it ended before all tasks were done. A refused commissioning is none, so `done` may be shorter than the
    /// tasks.
    pub fn complete(mut self) -> Result<Self, InputError> {
        self.broken.take().map_or(Ok(self), Err)
    }
}

/// Does all tasks in order on the first axis.
pub fn run(
    wire: Box<dyn Wire>,
    config: Config,
    every: u32,
    tasks: &[Task],
    progress: &mut Listener,
) -> Result<SessionResult, InputError> {
    let start = Start::Configure(config.into());
    run_kept(wire, start, Listening { axis: 0, every }, tasks, progress)?.complete()
}

/// The same on any axis, and from what it has stored if need be. What was recorded and done before an error or an
/// interruption is kept. In every case the servo is stopped as long as it can be reached.
pub fn run_kept(
    wire: Box<dyn Wire>,
    start: Start,
    listening: Listening,
    tasks: &[Task],
    progress: &mut Listener,
) -> Result<SessionResult, InputError> {
    let _hold = interrupt::hold();
    let mut session = Session::open(wire, start, listening)?;
    let mut done = Vec::new();
    let broken = session.all(tasks, &mut done, progress).err().map(|error| session.halt(error));
    Ok(session.close(done, broken))
}

/// Why a session ended early, and whether the servo is known to stand.
fn ending(error: InputError, fault: Fault, stopped: bool) -> InputError {
    let latched = match fault {
        Fault::None => String::new(),
        fault => format!("; the servo had latched a fault: {}", fault_advice(fault)),
    };
    InputError(match (interrupt::asked(), stopped) {
        (true, true) => format!("interrupted: the servo was stopped, its bridge is open{latched}"),
        (true, false) => format!(
            "interrupted, and the servo has not confirmed the stop: see that the motor stands, or switch its supply off{latched}"
        ),
        (false, _) => format!("{error}{latched}"),
    })
}

/// An open session, for whoever drives a servo step by step.
pub struct Session {
    client: Client,
    /// What has arrived so far.
    pub kept: RefCell<Kept>,
    /// One record in so many ticks.
    pub every: u32,
    /// What was in force on the axis when the session began; `None`: nothing.
    pub before: Option<AxisParameters>,
    capture: Option<(Trigger, u16)>,
    cleared: Fault,
    tuning: Tuning,
    fit: bool,
    fitted: Option<Shortfall>,
}

impl Session {
    /// Subscribes, opens the bridge and puts in force what `start` says. A servo that refuses is stopped.
    pub fn open(wire: Box<dyn Wire>, start: Start, listening: Listening) -> Result<Self, InputError> {
        let Listening { axis, every } = listening;
        let mut client = Client::new(wire);
        client.select(axis);
        let (config, known) = match start {
            Start::Configure(setup) => (setup.config, None),
            Start::Stored => match stored(&mut client) {
                Ok(parameters) => (parameters.config, Some(parameters)),
                Err(error) => {
                    let stopped = client.stop(&mut |_| {}).is_some();
                    return Err(ending(error, Fault::None, stopped));
                }
            },
        };
        let mut session = Session {
            client,
            kept: RefCell::new(Kept {
                axis,
                log: RunLog::new(config),
                ended: None,
                captured: None,
                estimates: None,
                known: Estimates::default(),
                fault: Fault::None,
            }),
            every,
            before: None,
            capture: None,
            cleared: Fault::None,
            tuning: known.map_or_else(Tuning::default, |known| known.tuning),
            fit: false,
            fitted: None,
        };
        if let Some(known) = &known {
            session.kept.get_mut().learn(&known.estimates);
        }
        session.begin(start).map_err(|error| session.halt(error))?;
        Ok(session)
    }

    fn begin(&mut self, start: Start) -> Result<(), InputError> {
        self.before = self.listen(self.every)?;
        if let Start::Configure(setup) = start {
            let board = self.client.board(&mut |message| self.kept.borrow_mut().take(message))?;
            self.set_up(&setup.on(&board)?, self.before)?;
        }
        while self.kept.borrow().log.rows.is_empty() {
            self.turn()?;
        }
        Ok(())
    }

    /// Does all tasks in order; a refused commissioning or a fault ends it early.
    fn all(
        &mut self,
        tasks: &[Task],
        done: &mut Vec<Done>,
        progress: &mut Listener,
    ) -> Result<(), InputError> {
        for task in tasks {
            let result = self.perform(task, progress)?;
            let kept = self.kept.borrow();
            progress(kept.progress("done", 1.0, Some(&result)));
            let over = match &result {
                Done::Commissioned(outcome) => outcome.refused.is_some(),
                Done::Tracked(span) => span.faulted,
                _ => false,
            };
            done.push(result);
            if over {
                break;
            }
        }
        Ok(())
    }

    fn perform(&mut self, task: &Task, progress: &mut Listener) -> Performed {
        match task {
            Task::Commission { budget_s, seed } => self.commission(*budget_s, *seed, progress),
            Task::Adopt(estimates) => self.adopt(estimates),
            Task::Modelled(told) => self.command(Command::Modelled(*told)).map(|_| Done::Adopted),
            Task::PositionLoad(load) => self.command(Command::PositionLoad(*load)).map(|_| Done::Adopted),
            Task::Reference(how) => self.reference(*how, progress),
            Task::Store => self.store(progress),
            Task::Move(target) => self.go(*target, progress),
            Task::Capture { trigger, before } => {
                self.capture = Some((*trigger, *before));
                Ok(Done::Armed)
            }
            Task::Fit => {
                self.fit = true;
                Ok(Done::Fits)
            }
            Task::Track { profile, compensation } => self.track(profile, *compensation, progress),
            Task::Excite(waveform) => self.excite(waveform, progress),
        }
    }

    /// Opens the bridge if the servo can still be reached; why the session ended, in words.
    pub fn halt(&mut self, error: InputError) -> InputError {
        // A stop clears the fault.
        let fault = self.kept.get_mut().fault;
        let stopped = self.client.stop(&mut |message| self.kept.borrow_mut().take(message));
        if let Some(tick) = stopped {
            self.kept.get_mut().log.commands.push((tick, Command::Stop));
        }
        ending(error, fault, stopped.is_some())
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
    fn set_up(&mut self, setup: &Setup, before: Option<AxisParameters>) -> Result<(), InputError> {
        let parameters = setup.parameters(before.as_ref());
        let bare = Setup::from(setup.config).parameters(None);
        self.kept.get_mut().log.config = parameters.config;
        self.kept.get_mut().log.commands.clear();
        self.tuning = parameters.tuning;
        let tick = self.command(match parameters == bare {
            true if before.is_none() => Command::Configure(setup.config),
            _ => Command::Restore(parameters),
        })?;
        self.kept.get_mut().log.rows.retain(|row| row.tick >= tick);
        Ok(())
    }

    /// [`Client::trial`]
    pub fn trial(&mut self, tick_hz: u32) -> Result<(), InputError> {
        self.client.trial(tick_hz)
    }

    /// The configuration in force.
    pub fn config(&self) -> Config {
        self.kept.borrow().log.config
    }

    fn turn(&mut self) -> Result<(), InputError> {
        self.client.turn(&mut |message| self.kept.borrow_mut().take(message))
    }

    /// Sends a command, waits for its answer and keeps it with the tick in which it acted.
    pub fn command(&mut self, command: Command) -> Result<u32, InputError> {
        let tick = self.client.command(command, &mut |message| self.kept.borrow_mut().take(message))?;
        self.kept.borrow_mut().log.commands.push((tick, command));
        Ok(tick)
    }

    /// Lets the servo run up to a tick, or until `until` says so; returns the tick reached.
    pub fn run_to(
        &mut self,
        end: u32,
        until: impl Fn(&Kept) -> bool,
        task: &str,
        progress: &mut Listener,
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
                progress(kept.progress(task, share, None));
            }
        }
    }

    /// s → control ticks.
    pub fn ticks(&self, seconds: f64) -> u32 {
        (seconds * f64::from(self.config().tick_hz)).round() as u32
    }

    /// Lets the servo run for so long, s.
    pub fn pause(&mut self, seconds: f64) -> Result<(), InputError> {
        let end = self.kept.borrow().now() + self.ticks(seconds).max(2);
        self.run_to(end, |_| false, "pause", &mut |_| {}).map(|_| ())
    }

    /// Ends the connection; all that was recorded.
    pub fn close(self, done: Vec<Done>, broken: Option<InputError>) -> SessionResult {
        let (cleared, tuning, fitted) = (self.cleared, self.tuning, self.fitted);
        let Farewell { firmware_log, motor_flags } = self.client.close();
        let Kept { mut log, captured, .. } = self.kept.into_inner();
        for row in &mut log.rows {
            row.motor_flags = motor_flags.get(row.tick as usize).copied().unwrap_or(0);
        }
        SessionResult { log, done, firmware_log, captured, cleared, tuning, broken, fitted }
    }
}
