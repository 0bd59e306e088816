//! Everything the plant can do, as numbers. The neutral value of each field means: the effect is absent.
//!
//! ```text
//! command → delay → lag → gain → offset → dead zone → limit → voltage drop → winding (R, L, Ke, sag, current limit, heat)
//!         → Kt·i → friction, external torques → inertia [→ gap or spring → load] → sensor
//! ```

use super::laws::TorqueLaw;
use super::simd::Lanes;
use super::step_size::StepSize;
use super::unnamed::Term;

/// What the input of the plant is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// A terminal voltage: the winding's equation holds.
    Voltage,
    /// A torque or force, or a current held by a loop: input times [`Physics::force_gain`] is the torque.
    Torque,
}

/// Declares the plant from its numbers: of each its meaning, and the value with which it does nothing.
macro_rules! numbers {
    ($($(#[doc = $doc:literal])+ $number:ident: $neutral:expr,)+) => {
        /// The plant in numbers. SI units; on a linear axis read N for N m and m for rad. `F`: one number, or one of each of several
        /// sets in lock-step ([`Lanes`]).
        #[derive(Clone, Debug)]
        pub struct Physics<F = f64> {
            $($(#[doc = $doc])+ pub $number: F,)+
            /// Voltage or torque input.
            pub drive: Drive,
            /// External torques.
            pub torques: Vec<TorqueLaw<F>>,
            /// Terms without a name.
            pub unnamed: Vec<Term>,
            /// True: the encoder sits on the load side.
            pub encoder_at_load: bool,
            /// True: the sensor reports the magnitude.
            pub sensor_rectified: bool,
            /// The steps of another plant, if it advances by those; otherwise by its own.
            pub step_size: Option<StepSize>,
        }

        impl Physics {
            fn neutral() -> Self {
                Self {
                    $($number: $neutral,)+
                    drive: Drive::Torque,
                    torques: Vec::new(),
                    unnamed: Vec::new(),
                    encoder_at_load: false,
                    sensor_rectified: false,
                    step_size: None,
                }
            }
        }

        impl<L: Lanes> Physics<L> {
            /// Plants with the same features side by side; the last one fills what is left. `like`: any number, for its width.
            pub fn side_by_side(sets: &[Physics], like: L) -> Self {
                Self {
                    $($number: like.of(|set| sets[set.min(sets.len() - 1)].$number),)+
                    drive: sets[0].drive,
                    torques: laws(sets, like),
                    unnamed: sets[0].unnamed.clone(),
                    encoder_at_load: sets[0].encoder_at_load,
                    sensor_rectified: sets[0].sensor_rectified,
                    step_size: sets[0].step_size,
                }
            }
        }
    };
}

numbers! {
    /// Torque per unit of input, for [`Drive::Torque`].
    force_gain: 1.0,
    /// Winding resistance, Ω.
    resistance: 1.0,
    /// Winding inductance, H; 0: the current follows at once.
    inductance: 0.0,
    /// Torque constant, N m/A.
    kt: 1.0,
    /// Back-EMF constant, V s/rad.
    ke: 1.0,
    /// Total inertia, kg m².
    inertia: 1.0,
    /// Viscous friction, N m s/rad.
    viscous: 0.0,
    /// Turns of the encoder's shaft per turn of the load.
    gear_ratio: 1.0,
    /// Nominal supply, V: what a full duty means for the supply's sag.
    supply_v: f64::INFINITY,
    /// Pure delay of the command, s.
    delay_s: 0.0,
    /// First-order lag of the drive, s.
    lag_s: 0.0,
    /// Gain of the drive.
    drive_gain: 1.0,
    /// Offset of the drive, in units of the input.
    drive_offset: 0.0,
    /// Dead zone, positive side.
    dead_pos: 0.0,
    /// Dead zone, negative side, as a magnitude.
    dead_neg: 0.0,
    /// Rounding of the dead zone's corners, in units of the input.
    dead_softness: 0.0,
    /// Limit behind the dead zone; infinite: none.
    limit: f64::INFINITY,
    /// Limit for negative inputs over that for positive ones.
    limit_skew: 1.0,
    /// 0: hard knee; else the knee's smoothness (relative).
    limit_softness: 0.0,
    /// Constant voltage drop in the direction of the current, V.
    drop_v: 0.0,
    /// Source resistance, Ω.
    source_ohm: 0.0,
    /// Capacity of the supply rail, F; 0: the rail follows at once.
    bus_farad: 0.0,
    /// Largest current, A; infinite: none.
    current_limit: f64::INFINITY,
    /// Relative rise of R per watt of copper loss, 1/W.
    heat_rise_per_w: 0.0,
    /// Thermal time constant, s.
    heat_time_s: f64::INFINITY,
    /// Relative rise of R when a log begins.
    heat_start: 0.0,
    /// Current at which Kt has fallen to a half, A; infinite: never.
    kt_knee_a: f64::INFINITY,
    /// Kinetic friction for positive speed, N m.
    friction_pos: 0.0,
    /// Kinetic friction for negative speed, N m, as a magnitude.
    friction_neg: 0.0,
    /// Breakaway above kinetic friction, N m.
    breakaway_extra: 0.0,
    /// Stribeck speed, rad/s.
    stribeck_speed: 1.0,
    /// Friction per motor torque.
    friction_per_motor: 0.0,
    /// Friction per load torque.
    friction_per_load: 0.0,
    /// Additional viscous friction for positive speed, N m s/rad.
    viscous_pos: 0.0,
    /// Additional viscous friction for negative speed, N m s/rad.
    viscous_neg: 0.0,
    /// Total play between motor and load, rad.
    gap_rad: 0.0,
    /// Share of the inertia that sits behind the gap or spring.
    load_share: 0.0,
    /// Stiffness of the coupling, N m/rad; infinite: rigid.
    stiffness: f64::INFINITY,
    /// Damping of the coupling, N m s/rad.
    coupling_damping: 0.0,
    /// Rate at which the teeth of a play answer a contact, rad/s; infinite: the contact is inelastic.
    contact_rad_s: f64::INFINITY,
    /// Damping ratio of that contact.
    contact_damping: 1.0,
    /// Scale of the reading.
    sensor_scale: 1.0,
    /// Lag of the reading, s.
    sensor_lag_s: 0.0,
    /// Largest reading; infinite: none.
    sensor_limit: f64::INFINITY,
    /// Offset of the reading.
    sensor_offset: 0.0,
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

fn laws<L: Lanes>(sets: &[Physics], like: L) -> Vec<TorqueLaw<L>> {
    let of = |law: usize| sets.iter().map(|set| &set.torques[law]).collect::<Vec<_>>();
    (0..sets[0].torques.len()).map(|law| TorqueLaw::side_by_side(&of(law), like)).collect()
}
