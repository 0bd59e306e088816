//! The motor: parameters in SI units. Its equations are in module `equations`.

use super::drive::Drive;
use super::friction::Friction;
use super::sensors::Tacho;

/// Between rotor and load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Train {
    /// One body.
    Rigid,
    /// Two bodies and an elastic shaft.
    Flexible {
        /// How inertia and viscous friction are shared out.
        split: Split,
        /// Stiffness, N m/rad.
        stiffness: f64,
        /// Damping, N m s/rad.
        damping: f64,
    },
    /// Two bodies and play. The teeth touch with the torque k·x + c·ẋ at penetration x, from the moment they meet to the
    /// moment that torque would pull (Kelvin–Voigt contact; M. Nordin, J. Galić and P.-O. Gutman, Int. J. Adaptive Control
    /// and Signal Processing 11, 1997). The speed that a meeting leaves does not depend on how fast it is, so bouncing dies
    /// out in finite time.
    Play {
        /// How inertia and viscous friction are shared out.
        split: Split,
        /// Total free play, rad; > 0.
        gap_rad: f64,
        /// Stiffness k of the contact, N m/rad.
        stiffness: f64,
        /// Damping c of the contact, N m s/rad.
        damping: f64,
    },
}

/// Shares of the load in a train of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// Share of the total inertia on the load's side, between 0 and 1.
    pub inertia: f64,
    /// Share of the viscous friction on the load's side, 0 … 1.
    pub viscous: f64,
}

impl Train {
    /// Torque of touching teeth at this penetration and its rate.
    pub(super) fn contact_torque(&self, depth: f64, rate: f64) -> f64 {
        match *self {
            Self::Play { stiffness, damping, .. } => stiffness * depth + damping * rate,
            Self::Rigid | Self::Flexible { .. } => 0.0,
        }
    }

    /// The shares, if there are two bodies.
    pub fn split(&self) -> Option<Split> {
        match *self {
            Self::Rigid => None,
            Self::Flexible { split, .. } | Self::Play { split, .. } => Some(split),
        }
    }
}

/// Copper that heats up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// Relative rise of R per watt.
    pub rise_per_w: f64,
    /// Thermal time constant, s.
    pub time_constant_s: f64,
}

/// Torques from outside. All 0: none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Load {
    /// Constant, drives +ω, N m.
    pub constant_nm: f64,
    /// Changes of the constant load: at time (s) it becomes this (N m). Increasing times.
    pub steps: Vec<(f64, f64)>,
    /// Gravity `mgl` at the load, N m.
    pub mgl_nm: f64,
    /// Phase of gravity, rad.
    pub gravity_phase: f64,
    /// Cogging amplitude, N m.
    pub cogging_nm: f64,
    /// Cogging periods per turn of the rotor.
    pub cogging_periods: f64,
    /// Phase of cogging, rad.
    pub cogging_phase: f64,
    /// Time-periodic load, N m.
    pub periodic_nm: f64,
    /// Its frequency, Hz.
    pub periodic_hz: f64,
    /// Its phase, rad.
    pub periodic_phase: f64,
    /// Rms of a random torque (Ornstein–Uhlenbeck, held piecewise constant), N m.
    pub noise_nm: f64,
    /// Its correlation time, s.
    pub noise_s: f64,
    /// A torque whose equation a hidden case brings along.
    pub law: Option<Law>,
    /// Something that no list of ordinary effects holds.
    pub oddity: Option<Oddity>,
}

/// A torque that depends on the angle, with the equation of the hidden case that puts it into the motor. It has to be smooth.
#[derive(Clone, Debug)]
pub struct Law {
    /// Torque from the parameters and the angle of the body that carries the load, N m.
    pub torque: fn(&[f64], f64) -> f64,
    /// Its parameters.
    pub parameters: Vec<f64>,
}

impl PartialEq for Law {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::fn_addr_eq(self.torque, other.torque) && self.parameters == other.parameters
    }
}

/// Torques and changes that an ordinary motor model has no name for. Each is smooth inside a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Oddity {
    /// Viscous friction that changes as b · (1 + rate · t): a lubricant that warms up.
    ViscosityDrift {
        /// Relative change per second.
        rate_per_s: f64,
    },
    /// Torque ripple that scales with the current: Kt · (1 + a sin(nθ)) (commutation).
    CommutationRipple {
        /// Relative amplitude.
        amplitude: f64,
        /// Periods per turn.
        periods: f64,
    },
    /// A periodic torque whose frequency sweeps: A sin(2π (f t + s t²/2)).
    SweepingLoad {
        /// Amplitude, N m.
        amplitude_nm: f64,
        /// Frequency at t = 0, Hz.
        start_hz: f64,
        /// Sweep, Hz/s.
        sweep_hz_per_s: f64,
    },
    /// Inertia that depends on the angle: J · (1 + a cos(θ/N)), with its gyroscopic term.
    CrankInertia {
        /// Relative amplitude.
        amplitude: f64,
        /// Turns of the rotor per turn of the crank.
        ratio: f64,
    },
    /// Magnetic brake: torque c ω / (1 + (ω/ω₀)²), weaker again at high speed.
    EddyBrake {
        /// Slope at rest, N m s/rad.
        slope: f64,
        /// Speed of the greatest torque, rad/s.
        peak_rad_s: f64,
    },
    /// Two cogging orders that beat.
    BeatingCogging {
        /// Amplitude of either, N m.
        amplitude_nm: f64,
        /// Their periods per turn.
        periods: [f64; 2],
    },
    /// A soft end stop beyond ±θ₀ of the load's turn: k · excess.
    EndStop {
        /// Stiffness, N m/rad.
        stiffness: f64,
        /// Where it begins, rad.
        theta0_rad: f64,
    },
}

/// A motor with all that may be imperfect about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Winding resistance when cold, Ω.
    pub resistance_ohm: f64,
    /// Winding inductance, H; > 0 (1e-6 of τm is as good as none).
    pub inductance_h: f64,
    /// Torque constant, N m/A.
    pub torque_constant: f64,
    /// Back-EMF constant, V s/rad.
    pub emf_constant: f64,
    /// Current about which the torque constant falls; infinite: never.
    pub torque_knee_a: f64,
    /// Exponent p of that fall.
    pub torque_knee_order: f64,
    /// Total inertia, kg m².
    pub inertia: f64,
    /// Viscous friction for ω > 0 and ω < 0, N m s/rad.
    pub viscous: [f64; 2],
    /// Quadratic drag, N m s²/rad².
    pub drag: f64,
    /// Turns of the rotor's shaft per turn of the load.
    pub gear_ratio: f64,
    /// Input chain.
    pub drive: Drive,
    /// Dry friction at the rotor.
    pub friction: Friction,
    /// Dry friction at the load of a train of two bodies.
    pub load_friction: Friction,
    /// Torques from outside.
    pub load: Load,
    /// Rotor to load.
    pub train: Train,
    /// Heating.
    pub thermal: Option<Thermal>,
    /// What a speed sensor does before its window; `None`: the true speed is seen.
    pub tacho: Option<Tacho>,
}

impl Motor {
    /// The linear motor, with an ideal drive.
    pub fn linear(r: f64, l: f64, k: f64, inertia: f64, viscous: f64, supply_v: f64) -> Self {
        Self {
            resistance_ohm: r,
            inductance_h: l,
            torque_constant: k,
            emf_constant: k,
            torque_knee_a: f64::INFINITY,
            torque_knee_order: 1.0,
            inertia,
            viscous: [viscous; 2],
            drag: 0.0,
            gear_ratio: 1.0,
            drive: Drive::ideal(supply_v),
            friction: Friction::default(),
            load_friction: Friction::default(),
            load: Load::default(),
            train: Train::Rigid,
            thermal: None,
            tacho: None,
        }
    }

    /// Slope of the steady speed over voltage, rad/s per V.
    pub fn gain(&self) -> f64 {
        let viscous = 0.5 * (self.viscous[0] + self.viscous[1]);
        self.torque_constant / (self.torque_constant * self.emf_constant + self.resistance_ohm * viscous)
    }

    /// Sum of the two real time constants of the linear part, s.
    pub fn time_constant(&self) -> f64 {
        let viscous = 0.5 * (self.viscous[0] + self.viscous[1]);
        let denominator = self.torque_constant * self.emf_constant + self.resistance_ohm * viscous;
        (self.inertia * self.resistance_ohm + self.inductance_h * viscous) / denominator
    }

    /// Volts at the winding that hold this torque at rest.
    pub fn volts_for(&self, torque_nm: f64) -> f64 {
        torque_nm * self.resistance_ohm / self.torque_constant
    }

    /// Inertias of rotor and load.
    pub fn inertias(&self) -> [f64; 2] {
        let share = self.train.split().map_or(0.0, |split| split.inertia);
        [self.inertia * (1.0 - share), self.inertia * share]
    }

    /// True if rotor and load are two bodies.
    pub fn has_two_bodies(&self) -> bool {
        self.train != Train::Rigid
    }

    /// True if the equations of body `index` change with the direction of motion.
    pub fn depends_on_direction(&self, index: usize) -> bool {
        let friction = [&self.friction, &self.load_friction][index];
        friction.acts() || self.viscous[0] != self.viscous[1] || (index == 0 && self.drag != 0.0)
    }
}
