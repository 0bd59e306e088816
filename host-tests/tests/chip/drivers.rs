//! The drivers against mocked lines: what each wiring sees, in which order, and what happens when a line refuses.

use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::digital::{Mock as Pin, State as Level, Transaction as PinDo};
use embedded_hal_mock::eh1::pwm::{Mock as Pwm, Transaction as PwmDo};
use proptest::prelude::*;
use servo::axis::{Bridge, Sample};
use servo::drivers::bridge::{Config, Decay, Error, HBridge, Levels, NotConnected, Wiring};
use servo::drivers::encoder::{Counter, Encoder};
use servo::drivers::hardware::AxisHardware;
use servo::drivers::interlock::{Interlock, InterlockLines};
use servo::drivers::sense::{
    Converter, CurrentKind, CurrentSense, CurrentSensor, Divider, LowLegSense, Rises, Scale, SupplySense,
};
use servo::drivers::zero::{Reason, Zero, ZeroLimits, ZeroSearch};
use std::cell::Cell;
use std::io::ErrorKind;
use std::rc::Rc;

const FULL: u16 = 4200;

fn config(wiring: Wiring, decay: Decay) -> Config {
    Config { wiring, decay, duty_limit: FULL }
}

/// Bridge state and duty.
type Command = (Bridge, i16);
const OPEN: Command = (Bridge::Open, 0);

fn driven(duty: i16) -> Command {
    (Bridge::Driven, duty)
}

fn resting(bridge: Bridge) -> Command {
    // A duty left over from motion must not matter while the bridge does not drive.
    (bridge, 1234)
}

fn levels(config: Config, full: u16, (bridge, duty): Command) -> Levels {
    config.levels(full, bridge, duty)
}

fn lines(a: u16, b: u16, enable: bool) -> Levels {
    Levels { a, b, enable }
}

// ── H-bridge: levels ────────────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn two_inputs_follow_the_truth_table_of_the_driver_ic() {
    let bridge = config(Wiring::TwoInputs, Decay::Slow);
    // DRV8871 data sheet, table 1: 0 0 coast, 1 0 forward, 0 1 reverse, 1 1 brake.
    assert_eq!(levels(bridge, FULL, resting(Bridge::Open)), lines(0, 0, true));
    assert_eq!(levels(bridge, FULL, resting(Bridge::Shorted)), lines(FULL, FULL, true));
    assert_eq!(levels(bridge, FULL, driven(4200)), lines(FULL, 0, true));
    assert_eq!(levels(bridge, FULL, driven(-4200)), lines(0, FULL, true));
    // A quarter forward: IN1 stays high, IN2 is high (brake) for three quarters.
    assert_eq!(levels(bridge, FULL, driven(1050)), lines(4200, 3150, true));
    assert_eq!(levels(bridge, FULL, driven(-1050)), lines(3150, 4200, true));
    assert_eq!(levels(bridge, FULL, driven(0)), lines(FULL, FULL, true));
}

#[test]
fn half_bridges_brake_with_both_lines_low_and_open_only_by_enable() {
    let bridge = config(Wiring::HalfBridges, Decay::Slow);
    assert_eq!(levels(bridge, FULL, resting(Bridge::Open)), lines(0, 0, false));
    assert_eq!(levels(bridge, FULL, resting(Bridge::Shorted)), lines(0, 0, true));
    assert_eq!(levels(bridge, FULL, driven(1050)), lines(1050, 0, true));
    assert_eq!(levels(bridge, FULL, driven(-1050)), lines(0, 1050, true));
}

#[test]
fn locked_anti_phase_rests_at_one_half_and_reverses_for_the_rest_of_the_period() {
    for wiring in [Wiring::TwoInputs, Wiring::HalfBridges] {
        let bridge = config(wiring, Decay::LockedAntiPhase);
        assert_eq!(levels(bridge, FULL, driven(0)), lines(2100, 2100, true));
        assert_eq!(levels(bridge, FULL, driven(4200)), lines(4200, 0, true));
        assert_eq!(levels(bridge, FULL, driven(-4200)), lines(0, 4200, true));
        assert_eq!(levels(bridge, FULL, driven(1050)), lines(2625, 1575, true));
    }
}

#[test]
fn duty_beyond_the_limit_is_clipped_so_that_a_bootstrap_capacitor_is_recharged() {
    let bridge = Config { duty_limit: 4000, ..config(Wiring::HalfBridges, Decay::Slow) };
    assert_eq!(levels(bridge, FULL, driven(4200)), lines(4000, 0, true));
    assert_eq!(levels(bridge, FULL, driven(i16::MIN)), lines(0, 4000, true));
}

proptest! {
    /// Mean voltage over supply = (level a − level b) / full scale, whatever the wiring and the decay: the motor sees the
    /// commanded duty, to one count in locked anti-phase (a count there is two counts of duty).
    #[test]
    fn mean_voltage_is_the_commanded_duty(
        duty in -4200i16..=4200, full in 100u16..=8400, limit in 0u16..=8400,
        wiring in prop_oneof![Just(Wiring::TwoInputs), Just(Wiring::HalfBridges)],
        decay in prop_oneof![Just(Decay::Slow), Just(Decay::LockedAntiPhase)],
    ) {
        let lines = levels(Config { wiring, decay, duty_limit: limit }, full, driven(duty));
        let bound = i32::from(limit.min(full));
        let expected = i32::from(duty).clamp(-bound, bound);
        let got = i32::from(lines.a) - i32::from(lines.b);
        let tolerance = if decay == Decay::LockedAntiPhase { 1 } else { 0 };
        prop_assert!((got - expected).abs() <= tolerance, "{got} instead of {expected}");
        prop_assert!(lines.a <= full && lines.b <= full && lines.enable);
    }

    /// Opposite duties swap the lines: no direction is favoured.
    #[test]
    fn opposite_duties_mirror(duty in 0i16..=4200, wiring in prop_oneof![Just(Wiring::TwoInputs), Just(Wiring::HalfBridges)]) {
        let bridge = config(wiring, Decay::Slow);
        let (forward, reverse) = (levels(bridge, FULL, driven(duty)), levels(bridge, FULL, driven(-duty)));
        // Zero has one representation only where both lines agree anyway.
        prop_assert_eq!((forward.a, forward.b), (reverse.b, reverse.a));
    }
}

// ── H-bridge: lines ─────────────────────────────────────────────────────────────────────────────────────────────────

fn pwm(levels: &[u16]) -> Pwm {
    Pwm::new(&levels.iter().map(|level| PwmDo::set_duty_cycle(*level)).collect::<Vec<_>>())
}

/// Line a also tells full scale once.
fn pwm_a(levels: &[u16]) -> Pwm {
    let mut expected = vec![PwmDo::max_duty_cycle(FULL)];
    expected.extend(levels.iter().map(|level| PwmDo::set_duty_cycle(*level)));
    Pwm::new(&expected)
}

fn pin(states: &[Level]) -> Pin {
    Pin::new(&states.iter().map(|state| PinDo::set(*state)).collect::<Vec<_>>())
}

fn close(bridge: HBridge<Pwm, Pwm, Pin>) {
    let (mut a, mut b, mut enable) = bridge.release();
    a.done();
    b.done();
    enable.done();
}

#[test]
fn a_new_bridge_is_off_and_asleep_before_anything_else_happens() {
    let bridge =
        HBridge::new(config(Wiring::TwoInputs, Decay::Slow), pwm_a(&[0]), pwm(&[0]), pin(&[Level::Low]))
            .unwrap();
    assert_eq!(bridge.full_scale(), FULL);
    close(bridge);
}

#[test]
fn a_run_of_outputs_sets_every_line_once_a_tick() {
    let mut bridge = HBridge::new(
        config(Wiring::HalfBridges, Decay::Slow),
        pwm_a(&[0, 0, 0, 300, 0]),
        pwm(&[0, 0, 0, 0, 0]),
        pin(&[Level::Low, Level::Low, Level::High, Level::High, Level::Low]),
    )
    .unwrap();
    for output in [resting(Bridge::Open), resting(Bridge::Shorted), driven(300), OPEN] {
        bridge.apply(output.0, output.1).unwrap();
    }
    close(bridge);
}

#[test]
fn an_enable_line_that_refuses_leaves_both_pwm_lines_low() {
    let refused = MockError::Io(ErrorKind::NotConnected);
    let enable = Pin::new(&[
        PinDo::set(Level::Low),
        PinDo::set(Level::High).with_error(refused.clone()),
        PinDo::set(Level::Low).with_error(refused),
    ]);
    let mut bridge =
        HBridge::new(config(Wiring::HalfBridges, Decay::Slow), pwm_a(&[0, 300, 0]), pwm(&[0, 0, 0]), enable)
            .unwrap();
    let error = bridge.apply(Bridge::Driven, 300).unwrap_err();
    assert!(matches!(error, Error::Enable(_)), "{error:?}");
    close(bridge);
}

#[test]
fn a_pwm_line_that_refuses_pulls_enable_low_and_still_clears_the_other() {
    let refused = MockError::Io(ErrorKind::NotConnected);
    let a = Pwm::new(&[
        PwmDo::max_duty_cycle(FULL),
        PwmDo::set_duty_cycle(0),
        PwmDo::set_duty_cycle(300).with_error(refused.clone()),
        PwmDo::set_duty_cycle(0).with_error(refused),
    ]);
    let mut bridge = HBridge::new(
        config(Wiring::HalfBridges, Decay::Slow),
        a,
        pwm(&[0, 0]),
        pin(&[Level::Low, Level::Low]),
    )
    .unwrap();
    assert!(matches!(bridge.apply(Bridge::Driven, 300), Err(Error::Pwm(_))));
    close(bridge);
}

#[test]
fn a_bridge_without_enable_line_works_with_its_two_inputs_alone() {
    let mut bridge = HBridge::new(
        config(Wiring::TwoInputs, Decay::Slow),
        pwm_a(&[0, FULL, 0]),
        pwm(&[0, 3150, 0]),
        NotConnected,
    )
    .unwrap();
    bridge.apply(Bridge::Driven, 1050).unwrap();
    bridge.apply(Bridge::Open, 0).unwrap();
    let (mut a, mut b, _) = bridge.release();
    a.done();
    b.done();
}

// ── Encoder ─────────────────────────────────────────────────────────────────────────────────────────────────────────

/// A counter of `bits` bits whose true position the test moves.
#[derive(Clone)]
struct Shaft {
    bits: u32,
    position: Rc<Cell<i64>>,
}

impl Shaft {
    fn at(bits: u32, position: i64) -> Self {
        Self { bits, position: Rc::new(Cell::new(position)) }
    }

    fn turn(&self, counts: i64) {
        self.position.set(self.position.get() + counts);
    }
}

impl Counter for Shaft {
    fn bits(&self) -> u32 {
        self.bits
    }

    fn count(&self) -> u32 {
        // What a timer of 16 bits delivers when read as a 32-bit register: upper half zero.
        (self.position.get() as u64 & ((1u64 << self.bits) - 1)) as u32
    }
}

#[test]
fn sixteen_bits_are_extended_across_both_ends() {
    let shaft = Shaft::at(16, 65_530);
    let mut encoder = Encoder::new(shaft.clone());
    assert_eq!(encoder.read(), 0, "the count starts at zero wherever the counter stands");
    shaft.turn(10);
    assert_eq!(encoder.read(), 10, "across 65,535 → 0");
    shaft.turn(-15);
    assert_eq!(encoder.read(), -5, "and back across 0 → 65,535");
    for _ in 0..100 {
        shaft.turn(32_767);
        encoder.read();
    }
    assert_eq!(encoder.read(), 3_276_700 - 5, "fifty turns of the counter");
}

#[test]
fn the_fastest_motion_is_half_the_range_and_the_limit_is_sharp() {
    for (step, expected) in [(32_767, 32_767), (-32_768, -32_768), (32_768, -32_768)] {
        let shaft = Shaft::at(16, 100);
        let mut encoder = Encoder::new(shaft.clone());
        shaft.turn(step);
        assert_eq!(encoder.read(), expected);
    }
}

/// An erase of the flash stops the processor for seconds.
#[test]
fn a_counter_of_16_bits_can_go_round_while_nobody_reads_it_and_one_of_32_cannot() {
    assert!(Encoder::new(Shaft::at(16, 0)).goes_round());
    assert!(!Encoder::new(Shaft::at(32, 0)).goes_round());
}

#[test]
fn a_32_bit_counter_wraps_with_the_count() {
    let shaft = Shaft::at(32, 0);
    let mut encoder = Encoder::new(shaft.clone());
    shaft.turn(i64::from(i32::MAX));
    assert_eq!(encoder.read(), i32::MAX);
    shaft.turn(1);
    assert_eq!(encoder.read(), i32::MIN);
}

proptest! {
    /// Whatever the width, start and path, the count is the true motion modulo 2³².
    #[test]
    fn the_count_is_the_true_motion(bits in prop_oneof![Just(16u32), Just(24), Just(32)], start: u32,
                                    path in prop::collection::vec(-32_768i64..=32_767, 1..200)) {
        let shaft = Shaft::at(bits, i64::from(start));
        let mut encoder = Encoder::new(shaft.clone());
        for step in &path {
            shaft.turn(*step);
            encoder.read();
        }
        prop_assert_eq!(encoder.read(), path.iter().sum::<i64>() as i32);
    }
}

// ── Permission ──────────────────────────────────────────────────────────────────────────────────────────────────────

fn reading(state: Level) -> Pin {
    Pin::new(&[PinDo::get(state)])
}

#[test]
fn both_lines_must_be_high_and_the_contact_is_named_first() {
    for (enable, fault_n, expected) in [
        (Level::High, Level::High, Interlock::Granted),
        (Level::High, Level::Low, Interlock::BridgeFault),
        (Level::Low, Level::High, Interlock::Disabled),
        (Level::Low, Level::Low, Interlock::Disabled),
    ] {
        let (mut fault_pin, mut enable_pin) = (reading(fault_n), reading(enable));
        let verdict = InterlockLines::new(fault_pin.clone(), enable_pin.clone()).read();
        assert_eq!(verdict, expected);
        fault_pin.done();
        enable_pin.done();
    }
}

#[test]
fn a_line_that_cannot_be_read_forbids() {
    let broken = || Pin::new(&[PinDo::get(Level::High).with_error(MockError::Io(ErrorKind::NotConnected))]);
    let (mut good, mut bad) = (reading(Level::High), broken());
    assert_eq!(InterlockLines::new(good.clone(), bad.clone()).read(), Interlock::Disabled);
    good.done();
    bad.done();
    let (mut good, mut bad) = (reading(Level::High), broken());
    assert_eq!(InterlockLines::new(bad.clone(), good.clone()).read(), Interlock::BridgeFault);
    good.done();
    bad.done();
}

// ── Current and supply ──────────────────────────────────────────────────────────────────────────────────────────────

/// A converter whose reading the test sets.
#[derive(Clone, Default)]
struct Channel(Rc<Cell<u16>>);

impl Channel {
    fn reading(raw: u16) -> Self {
        Self(Rc::new(Cell::new(raw)))
    }
}

impl Converter for Channel {
    fn sample(&self) -> u16 {
        self.0.get()
    }
}

/// Ticks that pass with an open bridge before the first reading counts.
const SETTLING: usize = 16;

const LIMITS: ZeroLimits = ZeroLimits { readings_log2: 4, window: (0, 2200), spread: 12 };

/// A sensor that has found its zero at what the channel reads now.
fn sensor(kind: CurrentKind, channel: &Channel) -> CurrentSense<Channel> {
    let mut sense = CurrentSense::new(kind, LIMITS, channel.clone());
    for _ in 0..SETTLING + 15 {
        assert_eq!(sense.read(), Sample::CURRENT_ZERO_SOUGHT);
    }
    assert_eq!(sense.read(), 0);
    sense
}

#[test]
fn a_signed_sensor_reads_zero_at_its_offset_and_both_signs_around_it() {
    let channel = Channel::reading(2050);
    let mut sense = sensor(CurrentKind::Signed, &channel);
    channel.0.set(2150);
    assert_eq!(sense.read(), 100);
    channel.0.set(0);
    assert_eq!(sense.read(), -2050);
}

#[test]
fn a_magnitude_sensor_takes_the_sign_of_the_last_driven_duty() {
    let channel = Channel::reading(10);
    let mut sense = sensor(CurrentKind::Magnitude, &channel);
    channel.0.set(310);
    sense.follow(Bridge::Driven, 500);
    assert_eq!(sense.read(), 300);
    sense.follow(Bridge::Driven, -500);
    assert_eq!(sense.read(), -300);
    sense.follow(Bridge::Shorted, 1234);
    sense.follow(Bridge::Driven, 0);
    assert_eq!(sense.read(), -300, "braking and zero duty keep the last direction");
    channel.0.set(3);
    assert_eq!(sense.read(), 0, "noise below the offset is no current, least of all a negative one");
}

#[test]
fn the_marks_of_what_is_not_measured_are_never_produced_by_a_reading() {
    let none: SupplySense<Channel> = SupplySense::new(None);
    assert_eq!(none.read(), Sample::VBUS_NOT_MEASURED);
    assert_eq!(SupplySense::new(Some(Channel::reading(4095))).read(), 4095);
    let channel = Channel::reading(u16::MAX);
    let limits = ZeroLimits { window: (u16::MAX, u16::MAX), ..LIMITS };
    let mut deepest = CurrentSense::new(CurrentKind::Signed, limits, channel.clone());
    for _ in 0..=SETTLING + 15 {
        deepest.read();
    }
    channel.0.set(0);
    assert_eq!(deepest.read(), Sample::LOWEST_CURRENT);
    assert_eq!(Sample::sensed(Sample::LOWEST_CURRENT), Some(Sample::LOWEST_CURRENT));
    for mark in [
        Sample::CURRENT_NOT_SENSED,
        Sample::CURRENT_ZERO_SOUGHT,
        Sample::CURRENT_ZERO_UNSTEADY,
        Sample::CURRENT_ZERO_OUTSIDE,
        Sample::CURRENT_ZERO_UNSEEN,
    ] {
        assert_eq!(Sample::sensed(mark), None);
    }
}

/// A stage without sensor: its converter's pin floats, and nobody waits for a zero.
#[test]
fn where_there_is_no_sensor_no_zero_is_looked_for() {
    let channel = Channel::reading(77);
    let mut absent = CurrentSense::new(CurrentKind::Absent, LIMITS, channel.clone());
    for k in 0..200 {
        channel.0.set(4000 * (k % 2));
        assert_eq!(absent.read(), Sample::CURRENT_NOT_SENSED);
    }
}

/// What `truing monitor --board` shows.
#[test]
fn a_sensor_tells_its_zeros_or_why_it_has_none() {
    let unknown = CurrentSense::new(CurrentKind::Signed, LIMITS, Channel::reading(2050));
    assert_eq!(unknown.zeros(), [Sample::CURRENT_ZERO_SOUGHT, Sample::CURRENT_NOT_SENSED]);
    let known = sensor(CurrentKind::Signed, &Channel::reading(2050));
    assert_eq!(known.zeros(), [2050, Sample::CURRENT_NOT_SENSED]);
    let absent = CurrentSense::new(CurrentKind::Absent, LIMITS, Channel::reading(77));
    assert_eq!(absent.zeros(), [Sample::CURRENT_NOT_SENSED; 2]);
    let mut legs = LowLegSense::new(LIMITS, [2040, 4000].map(Channel::reading), Rises::WithCurrentDown);
    (0..1000).for_each(|_| _ = legs.read());
    assert_eq!(legs.zeros(), [2040, Sample::CURRENT_ZERO_OUTSIDE]);
}

/// Two shunts, as below the legs of a discrete bridge: the one of the leg that stays low carries the winding current.
#[test]
fn the_leg_that_stays_low_tells_the_current_with_its_sign() {
    let legs = [Channel::reading(2040), Channel::reading(2060)];
    let mut sense = LowLegSense::new(LIMITS, legs.clone(), Rises::WithCurrentDown);
    for _ in 0..SETTLING + 15 {
        assert_eq!(sense.read(), Sample::CURRENT_ZERO_SOUGHT);
    }
    assert_eq!(sense.read(), 0, "each leg has a zero of its own");
    // Forward, leg b low: 100 counts flow down through it. Leg a carries a share of the period, which tells nothing.
    sense.follow(Bridge::Driven, 500);
    legs[0].0.set(2100);
    legs[1].0.set(2160);
    assert_eq!(sense.read(), 100);
    // The motor brakes itself: the current flows up through leg b.
    legs[1].0.set(1960);
    assert_eq!(sense.read(), -100);
    // Reverse, leg a low: a current from b to a is negative and flows down through leg a.
    sense.follow(Bridge::Driven, -500);
    legs[0].0.set(2140);
    legs[1].0.set(2222);
    assert_eq!(sense.read(), -100);
    sense.follow(Bridge::Shorted, 0);
    assert_eq!(sense.read(), -100, "both legs are low: the one that was looked at tells it on");
}

/// An amplifier with its inputs the other way round.
#[test]
fn a_shunt_that_reads_the_other_way_round_tells_the_same_current() {
    let legs = [Channel::reading(2040), Channel::reading(2060)];
    let mut sense = LowLegSense::new(LIMITS, legs.clone(), Rises::WithCurrentUp);
    (0..SETTLING + 16).for_each(|_| _ = sense.read());
    sense.follow(Bridge::Driven, 500);
    legs[1].0.set(1960);
    assert_eq!(sense.read(), 100);
    sense.follow(Bridge::Driven, -500);
    legs[0].0.set(1940);
    assert_eq!(sense.read(), -100);
}

#[test]
fn two_shunts_know_no_current_before_both_have_a_zero() {
    let legs = [Channel::reading(2040), Channel::reading(4000)];
    let mut sense = LowLegSense::new(LIMITS, legs, Rises::WithCurrentDown);
    let last = (0..1000).map(|_| sense.read()).last();
    assert_eq!(last, Some(Sample::CURRENT_ZERO_OUTSIDE));
}

#[test]
fn si_values_of_one_count_follow_from_the_circuit() {
    let scale = Scale { reference_v: 3.3, bits: 12 };
    // 3.3 V / 4096 = 805.66 µV.
    assert!((scale.volt_per_lsb() - 805.664e-6).abs() < 1e-9);
    // 100 kΩ over 10 kΩ: 11 · 805.66 µV = 8.862 mV, full scale 36.3 V.
    let divider = Divider { upper_ohm: 100e3, lower_ohm: 10e3 };
    assert!((scale.supply_volt_per_lsb(divider) - 8.862_305e-3).abs() < 1e-8);
    // 450 µA/A into 2.49 kΩ is 1.1205 V/A: 719 µA per count.
    assert!((scale.ampere_per_lsb(1.1205) - 719.022e-6).abs() < 1e-9);
}

/// What is known after these readings, each with the bridge in this state.
fn found(readings: impl IntoIterator<Item = (u16, Bridge)>) -> Zero {
    let mut search = ZeroSearch::new(LIMITS);
    let step = |_, (raw, bridge)| search.step(raw, bridge);
    readings.into_iter().fold(Zero::Sought, step)
}

fn open(readings: impl IntoIterator<Item = u16>) -> impl Iterator<Item = (u16, Bridge)> {
    let settling = [(0, Bridge::Open); SETTLING];
    settling.into_iter().chain(readings.into_iter().map(|raw| (raw, Bridge::Open)))
}

#[test]
fn the_zero_is_the_rounded_mean_of_exactly_the_agreed_readings() {
    assert_eq!(found(open([2050; 15])), Zero::Sought, "one reading is missing");
    assert_eq!(found(open([2050; 16])), Zero::Known(2050));
    // Fourteen readings of 2050 and two of 2056: mean 2050.75.
    let uneven = (0..16).map(|k| if k < 2 { 2056 } else { 2050 });
    assert_eq!(found(open(uneven)), Zero::Known(2051));
}

/// A step of the readings at rest is no current, but neither is it believed at once.
#[test]
fn a_known_zero_moves_by_one_count_a_mean_at_rest_and_never_out_of_its_window() {
    let later = |raw, ticks| std::iter::repeat_n((raw, Bridge::Open), ticks);
    assert_eq!(found(open([2050; 16]).chain(later(2199, 15))), Zero::Known(2050));
    assert_eq!(found(open([2050; 16]).chain(later(2199, 16))), Zero::Known(2051));
    assert_eq!(found(open([2050; 16]).chain(later(1900, 33))), Zero::Known(2048));
    assert_eq!(found(open([2050; 16]).chain(later(2050, 160))), Zero::Known(2050));
    assert_eq!(found(open([2050; 16]).chain(later(4000, 160))), Zero::Known(2050), "outside of the window");
    let swinging = (0..160).map(|k| (2040 + 20 * (k % 2), Bridge::Open));
    assert_eq!(found(open([2050; 16]).chain(swinging)), Zero::Known(2050), "unsteady");
}

/// Sixteen ticks of settling and a whole mean of sixteen, with neither a motion nor a closed bridge between.
#[test]
fn a_known_zero_follows_nothing_while_the_bridge_is_closed_or_the_shaft_turns() {
    for bridge in [Bridge::Driven, Bridge::Shorted] {
        let driven = |ticks| std::iter::repeat_n((2100, bridge), ticks);
        let known = || open([2050; 16]).chain(driven(200));
        assert_eq!(found(known()), Zero::Known(2050));
        let at_rest = |ticks| std::iter::repeat_n((2100, Bridge::Open), ticks);
        assert_eq!(found(known().chain(at_rest(31)).chain(driven(1)).chain(at_rest(31))), Zero::Known(2050));
        assert_eq!(found(known().chain(at_rest(32))), Zero::Known(2051));
    }
    let mut search = ZeroSearch::new(LIMITS);
    for (raw, bridge) in open([2050; 16]) {
        // The first zero does not wait for a shaft that somebody turns.
        search.moved();
        search.step(raw, bridge);
    }
    for tick in 0..200 {
        if tick % 31 == 0 {
            search.moved();
        }
        assert_eq!(search.step(2100, Bridge::Open), Zero::Known(2050), "tick {tick}");
    }
}

/// A hold at a steady current reads like a zero, and so does a brake.
#[test]
fn a_current_of_a_bridge_that_is_not_open_is_never_taken_for_zero() {
    for bridge in [Bridge::Driven, Bridge::Shorted] {
        let held = [2150; 1000].map(|raw| (raw, bridge));
        assert_eq!(found(held), Zero::Missing(Reason::BridgeNotOpen));
        // The bridge opens in the middle of a mean, and the current decays.
        let decay = (0..SETTLING as u16).map(|k| (2150 - 6 * k, Bridge::Open));
        let rest = [2048; 16].map(|raw| (raw, Bridge::Open));
        let mixed = held.into_iter().take(12).chain(decay).chain(rest);
        assert_eq!(found(mixed), Zero::Known(2048));
    }
}

#[test]
fn the_wait_for_a_zero_is_bounded_and_ends_with_its_reason() {
    let swinging = |ticks: u16| open((0..ticks).map(|k| 2040 + 20 * (k % 2)));
    assert_eq!(found(swinging(48)), Zero::Sought, "three means more");
    assert_eq!(found(swinging(49)), Zero::Missing(Reason::Unsteady));
    assert_eq!(found(open([4095; 49])), Zero::Missing(Reason::OutsideWindow));
    // What was in vain at first is found later.
    let rest = [2050; 16].map(|raw| (raw, Bridge::Open));
    assert_eq!(found(swinging(64).chain(rest)), Zero::Known(2050));
}

// ── The axis as a value ─────────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn two_axes_in_one_array_keep_their_own_counts_currents_and_offsets() {
    let shafts = [Shaft::at(16, 0), Shaft::at(32, 7)];
    let currents = [Channel::reading(2048), Channel::reading(2060)];
    let mut joints: Vec<_> = (0..2)
        .map(|n| AxisHardware {
            bridge: HBridge::new(
                config(Wiring::TwoInputs, Decay::Slow),
                pwm_a(&[0, FULL]),
                pwm(&[0, FULL - 100 * (n as u16 + 1)]),
                NotConnected,
            )
            .unwrap(),
            encoder: Encoder::new(shafts[n].clone()),
            current: CurrentSense::new(CurrentKind::Signed, LIMITS, currents[n].clone()),
            supply: SupplySense::new(Some(Channel::reading(1354))),
        })
        .collect();
    for joint in &mut joints {
        for _ in 0..SETTLING + 16 {
            joint.sample();
        }
    }
    shafts[0].turn(-5);
    shafts[1].turn(9);
    currents[1].0.set(2000);
    let samples: Vec<Sample> = joints.iter_mut().map(AxisHardware::sample).collect();
    assert_eq!(samples[0], Sample { count: -5, vbus_raw: 1354, current_raw: 0 });
    assert_eq!(samples[1], Sample { count: 9, vbus_raw: 1354, current_raw: -60 });
    for (n, joint) in joints.iter_mut().enumerate() {
        joint.apply(Bridge::Driven, 100 * (n as i16 + 1)).unwrap();
    }
    for joint in joints {
        let (mut a, mut b, _) = joint.bridge.release();
        a.done();
        b.done();
    }
}
