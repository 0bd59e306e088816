//! Faults injected into a running loop: found, named as far as the data allow, bridge open in time.

use servo::axis::Command;
use servo::axis::{Bridge, Refusal, Sample};
use servo::protect::Fault;
use std::f64::consts::TAU;
use trials::bench::Bench;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::tracking::exact;

const TICK_HZ: u32 = 10_000;

fn knowing(family: Family, seed: u32) -> (Plant, Bench) {
    let options = Options { tick_hz: TICK_HZ, ..Options::default() };
    let plant = Plant::draw(family, Severity::Harsh, Seeds::Design(seed), &options);
    let mut bench = Bench::new(&plant);
    bench.run(0.01, |_, _| {});
    bench.axis.adopt(&mut bench.state, &exact(&plant)).expect("idle");
    bench.axis.command(&mut bench.state, &Command::Arm).expect("no fault");
    (plant, bench)
}

fn sine(plant: &Plant, bench: &mut Bench) {
    let peak = 0.3 * plant.truth.gain * 12.0;
    let command =
        Command::TrackSine { amplitude_rad: (peak / TAU) as f32, frequency_hz: 1.0, duration_ms: 20_000 };
    bench.axis.command(&mut bench.state, &command).expect("armed and identified");
}

/// Runs with falsified samples until the bridge opens; ticks, or `None` after `seconds`.
fn until_open(bench: &mut Bench, seconds: f64, falsify: impl Fn(Sample) -> Sample) -> Option<u32> {
    (0..(seconds * f64::from(TICK_HZ)) as u32).find(|_| {
        let sample = falsify(bench.board.sample());
        let output = bench.axis.step(&mut bench.state, sample);
        bench.board.pass(output.bridge, output.duty);
        output.bridge == Bridge::Open
    })
}

#[test]
fn an_encoder_that_is_unplugged_in_motion_opens_the_bridge_within_a_third_of_the_time_constant() {
    for (family, seed) in [(Family::G1, 1), (Family::G2, 2), (Family::G3, 3), (Family::G2, 4)] {
        let (plant, mut bench) = knowing(family, seed);
        sine(&plant, &mut bench);
        bench.run(1.95, |_, _| {});
        let frozen = bench.board.sample().count;
        let ticks = until_open(&mut bench, 3.0, |sample| Sample { count: frozen, ..sample }).expect("found");
        // A current sensor has learned the winding in two seconds of motion.
        let named = if plant.sensing.current { Fault::EncoderUnplugged } else { Fault::NoMotion };
        assert_eq!(bench.state.fault(), named, "{family:?}");
        let limit = (0.3 * plant.truth.time_constant_s).max(0.02) + 0.02;
        let seconds = f64::from(ticks) / f64::from(TICK_HZ);
        assert!(seconds < limit, "{family:?}: {seconds} s, allowed {limit} s");
    }
}

/// Each smaller than what four times full speed brings in a tick; together they walk away with the position.
#[test]
fn counts_that_jump_now_and_then_are_a_fault_and_a_single_false_reading_is_not() {
    let options = Options { tick_hz: TICK_HZ, ..Options::default() };
    let mut plant = Plant::draw(Family::G2, Severity::Harsh, Seeds::Design(2), &options);
    plant.config.counts_per_rev = 4096;
    let mut bench = Bench::new(&plant);
    bench.run(0.01, |_, _| {});
    bench.axis.adopt(&mut bench.state, &exact(&plant)).expect("idle");
    bench.axis.command(&mut bench.state, &Command::Arm).expect("no fault");
    sine(&plant, &mut bench);
    let full = plant.truth.gain * 12.0 * f64::from(plant.config.counts_per_rev) / TAU / f64::from(TICK_HZ);
    let size = (1.2 * full + 12.0) as i32;
    let tick = std::cell::Cell::new(0u32);
    let next = || tick.replace(tick.get() + 1);
    let once = |sample: Sample| match next() {
        100 => Sample { count: sample.count.wrapping_add(size), ..sample },
        _ => sample,
    };
    assert_eq!(until_open(&mut bench, 0.5, once), None, "{:?}", bench.state.fault());
    // One tick of fifty, by turns more and less.
    let jumping = |sample: Sample| {
        let offset = if next() / 50 % 2 == 0 { 0 } else { size };
        Sample { count: sample.count.wrapping_add(offset), ..sample }
    };
    let ticks = until_open(&mut bench, 2.0, jumping).expect("found");
    // A jump against the voltage looks like a shaft that runs back.
    let fault = bench.state.fault();
    assert!(matches!(fault, Fault::SlippingCounts | Fault::WrongDirection), "{fault:?}");
    assert!(ticks < 1_000, "{ticks} ticks");
}

#[test]
fn a_reversed_encoder_is_told_from_a_missing_one() {
    for (family, seed) in [(Family::G1, 1), (Family::G2, 2), (Family::G3, 3)] {
        let (plant, mut bench) = knowing(family, seed);
        sine(&plant, &mut bench);
        let reversed = |sample: Sample| Sample { count: -sample.count, ..sample };
        until_open(&mut bench, 3.0, reversed).expect("found");
        assert_eq!(bench.state.fault(), Fault::WrongDirection, "{family:?}");
        let counts = bench.board.reading().theta.abs() * f64::from(plant.config.counts_per_rev) / TAU;
        assert!(counts < 60.0, "{family:?} ran away by {counts} counts");
    }
}

#[test]
fn a_supply_that_fails_or_is_pumped_up_opens_the_bridge() {
    for (share, fault) in [(0.4, Fault::SupplyLow), (1.49, Fault::None), (1.9, Fault::SupplyHigh)] {
        let (plant, mut bench) = knowing(Family::G2, 5);
        sine(&plant, &mut bench);
        bench.run(0.5, |_, _| {});
        let raw = (share * 12.0 / f64::from(plant.config.vbus_v_per_lsb)) as u16;
        let ticks = until_open(&mut bench, 0.2, |sample| Sample { vbus_raw: raw, ..sample });
        assert_eq!(bench.state.fault(), fault);
        assert!(fault == Fault::None || ticks.expect("open") < TICK_HZ / 100);
    }
}

#[test]
fn a_latched_fault_refuses_torque_until_it_is_cleared() {
    let (plant, mut bench) = knowing(Family::G2, 6);
    sine(&plant, &mut bench);
    bench.run(0.9, |_, _| {});
    let frozen = bench.board.sample().count;
    until_open(&mut bench, 3.0, |sample| Sample { count: frozen, ..sample }).expect("found");
    let refusal = |bench: &mut Bench, command| bench.axis.command(&mut bench.state, &command).err();
    assert_eq!(refusal(&mut bench, Command::Arm), Some(Refusal::Faulted));
    assert_eq!(refusal(&mut bench, Command::Position(1.0)), Some(Refusal::Faulted));
    bench.run(0.5, |output, _| assert_eq!(output.bridge, Bridge::Open));
    assert_eq!(refusal(&mut bench, Command::Stop), None);
    assert_eq!(refusal(&mut bench, Command::Position(1.0)), Some(Refusal::NotArmed));
    assert_eq!(refusal(&mut bench, Command::Arm), None);
    assert_eq!(refusal(&mut bench, Command::Position(1.0)), None);
}

/// Steps, reversals at full voltage, load steps of a fifth of the dead zone, a supply that moves by 10 %: no fault.
#[test]
fn hard_ordinary_motion_is_no_fault() {
    for (family, seed) in [(Family::G1, 11), (Family::G2, 12), (Family::G3, 13), (Family::Paper, 14)] {
        let options = Options { tick_hz: 2_000, ..Options::default() };
        let plant =
            Plant::draw(family, Severity::Harsh, Seeds::Design(seed), &options).with_load_step(1.0, 0.2);
        let mut bench = Bench::new(&plant);
        bench.run(0.01, |_, _| {});
        bench.axis.adopt(&mut bench.state, &exact(&plant)).expect("idle");
        bench.axis.command(&mut bench.state, &Command::Arm).expect("no fault");
        let tau = plant.truth.time_constant_s;
        let supply = plant.motor.drive.supply_v as f32;
        for k in 0..40u32 {
            let share = [0.9, -0.9, 0.2, -0.5, 0.05][(k % 5) as usize] * (1.0 - 0.01 * k as f32);
            let command = match k % 8 {
                7 => Command::Position(0.0),
                _ => Command::Voltage(share * supply),
            };
            bench.axis.command(&mut bench.state, &command).unwrap_or_else(|refusal| {
                panic!("{family:?} {k} {command:?}: {refusal:?} after {:?}", bench.state.fault())
            });
            bench.run(tau * f64::from(1 + k % 3), |_, _| {});
        }
        assert_eq!(bench.state.fault(), Fault::None, "{family:?}");
    }
}
