//! Motor and load joined by a spring: two masses.

use super::*;

/// The effect.
pub static FLEXIBLE_COUPLING: Effect = Effect {
    name: "flexible_coupling",
    summary: "motor and load are joined by a spring",
    equation: "T_c = k·(θm − θl) + d·(ωm − ωl); the load has the given share of J",
    source: "Ellis: Control System Design Guide, 4th ed., 2012",
    signature: "ringing at one frequency after each step",
    confusable_with: &[&BACKLASH, &ACTUATOR_LAG, &PERIODIC_LOAD],
    separated_by: "chirp through the resonance, sampled five times faster than it",
    parameters: &[
        Parameter::new("stiffness_nm_per_rad", "N m/rad", Scale::Stiffness, 0.1, 1e6),
        Parameter::new("damping", "N m s/rad", Scale::Viscous, 0.0, 300.0),
        Parameter::new("load_share", "1", Scale::One, 0.02, 0.98),
    ],
    // Lightly damped resonances at 1.3, 3, 4.5, 7 … 100 over the time constant: a fit finds its way only from a frequency that is
    // not a third off.
    starts: Starts::Grid(&[
        &[0.4, 0.06, 0.4],
        &[2.2, 0.14, 0.4],
        &[4.9, 0.22, 0.4],
        &[12.0, 0.34, 0.4],
        &[24.0, 0.48, 0.4],
        &[54.0, 0.72, 0.4],
        &[116.0, 1.1, 0.4],
        &[261.0, 1.6, 0.4],
        &[600.0, 2.4, 0.4],
        &[2400.0, 4.8, 0.4],
        &[10.0, 0.3, 0.7],
        &[47.0, 0.6, 0.7],
        &[230.0, 1.4, 0.7],
        &[6.0, 0.2, 0.15],
        &[29.0, 0.4, 0.15],
        &[140.0, 0.9, 0.15],
    ]),
    family: Family::Coupling,
    form: Form::Rich,
    apply: |p, plant| {
        plant.stiffness = p[0];
        plant.coupling_damping = p[1];
        plant.load_share = p[2];
    },
    ..Effect::USUAL
};
