//! The image's control tick: at most one order, one step of the joint, one record.

use crate::board;
use heapless::spsc::{Consumer, Producer};
use servo::capture::{Capture, Ring};
use servo::joint::{Joint, Order};
use servo::protocol::{CAPTURE_PIECE, Command, Message, Refusal};

/// The only axis of this image.
const AXIS: u8 = 0;

/// Owned by the control interrupt.
pub struct Control {
    joint: Joint,
    tick: u32,
    telemetry_every: u32,
    capture: Capture<'static>,
    orders: Consumer<'static, (u16, Order)>,
    answers: Producer<'static, Message>,
    records: Producer<'static, Message>,
}

impl Control {
    /// Nothing configured, nothing subscribed.
    pub fn new(
        ring: &'static mut Ring,
        orders: Consumer<'static, (u16, Order)>,
        answers: Producer<'static, Message>,
        records: Producer<'static, Message>,
    ) -> Self {
        Control {
            joint: Joint::new(),
            tick: 0,
            telemetry_every: 0,
            capture: Capture::new(ring),
            orders,
            answers,
            records,
        }
    }

    /// One tick.
    pub fn tick(&mut self, drive: &mut board::Drive) {
        let start = drive.clock();
        let sample = drive.sample();
        self.take_order(drive);
        let result = self.joint.step(sample);
        drive.apply(result.output);
        self.capture.step(self.tick, &result.output.record);
        let cost = drive.clock_since(start);
        let (axis, tick) = (AXIS, self.tick);
        if self.telemetry_every != 0 && tick.is_multiple_of(self.telemetry_every) {
            // Full: the link is too slow for this decimation; the host sees it by the gap in the tick numbers.
            let _ = self.records.enqueue(Message::Telemetry {
                axis,
                tick,
                cost,
                record: result.output.record,
            });
        }
        if let Some(&outcome) = result.concluded {
            self.tell(Message::Commissioned { axis, tick, outcome });
        }
        self.tick = tick.wrapping_add(1);
    }

    fn take_order(&mut self, drive: &mut board::Drive) {
        if self.orders.ready() {
            self.carry_out(drive);
        }
    }

    /// Kept out of the tick: what it needs on the stack would otherwise be reserved in every tick.
    #[cold]
    #[inline(never)]
    fn carry_out(&mut self, drive: &mut board::Drive) {
        let Some((to, order)) = self.orders.dequeue() else {
            return;
        };
        let result = self.execute(&order);
        if let (Order::Install(axis), Ok(())) = (&order, &result) {
            drive.configure(&axis.scale().config);
        }
        let tick = self.tick;
        self.tell(Message::Answer { to, tick, result });
    }

    /// Telemetry and capture are the image's own; all else is the joint's.
    fn execute(&mut self, order: &Order) -> Result<(), Refusal> {
        match *order {
            Order::Run(Command::Subscribe { every }) => self.telemetry_every = every,
            Order::Run(Command::CaptureArm { trigger, before }) => self.capture.arm(trigger, before),
            Order::Run(Command::CaptureRead { from }) => self.read_capture(from),
            _ => return self.joint.execute(order),
        }
        Ok(())
    }

    fn read_capture(&mut self, from: u16) {
        let first = usize::from(from);
        let shots = (first..first + CAPTURE_PIECE).map_while(|index| self.capture.get(index));
        let piece = Message::Captured {
            stage: self.capture.stage(),
            extent: self.capture.extent(),
            from,
            shots: shots.collect(),
        };
        self.tell(piece);
    }

    /// Never full: there are twice as many places for answers as for orders, and the link hands over an order only when
    /// it has room for what comes back.
    fn tell(&mut self, message: Message) {
        let _ = self.answers.enqueue(message);
    }
}
