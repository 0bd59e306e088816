//! Dry friction of one bearing.
//!
//! ```text
//! level(ω, θ) = [Fc± + Fc± (r − 1) exp(−(ω/ωs)²)] · (1 + a sin(nθ + φ)) + c_m |T_motor| + c_l |T_load|
//! rigid   : torque = −sign(ω) · level; while ω = 0 whatever holds the shaft, up to level(0, θ)
//! bristles: ż = ω − σ₀ |ω| z / level,  torque = −(σ₀ z + σ₁ ż)
//! ```
//!
//! Stribeck form: B. Armstrong-Hélouvry, P. Dupont and C. Canudas de Wit, Automatica 30(7), 1994. Bristles: C. Canudas de
//! Wit, H. Olsson, K. J. Åström and P. Lischinsky, IEEE Trans. Automatic Control 40(3), 1995 (LuGre).

/// Elastic asperities: LuGre friction in place of rigid sticking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristle {
    /// Deflection at which the kinetic level is reached, rad.
    pub deflection_rad: f64,
    /// Damping of the asperities, N m s/rad.
    pub damping: f64,
}

/// Parameters; every level 0: no friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Kinetic level for ω > 0 and for ω < 0, N m.
    pub kinetic_nm: [f64; 2],
    /// Level at rest over kinetic level, ≥ 1.
    pub breakaway_ratio: f64,
    /// Stribeck speed, rad/s.
    pub stribeck_rad_s: f64,
    /// Relative amplitude of the ripple over the angle.
    pub ripple: f64,
    /// Periods of the ripple per turn.
    pub ripple_periods: f64,
    /// Phase of the ripple, rad.
    pub ripple_phase: f64,
    /// Growth with the motor's torque.
    pub per_motor_torque: f64,
    /// Growth with the load's torque.
    pub per_load_torque: f64,
    /// LuGre in place of rigid sticking.
    pub bristle: Option<Bristle>,
}

impl Default for Friction {
    fn default() -> Self {
        Self::coulomb(0.0)
    }
}

impl Friction {
    /// The same level in both directions, moving or not.
    pub fn coulomb(level_nm: f64) -> Self {
        Self {
            kinetic_nm: [level_nm; 2],
            breakaway_ratio: 1.0,
            stribeck_rad_s: 1.0,
            ripple: 0.0,
            ripple_periods: 1.0,
            ripple_phase: 0.0,
            per_motor_torque: 0.0,
            per_load_torque: 0.0,
            bristle: None,
        }
    }

    /// True if there is any.
    pub fn acts(&self) -> bool {
        self.kinetic_nm != [0.0; 2] || self.per_motor_torque != 0.0 || self.per_load_torque != 0.0
    }

    /// Level opposing motion in the direction `forward`, N m.
    pub fn level(&self, forward: bool, omega: f64, theta: f64, motor_nm: f64, load_nm: f64) -> f64 {
        let kinetic = self.kinetic_nm[usize::from(!forward)];
        let mut level = kinetic;
        if self.breakaway_ratio != 1.0 {
            level += kinetic * (self.breakaway_ratio - 1.0) * (-(omega / self.stribeck_rad_s).powi(2)).exp();
        }
        if self.ripple != 0.0 {
            level *= 1.0 + self.ripple * (self.ripple_periods * theta + self.ripple_phase).sin();
        }
        level + self.per_motor_torque * motor_nm.abs() + self.per_load_torque * load_nm.abs()
    }

    /// True if the level changes with the angle.
    pub fn depends_on_angle(&self) -> bool {
        self.ripple != 0.0
    }
}
