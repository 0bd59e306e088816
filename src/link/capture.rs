//! Pre-trigger capture: the last ticks before an event and the first after it, at full control rate.
//!
//! The control interrupt writes every tick into a ring of its own; nothing is decimated and nothing can be dropped. When
//! the trigger fires, recording goes on until the wanted share lies behind it, then the ring stands still until it is
//! read out and armed again.

use crate::protect::Fault;
pub use crate::record::Trigger;
use crate::record::{Activity, Limit, Record};
use crate::sample::Bridge;
use serde::{Deserialize, Serialize};

/// Ticks in the ring.
pub const LENGTH: usize = 1024;

impl Trigger {
    fn fires(self, before: &Shot, now: &Shot) -> bool {
        match self {
            Trigger::Now => true,
            Trigger::Fault => now.fault != Fault::None && before.fault == Fault::None,
            Trigger::Limit => now.limit != Limit::None && before.limit == Limit::None,
            Trigger::Activity(activity) => now.activity == activity && before.activity != activity,
        }
    }
}

/// One tick: eleven channels of the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shot {
    /// Encoder counter.
    pub count: i32,
    /// Set-point, counts relative to power-up, Q8, modulo 2²⁴ counts.
    pub reference_q8: i32,
    /// Speed estimate, counts per tick, Q20.
    pub speed_q20: i32,
    /// Duty that acts, PWM counts.
    pub duty: i16,
    /// Duty computed, PWM counts.
    pub command_duty: i16,
    /// Supply, converter counts.
    pub vbus_raw: u16,
    /// Winding current, converter counts.
    pub current_raw: i16,
    /// Bridge that acts.
    pub bridge: Bridge,
    /// What the axis does.
    pub activity: Activity,
    /// The limit that acts.
    pub limit: Limit,
    /// The latched fault.
    pub fault: Fault,
}

impl From<&Record> for Shot {
    fn from(record: &Record) -> Self {
        Shot {
            count: record.count,
            reference_q8: record.reference_q8,
            speed_q20: record.speed_q20,
            duty: record.duty,
            command_duty: record.command_duty,
            vbus_raw: record.vbus_raw,
            current_raw: record.current_raw,
            bridge: record.bridge,
            activity: record.activity,
            limit: record.limit,
            fault: record.fault,
        }
    }
}

/// Where the capture stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stage {
    /// Not armed.
    #[default]
    Off,
    /// Recording, the trigger has not fired.
    Waiting,
    /// The trigger has fired; some ticks are still to come.
    Finishing,
    /// Complete: standing still.
    Done,
}

/// The ring's memory, apart from its management so that it is all zeros at the start and takes no flash.
pub type Ring = [Shot; LENGTH];

/// All zeros.
#[allow(clippy::large_const_arrays, reason = "an initialiser: the image puts it into .bss once")]
pub const EMPTY: Ring = [Shot {
    count: 0,
    reference_q8: 0,
    speed_q20: 0,
    duty: 0,
    command_duty: 0,
    vbus_raw: 0,
    current_raw: 0,
    bridge: Bridge::Open,
    activity: Activity::Idle,
    limit: Limit::None,
    fault: Fault::None,
}; LENGTH];

/// The management of a ring.
#[derive(Debug)]
pub struct Capture<'a> {
    shots: &'a mut Ring,
    /// Place of the next tick; the oldest one when the ring is full.
    next: usize,
    filled: usize,
    stage: Stage,
    trigger: Trigger,
    /// Ticks wanted before the trigger.
    before: usize,
    /// Ticks still to come.
    left: usize,
    trigger_tick: u32,
    /// Its number among the ticks that can be read.
    trigger_index: usize,
}

/// What of a ring can be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Extent {
    /// Ticks.
    pub length: u16,
    /// Control tick at which the trigger fired.
    pub trigger_tick: u32,
    /// Its number among them, oldest 0.
    pub trigger_index: u16,
}

impl<'a> Capture<'a> {
    /// Not armed.
    pub const fn new(shots: &'a mut Ring) -> Self {
        Capture {
            shots,
            next: 0,
            filled: 0,
            stage: Stage::Off,
            trigger: Trigger::Now,
            before: 0,
            left: 0,
            trigger_tick: 0,
            trigger_index: 0,
        }
    }

    /// Starts anew. `before` of the [`LENGTH`] ticks shall lie before the trigger, fewer if it fires sooner.
    pub fn arm(&mut self, trigger: Trigger, before: u16) {
        self.trigger = trigger;
        self.before = usize::from(before).min(LENGTH - 1);
        (self.next, self.filled) = (0, 0);
        self.stage = Stage::Waiting;
    }

    /// Where it stands.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// What can be read.
    pub fn extent(&self) -> Extent {
        Extent {
            length: self.filled as u16,
            trigger_tick: self.trigger_tick,
            trigger_index: self.trigger_index as u16,
        }
    }

    /// Does it want the ticks that come?
    #[inline]
    #[must_use]
    pub fn records(&self) -> bool {
        !matches!(self.stage, Stage::Off | Stage::Done)
    }

    /// Takes one tick.
    #[inline]
    pub fn step(&mut self, tick: u32, record: &Record) {
        if self.records() {
            self.take(tick, record);
        }
    }

    #[inline(never)]
    fn take(&mut self, tick: u32, record: &Record) {
        let shot = Shot::from(record);
        let fires = self.stage == Stage::Waiting && self.trigger.fires(&self.newest().unwrap_or(shot), &shot);
        self.push(shot);
        if fires {
            self.stage = Stage::Finishing;
            self.trigger_tick = tick;
            // Older ticks than wanted give way to those still to come.
            self.filled = self.filled.min(self.before.wrapping_add(1));
            self.trigger_index = self.filled.wrapping_sub(1);
            self.left = LENGTH.wrapping_sub(self.filled);
        } else if self.stage == Stage::Finishing {
            self.left = self.left.saturating_sub(1);
        }
        if self.stage == Stage::Finishing && self.left == 0 {
            self.stage = Stage::Done;
        }
    }

    /// The tick with this number, oldest first.
    pub fn get(&self, index: usize) -> Option<Shot> {
        if index >= self.filled {
            return None;
        }
        let oldest = self.next.wrapping_add(LENGTH).wrapping_sub(self.filled);
        let place = oldest.wrapping_add(index) % LENGTH;
        self.shots.get(place).copied()
    }

    fn newest(&self) -> Option<Shot> {
        self.filled.checked_sub(1).and_then(|last| self.get(last))
    }

    fn push(&mut self, shot: Shot) {
        if let Some(place) = self.shots.get_mut(self.next) {
            *place = shot;
        }
        self.next = self.next.wrapping_add(1) % LENGTH;
        self.filled = self.filled.wrapping_add(1).min(LENGTH);
    }
}
