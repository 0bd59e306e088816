//! What of a plant MJCF holds by itself, and what the helper does: an effect may be native alone and need the helper beside another.

use truing_core::system::plant::laws::Law;
use truing_core::system::plant::physics::{Drive, Physics};

/// Longest advised step, s: bristles and friction of MuJoCo lose accuracy beyond it.
const LONGEST_S: f64 = 2.5e-4;
/// Steps to the mechanical time constant: MuJoCo's error is of first order, 0.1 % of the speed at 150 steps.
const STEPS_TO_TIME_CONSTANT: f64 = 200.0;
/// Steps to a radian of a resonance, and to the time of a contact.
const STEPS_TO_RADIAN: f64 = 40.0;
/// So much of a period of cogging passes in a step at the speed of an unloaded motor.
const RADIANS_OF_COGGING: f64 = 0.04;
/// Below it a rounded knee is a hard one, as in the plant.
pub const SOFT: f64 = 1e-3;

/// What turns the command into a torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Actuator {
    /// `dcmotor`.
    DcMotor,
    /// `general` with an affine bias.
    General,
    /// `general` whose torque the helper computes.
    Helper,
}

/// Who does what.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// The drive.
    pub actuator: Actuator,
    /// The helper sets the level of dry friction in every step.
    pub friction: bool,
    /// The helper adds torques.
    pub torques: bool,
    /// The helper says what the sensor of the speed shows.
    pub reading: bool,
    /// Motor and load are two bodies.
    pub two_bodies: bool,
    /// The step that the file asks for, s.
    pub step_s: f64,
}

impl Plan {
    /// That of a plant.
    pub fn of(p: &Physics) -> Self {
        let friction = p.breakaway_extra > 0.0 || p.friction_per_motor > 0.0 || p.friction_per_load > 0.0;
        let periodic = p.torques.iter().any(|law| law.law == Law::Periodic);
        let two_bodies = p.load_share > 0.0;
        Self {
            actuator: actuator(p),
            friction,
            torques: p.viscous_pos != p.viscous_neg || periodic || touches(p),
            reading: p.sensor_lag_s > 0.0
                || p.sensor_rectified
                || p.sensor_offset != 0.0
                || (p.encoder_at_load && p.gap_rad > 0.0 && !two_bodies),
            two_bodies,
            step_s: step_s(p),
        }
    }

    /// True if the file needs the helper beside it.
    pub fn helper(&self) -> bool {
        self.actuator == Actuator::Helper || self.friction || self.torques || self.reading
    }
}

/// True if the teeth of a play give way.
pub fn touches(p: &Physics) -> bool {
    p.load_share > 0.0 && p.gap_rad > 0.0 && !p.stiffness.is_finite() && p.contact_rad_s.is_finite()
}

fn actuator(p: &Physics) -> Actuator {
    let voltage = p.drive == Drive::Voltage;
    let winds = voltage && (p.inductance > 0.0 || p.heat_rise_per_w > 0.0);
    let general = p.lag_s > 0.0 || p.drive_offset != 0.0 || p.current_limit.is_finite();
    let alone = p.dead_pos > 0.0
        || p.dead_neg > 0.0
        || (p.limit.is_finite() && p.limit_softness > SOFT)
        || (voltage && p.drop_v > 0.0)
        || p.source_ohm > 0.0
        || p.kt_knee_a.is_finite()
        // Of a winding that warms up, `dcmotor` keeps the electrical time constant of the cold one: 1.2 % of the speed in a round trip.
        || (voltage && p.inductance > 0.0 && p.heat_rise_per_w > 0.0)
        || p.friction_per_motor > 0.0
        || (p.lag_s > 0.0 && p.limit.is_finite());
    match (alone || (winds && general), voltage && !general) {
        (true, _) => Actuator::Helper,
        (false, true) => Actuator::DcMotor,
        (false, false) => Actuator::General,
    }
}

/// The longest part of a millisecond that is fine enough.
fn step_s(p: &Physics) -> f64 {
    let mut enough = (p.time_constant_s() / STEPS_TO_TIME_CONSTANT).min(LONGEST_S);
    let resonance = p.resonance_rad_s();
    if p.load_share > 0.0 && resonance > 0.0 {
        enough = enough.min(1.0 / (STEPS_TO_RADIAN * resonance));
    }
    if touches(p) {
        enough = enough.min(1.0 / (STEPS_TO_RADIAN * p.contact_rad_s));
    }
    let fastest = if p.supply_v.is_finite() { p.dc_gain() * p.supply_v } else { 0.0 };
    for law in p.torques.iter().filter(|law| law.law == Law::Cogging) {
        enough = enough.min(RADIANS_OF_COGGING / (law.parameters[1] * fastest));
    }
    let steps = [2.5e-4, 2e-4, 1.25e-4, 1e-4, 5e-5, 2.5e-5, 1e-5, 5e-6];
    steps.into_iter().find(|step| *step <= enough * (1.0 + 1e-9)).unwrap_or(2e-6)
}
