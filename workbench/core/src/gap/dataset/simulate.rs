//! The simulation of one run.

use super::applied_input::AppliedInput;
use super::run::GridRun;
use crate::system::plant::dynamics::Dynamics;
use crate::system::plant::effort;
use crate::system::plant::features::Features;
use crate::system::plant::physics::{Drive, Physics};
use crate::system::plant::simd::Lanes;
use crate::system::plant::state::State;
use servo::axis::Bridge;

/// A simulated run at the grid's points. Of several plants in lock-step the numbers of a point stand side by side, and only what
/// a sensor needs is kept.
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
    pub(super) traces: Traces,
    pub(super) predicted: Vec<f64>,
}

impl Simulation {
    /// A run in free run, and what the sensor of its speed would have shown; the arguments are those of
    /// [`GridRun::simulate`].
    pub fn speed(&mut self, run: &GridRun, plant: &Physics, start: f64, finest: f64) -> (&Traces, &[f64]) {
        let (_, steps) = self.sensed(run, plant, start, Detail { finest, keep: Keep::All });
        effort::simulated(1, steps);
        (&self.traces, &self.predicted)
    }

    /// The run that was simulated last.
    pub fn traces(&self) -> &Traces {
        &self.traces
    }

    /// What its sensor would have shown.
    pub fn predicted(&self) -> &[f64] {
        &self.predicted
    }

    /// The same, with the number of inner steps, which it leaves to be counted.
    pub(super) fn sensed(&mut self, run: &GridRun, plant: &Physics, at: f64, kept: Detail) -> (&[f64], u64) {
        let Self { traces, predicted } = self;
        let steps = run.simulated(plant, at, kept, traces);
        predicted.resize(run.speed.len(), 0.0);
        run.speed.predict(0.0, &run.time, &traces.reading, &traces.integral, predicted);
        (predicted, steps)
    }

    /// What the sensor of the current would have shown in the run that was simulated last.
    pub fn current(&mut self, run: &GridRun) -> &[f64] {
        let Self { traces, predicted } = self;
        predicted.resize(run.current.len(), 0.0);
        run.current.predict(0.0, &run.time, &traces.current, &traces.charge, predicted);
        predicted
    }
}

impl GridRun {
    /// Simulates the run in free run. `start`: reading of the speed from which it goes on; 0: it rests. `finest`: longest inner step
    /// as a part of the time constant.
    pub fn simulate(&self, plant: &Physics, start: f64, finest: f64, traces: &mut Traces) {
        effort::simulated(1, self.simulated(plant, start, Detail { finest, keep: Keep::All }, traces));
    }

    fn simulated(&self, plant: &Physics, start: f64, detail: Detail, traces: &mut Traces) -> u64 {
        let mut input = AppliedInput::new(self, std::slice::from_ref(plant), plant);
        let state = self.start(plant, start);
        self.advance(plant, Features::of(plant), &mut input, state, detail, traces)
    }

    /// The same for one plant or several in lock-step, from a state. Returns the number of inner steps.
    #[inline(always)]
    pub(super) fn advance<F: Lanes>(
        &self,
        plant: &Physics<F>,
        features: Features,
        input: &mut AppliedInput,
        mut state: State<F>,
        Detail { finest, keep }: Detail,
        traces: &mut Traces,
    ) -> u64 {
        traces.make_room(self.blocks(), F::COUNT, keep);
        let longest = features.longest_step(finest);
        let mut dynamics = Dynamics::new(plant, features);
        let placed = !plant.torques.is_empty() || !plant.unnamed.is_empty();
        let with_position = placed && !self.position.is_empty();
        let none = state.theta.like(0.0);
        let (mut charge, mut steps) = (none, 0);
        traces.record(0, &state, state.current, charge, keep);
        for k in 0..self.blocks() {
            let (start, length) = (self.time[k], self.time[k + 1] - self.time[k]);
            let pieces = pieces(length, longest);
            let h = length / pieces;
            let mut mean = none;
            if with_position {
                dynamics.hold(&state, length, self.position_in(plant, k, 0, 1.0));
            }
            for piece in 0..pieces as usize {
                let applied = input.mean(none, self, k, start + (piece + 1) as f64 * h, h);
                let position =
                    if with_position { Some(self.position_in(plant, k, piece, pieces)) } else { None };
                steps += dynamics.advance(&mut state, applied, self.bridge[k], h, position);
                charge = charge + state.mean_current * h;
                mean = mean + applied;
            }
            let driven = plant.drive == Drive::Voltage && self.bridge[k] == Bridge::Driven;
            let current = match input.beyond(none, k) {
                Some(beyond) if driven => (state.current + beyond).within(plant.current_limit),
                _ => state.current,
            };
            traces.record(k + 1, &state, current, charge, keep);
            if keep == Keep::All {
                traces.applied[k] = mean.lane(0) / pieces;
            }
        }
        steps
    }

    /// The state in which a run begins, from the reading of its speed.
    pub(super) fn start(&self, plant: &Physics, reading: f64) -> State {
        let speed = if reading == 0.0 { 0.0 } else { (reading - plant.sensor_offset) / plant.sensor_scale };
        let start = if self.position.is_empty() { 0.0 } else { self.shaft(plant, 0) };
        let mut state = State::moving(plant, start, speed);
        state.time_s = self.since_s;
        let before = state.heat_w;
        state.heat_w = self.preheat.as_ref().map_or(before, |preheat| preheat.heat_w(plant, before));
        let driven = self.bridge.first() == Some(&Bridge::Driven);
        if self.since_s > 0.0 && driven {
            // It was driven before: what drives lies against the load.
            let push = plant.applied(self.input[0]) - plant.ke * speed;
            state.theta_load -= 0.5 * plant.gap_rad * push.signum();
        }
        if speed != 0.0 && driven && plant.drive == Drive::Voltage {
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

    #[inline(always)]
    fn position_in<F: Lanes>(&self, plant: &Physics<F>, block: usize, piece: usize, pieces: f64) -> (F, F) {
        let (from, to) = (self.position[block], self.position[block + 1]);
        let (start, end) = (piece as f64 / pieces, (piece + 1) as f64 / pieces);
        let scale = plant.sensor_scale;
        let at = |share: f64| scale.like(from + (to - from) * share) / scale;
        (at(start), at(end))
    }
}

/// Number of inner steps of a block; 200 bound the time that a gap in the log takes. Chosen by judgement; not studied.
#[inline(always)]
pub fn pieces(length: f64, longest: f64) -> f64 {
    (length / longest - 1e-9).ceil().clamp(1.0, 200.0)
}

/// How finely a run is simulated, and what is kept of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detail {
    /// Longest inner step as a part of the time constant.
    pub finest: f64,
    /// What is kept.
    pub keep: Keep,
}

/// What is kept of a simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keep {
    All,
    /// What the sensors of speed and current need.
    Sensed {
        current: bool,
    },
}

impl Keep {
    /// What the sensors of a run need.
    pub(super) fn sensed(run: &GridRun) -> Self {
        Self::Sensed { current: !run.current.is_empty() }
    }
}

impl Traces {
    /// Room for the points of so many blocks; what stands there is written over. Where all is kept, exactly so many. Buffers of fits
    /// only grow: one that is cut and filled again would be cleared each time.
    fn make_room(&mut self, blocks: usize, sets: usize, keep: Keep) {
        let points = (blocks + 1) * sets;
        if keep == Keep::All {
            for kept in
                [&mut self.omega, &mut self.reading, &mut self.integral, &mut self.current, &mut self.charge]
            {
                kept.resize(points, 0.0);
            }
            return self.applied.resize(blocks, 0.0);
        }
        for kept in [&mut self.reading, &mut self.integral, &mut self.current, &mut self.charge] {
            kept.resize(kept.len().max(points), 0.0);
        }
    }

    #[inline(always)]
    fn record<F: Lanes>(&mut self, point: usize, state: &State<F>, current: F, charge: F, keep: Keep) {
        let at = point * F::COUNT;
        state.reading.store(&mut self.reading[at..]);
        state.reading_integral.store(&mut self.integral[at..]);
        if keep == Keep::All {
            state.omega.store(&mut self.omega[at..]);
        }
        if keep != (Keep::Sensed { current: false }) {
            current.store(&mut self.current[at..]);
            charge.store(&mut self.charge[at..]);
        }
    }
}
