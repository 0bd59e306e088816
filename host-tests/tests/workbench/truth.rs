//! The independent integrator against solutions in closed form.

use servo::axis::Bridge;
use std::f64::consts::TAU;
use truing::synthetic::reference_plant::motor::Motor;
use truing::synthetic::reference_plant::state::*;
use truing::synthetic::reference_plant::{
    Bristle, Command, Decay, Drive, Friction, Simulator, Split, Thermal, Train,
};

fn motor() -> Motor {
    Motor::linear(2.0, 1e-3, 0.05, 1e-4, 1e-4, 12.0)
}

fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} ± {tolerance:e}");
}

/// ω(t) of the linear motor after a step of u, from the two poles.
fn step_response(m: &Motor, u: f64, t: f64) -> f64 {
    let (r, l, k, j, b) = (m.resistance_ohm, m.inductance_h, m.torque_constant, m.inertia, m.viscous[0]);
    let half = 0.5 * (r / l + b / j);
    let product = (r * b + k * k) / (l * j);
    let root = (half * half - product).sqrt();
    let (p, q) = (-half + root, -half - root);
    let steady = u * m.gain();
    steady * (1.0 + (q * (p * t).exp() - p * (q * t).exp()) / (p - q))
}

#[test]
fn step_of_voltage_gives_the_two_pole_response() {
    let m = motor();
    let mut simulator = Simulator::new(m.clone(), 1e-9, 1);
    simulator.command(Command::Volts(6.0), Bridge::Driven);
    for k in 1..=200 {
        let t = 1e-3 * f64::from(k);
        simulator.advance(t);
        close(simulator.state()[SPEED], step_response(&m, 6.0, t), 1e-6);
    }
}

#[test]
fn inductance_too_small_to_matter_costs_no_small_steps() {
    let mut m = motor();
    m.inductance_h = 1e-9;
    let mut simulator = Simulator::new(m.clone(), 1e-9, 1);
    let started = std::time::Instant::now();
    let reading = simulator.run(Command::Volts(6.0), Bridge::Driven, 0.1);
    let rate = (m.torque_constant.powi(2) / m.resistance_ohm + m.viscous[0]) / m.inertia;
    close(reading.omega, 6.0 * m.gain() * (1.0 - (-rate * 0.1).exp()), 1e-5);
    // An explicit method would need about 1e8 steps of the electrical time constant.
    assert!(started.elapsed().as_millis() < 100);
}

#[test]
fn coasting_against_dry_and_viscous_friction_stops_at_the_exact_time_and_angle() {
    let mut m = motor();
    m.friction = Friction::coulomb(0.004);
    let (j, b, f, start) = (m.inertia, m.viscous[0], 0.004, 80.0);
    let stop = j / b * (1.0 + b * start / f).ln();
    let angle = j / b * (start - f / b * (1.0 + b * start / f).ln());
    let mut simulator = Simulator::new(m, 1e-10, 1).moving_at(start, 0.0);
    simulator.advance(stop - 1e-6);
    assert!(simulator.state()[SPEED] > 0.0);
    simulator.advance(stop + 1e-6);
    assert_eq!(simulator.state()[SPEED], 0.0);
    simulator.advance(stop + 10.0);
    assert_eq!(simulator.state()[SPEED], 0.0);
    close(simulator.state()[ANGLE], angle, 1e-6);
    assert_eq!(simulator.switchings(), 1);
}

#[test]
fn shaft_sticks_until_a_growing_torque_reaches_the_breakaway_level() {
    let mut m = motor();
    m.friction = Friction { breakaway_ratio: 1.5, stribeck_rad_s: 2.0, ..Friction::coulomb(0.004) };
    m.load.periodic_nm = 0.01;
    m.load.periodic_hz = 0.5;
    let breakaway = (0.006_f64 / 0.01).asin() / (TAU * 0.5);
    let mut simulator = Simulator::new(m, 1e-9, 1);
    simulator.advance(breakaway - 1e-7);
    assert_eq!(simulator.state()[ANGLE], 0.0);
    simulator.advance(breakaway + 1e-3);
    assert!(simulator.state()[SPEED] > 0.0);
}

#[test]
fn current_limit_gives_constant_acceleration_and_is_left_at_the_right_speed() {
    let mut m = motor();
    m.viscous = [0.0; 2];
    m.inductance_h = 1e-6;
    m.drive.current_limit_a = 2.0;
    let mut simulator = Simulator::new(m.clone(), 1e-9, 1);
    simulator.command(Command::Volts(6.0), Bridge::Driven);
    let acceleration = m.torque_constant * 2.0 / m.inertia;
    // The limit holds while 6 V − 2 Ω·2 A exceeds the back-EMF: up to 40 rad/s.
    let leaves = 40.0 / acceleration;
    simulator.advance(0.9 * leaves);
    close(simulator.state()[SPEED], 36.0, 2e-3);
    assert_eq!(simulator.state()[CURRENT], 2.0);
    simulator.advance(leaves + 0.02);
    let rate = m.torque_constant.powi(2) / m.resistance_ohm / m.inertia;
    close(simulator.state()[SPEED], 120.0 - 80.0 * (-rate * 0.02_f64).exp(), 5e-3);
}

#[test]
fn brush_drop_costs_its_voltage_and_holds_the_current_at_zero_when_it_is_not_overcome() {
    let mut m = motor();
    m.drive.drop_v = 1.0;
    let mut simulator = Simulator::new(m.clone(), 1e-8, 1);
    let held = simulator.run(Command::Volts(0.9), Bridge::Driven, 1.0);
    assert_eq!((held.omega, held.current), (0.0, 0.0));
    simulator.run(Command::Volts(6.0), Bridge::Driven, 10.0);
    close(simulator.state()[SPEED], 5.0 * m.gain(), 1e-4);
}

#[test]
fn dead_zone_limit_and_supply_act_in_the_declared_order() {
    let mut m = motor();
    m.drive.dead_zone_v = [1.2, 0.8];
    m.drive.limit_v = [6.8, 6.0];
    let steady =
        |command, m: &Motor| Simulator::new(m.clone(), 1e-8, 1).run(command, Bridge::Driven, 10.0).omega;
    close(steady(Command::Volts(5.0), &m), 3.8 * m.gain(), 1e-4);
    close(steady(Command::Volts(-5.0), &m), -4.2 * m.gain(), 1e-4);
    close(steady(Command::Volts(9.0), &m), 6.8 * m.gain(), 1e-4);
    close(steady(Command::Volts(-9.0), &m), -6.0 * m.gain(), 1e-4);
    close(steady(Command::Duty(0.5), &m), 4.8 * m.gain(), 1e-4);
    // d = 1: v = V − Rs·i, and i = b ω / K at a steady speed.
    let m = Motor { drive: Drive { source_ohm: 0.5, ..Drive::ideal(12.0) }, ..motor() };
    let current_per_speed = m.viscous[0] / m.torque_constant;
    let expected = 12.0 / (m.emf_constant + (m.resistance_ohm + 0.5) * current_per_speed);
    close(steady(Command::Duty(1.0), &m), expected, 1e-4);
}

#[test]
fn delay_is_pure_and_lag_is_exponential() {
    let mut m = motor();
    m.drive.delay_s = 0.0123;
    let mut simulator = Simulator::new(m, 1e-9, 1);
    simulator.command(Command::Volts(6.0), Bridge::Driven);
    simulator.advance(0.0123);
    assert_eq!(simulator.state()[SPEED], 0.0);
    simulator.advance(0.0523);
    close(simulator.state()[SPEED], step_response(&motor(), 6.0, 0.04), 1e-6);

    let mut m = motor();
    m.drive.lag_s = 0.02;
    let mut simulator = Simulator::new(m, 1e-9, 1);
    simulator.run(Command::Volts(6.0), Bridge::Driven, 0.03);
    close(simulator.state()[LAG], 6.0 * (1.0 - (-1.5_f64).exp()), 1e-7);
}

#[test]
fn lossless_two_mass_motor_rings_at_its_eigenfrequency() {
    let mut m = motor();
    m.viscous = [0.0; 2];
    m.train = Train::Flexible { split: Split { inertia: 0.25, viscous: 0.0 }, stiffness: 0.3, damping: 0.0 };
    let [rotor, load] = m.inertias();
    let omega = (0.3 / (rotor * load / (rotor + load))).sqrt();
    let mut simulator = Simulator::new(m, 1e-10, 1);
    simulator.command(Command::Torque(0.02), Bridge::Driven);
    // Relative motion under a constant torque: twist(t) = twist_static (1 − cos ωt).
    let held = 0.02 * load / (rotor + load) / 0.3;
    for k in 1..50 {
        let t = 0.001 * f64::from(k);
        simulator.advance(t);
        let y = simulator.state();
        close(y[ANGLE] - y[LOAD_ANGLE], held * (1.0 - (omega * t).cos()), 1e-6 * held);
    }
}

#[test]
fn teeth_that_meet_without_loss_keep_momentum_and_energy() {
    let mut m = motor();
    m.viscous = [0.0; 2];
    let split = Split { inertia: 0.5, viscous: 0.0 };
    m.train = Train::Play { split, gap_rad: 0.02, stiffness: 50.0, damping: 0.0 };
    let [rotor, load] = m.inertias();
    let mut simulator = Simulator::new(m, 1e-10, 1);
    // A torque for 10 ms sets the rotor in motion inside the play; then it meets the load.
    simulator.run(Command::Torque(2e-3), Bridge::Driven, 0.01);
    let momentum = rotor * simulator.state()[SPEED];
    let energy = 0.5 * rotor * simulator.state()[SPEED].powi(2);
    assert_eq!(simulator.state()[LOAD_SPEED], 0.0);
    simulator.command(Command::Torque(0.0), Bridge::Driven);
    let mut exchanged = false;
    for k in 1..=400 {
        simulator.advance(0.01 + 0.005 * f64::from(k));
        let y = simulator.state();
        let twist = y[ANGLE] - y[LOAD_ANGLE];
        let stored = 0.5 * 50.0 * (twist.abs() - 0.01).max(0.0).powi(2);
        close(rotor * y[SPEED] + load * y[LOAD_SPEED], momentum, 1e-8 * momentum);
        close(
            0.5 * (rotor * y[SPEED].powi(2) + load * y[LOAD_SPEED].powi(2)) + stored,
            energy,
            1e-5 * energy,
        );
        // Equal bodies exchange their speeds.
        exchanged |= y[SPEED].abs() < 1e-5 * y[LOAD_SPEED].abs();
    }
    assert!(exchanged);
    assert_eq!(simulator.overlooked(), 0);
}

#[test]
fn bristles_deflect_before_sliding_and_slide_at_the_kinetic_level() {
    let mut m = motor();
    m.viscous = [0.0; 2];
    let bristle = Bristle { deflection_rad: 1e-3, damping: 2e-3 };
    m.friction = Friction { bristle: Some(bristle), ..Friction::coulomb(0.004) };
    let mut simulator = Simulator::new(m.clone(), 1e-8, 1);
    // Below the level the shaft rests at the deflection of a spring of 4 N m/rad.
    simulator.run(Command::Torque(0.001), Bridge::Driven, 2.0);
    close(simulator.state()[BRISTLE], 0.25e-3, 1e-6);
    assert!(simulator.state()[ANGLE] < 1e-3);
    let start = simulator.run(Command::Torque(0.006), Bridge::Driven, 0.5).omega;
    let end = simulator.run(Command::Torque(0.006), Bridge::Driven, 0.5).omega;
    close(end - start, 0.5 * 0.002 / m.inertia, 1e-3);
}

#[test]
fn fast_decay_gives_the_discontinuous_current_of_the_closed_form() {
    let mut m = motor();
    m.inertia = 1e6;
    m.inductance_h = 2e-4;
    m.drive.decay = Decay::Fast { pwm_hz: 5000.0 };
    let (duty, period, tau) = (0.3, 2e-4, 1e-4_f64);
    let (u, r) = (12.0, 2.0);
    let on = duty * period;
    let peak = u / r * (1.0 - (-on / tau).exp());
    let off = tau * (1.0 + peak * r / u).ln();
    assert!(on + off < period);
    let rising = u / r * (on - tau * (1.0 - (-on / tau).exp()));
    let falling = (peak + u / r) * tau * (1.0 - (-off / tau).exp()) - u / r * off;
    let mut simulator = Simulator::new(m, 1e-9, 1);
    simulator.step(duty, Bridge::Driven, 10.0 * period);
    let mean = simulator.step(duty, Bridge::Driven, 10.0 * period).current;
    close(mean, (rising + falling) / period, 1e-6);
}

#[test]
fn copper_heats_by_the_first_order_law() {
    let mut m = motor();
    m.inertia = 1e9;
    m.thermal = Some(Thermal { rise_per_w: 0.01, time_constant_s: 3.0 });
    let mut simulator = Simulator::new(m, 1e-9, 1);
    simulator.run(Command::Volts(6.0), Bridge::Driven, 60.0);
    // Steady: h = R (1 + ρh) i² with i = u / (R (1 + ρh)), so (1 + ρh) h = u²/R.
    let h = (-1.0 + (1.0 + 4.0 * 0.01 * 18.0_f64).sqrt()) / 0.02;
    close(simulator.state()[HEAT], h, 1e-5);
    close(simulator.state()[CURRENT], 3.0 / (1.0 + 0.01 * h), 1e-6);
}

/// A motor with nearly everything at once.
fn imperfect() -> Motor {
    let mut m = motor();
    m.friction = Friction {
        breakaway_ratio: 1.4,
        stribeck_rad_s: 2.0,
        ripple: 0.1,
        ripple_periods: 3.0,
        ..Friction::coulomb(0.004)
    };
    m.drag = 1e-7;
    m.drive.dead_zone_v = [0.5, 0.4];
    m.drive.limit_v = [9.0, 9.5];
    m.drive.source_ohm = 0.1;
    m.drive.gain = [1.02, 0.99];
    m.drive.current_limit_a = 4.0;
    m.load.cogging_nm = 0.001;
    m.load.cogging_periods = 12.0;
    m.load.mgl_nm = 0.002;
    m
}

fn trajectory(tolerance: f64) -> Vec<f64> {
    let mut simulator = Simulator::new(imperfect(), tolerance, 1);
    let omegas = (0..3000)
        .map(|k| simulator.step((0.01 * f64::from(k)).sin() * 0.9, Bridge::Driven, 1e-3).omega)
        .collect();
    assert_eq!(simulator.overlooked(), 0);
    assert!(simulator.switchings() > 4);
    omegas
}

#[test]
fn error_falls_with_the_tolerance_on_a_motor_with_everything_at_once() {
    let reference = trajectory(1e-11);
    let error = |tolerance| {
        let worst =
            trajectory(tolerance).iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        worst / 240.0
    };
    let (coarse, fine) = (error(1e-5), error(1e-8));
    println!("relative error {coarse:.1e} at 1e-5, {fine:.1e} at 1e-8");
    assert!(coarse < 2e-4 && fine < 1e-6 && fine < 0.05 * coarse);
}

#[test]
fn ten_kilohertz_lock_step_runs_far_faster_than_real_time() {
    let mut simulator = Simulator::new(imperfect(), 1e-6, 1);
    let started = std::time::Instant::now();
    for k in 0..50_000 {
        let duty = (0.0006 * f64::from(k)).sin() * 0.9 + 0.01 * f64::from(k % 7);
        simulator.step(duty, Bridge::Driven, 1e-4);
    }
    let factor = 5.0 / started.elapsed().as_secs_f64();
    println!(
        "{factor:.0} times real time, {} steps, {} switchings",
        simulator.steps(),
        simulator.switchings()
    );
    // 20 is the aim on an idle core; a quarter of it leaves room for a busy test machine.
    assert!(factor > 5.0, "{factor}");
}

/// A stiff coupling needs row exchanges in the linear solve; a slip there shows as tiny steps, not as a wrong result.
#[test]
fn stiff_damped_contact_costs_few_steps() {
    let mut m = motor();
    let split = Split { inertia: 0.4, viscous: 0.5 };
    let reduced = m.inertia * 0.24;
    let (stiffness, damping) = (reduced * 3000.0_f64.powi(2), reduced * 3000.0);
    m.train = Train::Play { split, gap_rad: 0.05, stiffness, damping };
    let mut simulator = Simulator::new(m, 1e-7, 1);
    for k in 0..100 {
        let volts = if (k / 25) % 2 == 0 { 6.0 } else { -6.0 };
        simulator.run(Command::Volts(volts), Bridge::Driven, 4e-3);
    }
    assert!(simulator.steps() < 3000, "{}", simulator.steps());
    assert_eq!(simulator.overlooked(), 0);
}
