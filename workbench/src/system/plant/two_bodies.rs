//! Motor and load as two bodies, joined by a spring (flexible coupling) or by a gap (backlash) with inelastic or
//! compliant contact.
//! Viscous and dry friction act on the motor's side, external loads on the load's.

use super::physics::Physics;
use super::state::State;
use super::step::{Before, Loads, slowed};

/// Speeds of motor and load after `h` seconds.
pub(super) fn moved(
    p: &Physics,
    state: &State,
    torque: f64,
    damping: f64,
    loads: &Loads,
    h: f64,
) -> (f64, f64) {
    let motor = Body {
        inertia: p.inertia * (1.0 - p.load_share),
        damping,
        torque: torque + loads.motor,
        omega: state.omega,
    };
    let load =
        Body { inertia: p.inertia * p.load_share, damping: 0.0, torque: loads.load, omega: state.omega_load };
    let play = 0.5 * p.gap_rad;
    let twist = state.theta - state.theta_load;
    if p.stiffness.is_finite() {
        let beyond = twist - twist.clamp(-play, play);
        return sprung(p, &motor, &load, beyond, loads, h);
    }
    if p.contact_rad_s.is_finite() {
        return touched(p, &motor, &load, twist, play, loads, h);
    }
    gapped(&motor, &load, twist, play, loads, h)
}

/// One body over a step: (J/h + D/2)·ω1 = (J/h − D/2)·ω0 + T.
struct Body {
    inertia: f64,
    damping: f64,
    torque: f64,
    omega: f64,
}

impl Body {
    fn stiffness(&self, h: f64) -> f64 {
        self.inertia / h + 0.5 * self.damping
    }

    fn momentum(&self, h: f64) -> f64 {
        (self.inertia / h - 0.5 * self.damping) * self.omega + self.torque
    }
}

/// Spring and damper, trapezoidal: T = k·(mean twist) + d·(mean rate).
fn sprung(p: &Physics, motor: &Body, load: &Body, twist: f64, loads: &Loads, h: f64) -> (f64, f64) {
    let rate = motor.omega - load.omega;
    let coupling = 0.25 * p.stiffness * h + 0.5 * p.coupling_damping;
    let held = p.stiffness * twist + coupling * rate;
    joined(motor, load, held, coupling, loads, h)
}

/// Both bodies under the torque `held` + `coupling`·(ω_motor − ω_load) between them.
fn joined(motor: &Body, load: &Body, held: f64, coupling: f64, loads: &Loads, h: f64) -> (f64, f64) {
    let (a, b) = (motor.stiffness(h) + coupling, load.stiffness(h) + coupling);
    let (r1, r2) = (motor.momentum(h) - held, load.momentum(h) + held);
    let determinant = a * b - coupling * coupling;
    let free = (b * r1 + coupling * r2) / determinant;
    let omega = slowed(free, b / determinant, loads);
    (omega, (r2 + coupling * omega) / b)
}

/// Teeth that touch with the torque k·x + c·ẋ at penetration x, from the moment they meet to the moment that torque would
/// pull (Nordin, Galić, Gutman: Int. J. Adaptive Control and Signal Processing 11, 1997). k and c are those of the
/// reduced inertia at the contact's rate and damping ratio.
fn touched(
    p: &Physics,
    motor: &Body,
    load: &Body,
    twist: f64,
    play: f64,
    loads: &Loads,
    h: f64,
) -> (f64, f64) {
    let (m, l) = (1.0 / motor.stiffness(h), 1.0 / load.stiffness(h));
    let flight = (slowed(m * motor.momentum(h), m, loads), l * load.momentum(h));
    let rate = motor.omega - load.omega;
    let way = 0.5 * h * (rate + flight.0 - flight.1);
    let side = 1.0f64.copysign(if twist.abs() > play { twist } else { twist + way });
    let depth = side * twist - play;
    // The part of the step in which the teeth touch.
    let part = if depth >= 0.0 { 1.0 } else { 1.0 + depth / (side * way).max(1e-300) };
    if part <= 0.0 {
        return flight;
    }
    let reduced = motor.inertia * load.inertia / (motor.inertia + load.inertia);
    let stiffness = reduced * p.contact_rad_s * p.contact_rad_s * part * part;
    let damping = 2.0 * p.contact_damping * reduced * p.contact_rad_s * part;
    let coupling = 0.25 * stiffness * h + 0.5 * damping;
    let held = side * stiffness * depth.max(0.0) + coupling * rate;
    let (omega, omega_load) = joined(motor, load, held, coupling, loads, h);
    let torque = held + coupling * (omega - omega_load);
    if side * torque < 0.0 { flight } else { (omega, omega_load) }
}

/// Free flight inside the gap; at its end the bodies go on together.
fn gapped(motor: &Body, load: &Body, twist: f64, play: f64, loads: &Loads, h: f64) -> (f64, f64) {
    let (m, l) = (1.0 / motor.stiffness(h), 1.0 / load.stiffness(h));
    let omega = slowed(m * motor.momentum(h), m, loads);
    let omega_load = l * load.momentum(h);
    let reached = twist + h * (omega - omega_load);
    if reached.abs() <= play {
        return (omega, omega_load);
    }
    // In contact the two are one body; what is left of the gap is closed in this step.
    let rate = (play.copysign(reached) - twist) / h;
    let mobility = 1.0 / (motor.stiffness(h) + load.stiffness(h));
    let together = mobility * (motor.momentum(h) + load.momentum(h) + rate * load.stiffness(h));
    let omega = slowed(together, mobility, loads);
    (omega, omega - rate)
}

/// Position of the load after the step.
pub(super) fn settle(p: &Physics, state: &mut State, before: &Before, omega_load: f64, h: f64) {
    state.omega_load = omega_load;
    state.theta_load = before.theta_load + 0.5 * h * (before.omega_load + omega_load);
    if !p.stiffness.is_finite() && !p.contact_rad_s.is_finite() {
        let half = 0.5 * p.gap_rad;
        state.theta_load = state.theta_load.clamp(state.theta - half, state.theta + half);
    }
}
