//! The plant against closed forms, and against itself with half the step.

use servo::axis::Bridge;
use truing::system::plant::Motor;
use truing::system::plant::physics::Physics;

/// A 12 V motor with a visible winding: τ_m ≈ 60 ms, τ_e ≈ 1.4 ms.
fn motor() -> Physics {
    let mut plant = Physics::linear_motor(1.5, 0.0021, 0.05, 0.05, 1.2e-4, 3e-5);
    plant.supply_v = 12.0;
    plant
}

/// Speeds over 0.6 s of steps, reversals and coasting, sampled every 2 ms, with `per` commands a sample.
fn speeds(plant: &Physics, per: usize) -> Vec<f64> {
    let mut motor = Motor::new(plant.clone(), 4096.0);
    let mut speeds = Vec::new();
    for k in 0..300 {
        let volts = [6.0, -9.0, 12.0, 2.0, -4.0, 0.0][k / 50];
        let bridge = if (120..130).contains(&k) { Bridge::Open } else { Bridge::Driven };
        for _ in 0..per {
            motor.step(volts, bridge, 2e-3 / per as f64);
        }
        speeds.push(motor.state().omega);
    }
    speeds
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|v| v * v).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn relative_change(plant: &Physics, per: usize) -> f64 {
    let (coarse, fine) = (speeds(plant, per), speeds(plant, 2 * per));
    rms(coarse.iter().zip(&fine).map(|(a, b)| a - b)) / rms(fine.iter().copied())
}

#[test]
fn halving_the_step_changes_less_than_a_hundredth_of_a_percent() {
    for inductance in [0.0, 1e-6, 2.1e-4, 2.1e-3, 2.1e-2] {
        let plant = Physics { inductance, ..motor() };
        let change = relative_change(&plant, 4);
        assert!(change < 1e-4, "L = {inductance} H: {change:.2e}");
        assert!(change > 0.0, "the comparison compares nothing");
    }
}

#[test]
fn the_step_response_is_the_closed_form_of_two_poles() {
    let p = motor();
    let (a, b) = (
        p.viscous / p.inertia + p.resistance / p.inductance,
        (p.viscous * p.resistance + p.kt * p.ke) / (p.inertia * p.inductance),
    );
    let root = (a * a / 4.0 - b).sqrt();
    let (s1, s2) = (-a / 2.0 + root, -a / 2.0 - root);
    let gain = p.dc_gain() * 6.0;
    let mut motor = Motor::new(p, 4096.0);
    for k in 1..=2000 {
        motor.step(6.0, Bridge::Driven, 1e-4);
        let t = f64::from(k) * 1e-4;
        let exact = gain * (1.0 + (s2 * (s1 * t).exp() - s1 * (s2 * t).exp()) / (s1 - s2));
        assert!(
            (motor.state().omega - exact).abs() < 2e-5 * gain,
            "t = {t}: {} and {exact}",
            motor.state().omega
        );
    }
}

#[test]
fn a_stiff_winding_needs_no_small_steps() {
    let slow = Physics { inductance: 1e-9, ..motor() };
    let none = Physics { inductance: 0.0, ..motor() };
    let difference = rms(speeds(&slow, 1).iter().zip(&speeds(&none, 1)).map(|(a, b)| a - b));
    assert!(difference < 1e-4, "{difference}");
}

#[test]
fn friction_holds_the_axis_and_brakes_a_coast_down_linearly() {
    let mut plant = motor();
    plant.friction_pos = 0.02;
    plant.friction_neg = 0.02;
    let holds = 0.02 * plant.resistance / plant.kt;
    let mut axis = Motor::new(plant.clone(), 4096.0);
    for _ in 0..1000 {
        axis.step(0.98 * holds, Bridge::Driven, 1e-3);
    }
    assert_eq!(axis.state().omega, 0.0, "below the level it sticks exactly");
    axis.step(1.05 * holds, Bridge::Driven, 1e-3);
    assert!(axis.state().omega > 0.0);

    plant.viscous = 0.0;
    let mut axis = Motor::new(plant.clone(), 4096.0);
    while axis.state().omega < 100.0 {
        axis.step(12.0, Bridge::Driven, 1e-3);
    }
    let before = axis.state().omega;
    for _ in 0..100 {
        axis.step(0.0, Bridge::Open, 1e-4);
    }
    let braked = before - axis.state().omega;
    assert!((braked - 0.02 / plant.inertia * 0.01).abs() < 1e-6 * before, "{braked}");
}

#[test]
fn dead_zone_limit_delay_and_lag_stand_in_the_order_of_the_chain() {
    let plant =
        Physics { dead_pos: 1.0, dead_neg: 0.5, limit: 5.0, drive_gain: 2.0, drive_offset: 0.1, ..motor() };
    assert_eq!(plant.applied(1.0), 1.1);
    assert_eq!(plant.applied(-0.25), 0.0);
    assert_eq!(plant.applied(-1.0), -1.4);
    assert_eq!(plant.applied(4.0), 5.0);
    let soft = Physics { limit: 5.0, limit_softness: 0.2, ..motor() };
    assert!((soft.applied(5.0) - 5.0 / 2f64.powf(0.2)).abs() < 1e-12 && soft.applied(500.0) <= 5.0);

    let delayed = Physics { delay_s: 2.5e-3, ..motor() };
    let (mut late, mut prompt) = (Motor::new(delayed, 4096.0), Motor::new(motor(), 4096.0));
    let mut behind = Vec::new();
    let mut ahead = Vec::new();
    for _ in 0..400 {
        behind.push(late.step(6.0, Bridge::Driven, 5e-4).omega_rad_s);
        ahead.push(prompt.step(6.0, Bridge::Driven, 5e-4).omega_rad_s);
    }
    for k in 5..400 {
        assert!((behind[k] - ahead[k - 5]).abs() < 1e-9, "five steps late");
    }
    let mut lagged = Motor::new(Physics { lag_s: 0.02, ..motor() }, 4096.0);
    let mut last = 0.0;
    for _ in 0..1500 {
        last = lagged.step(6.0, Bridge::Driven, 1e-3).omega_rad_s;
    }
    assert!((last - 6.0 * motor().dc_gain()).abs() < 0.1, "the lag changes no steady state");
}

#[test]
fn play_on_the_load_side_is_lost_motion() {
    let plant = Physics { gap_rad: 0.1, encoder_at_load: true, ..motor() };
    let mut axis = Motor::new(plant, 1e6);
    for _ in 0..200 {
        axis.step(3.0, Bridge::Driven, 1e-3);
    }
    assert!((axis.state().theta - axis.state().theta_load - 0.05).abs() < 1e-12);
    while axis.state().omega > -5.0 {
        axis.step(-3.0, Bridge::Driven, 1e-4);
    }
    assert!((axis.state().theta_load - axis.state().theta).abs() <= 0.05 + 1e-12);
}

#[test]
fn a_gap_with_a_heavy_load_keeps_momentum_and_a_spring_rings_at_its_resonance() {
    let gap = Physics { gap_rad: 0.2, load_share: 0.5, viscous: 0.0, ..motor() };
    let mut axis = Motor::new(gap, 1e6);
    axis.step(12.0, Bridge::Driven, 1e-3);
    for _ in 0..3000 {
        axis.step(0.0, Bridge::Open, 1e-4);
    }
    let (motor_speed, load_speed) = (axis.state().omega, axis.state().omega_load);
    assert!((motor_speed - load_speed).abs() < 1e-6 * motor_speed, "inelastic contact ends in one speed");

    let spring = Physics { stiffness: 5.0, load_share: 0.4, viscous: 0.0, ..motor() };
    let resonance = spring.resonance_rad_s();
    let mut axis = Motor::new(spring, 1e6);
    axis.step(12.0, Bridge::Driven, 1e-3);
    let mut crossings = Vec::new();
    let mut last = 0.0;
    for k in 0..20000 {
        axis.step(0.0, Bridge::Open, 1e-5);
        let twist = axis.state().theta - axis.state().theta_load;
        if last < 0.0 && twist >= 0.0 {
            crossings.push(f64::from(k) * 1e-5);
        }
        last = twist;
    }
    let period = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    assert!(
        (period * resonance / std::f64::consts::TAU - 1.0).abs() < 0.01,
        "{period} s at {resonance} rad/s"
    );
}

#[test]
fn current_limit_heat_brushes_and_supply_act_on_the_current() {
    let limited = Physics { current_limit: 2.0, ..motor() };
    let mut axis = Motor::new(limited, 4096.0);
    for _ in 0..100 {
        assert!(axis.step(12.0, Bridge::Driven, 1e-3).current_a.abs() <= 2.0 + 1e-9);
    }
    let blocked = Physics { drop_v: 1.0, ..motor() };
    let mut axis = Motor::new(blocked, 4096.0);
    assert_eq!(axis.step(0.9, Bridge::Driven, 0.1).omega_rad_s, 0.0, "below the drop no current flows");
    let sagging = Physics { source_ohm: 0.5, ..motor() };
    let mut axis = Motor::new(sagging, 4096.0);
    for _ in 0..2000 {
        axis.step_duty(0.8, Bridge::Driven, 1e-3);
    }
    let answer = axis.step_duty(0.8, Bridge::Driven, 1e-3);
    assert!(
        answer.supply_v < 11.99 && (answer.supply_v - (12.0 - 0.5 * 0.8 * answer.current_a)).abs() < 1e-6
    );
    let hot =
        Physics { heat_rise_per_w: 0.01, heat_time_s: 0.5, friction_pos: 1.0, friction_neg: 1.0, ..motor() };
    let mut axis = Motor::new(hot, 4096.0);
    for _ in 0..5000 {
        axis.step(6.0, Bridge::Driven, 1e-3);
    }
    // Stalled and settled: R·(1 + rise·P)·i = u with P = i²·R(hot).
    let state = axis.state();
    assert!((state.current * 1.5 * (1.0 + 0.01 * state.heat_w) - 6.0).abs() < 1e-3, "{state:?}");
}

#[test]
fn the_count_follows_the_shaft() {
    let mut axis = Motor::new(motor(), 2048.0).at(0.3);
    for _ in 0..1000 {
        let answer = axis.step(-6.0, Bridge::Driven, 1e-3);
        let exact = axis.state().theta / std::f64::consts::TAU * 2048.0;
        assert!((f64::from(answer.count) - exact).abs() <= 1.0 + 1e-6);
    }
    assert!(axis.state().theta < -10.0);
}
