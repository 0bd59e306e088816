//! The library of physical effects: one file each, and a line here.
//!
//! An effect knows its name, equation, published source, bounded parameters, the values from which a fit starts, the
//! trace it leaves in the residual, what it is confused with, and the experiment that separates them; it says which logs
//! may name it, how a table of settled speeds shows it, and whether the firmware has a number for it. It turns its
//! parameters into [`Physics`](crate::system::plant::physics::Physics); it knows nothing of the search.

use crate::text::input_error::nearest_hint;

mod actuator_lag;
mod backlash;
mod base_parameter;
mod cogging;
mod constant_load;
mod coulomb_asymmetric;
mod coulomb_friction;
mod current_limit;
mod dead_zone;
mod definition;
mod drive_gain;
mod encoder_scale;
mod flexible_coupling;
mod gravity;
mod kt_saturation;
mod load_dependent_friction;
mod periodic_load;
mod quadratic_drag;
mod sensor_lag;
mod sensor_offset;
mod sensor_rectified;
mod speed_saturation;
mod stribeck_friction;
mod supply_sag;
mod thermal_resistance;
mod torsional_spring;
mod transport_delay;
mod viscous_asymmetric;
mod voltage_drop;
mod voltage_offset;
mod voltage_saturation;

pub use definition::*;

/// Makes every effect public under its own name, and puts it into the library.
macro_rules! library {
    ($($file:ident::$name:ident,)*) => {
        $(pub use $file::$name;)*

        /// Every effect. The order is the order of the plant: input, winding, friction, torques, load, sensor.
        pub static LIBRARY: &[&Effect] = &[$(&$name),*];
    };
}

library! {
    dead_zone::DEAD_ZONE,
    dead_zone::DEAD_ZONE_ASYMMETRIC,
    voltage_saturation::VOLTAGE_SATURATION,
    voltage_saturation::VOLTAGE_SATURATION_ASYMMETRIC,
    drive_gain::DRIVE_GAIN,
    voltage_offset::VOLTAGE_OFFSET,
    transport_delay::TRANSPORT_DELAY,
    actuator_lag::ACTUATOR_LAG,
    voltage_drop::VOLTAGE_DROP,
    supply_sag::SUPPLY_SAG,
    current_limit::CURRENT_LIMIT,
    base_parameter::RESISTANCE,
    base_parameter::MOTOR_GAIN,
    base_parameter::INERTIA,
    base_parameter::VISCOUS_FRICTION,
    thermal_resistance::THERMAL_RESISTANCE,
    kt_saturation::KT_SATURATION,
    coulomb_friction::COULOMB_FRICTION,
    coulomb_asymmetric::COULOMB_ASYMMETRIC,
    stribeck_friction::STRIBECK_FRICTION,
    load_dependent_friction::LOAD_DEPENDENT_FRICTION,
    viscous_asymmetric::VISCOUS_ASYMMETRIC,
    quadratic_drag::QUADRATIC_DRAG,
    constant_load::CONSTANT_LOAD,
    gravity::GRAVITY,
    torsional_spring::TORSIONAL_SPRING,
    cogging::COGGING,
    periodic_load::PERIODIC_LOAD,
    backlash::BACKLASH,
    flexible_coupling::FLEXIBLE_COUPLING,
    encoder_scale::ENCODER_SCALE,
    speed_saturation::SPEED_SATURATION,
    sensor_lag::SENSOR_LAG,
    sensor_rectified::SENSOR_RECTIFIED,
    sensor_offset::SENSOR_OFFSET,
}

/// What makes a measured speed late: controllers average the speed that they report over 30 to 220 ms, and send it late.
pub static LAGS: [&Effect; 2] = [&SENSOR_LAG, &TRANSPORT_DELAY];
/// What resists the motion at any speed, in its plain forms.
pub static PLAIN_FRICTIONS: [&Effect; 2] = [&COULOMB_FRICTION, &DEAD_ZONE];
/// What a sensor of the speed does to its reading.
pub static OF_SPEED_SENSOR: [&Effect; 3] = [&SENSOR_OFFSET, &SENSOR_RECTIFIED, &SPEED_SATURATION];
/// What shifts the whole motion to one side: beside a symmetric threshold or friction the same as two different sides.
pub static SHIFTS: [&Effect; 2] = [&VOLTAGE_OFFSET, &CONSTANT_LOAD];
/// A drive that follows its command so late is rare, and an applied voltage that was logged has its lag behind it.
pub static RARE_LAG: &Effect = &ACTUATOR_LAG;

/// The effect of that name. `coulomb`, `stribeck`, `viscous` and `gravity_arm` are read as aliases.
pub fn find(name: &str) -> Option<&'static Effect> {
    match name {
        "coulomb" => Some(&COULOMB_FRICTION),
        "stribeck" => Some(&STRIBECK_FRICTION),
        "viscous" => Some(&VISCOUS_FRICTION),
        "gravity_arm" => Some(&GRAVITY),
        name => LIBRARY.iter().copied().find(|effect| effect.name == name),
    }
}

/// The effect of that name, or a sentence that says which one is near.
pub fn known(name: &str) -> Result<&'static Effect, String> {
    find(name).ok_or_else(|| {
        let near = nearest_hint(name, LIBRARY.iter().map(|effect| effect.name));
        format!("`{name}` is no effect of the library{near}; `truing effects` lists them")
    })
}

/// A parameter's or effect's key on a linear axis: `_nm` reads `_n`, `_rad` reads `_m`.
pub fn linear_key(name: &str) -> String {
    name.replace("_nm", "_n").replace("_rad", "_m")
}

/// A unit on a linear axis.
pub fn linear_unit(unit: &str) -> String {
    unit.replace("N m", "N").replace("rad", "m")
}
