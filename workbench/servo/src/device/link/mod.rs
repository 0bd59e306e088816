//! The host's end of the link: commands out, answers and telemetry in, whatever carries the bytes.

mod epoch;
mod lockstep;
mod serial;
mod words;

pub use lockstep::Lockstep;
pub use serial::Serial;
pub use words::{
    advice, advisory_text, current_text, fault_advice, found_text, named, range_text, refusal_text,
    scale_text, store_text,
};

use epoch::Epoch;
use servo::link::board::Board;
use servo::link::protocol::{
    Command, FRAME_CAPACITY, Message, Receiver, Refusal, Request, ResetCause, encode,
};
use servo::store::{AxisParameters, Found, StoreEvent};
use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};
use truing_core::text::input_error::InputError;
use truing_report::console::interrupt;

/// Answers come within a few ticks; after so many turns, and so long, there is nobody.
const PATIENT_TURNS: u32 = 2_000;
const PATIENCE: Duration = Duration::from_secs(3);
/// The same when the servo is to stop before the program ends.
const LAST_PATIENCE: Duration = Duration::from_secs(1);
/// Behind a stop: the bridge is open, and the motor has seen it, after so many control ticks,
const TICKS_OF_PARTING: u32 = 4;
/// of which the telemetry has arrived after so long.
const LONGEST_PARTING: Duration = Duration::from_millis(500);
/// Between two attempts to store, while the shaft comes to rest, or to arm, while the zero of the current is looked for.
const TURNS_OF_REST: u32 = 20;
/// The servo looks for the zero of its current sensor for 4.1 s at the slowest control rate.
const LONGEST_ZERO: Duration = Duration::from_secs(6);
/// A servo on trial that hears nothing for so long, s, has lost its host: no commissioning and no coast-down is longer.
const SILENCE_S: u32 = 60;
/// An erase of the slowest kind takes 4 s.
const LONGEST_SAVE: Duration = Duration::from_secs(6);

/// Takes the messages that arrive.
pub type Sink<'a> = dyn FnMut(Message) + 'a;

/// The tick in which a command was judged, and how.
type Answer = (u32, Result<(), Refusal>);

/// Carries bytes to the servo and back.
pub trait Wire {
    /// One turn: takes what it can of `outgoing`, adds what has arrived to `incoming`. In lock-step a turn is one
    /// control tick; on a real line it is a short wait.
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError>;

    /// Number before that of the first command. Behind a line that outlives its clients it must be one that the last
    /// client is unlikely to have used, or an old answer would be taken for a new one.
    fn first_number(&self) -> u16 {
        0
    }

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

/// How a servo introduces itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hello {
    /// Axes of its image.
    pub axes: u8,
    /// Why it has started.
    pub cause: ResetCause,
    /// What it has found in its store.
    pub stored: Found,
    /// Its board.
    pub board: Board,
}

/// A servo at the other end of a [`Wire`].
pub struct Client {
    wire: Box<dyn Wire>,
    receiver: Receiver<Message>,
    axis: u8,
    sequence: u16,
    outgoing: Vec<u8>,
    incoming: Vec<u8>,
    epoch: Epoch,
    /// As it introduced itself last.
    board: Option<Board>,
    /// The wire carries nothing any more.
    lost: bool,
    /// It is being stopped: an interruption is heeded already.
    parting: bool,
}

impl Client {
    /// Nothing is sent yet.
    pub fn new(wire: Box<dyn Wire>) -> Self {
        Self {
            sequence: wire.first_number(),
            wire,
            receiver: Receiver::new(),
            axis: 0,
            outgoing: Vec::new(),
            incoming: Vec::new(),
            epoch: Epoch::default(),
            board: None,
            lost: false,
            parting: false,
        }
    }

    /// One turn of the wire; every message goes to `sink`. None if the user has interrupted the session.
    pub fn turn(&mut self, sink: &mut Sink) -> Result<(), InputError> {
        if interrupt::asked() && !self.parting {
            return Err(InputError("interrupted".into()));
        }
        let turned = self.wire.turn(&mut self.outgoing, &mut self.incoming);
        turned.inspect_err(|_| self.lost = true)?;
        for byte in self.incoming.drain(..) {
            // A damaged frame is none.
            let Some(Ok(frame)) = self.receiver.push(byte) else { continue };
            if let Message::Hello { board, .. } = &frame.body {
                self.board = Some(*board);
            }
            sink(self.epoch.rebase(frame.body));
        }
        Ok(())
    }

    /// The axis that commands are for from now on. Messages of all axes arrive.
    pub fn select(&mut self, axis: u8) {
        self.axis = axis;
    }

    /// Sends a command and waits for its answer: the control tick in which it acted. A servo that has just been switched on
    /// needs a moment until it knows the zero of its current sensor.
    pub fn command(&mut self, command: Command, sink: &mut Sink) -> Result<u32, InputError> {
        let sought = Refusal::CurrentZeroSought;
        self.patiently(command, sought, LONGEST_ZERO, sink)
    }

    /// Sends a command again while it is refused for a reason that passes, but no longer than so long.
    fn patiently(
        &mut self,
        command: Command,
        passing: Refusal,
        longest: Duration,
        sink: &mut Sink,
    ) -> Result<u32, InputError> {
        let patience = Instant::now() + longest;
        loop {
            match self.request(command, sink)? {
                (tick, Ok(())) => return Ok(tick),
                (_, Err(reason)) if reason != passing || Instant::now() >= patience => {
                    return Err(InputError(refusal_text(&reason)));
                }
                _ => (0..TURNS_OF_REST).try_for_each(|_| self.turn(sink))?,
            }
        }
    }

    /// Sends a command and waits for its answer. A servo that has counted farther with another client is followed.
    fn request(&mut self, command: Command, sink: &mut Sink) -> Result<Answer, InputError> {
        match self.exchange(command, sink)? {
            (_, Err(Refusal::Stale { expected })) => {
                self.sequence = expected.wrapping_sub(1);
                self.exchange(command, sink)
            }
            answer => Ok(answer),
        }
    }

    fn exchange(&mut self, command: Command, sink: &mut Sink) -> Result<Answer, InputError> {
        self.sequence = self.sequence.wrapping_add(1);
        let number = self.sequence;
        let mut buffer = [0; FRAME_CAPACITY];
        let request = Request { axis: self.axis, command };
        let bytes =
            encode(number, request, &mut buffer).map_err(|_| InputError("a command is too long".into()))?;
        self.outgoing.extend_from_slice(bytes);
        let (patience, patient_turns) =
            if self.parting { (LAST_PATIENCE, 0) } else { (PATIENCE, PATIENT_TURNS) };
        let deadline = Instant::now() + patience;
        let (mut turns, mut answer) = (0, None);
        loop {
            self.turn(&mut |message| match message {
                Message::Answer { to, tick, result } if to == number => answer = Some((tick, result)),
                other => sink(other),
            })?;
            if let Some(answer) = answer {
                return Ok(answer);
            }
            turns += 1;
            if turns > patient_turns && Instant::now() > deadline {
                let what =
                    "the servo does not answer; check port, wiring and that the firmware speaks this version";
                return Err(InputError(what.into()));
            }
        }
    }

    /// What comes into force on an axis of this control rate is on trial from now on: a servo that hears nothing for a minute starts
    /// anew with what it has stored. 0: no longer, and an interruption does not keep it from that.
    pub fn trial(&mut self, tick_hz: u32) -> Result<(), InputError> {
        self.parting |= tick_hz == 0;
        self.command(Command::OnTrial(SILENCE_S * tick_hz), &mut |_| {}).map(|_| ())
    }

    /// The last command of a session that ends early: stop. The control tick in which it acted; `None`: the wire carries
    /// nothing any more, or the servo does not answer.
    pub fn stop(&mut self, sink: &mut Sink) -> Option<u32> {
        if self.lost {
            return None;
        }
        self.parting = true;
        let tick = self.command(Command::Stop, sink).ok()?;
        // An answer is no open bridge yet; the log is to show it.
        let deadline = Instant::now() + LONGEST_PARTING;
        let shown = Cell::new(false);
        let mut heed = |message| {
            if let Message::Telemetry { tick: now, .. } = &message {
                shown.set(shown.get() || *now >= tick.saturating_add(TICKS_OF_PARTING));
            }
            sink(message);
        };
        while !shown.get() && Instant::now() < deadline && self.turn(&mut heed).is_ok() {}
        Some(tick)
    }

    /// A command whose answer brings a message of its own; the message. All others go to `sink`.
    pub fn ask<T>(
        &mut self,
        command: Command,
        sink: &mut Sink,
        pick: impl Fn(&Message) -> Option<T>,
    ) -> Result<T, InputError> {
        let found = RefCell::new(None);
        let mut heed = |message| match pick(&message) {
            Some(picked) => _ = found.borrow_mut().get_or_insert(picked),
            None => sink(message),
        };
        self.command(command, &mut heed)?;
        let mut turns = 0;
        while found.borrow().is_none() && turns < PATIENT_TURNS {
            self.turn(&mut heed)?;
            turns += 1;
        }
        let untold = || InputError("the servo has not told what it was asked; update its firmware".into());
        found.into_inner().ok_or_else(untold)
    }

    /// Number of axes, cause of the last start, and what the store holds.
    pub fn hello(&mut self) -> Result<Hello, InputError> {
        self.introduced(&mut |_| {})
    }

    fn introduced(&mut self, sink: &mut Sink) -> Result<Hello, InputError> {
        self.ask(Command::Hello, sink, |message| match *message {
            Message::Hello { axes, cause, stored, board } => Some(Hello { axes, cause, stored, board }),
            _ => None,
        })
    }

    /// The board: as it introduced itself at power-up, or when asked. All other messages go to `sink`.
    pub fn board(&mut self, sink: &mut Sink) -> Result<Board, InputError> {
        match self.board {
            Some(board) => Ok(board),
            None => Ok(self.introduced(sink)?.board),
        }
    }

    /// What is in force on the selected axis; `None`: it is not configured.
    pub fn parameters(&mut self) -> Result<Option<AxisParameters>, InputError> {
        self.parameters_heeding(&mut |_| {})
    }

    /// The same; messages that arrive meanwhile go to `sink`.
    pub fn parameters_heeding(&mut self, sink: &mut Sink) -> Result<Option<AxisParameters>, InputError> {
        let selected = self.axis;
        self.ask(Command::Parameters, sink, |message| match *message {
            Message::Parameters { axis, parameters } if axis == selected => Some(parameters),
            _ => None,
        })
    }

    /// Stores what is in force on all axes. Messages that arrive meanwhile go to `sink`: the announcement of an erase, and
    /// the telemetry, for the control tick goes on. A servo that has just been configured needs a moment until it knows that
    /// its shafts stand.
    pub fn save(&mut self, sink: &mut Sink) -> Result<(), InputError> {
        let end = Cell::new(None);
        let mut heed = |message| match message {
            Message::Store(event @ (StoreEvent::Saved | StoreEvent::Failed(_))) => end.set(Some(event)),
            other => sink(other),
        };
        self.patiently(Command::Save, Refusal::NotAtRest, PATIENCE, &mut heed)?;
        let deadline = Instant::now() + LONGEST_SAVE;
        let mut turns = 0;
        while end.get().is_none() && (turns < PATIENT_TURNS || Instant::now() < deadline) {
            self.turn(&mut heed)?;
            turns += 1;
        }
        match end.get() {
            Some(StoreEvent::Saved) => Ok(()),
            Some(event) => Err(InputError(store_text(event))),
            None => Err(InputError("the servo does not tell whether it has stored its parameters".into())),
        }
    }

    /// Ends the connection.
    pub fn close(mut self) -> Farewell {
        self.wire.close()
    }
}
