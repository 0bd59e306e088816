//! Free play between motor and load. `load_share` 0 is the massless play operator; above it the load's inertia
//! moves freely inside the gap and is caught at its ends: inelastically, or within `contact_s` by teeth that give way.

use super::*;

/// A contact shorter than this part of the time constant is inelastic. Chosen by judgement; not studied.
const SHORTEST: f64 = 2e-3;

/// Gaps from which a fit of the massless play begins. Chosen by judgement; not studied.
const GAPS: [f64; 8] = [0.002, 0.006, 0.015, 0.03, 0.06, 0.12, 0.25, 0.55];
/// The same beside a load with inertia. The teeth meet at moments that depend on the gap and on how far they throw
/// the load back, and a fit finds its way only from a start that puts them within the width of a shock. Steps of 1.3;
/// chosen by judgement.
const GAPS_OF_LOAD: [f64; 20] = [
    0.005, 0.0065, 0.0085, 0.011, 0.014, 0.019, 0.024, 0.031, 0.041, 0.053, 0.069, 0.09, 0.12, 0.15, 0.2,
    0.26, 0.33, 0.43, 0.56, 0.73,
];
/// Share and damping of the loads that are tried with each of those gaps. Chosen by judgement; not studied.
const LOADS: [[f64; 2]; 3] = [[0.3, 0.9], [0.3, 0.5], [0.55, 0.5]];
const COUNT: usize = GAPS.len() + GAPS_OF_LOAD.len() * LOADS.len();
/// Gap, share of the load, time of a contact and its damping.
static ROWS: [[f64; 4]; COUNT] = {
    let mut rows = [[0.0; 4]; COUNT];
    let mut row = 0;
    while row < COUNT {
        rows[row] = match row.checked_sub(GAPS.len()) {
            None => [GAPS[row], 0.0, 0.0, 1.0],
            Some(place) => {
                let [share, damping] = LOADS[place % LOADS.len()];
                [GAPS_OF_LOAD[place / LOADS.len()], share, 0.006, damping]
            }
        };
        row += 1;
    }
    rows
};
static STARTS: [&[f64]; COUNT] = {
    let mut starts: [&[f64]; COUNT] = [&[]; COUNT];
    let mut row = 0;
    while row < COUNT {
        starts[row] = &ROWS[row];
        row += 1;
    }
    starts
};

/// The effect.
pub static BACKLASH: Effect = Effect {
    name: "backlash",
    summary: "free play between motor and load",
    equation: "θ_load stays within θ_motor ± gap/2; contact is inelastic, or k·x + c·ẋ at penetration x with k = Jᵣ/contact_s², c = 2·contact_damping·Jᵣ/contact_s, Jᵣ = J·share·(1 − share)",
    source: "Nordin, Gutman: Controlling mechanical systems with backlash, a survey, Automatica 38(10), 2002",
    signature: "residual only after reversals",
    confusable_with: &[&TRANSPORT_DELAY, &DEAD_ZONE, &FLEXIBLE_COUPLING],
    separated_by: "square reversals with small amplitude",
    parameters: &[
        Parameter::new("gap_rad", "rad", Scale::Angle, 0.0, 3.0),
        Parameter::new("load_share", "1", Scale::One, 0.0, 0.95).optional(0.0).unknown_on_chip(),
        Parameter::new("contact_s", "s", Scale::Time, 0.0, 0.05).optional(0.0).unknown_on_chip(),
        Parameter::new("contact_damping", "1", Scale::One, 0.05, 3.0).optional(1.0),
    ],
    starts: Starts::Rugged(&STARTS, &[0.12, 0.2, 0.25, 0.25]),
    family: Family::Coupling,
    form: Form::Rich,
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.gap_rad += p[0];
        plant.load_share = plant.load_share.max(p[1]);
        if p[1] > 0.0 && p[2] > SHORTEST * plant.time_constant_s() {
            plant.contact_rad_s = 1.0 / p[2];
            plant.contact_damping = p[3];
        }
    },
    ..Effect::USUAL
};
