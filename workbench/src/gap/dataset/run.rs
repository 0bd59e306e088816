//! One run on its grid, and its simulation.

use super::probe::Probes;
use crate::system::plant::dynamics::Dynamics;
use crate::system::plant::physics::Physics;
use crate::system::plant::state::State;
use servo::axis::Bridge;

/// One run made ready.
#[derive(Clone, Debug, Default)]
pub struct BenchRun {
    /// Number of the run in the log.
    pub id: i64,
    /// Index of the log: 0 the log itself, 1 … the hold-outs.
    pub log: usize,
    /// Start of each block and the end of the last, s.
    pub time: Vec<f64>,
    /// Bridge mode of each block.
    pub bridge: Vec<Bridge>,
    /// First row of each block, and one past the last row of all.
    pub first_row: Vec<u32>,
    /// Start of each row and the end of the last, s.
    pub row_time: Vec<f64>,
    /// Input of each row.
    pub input: Vec<f64>,
    /// Shaft position at the grid's points: measured, or the integral of the measured speed.
    pub position: Vec<f64>,
    /// Speed at the start.
    pub start_speed: f64,
    /// Uncertainty of the speed at the start; 0: it starts at rest.
    pub start_sigma: f64,
    /// The compared speed.
    pub speed: Probes,
    /// The compared current; empty if there is none.
    pub current: Probes,
}

/// A simulated run at the grid's points.
#[derive(Clone, Debug, Default)]
pub struct Traces {
    /// True speed, rad/s.
    pub omega: Vec<f64>,
    /// The sensor's reading of the speed.
    pub reading: Vec<f64>,
    /// Its integral.
    pub integral: Vec<f64>,
    /// Winding current, A.
    pub current: Vec<f64>,
    /// Charge that flowed, A s.
    pub charge: Vec<f64>,
    /// Voltage behind the input chain, mean of each block.
    pub applied: Vec<f64>,
}

/// Simulates runs and looks at them as their sensors do. It keeps its buffers, because fits simulate thousands of runs.
#[derive(Clone, Debug, Default)]
pub struct Simulation {
    traces: Traces,
    predicted: Vec<f64>,
}

impl Simulation {
    /// A run in free run, and what the sensor of its speed would have shown; the arguments are those of
    /// [`BenchRun::simulate`].
    pub fn speed(&mut self, run: &BenchRun, plant: &Physics, start: f64, finest: f64) -> (&Traces, &[f64]) {
        let Self { traces, predicted } = self;
        run.simulate(plant, start, finest, traces);
        run.speed.predict(&run.time, &traces.reading, &traces.integral, predicted);
        (traces, predicted)
    }

    /// What the sensor of the current would have shown in the run that was simulated last.
    pub fn current(&mut self, run: &BenchRun) -> &[f64] {
        let Self { traces, predicted } = self;
        run.current.predict(&run.time, &traces.current, &traces.charge, predicted);
        predicted
    }
}

impl BenchRun {
    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.bridge.len()
    }

    /// Simulates the run in free run. `start`: reading of the speed from which it goes on; 0: it rests. `finest`: longest inner step
    /// as a part of the time constant.
    pub fn simulate(&self, plant: &Physics, start: f64, finest: f64, traces: &mut Traces) {
        traces.clear(self.blocks());
        let input = Drawn::new(self, plant);
        let longest = (plant.time_constant_s() * finest).max(1e-7);
        let speed = if start == 0.0 { 0.0 } else { plant.speed_behind(start) };
        let mut state = self.start(plant, speed);
        let mut dynamics = Dynamics::new(plant);
        let placed = !plant.torques.is_empty() || !plant.unnamed.is_empty();
        let with_position = placed && !self.position.is_empty();
        let mut charge = 0.0;
        traces.record(&state, charge);
        for k in 0..self.blocks() {
            let (start, length) = (self.time[k], self.time[k + 1] - self.time[k]);
            let pieces = ((length / longest - 1e-9).ceil()).clamp(1.0, 200.0);
            let h = length / pieces;
            for piece in 0..pieces as usize {
                let applied = input.mean(self, k, start + piece as f64 * h, h);
                let position = with_position.then(|| self.position_in(plant, k, piece, pieces));
                dynamics.advance(&mut state, applied, self.bridge[k], h, position);
                charge += state.mean_current * h;
                traces.applied[k] += applied / pieces;
            }
            traces.record(&state, charge);
        }
    }

    fn start(&self, plant: &Physics, speed: f64) -> State {
        let start = if self.position.is_empty() { 0.0 } else { self.shaft(plant, 0) };
        let mut state = State::moving(plant, start, speed);
        if speed != 0.0
            && self.bridge.first() == Some(&Bridge::Driven)
            && plant.drive == crate::system::plant::physics::Drive::Voltage
        {
            let limit = plant.current_limit;
            state.current =
                ((plant.applied(self.input[0]) - plant.ke * speed) / plant.resistance).clamp(-limit, limit);
        }
        state
    }

    /// Where the shaft is at a point of the grid: a wrong scale of the readings is in the logged position, too.
    pub fn shaft(&self, plant: &Physics, point: usize) -> f64 {
        self.position[point] / plant.sensor_scale
    }

    fn position_in(&self, plant: &Physics, block: usize, piece: usize, pieces: f64) -> (f64, f64) {
        let (from, to) = (self.shaft(plant, block), self.shaft(plant, block + 1));
        let at = |k: usize| from + (to - from) * k as f64 / pieces;
        (at(piece), at(piece + 1))
    }
}

impl Traces {
    fn clear(&mut self, blocks: usize) {
        for values in
            [&mut self.omega, &mut self.reading, &mut self.integral, &mut self.current, &mut self.charge]
        {
            values.clear();
            values.reserve(blocks + 1);
        }
        self.applied.clear();
        self.applied.resize(blocks, 0.0);
    }

    fn record(&mut self, state: &State, charge: f64) {
        self.omega.push(state.omega);
        self.reading.push(state.reading);
        self.integral.push(state.reading_integral);
        self.current.push(state.current);
        self.charge.push(charge);
    }
}

/// The input behind delay, lag and the memoryless chain: the mean over any stretch of time.
enum Drawn {
    /// No delay: the mean of each block. (A block is shorter than what a motor could resolve.)
    Held(Vec<f64>),
    /// Integral over the rows, read `delay` seconds back.
    Integral { area: Vec<f64>, delay: f64 },
}

impl Drawn {
    fn new(run: &BenchRun, plant: &Physics) -> Self {
        let applied = if plant.lag_s > 0.0 {
            lagged(run, plant)
        } else {
            run.input.iter().map(|u| plant.applied(*u)).collect()
        };
        if plant.delay_s <= 0.0 {
            let held = if run.blocks() == run.input.len() { applied } else { means(run, &applied) };
            return Self::Held(held);
        }
        let mut area = Vec::with_capacity(applied.len() + 1);
        let mut sum = 0.0;
        area.push(0.0);
        for (row, value) in applied.iter().enumerate() {
            sum += value * (run.row_time[row + 1] - run.row_time[row]);
            area.push(sum);
        }
        Self::Integral { area, delay: plant.delay_s }
    }

    #[inline]
    fn mean(&self, run: &BenchRun, block: usize, start: f64, length: f64) -> f64 {
        match self {
            Self::Held(applied) => applied[block],
            Self::Integral { area, delay } => {
                let at = |time: f64| {
                    interpolated(&run.row_time, area, time - delay, run.first_row[block] as usize)
                };
                (at(start + length) - at(start)) / length
            }
        }
    }
}

/// Mean of each block, its rows weighted by their duration.
fn means(run: &BenchRun, applied: &[f64]) -> Vec<f64> {
    let block = |k: usize| {
        let (from, to) = (run.first_row[k] as usize, run.first_row[k + 1] as usize);
        let (values, times) = (&applied[from..to], &run.row_time[from..=to]);
        let area: f64 =
            values.iter().zip(times.windows(2)).map(|(value, span)| value * (span[1] - span[0])).sum();
        area / (times[to - from] - times[0])
    };
    (0..run.blocks()).map(block).collect()
}

/// First-order lag of the command, then the memoryless chain, on every row.
fn lagged(run: &BenchRun, plant: &Physics) -> Vec<f64> {
    let mut state = run.input[0] * if run.start_speed == 0.0 { 0.0 } else { 1.0 };
    let pair = |(row, command): (usize, &f64)| {
        let x = (run.row_time[row + 1] - run.row_time[row]) / plant.lag_s;
        let (rest, decay) = (state - command, (-x).exp());
        state = command + rest * decay;
        plant.applied(command + rest * (1.0 - decay) / x)
    };
    run.input.iter().enumerate().map(pair).collect()
}

/// Linear interpolation of `values` over `times`; 0 before the first time. `near`: a row not far after the place.
fn interpolated(times: &[f64], values: &[f64], at: f64, near: usize) -> f64 {
    if at <= times[0] {
        return 0.0;
    }
    let mut k = near.min(times.len() - 2);
    while times[k] > at {
        k -= 1;
    }
    while k + 2 < times.len() && times[k + 1] < at {
        k += 1;
    }
    values[k] + (values[k + 1] - values[k]) * (at - times[k]) / (times[k + 1] - times[k])
}
