//! Same code, same bits: the chip's raw integers and commands of every tick, run through the library on the host.
//!
//! What only the image saw (enable contact, bridge driver, tick overrun, watchdog, damaged parameters) is in no sample:
//! where the log holds a fault of that kind, the condition behind it is raised again. One that came while another fault was
//! latched has left no trace.

use crate::device::link::{advisory_text, fault_advice};
use crate::device::run_log::{Tape, Trace, digest};
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::commission::Outcome;
use servo::link::protocol::Command;
use servo::protect::{Condition, Fault};
use servo::record::{Advisory, Record, Referenced};
use std::fmt;
use std::iter::Peekable;
use std::slice::Iter;
use truing_core::text::input_error::InputError;

/// How a replay ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Control ticks compared.
    pub ticks: usize,
    /// Commands executed.
    pub commands: usize,
    /// Ends of commissionings compared.
    pub commissionings: usize,
    /// Faults and advisories with the ticks in which they came up.
    pub told: Vec<(u32, Telling)>,
    /// The first difference; `None`: every bit is the same.
    pub difference: Option<Difference>,
}

/// What an axis says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Telling {
    /// A fault was latched.
    Fault(Fault),
    /// Something should be looked at.
    Advisory(Advisory),
}

/// In the words of every other command.
impl fmt::Display for Telling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Telling::Fault(fault) => write!(f, "fault     {}", fault_advice(*fault)),
            Telling::Advisory(advisory) => {
                write!(f, "advisory  {}", advisory_text(*advisory).unwrap_or("none"))
            }
        }
    }
}

/// Where chip and host part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Control tick since power-up.
    pub tick: u32,
    /// What differs, with both values.
    pub what: String,
}

impl Verdict {
    /// Is every bit the same?
    pub fn identical(&self) -> bool {
        self.difference.is_none()
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (ticks, commands, ends) = (self.ticks, self.commands, self.commissionings);
        match &self.difference {
            None => write!(
                f,
                "same bits on chip and host: {ticks} control ticks, {commands} commands, {ends} commissionings"
            ),
            Some(difference) => {
                write!(f, "chip and host differ from tick {} on: {}", difference.tick, difference.what)
            }
        }
    }
}

/// Runs the tape through the library. Records and estimates are compared in every bit.
pub fn replay(tape: &Tape) -> Result<Verdict, InputError> {
    let mut replay = Replay::new(tape);
    for trace in &tape.traces {
        replay.obey(trace)?;
        replay.raise(trace);
        replay.step(trace);
        if replay.verdict.difference.is_some() {
            break;
        }
    }
    Ok(replay.verdict)
}

/// The axis of the library, and how far the tape has run.
struct Replay<'a> {
    axis: ServoAxis,
    commands: Peekable<Iter<'a, (u32, Command)>>,
    outcomes: Iter<'a, (u32, Outcome)>,
    last: Option<u32>,
    fault: Fault,
    advisory: Advisory,
    searching: bool,
    verdict: Verdict,
}

impl<'a> Replay<'a> {
    fn new(tape: &'a Tape) -> Self {
        Self {
            axis: ServoAxis::new(),
            commands: tape.commands.iter().peekable(),
            outcomes: tape.outcomes.iter(),
            last: None,
            fault: Fault::None,
            advisory: Advisory::None,
            searching: false,
            verdict: Verdict::default(),
        }
    }

    /// Executes what the chip had executed before this tick.
    fn obey(&mut self, trace: &Trace) -> Result<(), InputError> {
        consecutive(self.last.replace(trace.tick), trace.tick)?;
        while let Some((_, command)) = self.commands.next_if(|(tick, _)| *tick <= trace.tick) {
            execute(&mut self.axis, command)?;
            self.verdict.commands += 1;
        }
        Ok(())
    }

    /// Gives again what no sample holds: conditions, and the index pulse in the tick in which a search ends by it.
    fn raise(&mut self, trace: &Trace) {
        if let Some(condition) = Condition::behind(trace.fault) {
            self.axis.raise(condition);
        }
        if (self.searching, trace.referenced) == (true, Referenced::Yes) {
            self.axis.index();
        }
        self.searching = trace.referenced == Referenced::Searching;
    }

    fn step(&mut self, trace: &Trace) {
        let tick = self.axis.step(trace.sample);
        let record = &tick.output.record;
        let told = &mut self.verdict.told;
        if std::mem::replace(&mut self.fault, record.fault) != record.fault && self.fault != Fault::None {
            told.push((trace.tick, Telling::Fault(self.fault)));
        }
        let advised = std::mem::replace(&mut self.advisory, record.advisory) != record.advisory;
        if advised && self.advisory != Advisory::None {
            told.push((trace.tick, Telling::Advisory(self.advisory)));
        }
        let mut differ = differences(record, trace);
        if let Some(here) = tick.concluded {
            self.verdict.commissionings += 1;
            differ.extend(compare(self.outcomes.next(), trace.tick, here));
        }
        self.verdict.ticks += 1;
        self.verdict.difference =
            (!differ.is_empty()).then(|| Difference { tick: trace.tick, what: differ.join("; ") });
    }
}

fn differences(record: &Record, trace: &Trace) -> Vec<String> {
    let mut differ = Vec::new();
    if (record.bridge, record.duty) != (trace.bridge, trace.duty) {
        differ.push(format!(
            "bridge and duty {:?} {} on the chip, {:?} {} here",
            trace.bridge, trace.duty, record.bridge, record.duty
        ));
    }
    if digest(record) != trace.digest {
        differ.push("the telemetry record".into());
    }
    differ
}

fn consecutive(last: Option<u32>, tick: u32) -> Result<(), InputError> {
    match last {
        Some(last) if tick != last.wrapping_add(1) => Err(InputError(format!(
            "the log jumps from tick {last} to {tick}; a replay needs every control tick"
        ))),
        _ => Ok(()),
    }
}

/// Executes a command of the log, if it touches the axis.
fn execute(axis: &mut ServoAxis, command: &Command) -> Result<(), InputError> {
    if command.listens() {
        return Ok(());
    }
    Order::of(command)
        .and_then(|order| axis.execute(&order))
        .map_err(|reason| InputError(format!("the log holds a command that the library refuses: {reason:?}")))
}

fn compare(chip: Option<&(u32, Outcome)>, tick: u32, here: &Outcome) -> Option<String> {
    match chip {
        Some((at, chip)) if *at == tick && chip == here => None,
        Some((at, chip)) => {
            Some(format!("the commissioning ended at tick {at} with {chip:?}, here {here:?}"))
        }
        None => Some("a commissioning ended here that the chip has not reported".into()),
    }
}
