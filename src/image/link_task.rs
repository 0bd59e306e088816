//! The image's end of the link: bytes become orders for the control interrupt, its messages become frames.

use super::board::{AXES, Board, Line};
use super::tick::{Parcel, Telemetry};
use fast_tick::constants::{self, Constants, NoPlace};
use heapless::spsc::{Consumer, Producer};
use servo::axis::Axis;
use servo::axis::servo_axis::Order;
use servo::link::in_force::InForce;
use servo::link::inbox::{Inbox, Incoming, refusal};
use servo::link::protocol::{Command, FRAME_CAPACITY, Message, Refusal, Request, encode};

/// Bytes that one run takes from the line. The rest waits for the next tick.
const BYTES_AT_ONCE: usize = 2 * FRAME_CAPACITY;

/// What the link task owns.
pub struct LinkTask<B: Board> {
    link: Link<B>,
    answers: Consumer<'static, Message>,
    records: Consumer<'static, Telemetry>,
}

impl<B: Board> LinkTask<B> {
    /// Puts the parts together.
    pub fn new(
        link: Link<B>,
        answers: Consumer<'static, Message>,
        records: Consumer<'static, Telemetry>,
    ) -> Self {
        LinkTask { link, answers, records }
    }

    /// Takes bytes in and sends frames out. To be run after every tick and when a byte arrives.
    pub fn run(&mut self) {
        self.link.take_commands();
        self.link.forward(&mut self.answers);
        self.link.forward(&mut self.records);
    }
}

/// The link's ends of the two queues in which a [`Parcel`] goes round.
pub struct Parcels {
    /// From the control interrupt, to be filled.
    pub empty: Consumer<'static, &'static mut Parcel>,
    /// Filled, to it.
    pub filled: Producer<'static, &'static mut Parcel>,
}

/// The link's state between two runs.
pub struct Link<B: Board> {
    line: B::Line,
    inbox: Inbox,
    parcels: Parcels,
    /// The place for the next order, when it is back and how the last one ended is noted.
    parcel: Option<&'static mut Parcel>,
    /// With it orders are prepared. No order is under way when the next one is made, so the control interrupt has the same.
    in_force: InForce<Constants, AXES>,
    sequence: u16,
    /// The frame that is being written.
    frame: [u8; FRAME_CAPACITY],
}

impl<B: Board> Link<B> {
    /// The state at power-up: nothing sent, nothing received.
    pub fn new(line: B::Line, parcels: Parcels, in_force: InForce<Constants, AXES>) -> Self {
        Link {
            line,
            inbox: Inbox::new(),
            parcels,
            parcel: None,
            in_force,
            sequence: 0,
            frame: [0; FRAME_CAPACITY],
        }
    }

    /// Takes bytes while there is a place for an order that they may complete, and for the answer to it.
    #[inline(never)]
    pub fn take_commands(&mut self) {
        for _ in 0..BYTES_AT_ONCE {
            if !self.has_parcel() || !self.has_room() {
                return;
            }
            let Some(byte) = self.line.read() else { return };
            if let Some(incoming) = self.hear(byte) {
                self.handle(&incoming);
            }
        }
    }

    /// Takes one byte. This is a function of its own so that its stack is free again when the request is handled.
    #[inline(never)]
    fn hear(&mut self, byte: u8) -> Option<Incoming> {
        self.inbox.push(byte)
    }

    /// Sends the messages that wait, as far as the line has room.
    #[inline(never)]
    pub fn forward(&mut self, messages: &mut Consumer<'static, impl Into<Message>>) {
        while self.has_room()
            && let Some(message) = messages.dequeue()
        {
            let message = message.into();
            self.inbox.answered(&message);
            self.send(&message);
        }
    }

    fn handle(&mut self, incoming: &Incoming) {
        match incoming {
            Incoming::Execute(to, request) => self.order(*to, request),
            Incoming::Answer(answer) => self.send(answer),
            Incoming::Drop(_) => defmt::debug!("frame dropped"),
        }
    }

    #[inline(never)]
    fn order(&mut self, to: u16, request: &Request) {
        match self.in_force.prepare(request, supports::<B>, place) {
            Ok(order) => {
                if let Some(parcel) = self.parcel.take() {
                    *parcel = Parcel { to, axis: request.axis, order, done: false };
                    let _ = self.parcels.filled.enqueue(parcel);
                }
            }
            Err(reason) => {
                let answer = refusal(to, reason);
                self.inbox.answered(&answer);
                self.send(&answer);
            }
        }
    }

    /// Is the place for the next order here? When it comes back, what is in force is noted, and constants that are not are let go.
    fn has_parcel(&mut self) -> bool {
        if self.parcel.is_none()
            && let Some(parcel) = self.parcels.empty.dequeue()
        {
            if parcel.done {
                self.in_force.note(parcel.axis, &parcel.order);
            }
            parcel.order = Order::Run(Command::Hello);
            self.parcel = Some(parcel);
        }
        self.parcel.is_some()
    }

    fn send(&mut self, message: &Message) {
        self.sequence = self.sequence.wrapping_add(1);
        if let Ok(bytes) = encode(self.sequence, message, &mut self.frame) {
            self.line.write(bytes);
        }
    }

    fn has_room(&mut self) -> bool {
        self.line.room() >= FRAME_CAPACITY
    }
}

/// Asks the board.
fn supports<B: Board>(axis: &Axis) -> Result<(), Refusal> {
    B::supports(&axis.scale().config, Some(axis.protection()))
}

/// There is a place for these constants: one for every axis, and one more, which is free when no order is under way.
fn place(constants: Axis) -> Result<Constants, Refusal> {
    constants::put(constants).map_err(|NoPlace| Refusal::Busy)
}
