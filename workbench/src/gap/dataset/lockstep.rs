//! Several plants through the same runs in lock-step.

use super::drawn::Drawn;
use super::run::BenchRun;
use super::simulate::Simulation;
use super::{Part, Probes};
use crate::gap::effort;
use crate::system::plant::lanes::{Lanes, Pair, Register};
use crate::system::plant::physics::Physics;
use crate::system::plant::shape::{Shape, alike};
use crate::system::plant::state::State;
use pulp::{Arch, Simd, WithSimd};
use std::cell::Cell;

/// Sets that count as one pack: what two registers of the commonest processors hold. Narrower ones take a pack in parts, so that
/// counts of work do not depend on the machine.
const PACK: usize = 8;

thread_local! {
    /// What a simulation writes into. Memory that is fetched and given back for each of them costs a tenth of the time.
    static BUFFERS: Cell<Simulation> = Cell::default();
}

/// A run with the start speed of each set.
pub struct Compared<'a> {
    /// The run.
    pub run: &'a BenchRun,
    /// Reading of the speed from which each set goes on.
    pub starts: Vec<f64>,
}

/// Simulates runs with several plants and appends the weighted residuals of each to its own place of `out`. `finest`: longest
/// inner step as a part of the time constant. Plants that are alike advance together; the numbers do not depend on it.
pub fn lockstep(runs: &[Compared], plants: &[Physics], parts: &[Part], finest: f64, out: &mut [Vec<f64>]) {
    let mut left: Vec<usize> = (0..plants.len()).collect();
    while let Some(first) = left.first().copied() {
        let (group, others) = left.iter().partition(|k| **k == first || alike(&plants[first], &plants[**k]));
        left = others;
        Arch::new().dispatch(Group { runs, plants, parts, finest, out, group });
    }
}

/// Plants that are alike.
struct Group<'a> {
    runs: &'a [Compared<'a>],
    plants: &'a [Physics],
    parts: &'a [Part],
    finest: f64,
    out: &'a mut [Vec<f64>],
    group: Vec<usize>,
}

impl WithSimd for Group<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let group = std::mem::take(&mut self.group);
        for pack in group.chunks(PACK) {
            let steps = if const { S::F64_LANES == 1 } {
                self.one_by_one(pack)
            } else {
                self.side_by_side(Register::splat(simd, 0.0), pack)
            };
            effort::simulated(pack.len(), steps);
        }
    }
}

impl Group<'_> {
    /// Advances a pack in registers as wide as the processor's, two at a time. Returns the steps of one set.
    #[inline(always)]
    fn side_by_side<F: Lanes>(&mut self, one: F, pack: &[usize]) -> u64 {
        let mut steps = 0;
        for some in pack.chunks(2 * F::COUNT) {
            steps = match some.len() {
                1 => self.one_by_one(some),
                few if few <= F::COUNT => self.together(one, some),
                _ => self.together(Pair(one, one), some),
            };
        }
        steps
    }

    fn one_by_one(&mut self, pack: &[usize]) -> u64 {
        pack.iter().fold(0, |_, set| self.alone(*set))
    }

    fn alone(&mut self, set: usize) -> u64 {
        let (mut simulation, mut steps) = (BUFFERS.take(), 0);
        for Compared { run, starts } in self.runs {
            let (predicted, taken) = simulation.sensed(run, &self.plants[set], starts[set], self.finest);
            steps += taken;
            compare(self.parts, &run.speed, predicted, 1, 0, &mut self.out[set]);
            if !run.current.is_empty() {
                compare(self.parts, &run.current, simulation.current(run), 1, 0, &mut self.out[set]);
            }
        }
        BUFFERS.set(simulation);
        steps
    }

    #[inline(always)]
    fn together<F: Lanes>(&mut self, like: F, group: &[usize]) -> u64 {
        let sets: Vec<Physics> = group.iter().map(|set| self.plants[*set].clone()).collect();
        let (shape, plant) = (Shape::of(&sets[0]), Physics::side_by_side(&sets, like));
        let (mut steps, Simulation { mut traces, mut predicted }) = (0, BUFFERS.take());
        for Compared { run, starts } in self.runs {
            let states: Vec<State> =
                sets.iter().zip(group).map(|(plant, set)| run.start(plant, starts[*set])).collect();
            let state = State::side_by_side(&states, like);
            let input = Drawn::new(run, &sets, &plant);
            steps += run.advance(&plant, shape, &input, state, self.finest, &mut traces);
            run.speed.predict(like, &run.time, &traces.reading, &traces.integral, &mut predicted);
            for (lane, set) in group.iter().enumerate() {
                compare(self.parts, &run.speed, &predicted, F::COUNT, lane, &mut self.out[*set]);
            }
            if run.current.is_empty() {
                continue;
            }
            run.current.predict(like, &run.time, &traces.current, &traces.charge, &mut predicted);
            for (lane, set) in group.iter().enumerate() {
                compare(self.parts, &run.current, &predicted, F::COUNT, lane, &mut self.out[*set]);
            }
        }
        BUFFERS.set(Simulation { traces, predicted });
        steps
    }
}

/// The weighted residuals of the parts that count, of one set of `width`.
fn compare(parts: &[Part], probes: &Probes, predicted: &[f64], width: usize, set: usize, out: &mut Vec<f64>) {
    if probes.is_empty() {
        return;
    }
    let samples = probes.measured.iter().zip(&probes.weight).zip(predicted[set..].iter().step_by(width));
    let residuals = samples.map(|((measured, weight), predicted)| (measured - predicted) * weight);
    if probes.part.iter().all(|part| parts.contains(part)) {
        return out.extend(residuals);
    }
    let counted = residuals.zip(&probes.part).filter(|(_, part)| parts.contains(part));
    out.extend(counted.map(|(residual, _)| residual));
}
