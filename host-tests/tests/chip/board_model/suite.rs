//! What every board of the table has to do: its own data, the chip's code, and a model that is wired as its maker has published.

use super::chip::Drive;
use super::chip::stm32f405::board::{Board, GATES, SCALE};
use super::chip::stm32f405::drive::switch_off;
use super::rig::{Rig, TICK, order};
use super::{AXES, ROWS};
use crate::board_model::drv8301::{Drv8301, STARTED};
use crate::board_model::machine::{Chip, TIM1, TIM8};
use crate::board_model::motor::{Leg, Motor};
use crate::board_model::wires::{Lines, Wires};
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Bridge, Command, Output, Sample};
use servo::config::Config;
use servo::drivers::gates::Event;
use servo::drivers::sense::CurrentKind;
use servo::optional::Optional;
use servo::protect::{Fault, Interlock};
use servo::record::Activity;

const DRIVE: [(Bridge, i16); AXES] = [(Bridge::Driven, 2000); AXES];
const OPEN: [(Bridge, i16); AXES] = [(Bridge::Open, 0); AXES];

/// What the model's motor is, in the board's own counts.
fn config(board: &Board) -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 4000,
        rated_speed_rad_s: 240.0,
        tick_hz: 10_000,
        time_constant_hint_s: Optional::new(0.016),
        pwm_full_scale: 4200,
        vbus_v_per_lsb: SCALE.supply_volt_per_lsb(board.supply.divider),
        current_a_per_lsb: SCALE.ampere_per_lsb(board.stage.volt_per_ampere),
        ..Config::EXAMPLE
    }
}

fn configured(board: &'static Board, wires: Wires) -> (Rig<AXES>, [ServoAxis; AXES]) {
    let (mut rig, mut axes) = (Rig::<AXES>::new(board, wires, false), [(); AXES].map(|()| ServoAxis::new()));
    for (number, axis) in axes.iter_mut().enumerate() {
        axis.execute(&Order::configure(&config(board)).expect("a good one")).expect("open");
        rig.drive.configure(number, &config(board));
    }
    // The zero of the current sensor takes 1,040 ticks.
    (0..1_100).for_each(|_| _ = rig.image_tick(&mut axes));
    (rig, axes)
}

fn ticks(rig: &mut Rig<AXES>, axes: &mut [ServoAxis; AXES], number: usize) -> [Output; AXES] {
    (0..number).map(|_| rig.image_tick(axes)).last().expect("ticks")
}

fn motor(rig: &Rig<AXES>, number: usize) -> Motor {
    rig.bench.chip(|chip| chip.motors[number].clone())
}

#[test]
fn the_pins_of_the_probe_stay_as_they_are_after_a_reset() {
    for (name, board, wires) in ROWS {
        let rig = Rig::<AXES>::new(board, wires(), false);
        // An alternate function each; the data line fast; pulled up and pulled down.
        assert_eq!(rig.bench.chip(|chip| chip.probe_pins()), [0b1010, 0b0011, 0b1001], "{name}");
    }
}

#[test]
fn motors_move_where_they_are_told_and_their_currents_and_supply_come_back() {
    for (name, board, wires) in ROWS {
        let (mut rig, mut axes) = configured(board, wires());
        let configuration = config(board);
        for (number, axis) in axes.iter_mut().enumerate() {
            order(axis, Command::Arm);
            // Both directions.
            order(axis, Command::Position(if number % 2 == 0 { 6.0 } else { -4.0 }));
        }
        let mut seen = 0;
        let mut last = None;
        for _ in 0..2_500 {
            let before: Vec<f64> = (0..AXES).map(|number| motor(&rig, number).ampere).collect();
            let outputs = rig.image_tick(&mut axes);
            for (number, output) in outputs.iter().enumerate() {
                let told = f64::from(output.record.current_raw) * f64::from(configuration.current_a_per_lsb);
                // The sign of a mirror is a guess while the motor brakes.
                let told = match board.stage.current {
                    CurrentKind::Magnitude => told.abs().copysign(before[number]),
                    _ => told,
                };
                // Steady from tick to tick: the sample lies between two looks.
                let steady = (before[number] - motor(&rig, number).ampere).abs() < 0.15;
                if steady && before[number].abs() > 0.5 && number == 0 {
                    seen += 1;
                    assert!((told - before[number]).abs() < 0.35, "{name}: {told} A for {}", before[number]);
                }
            }
            last = Some(outputs);
        }
        assert!(seen > 50, "{name}: {seen} ticks with a current to compare");
        for (number, output) in last.expect("ticks").iter().enumerate() {
            assert_eq!((output.record.fault, output.record.activity), (Fault::None, Activity::Holding), "{name}");
            let (rad, target) = (motor(&rig, number).rad, if number % 2 == 0 { 6.0 } else { -4.0 });
            assert!((rad - target).abs() < 0.01, "{name}: axis {number} at {rad} rad");
            let supply = f32::from(output.record.vbus_raw) * configuration.vbus_v_per_lsb;
            assert!((supply - 12.0).abs() < 0.05, "{name}: {supply} V");
        }
        let ports = rig.bench.chip(|chip| chip.clocks.ports);
        assert_eq!(ports & 0b111, 0b111, "{name}: ports A to C have a clock");
        assert_eq!(ports >> 3 != 0, GATES.is_some(), "{name}: port D, with PD2");
    }
}

/// In full ticks, with the dead time of the bridge's own timer taken off where it has one.
#[test]
fn a_duty_drives_its_share_of_the_period_in_both_directions() {
    for (name, board, wires) in ROWS {
        let mut rig = Rig::<AXES>::new(board, wires(), false);
        let dead = match name {
            "stm32f405" => 0,
            // TIM_1_8_DEADTIME_CLOCKS, and 360 ns at 168 MHz.
            "vesc-6" => 61,
            _ => 20,
        };
        for (duty, forward) in [(1050, [Leg::High, Leg::Low]), (-2100, [Leg::Low, Leg::High])] {
            let edges = rig.record([(Bridge::Driven, duty); AXES]);
            for axis in 0..AXES {
                let pairs = edges.windows(2).filter(|pair| pair[0].1[axis] == forward);
                let driven: u64 = pairs.map(|pair| pair[1].0 - pair[0].0).sum();
                let expected = 2 * TICK * u64::from(duty.unsigned_abs()) / 4200 - 4 * dead;
                assert_eq!(driven, expected, "{name}: axis {axis}, duty {duty}");
            }
        }
        // Full duty stays on.
        rig.record([(Bridge::Driven, 4200); AXES]);
        assert_eq!(rig.legs(), [[Leg::High, Leg::Low]; AXES], "{name}");
    }
}

#[test]
fn a_fault_line_that_goes_low_opens_every_bridge_within_two_ticks() {
    for (name, board, wires) in ROWS {
        let mut rig = Rig::<AXES>::new(board, wires(), false);
        (0..3).for_each(|_| rig.tick(DRIVE));
        rig.bench.chip(|chip| chip.hold_fault(true));
        (0..2).for_each(|_| rig.tick(DRIVE));
        for axis in 0..AXES.min(2) {
            assert_eq!(rig.drive.interlock(axis), Interlock::BridgeFault, "{name}");
            assert_eq!(rig.legs()[axis], [Leg::Open; 2], "{name}");
        }
        // It is gone, and nobody asked for an open bridge since.
        rig.bench.chip(|chip| chip.hold_fault(false));
        (0..5).for_each(|_| rig.tick(DRIVE));
        assert_eq!(rig.legs()[0], [Leg::Open; 2], "{name}");
    }
}

/// A board that lets go of its own power switch is off.
#[test]
fn outputs_that_the_maker_s_firmware_sets_from_the_start_are_set() {
    for (name, board, wires) in ROWS {
        let wires = wires();
        let (high, low) = (wires.high, wires.low);
        let rig = Rig::<AXES>::new(board, wires, false);
        rig.bench.chip(|chip| {
            high.iter().for_each(|pin| assert_eq!(chip.drives(*pin), Some(true), "{name}: {pin:?}"));
            low.iter().for_each(|pin| assert_eq!(chip.drives(*pin), Some(false), "{name}: {pin:?}"));
        });
    }
}

/// What handlers of panics and faults call: it knows no state, and no tick comes after it.
#[test]
fn the_way_off_clears_every_timer_and_puts_every_driver_to_sleep() {
    for (name, board, wires) in ROWS {
        let mut rig = Rig::<AXES>::new(board, wires(), false);
        (0..3).for_each(|_| rig.tick(DRIVE));
        switch_off::<AXES>(board);
        let outputs_enabled = |chip: &mut Chip| [TIM1, TIM8].map(|timer| chip.read(timer + 0x44) >> 15 & 1);
        assert_eq!(rig.bench.chip(outputs_enabled), [0, 0], "{name}");
        let sleeping = rig.bench.chip(|chip| match &wires().drivers {
            Some(drivers) => !chip.is_high(drivers.enable),
            None => wires().bridges.iter().all(|bridge| match bridge.lines {
                Lines::Inputs(_, sleep) => !chip.is_high(sleep),
                Lines::Gates(_) => true,
            }),
        });
        assert!(sleeping, "{name}");
        rig.bench.chip(|chip| chip.run(2 * TICK));
        assert_eq!(rig.legs(), [[Leg::Open; 2]; AXES], "{name}");
    }
}

/// An amplifier at 80 V/V drifts by a count of 20 mA for each degree or so.
#[test]
fn the_zero_of_the_current_follows_a_drift_at_rest_and_not_a_motion() {
    for (name, board, wires) in ROWS {
        let (mut rig, mut axes) = configured(board, wires());
        let told = |rig: &mut Rig<AXES>, axes: &mut [ServoAxis; AXES], number| {
            // Of which sign it is depends on the way round of the amplifier.
            ticks(rig, axes, number).map(|output| output.record.current_raw.abs())
        };
        let turn = |rig: &Rig<AXES>, speed| {
            rig.bench.chip(|chip| chip.motors.iter_mut().for_each(|motor| motor.turned = speed));
        };
        assert_eq!(told(&mut rig, &mut axes, 1), [0; AXES], "{name}");
        rig.bench.chip(|chip| chip.drift = 3.0);
        assert_eq!(told(&mut rig, &mut axes, 1), [3; AXES], "{name}");
        // Somebody turns the shafts: two means would have fitted in.
        turn(&rig, Some(5.0));
        assert_eq!(told(&mut rig, &mut axes, 2_500), [3; AXES], "{name}");
        // They stand: a count for each mean.
        turn(&rig, Some(0.0));
        assert_eq!(told(&mut rig, &mut axes, 1_200), [2; AXES], "{name}");
        assert_eq!(told(&mut rig, &mut axes, 2_200), [0; AXES], "{name}");
        // A held shaft carries a current that must not become the zero.
        rig.bench.chip(|chip| chip.drift = 6.0);
        (0..2_500).for_each(|_| rig.tick([(Bridge::Driven, 0); AXES]));
        assert_eq!(told(&mut rig, &mut axes, 1), [3; AXES], "{name}");
    }
}

// ── Gate drivers ────────────────────────────────────────────────────────────────────────────────────────────────────

/// Rows that share their data have the same drivers: one of them does.
fn gated() -> impl Iterator<Item = (&'static str, &'static Board, fn() -> Wires)> {
    ROWS.into_iter().take(usize::from(GATES.is_some()))
}

fn with_drivers(change: impl Fn(&mut Drv8301)) -> impl Fn(&mut Chip) {
    move |chip| chip.drivers.iter_mut().for_each(&change)
}

/// SLOS719: OC_MODE 01 is latched shut-down; GAIN 01 is 20 V/V, 11 is 80 V/V. OC_ADJ_SET 21 is the ODrive firmware's
/// `VdsLevel_0p730_V`; 16 is 0.403 V.
#[test]
fn gate_drivers_hold_what_the_board_wants_before_anything_is_driven() {
    for (name, board, wires) in gated() {
        for deaf in [0, 3] {
            let rig = Rig::<AXES>::prepared(board, wires(), false, with_drivers(|driver| driver.deaf = deaf));
            let (trip, gain) = if name == "vesc-6" { (16, 1) } else { (21, 3) };
            rig.bench.chip(|chip| {
                assert_eq!(chip.drivers.len(), AXES);
                for driver in &chip.drivers {
                    assert_eq!(driver.starts, 1, "{name}: the enable line stays low until then");
                    assert_eq!(driver.registers[2..], [trip << 6 | 1 << 4, gain << 2], "{name}, deaf {deaf}");
                }
            });
            assert_eq!(rig.told, [Event::Started], "{name}");
        }
    }
}

/// Flags that stay are no flags of the start.
#[test]
fn a_driver_whose_gate_supply_stays_low_does_not_start_and_is_told() {
    for (name, board, wires) in gated() {
        let mut rig =
            Rig::<AXES>::prepared(board, wires(), false, with_drivers(|driver| driver.starved = true));
        match rig.told[..] {
            [Event::NotStarted(0, trouble)] => assert_eq!(trouble.words(), ("gate supply too low", STARTED)),
            ref other => panic!("{name}: {other:?}"),
        }
        rig.bench.chip(|chip| with_drivers(|driver| driver.starved = false)(chip));
        (0..5_500).for_each(|_| rig.tick(OPEN));
        assert_eq!(rig.told[1..], [Event::Started], "{name}");
    }
}

/// 0.3 V from an amplifier that is off would be 34 A on an ODrive.
#[test]
fn amplifiers_that_are_off_tell_no_current_while_drivers_start_anew() {
    for (name, board, wires) in gated() {
        let (mut rig, mut axes) = configured(board, wires());
        (0..300).for_each(|_| rig.tick(DRIVE));
        rig.bench.chip(|chip| chip.drivers[0].overload());
        (0..300).for_each(|_| rig.tick(OPEN));
        let mut unsensed = 0;
        for tick in 0..6_500 {
            for (number, output) in rig.image_tick(&mut axes).into_iter().enumerate() {
                match Sample::sensed(output.record.current_raw) {
                    Some(raw) => assert!(raw.abs() < 3, "{name}: {raw} of axis {number} in tick {tick}"),
                    None => unsensed += 1,
                }
            }
        }
        assert_eq!(rig.told.last(), Some(&Event::Started), "{name}");
        assert!(unsensed > 4_000, "{name}: {unsensed} ticks while they were off");
        let sensed = axes.each_ref().map(|axis| Sample::sensed(axis.record().current_raw).is_some());
        assert_eq!(sensed, [true; AXES], "{name}: afterwards");
        drop(rig);
        // With the enable line low from the start there is a mark, and no zero of what the amplifier is not.
        let mut rig =
            Rig::<AXES>::prepared(board, wires(), false, with_drivers(|driver| driver.deaf = u32::MAX));
        for _ in 0..3_000 {
            rig.tick(OPEN);
            assert_eq!(rig.drive.sample(0).current_raw, Sample::CURRENT_NOT_SENSED, "{name}");
        }
    }
}

#[test]
fn a_driver_that_does_not_answer_forbids_driving_and_is_asked_again() {
    for (name, board, wires) in gated() {
        for last in [false, true] {
            let mut rig = Rig::<AXES>::prepared(board, wires(), false, |chip| {
                let drivers = &mut chip.drivers;
                let number = if last { drivers.len() - 1 } else { 0 };
                drivers[number].deaf = u32::MAX;
            });
            assert!(matches!(rig.told[..], [Event::NotStarted(..)]), "{name}: {:?}", rig.told);
            for _ in 0..50 {
                rig.tick(DRIVE);
                assert!((0..AXES).all(|axis| rig.drive.interlock(axis) == Interlock::BridgeFault));
                assert_eq!(rig.legs(), [[Leg::Open; 2]; AXES], "{name}");
            }
            // It listens at last. Half a second of rest, 20 ms of waking.
            rig.bench.chip(|chip| with_drivers(|driver| driver.deaf = 0)(chip));
            (0..5_500).for_each(|_| rig.tick(OPEN));
            assert_eq!(rig.told.last(), Some(&Event::Started), "{name}: {:?}", rig.told);
            (0..3).for_each(|_| rig.tick([(Bridge::Driven, 4200); AXES]));
            assert_eq!(rig.legs(), [[Leg::High, Leg::Low]; AXES], "{name}");
        }
    }
}

#[test]
fn a_latched_over_current_is_told_and_ends_with_a_new_start_and_a_new_command() {
    for (name, board, wires) in gated() {
        let (mut rig, mut axes) = configured(board, wires());
        axes.iter_mut().for_each(|axis| order(axis, Command::Arm));
        axes.iter_mut().for_each(|axis| order(axis, Command::Position(60.0)));
        ticks(&mut rig, &mut axes, 300);
        // The load drives it on, faster than a driver would start: 10 V at its terminals.
        let turn = |chip: &mut Chip, speed| chip.motors.iter_mut().for_each(|motor| motor.turned = speed);
        rig.bench.chip(|chip| {
            chip.drivers[0].overload();
            turn(chip, Some(200.0));
        });
        let last = ticks(&mut rig, &mut axes, 5);
        for output in last {
            assert_eq!((output.record.fault, output.bridge), (Fault::BridgeFault, Bridge::Open), "{name}");
        }
        match rig.told[..] {
            [Event::Started, Event::Fault(0, trouble)] => assert_eq!(trouble.words().0, "over-current", "{name}"),
            ref other => panic!("{name}: {other:?}"),
        }
        // Half a second of rest is too short for this load.
        ticks(&mut rig, &mut axes, 5_500);
        assert!(matches!(rig.told[2..], [Event::NotStarted(..)]), "{name}: {:?}", rig.told);
        rig.bench.chip(|chip| turn(chip, Some(0.0)));
        ticks(&mut rig, &mut axes, 5_500);
        rig.bench.chip(|chip| turn(chip, None));
        assert_eq!(rig.told[3..], [Event::Started], "{name}");
        assert_eq!(rig.legs(), [[Leg::Open; 2]; AXES], "{name}: nobody has armed an axis again");
        let begin = motor(&rig, 0).rad;
        axes.iter_mut().for_each(|axis| order(axis, Command::Stop));
        ticks(&mut rig, &mut axes, 2);
        axes.iter_mut().for_each(|axis| order(axis, Command::Arm));
        axes.iter_mut().for_each(|axis| order(axis, Command::Position((begin + 3.0) as f32)));
        ticks(&mut rig, &mut axes, 2_500);
        assert!((motor(&rig, 0).rad - begin - 3.0).abs() < 0.01, "{name}");
    }
}

/// Its gain is back at 10: the current would be told eight times too small.
#[test]
fn a_driver_that_forgets_its_settings_is_noticed_within_a_tenth_of_a_second() {
    for (name, board, wires) in gated() {
        let mut rig = Rig::<AXES>::new(board, wires(), false);
        (0..500).for_each(|_| rig.tick(DRIVE));
        assert_eq!(rig.told, [Event::Started], "{name}");
        rig.bench.chip(|chip| chip.drivers[AXES - 1].forget());
        let ticks = (0..1_100).take_while(|_| {
            rig.tick(DRIVE);
            rig.legs()[0] != [Leg::Open; 2]
        });
        let ticks = ticks.count();
        assert!(ticks <= 1_010, "{name}: {ticks} ticks");
        (0..3).for_each(|_| rig.tick(DRIVE));
        assert!(matches!(rig.told[1..], [Event::Fault(number, _), ..] if number == AXES - 1), "{name}");
    }
}

/// What `Hello` says of a board, and `truing monitor --board` prints.
#[test]
fn a_board_tells_how_its_gate_drivers_are_and_where_its_currents_are_zero() {
    for (name, board, wires) in ROWS {
        let (rig, _) = configured(board, wires());
        let state = rig.drive.gates().map(|gates| gates.state);
        assert_eq!(state, GATES.map(|_| servo::drivers::gates::State::Ready), "{name}");
        let (low, high) = board.stage.zero_window;
        for axis in 0..AXES {
            let zero = rig.drive.zeros(axis)[0];
            assert!((low..=high).contains(&zero.try_into().expect("known")), "{name}, axis {axis}: {zero}");
        }
    }
}
