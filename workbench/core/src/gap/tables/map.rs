//! The steady-state map of the plant: the speed at which it settles when a voltage is held.
//!
//! ```text
//! u → gain → offset → dead zone → limit → drop → i = (v − Ke ω)/R → Kt i = b ω + friction(ω) − external torques → sensor
//! ```
//!
//! It is the equilibrium of the equations in [`crate::system::plant`], so nothing that only delays (inertia, inductance, lags)
//! appears. Friction with a breakaway level makes the map depend on the past: a row that starts from standstill, or from
//! the other direction, needs the breakaway torque; a row that follows motion in the same direction needs the kinetic
//! one. Rows are therefore taken in the order in which they were measured.

use crate::system::model::Model;
use crate::system::plant::laws::Motion;
use crate::system::plant::physics::Physics;

/// Newton steps at most; two suffice without breakaway and drag. Chosen by judgement, as a bound.
const ITERATIONS: usize = 80;
/// Change of the speed, relative, at which the equilibrium is found. Chosen by judgement; not studied.
const SETTLED: f64 = 1e-8;

/// The plant of a model as a steady state sees it.
pub fn visible(model: &Model) -> Physics {
    let mut plant = model.base();
    for known in model.known.iter().filter(|known| known.effect.counts_in_tables()) {
        (known.effect.apply)(&known.values, &mut plant);
    }
    plant
}

/// What the sensor shows for each voltage, rad/s, the voltages being held one after the other from standstill.
pub fn sweep(plant: &Physics, volts: &[f64]) -> Vec<f64> {
    let mut turning = 0.0;
    let row = |&u: &f64| {
        let omega = settled(plant, u, turning);
        turning = if omega == 0.0 { 0.0 } else { omega.signum() };
        plant.reading_of(plant.scaled(omega))
    };
    volts.iter().map(row).collect()
}

/// The speed at which the motor settles, rad/s; `turning` is the sign of the motion before.
fn settled(plant: &Physics, command: f64, turning: f64) -> f64 {
    let v = plant.applied(command);
    let stall = driving(plant, v, 0.0);
    let direction = stall.signum();
    let extra = if turning == direction { 0.0 } else { plant.breakaway_extra };
    if stall.abs() <= kinetic(plant, direction, v, 0.0) + extra {
        return 0.0;
    }
    direction * running(plant, v, direction)
}

/// Motor torque and external torques, N m.
fn driving(plant: &Physics, v: f64, omega: f64) -> f64 {
    let i = current(plant, v, omega);
    let knee = i / plant.kt_knee_a;
    plant.kt / (1.0 + knee * knee) * i + external(plant, omega)
}

/// Winding current, A. The source resistance counts by the square of the duty: it carries duty·i and its drop is
/// multiplied by the duty again.
fn current(plant: &Physics, v: f64, omega: f64) -> f64 {
    let duty = v / plant.supply_v;
    let cold = plant.resistance + plant.source_ohm * duty * duty;
    let net = v - plant.ke * omega;
    let pushing = net.signum() * (net.abs() - plant.drop_v).max(0.0);
    (pushing / warm(plant, cold, pushing)).clamp(-plant.current_limit, plant.current_limit)
}

/// The winding's resistance when its heat has settled: R = R0·(1 + rise·i²R).
fn warm(plant: &Physics, cold: f64, volts: f64) -> f64 {
    let mut resistance = cold;
    if plant.heat_rise_per_w > 0.0 {
        for _ in 0..20 {
            resistance = cold * (1.0 + plant.heat_rise_per_w * volts * volts / resistance);
        }
    }
    resistance
}

fn external(plant: &Physics, omega: f64) -> f64 {
    let motion = Motion { time_s: 0.0, theta: 0.0, theta_next: 0.0, omega, gear_ratio: plant.gear_ratio };
    plant.torques.iter().map(|law| law.torque(&motion)).sum()
}

/// Friction that opposes motion in `direction` whatever its speed, N m.
fn kinetic(plant: &Physics, direction: f64, v: f64, omega: f64) -> f64 {
    let level = if direction > 0.0 { plant.friction_pos } else { plant.friction_neg };
    let geared = match plant.friction_per_motor > 0.0 {
        true => plant.friction_per_motor * (driving(plant, v, omega) - external(plant, omega)).abs(),
        false => 0.0,
    };
    level + geared
}

/// The largest speed (magnitude) at which all torques balance; 0 if there is none.
///
/// Newton's method from above. Without the Stribeck term the balance is concave and falls, so the steps approach the
/// root from above; the Stribeck term flattens it, so that they stay above.
fn running(plant: &Physics, v: f64, direction: f64) -> f64 {
    if is_linear(plant) {
        return beyond_breakaway(plant, v, direction);
    }
    let smooth = |x: f64| smooth_balance(plant, v, direction, x);
    let mut x = starting_speed(plant, v);
    for _ in 0..ITERATIONS {
        let width = 1e-6 * x.max(1e-6);
        let slope = ((smooth(x) - smooth(x - width)) / width).min(-1e-9 * plant.total_damping());
        let step = (smooth(x) - stribeck(plant, x)) / slope;
        x -= step;
        if x <= 0.0 {
            return 0.0;
        }
        if step.abs() <= SETTLED * x {
            break;
        }
    }
    x
}

/// True if the balance is a straight line in the speed, the Stribeck term apart.
fn is_linear(plant: &Physics) -> bool {
    plant.torques.is_empty()
        && plant.heat_rise_per_w == 0.0
        && plant.friction_per_motor == 0.0
        && plant.current_limit.is_infinite()
        && plant.kt_knee_a.is_infinite()
}

/// The root of that line less what the Stribeck term takes, by repetition from above; 0 if it takes everything.
fn beyond_breakaway(plant: &Physics, v: f64, direction: f64) -> f64 {
    let duty = v / plant.supply_v;
    let resistance = plant.resistance + plant.source_ohm * duty * duty;
    let (level, extra) = match direction > 0.0 {
        true => (plant.friction_pos, plant.viscous_pos),
        false => (plant.friction_neg, plant.viscous_neg),
    };
    let torque = plant.kt * (v.abs() - plant.drop_v) / resistance - level;
    let damping = plant.viscous + extra + plant.kt * plant.ke / resistance;
    let mut x = torque / damping;
    for _ in 0..ITERATIONS {
        let next = (torque - stribeck(plant, x)) / damping;
        let settled = (x - next).abs() <= SETTLED * x.abs();
        x = next;
        if settled || x <= 0.0 {
            break;
        }
    }
    x.max(0.0)
}

/// A speed above every equilibrium: no load, no friction; external torques can drive it beyond.
fn starting_speed(plant: &Physics, v: f64) -> f64 {
    let helped = external(plant, 0.0).abs() / plant.total_damping();
    (v.abs() - plant.drop_v).max(0.0) / plant.ke.abs().max(1e-12) + helped
}

/// Torque that accelerates in `direction` at speed x, without the Stribeck term, N m.
fn smooth_balance(plant: &Physics, v: f64, direction: f64, x: f64) -> f64 {
    let omega = direction * x;
    let viscous = plant.viscous + if direction > 0.0 { plant.viscous_pos } else { plant.viscous_neg };
    direction * driving(plant, v, omega) - kinetic(plant, direction, v, omega) - viscous * x
}

fn stribeck(plant: &Physics, x: f64) -> f64 {
    match plant.breakaway_extra > 0.0 {
        true => plant.breakaway_extra * (-(x / plant.stribeck_speed).powi(2)).exp(),
        false => 0.0,
    }
}
