use super::clocks::Clocks;
use super::machine::Chip;
use super::motor::Leg;
use super::own::chip::Drive;
use super::own::chip::stm32f405::board::Board;
use super::own::chip::stm32f405::chosen::OWN;
use super::own::chip::stm32f405::clock::{self, Source};
use super::own::chip::stm32f405::pac::Peripherals;
use super::own::chip::stm32f405::stage;
use super::own::rig::{Rig, TICK, WORK, order};
use super::trap::Bench;
use super::wires::Wires;
use super::{odrive, own, vesc};
use servo::axis::Bridge;
use servo::axis::Command;
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::config::Config;
use servo::link::protocol::ResetCause;
use servo::optional::Optional;
use servo::protect::{Fault, Interlock};
use servo::record::Activity;
use std::collections::BTreeSet;

pub const CARRIER: Board = Board { stage: &stage::DRV8874, ..OWN };
const DISCRETE: Board = Board { stage: &stage::DISCRETE, ..OWN };
/// Clocks of half a PWM period of 20 kHz.
const HALF: u64 = 4_200;

/// The board of `docs/hardware.md` with one of its stages.
pub fn on<const N: usize>(board: &'static Board, late: bool) -> Rig<N> {
    let wires = if board.stage.has_low_sides() { Wires::discrete() } else { Wires::carrier() };
    Rig::new(board, wires, late)
}

#[test]
fn every_board_of_the_table_that_is_no_program_is_run() {
    let run = [own::ROW_NAMES, odrive::ROW_NAMES, vesc::ROW_NAMES].concat();
    let table: BTreeSet<&str> = boards::real().map(|board| board.name).collect();
    assert_eq!(run.iter().copied().collect::<BTreeSet<_>>(), table);
    assert_eq!(run.len(), table.len());
}

fn drives(legs: [Leg; 2]) -> bool {
    matches!(legs, [Leg::High, Leg::Low] | [Leg::Low, Leg::High])
}

/// Clocks for which axis 0 is driven so in two ticks, and the middles of the driven parts.
fn driven(edges: &[(u64, Vec<[Leg; 2]>)], forward: [Leg; 2]) -> (u64, Vec<u64>) {
    let parts = edges.windows(2).filter(|pair| pair[0].1[0] == forward).map(|pair| (pair[0].0, pair[1].0));
    let parts: Vec<(u64, u64)> = parts.collect();
    (parts.iter().map(|(from, to)| to - from).sum(), parts.iter().map(|(from, to)| (from + to) / 2).collect())
}

#[test]
fn a_quarter_of_full_duty_drives_a_quarter_of_the_time_and_the_current_is_sampled_in_its_middle() {
    for late in [false, true] {
        for (duty, forward) in [(1050, [Leg::High, Leg::Low]), (-1050, [Leg::Low, Leg::High])] {
            let mut rig = on::<1>(&CARRIER, late);
            let edges = rig.record([(Bridge::Driven, duty)]);
            let (clocks, middles) = driven(&edges, forward);
            assert_eq!(clocks, 2 * TICK / 4, "late {late}, duty {duty}");
            // The update is the trigger: 28 clocks of 21 MHz later the sample is taken.
            let sampled = rig.bench.chip(|chip| chip.sampled[0]);
            let off = middles.iter().map(|middle| (sampled - 28 * 8).abs_diff(*middle)).min();
            assert_eq!(off, Some(0), "late {late}, duty {duty}: {middles:?}, {sampled}");
        }
    }
}

#[test]
fn no_duty_brakes_and_full_duty_never_lets_go() {
    let mut rig = on::<1>(&CARRIER, false);
    for (duty, legs) in
        [(0, [Leg::High, Leg::High]), (4200, [Leg::High, Leg::Low]), (-4200, [Leg::Low, Leg::High])]
    {
        rig.record([(Bridge::Driven, duty)]);
        assert_eq!(rig.legs(), [legs], "{duty}");
        let edges = rig.record([(Bridge::Driven, duty)]);
        assert_eq!(edges.len(), 2, "no edge but begin and end: {edges:?}");
    }
    rig.record([(Bridge::Open, 0)]);
    assert_eq!(rig.legs(), [[Leg::Open; 2]]);
}

/// Whatever the program takes, levels change at the update alone.
#[test]
fn a_duty_acts_at_the_update_that_ends_its_tick() {
    let mut rig = on::<1>(&CARRIER, false);
    rig.begin();
    rig.drive.set(0, Bridge::Driven, 4200);
    let set = rig.bench.chip(|chip| {
        chip.watch();
        chip.now
    });
    rig.bench.chip(Chip::run_to_tick);
    let acted = rig.bench.chip(|chip| chip.edges[1].0);
    // The measurement ends 40 clocks of the converter after the update.
    let update = rig.bench.chip(|chip| chip.now) - 40 * 8;
    assert_eq!(acted, update);
    assert!(acted > set + TICK / 2);
}

#[test]
fn a_discrete_bridge_never_has_both_switches_on_and_rests_for_the_dead_time() {
    let mut rig = on::<1>(&DISCRETE, false);
    for duty in [-4200, -1050, -1, 0, 1, 1050, 4200] {
        let edges = rig.record([(Bridge::Driven, duty)]);
        // A leg that leaves one side is open for 500 ns (84 clocks) before it takes the other.
        for leg in 0..2 {
            let mut of_leg: Vec<(u64, Leg)> = edges.iter().map(|(at, legs)| (*at, legs[0][leg])).collect();
            of_leg.dedup_by_key(|edge| edge.1);
            for three in of_leg.windows(3).filter(|three| three[1].1 == Leg::Open) {
                let open = three[2].0 - three[1].0;
                // A pulse that is shorter than the dead time never reaches the other side.
                assert!(open == 84 || open > 84 && three[0].1 == three[2].1, "duty {duty}: {three:?}");
            }
            let jumps = of_leg.windows(2).filter(|two| two[0].1 != Leg::Open && two[1].1 != Leg::Open);
            assert_eq!(jumps.count(), 0, "duty {duty}");
        }
    }
    // Bootstrap: 4 % of every period the low side is on, less the dead time before it.
    let edges = rig.record([(Bridge::Driven, 4200)]);
    let low: u64 =
        edges.windows(2).filter(|pair| pair[0].1[0][0] == Leg::Low).map(|pair| pair[1].0 - pair[0].0).sum();
    assert_eq!(low, 2 * TICK / (2 * HALF) * (336 - 84));
}

// ── Clocks ──────────────────────────────────────────────────────────────────────────────────────────────────────────

/// Starts the clocks as the image does: what they come from, and the chip's clocks afterwards.
fn started(clocks: Clocks) -> (Source, Clocks) {
    let mut chip = Chip::new(Vec::new(), Wires::carrier(), false);
    chip.clocks = clocks;
    let bench = Bench::new(chip);
    // SAFETY: as above.
    let device = unsafe { Peripherals::steal() };
    let source = clock::start(&device.RCC, &device.FLASH, &device.DBGMCU, &device.TIM11);
    (source, bench.chip(|chip| std::mem::replace(&mut chip.clocks, Clocks::new(0.0, 1.0))))
}

#[test]
fn every_cause_of_a_reset_is_told_once() {
    // RM0090 section 7.3.21: each cause sets the flag of the pin, too.
    let causes = [
        (30, ResetCause::Watchdog),
        (29, ResetCause::Watchdog),
        (28, ResetCause::Software),
        (27, ResetCause::Power),
        (25, ResetCause::Power),
        (26, ResetCause::Pin),
    ];
    for (bit, cause) in causes {
        let mut chip = Chip::new(Vec::new(), Wires::carrier(), false);
        chip.clocks.causes = 1 << bit | 1 << 26;
        let _bench = Bench::new(chip);
        // SAFETY: as above.
        let device = unsafe { Peripherals::steal() };
        assert_eq!(clock::take_reset_cause(&device.RCC), cause, "bit {bit}");
        assert_eq!(clock::take_reset_cause(&device.RCC), ResetCause::Pin, "bit {bit} is told twice");
    }
}

#[test]
fn every_crystal_that_boards_carry_is_recognised_and_makes_168_mhz() {
    for crystal in [8_000_000, 12_000_000, 16_000_000, 25_000_000] {
        for internal in [0.92, 1.0, 1.045] {
            let (source, clocks) = started(Clocks::new(f64::from(crystal), internal));
            assert_eq!(source, Source::Crystal(crystal), "internal oscillator {internal}");
            assert_eq!(clocks.hertz(), [168e6, 42e6, 84e6], "{crystal} Hz");
            assert!(clocks.watches_the_crystal() && clocks.prefetches());
        }
    }
}

#[test]
fn without_a_known_crystal_the_internal_oscillator_makes_168_mhz() {
    for crystal in [0.0, 4e6, 10e6, 20e6] {
        let (source, clocks) = started(Clocks::new(crystal, 1.0));
        assert_eq!((source, clocks.hertz()), (Source::Internal, [168e6, 42e6, 84e6]), "{crystal} Hz");
        assert!(!clocks.watches_the_crystal());
    }
}

#[test]
fn a_pll_that_a_boot_loader_has_left_running_is_set_anew() {
    let (source, clocks) = started(Clocks::behind_a_boot_loader(12e6));
    assert_eq!((source, clocks.hertz()), (Source::Crystal(12_000_000), [168e6, 42e6, 84e6]));
}

#[test]
fn the_revision_whose_prefetch_fails_runs_without_it() {
    let mut clocks = Clocks::new(8e6, 1.0);
    clocks.revision = 0x1000;
    assert!(!started(clocks).1.prefetches());
}

// ── Several axes ────────────────────────────────────────────────────────────────────────────────────────────────────

const DRIVE: (Bridge, i16) = (Bridge::Driven, 2000);
const OPEN: (Bridge, i16) = (Bridge::Open, 0);

/// Finding B4 of the audit: axis 0 opened, cleared the break and enabled the outputs before axis 1 had looked.
#[test]
fn a_break_of_a_microsecond_opens_both_axes_of_its_timer_whenever_it_comes() {
    // In clocks from the beginning of a tick, so that it falls before, between and behind the steps of the axes.
    for at in (0..TICK).step_by(1_100) {
        for first in [OPEN, DRIVE] {
            let mut rig = on::<4>(&CARRIER, false);
            (0..3).for_each(|_| rig.tick([first, DRIVE, DRIVE, DRIVE]));
            let mut told = [Interlock::Granted; 2];
            let (mut clocks, mut waiting) = (0, true);
            for _ in 0..4 {
                rig.begin();
                for axis in 0..4 {
                    let wanted = if axis == 0 { first } else { DRIVE };
                    let wanted = match rig.drive.interlock(axis) {
                        Interlock::Granted if axis == 0 && told[0] != Interlock::Granted => OPEN,
                        Interlock::Granted => wanted,
                        // Axis 0 does as it is told; axis 1 does not understand.
                        fault if axis < 2 => {
                            told[axis] = fault;
                            if axis == 0 { OPEN } else { DRIVE }
                        }
                        fault => panic!("axis {axis} is told {fault:?}"),
                    };
                    rig.bench.chip(|chip| {
                        chip.run(WORK);
                        clocks += WORK;
                        if waiting && clocks >= at {
                            waiting = false;
                            chip.pulse_fault(0);
                            chip.watch();
                        }
                    });
                    rig.drive.set(axis, wanted.0, wanted.1);
                }
                clocks = clocks.next_multiple_of(TICK);
            }
            assert_eq!(told, [Interlock::BridgeFault; 2], "break at {at}");
            rig.bench.chip(|chip| {
                let stray = chip.edges.iter().find(|(_, legs)| drives(legs[0]) || drives(legs[1]));
                assert_eq!(stray, None, "break at {at}, axis 0 {first:?}");
                assert!(chip.edges.iter().any(|(_, legs)| drives(legs[2])), "the other timer goes on");
            });
        }
    }
}

/// Finding B5 of the audit: counters were read in the loop over the axes, each after the work of those before it.
#[test]
fn shafts_that_turn_alike_are_counted_alike_however_long_the_axes_compute() {
    let mut rig = on::<4>(&CARRIER, false);
    rig.bench.chip(|chip| {
        for motor in &mut chip.motors {
            // 60 counts in a tick.
            (motor.rad, motor.turned) = (0.0, Some(942.48));
        }
    });
    let begin = [0, 1, 2, 3].map(|axis| rig.drive.sample(axis).count);
    for tick in 1..1_200i32 {
        rig.begin();
        let mut counts = [0; 4];
        for (axis, count) in counts.iter_mut().enumerate() {
            let work = 400 + (tick as u64 * 977 + axis as u64 * 311) % 3_200;
            rig.bench.chip(|chip| chip.run(work));
            *count = rig.drive.sample(axis).count - begin[axis];
            rig.drive.set(axis, Bridge::Open, 0);
        }
        assert!(counts.iter().all(|count| *count == counts[0]), "tick {tick}: {counts:?}");
    }
    let far = rig.drive.sample(1).count - begin[1];
    assert!(far > 65_536, "the counters of 16 bits have gone round: {far}");
}

#[test]
fn an_open_contact_opens_every_bridge_within_two_ticks() {
    let mut rig = on::<4>(&CARRIER, false);
    (0..3).for_each(|_| rig.tick([DRIVE; 4]));
    // Just after a look.
    rig.begin();
    let opened = rig.bench.chip(|chip| {
        chip.enable(false);
        chip.now
    });
    (0..4).for_each(|axis| rig.drive.set(axis, Bridge::Driven, 2000));
    (0..3).for_each(|_| rig.tick([DRIVE; 4]));
    assert!(rig.legs().iter().all(|legs| *legs == [Leg::Open; 2]));
    let last = rig.bench.chip(|chip| {
        let driving = |(_, legs): &&(u64, Vec<[Leg; 2]>)| legs.iter().any(|legs| *legs != [Leg::Open; 2]);
        let last = chip.edges.iter().rposition(|edge| driving(&edge)).expect("it was driven");
        chip.edges[last + 1].0
    });
    assert!(last - opened <= 2 * TICK, "{} ticks", (last - opened) as f64 / TICK as f64);
}

/// Something holds the processor up for two periods: one measurement ends unseen.
#[test]
fn a_tick_that_is_lost_is_an_overrun() {
    let mut rig = on::<1>(&CARRIER, false);
    rig.tick([OPEN]);
    rig.bench.chip(|chip| {
        chip.run_to_tick();
        chip.run_to_tick();
    });
    rig.drive.begin_tick();
    rig.drive.set(0, Bridge::Open, 0);
    assert!(rig.drive.end_tick());
    rig.tick([OPEN]);
    // Another rate is no lost tick.
    rig.drive.configure(0, &Config { tick_hz: 1_000, ..config() });
    (0..5).for_each(|_| rig.tick([OPEN]));
}

// ── Closed loop ─────────────────────────────────────────────────────────────────────────────────────────────────────

/// What the model's motor is: 240 rad/s at 12 V, 16 ms.
fn config() -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 4000,
        rated_speed_rad_s: 240.0,
        tick_hz: 10_000,
        time_constant_hint_s: Optional::new(0.016),
        pwm_full_scale: 4200,
        vbus_v_per_lsb: 36.3 / 4096.0,
        current_a_per_lsb: 3.3 / 4096.0 / 1.1205,
        ..Config::EXAMPLE
    }
}

fn closed_loop<const N: usize>(board: &'static Board) -> (Rig<N>, [ServoAxis; N]) {
    let (mut rig, mut axes) = (on::<N>(board, false), [(); N].map(|()| ServoAxis::new()));
    let per_lsb = if board.stage.has_low_sides() { 3.3 / 4096.0 / 0.1 } else { 3.3 / 4096.0 / 1.1205 };
    let config = Config { current_a_per_lsb: per_lsb, ..config() };
    for (number, axis) in axes.iter_mut().enumerate() {
        axis.execute(&Order::configure(&config).expect("a good one")).expect("open");
        rig.drive.configure(number, &config);
    }
    // The zero of the current sensor takes 1,040 ticks.
    (0..1_100).for_each(|_| _ = rig.image_tick(&mut axes));
    (rig, axes)
}

#[test]
fn a_motor_behind_the_registers_of_the_board_moves_where_it_is_told() {
    for board in [&CARRIER, &DISCRETE] {
        let (mut rig, mut axes) = closed_loop::<1>(board);
        order(&mut axes[0], Command::Arm);
        order(&mut axes[0], Command::Position(6.0));
        let mut highest = 0i16;
        let last = (0..2_500).map(|_| {
            let [output] = rig.image_tick(&mut axes);
            highest = highest.max(output.record.current_raw);
            output
        });
        let record = last.last().expect("ticks").record;
        assert_eq!((record.fault, record.activity), (Fault::None, Activity::Holding));
        let rad = rig.bench.chip(|chip| chip.motors[0].rad);
        assert!((rad - 6.0).abs() < 0.01, "{} at {rad} rad", board.stage.name);
        assert!(highest > 20, "the current comes back through the converter: {highest}");
    }
}

#[test]
fn four_motors_move_to_four_places_and_a_break_stops_two_of_them() {
    let (mut rig, mut axes) = closed_loop::<4>(&CARRIER);
    for (number, axis) in axes.iter_mut().enumerate() {
        order(axis, Command::Arm);
        order(axis, Command::Position(2.0 * (number as f32 + 1.0)));
    }
    (0..2_000).for_each(|_| _ = rig.image_tick(&mut axes));
    for number in 0..4 {
        let rad = rig.bench.chip(|chip| chip.motors[number].rad);
        assert!((rad - 2.0 * (number as f64 + 1.0)).abs() < 0.01, "axis {number} at {rad} rad");
    }
    axes.iter_mut().for_each(|axis| order(axis, Command::Position(20.0)));
    (0..200).for_each(|_| _ = rig.image_tick(&mut axes));
    rig.bench.chip(|chip| chip.pulse_fault(1));
    let last = (0..2_500).map(|_| rig.image_tick(&mut axes)).last().expect("ticks");
    let faults = last.map(|output| output.record.fault);
    assert_eq!(faults, [Fault::None, Fault::None, Fault::BridgeFault, Fault::BridgeFault]);
    for (number, output) in last.iter().enumerate() {
        let rad = rig.bench.chip(|chip| chip.motors[number].rad);
        match number {
            0 | 1 => assert!((rad - 20.0).abs() < 0.01, "axis {number} at {rad} rad"),
            _ => assert_eq!(output.bridge, Bridge::Open),
        }
    }
}
