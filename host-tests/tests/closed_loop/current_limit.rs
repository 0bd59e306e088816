//! The current limit: the voltage gives way, nothing trips, and a first run under it says what it could not learn.

use rayon::prelude::*;
use servo::axis::{Axis, Bridge, Command, Sample};
use servo::identify::estimate::Reason;
use servo::optional::Optional;
use servo::protect::Fault;
use servo::record::Limit;
use trials::bench::Bench;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::power_up::PowerUp;
use trials::tracking::knowing;

/// Design plants apart from those of the evaluation.
const FIRST: u32 = 310;
/// A converter count, shares of the limit.
const LSB: f64 = 0.04;

fn plant(family: Family, number: u32, tick_hz: u32) -> Plant {
    let options = Options { tick_hz, ..Options::default() };
    Plant::draw(family, Severity::Nominal, Seeds::Design(number), &options)
}

#[test]
fn the_current_is_held_at_any_control_rate_and_delay() {
    let rates = [(1_000, 1), (1_000, 3), (5_000, 1), (10_000, 3), (20_000, 1)];
    rates.into_par_iter().for_each(|(tick_hz, delay)| {
        for (family, share) in [(Family::G1, 0.2), (Family::G2, 0.35), (Family::G3, 0.5)] {
            let mut plant = plant(family, FIRST, tick_hz);
            plant.config.pwm_delay_ticks = delay;
            let outcome = PowerUp::new(plant, share, LSB).commission(3.0, 1);
            let what = format!("{tick_hz} Hz, delay {delay}, {family:?}: {outcome:?}");
            assert_ne!(outcome.report.refused, Some(Reason::Aborted), "{what}");
            assert!(outcome.peak < 2.0 && outcome.beyond_s < 0.004 && outcome.limited > 0.005, "{what}");
        }
    });
}

/// Starts at a tenth of the stall current: two of three motors need more than that to turn.
#[test]
fn a_first_power_up_by_the_recipe_of_the_pages_ends_with_trusted_numbers() {
    let plants = [Family::G1, Family::G2, Family::G3].map(|family| plant(family, FIRST + 1, 10_000));
    plants.into_par_iter().for_each(|plant| {
        let recipe = PowerUp::recipe(&plant, LSB, 0);
        assert!(recipe.works(), "{recipe:?}");
    });
}

#[test]
fn what_the_limit_keeps_from_being_learned_is_named() {
    let mut stuck = plant(Family::G2, FIRST, 2_000);
    stuck.motor.friction.kinetic_nm = stuck.motor.friction.kinetic_nm.map(|level| 4.0 * level);
    let outcome = PowerUp::new(stuck, 0.2, LSB).commission(3.0, 0);
    assert_eq!(outcome.report.refused, Some(Reason::CurrentLimited), "{outcome:?}");
    // It turns, and full voltage is not reached: no saturation is invented, none is denied.
    let outcome = PowerUp::new(plant(Family::G3, FIRST, 2_000), 0.3, LSB).commission(3.0, 0);
    let found = outcome.report.estimates;
    assert_eq!(outcome.report.refused, None, "{outcome:?}");
    assert!(!outcome.score.false_trust(12.0) && outcome.score.invented == 0, "{outcome:?}");
    for saturation in [found.saturation_pos_v, found.saturation_neg_v] {
        assert!(
            saturation.value.is_some() || saturation.reason == Some(Reason::CurrentLimited),
            "{outcome:?}"
        );
    }
}

/// An encoder that is dead stays told under a limit.
#[test]
fn a_dead_encoder_and_an_open_winding_are_not_taken_for_the_limit() {
    let mut unplugged = plant(Family::G2, FIRST, 2_000);
    unplugged.sensing.missing = 1.0;
    let outcome = PowerUp::new(unplugged, 0.35, LSB).commission(3.0, 0);
    assert_eq!(outcome.report.refused, Some(Reason::EncoderUnplugged), "{outcome:?}");
    let mut open = plant(Family::G2, FIRST, 2_000);
    let limit = PowerUp::new(open.clone(), 0.35, LSB);
    open.motor.resistance_ohm *= 1e5;
    let outcome = limit.of(open).commission(3.0, 0);
    assert_eq!(outcome.report.refused, Some(Reason::MotorDisconnected), "{outcome:?}");
}

/// A motion that asks for more than the limit: it is late, and it arrives.
#[test]
fn a_motion_beyond_the_limit_is_held_back_told_and_ends_at_its_place() {
    let mut plant = plant(Family::G2, FIRST, 5_000);
    plant.sensing.current = true;
    let limit_a = 0.22 * plant.motor.drive.supply_v / plant.motor.resistance_ohm;
    plant.config.current_limit_a = Optional::new(limit_a as f32);
    let mut bench = knowing(&plant);
    bench.ask(Command::Position(60.0)).expect("a place");
    let (mut peak, mut told, mut highest) = (0.0f64, 0, 0.0f64);
    bench.run(4.0, |output, reading| {
        assert_eq!(output.record.fault, Fault::None);
        peak = peak.max(reading.current.abs() / limit_a);
        told += u32::from(output.record.limit == Limit::Current);
        highest = highest.max(reading.theta);
    });
    let place = bench.board.reading().theta;
    assert!(peak < 1.2 && told > 50, "peak {peak}, told in {told} ticks");
    assert!((place - 60.0).abs() < 0.05 && highest < 62.0, "at {place}, highest {highest}");
}

/// Currents that no voltage explains: the fault lies above the limit, and comes the sooner the more it is exceeded.
#[test]
fn a_current_that_the_voltage_does_not_hold_is_a_fault() {
    let config = servo::config::Config {
        current_limit_a: Optional::new(1.0),
        current_a_per_lsb: 0.01,
        ..servo::config::Config::EXAMPLE
    };
    let axis = Axis::new(&config).expect("good ones");
    let ticks_until = |raw: i16| {
        let mut state = axis.start();
        let sample = |current_raw| Sample { count: 0, vbus_raw: 2048, current_raw };
        axis.step(&mut state, sample(0));
        axis.command(&mut state, &Command::Arm).expect("at rest");
        axis.command(&mut state, &Command::Voltage(3.0)).expect("armed");
        (0..5_000).find(|_| axis.step(&mut state, sample(raw)).record.fault == Fault::OverCurrent)
    };
    assert_eq!(ticks_until(104), None, "ripple");
    let [slow, twice, short] = [125, 210, 2_000].map(|raw| ticks_until(raw).expect("a fault"));
    assert!(
        (300..800).contains(&slow) && (90..130).contains(&twice) && short <= twice,
        "{slow} {twice} {short}"
    );
}

/// It asks for ever more voltage, if it is believed.
#[test]
fn a_sensor_that_reads_backwards_does_not_drive_the_voltage_up() {
    let mut plant = plant(Family::G2, FIRST, 5_000);
    plant.sensing.current = true;
    let limit_a = 0.3 * plant.motor.drive.supply_v / plant.motor.resistance_ohm;
    plant.config.current_limit_a = Optional::new(limit_a as f32);
    let mut bench = Bench::new(&plant);
    bench.ask(Command::Arm).expect("at rest");
    bench.ask(Command::Voltage(0.4 * plant.config.supply_nominal_v)).expect("armed");
    for _ in 0..5_000 {
        let sample = bench.board.sample();
        let backwards = Sample { current_raw: sample.current_raw.saturating_neg(), ..sample };
        let output = bench.axis.step(&mut bench.state, backwards);
        bench.board.pass(output.bridge, output.duty);
        let share = f32::from(output.duty.unsigned_abs()) / f32::from(plant.config.pwm_full_scale);
        assert!(share < 0.45, "{share}");
        if output.record.fault != Fault::None {
            assert_eq!(output.bridge, Bridge::Open);
            break;
        }
    }
}
