//! External torques within a step.

use super::laws::{Acts, Law, Motion, TorqueLaw};
use super::physics::Physics;
use super::simd::{Apart, Lanes};
use super::state::State;
use super::step::{Loads, Places};

/// The torques that do not depend on the speed, on a step's way.
pub(super) struct Torques<'a, F> {
    pub plant: &'a Physics<F>,
    pub state: &'a State<F>,
    pub h: f64,
    pub places: Places<F>,
    /// What acts besides.
    pub loads: Loads<F>,
}

impl<F: Lanes> Apart for Torques<'_, F> {
    type Output = Loads<F>;

    #[inline(always)]
    fn run(self) -> Loads<F> {
        let Self { plant, state, h, places, mut loads } = self;
        let motion = |theta: F, omega: F| {
            let (theta, theta_next) = places.unwrap_or((theta, theta + omega * h));
            Motion { time_s: state.time_s + 0.5 * h, theta, theta_next, omega, gear_ratio: plant.gear_ratio }
        };
        let motor = motion(state.theta, state.omega);
        // What hangs on a load that moves by itself turns with it.
        let apart = plant.load_share.gt(state.theta.like(0.0));
        let own = |load: F, motor: F| F::select(apart, load, motor);
        let load = motion(own(state.theta_load, state.theta), own(state.omega_load, state.omega));
        for law in &plant.torques {
            if law.law == Law::Drag {
                continue;
            }
            let torque = law.torque(if law.acts == Acts::Load { &load } else { &motor });
            match law.acts {
                Acts::Motor => loads.motor = loads.motor + torque,
                Acts::Load => loads.load = loads.load + torque,
                Acts::Friction => {
                    loads.friction_pos = loads.friction_pos + torque;
                    loads.friction_neg = loads.friction_neg + torque;
                }
            }
        }
        loads
    }
}

/// Drag at a speed: the one torque that changes within a step.
#[inline(always)]
pub(super) fn drag<F: Lanes>(torques: &[TorqueLaw<F>], omega: F) -> F {
    let mut sum = omega.like(0.0);
    for law in torques {
        if law.law == Law::Drag {
            sum = sum - law.parameters[0] * omega * omega.abs();
        }
    }
    sum
}
