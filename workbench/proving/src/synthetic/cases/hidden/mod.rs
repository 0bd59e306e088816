//! What can be hidden: every effect of the library, drawn from barely visible to large, put into the truth.
//!
//! Nothing here touches the library's own code or bounds: names and parameter conventions alone are shared, because the
//! answer has to be compared. Sizes are relative to the motor's natural scales.

mod drive;
mod friction;
mod load;
mod motor;
mod sensor;

use super::base::Natural;
use crate::synthetic::reference_plant::{Motor, Tacho};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use truing_core::system::effects::Effect;

/// The motor with its sensor, under construction.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The truth.
    pub motor: Motor,
    /// Scale of everything that is read from the encoder or tacho.
    pub reading_scale: f64,
    /// Added to the speed reading, rad/s.
    pub reading_offset: f64,
    /// The encoder sits at the load.
    pub encoder_at_load: bool,
}

impl Subject {
    fn tacho(&mut self) -> &mut Tacho {
        self.motor.tacho.get_or_insert_with(Tacho::default)
    }
}

/// Kinds that exclude each other, or that no data could part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// A group of its own.
    Own,
    /// Dead zones.
    DeadZone,
    /// Scales of the input or of the reading.
    Scale,
    /// Constants that shift the motion to one side.
    Constant,
    /// What makes the reading late.
    Delay,
    /// Numbers of the linear motor.
    Base,
    /// Dry friction.
    DryFriction,
    /// What joins rotor and load.
    Train,
}

/// One kind of effect.
#[derive(Debug)]
pub struct Kind {
    /// The effect of the library, whose name the answer takes; the values are those of its first parameters.
    pub effect: &'static Effect,
    /// Two of the same group never hide together.
    pub group: Group,
    /// True if it lives in a tacho, so that the speed cannot come from encoder differences.
    pub needs_tacho: bool,
    /// True if the truth can take a form that resembles the library's but is not it.
    pub has_other_form: bool,
    /// Draws the values.
    pub draw: fn(&mut ChaCha8Rng, &Natural) -> Vec<f64>,
    /// Puts them into the subject. `shape` 0 … 1: in a form that resembles the library's but is not it; `None`: exactly
    /// the library's form.
    pub put: fn(&[f64], Option<f64>, &Natural, &mut Subject),
}

impl Kind {
    /// A kind of a group of its own, in the library's form alone, that any sensor of the speed may see.
    const fn new(
        effect: &'static Effect,
        draw: fn(&mut ChaCha8Rng, &Natural) -> Vec<f64>,
        put: fn(&[f64], Option<f64>, &Natural, &mut Subject),
    ) -> Self {
        Self { effect, group: Group::Own, needs_tacho: false, has_other_form: false, draw, put }
    }

    const fn of(mut self, group: Group) -> Self {
        self.group = group;
        self
    }

    const fn behind_tacho(mut self) -> Self {
        self.needs_tacho = true;
        self
    }

    const fn in_other_forms(mut self) -> Self {
        self.has_other_form = true;
        self
    }

    /// True if the two never hide together.
    pub fn excludes(&self, other: &Kind) -> bool {
        let one_group = self.group == other.group && self.group != Group::Own;
        self.effect == other.effect || one_group || self.is_inseparable_from(other)
    }

    /// Whether the two are one effect under another name, exactly: an offset moves both edges of a dead zone, a constant
    /// torque adds to friction in one direction and subtracts in the other, and uneven viscous friction holds a wrong even
    /// one.
    fn is_inseparable_from(&self, other: &Kind) -> bool {
        let holds = |a: &Effect, b: &Effect| a.relations.inseparable_from.contains(&b);
        holds(self.effect, other.effect) || holds(other.effect, self.effect)
    }
}

/// A hidden effect.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// What.
    pub kind: &'static Kind,
    /// Its parameters.
    pub values: Vec<f64>,
    /// See [`Kind::put`].
    pub shape: Option<f64>,
}

impl Hidden {
    /// Puts the effect into the subject.
    pub fn put_into(&self, natural: &Natural, subject: &mut Subject) {
        (self.kind.put)(&self.values, self.shape, natural, subject);
    }

    /// The values with the names of their parameters.
    pub fn named_values(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let names = self.kind.effect.parameters.iter().map(|parameter| parameter.name);
        names.zip(self.values.iter().copied())
    }

    /// True if the truth has the library's form.
    pub fn form_in_library(&self) -> bool {
        self.shape.is_none()
    }
}

fn sign(rng: &mut ChaCha8Rng) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

/// A ratio that no tolerance covers: beyond 4.5 of them, up to a factor of 2.
fn wrong_ratio(rng: &mut ChaCha8Rng, natural: &Natural) -> Vec<f64> {
    let size = rng.random_range((4.5 * natural.tolerance).ln_1p()..2.0_f64.ln());
    vec![(sign(rng) * size).exp()]
}

/// Two magnitudes that differ by 25 to 60 %.
fn unequal(rng: &mut ChaCha8Rng, value: f64) -> Vec<f64> {
    let other = value * rng.random_range(0.4..0.75);
    if rng.random_bool(0.5) { vec![value, other] } else { vec![other, value] }
}

/// Chooses so many effects, none of which excludes another.
pub(super) fn choose(number: usize, rng: &mut ChaCha8Rng, natural: &Natural) -> Vec<Hidden> {
    let mut chosen: Vec<Hidden> = Vec::new();
    while chosen.len() < number {
        let kind = any(rng);
        let values = (kind.draw)(rng, natural);
        let shape = rng.random_bool(0.5).then(|| rng.random_range(0.0..1.0));
        if !chosen.iter().any(|other| other.kind.excludes(kind)) {
            let shape = shape.filter(|_| kind.has_other_form);
            chosen.push(Hidden { kind, values, shape });
        }
    }
    chosen
}

/// One of [`KINDS`], each as probable as any other. A later kind takes its share of the cases (reservoir sampling, Vitter, ACM
/// Trans. Math. Software 11, 1985) by a stream of random numbers of its own; every other case of a seed stays what it was.
fn any(rng: &mut ChaCha8Rng) -> &'static Kind {
    let first = KINDS[rng.random_range(0..FIRST_KINDS)];
    let takes = |place: &usize| {
        let mut own = rng.clone();
        own.set_stream(*place as u64);
        own.random_range(0..=*place) == 0
    };
    let taker = (FIRST_KINDS..KINDS.len()).rev().find(takes);
    taker.map_or(first, |place| KINDS[place])
}

/// Kinds from which the cases were drawn at first.
const FIRST_KINDS: usize = 33;

/// Every effect that can hide. A seed draws by the place in this list: a new kind goes to its end.
pub static KINDS: &[&Kind] = &[
    &drive::DEAD_ZONE,
    &drive::DEAD_ZONE_ASYMMETRIC,
    &drive::VOLTAGE_SATURATION,
    &drive::DRIVE_GAIN,
    &drive::VOLTAGE_OFFSET,
    &drive::TRANSPORT_DELAY,
    &drive::ACTUATOR_LAG,
    &drive::VOLTAGE_DROP,
    &drive::SUPPLY_SAG,
    &drive::CURRENT_LIMIT,
    &motor::RESISTANCE,
    &motor::MOTOR_GAIN,
    &motor::INERTIA,
    &motor::VISCOUS_FRICTION,
    &motor::THERMAL_RESISTANCE,
    &motor::KT_SATURATION,
    &friction::COULOMB_FRICTION,
    &friction::COULOMB_ASYMMETRIC,
    &friction::STRIBECK_FRICTION,
    &friction::LOAD_DEPENDENT_FRICTION,
    &friction::VISCOUS_ASYMMETRIC,
    &friction::QUADRATIC_DRAG,
    &load::CONSTANT_LOAD,
    &load::GRAVITY,
    &load::COGGING,
    &load::PERIODIC_LOAD,
    &load::BACKLASH,
    &load::FLEXIBLE_COUPLING,
    &sensor::ENCODER_SCALE,
    &sensor::SPEED_SATURATION,
    &sensor::SENSOR_LAG,
    &sensor::SENSOR_RECTIFIED,
    &sensor::SENSOR_OFFSET,
    &load::TORSIONAL_SPRING,
];
