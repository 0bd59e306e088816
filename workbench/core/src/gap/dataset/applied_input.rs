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
    /// resolve.) Behind a lag, also the current at its end beyond the one of that mean.
    Held(Vec<f64>, Vec<f64>),
    /// Of each set the integral over the rows, read `delay` seconds back.
    Integrals(Vec<Integral>),
}

/// The integral of one set's input over the rows, read `delay` seconds back, piece by piece from the start of the run. Behind a lag too,
/// each row counts as held at its mean.
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
    /// Current at the end of that piece beyond the one of its mean voltage, A.
    beyond: f64,
    /// R/L; 0: no current is compared.
    rate: f64,
    resistance: f64,
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
            return Self::Held(held(run, plant, &Chain::of(&sets[0])), Vec::new());
        }
        let lagged: Vec<(Vec<f64>, Vec<f64>)> = sets.iter().map(|plant| behind_lag(run, plant)).collect();
        let of = |set: usize| &lagged[set.min(lagged.len() - 1)];
        let (mut means, mut beyond) = (Vec::new(), Vec::new());
        for block in 0..run.blocks() {
            plant.supply_v.of(|set| of(set).0[block]).push_to(&mut means);
            plant.supply_v.of(|set| of(set).1[block]).push_to(&mut beyond);
        }
        Self::Held(means, beyond)
    }

    /// Current at the end of a block beyond the one of its mean voltage, A; of a plant that lags.
    #[inline(always)]
    pub(super) fn beyond<F: Lanes>(&self, like: F, block: usize) -> Option<F> {
        match self {
            Self::Held(_, beyond) => (!beyond.is_empty()).then(|| like.load(&beyond[block * F::COUNT..])),
            Self::Integrals(sets) => Some(like.of(|set| sets[set.min(sets.len() - 1)].beyond)),
        }
    }

    /// Mean over the next piece, up to `end`, of a block. The pieces of a run follow one another.
    #[inline(always)]
    pub(super) fn mean<F: Lanes>(&mut self, like: F, run: &GridRun, block: usize, end: f64, span: f64) -> F {
        match self {
            Self::Held(means, _) => like.load(&means[block * F::COUNT..]),
            Self::Integrals(sets) => {
                let (per_second, last) = (1.0 / span, sets.len() - 1);
                let mut means = [0.0; MOST_SETS];
                for (mean, set) in means.iter_mut().zip(sets) {
                    *mean = set.up_to(run, end, span) * per_second;
                }
                like.of(|set| means[set.min(last)])
            }
        }
    }
}

impl Integral {
    fn new(run: &GridRun, plant: &Physics) -> Self {
        let (applied, _) = behind_lag(run, plant);
        let mut area = Vec::with_capacity(applied.len());
        let mut sum = 0.0;
        for (row, value) in applied.iter().enumerate() {
            area.push(sum);
            sum += value * (run.row_time[row + 1] - run.row_time[row]);
        }
        let (delay, before) = (plant.delay_s.max(0.0), if run.since_s > 0.0 { applied[0] } else { 0.0 });
        let (reached, resistance, rate) = (-before * delay, plant.resistance, rate(run, plant));
        Self { applied, area, delay, before, row: 0, reached, beyond: 0.0, rate, resistance }
    }

    /// What was added since the last piece ended.
    #[inline(always)]
    fn up_to(&mut self, run: &GridRun, end: f64, span: f64) -> f64 {
        let time = end - self.delay;
        while self.row + 1 < self.applied.len() && run.row_time[self.row + 1] < time {
            self.row += 1;
        }
        let since = time - run.row_time[self.row];
        let applied = if since < 0.0 { self.before } else { self.applied[self.row] };
        if self.rate > 0.0 {
            let (left, early) = ((-self.rate * span).exp(), self.before);
            self.beyond *= left;
            if (0.0..span).contains(&since) {
                let step = applied - self.row.checked_sub(1).map_or(early, |row| self.applied[row]);
                let risen = 1.0 - (-self.rate * since).exp() - since / span * (1.0 - left);
                self.beyond += step * risen / self.resistance;
            }
        }
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

/// R/L, 1/s, where the current is compared.
fn rate(run: &GridRun, plant: &Physics) -> f64 {
    if run.current.is_empty() { 0.0 } else { plant.resistance / plant.inductance.max(1e-12) }
}

/// First-order lag of the command, if there is one, then the memoryless chain: the mean of every row. And the winding's current at the end
/// of the row beyond the one of that mean. Origin: L·di/dt + R·i = D·(e^(−x·t/h) − m), where m = (1 − e^−x)/x is the mean, with a = R·h/L
/// gives D·[a/(a − x)·(e^−x − e^−a) − m·(1 − e^−a)]/R at t = h.
fn behind_lag(run: &GridRun, plant: &Physics) -> (Vec<f64>, Vec<f64>) {
    let chain = Chain::of(plant);
    if plant.lag_s <= 0.0 {
        return (run.input.iter().map(|u| plant.applied_to(&chain, *u)).collect(), Vec::new());
    }
    let settled = run.since_s > 0.0 || run.start_speed != 0.0;
    let rate = rate(run, plant);
    let (mut state, mut beyond) = (if settled { run.input[0] } else { 0.0 }, 0.0);
    let row = |(row, command): (usize, &f64)| {
        let h = run.row_time[row + 1] - run.row_time[row];
        let x = h / plant.lag_s;
        let (rest, decay) = (state - command, (-x).exp());
        let share = (1.0 - decay) / x;
        let mean = plant.applied_to(&chain, command + rest * share);
        state = command + rest * decay;
        if rate > 0.0 {
            // Equal exponents have the same limit as nearly equal ones.
            let a = if (rate * h - x).abs() < 1e-6 * x { x * (1.0 + 1e-6) } else { rate * h };
            let (rise, left) = (plant.applied_to(&chain, state) - mean, (-a).exp());
            let risen = a / (a - x) * (decay - left) - share * (1.0 - left);
            beyond = beyond * left + rise / (decay - share) * risen / plant.resistance;
        }
        (mean, beyond)
    };
    run.input.iter().enumerate().map(row).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::dataset::probe::{Grid, Probes};
    use crate::gap::dataset::{FINE, Simulation};
    use servo::axis::Bridge;

    const ROWS: usize = 60;
    const ROW_S: f64 = 2e-3;

    /// Three levels, five rows each. Each row stands in so many parts, so that of many each has hardly a voltage beyond its mean.
    fn currents(parts: usize, plant: &Physics) -> Vec<f64> {
        let rows = ROWS * parts;
        let time: Vec<f64> = (0..=rows).map(|k| k as f64 * ROW_S / parts as f64).collect();
        let mut current = Probes::default();
        (1..ROWS).for_each(|row| current.push_instant(&Grid(&time), row as f64 * ROW_S, 0.0));
        let run = GridRun {
            input: (0..rows).map(|k| 6.0 * (k / parts / 5 % 3) as f64 - 6.0).collect(),
            bridge: vec![Bridge::Driven; rows],
            first_row: (0..=rows as u32).collect(),
            row_time: time.clone(),
            time,
            current,
            ..GridRun::default()
        };
        let mut simulation = Simulation::default();
        simulation.speed(&run, plant, 0.0, FINE);
        simulation.current(&run).to_vec()
    }

    #[test]
    fn the_current_at_the_end_of_a_row_is_that_of_the_voltage_there() {
        for (delay_s, lag_s) in [(0.0, 4e-4), (0.0, 8e-3), (3.3e-3, 0.0)] {
            let plant =
                Physics { delay_s, lag_s, ..Physics::linear_motor(1.0, 1e-3, 0.05, 0.05, 1e-4, 1e-5) };
            let rows = currents(1, &plant).into_iter().zip(currents(200, &plant));
            let off = rows.map(|(whole, parts)| (whole - parts).abs()).fold(0.0, f64::max);
            // With the row's mean alone it is 0.2 to 1.2 A off.
            assert!(off < 0.05, "delay {delay_s} s, lag {lag_s} s: {off} A");
        }
    }
}
