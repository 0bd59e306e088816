//! The motor: parameters in SI units and the equations of one smooth piece.
//!
//! ```text
//! L di/dt = v − R (1 + ρ h) i − Ke ω                 τh dh/dt = R (1 + ρ h) i² − h
//! J dω/dt = Kt(i) i − b± ω − c ω|ω| − friction − (mgl/N) sin(θ/N + φ) − A sin(nθ + ψ) + loads
//! Kt(i)   = Kt / (1 + (i/knee)²)^p
//! ```
//!
//! With a train of two bodies the load has its own speed and angle and a spring with damping between them; behind a play
//! the spring acts only where the teeth touch, and never pulls. Everything is referred to the rotor's shaft.

use super::drive::{Command, Drive};
use super::friction::Friction;
use super::modes::{Contact, Held, Modes, Motion, Winding};
use super::rosenbrock::{N, State};
use super::sensors::Tacho;
use super::state::*;
use servo::axis::Bridge;

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
    fn contact_torque(&self, depth: f64, rate: f64) -> f64 {
        match *self {
            Self::Play {
                stiffness, damping, ..
            } => stiffness * depth + damping * rate,
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
    /// Something that no list of ordinary effects holds.
    pub oddity: Option<Oddity>,
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
    /// Progressive return spring: −k θ³ / θ₀².
    CubicSpring {
        /// Stiffness at θ₀, N m/rad.
        stiffness: f64,
        /// Reference angle, rad.
        theta0_rad: f64,
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

    /// Whether rotor and load are two bodies.
    pub fn has_two_bodies(&self) -> bool {
        self.train != Train::Rigid
    }

    /// Whether the equations of body `index` change with the direction of motion.
    pub fn depends_on_direction(&self, index: usize) -> bool {
        let friction = [&self.friction, &self.load_friction][index];
        friction.acts() || self.viscous[0] != self.viscous[1] || (index == 0 && self.drag != 0.0)
    }

    /// Torque of the winding, N m.
    pub fn electric_torque(&self, held: &Held, y: &State) -> f64 {
        if let Command::Torque(torque) = held.command {
            return if held.bridge == Bridge::Driven {
                torque
            } else {
                0.0
            };
        }
        let mut constant = self.torque_constant;
        if self.torque_knee_a.is_finite() {
            constant /= (1.0 + (y[CURRENT] / self.torque_knee_a).powi(2)).powf(self.torque_knee_order);
        }
        if let Some(Oddity::CommutationRipple { amplitude, periods }) = self.load.oddity {
            constant *= 1.0 + amplitude * (periods * y[ANGLE]).sin();
        }
        constant * y[CURRENT]
    }

    /// Torques from outside on the body that carries the load, N m.
    pub fn outer_torque(&self, held: &Held, t: f64, omega: f64, theta: f64) -> f64 {
        let load = &self.load;
        let mut torque = held.load_nm + held.noise_nm;
        if load.mgl_nm != 0.0 {
            torque -= load.mgl_nm / self.gear_ratio * (theta / self.gear_ratio + load.gravity_phase).sin();
        }
        if load.periodic_nm != 0.0 {
            let angle = std::f64::consts::TAU * load.periodic_hz * t + load.periodic_phase;
            torque += load.periodic_nm * angle.sin();
        }
        torque
            + load
                .oddity
                .map_or(0.0, |oddity| self.odd_torque(oddity, t, omega, theta))
    }

    fn odd_torque(&self, oddity: Oddity, t: f64, omega: f64, theta: f64) -> f64 {
        match oddity {
            Oddity::ViscosityDrift { rate_per_s } => {
                -self.viscous[usize::from(omega < 0.0)] * rate_per_s * t * omega
            }
            Oddity::CommutationRipple { .. } | Oddity::CrankInertia { .. } => 0.0,
            Oddity::CubicSpring {
                stiffness,
                theta0_rad,
            } => -stiffness * theta * (theta / theta0_rad).powi(2),
            Oddity::SweepingLoad {
                amplitude_nm,
                start_hz,
                sweep_hz_per_s,
            } => amplitude_nm * (std::f64::consts::TAU * (start_hz + 0.5 * sweep_hz_per_s * t) * t).sin(),
            Oddity::EddyBrake { slope, peak_rad_s } => -slope * omega / (1.0 + (omega / peak_rad_s).powi(2)),
            Oddity::BeatingCogging {
                amplitude_nm,
                periods: [n, m],
            } => -amplitude_nm * ((n * theta).sin() + (m * theta).sin()),
            Oddity::EndStop {
                stiffness,
                theta0_rad,
            } => -stiffness * ((theta - theta0_rad).max(0.0) + (theta + theta0_rad).min(0.0)),
        }
    }

    /// Spring and damper between rotor and load, N m on the load.
    pub fn coupling_torque(&self, contact: Contact, y: &State) -> f64 {
        let twist = y[ANGLE] - y[LOAD_ANGLE];
        let rate = y[SPEED] - y[LOAD_SPEED];
        match self.train {
            Train::Rigid => 0.0,
            Train::Flexible {
                stiffness, damping, ..
            } => stiffness * twist + damping * rate,
            Train::Play { gap_rad, .. } => match contact {
                Contact::Ahead => self.train.contact_torque(twist - 0.5 * gap_rad, rate),
                Contact::Behind => -self.train.contact_torque(-twist - 0.5 * gap_rad, -rate),
                Contact::Free | Contact::Bonded => 0.0,
            },
        }
    }

    /// Torque on body `index` (0 rotor, 1 load) without its dry friction, and the two torques that load its bearing.
    pub fn driving_torque(&self, index: usize, held: &Held, modes: &Modes, t: f64, y: &State) -> Driving {
        let two = self.has_two_bodies();
        let (omega, theta) = if index == 0 {
            (y[SPEED], y[ANGLE])
        } else {
            (y[LOAD_SPEED], y[LOAD_ANGLE])
        };
        let viscous_share = match self.train.split() {
            None => 1.0,
            Some(split) if index == 0 => 1.0 - split.viscous,
            Some(split) => split.viscous,
        };
        let direction = usize::from(!modes.motion[index].is_forward(omega));
        let mut total = -viscous_share * self.viscous[direction] * omega;
        let coupling = if two {
            self.coupling_torque(modes.contact, y)
        } else {
            0.0
        };
        let outer = if two == (index == 1) {
            self.outer_torque(held, t, omega, theta)
        } else {
            0.0
        };
        total += outer;
        if index == 1 {
            return Driving {
                total: total + coupling,
                motor: coupling,
                load: outer,
            };
        }
        let motor = self.electric_torque(held, y);
        total += motor - coupling;
        if self.drag != 0.0 {
            total -= self.drag * omega * if direction == 0 { omega } else { -omega };
        }
        if self.load.cogging_nm != 0.0 {
            total -=
                self.load.cogging_nm * (self.load.cogging_periods * theta + self.load.cogging_phase).sin();
        }
        Driving {
            total,
            motor,
            load: outer - coupling,
        }
    }

    /// Rates of all states in one smooth piece.
    pub fn rates(&self, held: &Held, modes: &Modes, t: f64, y: &State) -> State {
        let mut rate = [0.0; N];
        self.electric_rates(held, modes, y, &mut rate);
        for index in 0..1 + usize::from(self.has_two_bodies()) {
            self.body_rates(index, held, modes, t, y, &mut rate);
        }
        if let Some(tacho) = &self.tacho {
            tacho.rates(self.seen_speed(tacho, y), y, &mut rate);
        }
        rate
    }

    fn seen_speed(&self, tacho: &Tacho, y: &State) -> f64 {
        if tacho.on_load && self.has_two_bodies() {
            y[LOAD_SPEED]
        } else {
            y[SPEED]
        }
    }

    fn electric_rates(&self, held: &Held, modes: &Modes, y: &State, rate: &mut State) {
        let drive = &self.drive;
        let current = y[CURRENT];
        let mut resistance = self.resistance_ohm;
        if let Some(thermal) = self.thermal {
            resistance *= 1.0 + thermal.rise_per_w * y[HEAT];
            rate[HEAT] = (resistance * current * current - y[HEAT]) / thermal.time_constant_s;
        }
        let driven = held.bridge == Bridge::Driven;
        let supply = drive.supply(held.live_command(), held.ripple_v, y);
        if drive.bus_farad > 0.0 {
            let drawn = if driven {
                drive.duty(held.command) * current
            } else {
                0.0
            };
            let source = drive.source_ohm.max(1e-6);
            rate[BUS] = ((drive.supply_v + held.ripple_v - y[BUS]) / source - drawn) / drive.bus_farad;
        }
        if drive.lag_s > 0.0 {
            rate[LAG] = (drive.requested(held.live_command(), supply) - y[LAG]) / drive.lag_s;
        }
        let emf = self.emf_constant * y[SPEED];
        let push = |volts: f64, sign: f64| {
            (volts - drive.drop_v * sign - resistance * current - emf) / self.inductance_h
        };
        rate[CURRENT] = match modes.winding {
            Winding::Off | Winding::Blocked | Winding::Limited(_) => 0.0,
            Winding::Free => push(self.offered(held, modes, y), 0.0),
            Winding::Signed(sign) => push(self.offered(held, modes, y), sign),
            Winding::Diode(sign) => push(-sign * supply, sign),
        };
    }

    /// Voltage that the drive offers the winding.
    pub fn offered(&self, held: &Held, modes: &Modes, y: &State) -> f64 {
        if held.bridge != Bridge::Driven {
            return 0.0;
        }
        let supply = self.drive.supply(held.command, held.ripple_v, y);
        if let Some(sign) = held.full_on {
            return sign * supply;
        }
        let x = self
            .drive
            .behind_dead_zone(self.before_dead_zone(held, y), modes.dead_zone);
        self.drive
            .supplied(held.command, self.drive.behind_limit(x, modes.limit), supply)
    }

    /// Voltage in front of the dead zone.
    pub fn before_dead_zone(&self, held: &Held, y: &State) -> f64 {
        let request = if self.drive.lag_s > 0.0 {
            y[LAG]
        } else {
            self.drive.requested(
                held.live_command(),
                self.drive.supply(held.live_command(), held.ripple_v, y),
            )
        };
        self.drive.scaled(request)
    }

    fn body_rates(&self, index: usize, held: &Held, modes: &Modes, t: f64, y: &State, rate: &mut State) {
        let (speed, angle) = if index == 0 {
            (SPEED, ANGLE)
        } else {
            (LOAD_SPEED, LOAD_ANGLE)
        };
        let motion = modes.motion[index];
        if motion == Motion::Stuck {
            return;
        }
        let friction = [&self.friction, &self.load_friction][index];
        let driving = self.driving_torque(index, held, modes, t, y);
        let mut torque = driving.total;
        if friction.acts() {
            let forward = motion.is_forward(y[speed]);
            let level = friction.level(forward, y[speed], y[angle], driving.motor, driving.load);
            let opposing = if forward { level } else { -level };
            torque -= match friction.bristle {
                None => opposing,
                Some(bristle) => {
                    let reference = friction.kinetic_nm[usize::from(!forward)];
                    let speed_over = if forward { y[speed] } else { -y[speed] };
                    let stiffness = reference / bristle.deflection_rad;
                    rate[BRISTLE] = y[speed] - stiffness * speed_over / level * y[BRISTLE];
                    stiffness * y[BRISTLE] + bristle.damping * rate[BRISTLE]
                }
            };
        }
        rate[speed] = self.acceleration(index, torque, y[speed], y[angle]);
        rate[angle] = y[speed];
    }

    fn acceleration(&self, index: usize, torque: f64, omega: f64, theta: f64) -> f64 {
        let inertia = self.inertias()[index];
        if let Some(Oddity::CrankInertia { amplitude, ratio }) = self.load.oddity {
            let angle = theta / ratio;
            let gyroscopic = -0.5 * inertia * amplitude * angle.sin() / ratio * omega * omega;
            return (torque - gyroscopic) / (inertia * (1.0 + amplitude * angle.cos()));
        }
        torque / inertia
    }
}

/// Torques on a body, N m.
#[derive(Clone, Copy, Debug)]
pub struct Driving {
    /// All but dry friction.
    pub total: f64,
    /// What the motor's side brings to the bearing.
    pub motor: f64,
    /// What the load's side brings to the bearing.
    pub load: f64,
}
