//! Protection in a broken world, reduced: the whole suite is `cargo run -p evaluation -- faults`.

use servo::axis::Command;
use servo::axis::{Axis, Bridge};
use servo::config::Scale;
use servo::protect::{
    Action, Actions, Expectation, Fault, Input, Params, Settings, SettingsError, State, Thermal,
};
use trials::bench::{Bench, Board};
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::faults::calm;
use trials::faults::trial::{Trial, When};
use trials::faults::world::{Injury, World};
use trials::firmware::qemu;
use trials::tracking::exact;
use trials::virtual_motor::VirtualMotor;
use truing::device::link::Lockstep;
use truing::device::motor::{Drive, Motor, Reading};
use truing::device::replay::replay;
use truing::device::session::{self, Done, Profile, Task};
use truing::text::input_error::InputError;

fn plant(family: Family, seed: u32, tick_hz: u32, sensed: bool) -> Plant {
    let options = Options { tick_hz, ..Options::default() };
    let mut plant = Plant::draw(family, Severity::Harsh, Seeds::Design(seed), &options);
    plant.sensing.current = sensed;
    plant
}

#[test]
fn a_shaft_that_turned_and_breaks_is_found_within_24_counts_and_named_by_its_current() {
    let (mut cases, mut in_time) = (0, 0);
    for (family, seed, sensed) in [(Family::G2, 0, true), (Family::G3, 1, false)] {
        let plant = plant(family, seed, 10_000, sensed);
        let trial = Trial::commissioned(&plant, &Settings::default(), 5_000);
        for (injury, named) in [
            (Injury::Stall, Fault::Stalled),
            (Injury::EncoderUnplugged, Fault::EncoderUnplugged),
            (Injury::EncoderReversed, Fault::WrongDirection),
        ] {
            let fault = if sensed || named == Fault::WrongDirection { named } else { Fault::NoMotion };
            for n in 0..4 {
                let finding = trial.injure(injury, When::InMotion, n);
                assert_eq!(finding.fault, fault, "{family:?} {n} {finding:?}");
                cases += 1;
                in_time += u32::from(finding.in_limits());
            }
        }
    }
    // The rest broke while the voltage was about to reverse.
    assert!(cases == 24 && (18..=20).contains(&in_time), "{in_time} of {cases}");
}

#[test]
fn minutes_of_hard_motion_raise_no_alarm() {
    for (family, seed, sensed) in [(Family::G1, 20, false), (Family::G2, 21, true), (Family::G3, 22, true)] {
        let plant = calm::plant(family, Seeds::Design(seed), 1000, sensed, 60.0);
        let calm = calm::run(&plant, family, 60.0);
        assert_eq!(calm.fault, Fault::None, "{family:?} {calm:?}");
        assert!(calm.moving_s > 0.5 * calm.seconds && calm.contacts > 0, "{calm:?}");
    }
}

/// A world with exact knowledge and settings of one's own, under way.
fn driving(settings: &Settings, command: Command) -> (Plant, Axis, servo::axis::State, World) {
    let plant = plant(Family::G2, 5, 2_000, true);
    let axis = Axis::new(&plant.config).expect("valid");
    let axis = axis.protected(settings).expect("valid");
    let mut bench = Bench { state: axis.start(), board: Board::new(&plant), axis };
    bench.run(0.01, |_, _| {});
    axis.adopt(&mut bench.state, &exact(&plant)).expect("idle");
    for command in [Command::Arm, command] {
        axis.command(&mut bench.state, &command).expect("ready");
    }
    let world = World::around(&plant, bench.board);
    (plant, axis, bench.state, world)
}

/// Runs for some seconds; the last bridge, and the first tick with a fault.
fn run(
    axis: &Axis,
    state: &mut servo::axis::State,
    world: &mut World,
    seconds: f64,
) -> (Bridge, Option<u32>) {
    let mut found = None;
    let mut bridge = Bridge::Open;
    for tick in 0..(seconds * 2000.0) as u32 {
        let output = axis.step(state, world.sample());
        world.pass(output.bridge, output.duty);
        bridge = output.bridge;
        if found.is_none() && output.record.fault != Fault::None {
            found = Some(tick);
        }
    }
    (bridge, found)
}

#[test]
fn a_silent_host_ends_an_endless_motion_as_the_table_says() {
    let table = |action| Actions::default().with(Fault::CommandTimeout, action).expect("any action suits");
    for (action, bridge) in
        [(Action::Open, Bridge::Open), (Action::Brake, Bridge::Shorted), (Action::Hold, Bridge::Driven)]
    {
        let settings = Settings { actions: table(action), command_timeout_ms: 300, ..Settings::default() };
        let (_, axis, mut state, mut world) = driving(&settings, Command::Speed(40.0));
        let (last, found) = run(&axis, &mut state, &mut world, 2.0);
        assert_eq!((state.fault(), last), (Fault::CommandTimeout, bridge));
        assert_eq!(found, Some(600), "300 ms of 2 kHz, counted from the command");
        if action == Action::Hold {
            let before = world.reading().theta;
            run(&axis, &mut state, &mut world, 1.0);
            assert!((world.reading().theta - before).abs() < 0.2, "it holds");
            // An over-current asks for more than to hold; the first reason stays.
            axis.raise(&mut state, servo::protect::Condition::TickOverrun);
            let (last, _) = run(&axis, &mut state, &mut world, 0.01);
            assert_eq!((state.fault(), last), (Fault::CommandTimeout, Bridge::Open));
        }
        let refused = axis.command(&mut state, &Command::Speed(1.0));
        assert_eq!(refused, Err(servo::axis::Refusal::Faulted));
    }
}

#[test]
fn a_host_that_speaks_in_time_is_not_missed() {
    let settings = Settings { command_timeout_ms: 300, ..Settings::default() };
    let (_, axis, mut state, mut world) = driving(&settings, Command::Speed(40.0));
    for _ in 0..5 {
        let (_, found) = run(&axis, &mut state, &mut world, 0.25);
        assert_eq!(found, None);
        axis.command(&mut state, &Command::Speed(40.0)).expect("in time");
    }
}

#[test]
fn what_only_a_sample_shows_is_named() {
    for (injury, fault) in [
        (Injury::SupplyUnseen, Fault::SupplyNotMeasured),
        (Injury::Supply(0.4), Fault::SupplyLow),
        (Injury::Supply(1.7), Fault::SupplyHigh),
        (Injury::Jump(4000), Fault::SlippingCounts),
        (Injury::Jump(-4000), Fault::SlippingCounts),
    ] {
        let (_, axis, mut state, mut world) = driving(&Settings::default(), Command::Speed(40.0));
        assert_eq!(run(&axis, &mut state, &mut world, 0.5), (Bridge::Driven, None));
        world.injure(injury);
        let (bridge, found) = run(&axis, &mut state, &mut world, 0.02);
        assert_eq!((state.fault(), bridge), (fault, Bridge::Open), "{injury:?}");
        assert!(found.is_some_and(|tick| tick <= 11), "5 ms and a tick: {found:?}");
    }
}

/// Protection alone, at a constant current.
fn constant(raw: i16, settings: &Settings, seconds: f64) -> Option<f64> {
    let plant = plant(Family::G2, 5, 2_000, true);
    let scale: Scale = plant.config.build().expect("valid");
    let params = Params::new(&scale, settings).expect("valid");
    let mut state = State::default();
    let input = Input { current: Some(raw), ..Input::default() };
    // At 2 kHz every tick is a look.
    let tick = (0..(seconds * 2000.0) as u32).find(|_| {
        params.look(&mut state, &Expectation::default(), &input);
        state.action().is_some()
    })?;
    assert_eq!(state.fault(), Fault::Overload);
    Some(f64::from(tick) / 2000.0)
}

/// τ·ln(1/(1 − (i∞/i)²)): 0.2877 τ at twice the continuous current.
#[test]
fn the_winding_warms_up_as_its_time_constant_says() {
    let lsb = f64::from(plant(Family::G2, 5, 2_000, true).config.current_a_per_lsb);
    let settings = Settings {
        thermal: Some(Thermal { continuous_a: (300.0 * lsb) as f32, time_constant_s: 20 }),
        ..Settings::default()
    };
    for raw in [600, -600] {
        let seconds = constant(raw, &settings, 30.0).expect("too warm");
        assert!((seconds / (20.0 * 0.2877) - 1.0).abs() < 0.02, "{seconds} s");
    }
    assert_eq!(constant(297, &settings, 200.0), None, "for ever");
    let never =
        Settings { thermal: Some(Thermal { continuous_a: 1.0, time_constant_s: 0 }), ..Settings::default() };
    let plant = plant(Family::G2, 5, 2_000, true);
    let error = Axis::new(&plant.config).expect("valid").protected(&never).expect_err("no time constant");
    assert!(
        matches!(error, SettingsError::Value(value) if value.field.name() == "limits.thermal_time_constant_s")
    );
}

/// A motor whose encoder stands still from a tick on.
struct Unplugged {
    motor: VirtualMotor,
    ticks: u32,
    from: u32,
    last: i32,
}

impl Motor for Unplugged {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        let mut reading = self.motor.pass(drive)?;
        self.ticks += 1;
        if self.ticks >= self.from {
            reading.count = self.last;
        }
        self.last = reading.count;
        Ok(reading)
    }
}

#[test]
fn the_image_finds_an_unplugged_encoder_and_the_host_agrees_bit_by_bit() {
    let plant = plant(Family::G2, 0, 1_000, true);
    let motor = Unplugged { motor: VirtualMotor::new(&plant), ticks: 0, from: 6_000, last: 0 };
    let wire = Lockstep::start(&qemu(), Box::new(motor), plant.config).expect("QEMU runs");
    let commission = Task::Commission { budget_s: 4.0, seed: 1 };
    let sine = Task::Track {
        profile: Profile::Sine {
            amplitude_rad: (0.4 * plant.truth.gain * 12.0 / std::f64::consts::TAU) as f32,
            frequency_hz: 1.0,
            seconds: 4.0,
        },
        compensation: true,
    };
    let tasks = [commission, sine];
    let result = session::run(Box::new(wire), plant.config, 1, &tasks, &mut |_| {}).expect("a session");
    assert!(matches!(result.done.last(), Some(Done::Tracked(span)) if span.faulted), "{:?}", result.done);
    let faulted = |row: &&truing::device::run_log::Row| row.record.fault != Fault::None;
    let first = result.log.rows.iter().find(faulted).expect("a fault");
    assert_eq!(first.record.fault, Fault::EncoderUnplugged);
    // The first reading is that of tick 0. A tick brings some ten counts here, more than a missing motion needs.
    assert!((5_999..6_600).contains(&first.tick), "{}", first.tick);
    let verdict = replay(&result.log.tape()).expect("a whole tape");
    assert!(verdict.identical(), "{verdict}");
}
