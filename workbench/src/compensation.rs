//! From a model with its effects to what the firmware's compensator and loops take: everything becomes a voltage at the
//! terminals, as the chip sees it.
//!
//! In the order of the plant's input chain, v = gain·u + offset passes the dead zone, then the limit; the current then
//! has to overcome the drop of the bridge, and its torque friction and load. So the terminal voltage at which the shaft
//! is about to move, positive direction, is
//!
//! ```text
//! u₊ = (zone₊ + drop + (friction₊ − load)·R/Kt − offset) / gain        u₋ likewise with load and offset the other way
//! ```
//!
//! and the one beyond which more command brings no more speed is (limit + zone − offset)/gain.

use crate::commission_report::{Kept, Params};
use crate::input_error::InputError;
use crate::model::Model;
use crate::plant::physics::{Drive, Physics};
use servo::config::Config;
use servo::identify::estimate::Mechanism;

/// Effects that become one of the firmware's numbers.
const TAKEN: &[&str] = &[
    "dead_zone",
    "dead_zone_asymmetric",
    "voltage_saturation",
    "voltage_saturation_asymmetric",
    "drive_gain",
    "voltage_offset",
    "voltage_drop",
    "resistance",
    "motor_gain",
    "inertia",
    "viscous_friction",
    "coulomb_friction",
    "coulomb_asymmetric",
    "stribeck_friction",
    "constant_load",
];
/// Half width of the 95 % interval, standard deviations.
const U95: f64 = 1.96;

/// The parameters, and the names of the effects that the firmware has no parameter for.
pub fn from_model(model: &Model, config: &Config) -> Result<(Params, Vec<&'static str>), InputError> {
    check(model, config)?;
    let value = Terminal::of(model);
    let kept = |pick: fn(&Terminal) -> f64| Kept::trusted(pick(&value), uncertainty(model, pick));
    let below_supply = |volts: f64| volts < f64::from(config.supply_nominal_v);
    let params = Params {
        mechanism: value.mechanism,
        dead_zone_pos_v: (value.dead_zone[0] > 0.0).then(|| kept(|terminal| terminal.dead_zone[0])),
        dead_zone_neg_v: (value.dead_zone[1] > 0.0).then(|| kept(|terminal| terminal.dead_zone[1])),
        saturation_pos_v: below_supply(value.saturation[0]).then(|| kept(|terminal| terminal.saturation[0])),
        saturation_neg_v: below_supply(value.saturation[1]).then(|| kept(|terminal| terminal.saturation[1])),
        gain_rad_s_per_v: Some(kept(|terminal| terminal.gain)),
        time_constant_s: Some(kept(|terminal| terminal.time_constant)),
        ..Params::nothing()
    };
    let names = model.known.iter().map(|known| known.effect.name);
    Ok((params, names.filter(|name| !TAKEN.contains(name)).collect()))
}

/// The model must be of the axis that the firmware drives.
fn check(model: &Model, config: &Config) -> Result<(), InputError> {
    let refuse = |what: String| Err(InputError::file(&model.source, what));
    if model.physics().drive != Drive::Voltage || model.linear() {
        return refuse(
            "has no voltage at its input; the firmware drives a motor by its terminal voltage".into(),
        );
    }
    if let Some(encoder) = model.encoder
        && encoder.counts_per_rev != f64::from(config.counts_per_rev)
    {
        let (of_model, of_axis) = (encoder.counts_per_rev, config.counts_per_rev);
        return refuse(format!(
            "encoder.counts_per_rev is {of_model}, the axis file says {of_axis}; make them equal"
        ));
    }
    Ok(())
}

/// What the chip would see of the model.
struct Terminal {
    /// Positive, negative; V, positive magnitudes.
    dead_zone: [f64; 2],
    saturation: [f64; 2],
    /// rad/s/V at the encoder's shaft.
    gain: f64,
    /// s.
    time_constant: f64,
    mechanism: Mechanism,
}

impl Terminal {
    fn of(model: &Model) -> Self {
        let plant = model.physics();
        let load: f64 = model
            .known
            .iter()
            .filter(|known| known.effect.name == "constant_load")
            .map(|known| known.values[0])
            .sum();
        let volts = |torque: f64| torque * plant.resistance / plant.kt;
        let friction = [volts(plant.friction_pos), volts(plant.friction_neg)];
        let zone = [plant.dead_pos, plant.dead_neg];
        let limit = [plant.limit, plant.limit * plant.limit_skew];
        let towards = [1.0, -1.0];
        let side = |side: usize, level: f64| (level - towards[side] * plant.drive_offset) / plant.drive_gain;
        Terminal {
            dead_zone: [0, 1].map(|at| {
                side(
                    at,
                    zone[at] + plant.drop_v + friction[at] - towards[at] * volts(load),
                )
            }),
            saturation: [0, 1].map(|at| side(at, limit[at] + zone[at])),
            gain: plant.drive_gain * plant.dc_gain(),
            time_constant: plant.time_constant_s() + electrical(&plant),
            mechanism: mechanism(zone, friction),
        }
    }
}

/// The sum of the two time constants of winding and inertia exceeds the mechanical one by this.
fn electrical(plant: &Physics) -> f64 {
    plant.inductance * plant.viscous / (plant.resistance * plant.total_damping())
}

/// The one that makes nearly all of it.
fn mechanism(zone: [f64; 2], friction: [f64; 2]) -> Mechanism {
    const MOST: f64 = 0.8;
    let (zone, friction): (f64, f64) = (zone.iter().sum(), friction.iter().sum());
    let all = zone + friction;
    if all <= 0.0 {
        Mechanism::Unclear
    } else if friction >= MOST * all {
        Mechanism::Friction
    } else if zone >= MOST * all {
        Mechanism::InputDeadZone
    } else {
        Mechanism::Unclear
    }
}

/// First-order propagation of what the effects' parameters and the base parameters are known by.
fn uncertainty(model: &Model, pick: fn(&Terminal) -> f64) -> f64 {
    let nominal = pick(&Terminal::of(model));
    let mut variance = 0.0;
    let mut moved = |changed: Model| {
        let change = pick(&Terminal::of(&changed)) - nominal;
        variance += if change.is_finite() { change * change } else { 0.0 };
    };
    for (place, known) in model.known.iter().enumerate() {
        for (index, std) in known.stds.iter().enumerate() {
            let Some(std) = std else { continue };
            let mut changed = model.clone();
            changed.known[place].values[index] += std;
            moved(changed);
        }
    }
    for (key, value) in model.parameters() {
        let mut changed = model.clone();
        changed.set_parameter(key, value * (1.0 + model.tolerance(key)));
        moved(changed);
    }
    U95 * variance.sqrt()
}
