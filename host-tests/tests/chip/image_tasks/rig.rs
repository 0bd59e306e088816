//! A board that is a few fields, and the tasks of the image around it.

use super::image::board::{AXES, Board, Drive, Idle, Line, Started};
use super::image::tick::{Control, Ends, Order, Orders, Parcel, Telemetry};
use super::names::ServoAxis;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use heapless::spsc::{Consumer, Producer, Queue};
use servo::axis::{Bridge, Command, Sample};
use servo::config::Config;
use servo::drivers::gates::State;
use servo::drivers::saving::{Job, Report};
use servo::drivers::scales::Scales;
use servo::link::board::{Clock, Gates};
use servo::link::capture::EMPTY;
use servo::link::protocol::{Message, Refusal, ResetCause};
use servo::optional::Optional;
use servo::protect::{Interlock, Settings};
use servo::store::Found;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Clocks that each look at the clock takes.
pub const LOOK: u32 = 70;

/// Zeros of the current that the board has found: one axis has two sensors, the other none.
pub const ZEROS: [[i16; 2]; AXES] = [[2_031, 2_064], [Sample::CURRENT_NOT_SENSED; 2]];

/// A start as it should be.
pub const STARTED: Started =
    Started { cause: ResetCause::Power, clock: Clock::Crystal(8_000_000), brown_out_reset_off: false };

/// What a board has and was told.
pub struct World {
    pub samples: [Sample; AXES],
    pub interlocks: [Interlock; AXES],
    pub index: [bool; AXES],
    pub goes_round: [bool; AXES],
    pub zeros: [[i16; 2]; AXES],
    pub gates: Option<Gates>,
    /// The next tick is due already.
    pub late: bool,
    pub bridges: [(Bridge, i16); AXES],
    pub configured: Vec<(usize, Config)>,
    pub begun: u32,
    pub restarts: u32,
    clock: Cell<u32>,
}

/// Standing shafts, permitted.
pub fn world() -> World {
    World {
        samples: [Sample { count: 0, vbus_raw: 1200, current_raw: Sample::CURRENT_NOT_SENSED }; AXES],
        interlocks: [Interlock::Granted; AXES],
        index: [false; AXES],
        goes_round: [false; AXES],
        zeros: ZEROS,
        gates: Some(Gates { state: State::Ready, trouble: 0 }),
        late: false,
        bridges: [(Bridge::Open, 0); AXES],
        configured: Vec::new(),
        begun: 0,
        restarts: 0,
        clock: Cell::new(u32::MAX - 1_000),
    }
}

impl Drive for World {
    fn begin_tick(&mut self) {
        self.begun += 1;
    }

    fn sample(&self, axis: usize) -> Sample {
        self.samples[axis]
    }

    fn interlock(&self, axis: usize) -> Interlock {
        self.interlocks[axis]
    }

    fn index(&self, axis: usize) -> bool {
        self.index[axis]
    }

    fn apply(&mut self, axis: usize, bridge: Bridge, duty: i16) {
        self.bridges[axis] = (bridge, duty);
    }

    fn end_tick(&mut self) -> bool {
        self.late
    }

    fn zeros(&self, axis: usize) -> [i16; 2] {
        self.zeros[axis]
    }

    fn gates(&self) -> Option<Gates> {
        self.gates
    }

    fn goes_round(&self, axis: usize) -> bool {
        self.goes_round[axis]
    }

    fn configure(&mut self, axis: usize, config: &Config) {
        self.configured.push((axis, *config));
    }

    fn restart(&mut self) {
        self.restarts += 1;
    }

    fn clock(&self) -> u32 {
        self.clock.set(self.clock.get().wrapping_add(LOOK));
        self.clock.get()
    }

    fn clock_since(&self, start: u32) -> u32 {
        self.clock().wrapping_sub(start)
    }
}

/// Two sectors of flash.
#[derive(Clone)]
pub struct Memory(pub Rc<RefCell<Vec<u8>>>);

impl Memory {
    pub fn blank() -> Self {
        Self(Rc::new(RefCell::new(vec![0xFF; 2 * Self::ERASE_SIZE])))
    }
}

impl ErrorType for Memory {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Memory {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        bytes.copy_from_slice(&self.0.borrow()[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * Self::ERASE_SIZE
    }
}

impl NorFlash for Memory {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 16 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.0.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        let mut memory = self.0.borrow_mut();
        memory[offset as usize..].iter_mut().zip(bytes).for_each(|(cell, byte)| *cell &= byte);
        Ok(())
    }
}

pub struct NoLine;

impl Line for NoLine {
    fn read(&mut self) -> Option<u8> {
        None
    }

    fn room(&mut self) -> usize {
        0
    }

    fn write(&mut self, _: &[u8]) {}
}

pub struct NoIdle;

impl Idle for NoIdle {
    fn turn(&mut self) {}

    fn while_storing<R>(&mut self, work: impl FnOnce() -> R) -> R {
        work()
    }
}

/// The board of these fields. It cannot do a PWM scale of 7,777.
pub struct Fields;

pub const IMPOSSIBLE: u16 = 7_777;

impl Board for Fields {
    const NAME: &'static str = "fields";
    const MOST_AXES: usize = AXES;
    const SCALES: Scales = Scales { supply: Optional::new(0.01), current: Optional::new(0.005) };
    const PARAMETERS: u32 = 0;

    type Device = ();
    type Drive = World;
    type Line = NoLine;
    type Idle = NoIdle;
    type Flash = Memory;

    fn begin(_: &(), _: &mut cortex_m::Peripherals) -> Started {
        STARTED
    }

    fn flash() -> Memory {
        Memory::blank()
    }

    fn init(_: (), _: cortex_m::Peripherals) -> (World, NoLine, NoIdle) {
        (world(), NoLine, NoIdle)
    }

    fn supports(config: &Config, _: Option<&Settings>) -> Result<(), Refusal> {
        if config.pwm_full_scale == IMPOSSIBLE { Err(Refusal::TickRate) } else { Ok(()) }
    }

    fn bridge_off() {}

    fn halt() -> ! {
        panic!("halted")
    }
}

/// The control task with the other ends of its queues. What it points to lives as long as the test run.
pub struct Task {
    pub control: Control,
    pub world: World,
    orders: Orders,
    filled: Producer<'static, &'static mut Parcel>,
    empty: Consumer<'static, &'static mut Parcel>,
    pub answers: Consumer<'static, Message>,
    pub records: Consumer<'static, Telemetry>,
    pub jobs: Consumer<'static, Job>,
    pub reports: Producer<'static, Report>,
}

fn leak<T>(value: T) -> &'static mut T {
    Box::leak(Box::new(value))
}

fn queue<T, const N: usize>() -> (Producer<'static, T>, Consumer<'static, T>) {
    leak(Queue::<T, N>::new()).split()
}

impl Task {
    pub fn new(started: Started, stored: Found) -> Self {
        let (filled, waiting) = queue::<_, 2>();
        let (mut done, empty) = queue::<_, 2>();
        let (answers, answers_in) = queue::<_, 8>();
        let (records, records_in) = queue::<_, 8>();
        let (jobs, jobs_in) = queue::<_, 2>();
        let (reports, reports_in) = queue::<_, 2>();
        let parcel = Parcel { to: 0, axis: 0, order: Order::Run(Command::Hello), done: false };
        assert!(done.enqueue(leak(parcel)).is_ok());
        let ends = Ends { answers, records, jobs, reports: reports_in };
        let axes = [(); AXES].map(|()| leak(ServoAxis::default()));
        let world = world();
        Task {
            control: Control::new(axes, leak(EMPTY), started, stored, ends, &world),
            world,
            orders: Orders { waiting, done },
            filled,
            empty,
            answers: answers_in,
            records: records_in,
            jobs: jobs_in,
            reports,
        }
    }

    pub fn tick(&mut self) {
        self.control.tick(&mut self.orders, &mut self.world);
    }

    pub fn ticks(&mut self, number: u32) {
        (0..number).for_each(|_| self.tick());
    }

    /// Everything that was told since the last look.
    pub fn told(&mut self) -> Vec<Message> {
        std::iter::from_fn(|| self.answers.dequeue()).collect()
    }

    /// Hands an order over.
    pub fn send(&mut self, to: u16, axis: u8, order: Order) {
        let parcel = self.empty.dequeue().expect("the parcel is back");
        *parcel = Parcel { to, axis, order, done: false };
        assert!(self.filled.enqueue(parcel).is_ok());
    }

    /// Is the order carried out or refused?
    pub fn is_back(&self) -> bool {
        self.empty.ready()
    }

    /// Hands an order over and runs ticks until it is answered. What else was told is forgotten.
    pub fn order(&mut self, axis: u8, order: Order) -> Result<(), Refusal> {
        self.send(77, axis, order);
        for _ in 0..100 {
            self.tick();
            let answer = self.told().into_iter().find_map(|message| match message {
                Message::Answer { to: 77, result, .. } => Some(result),
                _ => None,
            });
            if let Some(result) = answer {
                let parcel = self.empty.peek().expect("the parcel is back");
                assert_eq!(parcel.done, result.is_ok());
                return result;
            }
        }
        panic!("no answer")
    }

    pub fn run(&mut self, axis: u8, command: Command) -> Result<(), Refusal> {
        self.order(axis, Order::Run(command))
    }

    pub fn configure(&mut self, axis: u8, config: &Config) -> Result<(), Refusal> {
        let constants = servo::axis::Axis::new(config).expect("a good configuration").into();
        self.order(axis, Order::Install(constants, None))
    }
}
