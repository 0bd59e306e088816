//! Gate drivers over SPI: frames, registers and faults of the DRV8301 (SLOS719) against a mock, the pins of the SPI, and the life of
//! drivers between control and idle.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType as PinErrorType, InputPin, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use servo::drivers::bit_bang::BitBang;
use servo::drivers::drv8301::{Drv8301, Faults, Gain, Register, Settings, Trouble};
use servo::drivers::gates::{Event, GateStatus, Gates, State};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::rc::Rc;

const SETTINGS: Settings = Settings { gain: Gain::Eighty, trip: 21 };

/// A DRV8301 by frames: each answer is about the frame before.
#[derive(Default)]
struct Chip {
    registers: [u16; 4],
    answer: u16,
    frames: Vec<u16>,
    deaf: u32,
    /// Flags of status register 1 that reading does not clear for long.
    lasting: u16,
    /// Answers with this instead.
    dead: Option<u16>,
    refuses: bool,
}

#[derive(Clone, Default)]
struct Bus(Rc<RefCell<Chip>>);

impl spi::ErrorType for Bus {
    type Error = spi::ErrorKind;
}

impl SpiDevice<u16> for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u16>]) -> Result<(), spi::ErrorKind> {
        let mut chip = self.0.borrow_mut();
        let [Operation::TransferInPlace([word])] = operations else { panic!("one frame at a time") };
        if chip.refuses {
            return Err(spi::ErrorKind::Other);
        }
        let (frame, answer) = (*word, chip.answer);
        chip.frames.push(frame);
        let place = usize::from(frame >> 11 & 3);
        if frame >> 15 != 0 {
            chip.answer = frame & 0x7800 | chip.registers[place];
            if place < 2 {
                chip.registers[place] &= !0x7FF | u16::from(place == 1);
                chip.registers[0] |= chip.lasting;
            }
        } else {
            chip.answer = chip.registers[0];
            match chip.deaf {
                0 => chip.registers[place] = frame & 0x7FF,
                _ => chip.deaf -= 1,
            }
        }
        *word = chip.dead.unwrap_or(answer);
        Ok(())
    }
}

fn driver() -> (Drv8301<Bus>, Bus) {
    let bus = Bus::default();
    bus.0.borrow_mut().registers[1] = 1;
    (Drv8301::new(bus.clone(), SETTINGS), bus)
}

/// W0, A3 … A0, D10 … D0; OC_ADJ_SET in D10 … D6, OC_MODE in D5 and D4; GAIN in D3 and D2.
#[test]
fn frames_are_the_data_sheet_s() {
    assert_eq!(Register::Status1.read(), 0x8000);
    assert_eq!(Register::Status2.read(), 0x8800);
    assert_eq!(Register::Control1.read(), 0x9000);
    assert_eq!(Register::Control2.write(0b1100), 0x180C);
    assert_eq!(Register::Control1.write(0xFFFF), 0x17FF, "eleven bits of data");
    assert_eq!(SETTINGS.controls(), [(Register::Control1, 21 << 6 | 1 << 4), (Register::Control2, 0b1100)]);
    let gains =
        [(Gain::Ten, 0, 10.0), (Gain::Twenty, 4, 20.0), (Gain::Forty, 8, 40.0), (Gain::Eighty, 12, 80.0)];
    for (gain, data, volt_per_volt) in gains {
        let settings = Settings { gain, trip: 0xFF };
        assert_eq!(settings.controls()[1].1, data);
        assert_eq!(settings.controls()[0].1, 31 << 6 | 1 << 4, "a threshold beyond the field stays in it");
        assert_eq!(gain.volt_per_volt(), volt_per_volt);
    }
}

#[test]
fn settings_are_written_and_read_back() {
    let (mut driver, bus) = driver();
    assert_eq!(driver.configure(), Ok(Faults(0)));
    let frames = &bus.0.borrow().frames;
    assert_eq!(frames[..6], [0x1550, 0x180C, 0x9000, 0x9000, 0x9800, 0x9000]);
    let status = [0x8000, 0x9000, 0x8800, 0x9000];
    assert_eq!(frames[6..], [status, status].concat(), "then both status registers, twice");
}

#[test]
fn writes_that_are_ignored_are_repeated_and_at_last_given_up() {
    for deaf in [1, 2, 7] {
        let (mut driver, bus) = driver();
        bus.0.borrow_mut().deaf = deaf;
        assert_eq!(driver.configure(), Ok(Faults(0)), "{deaf}");
    }
    let (mut driver, bus) = driver();
    bus.0.borrow_mut().deaf = u32::MAX;
    assert_eq!(driver.configure(), Err(Trouble::NotKept(Register::Control1, 0)));
    assert!(bus.0.borrow().frames.len() < 100, "it ends");
}

#[test]
fn what_is_no_answer_is_told_with_the_word() {
    // Nobody there: pulled up or down; a frame fault.
    for word in [0xFFFF, 0x0000, 0x9550] {
        let (mut driver, bus) = driver();
        bus.0.borrow_mut().dead = Some(word);
        assert_eq!(driver.configure(), Err(Trouble::NoAnswer(word)));
    }
    let (mut driver, bus) = driver();
    bus.0.borrow_mut().refuses = true;
    assert_eq!(driver.check(), Err(Trouble::NoAnswer(0xFFFF)));
}

#[test]
fn flags_of_the_start_are_read_away_and_flags_that_come_back_are_faults() {
    let (mut driver, bus) = driver();
    bus.0.borrow_mut().registers[0] = 0x600;
    assert_eq!(driver.configure(), Ok(Faults(0x600)));
    assert_eq!(driver.faults(), Ok(Faults(0)), "reading has cleared them");
    bus.0.borrow_mut().lasting = 0x420;
    assert_eq!(driver.configure(), Err(Trouble::Faulty(Faults(0x420))));
}

#[test]
fn faults_are_read_and_named_worst_first() {
    let (mut driver, bus) = driver();
    bus.0.borrow_mut().registers[1] = 1 << 7 | 1;
    let faults = driver.faults().expect("an answer");
    assert_eq!(faults.worst(), "gate supply too high: inspect the board");
    for (bits, name) in [
        (1 << 10 | 1 << 9, "gate supply too low"),
        (1 << 10 | 1 << 8, "supply too low"),
        (1 << 10 | 1 << 7, "over-temperature"),
        (1 << 10 | 1, "over-current"),
        (1 << 10, "fault"),
    ] {
        assert_eq!(Faults(bits).worst(), name);
        assert!(!Faults(bits).is_none());
    }
    assert!(Faults(1 << 6).is_none(), "a warning of temperature switches nothing off");
}

// ── Pins ────────────────────────────────────────────────────────────────────────────────────────────────────────────

/// What happens on the pins, in order.
type Trace = Rc<RefCell<Vec<(char, bool)>>>;

struct Out(Trace, char);

impl PinErrorType for Out {
    type Error = Infallible;
}

impl OutputPin for Out {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().push((self.1, false));
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().push((self.1, true));
        Ok(())
    }
}

/// Gives these bits, one after each rising edge.
struct In(Trace, u16);

impl PinErrorType for In {
    type Error = Infallible;
}

impl InputPin for In {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let rises = self.0.borrow().iter().filter(|edge| **edge == ('c', true)).count();
        Ok(self.1 >> (16 - rises) & 1 != 0)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

struct Wait(Trace);

impl DelayNs for Wait {
    fn delay_ns(&mut self, nanoseconds: u32) {
        assert!(nanoseconds >= 400, "half a clock, or a pause between frames");
        self.0.borrow_mut().push(('t', true));
    }
}

#[test]
fn a_word_goes_out_highest_bit_first_and_is_taken_with_the_falling_edge() {
    let trace = Trace::default();
    let pin = |name| Out(trace.clone(), name);
    let input = In(trace.clone(), 0xA5C3);
    let mut device = BitBang::new(pin('c'), pin('o'), input, pin('s'), Wait(trace.clone()));
    let mut words = [0x180C];
    device.transfer_in_place(&mut words).expect("pins never refuse");
    assert_eq!(words, [0xA5C3]);
    let trace = trace.borrow();
    assert_eq!((trace[0], trace[trace.len() - 2]), (('s', false), ('s', true)));
    // The level of the data line at each falling edge.
    let mut level = false;
    let mut sent = Vec::new();
    for (name, high) in trace.iter() {
        match (name, high) {
            ('o', high) => level = *high,
            ('c', false) => sent.push(level),
            _ => {}
        }
    }
    let word = sent.iter().fold(0u16, |word, bit| word << 1 | u16::from(*bit));
    assert_eq!((sent.len(), word), (16, 0x180C));
    // Each edge of the clock is followed by a wait.
    let edges = trace.windows(2).filter(|pair| pair[0] == ('c', false)).all(|pair| pair[1].0 == 't');
    assert!(edges);
}

// ── Life ────────────────────────────────────────────────────────────────────────────────────────────────────────────

#[derive(Clone, Default)]
struct Pin(Rc<Cell<bool>>);

impl PinErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
}

impl InputPin for Pin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.get())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.get())
    }
}

/// Drivers with a clock of 1,000 a millisecond that begins shortly before it wraps.
struct Life<'a> {
    gates: Gates<'a, Pin, Pin, Bus, 1>,
    enable: Pin,
    fault_n: Pin,
    bus: Bus,
    now: u32,
}

impl<'a> Life<'a> {
    fn new(status: &'a GateStatus) -> Self {
        let (enable, fault_n) = (Pin::default(), Pin::default());
        fault_n.0.set(true);
        let (driver, bus) = driver();
        let now = u32::MAX - 5_000;
        let gates = Gates::new(status, (enable.clone(), fault_n.clone()), [driver], now, 1_000);
        Self { gates, enable, fault_n, bus, now }
    }

    /// Milliseconds go by; what is told meanwhile.
    fn pass(&mut self, milliseconds: u32) -> Vec<Event> {
        let turns = 0..milliseconds * 4;
        turns
            .filter_map(|_| {
                self.now = self.now.wrapping_add(250);
                self.gates.turn(self.now)
            })
            .collect()
    }
}

#[test]
fn drivers_are_enabled_wait_and_are_ready_when_what_was_written_is_read_back() {
    let status = GateStatus::new();
    let mut life = Life::new(&status);
    assert!(status.is_off(false) && !life.enable.0.get());
    assert_eq!(life.pass(15), []);
    assert!(life.enable.0.get() && status.is_off(false));
    assert_eq!(life.bus.0.borrow().frames.len(), 0, "no frame before they are awake");
    assert_eq!(life.pass(10), [Event::Started]);
    assert!(!status.is_off(false), "from the look after the one that tells it");
}

#[test]
fn a_fault_waits_for_open_bridges_is_told_and_rests_before_the_next_start() {
    let status = GateStatus::new();
    let mut life = Life::new(&status);
    life.pass(25);
    life.bus.0.borrow_mut().registers[0] = 1 << 10 | 1 << 4;
    life.fault_n.0.set(false);
    assert!(status.is_off(true), "control sees the line");
    assert_eq!(life.pass(50), [], "bridges may still be driven: idle leaves the drivers alone");
    assert_eq!(status.state(), State::Tripped);
    life.fault_n.0.set(true);
    assert!(status.is_off(false), "a short pulse is a fault all the same");
    status.all_open();
    assert_eq!(life.pass(1), [Event::Fault(0, Trouble::Faulty(Faults(0x410)))]);
    assert!(!life.enable.0.get());
    assert_eq!(life.pass(490), []);
    assert!(!life.enable.0.get(), "the shaft comes to rest");
    assert_eq!(life.pass(40), [Event::Started]);
    assert!(!status.is_off(false));
    // Nothing is asked twice: an open bridge without a fault changes nothing.
    status.all_open();
    assert_eq!((life.pass(300), status.state()), (Vec::new(), State::Ready));
}

#[test]
fn drivers_that_do_not_come_up_are_tried_again_for_ever() {
    let status = GateStatus::new();
    let mut life = Life::new(&status);
    life.bus.0.borrow_mut().dead = Some(0);
    let failed = Event::NotStarted(0, Trouble::NoAnswer(0));
    assert_eq!(life.pass(25), [failed]);
    assert_eq!(status.state(), State::Failed);
    assert_eq!(life.pass(1_100), [failed; 2]);
    life.bus.0.borrow_mut().dead = None;
    // It answers, and the line is low without a word.
    life.fault_n.0.set(false);
    assert_eq!(life.pass(530), [Event::NotStarted(0, Trouble::LineLow)]);
    // And with flags that were gone when they were read again.
    life.bus.0.borrow_mut().registers[0] = 1 << 10 | 1 << 8;
    assert_eq!(life.pass(530), [Event::NotStarted(0, Trouble::Faulty(Faults(0x500)))]);
    life.fault_n.0.set(true);
    assert_eq!(life.pass(530), [Event::Started]);
}

/// Their amplifiers are off with them, and before they are set up their gain is another.
#[test]
fn currents_are_measured_while_drivers_are_ready_and_their_line_is_high() {
    let status = GateStatus::new();
    let mut life = Life::new(&status);
    assert!(!status.measures(false));
    life.pass(21);
    assert!(life.enable.0.get() && !status.measures(false), "awake, not set up");
    life.pass(4);
    assert!(status.measures(false) && !status.measures(true));
    status.is_off(true);
    assert!(!status.measures(false));
    status.all_open();
    life.pass(1);
    assert!(!status.measures(false));
    assert_eq!(life.pass(530), [Event::Started]);
    life.pass(1);
    assert!(status.measures(false));
}

/// The gain back at its default, and no line says so.
#[test]
fn lost_settings_are_found_within_a_tenth_of_a_second_and_told_when_bridges_are_open() {
    let status = GateStatus::new();
    let mut life = Life::new(&status);
    life.pass(25);
    assert_eq!(life.pass(1_000), [], "nothing to tell");
    life.bus.0.borrow_mut().registers[3] = 0;
    assert_eq!(life.pass(101), [], "a line of log masks interrupts: not while a bridge is driven");
    assert!(status.is_off(false));
    status.all_open();
    assert_eq!(life.pass(1), [Event::Fault(0, Trouble::NotKept(Register::Control2, 0))]);
}
