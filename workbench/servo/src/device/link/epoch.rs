//! Ticks of the servo as ticks of a session that does not live to see them wrap.

use servo::link::protocol::Message;

/// What a servo may tell out of order, ticks: an answer overtakes the records before it.
const DISORDER: u32 = 1 << 16;

/// A servo counts its ticks in 32 bits: they wrap after 5 days at 10 kHz. A session that meets a servo in the second half of
/// that time counts from its own beginning, so it has as long again before it; any other keeps the servo's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Epoch(Option<u32>);

impl Epoch {
    /// The message with its ticks on the session's own count.
    pub fn rebase(&mut self, mut message: Message) -> Message {
        match &mut message {
            Message::Answer { tick, .. }
            | Message::Telemetry { tick, .. }
            | Message::Commissioned { tick, .. } => *tick = self.since(*tick),
            Message::Captured { extent, .. } if self.0.is_some() => {
                extent.trigger_tick = self.since(extent.trigger_tick);
            }
            _ => {}
        }
        message
    }

    fn since(&mut self, tick: u32) -> u32 {
        let begin = match tick {
            0..=0x7FFF_FFFF => 0,
            late => late - DISORDER,
        };
        tick.wrapping_sub(*self.0.get_or_insert(begin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(told: &[u32]) -> Vec<u32> {
        let mut epoch = Epoch::default();
        told.iter()
            .map(|&tick| match epoch.rebase(Message::Answer { to: 0, tick, result: Ok(()) }) {
                Message::Answer { tick, .. } => tick,
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn a_young_servo_keeps_its_own_ticks() {
        assert_eq!(ticks(&[7, 8, 2_000_000_000, 3_000_000_000]), [7, 8, 2_000_000_000, 3_000_000_000]);
    }

    #[test]
    fn a_session_across_the_wrap_of_the_tick_counter_goes_on_counting() {
        assert_eq!(
            ticks(&[u32::MAX - 1, u32::MAX - 3, 0, 1_000]),
            [DISORDER, DISORDER - 2, DISORDER + 2, DISORDER + 1_002]
        );
    }
}
