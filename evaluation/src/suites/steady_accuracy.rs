//! Accuracy of steady-state tables on random motors: `cargo run -p evaluation -- steady-accuracy [TABLES] [SEED]`.
//!
//! Each table draws a motor, base errors N(0, 5 %) cut at two, noise of 0.1–1 % of the largest speed, 20–60 voltages in one
//! or both directions, and no effect, one, or two. Speeds come from closed forms written here, not from the library's map.
//! Seeds below 1,000,000 are for design; evaluate with others.

use evaluation::Results;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use std::collections::BTreeMap;
use truing::outcome::{Outcome, Verdict};
use truing::system::effects::{
    DEAD_ZONE, DEAD_ZONE_ASYMMETRIC, DRIVE_GAIN, Effect, VOLTAGE_OFFSET, VOLTAGE_SATURATION,
};
use truing::system::log::Table;

/// What was drawn.
struct Case {
    kind: &'static str,
    hidden: Vec<&'static Effect>,
    truth: Option<(&'static Effect, &'static str, f64)>,
    model: String,
    table: Table,
}

const KINDS: [&str; 8] =
    ["nothing", "gain", "dead_zone", "asymmetric", "saturation", "offset", "zone+limit", "gain+limit"];

fn draw(seed: u64) -> Case {
    let mut r = ChaCha8Rng::seed_from_u64(seed);
    let kind = KINDS[(seed % KINDS.len() as u64) as usize];
    let (resistance, k): (f64, f64) = (r.random_range(0.6..8.0), r.random_range(0.015..0.12));
    let damping = r.random_range(0.02..0.4) * k * k / resistance;
    let top = [6.0, 12.0, 24.0][r.random_range(0..3)];
    let gain = k / (resistance * damping + k * k);
    let both = kind == "asymmetric" || r.random_bool(0.5);
    let rows = r.random_range(20..60);
    let from = if both { -top } else { 0.05 * top };
    let volts: Vec<f64> =
        (0..rows).map(|i| from + (top - from) * f64::from(i) / f64::from(rows - 1)).collect();
    let scale = match r.random_bool(0.5) {
        true => r.random_range(1.4..2.5),
        false => r.random_range(0.4..0.7),
    };
    let scale: f64 = if kind.starts_with("gain") { scale } else { 1.0 };
    let zone = r.random_range(0.08..0.25) * top;
    let other = if kind == "asymmetric" { zone * r.random_range(0.3..0.7) } else { zone };
    let limit = r.random_range(0.45..0.75) * top;
    let offset = r.random_range(0.03..0.1) * top;
    let has = |name: &str| kind.contains(name);
    let dead = has("zone") || has("asymmetric");
    let shaft = |u: f64| {
        let mut v = scale * u + if has("offset") { offset } else { 0.0 };
        if dead {
            v = if v > 0.0 { (v - zone).max(0.0) } else { (v + other).min(0.0) };
        }
        let clamp = if has("saturation") || has("limit") { scale * limit } else { f64::INFINITY };
        gain * v.min(clamp).max(-clamp)
    };
    let clean: Vec<f64> = volts.iter().map(|u| shaft(*u)).collect();
    let largest = clean.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
    let noise = Normal::new(0.0, largest * 10f64.powf(r.random_range(-3.0..-2.0))).unwrap();
    let speed = clean.iter().map(|w| if *w == 0.0 { 0.0 } else { w + noise.sample(&mut r) }).collect();
    let mut claimed =
        |x: f64| x * (1.0 + 0.05 * Normal::new(0.0, 1.0_f64).unwrap().sample(&mut r).clamp(-2.0, 2.0));
    let model = format!(
        "schema = \"truing-model/1\"\n[motor]\nR_ohm = {}\nKt_nm_per_a = {k}\nKe_vs_per_rad = {k}\nJ_kgm2 = 1e-4\nb_nms_per_rad = {}\n",
        claimed(resistance),
        claimed(damping)
    );
    let (hidden, truth): (Vec<&Effect>, _) = match kind {
        "gain" => (vec![&DRIVE_GAIN], Some((&DRIVE_GAIN, "ratio", scale))),
        "dead_zone" => (vec![&DEAD_ZONE], Some((&DEAD_ZONE, "half_width_v", zone))),
        "asymmetric" => (vec![&DEAD_ZONE_ASYMMETRIC], Some((&DEAD_ZONE_ASYMMETRIC, "neg_v", other))),
        "saturation" => (vec![&VOLTAGE_SATURATION], Some((&VOLTAGE_SATURATION, "limit_v", limit))),
        "offset" => (vec![&VOLTAGE_OFFSET], Some((&VOLTAGE_OFFSET, "offset_v", offset))),
        "zone+limit" => (vec![&DEAD_ZONE, &VOLTAGE_SATURATION], Some((&DEAD_ZONE, "half_width_v", zone))),
        "gain+limit" => (vec![&DRIVE_GAIN, &VOLTAGE_SATURATION], Some((&DRIVE_GAIN, "ratio", scale))),
        _ => (vec![], None),
    };
    let table = Table {
        source: format!("seed {seed}"),
        u_v: volts,
        omega_rad_s: speed,
        speed_unit_rad_s: 1.0,
        names: Default::default(),
    };
    Case { kind, hidden, truth, model, table }
}

/// Whether every hidden name is named or among the rivals of a named one, and nothing else is named.
fn right(case: &Case, outcome: &Outcome) -> (bool, bool) {
    let covers = |index: Option<usize>, name: &str| {
        index.is_some_and(|t| outcome.ties[t].rivals.iter().any(|r| r.len() == 1 && r[0] == name))
    };
    let found = |hidden: &&Effect| {
        outcome.effects.iter().any(|e| e.name == hidden.name || covers(e.tie, hidden.name))
    };
    let all = case.hidden.iter().all(found);
    (all, all && outcome.effects.len() == case.hidden.len())
}

/// Accuracy of steady-state tables on random motors.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// How many tables.
    #[arg(default_value_t = 160)]
    tables: u64,
    /// First seed.
    #[arg(default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    results: Results,
}

pub fn run(arguments: Arguments) {
    let (tables, first) = (arguments.tables, arguments.seed);
    let mut page = arguments.results.page();
    let results: Vec<(Case, Outcome)> = (first..first + tables)
        .into_par_iter()
        .map(|seed| {
            let case = draw(seed);
            let model = truing::system::model::parse("drawn", &case.model).unwrap();
            let outcome = truing::gap::tables::run(&model, &case.table, &[], &[]);
            (case, outcome)
        })
        .collect();
    // Tables, all found, exactly these, called unexplained, parameters compared, inside 2 σ.
    let mut rows: BTreeMap<&str, [usize; 6]> = BTreeMap::new();
    for (case, outcome) in &results {
        let row = rows.entry(case.kind).or_default();
        let (all, exact) = right(case, outcome);
        row[0] += 1;
        row[1] += usize::from(all);
        row[2] += usize::from(exact);
        row[3] += usize::from(outcome.verdict == Verdict::Unexplained);
        if !exact {
            let names: Vec<&str> = outcome.effects.iter().map(|e| e.name.as_str()).collect();
            page.line(format_args!("{}: {} -> {names:?}", case.table.source, case.kind));
        }
        let Some((effect, parameter, truth)) = case.truth else {
            continue;
        };
        let value =
            outcome.effects.iter().find(|e| e.name == effect.name).and_then(|e| e.parameters.get(parameter));
        if let Some((value, std)) = value.and_then(|v| Some((v.value, v.std?))) {
            row[4] += 1;
            row[5] += usize::from((value - truth).abs() < 2.0 * std);
        }
    }
    page.line("kind          tables  named or rival  exactly  unexplained  within 2 sigma");
    for (kind, [n, all, exact, unexplained, compared, inside]) in rows {
        page.line(format_args!("{kind:12} {n:7} {all:15} {exact:8} {unexplained:12} {inside:8}/{compared}"));
    }
    page.close(&format!("{first} to {}", first + tables.saturating_sub(1)));
}
