//! The accuracy suites: commissions many plants and prints markdown rows, the source of docs/results/README.md.

use clap::ValueEnum;
use evaluation::{Page, Results};
use rayon::prelude::*;
use std::collections::BTreeMap;
use trials::commissioning::{Score, commission, quantiles};
use trials::families::{Cause, Ceiling, Family, Imperfection, Options, Plant, Seeds, Severity};

#[derive(Clone, Copy, Debug, ValueEnum)]
enum FamilyName {
    G1,
    G2,
    G3,
    Paper,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SeverityName {
    Exact,
    Nominal,
    Harsh,
}

/// Accuracy of the commissioning on drawn plants.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Families.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "g1,g2,g3")]
    family: Vec<FamilyName>,
    /// Severities.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "nominal,harsh")]
    severity: Vec<SeverityName>,
    /// Plants per row.
    #[arg(long, default_value_t = 200)]
    plants: u32,
    /// First seed.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Budget of one commissioning, s.
    #[arg(long, default_value_t = 5.0)]
    seconds: f64,
    /// Control rate, Hz.
    #[arg(long, default_value_t = 1000)]
    tick: u32,
    /// The supply is not measured.
    #[arg(long)]
    blind: bool,
    /// Dead zone at the input, whatever the family.
    #[arg(long)]
    input: bool,
    /// Dead zone by friction, whatever the family.
    #[arg(long)]
    friction: bool,
    /// Knee at this share of the supply; 0: no saturation; two shares: drawn between them.
    #[arg(long, value_delimiter = ',', num_args = 1..=2)]
    knee: Vec<f64>,
    /// One more imperfection of real drives, a row for each; "all": every one.
    #[arg(long, value_delimiter = ',')]
    imperfection: Vec<String>,
    /// Load step at a random time in the learning segments, share of the dead zone.
    #[arg(long)]
    load_step: Option<f64>,
    /// End stops so far apart as the motor gets in this time at full speed, s.
    #[arg(long)]
    travel_s: Option<f64>,
    /// Use the design seeds.
    #[arg(long)]
    design: bool,
    /// Print each plant.
    #[arg(long)]
    each: bool,
    #[command(flatten)]
    results: Results,
}

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    page.line(
        "| family | budget | rate | n | dead zone % | gain % | time constant % | saturation % | unseen, invented | trusted, worst | false trust | covered, u95 % | mechanism right, wrong | refused, doubts |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let imperfections = imperfections(&arguments.imperfection);
    for imperfection in imperfections {
        for &family in &arguments.family {
            for &severity in &arguments.severity {
                row(&mut page, &arguments, family, severity, imperfection);
            }
        }
    }
    let kind = if arguments.design { "design" } else { "evaluation" };
    let last = arguments.first + arguments.plants.saturating_sub(1);
    page.close(&format!("{kind}, {} to {last}", arguments.first));
}

/// Those that are asked for; `None`: the plants as they are drawn.
fn imperfections(names: &[String]) -> Vec<Option<Imperfection>> {
    let asked = |imperfection: &Imperfection| {
        let name = format!("{imperfection:?}");
        names.iter().any(|asked| asked == "all" || asked.eq_ignore_ascii_case(&name))
    };
    let found: Vec<_> = Imperfection::ALL.into_iter().filter(asked).map(Some).collect();
    if names.is_empty() { vec![None] } else { found }
}

fn row(
    page: &mut Page,
    arguments: &Arguments,
    family: FamilyName,
    severity: SeverityName,
    imperfection: Option<Imperfection>,
) {
    let scores: Vec<(u32, Score)> = (arguments.first..arguments.first + arguments.plants)
        .into_par_iter()
        .map(|number| (number, one(arguments, family, severity, imperfection, number)))
        .collect();
    if arguments.each {
        for (number, score) in &scores {
            page.line(format_args!("{number}: {score:?}"));
        }
    }
    let scores: Vec<Score> = scores.into_iter().map(|(_, score)| score).collect();
    let with = imperfection.map_or(String::new(), |imperfection| format!(" {imperfection:?}"));
    print(page, arguments, &format!("{family:?} {severity:?}{with}"), &scores);
}

/// A number between 0 and 1 that belongs to a plant's number.
fn fraction(number: u32) -> f64 {
    f64::from(number.wrapping_mul(2_654_435_761)) / f64::from(u32::MAX)
}

fn one(
    arguments: &Arguments,
    family: FamilyName,
    severity: SeverityName,
    imperfection: Option<Imperfection>,
    number: u32,
) -> Score {
    let mut plant = draw(arguments, family, severity, number);
    if let Some(imperfection) = imperfection {
        plant = plant.with(imperfection);
    }
    if let Some(share) = arguments.load_step {
        // The learning segments of a budget of 5 s last from 15 to 65 % of it.
        let at = arguments.seconds * (0.15 + 0.5 * fraction(number));
        let sign = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        plant = plant.with_load_step(at, sign * share);
        let mean = 0.5 * (plant.truth.dead_zone_v[0] + plant.truth.dead_zone_v[1]);
        plant.truth.dead_zone_v[0] += sign * share * mean;
        plant.truth.dead_zone_v[1] -= sign * share * mean;
    }
    if let Some(seconds) = arguments.travel_s {
        plant = plant.with_travel(seconds);
    }
    let report = commission(&plant, arguments.seconds, number, |_, _| {});
    Score::of(&plant, &report)
}

fn draw(arguments: &Arguments, family: FamilyName, severity: SeverityName, number: u32) -> Plant {
    let family = match family {
        FamilyName::G1 => Family::G1,
        FamilyName::G2 => Family::G2,
        FamilyName::G3 => Family::G3,
        FamilyName::Paper => Family::Paper,
    };
    let severity = match severity {
        SeverityName::Exact => Severity::Exact,
        SeverityName::Nominal => Severity::Nominal,
        SeverityName::Harsh => Severity::Harsh,
    };
    let seeds = if arguments.design { Seeds::Design(number) } else { Seeds::Evaluation(number) };
    let options = Options {
        tick_hz: arguments.tick,
        vbus_measured: !arguments.blind,
        cause: match (arguments.input, arguments.friction) {
            (true, _) => Some(Cause::Input),
            (_, true) => Some(Cause::Friction),
            _ => None,
        },
        ceiling: match arguments.knee[..] {
            [] => Ceiling::Family,
            [0.0] => Ceiling::Absent,
            [share] => Ceiling::At(share),
            [low, high, ..] => Ceiling::At(low + (high - low) * fraction(number)),
        },
    };
    Plant::draw(family, severity, seeds, &options)
}

fn print(page: &mut Page, arguments: &Arguments, name: &str, scores: &[Score]) {
    let three = |values: Vec<f64>| {
        let [median, most, worst] = quantiles(values);
        format!("{median:.2} / {most:.2} / {worst:.1}")
    };
    let share = |part: usize, whole: usize| format!("{:.1}", 100.0 * part as f64 / whole.max(1) as f64);
    let all = |pick: fn(&Score) -> Vec<f64>| scores.iter().flat_map(pick).collect::<Vec<f64>>();
    let trusted: Vec<&Score> = scores.iter().filter(|score| score.all_trusted()).collect();
    let worst = quantiles(trusted.iter().flat_map(|score| score.dead_zone.clone()))[2];
    let covered: Vec<bool> = scores.iter().flat_map(|score| score.covered.clone()).collect();
    let [u95, ..] = quantiles(all(|score| score.u95.clone()));
    let mut why: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in scores.iter().filter_map(|score| score.refused.or(score.doubt)) {
        *why.entry(reason).or_default() += 1;
    }
    page.line(format_args!(
        "| {name}{} | {} s | {} Hz | {} | {} | {} | {} | {} | {}, {} | {} %, {worst:.1} | {} | {} %, {u95:.1} | {}, {} | {}, {why:?} |",
        if arguments.blind { " blind" } else { "" },
        arguments.seconds,
        arguments.tick,
        scores.len(),
        three(all(|score| score.dead_zone.clone())),
        three(all(|score| score.gain.into_iter().collect())),
        three(all(|score| score.time_constant.into_iter().collect())),
        three(all(|score| score.saturation.clone())),
        scores.iter().map(|score| score.unseen).sum::<usize>(),
        scores.iter().map(|score| score.invented).sum::<usize>(),
        share(trusted.len(), scores.len()),
        scores.iter().filter(|score| score.false_trust(12.0)).count(),
        share(covered.iter().filter(|&&inside| inside).count(), covered.len()),
        scores
            .iter()
            .filter(|score| score.mechanism == Some(true))
            .count(),
        scores
            .iter()
            .filter(|score| score.mechanism == Some(false))
            .count(),
        scores.iter().filter(|score| score.refused.is_some()).count(),
    ));
}
