//! What has arrived from the servo.

use super::{Captured, Done, Progress};
use crate::device::run_log::{Row, RunLog};
use servo::commission::Outcome;
use servo::identify::estimate::{Estimates, EstimatesReport};
use servo::link::protocol::Message;
use servo::protect::Fault;
use servo::record::Activity;

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

    /// Did the last `still` records show no motion? At the edge of a count the encoder of an axis at rest tells both of its sides.
    pub fn stands(&self, still: usize) -> bool {
        self.stands_within(still, 1)
    }

    /// Did they stay within so many counts of where it is now?
    pub fn stands_within(&self, still: usize, counts: i32) -> bool {
        let rows = &self.log.rows;
        let now = rows.last().map_or(0, |row| row.record.count);
        let mut recent = rows.iter().rev().take(still);
        rows.len() >= still && recent.all(|row| row.record.count.wrapping_sub(now).saturating_abs() <= counts)
    }

    /// What the axis was doing then.
    pub fn activity(&self) -> Activity {
        self.log.rows.last().map_or(Activity::Idle, |row| row.record.activity)
    }
}
