//! Motor and load as two bodies, joined by a spring (flexible coupling) or by a gap (backlash) with inelastic or
//! compliant contact.
//! Viscous and dry friction act on the motor's side, external loads on the load's.

use super::features::Features;
use super::physics::Physics;
use super::simd::{Apart, Lanes, Mask};
use super::state::State;
use super::step::{Before, Loads, slowed};
use super::step_size::Coupling;

/// Speeds of motor and load.
type Speeds<F> = (F, F);

/// A step of two bodies under a torque on the motor.
pub(super) struct TwoBodies<'a, F> {
    pub plant: &'a Physics<F>,
    pub features: &'a Features,
    pub state: &'a State<F>,
    pub torque: F,
    pub damping: F,
    pub loads: &'a Loads<F>,
    pub h: f64,
}

impl<F: Lanes> Apart for TwoBodies<'_, F> {
    type Output = Speeds<F>;

    /// Speeds of motor and load after `h` seconds.
    #[inline(always)]
    fn run(self) -> Speeds<F> {
        let Self { plant: p, features, state, torque, damping, loads, h } = self;
        let motor = Body {
            inertia: p.inertia * (-p.load_share + 1.0),
            damping,
            torque: torque + loads.motor,
            omega: state.omega,
        };
        let load = Body {
            inertia: p.inertia * p.load_share,
            damping: torque.like(0.0),
            torque: loads.load,
            omega: state.omega_load,
        };
        let play = p.gap_rad * 0.5;
        let twist = state.theta - state.theta_load;
        let pair = Pair { motor, load, twist, loads, h };
        match features.step_size.coupling {
            Coupling::Spring => pair.sprung(p, twist - twist.within(play)),
            Coupling::Contact => pair.touched(p, play),
            _ => pair.gapped(play),
        }
    }
}

/// One body over a step: (J/h + D/2)·ω1 = (J/h − D/2)·ω0 + T.
struct Body<F> {
    inertia: F,
    damping: F,
    torque: F,
    omega: F,
}

impl<F: Lanes> Body<F> {
    #[inline(always)]
    fn stiffness(&self, h: f64) -> F {
        self.inertia * (1.0 / h) + self.damping * 0.5
    }

    #[inline(always)]
    fn momentum(&self, h: f64) -> F {
        (self.inertia * (1.0 / h) - self.damping * 0.5) * self.omega + self.torque
    }
}

/// Motor and load over a step.
struct Pair<'a, F> {
    motor: Body<F>,
    load: Body<F>,
    twist: F,
    loads: &'a Loads<F>,
    h: f64,
}

impl<F: Lanes> Pair<'_, F> {
    /// Spring and damper, trapezoidal: T = k·(mean twist) + d·(mean rate).
    #[inline(always)]
    fn sprung(&self, p: &Physics<F>, twist: F) -> Speeds<F> {
        let Self { motor, load, h, .. } = self;
        let rate = motor.omega - load.omega;
        let coupling = p.stiffness * (0.25 * h) + p.coupling_damping * 0.5;
        self.joined(p.stiffness * twist + coupling * rate, coupling)
    }

    /// Both bodies under the torque `held` + `coupling`·(ω_motor − ω_load) between them.
    #[inline(always)]
    fn joined(&self, held: F, coupling: F) -> Speeds<F> {
        let &Self { ref motor, ref load, loads, h, .. } = self;
        let (a, b) = (motor.stiffness(h) + coupling, load.stiffness(h) + coupling);
        let (r1, r2) = (motor.momentum(h) - held, load.momentum(h) + held);
        // One division for both bodies.
        let determinant = a * b - coupling * coupling;
        let over_both = a.like(1.0) / (determinant * b);
        let over = over_both * b;
        let free = (b * r1 + coupling * r2) * over;
        let omega = slowed(free, b * over, loads);
        (omega, (r2 + coupling * omega) * (over_both * determinant))
    }

    /// Teeth that touch with the torque k·x + c·ẋ at penetration x, from the moment they meet to the moment that torque would
    /// pull (Nordin, Galić, Gutman: Int. J. Adaptive Control and Signal Processing 11, 1997). k and c are those of the
    /// reduced inertia at the contact's rate and damping ratio.
    #[inline(always)]
    fn touched(&self, p: &Physics<F>, play: F) -> Speeds<F> {
        let &Self { ref motor, ref load, twist, loads, h } = self;
        let one = twist.like(1.0);
        let (m, l) = (one / motor.stiffness(h), one / load.stiffness(h));
        let flight = (slowed(m * motor.momentum(h), m, loads), l * load.momentum(h));
        let rate = motor.omega - load.omega;
        let way = (rate + flight.0 - flight.1) * (0.5 * h);
        let side = one.copysign(F::select(twist.abs().gt(play), twist, twist + way));
        let depth = side * twist - play;
        let none = twist.like(0.0);
        let tiny = twist.like(1e-300);
        // The part of the step in which the teeth touch.
        let part = F::select(depth.ge(none), one, one + depth / (side * way).max(tiny));
        let flies = part.le(none);
        if flies.all() {
            return flight;
        }
        let reduced = motor.inertia * load.inertia / (motor.inertia + load.inertia);
        let stiffness = reduced * p.contact_rad_s * p.contact_rad_s * part * part;
        let damping = p.contact_damping * reduced * p.contact_rad_s * part * 2.0;
        let coupling = stiffness * (0.25 * h) + damping * 0.5;
        let held = side * stiffness * depth.max(none) + coupling * rate;
        let (omega, omega_load) = self.joined(held, coupling);
        let torque = held + coupling * (omega - omega_load);
        let apart = flies | (side * torque).lt(none);
        (F::select(apart, flight.0, omega), F::select(apart, flight.1, omega_load))
    }

    /// Free flight inside the gap; at its end the bodies go on together.
    #[inline(always)]
    fn gapped(&self, play: F) -> Speeds<F> {
        let &Self { ref motor, ref load, twist, loads, h } = self;
        let one = twist.like(1.0);
        let (m, l) = (one / motor.stiffness(h), one / load.stiffness(h));
        let omega = slowed(m * motor.momentum(h), m, loads);
        let omega_load = l * load.momentum(h);
        let reached = twist + (omega - omega_load) * h;
        let flies = reached.abs().le(play);
        if flies.all() {
            return (omega, omega_load);
        }
        // In contact the two are one body; what is left of the gap is closed in this step.
        let rate = (play.copysign(reached) - twist) * (1.0 / h);
        let mobility = one / (motor.stiffness(h) + load.stiffness(h));
        let together = mobility * (motor.momentum(h) + load.momentum(h) + rate * load.stiffness(h));
        let joined = slowed(together, mobility, loads);
        (F::select(flies, omega, joined), F::select(flies, omega_load, joined - rate))
    }
}

/// Position of the load after the step.
#[inline(always)]
pub(super) fn settle<F: Lanes>(
    p: &Physics<F>,
    features: &Features,
    state: &mut State<F>,
    before: &Before<F>,
    omega_load: F,
    h: f64,
) {
    state.omega_load = omega_load;
    state.theta_load = before.theta_load + (before.omega_load + omega_load) * (0.5 * h);
    if features.step_size.coupling == Coupling::Gap {
        let half = p.gap_rad * 0.5;
        state.theta_load = state.theta_load.max(state.theta - half).min(state.theta + half);
    }
}
