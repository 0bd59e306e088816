//! One joint as a whole: what it accepts, what it refuses, and that it is a value that repeats itself bit by bit.

use host_tests::joint::{Joint, Plan};
use servo::axis::{Axis, Bridge, Output, Refusal, Sample};
use servo::config::Config;
use servo::control::Tuning;
use servo::protocol::Command;
use servo::record::{Activity, Source};
use truing::truth::{Friction, Motor};

/// A small geared motor: 12 V, 20 rad/s/V, 40 ms, 1.2 V of friction, 500 counts.
fn plan() -> Plan {
    let (resistance, constant) = (1.5, 0.05);
    let mut motor = Motor::linear(resistance, 1e-3, constant, 6.7e-5, 1e-6, 12.0);
    motor.friction = Friction::coulomb(1.2 * constant / resistance);
    let config = Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 500,
        rated_speed_rad_s: 220.0,
        tick_hz: 10_000,
        time_constant_hint_s: None,
        gear_ratio: 1.0,
        travel_limit_rad: None,
        current_limit_a: None,
        energy_limit_j: None,
        speed_limit_rad_s: None,
        pwm_delay_ticks: 1,
        pwm_full_scale: 4200,
        vbus_v_per_lsb: 0.005,
        current_a_per_lsb: 0.01,
    };
    Plan {
        motor,
        config,
        encoder_error: 0.1,
        supply_noise_v: 0.02,
        current_sensed: false,
        seed: 7,
    }
}

fn joint(plan: &Plan) -> Joint {
    Joint::new(plan, Tuning::default()).expect("valid configuration")
}

fn refused(joint: &mut Joint, command: Command) -> Refusal {
    joint
        .axis
        .command(&mut joint.state, &command)
        .expect_err("a refusal")
}

const SINE: Command = Command::TrackSine {
    amplitude_rad: 6.0,
    frequency_hz: 1.0,
    duration_ms: 3_000,
};
const COMMISSION: Command = Command::Commission {
    budget_ms: 5_000,
    seed: 1,
};

#[test]
fn it_commissions_itself_and_then_tracks_several_times_better_with_what_it_learned() {
    let mut joint = joint(&plan());
    joint.run(0.01);
    joint.must(Command::Arm);
    joint.must(COMMISSION);
    joint.run(6.0);
    let report = joint.axis.report(&joint.state).commissioning.expect("an outcome");
    assert_eq!(report.refused, None);
    let (positive, negative) = (report.estimates.dead_zone_pos_v, report.estimates.dead_zone_neg_v);
    assert!(positive.trusted && negative.trusted, "{report:?}");
    assert!(
        (positive.value.expect("a value") - 1.2).abs() < 0.03,
        "{positive:?}"
    );
    assert_eq!(joint.output.bridge, Bridge::Open);

    let rms = [false, true].map(|on| {
        joint.must(Command::Compensation(on));
        joint.must(SINE);
        let mut sum = 0.0;
        for _ in 0..30_000 {
            let before = joint.position();
            joint.tick();
            sum += (joint.reference() - before).powi(2);
        }
        (sum / 30_000.0).sqrt() / (6.0 * joint.counts_per_rad())
    });
    assert!(rms[1] < 0.013, "{rms:?} of the amplitude");
    assert!(rms[0] > 4.0 * rms[1], "{rms:?} of the amplitude");
    assert_eq!(joint.output.record.gain_source, Source::Trusted);
    assert_eq!(joint.output.record.dead_zone_source, [Source::Trusted; 2]);
}

#[test]
fn torque_needs_arming_and_motion_needs_knowledge() {
    let mut joint = joint(&plan());
    joint.run(0.01);
    assert_eq!(refused(&mut joint, SINE), Refusal::NotArmed);
    assert_eq!(refused(&mut joint, COMMISSION), Refusal::NotArmed);
    joint.must(Command::Arm);
    assert_eq!(refused(&mut joint, SINE), Refusal::NotIdentified);
    assert_eq!(
        refused(&mut joint, Command::Position(1.0)),
        Refusal::NotIdentified
    );
    joint.must(COMMISSION);
    assert_eq!(refused(&mut joint, COMMISSION), Refusal::Busy);
    assert_eq!(refused(&mut joint, SINE), Refusal::Busy);
    joint.run(0.5);
    assert_eq!(joint.output.record.activity, Activity::Commissioning);
    joint.must(Command::Stop);
    joint.run(0.01);
    assert_eq!((joint.output.bridge, joint.output.duty), (Bridge::Open, 0));
    let report = joint.axis.report(&joint.state).commissioning.expect("an outcome");
    assert_eq!(report.refused, Some(servo::identify::estimate::Reason::Aborted));
    assert_eq!(refused(&mut joint, SINE), Refusal::NotArmed);
}

#[test]
fn targets_beyond_the_end_stops_are_refused() {
    let mut plan = plan();
    plan.config.travel_limit_rad = Some([-3.0, 3.0]);
    plan.config.time_constant_hint_s = Some(0.04);
    let mut joint = joint(&plan);
    joint.run(0.01);
    joint.must(Command::Arm);
    assert_eq!(refused(&mut joint, SINE), Refusal::BeyondTravel);
    assert_eq!(refused(&mut joint, Command::Position(3.1)), Refusal::BeyondTravel);
    assert_eq!(
        refused(&mut joint, Command::Position(f32::NAN)),
        Refusal::OutOfRange
    );
    joint.must(Command::Position(2.9));
}

#[test]
fn a_replay_of_the_raw_integers_gives_the_same_bits_and_two_axes_do_not_disturb_one_another() {
    let mut joint = joint(&plan());
    let axis = Axis::new(&plan().config).expect("valid configuration");
    let (mut replay, mut bystander) = (axis.start(), axis.start());
    for k in 0..60_000u32 {
        if let Some(command) = match k {
            100 => Some(Command::Arm),
            101 => Some(COMMISSION),
            55_000 => Some(SINE),
            _ => None,
        } {
            joint.must(command);
            axis.command(&mut replay, &command)
                .expect("accepted as on the chip");
        }
        let Output { record, .. } = joint.tick();
        let sample = Sample {
            count: record.count,
            vbus_raw: record.vbus_raw,
            current_raw: record.current_raw,
        };
        assert_eq!(axis.step(&mut replay, sample), joint.output, "tick {k}");
        let idle = axis.step(
            &mut bystander,
            Sample {
                count: -record.count,
                ..sample
            },
        );
        assert_eq!((idle.bridge, idle.duty), (Bridge::Open, 0));
    }
}
