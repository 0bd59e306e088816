//! A sine that was computed ahead of its tick, as the link task of the image does: the same bits as one that was not.

use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::track_sine::Units;
use servo::axis::{Axis, Command, Refusal};
use servo::config::Config;
use servo::optional::Optional;
use trials::bench::{Bench, Board};
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::tracking::knowing;

fn plant(limits: impl Fn(&mut Config)) -> Plant {
    let mut plant = Plant::draw(Family::G2, Severity::Nominal, Seeds::Design(43), &Options::default());
    limits(&mut plant.config);
    plant
}

fn units(config: &Config) -> Units {
    Units::of(Axis::new(config).expect("every value within its range").scale())
}

fn sine(amplitude_rad: f32, frequency_hz: f32, duration_ms: u32) -> Command {
    Command::TrackSine { amplitude_rad, frequency_hz, duration_ms }
}

/// Both answers, and whether both axes did the same for so many ticks.
fn compared(plant: &Plant, command: Command, units: &Units, ticks: u32) -> [Result<(), Refusal>; 2] {
    let mut order: Order = Order::Run(command);
    order.ahead(units);
    let Order::Sine(ahead) = order else { panic!("nothing was computed") };
    let mut benches = [knowing(plant), knowing(plant)];
    let [plain, other] = &mut benches;
    let answers = [plain.ask(command), other.axis.command_ahead(&mut other.state, &ahead)];
    for tick in 0..ticks {
        let [plain, other] = benches.each_mut().map(Bench::tick);
        assert_eq!(plain, other, "{command:?}, tick {tick}");
    }
    answers
}

#[test]
fn a_sine_that_was_computed_ahead_gives_the_same_bits() {
    let plant = plant(|_| {});
    for (amplitude_rad, frequency_hz, duration_ms) in [(1.0, 1.0, 3_000), (-0.3, 4.0, 1_100), (0.0, 2.0, 700)]
    {
        let command = sine(amplitude_rad, frequency_hz, duration_ms);
        let answers = compared(&plant, command, &units(&plant.config), 4_000);
        assert_eq!(answers, [Ok(()); 2], "{command:?}");
    }
}

#[test]
fn a_sine_that_was_computed_for_other_units_is_computed_anew() {
    let plant = plant(|_| {});
    let mut finer = plant.config;
    finer.counts_per_rev *= 2;
    let mut faster = plant.config;
    faster.tick_hz *= 2;
    for other in [finer, faster] {
        let answers = compared(&plant, sine(1.0, 1.0, 3_000), &units(&other), 4_000);
        assert_eq!(answers, [Ok(()); 2]);
    }
}

#[test]
fn a_sine_that_was_computed_ahead_is_refused_with_the_same_numbers() {
    let refused = |plant: &Plant, command: Command| {
        let [plain, ahead] = compared(plant, command, &units(&plant.config), 100);
        assert_eq!(plain, ahead, "{command:?}");
        plain.expect_err("it cannot be done")
    };
    let free = plant(|_| {});
    for command in [sine(1.0, 1e4, 1_000), sine(1.0, 1.0, 100), sine(1.0, f32::NAN, 1_000), sine(1.0, 1.0, 0)]
    {
        assert_eq!(refused(&free, command), Refusal::OutOfRange, "{command:?}");
    }
    let strong = refused(&free, sine(40.0, 3.0, 2_000));
    assert!(matches!(strong, Refusal::BeyondVoltage { .. }), "{strong:?}");
    let slow = plant(|config| config.speed_limit_rad_s = Optional::new(0.1 * config.rated_speed_rad_s));
    let amplitude_rad = 0.24 * slow.config.rated_speed_rad_s / std::f32::consts::TAU;
    let fast = refused(&slow, sine(amplitude_rad, 1.0, 3_000));
    assert!(matches!(fast, Refusal::BeyondSpeed { .. }), "{fast:?}");
    let gentle = plant(|config| config.jerk_limit_rad_s3 = Optional::new(10.0));
    assert_eq!(refused(&gentle, sine(1.0, 2.0, 3_000)), Refusal::OutOfRange);
    let narrow = plant(|config| config.travel_limit_rad = Some([-0.5, 0.5]));
    assert_eq!(refused(&narrow, sine(1.0, 1.0, 3_000)), Refusal::BeyondTravel);
}

/// Whoever asks whether an axis is ready waits a few ticks at most, at whatever rate and during whatever sine: a `Stop` may wait behind
/// a motion.
#[test]
fn an_axis_that_follows_a_sine_is_ready_every_few_ticks() {
    for tick_hz in [1_000, 2_000, 2_500, 4_000, 5_000, 8_000, 10_000, 20_000] {
        let options = Options { tick_hz, ..Options::default() };
        let plant = Plant::draw(Family::G2, Severity::Nominal, Seeds::Design(43), &options);
        let known = knowing(&plant);
        let parameters = known.axis.parameters(&known.state);
        for frequency_hz in [0.1, 0.3, 1.0, 2.0, 4.0] {
            let mut axis = ServoAxis::new();
            let mut board = Board::new(&plant);
            let order = Order::restore(&parameters).expect("what was in force can be");
            let sine = sine(0.5, frequency_hz, 10_000);
            for order in [order, Order::Run(Command::Arm), Order::Run(sine)] {
                axis.execute(&order).unwrap_or_else(|refusal| panic!("{refusal:?}"));
            }
            let mut waited = 0;
            for tick in 0..3 * tick_hz {
                let another = Order::Run(Command::Position(0.1));
                waited = if axis.is_ready(&another) { 0 } else { waited + 1 };
                assert!(waited < 8, "{tick_hz} Hz, {frequency_hz} Hz: {waited} ticks in tick {tick}");
                let output = axis.step(board.sample()).output;
                board.pass(output.bridge, output.duty);
            }
        }
    }
}
