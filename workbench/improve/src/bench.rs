//! A servo on the bench: what is in force on it, and the time that its motor has been under way.

use crate::motions::Motion;
use crate::shared::Shared;
use serde::{Deserialize, Serialize};
use servo::compensate::position_load::PositionLoad;
use servo::control::Tuning;
use servo::link::protocol::{Command, Message};
use servo::protect::Fault;
use servo::record::{Activity, Advisory};
use servo::store::AxisParameters;
use truing_core::text::input_error::InputError;
use truing_servo::device::link::{Client, Wire, fault_advice};
use truing_servo::device::run_log::RunLog;
use truing_servo::device::session::{
    self, DRIVEN, Kept, Listening, STILL_S, Session, SessionResult, Span, Start, Task,
};
use truing_servo::device::tracking::TrackJson;

/// Nobody waits longer than this for a shaft to stand, s.
const LONGEST_REST_S: f64 = 4.0;

/// Host and servo at once: whether the servo was switched off between two of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Seconds of 1970 to now.
    pub second: i64,
    /// Control ticks since the servo's power-up.
    pub tick: u32,
}

impl Moment {
    /// Is it the same life of the servo? Its ticks have gone on at least as long as the host's clock, to some seconds.
    pub fn same_life(&self, later: &Self, tick_hz: u32) -> bool {
        let elapsed = (later.second - self.second) as f64;
        let apart = f64::from(later.tick) - f64::from(self.tick);
        apart >= 0.0 && apart / f64::from(tick_hz) > 0.98 * elapsed - 5.0
    }
}

/// The servo.
pub struct Bench {
    wire: Shared,
    listening: Listening,
    /// How long the motor has been commissioned, recorded and tried, s.
    pub motor_s: f64,
}

impl Bench {
    /// Nothing is sent yet.
    pub fn new(wire: Box<dyn Wire>, listening: Listening) -> Self {
        Self { wire: Shared::new(wire), listening, motor_s: 0.0 }
    }

    /// The line for a session of its own, and how it listens.
    pub fn line(&self) -> (Box<dyn Wire>, Listening) {
        (self.wire.line(), self.listening)
    }

    fn client(&self) -> Client {
        let mut client = Client::new(self.wire.line());
        client.select(self.listening.axis);
        client
    }

    /// What is in force; `None`: the axis is not configured. A table of an earlier power-up, whose counter was another, is none.
    pub fn in_force(&self) -> Result<Option<AxisParameters>, InputError> {
        let (mut client, mut waits) = (self.client(), false);
        let mut heed = |message| {
            if let Message::Telemetry { axis, record, .. } = message
                && axis == self.listening.axis
            {
                waits = record.advisory == Advisory::PositionLoadOff;
            }
        };
        client.command(Command::Subscribe { every: self.listening.every }, &mut heed)?;
        let mut told = client.parameters_heeding(&mut heed)?;
        let stale = |told: &&mut AxisParameters| waits && !told.position_load.is_absolute();
        told.iter_mut().filter(stale).for_each(|told| told.position_load = PositionLoad::default());
        Ok(told)
    }

    /// Host and servo at once.
    pub fn moment(&self) -> Result<Moment, InputError> {
        let mut client = self.client();
        let tick = client.command(Command::Subscribe { every: self.listening.every }, &mut |_| {})?;
        Ok(Moment { second: jiff::Timestamp::now().as_second(), tick })
    }

    /// [`Client::trial`]
    pub fn trial(&self, tick_hz: u32) -> Result<(), InputError> {
        self.client().trial(tick_hz)
    }

    /// [`Bench::restore`], and a table of this life of the servo goes on acting.
    pub fn put(&self, parameters: Option<&AxisParameters>) -> Result<(), InputError> {
        let mut client = self.restored(parameters)?;
        let load = parameters.map(|set| set.position_load).filter(|load| load.is_on() && load.is_trusted());
        let act = |load| client.command(Command::PositionLoad(load), &mut |_| {}).map(|_| ());
        load.map_or(Ok(()), act)
    }

    /// Stops the motor, puts a set in force in RAM and reads it back; `None`: an axis that is not configured. An
    /// interruption does not keep it from that.
    ///
    /// # Errors
    /// The servo cannot be reached, refuses the set, or tells another one: then it is not known what is in force.
    pub fn restore(&self, parameters: Option<&AxisParameters>) -> Result<(), InputError> {
        self.restored(parameters).map(|_| ())
    }

    /// The client that has done it heeds no interruption any more.
    fn restored(&self, parameters: Option<&AxisParameters>) -> Result<Client, InputError> {
        let mut client = self.client();
        if client.stop(&mut |_| {}).is_none() {
            return Err(InputError("the servo does not answer".into()));
        }
        let command = parameters.map_or(Command::Reset, |parameters| Command::Restore(*parameters));
        client.command(command, &mut |_| {})?;
        let told = bits(client.parameters()?.as_ref()) == bits(parameters);
        told.then_some(client).ok_or_else(|| InputError("the servo tells other parameters than given".into()))
    }

    /// Has the servo store this set, which is in force, once the shaft stands, and reads it back.
    pub fn keep(&self, parameters: Option<&AxisParameters>) -> Result<(), InputError> {
        match parameters {
            Some(_) => _ = self.session(Start::Stored, &[Task::Store])?.complete()?,
            None => self.client().save(&mut |_| {})?,
        }
        if bits(self.client().parameters()?.as_ref()) != bits(parameters) {
            return Err(InputError("the servo has stored other parameters than it was given".into()));
        }
        Ok(())
    }

    /// Counts the motor time of a session.
    pub fn took(&mut self, log: &RunLog) {
        let ticks = log.rows.first().zip(log.rows.last()).map_or(0, |(first, last)| last.tick - first.tick);
        self.motor_s += f64::from(ticks) / f64::from(log.config.tick_hz);
    }

    /// A session of its own on this line.
    pub fn session(&self, start: Start, tasks: &[Task]) -> Result<SessionResult, InputError> {
        session::run_kept(self.wire.line(), start, self.listening, tasks, &mut |_| {})
    }

    /// A set in force, the place where the shaft stands as home, and runs from there.
    pub fn runs(&self, parameters: &AxisParameters) -> Result<Runs, InputError> {
        self.put(Some(parameters))?;
        let session = Session::open(self.wire.line(), Start::Stored, self.listening)?;
        let tuning = parameters.tuning;
        let mut runs = Runs { session, seconds: 0.0, driven: false, drifts: false, tuning };
        runs.drifts = !runs.rest(|_| true)?;
        runs.begin_here(parameters)?;
        Ok(runs)
    }
}

/// A set as text, in which one bit that differs shows.
fn bits(parameters: Option<&AxisParameters>) -> Option<String> {
    serde_json::to_string(&parameters).ok()
}

/// Runs of one axis, all from the same place.
pub struct Runs {
    session: Session,
    /// How long the motor was under way, s.
    pub seconds: f64,
    /// A load drives the shaft while the bridge is open.
    driven: bool,
    /// It does not come to rest by itself, and was waited for in vain once.
    drifts: bool,
    /// The loops in force.
    tuning: Tuning,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Followed {
    /// Rms of the position error of each motion, rad.
    Whole(Vec<f64>),
    /// A fault ended it: which, and what to do.
    Faulted(String),
}

impl Runs {
    /// A set in force, and the place where the shaft is as home. Positions count from the first record: a shaft that still coasts is
    /// elsewhere by the next one.
    fn begin_here(&mut self, parameters: &AxisParameters) -> Result<(), InputError> {
        let begun = self.session.command(Command::Restore(*parameters))?;
        self.tuning = parameters.tuning;
        self.session.pause(0.0)?;
        self.session.kept.get_mut().log.rows.retain(|row| row.tick >= begun);
        Ok(())
    }

    /// Follows all motions with these numbers in use: at home, at rest, and back to an open bridge. The numbers are adopted
    /// in RAM; nothing is stored.
    pub fn follow(&mut self, numbers: &AxisParameters, motions: &[Motion]) -> Result<Followed, InputError> {
        // A run ends where it began: there a load's shaft is taken up at once, before it is far away.
        self.drifts = self.drifts || !self.driven && !self.rest(|_| true)?;
        let faulted = |kept: &Kept| kept.activity() == Activity::Faulted;
        if faulted(&self.session.kept.borrow()) {
            let fault = self.session.kept.borrow().log.fault();
            return Ok(Followed::Faulted(fault_advice(fault)));
        }
        // No command of its own changes the loops.
        let _ = numbers.tuning == self.tuning || self.begin_here(numbers).map(|()| true)?;
        self.session.command(Command::Adopt(numbers.estimates))?;
        self.session.command(Command::Compensation(numbers.compensation))?;
        self.session.command(Command::PositionLoad(numbers.position_load))?;
        self.session.command(Command::Modelled(numbers.modelled))?;
        let begun = self.session.command(Command::Arm)?;
        let holds = |kept: &Kept| kept.activity() == Activity::Holding;
        let home = self.session.command(Command::Position(0.0)).and_then(|_| self.rest(holds));
        if !(matches!(home, Ok(true)) || home.is_ok() && holds(&self.session.kept.borrow())) {
            if std::mem::replace(&mut self.driven, true) {
                return Err(home.err().unwrap_or_else(|| InputError(DRIVEN.into())));
            }
            self.seconds += self.session.catch(true, &mut |_| {})?;
            self.begin_here(numbers)?;
            return self.follow(numbers, motions);
        }
        let mut rms = Vec::new();
        for motion in motions {
            // A latched fault refuses what comes next.
            if faulted(&self.session.kept.borrow()) {
                break;
            }
            let start = self.session.command(motion.command())?;
            let end = start + self.session.ticks(motion.seconds);
            self.session.run_to(end, faulted, "tracking", &mut |_| {})?;
            let span = Span { start, hold: end, end, faulted: false };
            rms.push(TrackJson::new(&self.session.kept.borrow().log, &span).position_rms_rad);
        }
        let fault = self.session.kept.borrow().log.fault();
        let driven = self.session.command(Command::Stop)? - begun;
        self.seconds += f64::from(driven) / f64::from(self.session.config().tick_hz);
        Ok(if fault == Fault::None { Followed::Whole(rms) } else { Followed::Faulted(fault_advice(fault)) })
    }

    /// Waits until the shaft stands and the axis is in such a state; a fault ends the wait. `false`: it takes too long.
    fn rest(&mut self, such: impl Fn(&Kept) -> bool) -> Result<bool, InputError> {
        // The records of before are none of this rest.
        self.session.pause(STILL_S)?;
        // What a load drives stands for a moment where it turns back.
        let still = self.session.standstill() * if self.driven { 2 } else { 1 };
        let end = self.session.kept.borrow().now() + self.session.ticks(LONGEST_REST_S);
        let over = |kept: &Kept| kept.activity() == Activity::Faulted || kept.stands(still) && such(kept);
        self.session.run_to(end, over, "settling", &mut |_| {})?;
        Ok(over(&self.session.kept.borrow()))
    }
}
