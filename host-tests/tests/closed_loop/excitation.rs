//! Excitation by sine and chirp: what comes out, what is refused, and what the identification learns from it.

use servo::axis::Command;
use servo::axis::{Bridge, Refusal};
use servo::config::{ConfigError, Field};
use servo::motion::excitation::{Sweep, Waveform};
use servo::record::{Activity, Source};
use servo::units::Voltage;
use std::f64::consts::TAU;
use trials::bench::Bench;
use trials::families::{Family, Options, Plant, Seeds, Severity};

const CHIRP: Waveform =
    Waveform { amplitude_v: 6.0, from_hz: 0.5, to_hz: 40.0, sweep: Sweep::Linear, duration_ms: 8_000 };

fn plant(tick_hz: u32, number: u32) -> Plant {
    let options = Options { tick_hz, ..Options::default() };
    Plant::draw(Family::G2, Severity::Nominal, Seeds::Evaluation(760_000 + number), &options)
}

/// All voltages in volts, and the frequency before each tick in Hz.
fn course(waveform: &Waveform, tick_hz: u32) -> Vec<(f64, f64)> {
    let scale = plant(tick_hz, 0).config.build().expect("a configuration");
    let mut excitation = waveform.plan(&scale).expect("a waveform");
    let volts = |voltage: Voltage| f64::from(voltage.0) / f64::from(Voltage::NOMINAL.0) * 12.0;
    std::iter::from_fn(|| {
        let hz = f64::from(excitation.frequency()) / 4_294_967_296.0 * f64::from(tick_hz);
        excitation.step().map(|voltage| (volts(voltage), hz))
    })
    .collect()
}

#[test]
fn a_sine_is_one_to_the_last_place_of_its_frequency() {
    let sine = Waveform { to_hz: 3.7, from_hz: 3.7, ..CHIRP };
    let course = course(&sine, 10_000);
    assert_eq!(course.len(), 80_000);
    let worst = (0..)
        .zip(&course)
        .map(|(tick, (volts, _))| (volts - 6.0 * (TAU * 3.7 * f64::from(tick) / 10_000.0).sin()).abs() / 6.0)
        .fold(0.0, f64::max);
    // 186 rad of a frequency in single precision.
    assert!(worst < 186.0 * f64::from(f32::EPSILON), "{worst}");
}

#[test]
fn a_chirp_goes_through_all_frequencies_and_ends_where_it_should() {
    for (sweep, tolerance) in [(Sweep::Linear, 1e-5), (Sweep::Logarithmic, 1e-3)] {
        for (from_hz, to_hz, duration_ms, tick_hz) in [
            (0.5, 40.0, 8_000, 1_000),
            (500.0, 0.2, 8_000, 10_000),
            (0.01, 1_000.0, 100, 20_000),
            (1.0, 1.001, 3_600_000, 1_000),
        ] {
            let waveform = Waveform { from_hz, to_hz, sweep, duration_ms, ..CHIRP };
            let course = course(&waveform, tick_hz);
            let (first, last) = (course[0].1, course[course.len() - 1].1);
            let span = f64::from((to_hz - from_hz).abs());
            let step = span / course.len() as f64;
            assert!((first - f64::from(from_hz)).abs() <= 1e-5 * f64::from(from_hz) + 5e-6, "{first} Hz");
            let off = (last - f64::from(to_hz)).abs();
            // The last tick lies one step before the end; a logarithmic chirp ends with larger ones.
            let ratio = f64::from(to_hz / from_hz).ln().abs() / course.len() as f64 * f64::from(to_hz);
            let allowed = tolerance * f64::from(to_hz.max(from_hz)) + step.max(ratio) + 5e-6;
            assert!(off <= allowed, "{sweep:?} {from_hz} to {to_hz} Hz ends at {last} Hz");
            let between =
                course.windows(2).all(|pair| (pair[1].1 - pair[0].1) * f64::from(to_hz - from_hz) >= 0.0);
            assert!(between, "{sweep:?} {from_hz} to {to_hz} Hz turns back");
        }
    }
}

/// Half of the time a logarithmic chirp is below the geometric mean.
#[test]
fn a_logarithmic_chirp_gives_every_octave_the_same_time() {
    let waveform = Waveform { from_hz: 0.1, to_hz: 10.0, sweep: Sweep::Logarithmic, ..CHIRP };
    let course = course(&waveform, 10_000);
    let middle = course[course.len() / 2].1;
    assert!((middle - 1.0).abs() < 2e-3, "{middle} Hz");
}

fn command(bench: &mut Bench, command: Command) -> Result<(), Refusal> {
    bench.axis.command(&mut bench.state, &command)
}

#[test]
fn a_number_that_cannot_be_is_refused_with_its_name_and_range() {
    let mut bench = Bench::new(&plant(1_000, 0));
    bench.run(0.01, |_, _| {});
    assert_eq!(command(&mut bench, Command::Excite(CHIRP)), Err(Refusal::NotArmed));
    command(&mut bench, Command::Arm).expect("no fault");
    let wrong = [
        (Field::ExcitationAmplitude, 0.012, 12.0, Waveform { amplitude_v: 12.1, ..CHIRP }),
        (Field::ExcitationAmplitude, 0.012, 12.0, Waveform { amplitude_v: f32::NAN, ..CHIRP }),
        (Field::ExcitationFrom, 0.01, 50.0, Waveform { from_hz: 0.0, ..CHIRP }),
        (Field::ExcitationTo, 0.01, 50.0, Waveform { to_hz: 50.1, ..CHIRP }),
        (Field::ExcitationDuration, 0.1, 3600.0, Waveform { duration_ms: 99, ..CHIRP }),
    ];
    for (field, minimum, maximum, waveform) in wrong {
        let Err(Refusal::Value(ConfigError { field: named, minimum: low, maximum: high })) =
            command(&mut bench, Command::Excite(waveform))
        else {
            panic!("{field:?} is accepted");
        };
        assert_eq!(named, field);
        assert!((low - minimum).abs() < 1e-6 && (high - maximum).abs() < 1e-3, "{field:?}: {low} to {high}");
    }
    let mut between_stops = plant(1_000, 0);
    between_stops.config.travel_limit_rad = Some([-1.0, 1.0]);
    let mut bench = Bench::new(&between_stops);
    bench.run(0.01, |_, _| {});
    command(&mut bench, Command::Arm).expect("no fault");
    assert_eq!(command(&mut bench, Command::Excite(CHIRP)), Err(Refusal::BeyondTravel));
}

#[test]
fn it_is_not_disturbed_and_ends_with_the_bridge_open() {
    let mut bench = Bench::new(&plant(10_000, 1));
    bench.run(0.01, |_, _| {});
    command(&mut bench, Command::Arm).expect("no fault");
    command(&mut bench, Command::Excite(CHIRP)).expect("it may");
    let mut activities = Vec::new();
    bench.run(1.0, |output, _| activities.push(output.record.activity));
    assert!(activities.iter().all(|&activity| activity == Activity::Driving));
    assert_eq!(command(&mut bench, Command::Voltage(1.0)), Err(Refusal::Busy));
    assert_eq!(command(&mut bench, Command::Excite(CHIRP)), Err(Refusal::Busy));
    let mut driven = 0;
    bench.run(8.0, |output, _| driven += u32::from(output.bridge == Bridge::Driven));
    assert_eq!(driven, 70_000, "eight seconds, one of them before");
    let last = bench.tick();
    assert_eq!((last.bridge, last.duty), (Bridge::Open, 0));
    assert_eq!(last.record.activity, Activity::Idle);

    // Stopped at any moment, it opens in that tick.
    command(&mut bench, Command::Arm).expect("no fault");
    command(&mut bench, Command::Excite(CHIRP)).expect("it may");
    bench.run(0.3, |_, _| {});
    command(&mut bench, Command::Stop).expect("always");
    assert_eq!(bench.tick().bridge, Bridge::Open);
}

/// Nothing was commissioned: what the loops would use comes from the excitation alone.
#[test]
fn the_identification_learns_from_a_slow_chirp() {
    let chirp = Waveform { amplitude_v: 7.0, from_hz: 0.4, to_hz: 2.5, duration_ms: 10_000, ..CHIRP };
    for number in 0..6 {
        let plant = plant(if number < 3 { 1_000 } else { 10_000 }, number);
        let mut bench = Bench::new(&plant);
        bench.run(0.01, |_, _| {});
        command(&mut bench, Command::Arm).expect("no fault");
        command(&mut bench, Command::Excite(chirp)).expect("it may");
        bench.run(10.1, |_, _| {});
        let record = bench.tick().record;
        assert_eq!(record.gain_source, Source::Trusted, "{number}: {:?}", bench.state.estimates());
        let scale = plant.config.build().expect("a configuration");
        let learned = bench.state.estimates().report(&scale);
        let found = [learned.dead_zone_pos_v, learned.dead_zone_neg_v];
        for (found, truth) in found.into_iter().zip(plant.truth.dead_zone_v) {
            assert!(found.trusted, "{number}: {found:?}");
            let error = f64::from(found.value.expect("a value")) / truth - 1.0;
            assert!(error.abs() < 0.04, "{number}: {:.1} %", 100.0 * error);
        }
    }
}
