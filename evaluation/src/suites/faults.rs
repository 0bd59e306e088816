//! The fault-injection suite: `cargo run -p evaluation -- faults --help`.

use evaluation::{Page, Results};
use servo::protect::{Fault, Settings};
use std::collections::BTreeMap;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::faults::calm;
use trials::faults::first_motion::{self, Travels};
use trials::faults::report::Tally;
use trials::faults::trial::{Trial, When};
use trials::faults::world::Injury;

/// Injects faults into virtual motors and prints what protection made of them.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Plants of each of the four families.
    #[arg(long, default_value_t = 18)]
    plants: u32,
    /// Number of the first of them; even numbers have a current sensor.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Control rate, Hz.
    #[arg(long, default_value_t = 10_000)]
    tick_hz: u32,
    /// Plants to develop with instead of those that figures come from.
    #[arg(long)]
    design: bool,
    /// These families only, with commas between them.
    #[arg(long, value_delimiter = ',')]
    family: Vec<String>,
    /// Instead: hours of hard ordinary motion in all, over all plants.
    #[arg(long)]
    calm_h: Option<f64>,
    /// Instead: how far joints go that are broken before their first motion.
    #[arg(long)]
    first_motion: bool,
    /// Print every finding.
    #[arg(long)]
    verbose: bool,
    #[command(flatten)]
    results: Results,
}

/// Evaluation seeds of this suite start here.
const SEEDS: u32 = 700_000;

const FAMILIES: [(&str, Family); 4] =
    [("G1", Family::G1), ("G2", Family::G2), ("G3", Family::G3), ("paper", Family::Paper)];

const INJURIES: [(&str, Injury, &[When]); 5] = [
    ("stalled shaft", Injury::Stall, &[When::AtRest, When::InMotion]),
    ("encoder unplugged", Injury::EncoderUnplugged, &[When::AtRest, When::InMotion]),
    ("encoder reversed", Injury::EncoderReversed, &[When::AtRest, When::InMotion]),
    ("motor reversed", Injury::MotorReversed, &[When::AtRest]),
    ("motor disconnected", Injury::MotorDisconnected, &[When::AtRest, When::InMotion]),
];

const BEFORE: [(&str, Injury); 5] = [
    ("nothing", Injury::None),
    ("encoder unplugged", Injury::EncoderUnplugged),
    ("encoder reversed", Injury::EncoderReversed),
    ("motor reversed", Injury::MotorReversed),
    ("motor disconnected", Injury::MotorDisconnected),
];

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    match arguments.calm_h {
        Some(hours) => calm(&mut page, &arguments, hours),
        None if arguments.first_motion => first_motion(&mut page, &arguments),
        None => injuries(&mut page, &arguments),
    }
    let (kind, offset) = if arguments.design { ("design", 0) } else { ("evaluation", SEEDS) };
    let first = offset + arguments.first;
    let last = first + arguments.plants.saturating_sub(1);
    page.close(&format!("{kind}, {first} to {last}"));
}

/// Broken in the middle of ordinary motion, or at rest.
fn injuries(page: &mut Page, arguments: &Arguments) {
    let mut rows: Vec<(String, Tally)> = Vec::new();
    for (name, family) in arguments.families() {
        for number in arguments.numbers() {
            injure_all(page, arguments, name, family, number, &mut rows);
        }
    }
    page.line(Tally::HEAD);
    for (key, tally) in &rows {
        let [fault, when, current] = [0, 1, 2].map(|k| key.split('|').nth(k).unwrap_or_default());
        page.line(tally.row(fault, when, current));
        if arguments.verbose {
            eprintln!("{key}: {:?}", tally.verdicts);
        }
    }
}

/// The same time for every plant; all currents sensed in every other one.
fn calm(page: &mut Page, arguments: &Arguments, hours: f64) {
    let number = arguments.families().count() as f64 * f64::from(arguments.plants);
    let seconds = 3600.0 * hours / number;
    page.line(
        "| family | plants | simulated | moving | motions | contacts | false alarms |\n|---|---|---|---|---|---|---|"
    );
    for (name, family) in arguments.families() {
        let (mut sum, mut plants, mut alarms) = (calm::Calm::default(), 0, 0);
        for number in arguments.numbers() {
            let plant = calm::plant(
                family,
                arguments.seeds(number),
                arguments.tick_hz,
                number.is_multiple_of(2),
                seconds,
            );
            let one = calm::run(&plant, family, seconds);
            plants += 1;
            alarms += u32::from(one.fault != Fault::None);
            if one.fault != Fault::None {
                eprintln!("{name} {number}: {one:?}");
            }
            sum.seconds += one.seconds;
            sum.moving_s += one.moving_s;
            sum.motions += one.motions;
            sum.contacts += one.contacts;
        }
        page.line(format_args!(
            "| {name} | {plants} | {:.2} h | {:.0} % | {} | {} | {alarms} |",
            sum.seconds / 3600.0,
            100.0 * sum.moving_s / sum.seconds,
            sum.motions,
            sum.contacts
        ));
    }
}

/// Broken before they are switched on, or healthy.
fn first_motion(page: &mut Page, arguments: &Arguments) {
    page.line(Travels::HEAD);
    for (name, family) in arguments.families() {
        let mut rows: BTreeMap<String, Travels> = BTreeMap::new();
        for number in arguments.numbers() {
            let sensed = number.is_multiple_of(2);
            let plant = first_motion::plant(family, arguments.seeds(number), arguments.tick_hz, sensed);
            for (fault, injury) in BEFORE {
                let one = first_motion::commission(&plant, injury, calm::budget_ms(family));
                if arguments.verbose {
                    eprintln!("{name} {number} {fault}: {one:?}");
                }
                let current = if sensed { "sensed" } else { "-" };
                let first = if one.shaken { "shaken" } else { "ramp" };
                let key = format!("{name} | {first} | {current} | {fault}");
                rows.entry(key).or_default().note(&one);
            }
        }
        for (key, travels) in &rows {
            page.line(travels.row(key));
        }
    }
}

impl Arguments {
    fn families(&self) -> impl Iterator<Item = (&'static str, Family)> {
        let wanted = |name: &str| self.family.is_empty() || self.family.iter().any(|one| one == name);
        FAMILIES.into_iter().filter(move |(name, _)| wanted(name))
    }

    fn numbers(&self) -> std::ops::Range<u32> {
        self.first..self.first + self.plants
    }

    fn seeds(&self, number: u32) -> Seeds {
        if self.design { Seeds::Design(number) } else { Seeds::Evaluation(SEEDS + number) }
    }
}

fn injure_all(
    page: &mut Page,
    arguments: &Arguments,
    name: &str,
    family: Family,
    number: u32,
    rows: &mut Vec<(String, Tally)>,
) {
    let options = Options { tick_hz: arguments.tick_hz, ..Options::default() };
    let mut plant = Plant::draw(family, Severity::Harsh, arguments.seeds(number), &options);
    plant.sensing.current = number.is_multiple_of(2);
    let trial = Trial::commissioned(&plant, &Settings::default(), calm::budget_ms(family));
    if trial.fault() != Fault::None {
        page.line(format_args!("false alarm before any injury: {name} {number}: {:?}", trial.fault()));
        return;
    }
    for (k, (fault, injury, whens)) in INJURIES.iter().enumerate() {
        for &when in *whens {
            let finding = trial.injure(*injury, when, plant.seed ^ (k as u64) << 8 ^ when as u64);
            if arguments.verbose {
                eprintln!("{name} {number} {fault} {when:?}: {finding:?}");
            }
            let current = if finding.sensed { "sensed" } else { "-" };
            let when = if when == When::AtRest { "at rest" } else { "in motion" };
            let key = format!("{fault}|{when}|{current}");
            match rows.iter_mut().find(|(other, _)| *other == key) {
                Some((_, tally)) => tally.note(*injury, &finding),
                None => {
                    let mut tally = Tally::default();
                    tally.note(*injury, &finding);
                    rows.push((key, tally));
                }
            }
        }
    }
}
