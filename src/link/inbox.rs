//! The servo's end of the link: which of the bytes that arrive are commands to execute.
//!
//! Every command carries a number. The next one in order is executed, once; a repeated number (the host missed the
//! answer) gets the same answer again, an older one is refused. So whatever the line does, no command acts twice.

use crate::link::protocol::{Frame, FrameError, Message, Receiver, Refusal, Request};

/// What to do with a complete frame.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub enum Incoming {
    /// New: execute, answer, and tell [`Inbox::answered`].
    Execute(u16, Request),
    /// Not to be executed: send this answer.
    Answer(Message),
    /// Nothing to say: not a frame of ours, whose sender cannot be told apart from noise, or a repeated command that
    /// is still being executed.
    Drop(Option<FrameError>),
}

/// Turns bytes into [`Incoming`]s.
#[derive(Clone, Debug, Default)]
pub struct Inbox {
    receiver: Receiver<Request>,
    last: Option<u16>,
    /// Its answer: tick and result.
    answer: Option<(u32, Result<(), Refusal>)>,
}

impl Inbox {
    /// Nothing received yet; the first command may carry any number.
    pub const fn new() -> Self {
        Inbox { receiver: Receiver::new(), last: None, answer: None }
    }

    /// Takes one byte.
    pub fn push(&mut self, byte: u8) -> Option<Incoming> {
        let incoming = match self.receiver.push(byte)? {
            Ok(frame) => self.sort(frame),
            Err(error) => Incoming::Drop(Some(error)),
        };
        Some(incoming)
    }

    /// Keeps the answer to the command that was executed last, to give it again.
    pub fn answered(&mut self, message: &Message) {
        if let Message::Answer { to, tick, result } = *message
            && Some(to) == self.last
        {
            self.answer = Some((tick, result));
        }
    }

    fn sort(&mut self, frame: Frame<Request>) -> Incoming {
        let ahead = self.last.map_or(1, |last| frame.sequence.wrapping_sub(last));
        match ahead {
            0 => self.answer.map_or(Incoming::Drop(None), |(tick, result)| {
                let to = frame.sequence;
                Incoming::Answer(Message::Answer { to, tick, result })
            }),
            // More than half of the circle ahead is behind.
            1..0x8000 => {
                self.last = Some(frame.sequence);
                self.answer = None;
                Incoming::Execute(frame.sequence, frame.body)
            }
            _ => {
                let expected = frame.sequence.wrapping_sub(ahead).wrapping_add(1);
                Incoming::Answer(refusal(frame.sequence, Refusal::Stale { expected }))
            }
        }
    }
}

/// The answer to a command that never reached the control interrupt.
pub const fn refusal(to: u16, reason: Refusal) -> Message {
    Message::Answer { to, tick: 0, result: Err(reason) }
}
