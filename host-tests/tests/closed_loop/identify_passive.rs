//! Identification in ordinary motion: learning from it, tracking in it, and standing still.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use servo::axis::Command;
use servo::axis::{Bridge, Sample};
use servo::commission::Input;
use servo::compensate::Compensator;
use servo::config::Scale;
use servo::identify::estimate::{Estimates, Reason, Standing};
use servo::identify::passive::{Params, State};
use servo::record::{Advisory, Record, Source};
use servo::units::VoltageQ14;
use trials::bench::{Bench, Board};
use trials::commissioning::commission_outcome;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::passive::{Following, Learning, Motion};
use trials::tracking::quantile;

/// A board that is told voltages, with the passive identification listening.
struct Listening {
    scale: Scale,
    params: Params,
    state: State,
    known: Estimates,
    board: Board,
    acting: (Bridge, i16),
    sample: Sample,
}

impl Listening {
    fn new(plant: &Plant) -> Self {
        let scale = plant.config.build().unwrap();
        let params = Params::new(&scale);
        let mut board = Board::new(plant);
        let sample = board.sample();
        let state = State::new(&params, sample.count);
        Listening {
            scale,
            params,
            state,
            known: Estimates::default(),
            board,
            acting: (Bridge::Open, 0),
            sample,
        }
    }

    /// Applies a share of the nominal voltage for one tick.
    fn tick(&mut self, share: f64) {
        let supply = self.scale.supply.voltage(self.sample.vbus_raw);
        let full = i32::from(self.scale.config.pwm_full_scale);
        let (bridge, duty) = self.acting;
        let input = Input {
            count: self.sample.count,
            voltage: VoltageQ14(i32::from(duty) * supply.0 / full),
            load: VoltageQ14(0),
            bridge,
            supply: Some(supply),
            current_raw: None,
        };
        self.params.step(&mut self.state, &mut self.known, &input);
        let duty = (share * 16_384.0 / f64::from(supply.0) * f64::from(full)) as i16;
        self.acting = (Bridge::Driven, duty);
        self.board.pass(Bridge::Driven, duty);
        self.sample = self.board.sample();
    }

    /// After a commissioning.
    fn knowing(plant: &Plant, known: &Estimates) -> Self {
        let mut listening = Listening::new(plant);
        listening.known = *known;
        assert!(listening.params.adopt(&mut listening.state, known));
        listening
    }

    fn volts(&self, direction: usize) -> f64 {
        let estimate = self.known.dead_zone[direction];
        f64::from(estimate.value) / 1_048_576.0 * f64::from(self.scale.config.supply_nominal_v)
    }
}

fn plant(family: Family, severity: Severity, number: u32) -> Plant {
    Plant::draw(family, severity, Seeds::Evaluation(720_000 + number), &Options::default())
}

/// Two sines that reach about half of full speed, as a position loop on a multi-sine would ask for.
fn ordinary_motion(t: f64) -> f64 {
    let tau = std::f64::consts::TAU;
    0.38 * (tau * 0.7 * t).sin() + 0.2 * (tau * 1.9 * t).sin()
}

#[test]
fn learns_from_ordinary_motion() {
    for family in [Family::G1, Family::G2, Family::G3] {
        for number in 0..4 {
            let plant = plant(family, Severity::Nominal, number);
            let mut listening = Listening::new(&plant);
            for tick in 0..10_000 {
                listening.tick(ordinary_motion(f64::from(tick) / 1_000.0));
            }
            for direction in [0, 1] {
                let error = listening.volts(direction) / plant.truth.dead_zone_v[direction] - 1.0;
                let standing = listening.known.dead_zone[direction].standing;
                assert!(error.abs() < 0.06, "{family:?} {number}: {:.1} %", 100.0 * error);
                assert_eq!(standing, Standing::Trusted, "{family:?} {number}: {:.1} %", 100.0 * error);
            }
        }
    }
}

#[test]
fn tracks_a_load_step_at_constant_speed_and_ages_the_other_direction() {
    for number in 0..4 {
        let plain = plant(Family::G2, Severity::Nominal, number);
        let share = 0.2;
        let mean = 0.5 * (plain.truth.dead_zone_v[0] + plain.truth.dead_zone_v[1]);
        let after = plain.truth.dead_zone_v[0] + share * mean;
        let (outcome, _) = commission_outcome(&plain, 5.0, number);
        let loaded = plain.clone().with_load_step(5.0, share);
        let mut listening = Listening::knowing(&loaded, &outcome.estimates);
        let voltage = 0.35 + plain.truth.dead_zone_v[0] / f64::from(plain.config.supply_nominal_v);
        for _ in 0..5_000 {
            listening.tick(voltage);
        }
        let before = listening.volts(0) / plain.truth.dead_zone_v[0] - 1.0;
        assert!(before.abs() < 0.06, "{number}: {:.1} % before the step", 100.0 * before);
        for _ in 0..1_600 {
            listening.tick(voltage);
        }
        let error = listening.volts(0) / after - 1.0;
        assert!(error.abs() < 0.06, "{number}: {:.1} % after the step", 100.0 * error);
        let other = listening.known.dead_zone[1].standing;
        assert_eq!(other, Standing::Doubtful(Reason::Aged), "{number}");
    }
}

#[test]
fn an_hour_of_standstill_changes_no_number_but_ends_trust() {
    let plant = plant(Family::G2, Severity::Nominal, 9);
    let (outcome, _) = commission_outcome(&plant, 5.0, 9);
    let mut listening = Listening::knowing(&plant, &outcome.estimates);
    let input = Input {
        count: 5,
        voltage: VoltageQ14(0),
        load: VoltageQ14(0),
        bridge: Bridge::Shorted,
        supply: None,
        current_raw: None,
    };
    for _ in 0..3_600_000 {
        listening.params.step(&mut listening.state, &mut listening.known, &input);
    }
    for direction in [0, 1] {
        let estimate = listening.known.dead_zone[direction];
        assert_eq!(estimate.value, outcome.estimates.dead_zone[direction].value);
        assert_eq!(estimate.standing, Standing::Doubtful(Reason::Aged));
    }
    assert_eq!(listening.known.gain, outcome.estimates.gain);
}

#[test]
fn wear_is_noticed() {
    let plain = plant(Family::G2, Severity::Nominal, 3);
    let (outcome, _) = commission_outcome(&plain, 5.0, 3);
    let mut worn = plain.clone();
    worn.motor.friction.kinetic_nm = worn.motor.friction.kinetic_nm.map(|level| 1.4 * level);
    for (plant, expected) in [(&plain, [false; 2]), (&worn, [true; 2])] {
        let mut listening = Listening::knowing(plant, &outcome.estimates);
        for tick in 0..8_000 {
            listening.tick(ordinary_motion(f64::from(tick) / 1_000.0));
        }
        assert_eq!(listening.state.worn(), expected);
    }
}

/// Reduced suite in closed loop, two-sided; the full one is the program `passive` of `evaluation`.
#[test]
fn learns_and_follows_with_the_real_loops_around_it() {
    let (mut errors, mut trusted, mut times) = (Vec::new(), 0, Vec::new());
    for family in [Family::G1, Family::G2] {
        for number in 0..4 {
            let seeds = Seeds::Evaluation(760_000 + number);
            let learned = Learning {
                family,
                severity: Severity::Harsh,
                tick_hz: 1_000,
                motion: Motion::Swings(0.25),
                seconds: 10.0,
            }
            .run(seeds);
            trusted += u32::from(learned.trusted);
            errors.extend(learned.dead_zone.map(f64::abs));
            let followed = Following {
                family,
                severity: Severity::Harsh,
                tick_hz: 1_000,
                speed_share: 0.3,
                load_share: 0.2,
            }
            .run(seeds);
            times.extend(followed.map(|run| run.within_6_percent_s));
        }
    }
    let (median, worst) = (quantile(errors.iter().copied(), 0.5), quantile(errors.iter().copied(), 1.0));
    assert!((0.002..0.02).contains(&median) && worst < 0.08, "{median}, at worst {worst}");
    assert!(trusted >= 7, "{trusted} of 8 trusted");
    let time = quantile(times.iter().copied(), 0.5);
    assert!(times.len() >= 7 && (0.1..1.6).contains(&time), "{time} s of {times:?}");
}

/// Commissioned before its friction grew by 40 %: the loops follow, and the record asks for attention.
#[test]
fn an_axis_follows_wear_and_says_so() {
    let plain = plant(Family::G2, Severity::Nominal, 5);
    let (outcome, _) = commission_outcome(&plain, 5.0, 5);
    let mut worn = plain.clone();
    worn.motor.friction.kinetic_nm = worn.motor.friction.kinetic_nm.map(|level| 1.4 * level);
    for (plant, expected) in [(&plain, Advisory::None), (&worn, Advisory::DeadZoneMoved)] {
        let mut bench = Bench::new(plant);
        bench.run(0.01, |_, _| {});
        bench.axis.command(&mut bench.state, &Command::Adopt(outcome.estimates)).expect("an idle axis");
        let full_speed = plant.truth.gain * plant.motor.drive.supply_v;
        let mut dice = ChaCha8Rng::seed_from_u64(5);
        Motion::Swings(0.4).run(&mut bench, full_speed, 8.0, &mut dice);
        let mut record = Record::default();
        bench.run(0.01, |output, _| record = output.record);
        assert_eq!(record.advisory, expected);
        // What has not moved is still the number that was given.
        let (grown, source) = match expected {
            Advisory::None => (1.0, Source::Stored),
            Advisory::DeadZoneMoved => (1.4, Source::Trusted),
            other => unreachable!("{other:?}: nothing is streamed, and no load is known"),
        };
        assert!(
            record.dead_zone_source.iter().all(|is| [source, Source::Trusted].contains(is)),
            "{:?}",
            record.dead_zone_source
        );
        for direction in [0, 1] {
            let before = f64::from(outcome.estimates.dead_zone[direction].value);
            let now = f64::from(bench.state.estimates().dead_zone[direction].value);
            assert!((now / before / grown - 1.0).abs() < 0.08, "{}", now / before);
        }
    }
}

/// What an axis carries for identification and compensation while it is in use; a commissioning borrows the same memory.
#[test]
fn the_state_of_an_axis_fits_1_5_kilobytes() {
    let bytes = size_of::<State>() + size_of::<Compensator>();
    println!("{} + {} bytes", size_of::<State>(), size_of::<Compensator>());
    assert!(bytes <= 1536, "{bytes} bytes");
}
