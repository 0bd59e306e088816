//! The input of a run behind delay, lag and the memoryless chain.

use super::run::GridRun;
use crate::system::plant::input::Chain;
use crate::system::plant::physics::Physics;
use crate::system::plant::simd::Lanes;

/// Sets that any processor's registers can hold side by side. Origin: the widest registers hold 8 numbers of 64 bits
/// (AVX-512), a pair of them 16; doubled by judgement.
const MOST_SETS: usize = 32;

/// The mean of the input over any stretch of time, of one plant or of several in lock-step.
pub(super) enum AppliedInput {
    /// No delay: the mean of each block, the numbers of the sets side by side. (A block is shorter than what a motor could
    /// resolve.)
    Held(Vec<f64>),
    /// Of each set the integral over the rows, read `delay` seconds back.
    Integrals(Vec<Integral>),
}

/// The integral of one set's input over the rows, read `delay` seconds back, piece by piece from the start of the run.
pub(super) struct Integral {
    applied: Vec<f64>,
    area: Vec<f64>,
    delay: f64,
    /// What acted before the first row.
    before: f64,
    /// Row in which the last piece ended.
    row: usize,
    /// The integral up to there.
    reached: f64,
}

impl AppliedInput {
    /// Of plants with the same features: one by one, and side by side.
    #[inline(always)]
    pub(super) fn new<F: Lanes>(run: &GridRun, sets: &[Physics], plant: &Physics<F>) -> Self {
        let (delayed, lagging) = (sets.iter().any(|p| p.delay_s > 0.0), sets.iter().any(|p| p.lag_s > 0.0));
        if delayed || lagging && run.blocks() != run.input.len() {
            return Self::Integrals(sets.iter().map(|plant| Integral::new(run, plant)).collect());
        }
        if !lagging {
            return Self::Held(held(run, plant, &Chain::of(&sets[0])));
        }
        let lagged: Vec<Vec<f64>> = sets.iter().map(|plant| behind_lag(run, plant)).collect();
        let at = |set: usize, block: usize| lagged[set.min(lagged.len() - 1)][block];
        let mut applied = Vec::with_capacity(run.blocks() * F::COUNT);
        for block in 0..run.blocks() {
            plant.supply_v.of(|set| at(set, block)).push_to(&mut applied);
        }
        Self::Held(applied)
    }

    /// Mean over the next piece, up to `end`, of a block. The pieces of a run follow one another.
    #[inline(always)]
    pub(super) fn mean<F: Lanes>(&mut self, like: F, run: &GridRun, block: usize, end: f64, span: f64) -> F {
        match self {
            Self::Held(applied) => like.load(&applied[block * F::COUNT..]),
            Self::Integrals(sets) => {
                let (per_second, last) = (1.0 / span, sets.len() - 1);
                let mut means = [0.0; MOST_SETS];
                for (mean, set) in means.iter_mut().zip(sets) {
                    *mean = set.up_to(run, end) * per_second;
                }
                like.of(|set| means[set.min(last)])
            }
        }
    }
}

impl Integral {
    fn new(run: &GridRun, plant: &Physics) -> Self {
        let applied = behind_lag(run, plant);
        let mut area = Vec::with_capacity(applied.len());
        let mut sum = 0.0;
        for (row, value) in applied.iter().enumerate() {
            area.push(sum);
            sum += value * (run.row_time[row + 1] - run.row_time[row]);
        }
        let (delay, before) = (plant.delay_s.max(0.0), if run.since_s > 0.0 { applied[0] } else { 0.0 });
        Self { applied, area, delay, before, row: 0, reached: -before * delay }
    }

    /// What was added since the last piece ended.
    #[inline(always)]
    fn up_to(&mut self, run: &GridRun, end: f64) -> f64 {
        let time = end - self.delay;
        while self.row + 1 < self.applied.len() && run.row_time[self.row + 1] < time {
            self.row += 1;
        }
        let since = time - run.row_time[self.row];
        let applied = if since < 0.0 { self.before } else { self.applied[self.row] };
        let reached = self.area[self.row] + applied * since;
        reached - std::mem::replace(&mut self.reached, reached)
    }
}

/// Without lag and delay: the mean of each block, its rows weighted by their duration.
#[inline(always)]
fn held<F: Lanes>(run: &GridRun, plant: &Physics<F>, chain: &Chain) -> Vec<f64> {
    let like = plant.drive_gain;
    let mut means = Vec::with_capacity(run.blocks() * F::COUNT);
    for block in 0..run.blocks() {
        let (from, to) = (run.first_row[block] as usize, run.first_row[block + 1] as usize);
        if to - from == 1 {
            plant.applied_to(chain, like.like(run.input[from])).push_to(&mut means);
            continue;
        }
        let mut area = like.like(0.0);
        for row in from..to {
            let span = run.row_time[row + 1] - run.row_time[row];
            area = area + plant.applied_to(chain, like.like(run.input[row])) * span;
        }
        (area * (1.0 / (run.row_time[to] - run.row_time[from]))).push_to(&mut means);
    }
    means
}

/// First-order lag of the command, if there is one, then the memoryless chain, on every row.
fn behind_lag(run: &GridRun, plant: &Physics) -> Vec<f64> {
    let chain = Chain::of(plant);
    if plant.lag_s <= 0.0 {
        return run.input.iter().map(|u| plant.applied_to(&chain, *u)).collect();
    }
    let settled = run.since_s > 0.0 || run.start_speed != 0.0;
    let mut state = if settled { run.input[0] } else { 0.0 };
    let pair = |(row, command): (usize, &f64)| {
        let x = (run.row_time[row + 1] - run.row_time[row]) / plant.lag_s;
        let (rest, decay) = (state - command, (-x).exp());
        state = command + rest * decay;
        plant.applied_to(&chain, command + rest * (1.0 - decay) / x)
    };
    run.input.iter().enumerate().map(pair).collect()
}
