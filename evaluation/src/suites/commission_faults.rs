//! Commissionings of motors that are wired, described or driven wrongly: do they end, how far does the shaft turn, and what is said?

use evaluation::Results;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use servo::commission::CommissionReport;
use servo::identify::estimate::{Reason, Reported};
use servo::protect::Fault;
use std::collections::BTreeMap;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::faults::commissioning::{Flaw, Trial, commission, commission_image};

/// Commissions flawed motors and prints what was made of them.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Motors of each kind of flaw, over all families.
    #[arg(long, default_value_t = 150)]
    motors: u32,
    /// Number of the first of them.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Budget of one commissioning, s.
    #[arg(long, default_value_t = 5.0)]
    seconds: f64,
    /// Control rate, Hz.
    #[arg(long, default_value_t = 1000)]
    tick_hz: u32,
    /// These kinds only, with commas between them.
    #[arg(long, value_delimiter = ',')]
    kind: Vec<String>,
    /// Motors to develop with instead of those that figures come from.
    #[arg(long)]
    design: bool,
    /// Run the image in QEMU, not the library.
    #[arg(long)]
    image: bool,
    /// Print every commissioning that is not as it should be.
    #[arg(long)]
    verbose: bool,
    #[command(flatten)]
    results: Results,
}

/// Evaluation seeds of this suite start here.
const SEEDS: u32 = 900_000;
/// A start above this share of the dead zone is no friction at rest: a dead zone that is trusted then is wrong.
const NO_FRICTION: f64 = 2.0;
/// A flaw that has shown for no longer when the commissioning ends by itself need not be named, s.
const JUST_NOW_S: f64 = 0.1;

/// A kind of flaw: how it is drawn, and whether it must be named.
type Kind = (&'static str, fn(&mut ChaCha8Rng) -> Flaw);

const KINDS: [Kind; 15] = [
    ("healthy", |_| Flaw::None),
    ("channel dead, counts up", |_| Flaw::CountsUp(0.0)),
    ("channel dead, flickers", |_| Flaw::Flickers(0.0)),
    ("channel dies, counts up", |rng| Flaw::CountsUp(rng.random_range(0.1..5.0))),
    ("channel dies, flickers", |rng| Flaw::Flickers(rng.random_range(0.1..5.0))),
    ("direction wire off", |rng| Flaw::DirectionWire(sign(rng), 0.0)),
    ("direction wire comes off", |rng| Flaw::DirectionWire(sign(rng), rng.random_range(0.1..5.0))),
    ("drive flips", |rng| Flaw::DriveFlips(rng.random_range(0.0..5.0))),
    ("encoder flips", |rng| Flaw::EncoderFlips(rng.random_range(0.0..5.0))),
    ("counts per turn × ½, 2, 4", |rng| Flaw::Counts([0.5, 2.0, 4.0][rng.random_range(0..3)])),
    ("half bridge weak", |rng| Flaw::Side(sign(rng), 0.5)),
    ("half bridge dead", |rng| Flaw::Side(sign(rng), 0.0)),
    ("threshold", |rng| Flaw::Threshold(rng.random_range(0.08..0.4))),
    ("supply ± 50 %", |rng| Flaw::Supply(if rng.random_bool(0.5) { 0.5 } else { 1.5 })),
    ("rated speed in rpm", |_| Flaw::Rpm),
];

fn sign(rng: &mut ChaCha8Rng) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    page.line("| flaw | motors | beyond budget + 1 s | longest, s | after it showed: beyond a turn and 0.3 s | turns, worst | right reason | trusted and wrong | reasons |");
    page.line("|---|---|---|---|---|---|---|---|---|");
    let mut whole = Tally::default();
    for (name, draw) in KINDS {
        if !(arguments.kind.is_empty() || arguments.kind.iter().any(|kind| name.contains(kind.as_str()))) {
            continue;
        }
        let tally = arguments.kind(name, draw);
        page.line(tally.row(name));
        if name != "healthy" {
            whole.add(tally);
        }
    }
    page.line(whole.row("all flaws"));
    let (kind, offset) = if arguments.design { ("design", 0) } else { ("evaluation", SEEDS) };
    let first = offset + arguments.first;
    page.close(&format!("{kind}, {first} to {}", first + arguments.motors.saturating_sub(1)));
}

impl Arguments {
    fn kind(&self, name: &str, draw: fn(&mut ChaCha8Rng) -> Flaw) -> Tally {
        let one = |number: u32| {
            let plant = self.plant(number);
            let flaw = draw(&mut ChaCha8Rng::seed_from_u64(plant.seed ^ 0xf1a3));
            let run = if self.image { commission_image } else { commission };
            let trial = run(&plant, flaw, self.seconds, number / 2);
            let seen = Seen::of(&plant, flaw, &trial, self.seconds);
            if self.verbose && !seen.is_good() {
                eprintln!("{name} {number} {flaw:?}: {seen:?} {trial:?} {:?}", plant.truth);
            }
            seen
        };
        let all: Vec<Seen> = (self.first..self.first + self.motors).into_par_iter().map(one).collect();
        Tally(all)
    }

    fn plant(&self, number: u32) -> Plant {
        let families = [Family::G1, Family::G2, Family::G3];
        let family = families[number as usize % 3];
        let severity = if number % 6 < 3 { Severity::Nominal } else { Severity::Harsh };
        let seeds = if self.design { Seeds::Design(number) } else { Seeds::Evaluation(SEEDS + number) };
        let options = Options { tick_hz: self.tick_hz, ..Options::default() };
        Plant::draw(family, severity, seeds, &options)
    }
}

/// What is kept of one commissioning.
#[derive(Clone, Debug)]
struct Seen {
    took_s: f64,
    late: bool,
    turns: f64,
    far: bool,
    right: bool,
    wrong: bool,
    said: &'static str,
}

impl Seen {
    fn of(plant: &Plant, flaw: Flaw, trial: &Trial, budget_s: f64) -> Self {
        let accepted = trial.report.as_ref().filter(|report| report.refused.is_none());
        Self {
            took_s: trial.took_s,
            late: trial.report.is_none() && trial.fault == Fault::None || trial.took_s > budget_s + 1.0,
            turns: trial.shown.turns,
            far: !trial.shown.is_soon_over(),
            right: is_right(plant, flaw, trial),
            wrong: accepted.is_some_and(|report| is_wrong(plant, flaw, report)),
            said: trial.reasons().first().map_or("accepted", |reason| reason.code()),
        }
    }

    fn is_good(&self) -> bool {
        self.right && !(self.late || self.far || self.wrong)
    }
}

/// The lowest voltage that the drive gives, as a share of the dead zones.
fn start_shares(plant: &Plant, least: f64) -> [f64; 2] {
    plant.truth.dead_zone_v.map(|dead_zone| least * plant.motor.drive.supply_v / dead_zone)
}

/// Does the reason say what is wrong? A flaw that never showed, or that is none, needs none.
fn is_right(plant: &Plant, flaw: Flaw, trial: &Trial) -> bool {
    let said = trial.reasons();
    let is = |reasons: &[Reason]| said.iter().any(|reason| reasons.contains(reason));
    let late = trial.shown.since_s.is_none() || trial.shown.driven_s < JUST_NOW_S;
    match flaw {
        Flaw::None => trial.report.is_some_and(|report| report.refused.is_none()),
        Flaw::CountsUp(0.0) | Flaw::DirectionWire(_, 0.0) => is(&[Reason::ChannelMissing]),
        Flaw::Flickers(0.0) => is(&[Reason::ChannelMissing]),
        Flaw::Flickers(_) => late || is(&[Reason::ChannelMissing]),
        Flaw::CountsUp(_) | Flaw::DirectionWire(..) | Flaw::DriveFlips(_) | Flaw::EncoderFlips(_) => {
            let before = !trial.learning && is(&[Reason::ChannelMissing, Reason::Reversed]);
            late || before || is(&[Reason::DirectionChanged])
        }
        Flaw::Counts(_) | Flaw::Rpm => is(&[Reason::SpeedContradicts]),
        Flaw::Side(_, 0.0) => is(&[Reason::OneDirection]),
        // A side so weak that nothing starts below 0.45 of the supply is as good as dead.
        Flaw::Side(..) => is(&[Reason::GainsDiffer, Reason::OneDirection]),
        Flaw::Threshold(least) => {
            let friction = start_shares(plant, least).iter().all(|share| *share < NO_FRICTION);
            friction || is(&[Reason::StartsHigher])
        }
        Flaw::Supply(_) => {
            is(&[Reason::SupplyNotNominal, Reason::SupplyTooLow])
                || matches!(trial.fault, Fault::SupplyLow | Fault::SupplyHigh)
        }
    }
}

/// Is a number trusted whose interval does not hold the truth?
fn is_wrong(plant: &Plant, flaw: Flaw, report: &CommissionReport) -> bool {
    let truth = &plant.truth;
    let misses = |number: &Reported, truth: f64| {
        let (value, u95) = (number.value.map_or(0.0, f64::from), number.u95.map_or(0.0, f64::from));
        number.trusted && (value - truth).abs() > u95
    };
    let [forwards, backwards] = match flaw {
        Flaw::Side(side, share) if side > 0.0 => [1.0 / share, 1.0],
        Flaw::Side(_, share) => [1.0, 1.0 / share],
        _ => [1.0, 1.0],
    };
    let found = &report.estimates;
    let higher = match flaw {
        Flaw::Threshold(least) => start_shares(plant, least).map(|share| share >= NO_FRICTION),
        _ => [false; 2],
    };
    let differs = matches!(flaw, Flaw::Side(..));
    higher[0] && found.dead_zone_pos_v.trusted
        || higher[1] && found.dead_zone_neg_v.trusted
        || differs && found.gain_rad_s_per_v.trusted
        || misses(&found.dead_zone_pos_v, truth.dead_zone_v[0] * forwards)
        || misses(&found.dead_zone_neg_v, truth.dead_zone_v[1] * backwards)
        || misses(&found.gain_rad_s_per_v, truth.gain) && !differs
}

#[derive(Default)]
struct Tally(Vec<Seen>);

impl Tally {
    fn add(&mut self, other: Tally) {
        self.0.extend(other.0);
    }

    fn row(&self, name: &str) -> String {
        let count = |what: fn(&Seen) -> bool| self.0.iter().filter(|seen| what(seen)).count();
        let most = |what: fn(&Seen) -> f64| self.0.iter().map(what).fold(0.0, f64::max);
        let all = self.0.len().max(1) as f64;
        let share = |part: usize| format!("{part}, {:.1} %", 100.0 * part as f64 / all);
        let mut said: BTreeMap<&str, usize> = BTreeMap::new();
        for seen in &self.0 {
            *said.entry(seen.said).or_default() += 1;
        }
        let said: Vec<String> = said.iter().map(|(code, count)| format!("{code} {count}")).collect();
        format!(
            "| {name} | {} | {} | {:.2} | {} | {:.1} | {} | {} | {} |",
            self.0.len(),
            count(|seen| seen.late),
            most(|seen| seen.took_s),
            share(count(|seen| seen.far)),
            most(|seen| seen.turns),
            share(count(|seen| seen.right)),
            share(count(|seen| seen.wrong)),
            said.join(", ")
        )
    }
}
