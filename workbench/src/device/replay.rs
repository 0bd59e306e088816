//! Same code, same bits: the chip's raw integers and commands of every tick, run through the library on the host.
//!
//! What only the image saw (enable contact, bridge driver, tick overrun, watchdog, damaged parameters) is in no sample:
//! where the log holds a fault of that kind, the notice behind it is given again. One that came while another fault was
//! latched has left no trace.

use crate::console::input_error::InputError;
use crate::device::link::{advisory_text, fault_advice};
use crate::device::run_log::{Tape, digest};
use servo::axis::servo_axis::{Joint, Order};
use servo::commission::Outcome;
use servo::link::protocol::Command;
use servo::motion::referencing::Referenced;
use servo::protect::{Fault, Notice};
use servo::record::Advisory;
use std::fmt;

/// How a replay ended.
#[derive(Clone, Debug, PartialEq, Eq)]
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
            Some(difference) => write!(
                f,
                "chip and host differ from tick {} on: {}",
                difference.tick, difference.what
            ),
        }
    }
}

/// Runs the tape through the library. Records and estimates are compared in every bit.
pub fn replay(tape: &Tape) -> Result<Verdict, InputError> {
    let mut verdict = Verdict {
        ticks: 0,
        commands: 0,
        commissionings: 0,
        told: Vec::new(),
        difference: None,
    };
    let mut joint = Joint::new();
    let mut commands = tape.commands.iter().peekable();
    let mut outcomes = tape.outcomes.iter();
    let (mut last, mut fault, mut advisory) = (None, Fault::None, Advisory::None);
    let mut searching = false;
    for trace in &tape.traces {
        consecutive(last.replace(trace.tick), trace.tick)?;
        while let Some((_, command)) = commands.next_if(|(tick, _)| *tick <= trace.tick) {
            execute(&mut joint, command)?;
            verdict.commands += 1;
        }
        if let Some(notice) = Notice::behind(trace.fault) {
            joint.heed(notice);
        }
        // The index is in no sample either; a search heeds it in the tick in which it ends, and no other tick does.
        if (searching, trace.referenced) == (true, Referenced::Yes) {
            joint.index();
        }
        searching = trace.referenced == Referenced::Searching;
        let tick = joint.step(trace.sample);
        let record = &tick.output.record;
        if std::mem::replace(&mut fault, record.fault) != record.fault && fault != Fault::None {
            verdict.told.push((trace.tick, Telling::Fault(fault)));
        }
        if std::mem::replace(&mut advisory, record.advisory) != record.advisory && advisory != Advisory::None
        {
            verdict.told.push((trace.tick, Telling::Advisory(advisory)));
        }
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
        if let Some(here) = tick.concluded {
            verdict.commissionings += 1;
            differ.extend(compare(outcomes.next(), trace.tick, here));
        }
        verdict.ticks += 1;
        if !differ.is_empty() {
            verdict.difference = Some(Difference {
                tick: trace.tick,
                what: differ.join("; "),
            });
            break;
        }
    }
    Ok(verdict)
}

fn consecutive(last: Option<u32>, tick: u32) -> Result<(), InputError> {
    match last {
        Some(last) if tick != last.wrapping_add(1) => Err(InputError(format!(
            "the log jumps from tick {last} to {tick}; a replay needs every control tick"
        ))),
        _ => Ok(()),
    }
}

fn execute(joint: &mut Joint, command: &Command) -> Result<(), InputError> {
    // Telemetry and capture listen to the joint and do not touch it.
    if let Command::Subscribe { .. }
    | Command::CaptureArm { .. }
    | Command::CaptureRead { .. }
    | Command::Hello
    | Command::Parameters
    | Command::Save = command
    {
        return Ok(());
    }
    Order::from_command(command)
        .and_then(|order| joint.execute(&order))
        .map_err(|reason| {
            InputError(format!(
                "the log holds a command that the library refuses: {reason:?}"
            ))
        })
}

fn compare(chip: Option<&(u32, Outcome)>, tick: u32, here: &Outcome) -> Option<String> {
    match chip {
        Some((at, chip)) if *at == tick && chip == here => None,
        Some((at, chip)) => Some(format!(
            "the commissioning ended at tick {at} with {chip:?}, here {here:?}"
        )),
        None => Some("a commissioning ended here that the chip has not reported".into()),
    }
}
