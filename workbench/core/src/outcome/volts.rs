//! How a torque is told that the model does not know as one: as the voltage at the terminals and the acceleration that stand for it. So
//! is a current that it does not know.

use crate::outcome::{NamedEffect, Value};

/// The unit that a voltage replaces.
pub const TORQUE: &str = "N m";
/// The same of a current: the winding of a first-order model has 1 Ω.
const CURRENT: &str = "A";
/// The same of a rise by a power.
const PER_POWER: &str = "1/W";
/// What the winding of a first-order model tells as a voltage.
pub const ELECTRICAL: [&str; 2] = [CURRENT, PER_POWER];
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
    effect
        .derived
        .get_key_value(&key(name))
        .filter(|_| unit.contains(TORQUE) || ELECTRICAL.contains(&&**unit))
}

/// `_nm` reads `_rad_s2`.
pub fn acceleration_key(name: &str) -> String {
    name.replace("_nm", "_rad_s2")
}

/// `_nm` reads `_v`, and so does a last `_a`; a last `_w` reads `_v2`.
pub fn key(name: &str) -> String {
    match (name.strip_suffix("_a"), name.strip_suffix("_w")) {
        (_, Some(power)) => format!("{power}_v2"),
        _ if name.contains("_nm") => name.replace("_nm", "_v"),
        (current, _) => format!("{}_v", current.unwrap_or(name)),
    }
}

/// `N m s/rad` reads `V s/rad`, `A` reads `V`, and `1/W` reads `1/V²`.
pub fn unit(unit: &str) -> String {
    match unit {
        CURRENT => "V".into(),
        PER_POWER => "1/V²".into(),
        _ => unit.replace(TORQUE, "V"),
    }
}
