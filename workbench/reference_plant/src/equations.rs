//! The equations of the motor on one smooth piece.
//!
//! ```text
//! L di/dt = v − R (1 + ρ h) i − Ke ω                 τh dh/dt = R (1 + ρ h) i² − h
//! J dω/dt = Kt(i) i − b± ω − c ω|ω| − friction − (mgl/N) sin(θ/N + φ) − A sin(nθ + ψ) + loads
//! Kt(i)   = Kt / (1 + (i/knee)²)^p
//! ```
//!
//! With a train of two bodies the load has its own speed and angle and a spring with damping between them; behind a play
//! the spring acts only where the teeth touch, and never pulls. Everything is referred to the rotor's shaft.

use super::drive::Command;
use super::modes::{Contact, Held, Modes, Motion, Winding};
use super::motor::{Motor, Oddity, Train};
use super::rosenbrock::{N, State};
use super::sensors::Tacho;
use super::state::*;
use servo::axis::Bridge;

impl Motor {
    /// Torque of the winding, N m.
    pub fn electric_torque(&self, held: &Held, y: &State) -> f64 {
        if let Command::Torque(torque) = held.command {
            return if held.bridge == Bridge::Driven { torque } else { 0.0 };
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
        if let Some(law) = &load.law {
            torque += (law.torque)(&law.parameters, theta);
        }
        torque + load.oddity.map_or(0.0, |oddity| self.odd_torque(oddity, t, omega, theta))
    }

    fn odd_torque(&self, oddity: Oddity, t: f64, omega: f64, theta: f64) -> f64 {
        match oddity {
            Oddity::ViscosityDrift { rate_per_s } => {
                -self.viscous[usize::from(omega < 0.0)] * rate_per_s * t * omega
            }
            Oddity::CommutationRipple { .. } | Oddity::CrankInertia { .. } => 0.0,
            Oddity::SweepingLoad { amplitude_nm, start_hz, sweep_hz_per_s } => {
                amplitude_nm * (std::f64::consts::TAU * (start_hz + 0.5 * sweep_hz_per_s * t) * t).sin()
            }
            Oddity::EddyBrake { slope, peak_rad_s } => -slope * omega / (1.0 + (omega / peak_rad_s).powi(2)),
            Oddity::BeatingCogging { amplitude_nm, periods: [n, m] } => {
                -amplitude_nm * ((n * theta).sin() + (m * theta).sin())
            }
            Oddity::EndStop { stiffness, theta0_rad } => {
                -stiffness * ((theta - theta0_rad).max(0.0) + (theta + theta0_rad).min(0.0))
            }
        }
    }

    /// Spring and damper between rotor and load, N m on the load.
    pub fn coupling_torque(&self, contact: Contact, y: &State) -> f64 {
        let twist = y[ANGLE] - y[LOAD_ANGLE];
        let rate = y[SPEED] - y[LOAD_SPEED];
        match self.train {
            Train::Rigid => 0.0,
            Train::Flexible { stiffness, damping, .. } => stiffness * twist + damping * rate,
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
        let (omega, theta) = if index == 0 { (y[SPEED], y[ANGLE]) } else { (y[LOAD_SPEED], y[LOAD_ANGLE]) };
        let viscous_share = match self.train.split() {
            None => 1.0,
            Some(split) if index == 0 => 1.0 - split.viscous,
            Some(split) => split.viscous,
        };
        let direction = usize::from(!modes.motion[index].is_forward(omega));
        let mut total = -viscous_share * self.viscous[direction] * omega;
        let coupling = if two { self.coupling_torque(modes.contact, y) } else { 0.0 };
        let outer = if two == (index == 1) { self.outer_torque(held, t, omega, theta) } else { 0.0 };
        total += outer;
        if index == 1 {
            return Driving { total: total + coupling, motor: coupling, load: outer };
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
        Driving { total, motor, load: outer - coupling }
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
        if tacho.on_load && self.has_two_bodies() { y[LOAD_SPEED] } else { y[SPEED] }
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
            let drawn = if driven { drive.duty(held.command) * current } else { 0.0 };
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
        let x = self.drive.behind_dead_zone(self.before_dead_zone(held, y), modes.dead_zone);
        self.drive.supplied(held.command, self.drive.behind_limit(x, modes.limit), supply)
    }

    /// Voltage in front of the dead zone.
    pub fn before_dead_zone(&self, held: &Held, y: &State) -> f64 {
        let request = if self.drive.lag_s > 0.0 {
            y[LAG]
        } else {
            self.drive
                .requested(held.live_command(), self.drive.supply(held.live_command(), held.ripple_v, y))
        };
        self.drive.scaled(request)
    }

    fn body_rates(&self, index: usize, held: &Held, modes: &Modes, t: f64, y: &State, rate: &mut State) {
        let (speed, angle) = if index == 0 { (SPEED, ANGLE) } else { (LOAD_SPEED, LOAD_ANGLE) };
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
