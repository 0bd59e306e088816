//! What has arrived from the servo.

use super::{Captured, Done, Progress};
use crate::device::run_log::{Row, RunLog};
use servo::commission::Outcome;
use servo::identify::estimate::{Estimates, EstimatesReport};
use servo::link::protocol::Message;
use servo::protect::Fault;
use servo::record::Activity;

/// An axis that moves no more than these counts stands.
const STILL_COUNTS: i32 = 1;

/// What has arrived.
pub struct Kept {
    pub(super) axis: u8,
    /// Every record.
    pub log: RunLog,
    pub(super) ended: Option<Outcome>,
    pub(super) captured: Option<Captured>,
    pub(super) estimates: Option<EstimatesReport>,
    /// The same in the servo's own units; nothing at first.
    pub(super) known: Estimates,
    /// The last fault that any telemetry has told, before the first configuration too.
    pub(super) fault: Fault,
}

impl Kept {
    pub(super) fn take(&mut self, message: Message) {
        if message.axis().is_some_and(|axis| axis != self.axis) {
            return;
        }
        if let Message::Telemetry { record, .. } = &message {
            self.fault = record.fault;
        }
        match message {
            // Before its configuration an axis has no version.
            Message::Telemetry { tick, cost, record, .. } if record.version != 0 => {
                self.log.rows.push(Row { tick, cost, motor_flags: 0, record });
            }
            Message::Commissioned { tick, outcome, .. } => {
                self.log.outcomes.push((tick, outcome));
                self.ended = Some(outcome);
                self.learn(&outcome.estimates);
            }
            Message::Parameters { parameters: Some(parameters), .. } => self.learn(&parameters.estimates),
            Message::Captured { stage, extent, shots, .. } => {
                let captured = self.captured.get_or_insert_default();
                (captured.stage, captured.extent) = (stage, extent);
                captured.shots.extend(shots);
            }
            _ => {}
        }
    }

    pub(super) fn learn(&mut self, estimates: &Estimates) {
        self.known = *estimates;
        self.estimates = self.log.config.build().ok().map(|scale| estimates.report(&scale));
    }

    /// How far the session is, with all that has arrived.
    pub fn progress<'a>(&'a self, task: &'a str, share: f64, done: Option<&'a Done>) -> Progress<'a> {
        Progress { log: &self.log, task, share, estimates: self.estimates.as_ref(), done }
    }

    /// The last tick.
    pub fn now(&self) -> u32 {
        self.log.rows.last().map_or(0, |row| row.tick)
    }

    /// Did the last `still` records show no motion?
    pub fn stands(&self, still: usize) -> bool {
        let rows = &self.log.rows;
        let recent = rows.iter().rev().take(still).map(|row| row.record.count);
        rows.len() >= still && spread(recent) <= STILL_COUNTS
    }

    /// What the axis was doing then.
    pub fn activity(&self) -> Activity {
        self.log.rows.last().map_or(Activity::Idle, |row| row.record.activity)
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
