//! The steady map is the equilibrium of the simulated plant.

use truing::gap::tables::map::sweep;
use truing::system::effects;
use truing::system::plant::Motor;
use truing::system::plant::physics::Physics;

fn motor() -> Physics {
    let mut plant = Physics::linear_motor(1.5, 0.0, 0.05, 0.05, 2e-4, 1e-4);
    plant.supply_v = 12.0;
    plant
}

fn with(names: &[(&str, &[f64])]) -> Physics {
    let mut plant = motor();
    for (name, values) in names {
        (effects::find(name).unwrap().apply)(values, &mut plant);
    }
    plant
}

/// Holds each voltage until the speed has settled.
fn simulated(plant: &Physics, volts: &[f64]) -> Vec<f64> {
    let mut motor = Motor::new(plant.clone(), 4096.0);
    let tau = plant.time_constant_s();
    let mut settle = |u: &f64| {
        (0..3000).map(|_| motor.step(*u, servo::axis::Bridge::Driven, 0.1 * tau).omega_rad_s).last().unwrap()
    };
    volts.iter().map(&mut settle).collect()
}

#[test]
fn every_effect_settles_where_the_simulation_does() {
    let up: Vec<f64> = (-12..=12).map(f64::from).collect();
    let cases: Vec<Vec<(&str, &[f64])>> = vec![
        vec![],
        vec![("dead_zone_asymmetric", &[1.5, 2.2, 0.0])],
        vec![("dead_zone", &[1.5, 0.4])],
        vec![("voltage_saturation", &[6.0, 0.3]), ("drive_gain", &[1.3])],
        vec![("voltage_saturation_asymmetric", &[6.0, 4.0, 0.0])],
        vec![("coulomb_asymmetric", &[0.04, 0.07]), ("voltage_offset", &[0.3])],
        vec![("stribeck_friction", &[0.03, 0.09, 15.0])],
        vec![("stribeck_friction", &[0.03, 0.09, 15.0]), ("quadratic_drag", &[3e-6])],
        vec![("viscous_asymmetric", &[2e-4, 5e-4]), ("constant_load", &[0.05])],
        vec![("quadratic_drag", &[5e-6]), ("voltage_drop", &[0.8]), ("coulomb_friction", &[0.01])],
        vec![("current_limit", &[0.25])],
        vec![("supply_sag", &[0.6, 0.0])],
        vec![("speed_saturation", &[70.0]), ("encoder_scale", &[0.8])],
        vec![("sensor_rectified", &[]), ("sensor_offset", &[2.0])],
    ];
    for case in cases {
        let plant = with(&case);
        let (map, settled) = (sweep(&plant, &up), simulated(&plant, &up));
        for ((u, m), s) in up.iter().zip(&map).zip(&settled) {
            assert!((m - s).abs() < 0.02 + 1e-3 * s.abs(), "{case:?} at {u} V: map {m}, simulated {s}");
        }
    }
}

#[test]
fn friction_with_breakaway_remembers_the_row_before() {
    // Kt/R = 1/30 N m/V: kinetic 0.9 V, breakaway 2.7 V.
    let plant = with(&[("stribeck_friction", &[0.03, 0.09, 5.0])]);
    let up = sweep(&plant, &[1.0, 2.0, 3.0, 2.0, 1.5]);
    assert_eq!(up[..2], [0.0, 0.0]);
    assert!(up[2] > 0.0 && up[3] > 0.0 && up[4] > 0.0, "once turning it goes on below the breakaway: {up:?}");
    assert_eq!(sweep(&plant, &[3.0, -2.0])[1], 0.0, "a reversal starts from rest");
}
