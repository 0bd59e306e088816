//! Torques of a model that has no torque constant. A first-order model stands for a motor of 1 Ω, so its torques are no
//! torques; a torque times R/Kt, here times the gain, is a voltage at the terminals, and that is what people are told.

use crate::outcome::{NamedEffect, Shift, Value};
use crate::system::model::{Kind, Model};

/// The parameter that turns a torque of a motor of 1 Ω into a voltage.
const GAIN: &str = "gain_rad_s_per_v";
/// The unit that a voltage replaces.
const TORQUE: &str = "N m";

/// The effects with a voltage beside every parameter that holds a torque, if the model has no torque constant. The gain is the one
/// that was fitted together with the effects, not the one that the file states.
pub fn told(model: &Model, shifts: &[Shift], mut effects: Vec<NamedEffect>) -> Vec<NamedEffect> {
    let Kind::FirstOrder { gain_rad_s_per_v, .. } = model.kind else {
        return effects;
    };
    let shift = shifts.iter().find(|shift| shift.parameter == GAIN).map_or(0.0, |it| it.shift_percent);
    let gain_rad_s_per_v = gain_rad_s_per_v * (1.0 + shift / 100.0);
    for effect in &mut effects {
        let torques = effect.parameters.iter().filter(|(_, torque)| torque.unit.contains(TORQUE));
        let voltages = torques.map(|(name, torque)| (key(name), voltage(torque, gain_rad_s_per_v)));
        let voltages: Vec<(String, Value)> = voltages.collect();
        let differences = std::mem::take(&mut effect.derived).into_iter().map(|(name, figure)| match figure
            .unit
            .contains(TORQUE)
        {
            true => (key(&name), voltage(&figure, gain_rad_s_per_v)),
            false => (name, figure),
        });
        effect.derived = differences.chain(voltages).collect();
    }
    effects
}

/// The voltage that stands for a parameter of an effect, with its name.
pub fn of<'a>(effect: &'a NamedEffect, name: &str) -> Option<(&'a String, &'a Value)> {
    let torque = effect.parameters.get(name)?.unit.contains(TORQUE);
    effect.derived.get_key_value(&key(name)).filter(|_| torque)
}

/// `_nm` reads `_v`.
fn key(name: &str) -> String {
    match name.contains("_nm") {
        true => name.replace("_nm", "_v"),
        false => format!("{name}_v"),
    }
}

fn voltage(torque: &Value, gain_rad_s_per_v: f64) -> Value {
    Value {
        value: torque.value * gain_rad_s_per_v,
        std: torque.std.map(|std| std * gain_rad_s_per_v),
        unit: torque.unit.replace(TORQUE, "V"),
    }
}
