//! The library of effects: every published name is there, every entry is complete, and each one acts on the plant.

use servo::axis::Bridge;
use truing::system::effects::{self, Effect, Forms, LIBRARY, Scale, Starts, Steady};
use truing::system::plant::Motor;
use truing::system::plant::physics::Physics;

/// The names that stay, whatever is added.
const PUBLISHED: &[&str] = &[
    "dead_zone",
    "dead_zone_asymmetric",
    "voltage_saturation",
    "drive_gain",
    "voltage_offset",
    "transport_delay",
    "actuator_lag",
    "voltage_drop",
    "supply_sag",
    "current_limit",
    "resistance",
    "motor_gain",
    "inertia",
    "viscous_friction",
    "thermal_resistance",
    "kt_saturation",
    "coulomb_friction",
    "coulomb_asymmetric",
    "stribeck_friction",
    "load_dependent_friction",
    "viscous_asymmetric",
    "quadratic_drag",
    "constant_load",
    "gravity",
    "cogging",
    "periodic_load",
    "backlash",
    "flexible_coupling",
    "encoder_scale",
    "speed_saturation",
    "sensor_lag",
    "sensor_rectified",
    "sensor_offset",
    "voltage_saturation_asymmetric",
    "torsional_spring",
];

#[test]
fn every_published_name_is_there() {
    for name in PUBLISHED {
        assert!(effects::find(name).is_some(), "{name} is missing");
    }
    for (alias, name) in
        [("coulomb", "coulomb_friction"), ("stribeck", "stribeck_friction"), ("gravity_arm", "gravity")]
    {
        assert_eq!(effects::find(alias).unwrap().name, name);
    }
}

#[test]
fn every_effect_is_complete() {
    for effect in LIBRARY {
        let name = effect.name;
        for text in [effect.summary, effect.equation, effect.source, effect.signature, effect.separated_by] {
            assert!(text.len() > 3, "{name}: an empty text");
        }
        assert!(!effect.confusable_with.contains(effect), "{name} is itself");
        for parameter in effect.parameters {
            assert!(parameter.lower < parameter.upper, "{name} {}: bounds", parameter.name);
        }
        if let Some(steady) = effect.steady() {
            complete_in_tables(effect, steady);
        }
    }
}

/// In which form an effect is tried on a table of settled speeds.
fn complete_in_tables(effect: &Effect, steady: &Steady) {
    if let Forms::FromRest(pinned) = steady.forms {
        assert_eq!(pinned.len(), effect.parameters.len(), "{effect:?}");
    }
}

#[test]
fn every_effect_that_records_may_name_has_starts() {
    for effect in LIBRARY.iter().filter(|effect| effect.on_records()) {
        assert!(!matches!(effect.starts, Starts::Grid([])), "{effect:?}");
    }
}

/// A 12 V motor driven to and fro, its reading every 2 ms, simulated in so many steps.
fn readings(plant: Physics, steps: usize) -> Vec<f64> {
    let mut motor = Motor::new(plant, 4096.0);
    let volts = |k: usize| [3.0, -9.0, 12.0, -1.0][k / 100 % 4];
    let read = |k: usize| {
        let readings =
            (0..steps).map(|_| motor.step(volts(k), Bridge::Driven, 2e-3 / steps as f64).omega_rad_s);
        readings.last().expect("at least one step")
    };
    (0..400).map(read).collect()
}

/// Steps of the simulation in a reading: as many as the final fits take.
const STEPS: usize = 5;

fn base() -> Physics {
    let mut base = Physics::linear_motor(1.5, 0.001, 0.05, 0.05, 1.2e-4, 3e-5);
    base.supply_v = 12.0;
    base.encoder_at_load = true;
    base
}

/// The motor with an effect of middle size.
fn with_effect(effect: &effects::Effect) -> Physics {
    // One natural unit of each scale of this motor.
    let unit = |scale: Scale| match scale {
        Scale::Input => 12.0,
        Scale::Torque => 0.4,
        Scale::Speed => 230.0,
        Scale::Time => 0.07,
        Scale::Current => 8.0,
        Scale::Resistance => 1.5,
        Scale::Viscous => 0.4 / 230.0,
        Scale::Drag => 0.4 / 230.0 / 230.0,
        Scale::Angle => 16.0,
        Scale::Frequency => 14.0,
        Scale::PerPower => 0.01,
        Scale::Stiffness => 0.025,
        Scale::Capacity => 0.07 / 1.5,
        Scale::TorquePerAngle(power) => 0.4 / 16.0_f64.powi(power.into()),
        Scale::One => 1.0,
    };
    let middle = |p: &effects::Parameter| match p.name {
        "periods_per_rev" => 7.0,
        "load_share" => 0.3,
        _ if p.scale == Scale::Stiffness => 3.0,
        _ => (p.lower.max(0.0) + 0.2 * (p.upper.min(3.0) - p.lower.max(0.0))) * unit(p.scale),
    };
    let values: Vec<f64> = effect.parameters.iter().map(middle).collect();
    let mut plant = base();
    (effect.apply)(&values, &mut plant);
    plant
}

#[test]
fn the_integrators_own_error_is_small_beside_every_effect() {
    let without = readings(base(), STEPS);
    for effect in LIBRARY {
        let (with, finer) = (readings(with_effect(effect), STEPS), readings(with_effect(effect), 8 * STEPS));
        let off = |other: &[f64]| {
            let square: f64 = with.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
            square.sqrt()
        };
        let share = off(&finer) / off(&without);
        // Teeth that meet and a ringing spring are the hardest; what is left of a weakening magnet and of a limit is the
        // moment of a jump inside a step.
        let allowed = match effect.name {
            "backlash" => 0.03,
            "flexible_coupling" => 0.02,
            _ => 1e-3,
        };
        assert!(share < allowed && share > 0.0, "{}: {share:.1e}", effect.name);
    }
}

#[test]
fn every_effect_changes_the_reading() {
    let without = readings(base(), STEPS);
    for effect in LIBRARY {
        let with = readings(with_effect(effect), STEPS);
        let change = with.iter().zip(&without).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(change > 0.5 && change.is_finite(), "{} changes the reading by {change} rad/s", effect.name);
    }
}
