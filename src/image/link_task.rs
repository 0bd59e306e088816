//! The image's end of the link: bytes become orders for the control interrupt, its messages become frames.

use super::board::{Board, Line};
use super::tick::Telemetry;
use heapless::spsc::{Consumer, Producer};
use servo::link::inbox::{Inbox, Incoming, refusal};
use servo::link::order::Order;
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

/// The link's state between two runs.
pub struct Link<B: Board> {
    line: B::Line,
    inbox: Inbox,
    orders: Producer<'static, (u16, u8, Order)>,
    sequence: u16,
    /// The frame that is being written.
    frame: [u8; FRAME_CAPACITY],
}

impl<B: Board> Link<B> {
    /// The state at power-up: nothing sent, nothing received.
    pub fn new(line: B::Line, orders: Producer<'static, (u16, u8, Order)>) -> Self {
        Link { line, inbox: Inbox::new(), orders, sequence: 0, frame: [0; FRAME_CAPACITY] }
    }

    /// Takes bytes while there is a place for an order that they may complete, and for the answer to it.
    #[inline(never)]
    pub fn take_commands(&mut self) {
        for _ in 0..BYTES_AT_ONCE {
            if !self.orders.ready() || !self.has_room() {
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
    fn order(&mut self, to: u16, Request { axis, command }: &Request) {
        match unpack::<B>(command) {
            Ok(order) => {
                let _ = self.orders.enqueue((to, *axis, order));
            }
            Err(reason) => {
                let answer = refusal(to, reason);
                self.inbox.answered(&answer);
                self.send(&answer);
            }
        }
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

/// Builds the order that the control interrupt will carry out, if the board supports what it configures.
fn unpack<B: Board>(command: &Command) -> Result<Order, Refusal> {
    let order = Order::from_command(command)?;
    if let Order::Axis(axis) = &order {
        let protection = axis.protection();
        axis.configuration().map_or(Ok(()), |config| B::supports(config, protection))?;
    }
    Ok(order)
}
