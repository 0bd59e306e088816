//! The host's end of the link: commands out, answers and telemetry in, whatever carries the bytes.

mod lockstep;
mod serial;
mod words;

pub use lockstep::Lockstep;
pub use serial::Serial;
pub use words::{advice, advisory_text, fault_advice, refusal_text};

use crate::input_error::InputError;
use servo::protocol::{Command, FRAME_CAPACITY, Message, Receiver, encode};
use std::time::{Duration, Instant};

/// Answers come within a few ticks; after so many turns, and so long, there is nobody.
const PATIENT_TURNS: u32 = 2_000;
const PATIENCE: Duration = Duration::from_secs(3);

/// Carries bytes to the servo and back.
pub trait Wire {
    /// One turn: takes what it can of `outgoing`, adds what has arrived to `incoming`. In lock-step a turn is one
    /// control tick; on a real line it is a short wait.
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError>;

    /// Ends the connection.
    fn close(&mut self) -> Farewell {
        Farewell::default()
    }
}

/// What is known when a connection has ended, as far as the wire carries it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Farewell {
    /// The firmware's own log.
    pub firmware_log: Vec<String>,
    /// The motor's flags before each control tick since power-up.
    pub motor_flags: Vec<u32>,
}

/// A servo at the other end of a [`Wire`].
pub struct Client {
    wire: Box<dyn Wire>,
    receiver: Receiver<Message>,
    sequence: u16,
    outgoing: Vec<u8>,
    incoming: Vec<u8>,
    damaged: u64,
}

impl Client {
    /// Nothing is sent yet.
    pub fn new(wire: Box<dyn Wire>) -> Self {
        Self {
            wire,
            receiver: Receiver::new(),
            sequence: 0,
            outgoing: Vec::new(),
            incoming: Vec::new(),
            damaged: 0,
        }
    }

    /// One turn of the wire; every message goes to `sink`.
    pub fn turn(&mut self, sink: &mut dyn FnMut(Message)) -> Result<(), InputError> {
        self.wire.turn(&mut self.outgoing, &mut self.incoming)?;
        for byte in self.incoming.drain(..) {
            match self.receiver.push(byte) {
                Some(Ok(frame)) => sink(frame.body),
                Some(Err(_)) => self.damaged += 1,
                None => {}
            }
        }
        Ok(())
    }

    /// Sends a command and waits for its answer: the control tick in which it acted.
    pub fn command(&mut self, command: Command, sink: &mut dyn FnMut(Message)) -> Result<u32, InputError> {
        self.sequence = self.sequence.wrapping_add(1);
        let number = self.sequence;
        let mut buffer = [0; FRAME_CAPACITY];
        let bytes =
            encode(number, command, &mut buffer).map_err(|_| InputError("a command is too long".into()))?;
        self.outgoing.extend_from_slice(bytes);
        let deadline = Instant::now() + PATIENCE;
        let (mut turns, mut answer) = (0, None);
        while answer.is_none() {
            self.turn(&mut |message| match message {
                Message::Answer { to, tick, result } if to == number => answer = Some((tick, result)),
                other => sink(other),
            })?;
            turns += 1;
            if turns > PATIENT_TURNS && Instant::now() > deadline {
                return Err(InputError(
                    "the servo does not answer; check port, wiring and that the firmware speaks this version"
                        .into(),
                ));
            }
        }
        match answer {
            Some((tick, Ok(()))) => Ok(tick),
            Some((_, Err(reason))) => Err(InputError(refusal_text(&reason))),
            None => unreachable!("the loop ends with an answer"),
        }
    }

    /// Frames that arrived damaged.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// Ends the connection.
    pub fn close(mut self) -> Farewell {
        self.wire.close()
    }
}
