//! What long runs of ordinary motion once mistook for a fault, each with its cause.

use servo::axis::Command;
use servo::compensate::modelled::Modelled;
use servo::encoder::Standstill;
use servo::protect::{Fault, Settings};
use servo::units::Speed;
use trials::families::{Cause, Family, Imperfection, Options, Plant, Seeds, Severity};
use trials::faults::calm;
use trials::faults::trial::Trial;
use trials::faults::world::Injury;
use trials::tracking::{exact, knowing};
use truing::synthetic::reference_plant::Train;

fn commissioned(family: Family, number: u32, sensed: bool, budget_ms: u32) -> (Plant, Trial) {
    let options = Options { tick_hz: 1000, ..Options::default() };
    let seeds = Seeds::Evaluation(700_000 + number);
    let mut plant = Plant::draw(family, Severity::Harsh, seeds, &options);
    plant.sensing.current = sensed;
    let trial = Trial::commissioned(&plant, &Settings::default(), budget_ms);
    assert_eq!(trial.fault(), Fault::None);
    (plant, trial)
}

#[test]
fn a_counter_that_stands_bounds_the_speed() {
    let mut standstill = Standstill::default();
    let fast = Speed(3 << 20);
    standstill.watch(10);
    assert_eq!(standstill.allows(fast), fast, "it has just moved");
    for tick in 1..=500 {
        standstill.watch(10 + (tick & 1));
        assert_eq!(standstill.allows(fast), Speed(((2 << 20) / tick).min(fast.0)));
        assert_eq!(standstill.allows(Speed(7)), Speed(7));
    }
}

/// A shaft that ran back when it last passed a count runs back still, or stands.
#[test]
fn a_counter_that_runs_back_bounds_the_speed() {
    let mut standstill = Standstill::default();
    for tick in 1..=40 {
        standstill.watch(-(tick / 4));
    }
    let back = Speed(-(2 << 20) / 8);
    assert_eq!(standstill.allows(Speed(5 << 16)), back);
    assert_eq!(standstill.allows(Speed(-(5 << 16))), Speed(-(5 << 16)));
    for tick in 1..=100 {
        standstill.watch(-10);
        let most = -((2 << 20) / tick);
        assert_eq!(standstill.allows(Speed(5 << 16)), Speed(most.max(back.0)));
    }
}

/// Between one and two dead zones nothing is demanded of a shaft at rest, which break-away friction may hold. (What a speed
/// that the observer alone sees may not do is the matter of the last test here.)
#[test]
fn of_a_shaft_that_friction_may_hold_nothing_is_demanded() {
    for (family, number, sensed) in [(Family::G3, 4, true), (Family::G2, 11, false)] {
        let (plant, mut trial) = commissioned(family, number, sensed, 5_000);
        trial.world.injure(Injury::Stall);
        // The loops take the dead zone off: 0.3 of it more is 1.3 at the terminals, 0.6 more is 1.6.
        for (share, side) in [(-0.3, 1), (0.6, 0), (0.3, 0), (-0.6, 1), (0.6, 0)] {
            let volts = share * plant.truth.dead_zone_v[side];
            trial.must(Command::Voltage(volts as f32));
            trial.run(6.0 * plant.truth.time_constant_s, |_, _| {});
            assert_eq!(trial.fault(), Fault::None, "{family:?}, {volts} V behind the dead zone");
        }
    }
}

/// The current of a large winding passes through zero for tens of milliseconds when the drive turns into a brake; its
/// rise is hidden by noise, and is no missing current.
#[test]
fn a_current_that_passes_through_zero_is_not_missing() {
    let (plant, mut trial) = commissioned(Family::Paper, 0, true, 20_000);
    assert_eq!(plant.truth.cause, Cause::Input);
    for speed in [-30.0, -12.6, -28.0, -12.6, 25.0, 10.0, 30.0, -30.0, -14.0, -30.0, -12.6] {
        trial.must(Command::Speed(speed));
        trial.run(4.0 * plant.truth.time_constant_s, |_, _| {});
        assert_eq!(trial.fault(), Fault::None, "towards {speed} rad/s");
    }
}

/// Minutes of ordinary motion in which a shaft that stood, or still ran back, was believed to turn forwards slowly, and less
/// than its break-away level was demanded of it.
#[test]
fn a_slow_speed_that_the_observer_alone_sees_begins_no_motion() {
    for (family, number, sensed, seconds) in
        [(Family::G1, 1000, true, 290.0), (Family::G2, 1020, true, 335.0), (Family::Paper, 903, false, 40.0)]
    {
        let plant = calm::plant(family, Seeds::Evaluation(700_000 + number), 1000, sensed, seconds);
        let calm = calm::run(&plant, family, seconds);
        assert_eq!(calm.fault, Fault::None, "{family:?} {number} {calm:?}");
        assert!(calm.seconds >= seconds, "{calm:?}");
    }
}

/// The current of a large winding hardly rises within a block of slow motion. Its noise made the learned inductance 3 % of
/// what it is and K 1.25 times too large; a current that passed through zero, and had to, was then missing.
#[test]
fn noise_does_not_teach_a_winding() {
    let plant = calm::plant(Family::Paper, Seeds::Evaluation(702_000), 1000, true, 500.0);
    let calm = calm::run(&plant, Family::Paper, 500.0);
    assert_eq!(calm.fault, Fault::None, "{calm:?}");
}

/// The voltage of a large winding had turned, its current still drove the shaft the old way; the model turned round
/// 50 ms before the shaft did.
#[test]
fn a_current_that_still_flows_the_old_way_begins_no_motion() {
    let plant = calm::plant(Family::Paper, Seeds::Evaluation(706_004), 1000, true, 1420.0);
    let calm = calm::run(&plant, Family::Paper, 1420.0);
    assert_eq!(calm.fault, Fault::None, "{calm:?}");
}

/// A load that stayed while the dead zone was learned was taken for friction, and then went.
#[test]
fn a_load_within_the_learned_dead_zone_does_not_lower_the_margin() {
    let plant = calm::plant(Family::G2, Seeds::Evaluation(708_008), 1000, true, 770.0);
    let calm = calm::run(&plant, Family::G2, 770.0);
    assert_eq!(calm.fault, Fault::None, "{calm:?}");
}

/// A shaft that had crept below 1/16 of full speed met an end stop with 1.3 dead zones. It had not broken away anew, yet less was
/// taken off than while it turned fast, and the model coasted on.
#[test]
fn a_shaft_that_creeps_into_an_end_stop_raises_no_alarm() {
    let plant = calm::plant(Family::G2, Seeds::Evaluation(730_405), 1000, false, 3600.0);
    let calm = calm::run(&plant, Family::G2, 190.0);
    assert_eq!(calm.fault, Fault::None, "{calm:?}");
}

/// A rotor with 15 % of the inertia behind a gear with play and teeth that meet hard.
fn with_heavy_play(mut plant: Plant) -> Plant {
    let half = plant.clone().with(Imperfection::Backlash);
    let Train::Play { mut split, gap_rad, stiffness, damping } = half.motor.train else {
        panic!("no play");
    };
    split.inertia = 0.85;
    // Five times the contact's rate on the reduced inertia, the same share of critical damping.
    let reduced = split.inertia * (1.0 - split.inertia) / 0.25;
    plant.motor.train = Train::Play {
        split,
        gap_rad,
        stiffness: 25.0 * reduced * stiffness,
        damping: 5.0 * reduced * damping,
    };
    plant
}

/// In small steps the rotor ran free through the play; the speed of two or three counts was taken for that of the whole
/// inertia, and was missing when the teeth had met, 7 to 20 ms after the step.
#[test]
fn a_rotor_that_runs_free_through_play_begins_no_motion() {
    for family in [Family::G1, Family::G2, Family::G3] {
        for seed in 0..12 {
            let plant = Plant::draw(family, Severity::Nominal, Seeds::Design(seed), &Options::default());
            let plant = with_heavy_play(plant);
            let tau = plant.truth.time_constant_s;
            let mut bench = knowing(&plant);
            let mut size = 0.003 * plant.truth.gain * plant.motor.drive.supply_v * tau;
            let mut target = 0.0;
            for step in 0..14 {
                target += if step % 2 == 0 { size } else { -1.5 * size };
                size *= if step % 2 == 0 { 1.0 } else { 1.7 };
                bench.ask(Command::Position(target as f32)).expect("no fault");
                bench.run(10.0 * tau, |_, _| {});
                let fault = bench.state.fault();
                assert_eq!(fault, Fault::None, "{family:?} {seed}, step {step} of {size} rad");
            }
        }
    }
}

/// A drive that answers late: motion was demanded of a shaft that no voltage had reached yet. With the lag that a model tells
/// protection waits that long, and still finds a shaft that is stuck.
#[test]
fn a_lag_that_a_model_tells_begins_no_motion() {
    const LATE: f64 = 0.25;
    let options = Options { tick_hz: 1000, ..Options::default() };
    for family in [Family::G1, Family::G2, Family::G3] {
        let mut alarms = 0;
        for seed in 50..54 {
            let mut plant = Plant::draw(family, Severity::Nominal, Seeds::Design(seed), &options);
            let tau = plant.truth.time_constant_s;
            plant.motor.drive.delay_s = LATE * tau;
            plant.sensing.current = false;
            let back_and_forth = |told_s: f64| {
                let mut trial = Trial::fresh(&plant, &Settings::default());
                trial.must(Command::Adopt(exact(&plant)));
                let lag = (16.0 * told_s * f64::from(plant.config.tick_hz)) as u16;
                trial.must(Command::Modelled(Modelled { lag, ..Modelled::default() }));
                trial.must(Command::Arm);
                let volts = 0.5 * plant.motor.drive.supply_v - plant.truth.dead_zone_v[0];
                for turn in 0..12 {
                    let sign = if turn % 2 == 0 { 1.0 } else { -1.0 };
                    if !trial.may(Command::Voltage((sign * volts) as f32)) {
                        break;
                    }
                    trial.run(2.5 * tau, |_, _| {});
                }
                trial
            };
            alarms += u32::from(back_and_forth(0.0).fault() != Fault::None);
            let mut stuck = back_and_forth(LATE * tau);
            assert_eq!(stuck.fault(), Fault::None, "{family:?} {seed}");
            stuck.world.injure(Injury::Stall);
            stuck.run(0.02 + (0.6 + LATE) * tau, |_, _| {});
            assert_eq!(stuck.fault(), Fault::NoMotion, "{family:?} {seed}, stalled");
        }
        assert!(alarms > 0, "{family:?}: what is not told is an alarm");
    }
}
