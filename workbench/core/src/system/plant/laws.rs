//! External torques: one equation an effect.

use super::simd::Lanes;
use std::f64::consts::TAU;

/// Where an external torque is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Motion<F = f64> {
    /// Time since the start of the run, s.
    pub time_s: f64,
    /// Position at the start of the step, rad.
    pub theta: F,
    /// Position at the end of the step (expected), rad.
    pub theta_next: F,
    /// Speed, rad/s.
    pub omega: F,
    /// Turns of the encoder's shaft per turn of the load.
    pub gear_ratio: F,
}

/// The equation of an external torque; a, b and c are its parameters, θ is the position in the middle of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// +a.
    Constant,
    /// −a/N·sin(θ/N + b), N turns of the encoder's shaft per turn of the load.
    Gravity,
    /// −a·sin(b·θ + c), its mean over the step, which does not alias when a step spans much of a period.
    Cogging,
    /// +a·sin(b·θ + c).
    Wave,
    /// a·sin(2π·b·t + c).
    Periodic,
    /// −a·(θ − b) − c·(θ − b)³.
    Spring,
    /// −a·ω·|ω|.
    Drag,
}

impl Law {
    /// The torque, N m.
    #[inline(always)]
    pub fn torque<F: Lanes>(self, p: &[F; 3], motion: &Motion<F>) -> F {
        let middle = (motion.theta + motion.theta_next) * 0.5;
        match self {
            Self::Constant => p[0],
            Self::Gravity => -p[0] / motion.gear_ratio * (middle / motion.gear_ratio + p[1]).sin(),
            Self::Cogging => {
                let half = p[1] * (motion.theta_next - motion.theta) * 0.5;
                let series = -(half * half * (1.0 / 6.0)) + 1.0;
                let little = half.abs().lt(half.like(1e-3));
                let sinc = F::select(little, series, half.sin() / half);
                -p[0] * sinc * (p[1] * middle + p[2]).sin()
            }
            Self::Wave => p[0] * (p[1] * middle + p[2]).sin(),
            Self::Periodic => p[0] * (p[1] * (TAU * motion.time_s) + p[2]).sin(),
            Self::Spring => {
                let twist = middle - p[1];
                -twist * (p[0] + p[2] * twist * twist)
            }
            Self::Drag => -p[0] * motion.omega * motion.omega.abs(),
        }
    }
}

/// An external torque: N m from up to three parameters and the motion.
#[derive(Clone, Copy, Debug)]
pub struct TorqueLaw<F = f64> {
    /// The equation.
    pub law: Law,
    /// Its parameters.
    pub parameters: [F; 3],
    /// On what it acts.
    pub acts: Acts,
}

impl<F: Lanes> TorqueLaw<F> {
    /// The torque, N m.
    #[inline(always)]
    pub fn torque(&self, motion: &Motion<F>) -> F {
        self.law.torque(&self.parameters, motion)
    }

    /// Laws with other parameters side by side. `like`: any number, for its width.
    /// A law with its parameters, acting where it does.
    pub fn new(law: Law, parameters: [F; 3], acts: Acts) -> Self {
        Self { law, parameters, acts }
    }

    pub(super) fn side_by_side(sets: &[&TorqueLaw], like: F) -> Self {
        let parameter = |k: usize| like.of(|set| sets[set.min(sets.len() - 1)].parameters[k]);
        Self { law: sets[0].law, parameters: [parameter(0), parameter(1), parameter(2)], acts: sets[0].acts }
    }
}

/// On what an external torque acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acts {
    /// The motor's shaft.
    Motor,
    /// The load behind the gear: the gear's friction feels it.
    Load,
    /// The level of dry friction, of both directions: against the motion, whichever it is.
    Friction,
}
