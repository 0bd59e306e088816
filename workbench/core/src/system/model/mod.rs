//! The model that is compared with a log: base motor, tolerances, sensors, and the effects it already contains.

mod complaints;
mod draft;
mod file;
mod keys;
mod read;
mod section;
pub mod table;
mod unnamed;

pub use draft::{Draft, Unknown};
pub use keys::{ACTS, NAMED, OVER, STANDING, STANDSTILL, UNNAMED, VALUES, VALUES_STD};
pub use read::{parse, parse_draft};
pub use unnamed::Unnamed;

use crate::system::effects::Effect;
use crate::system::plant::physics::Physics;
use crate::system::plant::unnamed::Term;
use std::collections::BTreeMap;

/// Relative tolerance (1 σ) of a parameter for which the file declares none. Chosen by judgement; not studied.
pub const DEFAULT_TOLERANCE: f64 = 0.05;

/// Key of the torque constant of a motor.
pub const KT: &str = "Kt_nm_per_a";
/// Key of its back-EMF constant.
pub const KE: &str = "Ke_vs_per_rad";
/// Key of what one unit of the input does to an axis that is driven directly.
pub const DRIVE_GAIN: &str = "drive_gain";
/// Key of the viscous friction of a first-order model.
pub const VISCOUS_V: &str = "viscous_vs_per_rad";
/// Key of the time constant of its winding.
pub const ELECTRICAL: &str = "electrical_time_constant_s";
/// The back-EMF makes at least this part of the damping of a first-order model: beyond it nothing would drive the
/// motor. Chosen by judgement; not studied.
const LEAST_EMF: f64 = 0.05;
/// Kind of an axis that is driven directly.
pub const DRIVEN_DIRECTLY: &str = "inertia";

/// The equations of the base, with their parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// L di/dt = u − R i − Ke ω; J dω/dt = Kt i − b ω.
    DcMotor {
        /// Winding resistance, Ω.
        r_ohm: f64,
        /// Winding inductance, H; 0: neglected.
        l_h: f64,
        /// Torque constant, N m/A.
        kt_nm_per_a: f64,
        /// Back-EMF constant, V s/rad.
        ke_vs_per_rad: f64,
        /// Total inertia, kg m².
        j_kgm2: f64,
        /// Viscous friction, N m s/rad.
        b_nms_per_rad: f64,
    },
    /// T dω/dt + ω = gain · u.
    FirstOrder {
        /// Steady speed per volt.
        gain_rad_s_per_v: f64,
        /// Time constant, s.
        time_constant_s: f64,
        /// Friction linear in the speed, as a voltage at the terminals, V s/rad. Gain and time constant hold it already; with the
        /// bridge open it is all that slows the shaft down.
        viscous_vs_per_rad: f64,
        /// Time constant of the winding, L/R, s; 0: neglected.
        electrical_s: f64,
    },
    /// J dω/dt = drive_gain · input − viscous · ω (or M dv/dt on a linear axis).
    Inertia {
        /// Inertia, kg m², or mass, kg.
        inertia: f64,
        /// Viscous friction, N m s/rad or N s/m.
        viscous: f64,
        /// Torque or force per unit of input.
        drive_gain: f64,
        /// True: the file gave `mass_kg`.
        linear: bool,
    },
}

/// An effect that the model already contains.
#[derive(Clone, Debug)]
pub struct Known {
    /// The effect.
    pub effect: &'static Effect,
    /// Its parameters in the effect's own order.
    pub values: Vec<f64>,
    /// Their standard deviations where the file gives them (`NAME_std`).
    pub stds: Vec<Option<f64>>,
    /// Where it came from.
    pub origin: Option<String>,
}

/// Which side of the gear carries the encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// The motor's shaft.
    #[default]
    Motor,
    /// The load's shaft (also written `output`).
    Load,
}

/// `[encoder]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Counts per turn after ×4 decoding; infinite where none are stated, as of a potentiometer.
    pub counts_per_rev: f64,
    /// Where it sits.
    pub side: Side,
}

/// How the logged speed came about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpeedSensor {
    /// Mean over a window centred on the row's time.
    EncoderDifferenceCentred,
    /// Mean over the window that ends at the row's time.
    EncoderDifferenceCausal,
    /// Instantaneous.
    AnalogTacho,
    /// Not known: taken as instantaneous.
    #[default]
    Unknown,
}

/// `[sensors]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensors {
    /// How the speed came about.
    pub speed: SpeedSensor,
    /// The window over which it is a mean, s.
    pub speed_window_s: f64,
    /// True if `i_a` is logged (informative; the columns decide).
    pub current_logged: Option<bool>,
    /// True if `vbus_v` is logged (informative; the columns decide).
    pub vbus_logged: Option<bool>,
}

/// The model file.
#[derive(Clone, Debug)]
pub struct Model {
    /// File name, for messages.
    pub source: String,
    /// The file's text: an extended model keeps its comments.
    pub source_text: String,
    /// The base.
    pub kind: Kind,
    /// The constant of a motor that the file states alone: Kt and Ke are then one number.
    pub constant: Option<&'static str>,
    /// Turns of the encoder's shaft per turn of the load.
    pub gear_ratio: f64,
    /// Relative tolerances (1 σ) by key; `default`: that of every other one.
    pub tolerances: BTreeMap<String, f64>,
    /// Nominal supply, V.
    pub supply_nominal_v: Option<f64>,
    /// Known limit of the drive, V.
    pub supply_limit_v: Option<f64>,
    /// The encoder, if declared.
    pub encoder: Option<Encoder>,
    /// How the speed came about.
    pub sensors: Sensors,
    /// Informative sample rate, Hz.
    pub sample_hz: Option<f64>,
    /// Effects that the model already contains.
    pub known: Vec<Known>,
    /// Terms without a name that the model already contains.
    pub unnamed: Vec<Unnamed>,
    /// True: the values are the best linear fit to the log and are refitted together with any effect.
    pub fitted_to_log: bool,
    /// True: names are asked for by shares of the gap, and not by the noise. As the file says, until a search asks the other way.
    pub by_shares: bool,
    /// Every key whose value is a text, as (section, key, value): kept, and written again.
    pub texts: Vec<(String, String, String)>,
    /// What the file holds and the program does not use, for the reader of a report.
    pub notes: Vec<String>,
}

impl Kind {
    /// Sets a parameter by key. Unknown keys change nothing.
    pub fn set(&mut self, key: &str, value: f64) {
        let number = self.numbers().into_iter().find(|(name, _)| *name == key);
        if let Some((_, number)) = number {
            *number = value;
        }
    }

    /// Its numbers by their keys in the model file.
    fn numbers(&mut self) -> Vec<(&'static str, &mut f64)> {
        match self {
            Kind::DcMotor { r_ohm, l_h, kt_nm_per_a, ke_vs_per_rad, j_kgm2, b_nms_per_rad } => vec![
                ("R_ohm", r_ohm),
                ("L_h", l_h),
                (KT, kt_nm_per_a),
                (KE, ke_vs_per_rad),
                ("J_kgm2", j_kgm2),
                ("b_nms_per_rad", b_nms_per_rad),
            ],
            Kind::FirstOrder { gain_rad_s_per_v, time_constant_s, viscous_vs_per_rad, electrical_s } => vec![
                ("gain_rad_s_per_v", gain_rad_s_per_v),
                ("time_constant_s", time_constant_s),
                (VISCOUS_V, viscous_vs_per_rad),
                (ELECTRICAL, electrical_s),
            ],
            Kind::Inertia { inertia, viscous, drive_gain, linear } => {
                let key = if *linear { "mass_kg" } else { "inertia_kgm2" };
                vec![(key, inertia), ("viscous", viscous), (DRIVE_GAIN, drive_gain)]
            }
        }
    }
}

impl Model {
    /// The base parameters by key, in the file's order.
    pub fn parameters(&self) -> Vec<(&'static str, f64)> {
        let mut kind = self.kind;
        kind.numbers().into_iter().map(|(key, number)| (key, *number)).collect()
    }

    /// Sets a base parameter by key. Unknown keys change nothing.
    pub fn set_parameter(&mut self, key: &str, value: f64) {
        self.kind.set(key, value);
    }

    /// Relative tolerance (1 σ) of a base parameter; `default`: of one that has none of its own.
    pub fn tolerance(&self, key: &str) -> f64 {
        let stated = self.tolerances.get(key).or_else(|| self.tolerances.get("default"));
        stated.copied().unwrap_or(DEFAULT_TOLERANCE)
    }

    /// True if the file says how well each number of the base is known, and not that they are a fit.
    pub fn is_vouched_for(&self) -> bool {
        let stated = |key: &str| self.tolerances.contains_key(key);
        let known = stated("default") || self.parameters().iter().all(|(key, _)| stated(key));
        known && !self.fitted_to_log
    }

    /// The key under which the file states a number: of one motor constant the one that it has.
    pub fn stated(&self, key: &'static str) -> &'static str {
        self.constant.filter(|_| key == KT).unwrap_or(key)
    }

    /// True on a linear axis.
    pub fn linear(&self) -> bool {
        matches!(self.kind, Kind::Inertia { linear: true, .. })
    }

    /// The base without any effect, not even the known ones.
    ///
    /// A first-order model with the viscous voltage c is the motor with R = 1 Ω, Kt = Ke = K = 1/gain − c, J = T·K/gain, b = c·K and the
    /// inductance that its electrical time constant says: its torques count in that motor's unit, in which a torque over K is a voltage.
    pub fn base(&self) -> Physics {
        self.base_of(&self.kind)
    }

    /// The same with another set of base parameters.
    pub fn base_of(&self, kind: &Kind) -> Physics {
        let mut plant = match *kind {
            Kind::DcMotor { r_ohm, l_h, kt_nm_per_a, ke_vs_per_rad, j_kgm2, b_nms_per_rad } => {
                Physics::linear_motor(r_ohm, l_h, kt_nm_per_a, ke_vs_per_rad, j_kgm2, b_nms_per_rad)
            }
            Kind::FirstOrder {
                gain_rad_s_per_v: g,
                time_constant_s: t,
                viscous_vs_per_rad: c,
                electrical_s,
            } => {
                let k = (1.0 / g - c).max(LEAST_EMF / g);
                Physics::linear_motor(1.0, electrical_s, k, k, t * k / g, c * k)
            }
            Kind::Inertia { inertia, viscous, drive_gain, .. } => {
                Physics::inertia(inertia, viscous, drive_gain)
            }
        };
        plant.gear_ratio = self.gear_ratio;
        plant.supply_v = self.supply_nominal_v.unwrap_or(f64::INFINITY);
        plant.limit = self.supply_limit_v.unwrap_or(f64::INFINITY);
        plant.encoder_at_load = self.encoder.is_some_and(|encoder| encoder.side == Side::Load);
        plant
    }

    /// The plant that the model describes, known effects included.
    pub fn physics(&self) -> Physics {
        let mut plant = self.base();
        for known in &self.known {
            (known.effect.apply)(&known.values, &mut plant);
        }
        plant.unnamed = self.terms();
        plant
    }

    /// The terms without a name, for a plant.
    pub fn terms(&self) -> Vec<Term> {
        self.unnamed.iter().map(|unnamed| unnamed.term.clone()).collect()
    }

    /// How sure the gap workflow was of the name of a known effect; `None`: a person has written it.
    pub fn standing(&self, effect: &str) -> Option<&str> {
        let section = format!("known.{effect}");
        let mut texts = self.texts.iter();
        let found = texts.find(|(place, key, _)| *place == section && key == STANDING);
        found.map(|(_, _, standing)| standing.as_str())
    }
}
