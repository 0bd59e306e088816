//! The axes of one chip against a mocked board: one moment for all, and what a fault of one does to the others.

use embedded_hal::digital::{self, InputPin, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use servo::axis::{Bridge, Sample};
use servo::drivers::axes::Axes;
use servo::drivers::axis::{GuardedAxis, HardwareOf};
use servo::drivers::bridge::{Config, Decay, HBridge, Wiring};
use servo::drivers::encoder::{Counter, Encoder};
use servo::drivers::interlock::{Interlock, InterlockLines};
use servo::drivers::parts::{Breaker, Parts};
use servo::drivers::sense::{Converter, CurrentKind, CurrentSense, SupplySense};
use servo::drivers::zero::ZeroLimits;
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

const FULL: u16 = 4200;
const SETTLING: u8 = 3;

/// Two timers with two axes each, as the registers of the chip see them.
#[derive(Default)]
struct World {
    counts: [u32; 4],
    index: [bool; 4],
    currents: [u16; 4],
    supply: u16,
    enabled: bool,
    fault_low: [bool; 2],
    /// Break flag and main output enable of the timers.
    tripped: [bool; 2],
    outputs: [bool; 2],
    /// An enable line is its timer's main output enable, as of a discrete bridge.
    discrete: bool,
    /// Compare registers as written, and as they act since the last update.
    written: [[u16; 2]; 4],
    acting: [[u16; 2]; 4],
}

impl World {
    /// The update of the timers: what was written acts.
    fn update(&mut self) {
        self.acting = self.written;
    }

    /// A pulse on the fault line that ends before anybody can read it.
    fn pulse(&mut self, timer: usize) {
        (self.tripped[timer], self.outputs[timer]) = (true, false);
    }

    /// True if voltage is across the motor.
    fn drives(&self, axis: usize) -> bool {
        self.outputs[axis / 2] && self.acting[axis][0] != self.acting[axis][1]
    }
}

type Shared = Rc<RefCell<World>>;

struct Line(Shared, usize);
struct Level(Shared, usize, usize);
struct Shaft(Shared, usize);
struct Channel(Shared, Option<usize>);
struct Break(Shared, usize);

/// Which input: 0 … 3 index, 4 and 5 fault, 6 enable contact.
const FAULT: usize = 4;
const ENABLE: usize = 6;

impl digital::ErrorType for Line {
    type Error = Infallible;
}

impl InputPin for Line {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let world = self.0.borrow();
        Ok(match self.1 {
            ENABLE => world.enabled,
            timer @ FAULT.. => !world.fault_low[timer - FAULT],
            axis => world.index[axis],
        })
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

impl OutputPin for Line {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(true);
        Ok(())
    }
}

impl Line {
    /// An active fault line keeps the outputs off.
    fn set(&self, high: bool) {
        let mut world = self.0.borrow_mut();
        if world.discrete {
            let timer = self.1 / 2;
            world.outputs[timer] = high && !world.fault_low[timer];
        }
    }
}

impl pwm::ErrorType for Level {
    type Error = Infallible;
}

impl SetDutyCycle for Level {
    fn max_duty_cycle(&self) -> u16 {
        FULL
    }

    fn set_duty_cycle(&mut self, level: u16) -> Result<(), Infallible> {
        self.0.borrow_mut().written[self.1][self.2] = level;
        Ok(())
    }
}

impl Counter for Shaft {
    fn bits(&self) -> u32 {
        32
    }

    fn count(&self) -> u32 {
        self.0.borrow().counts[self.1]
    }
}

impl Converter for Channel {
    fn sample(&self) -> u16 {
        let world = self.0.borrow();
        self.1.map_or(world.supply, |axis| world.currents[axis])
    }
}

impl Breaker for Break {
    fn has_tripped(&self) -> bool {
        self.0.borrow().tripped[self.1]
    }

    fn clear(&mut self) {
        let mut world = self.0.borrow_mut();
        world.tripped[self.1] = world.fault_low[self.1];
    }

    fn enable(&mut self) {
        let mut world = self.0.borrow_mut();
        if !world.fault_low[self.1] {
            world.outputs[self.1] = true;
        }
    }
}

struct Mocks;

impl Parts for Mocks {
    type Pwm = Level;
    type Enable = Line;
    type Counter = Shaft;
    type Current = CurrentSense<Channel>;
    type Supply = Channel;
    type Input = Line;
    type Breaker = Break;
}

fn bridge(world: &Shared, axis: usize) -> HBridge<Level, Level, Line> {
    let wiring = if world.borrow().discrete { Wiring::HalfBridges } else { Wiring::TwoInputs };
    let config = Config { wiring, decay: Decay::Slow, duty_limit: FULL };
    let lines = [0, 1].map(|line| Level(world.clone(), axis, line));
    let [a, b] = lines;
    HBridge::new(config, a, b, Line(world.clone(), axis)).unwrap()
}

fn guarded(world: &Shared, axis: usize) -> GuardedAxis<Mocks> {
    let limits = ZeroLimits { readings_log2: 0, window: (0, 4095), spread: 4095 };
    let hardware = HardwareOf::<Mocks> {
        bridge: bridge(world, axis),
        encoder: Encoder::new(Shaft(world.clone(), axis)),
        current: CurrentSense::new(CurrentKind::Signed, limits, Channel(world.clone(), Some(axis))),
        supply: SupplySense::new(Some(Channel(world.clone(), None))),
    };
    let lines = InterlockLines::new(Line(world.clone(), FAULT + axis / 2), Line(world.clone(), ENABLE));
    GuardedAxis::new(hardware, lines, Some(Line(world.clone(), axis)), axis / 2)
}

/// Four axes as they are at power-up, with a closed enable contact.
fn power_up() -> (Shared, Axes<Mocks, 4>) {
    let world = Shared::default();
    world.borrow_mut().enabled = true;
    let axes = std::array::from_fn(|axis| guarded(&world, axis));
    let breakers = [Break(world.clone(), 0), Break(world.clone(), 1)];
    (world, Axes::new(axes, breakers, SETTLING))
}

/// One tick: the update, which starts it, then what every axis wants.
fn tick(world: &Shared, axes: &mut Axes<Mocks, 4>, wanted: [(Bridge, i16); 4]) {
    begin(world, axes);
    for (axis, (bridge, duty)) in wanted.into_iter().enumerate() {
        axes.apply(axis, bridge, duty);
    }
}

fn begin(world: &Shared, axes: &mut Axes<Mocks, 4>) {
    world.borrow_mut().update();
    axes.begin_tick();
}

const OPEN: (Bridge, i16) = (Bridge::Open, 0);
const DRIVE: (Bridge, i16) = (Bridge::Driven, 1000);

/// Four axes after their drivers have woken up and every axis has asked for an open bridge.
fn ready() -> (Shared, Axes<Mocks, 4>) {
    let (world, mut axes) = power_up();
    for _ in 0..=SETTLING {
        tick(&world, &mut axes, [OPEN; 4]);
    }
    (world, axes)
}

/// Four axes that drive.
fn driving() -> (Shared, Axes<Mocks, 4>) {
    let (world, mut axes) = ready();
    tick(&world, &mut axes, [DRIVE; 4]);
    tick(&world, &mut axes, [DRIVE; 4]);
    assert!((0..4).all(|axis| world.borrow().drives(axis)));
    (world, axes)
}

#[test]
fn all_axes_are_sampled_at_the_beginning_of_the_tick() {
    let (world, mut axes) = ready();
    {
        let mut world = world.borrow_mut();
        (world.counts, world.currents, world.supply) = ([10, 20, 30, 40], [100, 200, 300, 400], 1354);
        world.index = [true, false, true, false];
    }
    begin(&world, &mut axes);
    // While axis 0 computes, the shafts turn on, the converters are triggered again and the contact opens.
    {
        let mut world = world.borrow_mut();
        (world.counts, world.currents, world.supply) = ([11, 22, 33, 44], [0; 4], 0);
        (world.index, world.enabled) = ([false, true, false, true], false);
    }
    for (axis, count) in [10, 20, 30, 40].into_iter().enumerate() {
        let sample = Sample { count, vbus_raw: 1354, current_raw: axes.sample(axis).current_raw };
        assert_eq!(axes.sample(axis), sample, "axis {axis}");
        assert_eq!(axes.index(axis), axis % 2 == 0, "axis {axis}");
        assert_eq!(axes.interlock(axis), Interlock::Granted, "axis {axis}");
        axes.apply(axis, Bridge::Open, 0);
    }
    begin(&world, &mut axes);
    for (axis, count) in [11, 22, 33, 44].into_iter().enumerate() {
        assert_eq!(axes.sample(axis).count, count);
        assert_eq!((axes.index(axis), axes.interlock(axis)), (axis % 2 == 1, Interlock::Disabled));
    }
}

/// The zero of the current is found with the bridge open; then the readings of one moment count for all axes.
#[test]
fn currents_are_those_of_the_beginning_of_the_tick() {
    let (world, mut axes) = power_up();
    world.borrow_mut().currents = [2000, 2010, 2020, 2030];
    for _ in 0..20 {
        tick(&world, &mut axes, [OPEN; 4]);
    }
    // At rest the zeros would follow.
    tick(&world, &mut axes, [DRIVE; 4]);
    world.borrow_mut().currents = [2001, 2012, 2023, 2034];
    begin(&world, &mut axes);
    world.borrow_mut().currents = [0; 4];
    for axis in 0..4 {
        assert_eq!(i32::from(axes.sample(axis).current_raw), 1 + axis as i32);
    }
}

#[test]
fn a_short_break_is_told_to_both_axes_of_its_timer_and_opens_both() {
    let (world, mut axes) = driving();
    world.borrow_mut().pulse(0);
    begin(&world, &mut axes);
    let said: Vec<Interlock> = (0..4).map(|axis| axes.interlock(axis)).collect();
    let (fault, granted) = (Interlock::BridgeFault, Interlock::Granted);
    assert_eq!(said, [fault, fault, granted, granted]);
    // Axis 0 opens as it is told; axis 1 has not understood and wants to go on.
    for (axis, (bridge, duty)) in [OPEN, DRIVE, DRIVE, DRIVE].into_iter().enumerate() {
        axes.apply(axis, bridge, duty);
        assert!(!world.borrow().drives(1), "while axis {axis} is set");
    }
    for _ in 0..5 {
        tick(&world, &mut axes, [OPEN, DRIVE, DRIVE, DRIVE]);
        let world = world.borrow();
        assert!(!world.drives(0) && !world.drives(1), "not before it has itself asked for an open bridge");
        assert!(world.drives(2) && world.drives(3), "the other timer goes on");
    }
    tick(&world, &mut axes, [OPEN, OPEN, DRIVE, DRIVE]);
    tick(&world, &mut axes, [OPEN, DRIVE, DRIVE, DRIVE]);
    begin(&world, &mut axes);
    assert!(world.borrow().drives(1), "a new motion");
}

/// The outputs of a discrete bridge are enabled anew in every tick that drives: not behind a break.
#[test]
fn a_break_within_a_tick_is_not_undone_by_the_command_of_that_tick() {
    let (world, mut axes) = driving();
    world.borrow_mut().discrete = true;
    (0..4).for_each(|axis| axes.put_bridge(axis, bridge(&world, axis)));
    tick(&world, &mut axes, [DRIVE; 4]);
    tick(&world, &mut axes, [DRIVE; 4]);
    assert!(world.borrow().drives(0));
    begin(&world, &mut axes);
    world.borrow_mut().pulse(0);
    for axis in 0..4 {
        axes.apply(axis, DRIVE.0, DRIVE.1);
        assert!(!world.borrow().drives(0) && !world.borrow().drives(1), "while axis {axis} is set");
    }
    assert!(world.borrow().drives(2) && world.borrow().drives(3), "the other timer goes on");
}

/// Decision 0310. One axis is not set in the tick of the break, and stays as it was.
#[test]
fn a_break_is_not_forgotten_before_every_axis_behind_it_is_open() {
    let (world, mut axes) = driving();
    world.borrow_mut().pulse(0);
    for _ in 0..3 {
        begin(&world, &mut axes);
        axes.apply(0, OPEN.0, OPEN.1);
        assert!(world.borrow().tripped[0] && !world.borrow().outputs[0]);
    }
    axes.apply(1, OPEN.0, OPEN.1);
    begin(&world, &mut axes);
    assert!(!world.borrow().tripped[0] && world.borrow().outputs[0]);
}

/// An idle axis opens its bridge in every tick, which must not hide the break from the other one.
#[test]
fn a_break_while_axis_0_idles_reaches_axis_1() {
    for before_axis in 0..2 {
        let (world, mut axes) = ready();
        tick(&world, &mut axes, [OPEN, DRIVE, OPEN, OPEN]);
        tick(&world, &mut axes, [OPEN, DRIVE, OPEN, OPEN]);
        assert!(world.borrow().drives(1));
        begin(&world, &mut axes);
        for axis in 0..2 {
            if axis == before_axis {
                world.borrow_mut().pulse(0);
            }
            axes.apply(axis, [OPEN, DRIVE][axis].0, 1000);
            assert!(axis < before_axis || !world.borrow().drives(1), "break before axis {before_axis}");
        }
        assert!(world.borrow().tripped[0], "nobody forgets a break that was not told");
        begin(&world, &mut axes);
        assert_eq!([0, 1].map(|axis| axes.interlock(axis)), [Interlock::BridgeFault; 2]);
        assert!(!world.borrow().drives(1), "break before axis {before_axis}");
    }
}

/// The compare registers are loaded once a tick: outputs that follow at once would drive on what was written before.
#[test]
fn outputs_follow_again_when_all_axes_behind_them_were_open_for_a_tick() {
    let (world, mut axes) = driving();
    world.borrow_mut().pulse(0);
    tick(&world, &mut axes, [OPEN; 4]);
    assert!(!world.borrow().outputs[0], "old levels act until the next update");
    tick(&world, &mut axes, [OPEN; 4]);
    assert!(world.borrow().outputs[0] && !world.borrow().tripped[0]);
}

#[test]
fn a_line_that_stays_low_keeps_its_axes_open() {
    let (world, mut axes) = driving();
    world.borrow_mut().fault_low[1] = true;
    world.borrow_mut().pulse(1);
    for _ in 0..5 {
        tick(&world, &mut axes, [OPEN; 4]);
        assert_eq!([2, 3].map(|axis| axes.interlock(axis)), [Interlock::BridgeFault; 2]);
        assert!(!world.borrow().outputs[1]);
    }
    world.borrow_mut().fault_low[1] = false;
    tick(&world, &mut axes, [OPEN; 4]);
    assert_eq!(axes.interlock(2), Interlock::Granted, "cleared, since both were open");
}

#[test]
fn a_contact_that_closes_again_starts_nothing() {
    let (world, mut axes) = driving();
    world.borrow_mut().enabled = false;
    tick(&world, &mut axes, [DRIVE; 4]);
    assert_eq!(axes.interlock(0), Interlock::Disabled);
    world.borrow_mut().enabled = true;
    for _ in 0..5 {
        tick(&world, &mut axes, [DRIVE; 4]);
        assert_eq!(axes.interlock(0), Interlock::Granted);
        assert!((0..4).all(|axis| !world.borrow().drives(axis)));
    }
}

/// Stored parameters make an axis that can be moved from the first tick on.
#[test]
fn nothing_is_driven_before_the_lines_have_been_looked_at() {
    let (world, mut axes) = power_up();
    world.borrow_mut().enabled = false;
    tick(&world, &mut axes, [OPEN; 4]);
    for _ in 0..10 {
        tick(&world, &mut axes, [DRIVE; 4]);
        assert!((0..4).all(|axis| !world.borrow().drives(axis)), "the contact is open");
    }
    assert_eq!(axes.interlock(0), Interlock::Disabled);
}

#[test]
fn a_break_while_drivers_wake_up_is_forgotten() {
    let (world, mut axes) = power_up();
    for _ in 0..SETTLING {
        world.borrow_mut().pulse(0);
        tick(&world, &mut axes, [OPEN; 4]);
        assert_eq!(axes.interlock(0), Interlock::Granted);
    }
    tick(&world, &mut axes, [OPEN; 4]);
    assert_eq!(axes.interlock(0), Interlock::Granted);
    world.borrow_mut().pulse(0);
    tick(&world, &mut axes, [OPEN; 4]);
    assert_eq!(axes.interlock(0), Interlock::BridgeFault, "from then on it is a fault");
}

#[test]
fn another_full_scale_keeps_count_and_verdict() {
    let (world, mut axes) = ready();
    world.borrow_mut().counts[1] = 77;
    tick(&world, &mut axes, [OPEN; 4]);
    axes.put_bridge(1, bridge(&world, 1));
    tick(&world, &mut axes, [OPEN, DRIVE, OPEN, OPEN]);
    assert_eq!(axes.sample(1).count, 77);
    begin(&world, &mut axes);
    assert!(world.borrow().drives(1));
}

#[test]
fn an_axis_that_does_not_exist_is_never_permitted() {
    let (_, mut axes) = ready();
    assert_eq!((axes.sample(4), axes.interlock(4)), (Sample::NONE, Interlock::Disabled));
    axes.apply(4, Bridge::Driven, 100);
}
