//! The image's end of the link: bytes become orders for the control interrupt, its messages become frames.

use super::board::{AXES, Board, Line};
use super::tick::{Parcel, Telemetry};
use heapless::spsc::{Consumer, Producer};
use servo::axis::servo_axis;
use servo::axis::track_sine::Units;
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
    /// With them orders are computed ahead; `None`: of an axis that is not configured.
    units: [Option<Units>; AXES],
    sequence: u16,
    /// The frame that is being written.
    frame: [u8; FRAME_CAPACITY],
}

impl<B: Board> Link<B> {
    /// The state at power-up: nothing sent, nothing received.
    pub fn new(line: B::Line, parcels: Parcels, units: [Option<Units>; AXES]) -> Self {
        Link { line, inbox: Inbox::new(), parcels, units, sequence: 0, frame: [0; FRAME_CAPACITY] }
    }

    /// Takes bytes while there is a place for an order that they may complete, and for the answer to it.
    #[inline(never)]
    pub fn take_commands(&mut self) {
        for _ in 0..BYTES_AT_ONCE {
            if !self.parcels.empty.ready() || !self.has_room() {
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
            Ok(order) => self.hand_over(to, *axis, order),
            Err(reason) => {
                let answer = refusal(to, reason);
                self.inbox.answered(&answer);
                self.send(&answer);
            }
        }
    }

    /// What an order needs besides the state of its axis is computed here.
    fn hand_over(&mut self, to: u16, axis: u8, mut order: Order) {
        if let Order::Axis(order) = &mut order
            && let Some(units) = self.units.get_mut(usize::from(axis))
        {
            ahead(order, units);
        }
        if let Some(parcel) = self.parcels.empty.dequeue() {
            *parcel = Parcel { to, axis, order };
            let _ = self.parcels.filled.enqueue(parcel);
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

/// Computes ahead what the units of the axis decide, and notes its units behind a configuration. If that is refused, the
/// axis has other units, and the tick computes anew.
fn ahead(order: &mut servo_axis::Order, units: &mut Option<Units>) {
    match order {
        servo_axis::Order::Install(axis, _) => *units = Some(Units::of(axis.scale())),
        servo_axis::Order::Run(command) => units.iter().for_each(|units| command.ahead(units)),
        servo_axis::Order::Reset => {}
    }
}
