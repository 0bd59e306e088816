//! What there is to tell about an axis.

use super::state::{Listener, Mode, Seen, State};
use crate::commission::{self, Outcome};
use crate::identify::estimate::Estimates;
use crate::protect::Fault;
use crate::record::Referenced;
use crate::record::{self, Activity, Advisory, Record};

impl State {
    /// All that is known of the motor now, with trust and reasons.
    #[must_use]
    pub fn estimates(&self) -> &Estimates {
        &self.known
    }

    /// How the last commissioning ended; `None` before the first, and while one is running.
    #[must_use]
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// What the axis is doing.
    #[must_use]
    pub fn activity(&self) -> Activity {
        match self.mode {
            _ if self.protect.fault() != Fault::None => Activity::Faulted,
            Mode::Idle | Mode::Brake => Activity::Idle,
            Mode::Commission(_) => Activity::Commissioning,
            Mode::Sine(_) | Mode::Move(_) | Mode::Cruise(_) | Mode::Stream(_) | Mode::Halt(_) => {
                Activity::Tracking
            }
            Mode::Hold(_) => Activity::Holding,
            Mode::Drive(_) | Mode::Excite(_) => Activity::Driving,
        }
    }

    /// The latched fault.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.protect.fault()
    }

    /// What the last tick saw, thought and did. Put together when somebody asks: in most ticks nobody does.
    #[must_use]
    #[inline(never)]
    pub fn record(&self) -> Record {
        let zero = self.zero.unwrap_or(0);
        let Seen { sample, acting, command } = &self.seen;
        Record {
            version: record::VERSION,
            tick: self.tick,
            count: sample.count,
            vbus_raw: sample.vbus_raw,
            current_raw: sample.current_raw,
            bridge: acting.bridge,
            duty: acting.duty,
            command_bridge: command.bridge,
            command_duty: command.duty,
            reference_q8: self.reference.position.relative_q8(zero),
            reference_speed_q20: self.reference.speed.0,
            speed_q20: self.encoder.speed().0,
            activity: self.activity(),
            phase: self.phase() as u8,
            limit: self.limit,
            fault: self.protect.fault(),
            gain_source: self.design.gain_source,
            dead_zone_source: self.design.dead_zone_source,
            compensation: self.compensation,
            advisory: self.advisory(),
            referenced: self.referenced(),
        }
    }

    fn referenced(&self) -> Referenced {
        match (&self.search, self.missed, self.datum) {
            (Some(_), _, _) => Referenced::Searching,
            (None, true, _) => Referenced::Missed,
            (None, false, Some(_)) => Referenced::Yes,
            (None, false, None) => Referenced::No,
        }
    }

    /// Phase of the commissioning: of the running one, or how the last one ended.
    fn phase(&self) -> commission::Phase {
        use commission::Phase;
        match (self.commissioning(), &self.outcome) {
            (Some(commissioning), _) => commissioning.phase(),
            (None, Some(outcome)) if outcome.refused.is_some() => Phase::Refused,
            (None, Some(_)) => Phase::Done,
            (None, None) => Phase::Idle,
        }
    }

    /// What should be looked at, though nothing is wrong.
    fn advisory(&self) -> Advisory {
        match &self.listener {
            _ if self.dry => Advisory::StreamRanDry,
            _ if self.load.waits() => Advisory::PositionLoadOff,
            Listener::Passive(passive) => match passive.worn() {
                [false, false] => Advisory::None,
                _ => Advisory::DeadZoneMoved,
            },
            Listener::None | Listener::Start(_) | Listener::Commissioning(_) => Advisory::None,
        }
    }
}
