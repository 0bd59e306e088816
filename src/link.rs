//! The servo's end of the link: which of the bytes that arrive are commands to execute.
//!
//! Every command carries a number. The next one in order is executed, once; a repeated number (the host missed the
//! answer) gets the same answer again, an older one is refused. So whatever the line does, no command acts twice.

use crate::protocol::{Command, Frame, FrameError, Receiver, Refusal};

/// What to do with a complete frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Incoming {
    /// New: execute and answer.
    Execute(u16, Command),
    /// Already executed: give its answer again.
    Repeat(u16),
    /// Older than that: answer with this refusal.
    Refuse(u16, Refusal),
    /// Not a frame of ours: not answered, since the sender cannot be told apart from noise.
    Drop(FrameError),
}

/// Turns bytes into [`Incoming`]s.
#[derive(Clone, Debug, Default)]
pub struct Inbox {
    receiver: Receiver<Command>,
    last: Option<u16>,
}

impl Inbox {
    /// Nothing received yet; the first command may carry any number.
    pub const fn new() -> Self {
        Inbox {
            receiver: Receiver::new(),
            last: None,
        }
    }

    /// Takes one byte.
    pub fn push(&mut self, byte: u8) -> Option<Incoming> {
        let incoming = match self.receiver.push(byte)? {
            Ok(frame) => self.sort(frame),
            Err(error) => Incoming::Drop(error),
        };
        Some(incoming)
    }

    fn sort(&mut self, frame: Frame<Command>) -> Incoming {
        let ahead = self.last.map_or(1, |last| frame.sequence.wrapping_sub(last));
        match ahead {
            0 => Incoming::Repeat(frame.sequence),
            // More than half of the circle ahead is behind.
            1..0x8000 => {
                self.last = Some(frame.sequence);
                Incoming::Execute(frame.sequence, frame.body)
            }
            _ => {
                let expected = frame.sequence.wrapping_sub(ahead).wrapping_add(1);
                Incoming::Refuse(frame.sequence, Refusal::Stale { expected })
            }
        }
    }
}
