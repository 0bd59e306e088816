//! The identifier, the compensator and the loop step of `servo`.

use crate::motor::Motor;
use crate::tally::Tally;
use core::hint::black_box;
use servo::axis::Command;
use servo::axis::{Axis, Bridge, Output, Sample, State};
use servo::commission::Input;
use servo::compensate::modelled::{DryFriction, LoadFriction, OverSpeed, Told};
use servo::compensate::{Compensator, SignSource, Smoothing};
use servo::config::Config;
use servo::identify::estimate::Estimates;
use servo::identify::passive;
use servo::record::Activity;
use servo::units::{Voltage, VoltageQ14};

fn config(tick_hz: u32) -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 2048,
        rated_speed_rad_s: 200.0,
        tick_hz,
        gear_ratio: 1.0,
        pwm_delay_ticks: 1,
        pwm_full_scale: 4200,
        vbus_v_per_lsb: 0.005,
        current_a_per_lsb: 0.01,
        ..Config::EXAMPLE
    }
}

/// Supply in converter counts.
const SUPPLY: u16 = 2400;

/// A joint on its motor, and the identifier alone on the same signals.
struct Bench {
    axis: Axis,
    state: State,
    motor: Motor,
    acting: Output,
    seconds: f32,
    identifier: passive::Params,
    learner: passive::State,
    known: Estimates,
    loop_step: Tally,
    identify: Tally,
}

impl Bench {
    fn tick(&mut self) -> Activity {
        let duty = f32::from(self.acting.duty) / 4200.0;
        self.motor.pass((self.acting.bridge != Bridge::Open).then_some(duty), self.seconds);
        let sample =
            Sample { count: self.motor.count(), vbus_raw: SUPPLY, current_raw: Sample::CURRENT_NOT_SENSED };
        let (axis, state) = (&self.axis, &mut self.state);
        let output = self.loop_step.count(|| axis.step(state, black_box(sample)));
        // The duty of this tick acts from the next one on: a delay of one tick.
        let input = Input {
            count: sample.count,
            voltage: VoltageQ14(i32::from(self.acting.duty) * 16_384 / 4200),
            load: VoltageQ14(0),
            bridge: self.acting.bridge,
            supply: Some(VoltageQ14::NOMINAL),
            current_raw: None,
        };
        let (identifier, learner, known) = (&self.identifier, &mut self.learner, &mut self.known);
        self.identify.count(|| identifier.step(learner, known, black_box(&input)));
        self.acting = output;
        output.record.activity
    }

    /// Runs while the joint does this; prints what it took.
    fn during(&mut self, activity: Activity, most: u32, names: [&str; 2], tick_hz: u32) {
        (self.loop_step, self.identify) = Default::default();
        for _ in 0..most {
            if self.tick() != activity {
                break;
            }
        }
        self.loop_step.print(names[0], tick_hz);
        self.identify.print(names[1], tick_hz);
    }

    fn command(&mut self, command: &Command) {
        self.axis.command(&mut self.state, command).expect("accepted");
    }
}

/// Commissions and tracks at this control rate.
pub fn run(tick_hz: u32) {
    let config = config(tick_hz);
    let axis = Axis::new(&config).expect("a good configuration");
    let identifier = passive::Params::new(axis.scale());
    let known = Estimates::default();
    let mut bench = Bench {
        state: axis.start(),
        axis,
        motor: Motor::default(),
        acting: Output::default(),
        seconds: 1.0 / tick_hz as f32,
        learner: identifier.listen(0, &known),
        identifier,
        known,
        loop_step: Tally::default(),
        identify: Tally::default(),
    };
    for _ in 0..20 {
        bench.tick();
    }
    bench.command(&Command::Arm);
    bench.command(&Command::Commission { budget_ms: 4_000, seed: 1 });
    // The first two ticks of a commissioning set it up.
    bench.tick();
    bench.tick();
    bench.during(
        Activity::Commissioning,
        5 * tick_hz,
        ["loop, commissioning", "identifier, learning"],
        tick_hz,
    );
    for _ in 0..20 {
        bench.tick();
    }
    bench.command(&Command::TrackSine { amplitude_rad: 5.0, frequency_hz: 1.0, duration_ms: 3_000 });
    bench.tick();
    bench.during(Activity::Tracking, 4 * tick_hz, ["loop, tracking", "identifier, listening"], tick_hz);
}

/// The compensator alone.
pub fn compensator() {
    let width = |share: f32| Voltage((share * Voltage::NOMINAL.0 as f32) as i32);
    let compensator =
        black_box(Compensator::new(width(0.10), width(0.12), SignSource::Reference, Smoothing::WIDEST));
    let mut tally = Tally::default();
    for k in -2_000..2_000 {
        let (linear, reference) = (Voltage(k * 400), Voltage(k * 300));
        tally.count(|| compensator.apply(black_box(linear), black_box(Some(reference)), black_box(false)));
    }
    tally.print("compensator", 0);
    let told = black_box(Told {
        load_friction: LoadFriction::new(8_000),
        over_speed: OverSpeed { skew: 3_000, drag: 2_000 },
        dry: DryFriction { share: 0, breakaway: 2_000, stribeck: 40_000 },
    });
    let mut tally = Tally::default();
    for k in -2_000..2_000 {
        let (linear, reference) = (Voltage(k * 400), Voltage(k * 300));
        tally.count(|| {
            compensator.apply_told(&told, black_box(linear), black_box(reference), black_box(false))
        });
    }
    tally.print("compensator, told", 0);
}
