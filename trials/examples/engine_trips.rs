//! Draws the round trips of `cargo xtask engines --back`: motors in which one effect of the library hides, for an engine to make the logs.
//!
//! `engine_trips FOLDER [CASES [FIRST]]`, that many of each effect. Cases are singles of the naming evaluation (docs/naming.md), evaluation
//! seeds from the first on. Taken is what the exported file can play: the effect in the form of the library, a tacho and white noise; and
//! what is judged there: an effect visible beyond 0.3 σ. No file opens the bridge, so coast-downs are driven with 0 V; what they would tell, the
//! current tells, which an engine has always: its torque over the torque constant.
//!
//! Each folder gets `nominal.toml`, the model file of the case; `extended.toml`, the motor's own numbers and the effect; the inputs
//! `log_input.csv` and `holdout_input.csv`; and `trip.toml`, which tells what an engine's log needs beside them.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use trials::naming::group;
use truing::synthetic::cases::base::Claim;
use truing::synthetic::cases::sheet::Sheet;
use truing::synthetic::cases::{Case, Set, Spec, draw};
use truing::synthetic::reference_plant::{Motor, Train};
use truing::system::effects::{BACKLASH, LIBRARY, VOLTAGE_SATURATION, VOLTAGE_SATURATION_ASYMMETRIC};

/// Smallest visibility of an effect that is judged, σ: that of docs/naming.md.
const VISIBLE: f64 = 0.3;

/// A case with the effect that is exported.
struct Trip {
    case: Case,
    effect: &'static str,
    parameters: BTreeMap<&'static str, f64>,
}

/// True for what an engine can play and the evaluation judges.
fn is_taken(case: &Case) -> bool {
    let hidden = &case.answer.hidden[0];
    hidden.form_in_library && hidden.visibility > VISIBLE && case.model.contains("speed = \"analog_tacho\"")
}

/// The trip of a case. Limits that differ are offered for tables alone, so no case hides them; one of two cases with a limit lends its motor: the
/// smaller limit is 0.4 to 0.75 of the other, as that of every uneven effect.
fn trip(case: Case, found: &BTreeMap<&str, Vec<Trip>>) -> Trip {
    let hidden = &case.answer.hidden[0];
    let (mut effect, mut parameters) = (hidden.name, hidden.parameters.clone());
    let count = |effect: &str| found.get(effect).map_or(0, Vec::len);
    let uneven = VOLTAGE_SATURATION_ASYMMETRIC.name;
    if effect == VOLTAGE_SATURATION.name && count(uneven) < count(effect) {
        let [pos, neg, softness] = VOLTAGE_SATURATION_ASYMMETRIC.parameters else {
            unreachable!("its three parameters")
        };
        let [limit, soft] = VOLTAGE_SATURATION.parameters else { unreachable!("its two parameters") };
        let (limit, soft) = (parameters[limit.name], parameters[soft.name]);
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(case.answer.seed));
        let smaller = limit * rng.random_range(0.4..0.75);
        let (forward, backward) = if rng.random_bool(0.5) { (limit, smaller) } else { (smaller, limit) };
        effect = uneven;
        parameters = BTreeMap::from([(pos.name, forward), (neg.name, backward), (softness.name, soft)]);
    }
    parameters.extend(teeth(&case.rig.subject.motor));
    Trip { case, effect, parameters }
}

/// How far the teeth of a play give way; the answer of a case tells the gap and the share of the load alone.
fn teeth(motor: &Motor) -> Vec<(&'static str, f64)> {
    let Train::Play { split, stiffness, damping, .. } = motor.train else { return Vec::new() };
    let [_, _, time, ratio] = BACKLASH.parameters else { unreachable!("its four parameters") };
    let reduced = motor.inertia * split.inertia * (1.0 - split.inertia);
    let contact_s = (reduced / stiffness).sqrt();
    vec![(time.name, contact_s), (ratio.name, damping * contact_s / (2.0 * reduced))]
}

/// The model file with the motor's own numbers and the effect: what is exported.
fn extended(trip: &Trip) -> String {
    let Claim { R_ohm, L_h, K_nm_per_a, J_kgm2, b_nms_per_rad } = trip.case.answer.base;
    let own = [
        ("R_ohm", R_ohm),
        ("L_h", L_h),
        ("Kt_nm_per_a", K_nm_per_a),
        ("Ke_vs_per_rad", K_nm_per_a),
        ("J_kgm2", J_kgm2),
        ("b_nms_per_rad", b_nms_per_rad),
    ];
    let mut text = String::new();
    for line in trip.case.model.lines() {
        let number = own.iter().find(|(key, _)| line.split(" = ").next() == Some(key));
        let _ = match number {
            Some((key, value)) => writeln!(text, "{key} = {value:?}"),
            None => writeln!(text, "{line}"),
        };
    }
    let _ = writeln!(text, "[known.{}]", trip.effect);
    for (name, value) in &trip.parameters {
        let _ = writeln!(text, "{name} = {value:?}");
    }
    text
}

/// What an engine's log needs beside the input.
fn described(trip: &Trip) -> String {
    let (answer, rig) = (&trip.case.answer, &trip.case.rig);
    let right: Vec<&str> =
        LIBRARY.iter().map(|effect| effect.name).filter(|name| group(name) == group(trip.effect)).collect();
    format!(
        "seed = {}\neffect = \"{}\"\nright = {right:?}\nvisibility = {:?}\ntolerance = {:?}\nsigma_rad_s = {:?}\n\
         current_sigma_a = {:?}\nconstant_nm_per_a = {:?}\ninterval_s = {:?}\ncounts_per_rev = {}\nvolts = {:?}\n\
         settled_s = {:?}\ntable = {}\n",
        answer.seed,
        trip.effect,
        answer.hidden[0].visibility,
        answer.tolerance,
        rig.sensors.sigma,
        rig.sensors.current.unwrap_or_default(),
        rig.subject.motor.torque_constant,
        rig.sensors.interval_s,
        rig.sensors.counts_per_rev,
        rig.natural.volts,
        8.0 * rig.natural.tau,
        trip.effect == VOLTAGE_SATURATION_ASYMMETRIC.name,
    )
}

fn input(record: &Sheet) -> String {
    let mut sheet = Sheet::default();
    for name in ["t_s", "u_v"] {
        sheet.add(name, record.column(name).to_vec());
    }
    sheet.to_csv()
}

fn write(trip: &Trip, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("nominal.toml"), &trip.case.model)?;
    std::fs::write(folder.join("extended.toml"), extended(trip))?;
    std::fs::write(folder.join("trip.toml"), described(trip))?;
    std::fs::write(folder.join("log_input.csv"), input(&trip.case.log))?;
    std::fs::write(folder.join("holdout_input.csv"), input(&trip.case.holdout))
}

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let folder = Path::new(arguments.get(1).map_or("target/engines/trips", String::as_str));
    let cases = arguments.get(2).and_then(|count| count.parse().ok()).unwrap_or(2);
    let first = arguments.get(3).and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let spec = Spec { dirty: Some(false), current: Some(true), evaluation: true, ..Spec::new(Set::Single) };
    let mut found: BTreeMap<&str, Vec<Trip>> = BTreeMap::new();
    let mut missing = cases * LIBRARY.len();
    for case in (first..).map(|seed| draw(&spec, seed)).filter(is_taken) {
        let trip = trip(case, &found);
        let others = found.entry(trip.effect).or_default();
        if others.len() < cases {
            write(&trip, &folder.join(format!("{}_{}", trip.effect, others.len() + 1)))?;
            others.push(trip);
            missing -= 1;
        }
        if missing == 0 {
            break;
        }
    }
    Ok(())
}
