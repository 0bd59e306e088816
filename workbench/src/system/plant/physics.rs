//! Everything the plant can do, as numbers. The neutral value of each field means: the effect is absent.
//!
//! ```text
//! command → delay → lag → gain → offset → dead zone → limit → voltage drop → winding (R, L, Ke, sag, current limit, heat)
//!         → Kt·i → friction, external torques → inertia [→ gap or spring → load] → sensor
//! ```

use super::unnamed::Term;
use std::f64::consts::PI;

/// What the input of the plant is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// A terminal voltage: the winding's equation holds.
    Voltage,
    /// A torque or force, or a current held by a loop: input times [`Physics::force_gain`] is the torque.
    Torque,
}

/// Where an external torque is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Time since the start of the run, s.
    pub time_s: f64,
    /// Position at the start of the step, rad.
    pub theta: f64,
    /// Position at the end of the step (expected), rad.
    pub theta_next: f64,
    /// Speed, rad/s.
    pub omega: f64,
    /// Turns of the encoder's shaft per turn of the load.
    pub gear_ratio: f64,
}

/// An external torque of its own file: N m from up to three parameters and the motion.
#[derive(Clone, Copy, Debug)]
pub struct TorqueLaw {
    /// The equation.
    pub torque: fn(&[f64; 3], &Motion) -> f64,
    /// Its parameters.
    pub parameters: [f64; 3],
    /// On what it acts.
    pub acts: Acts,
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

/// The plant in numbers. SI units; on a linear axis read N for N m and m for rad.
#[derive(Clone, Debug)]
pub struct Physics {
    /// Voltage or torque input.
    pub drive: Drive,
    /// Torque per unit of input, for [`Drive::Torque`].
    pub force_gain: f64,
    /// Winding resistance, Ω.
    pub resistance: f64,
    /// Winding inductance, H; 0: the current follows at once.
    pub inductance: f64,
    /// Torque constant, N m/A.
    pub kt: f64,
    /// Back-EMF constant, V s/rad.
    pub ke: f64,
    /// Total inertia, kg m².
    pub inertia: f64,
    /// Viscous friction, N m s/rad.
    pub viscous: f64,
    /// Turns of the encoder's shaft per turn of the load.
    pub gear_ratio: f64,
    /// Nominal supply, V: what a full duty means for the supply's sag.
    pub supply_v: f64,

    /// Pure delay of the command, s.
    pub delay_s: f64,
    /// First-order lag of the drive, s.
    pub lag_s: f64,
    /// Gain of the drive.
    pub drive_gain: f64,
    /// Offset of the drive, in units of the input.
    pub drive_offset: f64,
    /// Dead zone, positive side.
    pub dead_pos: f64,
    /// Dead zone, negative side, as a magnitude.
    pub dead_neg: f64,
    /// Rounding of the dead zone's corners, in units of the input.
    pub dead_softness: f64,
    /// Limit behind the dead zone; infinite: none.
    pub limit: f64,
    /// Limit for negative inputs over that for positive ones.
    pub limit_skew: f64,
    /// 0: hard knee; else the knee's smoothness (relative).
    pub limit_softness: f64,
    /// Constant voltage drop in the direction of the current, V.
    pub drop_v: f64,
    /// Source resistance, Ω.
    pub source_ohm: f64,
    /// Capacity of the supply rail, F; 0: the rail follows at once.
    pub bus_farad: f64,
    /// Largest current, A; infinite: none.
    pub current_limit: f64,
    /// Relative rise of R per watt of copper loss, 1/W.
    pub heat_rise_per_w: f64,
    /// Thermal time constant, s.
    pub heat_time_s: f64,
    /// Current at which Kt has fallen to a half, A; infinite: never.
    pub kt_knee_a: f64,

    /// Kinetic friction for positive speed, N m.
    pub friction_pos: f64,
    /// Kinetic friction for negative speed, N m, as a magnitude.
    pub friction_neg: f64,
    /// Breakaway above kinetic friction, N m.
    pub breakaway_extra: f64,
    /// Stribeck speed, rad/s.
    pub stribeck_speed: f64,
    /// Friction per motor torque.
    pub friction_per_motor: f64,
    /// Friction per load torque.
    pub friction_per_load: f64,
    /// Additional viscous friction for positive speed, N m s/rad.
    pub viscous_pos: f64,
    /// Additional viscous friction for negative speed, N m s/rad.
    pub viscous_neg: f64,
    /// External torques.
    pub torques: Vec<TorqueLaw>,
    /// Terms without a name.
    pub unnamed: Vec<Term>,

    /// Total play between motor and load, rad.
    pub gap_rad: f64,
    /// Share of the inertia that sits behind the gap or spring.
    pub load_share: f64,
    /// Stiffness of the coupling, N m/rad; infinite: rigid.
    pub stiffness: f64,
    /// Damping of the coupling, N m s/rad.
    pub coupling_damping: f64,
    /// Rate at which the teeth of a play answer a contact, rad/s; infinite: the contact is inelastic.
    pub contact_rad_s: f64,
    /// Damping ratio of that contact.
    pub contact_damping: f64,
    /// True: the encoder sits on the load side.
    pub encoder_at_load: bool,

    /// Scale of the reading.
    pub sensor_scale: f64,
    /// True: the sensor reports the magnitude.
    pub sensor_rectified: bool,
    /// Lag of the reading, s.
    pub sensor_lag_s: f64,
    /// Largest reading; infinite: none.
    pub sensor_limit: f64,
    /// Offset of the reading.
    pub sensor_offset: f64,
}

impl Physics {
    /// A motor without any effect.
    pub fn linear_motor(
        resistance: f64,
        inductance: f64,
        kt: f64,
        ke: f64,
        inertia: f64,
        viscous: f64,
    ) -> Self {
        Self { drive: Drive::Voltage, resistance, inductance, kt, ke, inertia, viscous, ..Self::neutral() }
    }

    /// An inertia moved by a torque or a force.
    pub fn inertia(inertia: f64, viscous: f64, force_gain: f64) -> Self {
        Self { drive: Drive::Torque, inertia, viscous, force_gain, ..Self::neutral() }
    }

    fn neutral() -> Self {
        Self {
            drive: Drive::Torque,
            force_gain: 1.0,
            resistance: 1.0,
            inductance: 0.0,
            kt: 1.0,
            ke: 1.0,
            inertia: 1.0,
            viscous: 0.0,
            gear_ratio: 1.0,
            supply_v: f64::INFINITY,
            delay_s: 0.0,
            lag_s: 0.0,
            drive_gain: 1.0,
            drive_offset: 0.0,
            dead_pos: 0.0,
            dead_neg: 0.0,
            dead_softness: 0.0,
            limit: f64::INFINITY,
            limit_skew: 1.0,
            limit_softness: 0.0,
            drop_v: 0.0,
            source_ohm: 0.0,
            bus_farad: 0.0,
            current_limit: f64::INFINITY,
            heat_rise_per_w: 0.0,
            heat_time_s: f64::INFINITY,
            kt_knee_a: f64::INFINITY,
            friction_pos: 0.0,
            friction_neg: 0.0,
            breakaway_extra: 0.0,
            stribeck_speed: 1.0,
            friction_per_motor: 0.0,
            friction_per_load: 0.0,
            viscous_pos: 0.0,
            viscous_neg: 0.0,
            torques: Vec::new(),
            unnamed: Vec::new(),
            gap_rad: 0.0,
            load_share: 0.0,
            stiffness: f64::INFINITY,
            coupling_damping: 0.0,
            contact_rad_s: f64::INFINITY,
            contact_damping: 1.0,
            encoder_at_load: false,
            sensor_scale: 1.0,
            sensor_rectified: false,
            sensor_lag_s: 0.0,
            sensor_limit: f64::INFINITY,
            sensor_offset: 0.0,
        }
    }

    /// Mechanical time constant of the linear part with the winding connected, s.
    pub fn time_constant_s(&self) -> f64 {
        self.inertia / self.total_damping()
    }

    /// b + Kt·Ke/R: what a driven motor is damped by, N m s/rad.
    pub fn total_damping(&self) -> f64 {
        match self.drive {
            Drive::Voltage => self.viscous + self.kt * self.ke / self.resistance,
            Drive::Torque => self.viscous,
        }
    }

    /// Steady speed per unit of input, rad/s.
    pub fn dc_gain(&self) -> f64 {
        self.torque_per_input() / self.total_damping()
    }

    /// Stall torque per unit of input, N m.
    pub fn torque_per_input(&self) -> f64 {
        match self.drive {
            Drive::Voltage => self.kt / self.resistance,
            Drive::Torque => self.force_gain,
        }
    }

    /// Frequency of the two-mass resonance, rad/s; 0 if the coupling is rigid.
    pub fn resonance_rad_s(&self) -> f64 {
        let share = self.load_share.clamp(1e-3, 1.0 - 1e-3);
        if self.stiffness.is_finite() {
            (self.stiffness / (self.inertia * share * (1.0 - share))).sqrt()
        } else {
            0.0
        }
    }
}

/// An angle in [−π, π) for reports.
pub fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}
