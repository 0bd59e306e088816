//! First power-ups under a current limit: `cargo run -p evaluation -- power-up --plants 20`.

use rayon::prelude::*;
use std::collections::BTreeMap;
use trials::commissioning::quantiles;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::power_up::{Outcome, PowerUp, Recipe};

/// Arguments.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Plants of each family a row.
    #[arg(long, default_value_t = 20)]
    plants: u32,
    /// Number of the first plant.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Control rate, Hz.
    #[arg(long, default_value_t = 10_000)]
    tick: u32,
    /// Length of a commissioning, s.
    #[arg(long, default_value_t = 5.0)]
    budget: f64,
    /// Limits, shares of the stall current.
    #[arg(long, value_delimiter = ',', default_value = "0.1,0.2,0.35,0.5,1,2")]
    shares: Vec<f64>,
    /// What a converter count is worth, shares of the limit.
    #[arg(long, default_value_t = 0.04)]
    lsb: f64,
    /// Use the design seeds.
    #[arg(long)]
    design: bool,
    /// The recipe of the pages of the boards: from a tenth of the stall current upwards.
    #[arg(long)]
    recipe: bool,
    /// Tell each plant.
    #[arg(long)]
    each: bool,
}

/// Evaluation seeds of this suite start here.
const SEEDS: u32 = 780_000;

pub fn run(arguments: Arguments) {
    if arguments.recipe {
        return recipes(&arguments);
    }
    println!(
        "| family | limit, share of stall | accepted, trusted | false trust | covered | dead zone % | gain % | peak, limits | longest above 1.5, ms | acts % | refused, doubts |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for family in [Family::G1, Family::G2, Family::G3] {
        for &share in &arguments.shares {
            let outcomes = outcomes(&arguments, family, share);
            println!("| {family:?} | {share} | {} |", cells(&outcomes));
        }
    }
}

/// What a converter count is worth on the boards, shares of a tenth of a stall current of 4.6 A; of 1 A on the own board.
const BOARDS: [(&str, f64); 3] =
    [("odrive-v3", 0.020142 / 0.46), ("vesc-6", 0.080566 / 0.46), ("own", 0.00072 / 0.1)];

fn recipes(arguments: &Arguments) {
    println!("| board | family | works | limit at the end, shares of the stall current | peak, limits |");
    println!("|---|---|---|---|---|");
    let options = Options { tick_hz: arguments.tick, ..Options::default() };
    for (board, lsb) in BOARDS {
        for family in [Family::G1, Family::G2, Family::G3] {
            let recipes: Vec<Recipe> = (arguments.first..arguments.first + arguments.plants)
                .into_par_iter()
                .map(|number| {
                    let plant = Plant::draw(family, Severity::Nominal, seeds(arguments, number), &options);
                    let recipe = PowerUp::recipe(&plant, lsb, number);
                    if arguments.each {
                        println!("  {number}: {} {recipe:?}", recipe.works());
                    }
                    recipe
                })
                .collect();
            let works = recipes.iter().filter(|recipe| recipe.works()).count();
            let [median, _, highest] = quantiles(recipes.iter().map(|recipe| recipe.share));
            let peak = recipes.iter().map(|recipe| recipe.peak).fold(0.0, f64::max);
            println!(
                "| {board} | {family:?} | {works} of {} | {median:.2}, at most {highest:.2} | {peak:.2} |",
                recipes.len()
            );
        }
    }
}

fn seeds(arguments: &Arguments, number: u32) -> Seeds {
    if arguments.design { Seeds::Design(number) } else { Seeds::Evaluation(SEEDS + number) }
}

fn outcomes(arguments: &Arguments, family: Family, share: f64) -> Vec<Outcome> {
    let options = Options { tick_hz: arguments.tick, ..Options::default() };
    (arguments.first..arguments.first + arguments.plants)
        .into_par_iter()
        .map(|number| {
            let plant = Plant::draw(family, Severity::Nominal, seeds(arguments, number), &options);
            let outcome =
                PowerUp::new(plant.clone(), share, arguments.lsb).commission(arguments.budget, number);
            if arguments.each {
                let friction = plant.truth.dead_zone_v[0] / plant.motor.drive.supply_v;
                println!(
                    "  {number}: dead zone {friction:.3} of the supply, {:?} {:?}",
                    outcome.score, outcome.peak
                );
            }
            outcome
        })
        .collect()
}

fn cells(outcomes: &[Outcome]) -> String {
    let scores = || outcomes.iter().map(|outcome| &outcome.score);
    let accepted = scores().filter(|score| score.refused.is_none()).count();
    let trusted = scores().filter(|score| score.all_trusted()).count();
    let wrong = scores().filter(|score| score.false_trust(12.0)).count();
    let covered = scores().flat_map(|score| &score.covered);
    let [zone, _, worst] = quantiles(scores().flat_map(|score| score.dead_zone.clone()));
    let [gain, _, worst_gain] = quantiles(scores().filter_map(|score| score.gain));
    let peak = outcomes.iter().map(|outcome| outcome.peak).fold(0.0, f64::max);
    let beyond = 1e3 * outcomes.iter().map(|outcome| outcome.beyond_s).fold(0.0, f64::max);
    let limited = 100.0 * outcomes.iter().map(|outcome| outcome.limited).sum::<f64>() / outcomes.len() as f64;
    let mut reasons = BTreeMap::new();
    for reason in scores().filter_map(|score| score.refused.or(score.doubt)) {
        *reasons.entry(reason).or_insert(0) += 1;
    }
    let reasons: Vec<String> = reasons.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    format!(
        "{accepted}, {trusted} | {wrong} | {}/{} | {zone:.2}, {worst:.2} | {gain:.2}, {worst_gain:.2} | {peak:.2} | {beyond:.1} | {limited:.0} | {}",
        covered.clone().filter(|&&covered| covered).count(),
        covered.count(),
        reasons.join(", ")
    )
}
