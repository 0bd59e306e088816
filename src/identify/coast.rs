//! Friction or input dead zone? The test with shorted terminals.
//!
//! While 0 V lie at the terminals and the motor still turns, friction goes on braking: a + α·w + δ·j = −γ. A dead zone
//! at the input ignores 0 V as it ignores any small voltage: a + α·w + δ·j = 0. The mean over the windows of a
//! coast, relative to γ, is −1 or 0; what lies between is neither, or too noisy to tell. A load that depends on the place and is
//! known acts like a voltage β·u, and is taken off.
//!
//! Coasts of fast motors are short, so their windows are: blocks shorter by 2ᵏ with W₀ = 2^(counts−k) keep the speed's
//! unit, divide the acceleration by 2ᵏ and the jerk by 4ᵏ.

use super::estimate::Mechanism;
use super::solve::{COEFFICIENT_FRAC, Coefficients, INVERSE_FRAC, Solution};
use super::spline::{ROW_FRAC, Window};
use crate::units::saturate;

/// Between these residuals, in 1/1024 of γ, it is neither.
const UNCLEAR_1024: [i64; 2] = [-717, -307];
/// Windows that the test needs.
const LEAST_WINDOWS: u32 = 3;

/// Sums over the windows of one direction's coasts, mirrored to the direction of motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    speed: i64,
    acceleration: i64,
    jerk: i64,
    voltage: i64,
    windows: u32,
}

impl Sums {
    /// Notes a window with blocks shorter by 2^`shift` than those of the solution. `sign`: of the motion.
    pub fn note(&mut self, window: &Window, sign: i32, shift: u32) {
        let sign = i64::from(sign);
        self.speed = self.speed.wrapping_add(sign * i64::from(window.speed));
        self.acceleration = self.acceleration.wrapping_add((sign * i64::from(window.acceleration)) << shift);
        self.jerk = self.jerk.wrapping_add((sign * i64::from(window.jerk)) << (2 * shift));
        self.voltage = self.voltage.wrapping_add(sign * i64::from(window.voltage));
        self.windows = self.windows.saturating_add(1);
    }

    /// Σ (a + α·w + δ·j), Q20.
    fn residual(&self, c: &Coefficients) -> i64 {
        let damping = product(c.alpha, self.speed);
        self.acceleration.wrapping_add(damping).wrapping_add(product(c.delta, self.jerk))
    }
}

fn product(coefficient: i32, sum: i64) -> i64 {
    i64::from(coefficient).wrapping_mul(sum >> 6) >> (COEFFICIENT_FRAC - 6)
}

impl Sums {
    /// Mean of (a + α·w + δ·j)/β, Q20 of nominal supply; 0 without windows.
    pub fn mean_voltage(&self, c: &Coefficients, inverse_beta: i32) -> i32 {
        // The residual is below 2³⁴ per window and the hardware divides 32 bits: the sum is halved until it fits.
        let total = self.residual(c);
        let shift = 33u32.saturating_sub(total.unsigned_abs().leading_zeros());
        let windows = (self.windows as i32).max(1);
        let mean = i64::from((total >> shift) as i32 / windows) << shift;
        let left = saturate(total.wrapping_sub(mean.wrapping_mul(i64::from(windows))));
        let rest = i64::from(left / windows);
        saturate(mean.wrapping_add(rest).wrapping_mul(i64::from(inverse_beta)) >> INVERSE_FRAC)
    }
}

/// The residual of some coasts, and what friction would make of it.
#[derive(Clone, Copy, Debug, Default)]
struct Evidence {
    residual: i64,
    friction: i64,
    windows: u32,
}

impl Evidence {
    fn of(sums: &Sums, c: &Coefficients) -> Self {
        let gamma = i64::from(c.gamma) >> (COEFFICIENT_FRAC - ROW_FRAC);
        Evidence {
            residual: sums.residual(c).wrapping_sub(product(c.beta, sums.voltage)),
            friction: gamma * i64::from(sums.windows),
            windows: sums.windows,
        }
    }

    fn with(self, other: Self) -> Self {
        Evidence {
            residual: self.residual.wrapping_add(other.residual),
            friction: self.friction.wrapping_add(other.friction),
            windows: self.windows.saturating_add(other.windows),
        }
    }

    fn verdict(&self) -> Mechanism {
        match self.residual.wrapping_mul(1024) {
            _ if self.friction <= 0 => Mechanism::Unclear,
            scaled if scaled < UNCLEAR_1024[0].wrapping_mul(self.friction) => Mechanism::Friction,
            scaled if scaled > UNCLEAR_1024[1].wrapping_mul(self.friction) => Mechanism::InputDeadZone,
            _ => Mechanism::Unclear,
        }
    }
}

/// The verdict over the coasts of both directions. Each is a test of its own: where they contradict each other, the
/// windows were too few or a load acted.
pub fn mechanism(coasts: &[Sums; 2], solution: &Solution) -> Mechanism {
    let [positive, negative] = [0, 1].map(|d| Evidence::of(&coasts[d], &solution.coefficients[d]));
    let whole = positive.with(negative);
    let verdict = whole.verdict();
    let agrees = |own: &Evidence| own.windows == 0 || own.verdict() == verdict;
    if whole.windows >= LEAST_WINDOWS && agrees(&positive) && agrees(&negative) {
        verdict
    } else {
        Mechanism::Unclear
    }
}
