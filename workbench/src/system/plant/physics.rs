//! Everything the plant can do, as numbers. The neutral value of each field means: the effect is absent.
//!
//! ```text
//! command → delay → lag → gain → offset → dead zone → limit → voltage drop → winding (R, L, Ke, sag, current limit, heat)
//!         → Kt·i → friction, external torques → inertia [→ gap or spring → load] → sensor
//! ```

use super::lanes::Lanes;
use super::laws::TorqueLaw;
use super::rungs::Rungs;
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

/// The plant in numbers. SI units; on a linear axis read N for N m and m for rad. `F`: one number, or one of each of several sets
/// in lock-step ([`Lanes`]).
#[derive(Clone, Debug)]
pub struct Physics<F = f64> {
    /// Voltage or torque input.
    pub drive: Drive,
    /// Torque per unit of input, for [`Drive::Torque`].
    pub force_gain: F,
    /// Winding resistance, Ω.
    pub resistance: F,
    /// Winding inductance, H; 0: the current follows at once.
    pub inductance: F,
    /// Torque constant, N m/A.
    pub kt: F,
    /// Back-EMF constant, V s/rad.
    pub ke: F,
    /// Total inertia, kg m².
    pub inertia: F,
    /// Viscous friction, N m s/rad.
    pub viscous: F,
    /// Turns of the encoder's shaft per turn of the load.
    pub gear_ratio: F,
    /// Nominal supply, V: what a full duty means for the supply's sag.
    pub supply_v: F,

    /// Pure delay of the command, s.
    pub delay_s: F,
    /// First-order lag of the drive, s.
    pub lag_s: F,
    /// Gain of the drive.
    pub drive_gain: F,
    /// Offset of the drive, in units of the input.
    pub drive_offset: F,
    /// Dead zone, positive side.
    pub dead_pos: F,
    /// Dead zone, negative side, as a magnitude.
    pub dead_neg: F,
    /// Rounding of the dead zone's corners, in units of the input.
    pub dead_softness: F,
    /// Limit behind the dead zone; infinite: none.
    pub limit: F,
    /// Limit for negative inputs over that for positive ones.
    pub limit_skew: F,
    /// 0: hard knee; else the knee's smoothness (relative).
    pub limit_softness: F,
    /// Constant voltage drop in the direction of the current, V.
    pub drop_v: F,
    /// Source resistance, Ω.
    pub source_ohm: F,
    /// Capacity of the supply rail, F; 0: the rail follows at once.
    pub bus_farad: F,
    /// Largest current, A; infinite: none.
    pub current_limit: F,
    /// Relative rise of R per watt of copper loss, 1/W.
    pub heat_rise_per_w: F,
    /// Thermal time constant, s.
    pub heat_time_s: F,
    /// Current at which Kt has fallen to a half, A; infinite: never.
    pub kt_knee_a: F,

    /// Kinetic friction for positive speed, N m.
    pub friction_pos: F,
    /// Kinetic friction for negative speed, N m, as a magnitude.
    pub friction_neg: F,
    /// Breakaway above kinetic friction, N m.
    pub breakaway_extra: F,
    /// Stribeck speed, rad/s.
    pub stribeck_speed: F,
    /// Friction per motor torque.
    pub friction_per_motor: F,
    /// Friction per load torque.
    pub friction_per_load: F,
    /// Additional viscous friction for positive speed, N m s/rad.
    pub viscous_pos: F,
    /// Additional viscous friction for negative speed, N m s/rad.
    pub viscous_neg: F,
    /// External torques.
    pub torques: Vec<TorqueLaw<F>>,
    /// Terms without a name.
    pub unnamed: Vec<Term>,

    /// Total play between motor and load, rad.
    pub gap_rad: F,
    /// Share of the inertia that sits behind the gap or spring.
    pub load_share: F,
    /// Stiffness of the coupling, N m/rad; infinite: rigid.
    pub stiffness: F,
    /// Damping of the coupling, N m s/rad.
    pub coupling_damping: F,
    /// Rate at which the teeth of a play answer a contact, rad/s; infinite: the contact is inelastic.
    pub contact_rad_s: F,
    /// Damping ratio of that contact.
    pub contact_damping: F,
    /// True: the encoder sits on the load side.
    pub encoder_at_load: bool,

    /// Scale of the reading.
    pub sensor_scale: F,
    /// True: the sensor reports the magnitude.
    pub sensor_rectified: bool,
    /// Lag of the reading, s.
    pub sensor_lag_s: F,
    /// Largest reading; infinite: none.
    pub sensor_limit: F,
    /// Offset of the reading.
    pub sensor_offset: F,

    /// The steps of another plant, if it advances by those; otherwise by its own.
    pub rungs: Option<Rungs>,
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
            rungs: None,
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

/// A plant whose numbers are those of several, place by place.
macro_rules! side_by_side {
    ($sets:ident, $like:ident: $($field:ident),*) => {
        Physics {
            drive: $sets[0].drive,
            torques: laws($sets, $like),
            unnamed: $sets[0].unnamed.clone(),
            encoder_at_load: $sets[0].encoder_at_load,
            sensor_rectified: $sets[0].sensor_rectified,
            rungs: $sets[0].rungs,
            $($field: $like.of(|set| $sets[set.min($sets.len() - 1)].$field)),*
        }
    };
}

impl<L: Lanes> Physics<L> {
    /// Plants of one shape side by side; the last one fills what is left. `like`: any number, for its width.
    pub fn side_by_side(sets: &[Physics], like: L) -> Self {
        side_by_side!(sets, like:
            force_gain, resistance, inductance, kt, ke, inertia, viscous, gear_ratio, supply_v,
            delay_s, lag_s, drive_gain, drive_offset, dead_pos, dead_neg, dead_softness, limit,
            limit_skew, limit_softness, drop_v, source_ohm, bus_farad, current_limit,
            heat_rise_per_w, heat_time_s, kt_knee_a, friction_pos, friction_neg, breakaway_extra,
            stribeck_speed, friction_per_motor, friction_per_load, viscous_pos, viscous_neg,
            gap_rad, load_share, stiffness, coupling_damping, contact_rad_s, contact_damping,
            sensor_scale, sensor_lag_s, sensor_limit, sensor_offset
        )
    }
}

fn laws<L: Lanes>(sets: &[Physics], like: L) -> Vec<TorqueLaw<L>> {
    let of = |law: usize| sets.iter().map(|set| &set.torques[law]).collect::<Vec<_>>();
    (0..sets[0].torques.len()).map(|law| TorqueLaw::side_by_side(&of(law), like)).collect()
}

/// An angle in [−π, π) for reports.
pub fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}
