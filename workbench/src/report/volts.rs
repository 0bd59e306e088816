//! Torques of a model that has no torque constant. A first-order model stands for a motor of 1 Ω, so its torques are no
//! torques; a torque times R/Kt, here times the gain, is a voltage at the terminals, and a torque over the inertia, here that voltage
//! times the gain over the time constant, is an acceleration. Those two are what people are told.

use crate::outcome::{NamedEffect, Shift, Value};
use crate::system::model::{Kind, Model};

/// The parameter that turns a torque of a motor of 1 Ω into a voltage.
const GAIN: &str = "gain_rad_s_per_v";
/// The unit that a voltage replaces.
const TORQUE: &str = "N m";

/// The parameter that turns the voltage into an acceleration.
const TIME_CONSTANT: &str = "time_constant_s";
/// The unit that an acceleration has.
const ACCELERATION: &str = "rad/s²";

/// The effects with a voltage beside every parameter that holds a torque, if the model has no torque constant, and an acceleration
/// if the log shows one (`moving`: a table of settled speeds does not). Gain and time constant are those that were fitted together
/// with the effects, not those that the file states.
pub fn told(
    model: &Model,
    moving: bool,
    shifts: &[Shift],
    mut effects: Vec<NamedEffect>,
) -> Vec<NamedEffect> {
    let Kind::FirstOrder { gain_rad_s_per_v, time_constant_s } = model.kind else {
        return effects;
    };
    let shift = |key: &str| {
        let shift = shifts.iter().find(|shift| shift.parameter == key);
        1.0 + shift.map_or(0.0, |it| it.shift_percent) / 100.0
    };
    let volts = gain_rad_s_per_v * shift(GAIN);
    let accelerations = volts * volts / (time_constant_s * shift(TIME_CONSTANT));
    for effect in &mut effects {
        let torques = effect.parameters.iter().filter(|(_, torque)| torque.unit.contains(TORQUE));
        let told = torques.flat_map(|(name, torque)| {
            let pure = moving && torque.unit == TORQUE;
            let acceleration = (acceleration_key(name), scaled(torque, accelerations, ACCELERATION));
            [(key(name), scaled(torque, volts, "V"))].into_iter().chain(pure.then_some(acceleration))
        });
        let told: Vec<(String, Value)> = told.collect();
        let differences = std::mem::take(&mut effect.derived).into_iter().map(|(name, figure)| match figure
            .unit
            .contains(TORQUE)
        {
            true => (key(&name), scaled(&figure, volts, "V")),
            false => (name, figure),
        });
        effect.derived = differences.chain(told).collect();
    }
    effects
}

/// The acceleration that stands for a torque of an effect, by the name of its voltage.
pub fn acceleration<'a>(effect: &'a NamedEffect, voltage: &str) -> Option<&'a Value> {
    let torques = effect.parameters.iter().filter(|(_, torque)| torque.unit == TORQUE);
    let name = torques.map(|(name, _)| name).find(|name| key(name) == voltage)?;
    effect.derived.get(&acceleration_key(name))
}

/// `_nm` reads `_rad_s2`.
fn acceleration_key(name: &str) -> String {
    name.replace("_nm", "_rad_s2")
}

/// The voltage that stands for a parameter of an effect, with its name.
pub fn of<'a>(effect: &'a NamedEffect, name: &str) -> Option<(&'a String, &'a Value)> {
    let torque = effect.parameters.get(name)?.unit.contains(TORQUE);
    effect.derived.get_key_value(&key(name)).filter(|_| torque)
}

/// `_nm` reads `_v`.
fn key(name: &str) -> String {
    if name.contains("_nm") { name.replace("_nm", "_v") } else { format!("{name}_v") }
}

fn scaled(torque: &Value, factor: f64, unit: &str) -> Value {
    Value {
        value: torque.value * factor,
        std: torque.std.map(|std| std * factor),
        unit: torque.unit.replace(TORQUE, unit),
    }
}
