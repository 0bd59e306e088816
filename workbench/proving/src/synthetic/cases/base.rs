//! Random linear motors: the base of a case, and what its model file claims.

use crate::synthetic::reference_plant::Motor;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use truing_core::system::effects::{self, Effect};

/// Natural scales of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Natural {
    /// Full voltage, V.
    pub volts: f64,
    /// Steady speed at full voltage, rad/s.
    pub speed: f64,
    /// Torque at standstill and full voltage, N m.
    pub torque: f64,
    /// Current at standstill and full voltage, A.
    pub current: f64,
    /// Mechanical time constant J R/(K² + b R), s.
    pub tau: f64,
    /// Resistance, Ω.
    pub resistance: f64,
    /// Inertia, kg m².
    pub inertia: f64,
    /// Turns of the rotor per turn of the load.
    pub gear_ratio: f64,
    /// Relative tolerance (1 σ) that the model file declares.
    pub tolerance: f64,
}

/// A random linear motor with its scales.
pub fn draw(rng: &mut ChaCha8Rng) -> (Motor, Natural) {
    let volts = [6.0, 12.0, 24.0][rng.random_range(0..3)];
    let resistance = log_range(rng, 0.6, 8.0);
    let constant = log_range(rng, 0.015, 0.12);
    let tau = log_range(rng, 0.06, 0.5);
    let viscous = log_range(rng, 0.02, 0.4) * constant * constant / resistance;
    let inertia = tau * (constant * constant + viscous * resistance) / resistance;
    let inductance = log_range(rng, 0.005, 0.08) * tau * resistance;
    let mut motor = Motor::linear(resistance, inductance, constant, inertia, viscous, volts);
    // No drive gives more than its supply, and the model file says so; a hair above, so that full voltage is no knee.
    motor.drive.limit_v = [volts * (1.0 + 1e-9); 2];
    motor.gear_ratio = [1.0, 5.0, 20.0][rng.random_range(0..3)];
    let natural = Natural {
        volts,
        speed: volts * motor.gain(),
        torque: constant * volts / resistance,
        current: volts / resistance,
        tau,
        resistance,
        inertia,
        gear_ratio: motor.gear_ratio,
        tolerance: [0.01, 0.03, 0.05][rng.random_range(0..3)],
    };
    (motor, natural)
}

/// Base parameters as a model file claims them.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[allow(non_snake_case)] // The keys of the model file.
pub struct Claim {
    /// Resistance, Ω.
    pub R_ohm: f64,
    /// Inductance, H.
    pub L_h: f64,
    /// Motor constant, N m/A and V s/rad.
    pub K_nm_per_a: f64,
    /// Inertia, kg m².
    pub J_kgm2: f64,
    /// Viscous friction, N m s/rad.
    pub b_nms_per_rad: f64,
}

impl Claim {
    /// The motor's own values.
    pub fn true_values(motor: &Motor) -> Self {
        Self {
            R_ohm: motor.resistance_ohm,
            L_h: motor.inductance_h,
            K_nm_per_a: motor.torque_constant,
            J_kgm2: motor.inertia,
            b_nms_per_rad: motor.viscous[0],
        }
    }

    /// `[motor]` of a model file.
    pub fn table(&self) -> String {
        let Self { R_ohm, L_h, K_nm_per_a, J_kgm2, b_nms_per_rad } = self;
        format!(
            "[motor]\nR_ohm = {R_ohm}\nL_h = {L_h}\nKt_nm_per_a = {K_nm_per_a}\nKe_vs_per_rad = {K_nm_per_a}\n\
             J_kgm2 = {J_kgm2}\nb_nms_per_rad = {b_nms_per_rad}\n"
        )
    }

    /// Off by N(0, tolerance), cut at 2 tolerances; a parameter whose error is the hidden effect keeps its value.
    pub fn with_errors(mut self, rng: &mut ChaCha8Rng, tolerance: f64, hidden: &[&Effect]) -> Self {
        let mut off = |value: &mut f64, effect: Option<&Effect>| {
            let z = std::iter::repeat_with(|| StandardNormal.sample(rng)).find(|z: &f64| z.abs() <= 2.0);
            if effect.is_none_or(|effect| !hidden.contains(&effect)) {
                *value *= 1.0 + tolerance * z.unwrap_or(0.0);
            }
        };
        off(&mut self.R_ohm, Some(&effects::RESISTANCE));
        off(&mut self.L_h, None);
        off(&mut self.K_nm_per_a, Some(&effects::MOTOR_GAIN));
        off(&mut self.J_kgm2, Some(&effects::INERTIA));
        off(&mut self.b_nms_per_rad, Some(&effects::VISCOUS_FRICTION));
        self
    }
}

/// Log-uniform.
pub fn log_range(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    rng.random_range(low.ln()..high.ln()).exp()
}
