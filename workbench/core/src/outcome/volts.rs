//! How a torque is told that the model does not know as one: as the voltage at the terminals and the acceleration that stand for it. So
//! is a current that it does not know.

use crate::outcome::{NamedEffect, Value};

/// The unit that a voltage replaces.
pub const TORQUE: &str = "N m";
/// The same of a current: the winding of a first-order model has 1 Ω.
pub const CURRENT: &str = "A";
/// The unit that an acceleration has.
pub const ACCELERATION: &str = "rad/s²";

/// The acceleration that stands for a torque of an effect, by the name of its voltage.
pub fn acceleration<'a>(effect: &'a NamedEffect, voltage: &str) -> Option<&'a Value> {
    effect.derived.get(&acceleration_key(torque(effect, voltage)?.0))
}

/// The torque for which a voltage stands.
pub fn torque<'a>(effect: &'a NamedEffect, voltage: &str) -> Option<(&'a String, &'a Value)> {
    let mut torques = effect.parameters.iter().filter(|(_, torque)| torque.unit.contains(TORQUE));
    torques.find(|(name, _)| key(name) == voltage)
}

/// The voltage that stands for a parameter of an effect, with its name.
pub fn of<'a>(effect: &'a NamedEffect, name: &str) -> Option<(&'a String, &'a Value)> {
    let unit = &effect.parameters.get(name)?.unit;
    effect.derived.get_key_value(&key(name)).filter(|_| unit.contains(TORQUE) || unit == CURRENT)
}

/// `_nm` reads `_rad_s2`.
pub fn acceleration_key(name: &str) -> String {
    name.replace("_nm", "_rad_s2")
}

/// `_nm` reads `_v`, and so does a last `_a`.
pub fn key(name: &str) -> String {
    let bare = name.strip_suffix("_a").unwrap_or(name);
    if name.contains("_nm") { name.replace("_nm", "_v") } else { format!("{bare}_v") }
}

/// `N m s/rad` reads `V s/rad`.
pub fn unit(torque: &str) -> String {
    torque.replace(TORQUE, "V")
}
