//! The first power-up of a drawn motor: a commissioning under a current limit, as the pages of the boards have it.

use crate::bench::Bench;
use crate::commissioning::Score;
use crate::families::Plant;
use servo::axis::Command;
use servo::commission::CommissionReport;
use servo::optional::Optional;
use servo::record::{Activity, Limit};

/// The motor, and how its current is limited and sensed.
#[derive(Clone, Debug)]
pub struct PowerUp {
    plant: Plant,
    limit_a: f64,
}

/// How it went.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What the host is told.
    pub report: CommissionReport,
    /// The same beside the truth.
    pub score: Score,
    /// Largest current, shares of the limit.
    pub peak: f64,
    /// Longest time above one and a half times the limit, s.
    pub beyond_s: f64,
    /// Share of the ticks in which the limit acted.
    pub limited: f64,
}

/// The recipe of the pages: a tenth of the stall current first, then half as much again until everything that is needed is trusted.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// Limit of the last run, share of the stall current.
    pub share: f64,
    /// How the last run went.
    pub last: Outcome,
    /// What was to be raised by what the runs before said; false: one of them said something else.
    pub told: bool,
    /// Largest current of all runs, shares of their limits.
    pub peak: f64,
}

impl Recipe {
    /// Dead zones and gain are trusted, within their intervals, and the current was held all along.
    pub fn works(&self) -> bool {
        let score = &self.last.score;
        self.told && score.all_trusted() && score.covered.iter().all(|&covered| covered) && self.peak < 2.0
    }
}

impl PowerUp {
    /// Follows the recipe. `lsb`: what a converter count is worth, shares of the first limit.
    pub fn recipe(plant: &Plant, lsb: f64, seed: u32) -> Recipe {
        let (mut share, mut peak) = (0.1, 0.0f64);
        loop {
            let last = Self::new(plant.clone(), share, lsb * 0.1 / share).commission(5.0, seed);
            peak = peak.max(last.peak);
            let limited = last.score.refused.or(last.score.doubt) == Some("current_limited");
            let told = limited || last.score.all_trusted();
            if !limited || share > 1.0 {
                return Recipe { share, last, told, peak };
            }
            share *= 1.5;
        }
    }

    /// The same limit on another motor.
    pub fn of(&self, plant: Plant) -> Self {
        let Plant { config, sensing, .. } = self.plant;
        Self { plant: Plant { config, sensing, ..plant }, limit_a: self.limit_a }
    }

    /// `share`: of the stall current at nominal voltage. `lsb`: what a converter count is worth, shares of the limit.
    pub fn new(mut plant: Plant, share: f64, lsb: f64) -> Self {
        let limit_a = share * plant.motor.drive.supply_v / plant.motor.resistance_ohm;
        plant.sensing.current = true;
        plant.config.current_limit_a = Optional::new(limit_a as f32);
        plant.config.current_a_per_lsb = (lsb * limit_a) as f32;
        Self { plant, limit_a }
    }

    /// Commissions.
    ///
    /// # Panics
    /// If the axis does not begin, or does not end within twice its budget.
    pub fn commission(&self, budget_s: f64, seed: u32) -> Outcome {
        let mut bench = Bench::new(&self.plant);
        bench.ask(Command::Arm).expect("nothing moves");
        bench.ask(Command::Commission { budget_ms: (1000.0 * budget_s) as u32, seed }).expect("armed");
        let tick_s = 1.0 / f64::from(self.plant.config.tick_hz);
        let (mut peak, mut beyond, mut longest, mut limited, mut ticks) = (0.0f64, 0u32, 0u32, 0u32, 0u32);
        for _ in 0..(2.0 * budget_s / tick_s) as u32 {
            let output = bench.tick();
            let current = bench.board.reading().current.abs() / self.limit_a;
            peak = peak.max(current);
            beyond = if current > 1.5 { beyond + 1 } else { 0 };
            longest = longest.max(beyond);
            ticks += 1;
            limited += u32::from(output.record.limit == Limit::Current);
            if output.record.activity != Activity::Commissioning && ticks > 100 {
                break;
            }
        }
        let report = bench.axis.report(&bench.state).commissioning.expect("it has ended");
        Outcome {
            report,
            score: Score::of(&self.plant, &report),
            peak,
            beyond_s: f64::from(longest) * tick_s,
            limited: f64::from(limited) / f64::from(ticks),
        }
    }
}
