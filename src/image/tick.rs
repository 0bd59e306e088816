//! The image's control tick: at most one order, one step of every axis, one record each.

use super::board::{AXES, Board as _, Drive, NAME, Selected, Started};
use fast_tick::ServoAxis;
use fast_tick::constants::Constants;
use heapless::spsc::{Consumer, Producer};
use servo::axis::servo_axis;
use servo::drivers::saving::{Job, Report, Saving, Step};
use servo::link::board::Board;
use servo::link::capture::{Capture, Ring};
use servo::link::protocol::{CAPTURE_PIECE, Command, Message, Refusal};
use servo::link::trial::Trial;
use servo::protect::{Condition, Interlock};
use servo::record::Record;
use servo::store::{AtRest, Found};

/// An order whose constants lie in a place of their own.
pub type Order = servo_axis::Order<Constants>;

/// Control rate until an axis is configured, Hz: the one with which the boards start.
const START_TICK_HZ: u32 = 10_000;

/// What an image knows of its board.
const BOARD: Board = Board::new(NAME, Selected::SCALES);

/// An order with its sequence number and its axis. There is one place for it, which goes to and fro between link and control.
pub struct Parcel {
    /// Sequence number.
    pub to: u16,
    /// The axis.
    pub axis: u8,
    /// What is to be done.
    pub order: Order,
    /// Filled in by the control interrupt: the order was carried out.
    pub done: bool,
}

/// The control interrupt's ends of the two queues in which a [`Parcel`] goes round.
pub struct Orders {
    /// From the link.
    pub waiting: Consumer<'static, &'static mut Parcel>,
    /// Back to it, to be filled anew.
    pub done: Producer<'static, &'static mut Parcel>,
}

/// The control interrupt's ends of the other queues.
pub struct Ends {
    /// Answers to the link.
    pub answers: Producer<'static, Message>,
    /// Telemetry to the link.
    pub records: Producer<'static, Telemetry>,
    /// Work for idle: parameters to be stored.
    pub jobs: Producer<'static, Job>,
    /// How that work went.
    pub reports: Consumer<'static, Report>,
}

/// [`Message::Telemetry`] on its way to the link. A queue of whole messages would take three times the room, that of the
/// longest one.
pub struct Telemetry {
    axis: u8,
    tick: u32,
    cost: u32,
    record: Record,
}

impl From<Telemetry> for Message {
    fn from(telemetry: Telemetry) -> Self {
        let Telemetry { axis, tick, cost, record } = telemetry;
        Message::Telemetry { axis, tick, cost, record }
    }
}

/// What the control interrupt owns.
pub struct ControlTask {
    control: Control,
    orders: Orders,
}

impl ControlTask {
    /// Puts the parts together.
    pub fn new(control: Control, orders: Orders) -> Self {
        ControlTask { control, orders }
    }

    /// Runs one tick.
    pub fn run(&mut self, drive: &mut impl Drive) {
        self.control.tick(&mut self.orders, drive);
    }
}

/// The state of the control tick.
pub struct Control {
    axes: [&'static mut ServoAxis; AXES],
    telemetry_every: [u32; AXES],
    tick: u32,
    capture: Capture<'static>,
    /// The axis that the capture looks at.
    captured: u8,
    saving: Saving,
    trial: Trial,
    /// The last tick did not end in time.
    overrun: bool,
    started: Started,
    stored: Found,
    ends: Ends,
}

impl Control {
    /// The state at power-up, when nobody has subscribed. The axes are as they were stored.
    pub fn new(
        axes: [&'static mut ServoAxis; AXES],
        ring: &'static mut Ring,
        started: Started,
        stored: Found,
        ends: Ends,
        drive: &impl Drive,
    ) -> Self {
        let mut control = Control {
            axes,
            telemetry_every: [0; AXES],
            tick: 0,
            capture: Capture::new(ring),
            captured: 0,
            saving: Saving::default(),
            trial: Trial::default(),
            overrun: false,
            started,
            stored,
            ends,
        };
        control.hello(drive);
        control
    }

    /// Runs one tick.
    pub fn tick(&mut self, orders: &mut Orders, drive: &mut impl Drive) {
        drive.begin_tick();
        let mut start = drive.clock();
        // Programming the flash and setting the timers anew take ticks away, both with the bridges open.
        let excused = self.take_order(orders, drive) || self.saving.is_active();
        for axis in 0..AXES {
            self.step(axis, start, drive);
            start = drive.clock();
        }
        if self.saving.is_active() {
            self.save(drive);
        }
        if let Some(axis) = self.trial.silent() {
            self.abandon(axis, drive);
        }
        self.overrun = drive.end_tick() && !excused;
        self.tick = self.tick.wrapping_add(1);
    }

    /// Runs one axis. Its cost counts from `start`: where the tick began, or where the axis before this one ended.
    fn step(&mut self, axis: usize, start: u32, drive: &mut impl Drive) {
        let sample = drive.sample(axis);
        let servo_axis = &mut self.axes[axis];
        if drive.index(axis) {
            servo_axis.index();
        }
        let interlock = drive.interlock(axis);
        if interlock != Interlock::Granted {
            servo_axis.raise(Condition::Interlock(interlock));
        }
        if self.overrun {
            servo_axis.raise(Condition::TickOverrun);
        }
        let result = fast_tick::advance(servo_axis, sample);
        drive.apply(axis, result.drive.bridge, result.drive.duty);
        let cost = drive.clock_since(start);
        if let Some(&outcome) = result.concluded {
            // Room as for an answer.
            let (axis, tick) = (axis as u8, self.tick);
            let _ = self.ends.answers.enqueue(Message::Commissioned { axis, tick, outcome });
        }
        let every = self.telemetry_every[axis];
        let watched = every != 0 && self.tick.is_multiple_of(every);
        let captured = axis == usize::from(self.captured) && self.capture.records();
        if watched || captured {
            self.tell_tick(axis, cost, watched, captured);
        }
    }

    /// The record of this tick, for those who asked for it.
    #[inline(never)]
    fn tell_tick(&mut self, axis: usize, cost: u32, watched: bool, captured: bool) {
        let (record, tick) = (self.axes[axis].record(), self.tick);
        if captured {
            self.capture.step(tick, &record);
        }
        if watched {
            // Full: the link is too slow for this decimation; the host sees it by the gap in the tick numbers.
            let _ = self.ends.records.enqueue(Telemetry { axis: axis as u8, tick, cost, record });
        }
    }

    /// Carries out the next order, if one waits and its axis is ready. True if the timers were set anew.
    fn take_order(&mut self, orders: &mut Orders, drive: &mut impl Drive) -> bool {
        orders.waiting.ready() && self.carry_out(orders, drive)
    }

    /// An axis that was just configured computes its gains a stage a tick. A motion waits for them, half a dozen ticks.
    fn is_ready(&self, axis: u8, order: &Order) -> bool {
        self.axes.get(usize::from(axis)).is_none_or(|axis| axis.is_ready(order))
    }

    /// Carries out the order that waits, where it lies, because an order is hundreds of bytes. This function is
    /// kept out of the tick, which would otherwise reserve its stack every time.
    #[cold]
    #[inline(never)]
    fn carry_out(&mut self, orders: &mut Orders, drive: &mut impl Drive) -> bool {
        let Some(Parcel { to, axis, order, .. }) = orders.waiting.peek().map(|parcel| &**parcel) else {
            return false;
        };
        if !self.is_ready(*axis, order) {
            return false;
        }
        self.trial.heard();
        let (result, tick) = (self.execute(*axis, order, drive), self.tick);
        let config = order.configuration().filter(|_| result.is_ok());
        if let Some(config) = config {
            drive.configure(usize::from(*axis), config);
        }
        let (done, configured) = (result.is_ok(), config.is_some());
        self.tell(Message::Answer { to: *to, tick, result });
        // There is one: the queue back has a place.
        if let Some(parcel) = orders.waiting.dequeue() {
            parcel.done = done;
            let _ = orders.done.enqueue(parcel);
        }
        configured
    }

    /// Telemetry, capture and store are the image's own; all else is the axis'.
    fn execute(&mut self, axis: u8, order: &Order, drive: &impl Drive) -> Result<(), Refusal> {
        let place = usize::from(axis);
        if place >= self.axes.len() {
            return Err(Refusal::NoSuchAxis);
        }
        let Order::Run(command) = order else { return self.order(place, order) };
        match *command {
            Command::Subscribe { every } => self.telemetry_every[place] = every,
            Command::OnTrial(ticks) => self.trial = Trial::new(axis, ticks),
            Command::CaptureRead(from) => self.read_capture(from),
            Command::Hello => self.hello(drive),
            Command::Parameters => self.tell_parameters(axis),
            Command::CaptureArm { .. } | Command::Save if self.saving.is_active() => {
                return Err(Refusal::Storing);
            }
            Command::CaptureArm { trigger, before } => {
                self.captured = axis;
                self.capture.arm(trigger, before);
            }
            Command::Save => {
                let rest = self.rest().ok_or(Refusal::NotAtRest)?;
                self.saving.begin(rest);
            }
            _ => return self.order(place, order),
        }
        Ok(())
    }

    /// While parameters are stored nothing but a stop is carried out.
    fn order(&mut self, place: usize, order: &Order) -> Result<(), Refusal> {
        let stops = matches!(order, Order::Run(Command::Stop));
        if !stops && self.saving.is_active() {
            return Err(Refusal::Storing);
        }
        if !self.shares_tick(place, order) {
            return Err(Refusal::SharedTick);
        }
        self.axes[place].carry_out(order)
    }

    /// The host of a trial is gone. What is stored comes into force by a new start, which opens every bridge and stalls every axis:
    /// it waits until none is driven.
    #[cold]
    #[inline(never)]
    fn abandon(&mut self, axis: u8, drive: &mut impl Drive) {
        let abandoned = self.axes.get_mut(usize::from(axis));
        let _ = abandoned.map(|axis| axis.carry_out(&Order::Run(Command::Stop)));
        if !self.saving.is_active() && !self.axes.iter().any(|axis| axis.is_driven()) {
            drive.restart();
        }
    }

    /// True if the order leaves the control rate and the PWM of the other axes as they are: one timer paces all axes.
    fn shares_tick(&self, place: usize, order: &Order) -> bool {
        let Some(new) = order.configuration() else {
            return true;
        };
        let others = self.axes.iter().enumerate().filter(|(other, _)| *other != place);
        others.filter_map(|(_, other)| other.config()).all(|config| {
            (config.tick_hz, config.pwm_full_scale, config.pwm_delay_ticks)
                == (new.tick_hz, new.pwm_full_scale, new.pwm_delay_ticks)
        })
    }

    /// The proof that every bridge is open and every shaft stands, if it is so.
    fn rest(&self) -> Option<AtRest> {
        let mut rest = None;
        for axis in self.axes.iter() {
            rest = Some(axis.rests()?);
        }
        rest
    }

    /// Takes a save one tick further. The bridges were open when it began, and `execute` lets nothing drive them until it ends.
    #[cold]
    #[inline(never)]
    fn save(&mut self, drive: &impl Drive) {
        if !self.ends.jobs.ready() {
            // Idle is still at the last job.
            return;
        }
        let tick_hz =
            self.axes.iter().find_map(|axis| axis.config()).map_or(START_TICK_HZ, |config| config.tick_hz);
        let report = self.ends.reports.dequeue();
        let job = match self.saving.step(AXES as u8, tick_hz, report) {
            Step::Rest => return,
            Step::Tell(event) => return self.tell(Message::Store(event)),
            Step::HandOver(axis) => Job::Axis(self.axes[usize::from(axis)].parameters()),
            Step::Write(rest) => Job::Write(rest),
            Step::Erase(rest) => {
                self.lose_references(drive);
                Job::Erase(rest)
            }
        };
        // The queue had a place when this function began.
        let _ = self.ends.jobs.enqueue(job);
    }

    /// The processor stands still during an erase: a counter that goes round meanwhile is not seen to.
    fn lose_references(&mut self, drive: &impl Drive) {
        let axes = self.axes.iter_mut().enumerate();
        axes.filter(|(axis, _)| drive.goes_round(*axis)).for_each(|(_, axis)| axis.lose_reference());
    }

    #[inline(never)]
    fn tell_parameters(&mut self, axis: u8) {
        if let Some(servo_axis) = self.axes.get(usize::from(axis)) {
            let parameters = servo_axis.parameters();
            self.tell(Message::Parameters { axis, parameters });
        }
    }

    #[inline(never)]
    fn read_capture(&mut self, from: u16) {
        let first = usize::from(from);
        let shots = (first..first + CAPTURE_PIECE).map_while(|index| self.capture.get(index));
        let piece = Message::Captured {
            axis: self.captured,
            stage: self.capture.stage(),
            extent: self.capture.extent(),
            from,
            shots: shots.collect(),
        };
        self.tell(piece);
    }

    #[inline(never)]
    fn hello(&mut self, drive: &impl Drive) {
        let Started { cause, clock, brown_out_reset_off } = self.started;
        let mut board = Board { clock, brown_out_reset_off, gates: drive.gates(), ..BOARD };
        board.zeros.iter_mut().take(AXES).enumerate().for_each(|(axis, zeros)| *zeros = drive.zeros(axis));
        self.tell(Message::Hello { axes: AXES as u8, cause, stored: self.stored, board });
    }

    /// Queues a message for the link. The queue is never full: there are twice as many places for answers as for orders, and the link hands over an order only when
    /// it has room for what comes back.
    fn tell(&mut self, message: Message) {
        let _ = self.ends.answers.enqueue(message);
    }
}
