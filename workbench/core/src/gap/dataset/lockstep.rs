//! Several plants through the same runs in lock-step.

use super::applied_input::AppliedInput;
use super::run::GridRun;
use super::simulate::{Detail, Keep, Simulation};
use super::{Part, Probes};
use crate::system::plant::effort;
use crate::system::plant::features::{Features, alike};
use crate::system::plant::physics::Physics;
use crate::system::plant::simd::{Lanes, Pair, Register};
use crate::system::plant::state::State;
use crate::system::threads::*;
use pulp::{Arch, Simd, WithSimd};
use std::cell::Cell;

/// Sets that count as one pack: what two registers of the commonest processors hold. Narrower ones take a pack in
/// parts, so that counts of work do not depend on the machine. Origin: registers of AVX2 hold four numbers of 64
/// bits.
pub const PACK: usize = 8;
/// Sets of a pack that stay together where two threads share it: what one register of the commonest processors holds.
const HALF: usize = PACK / 2;

thread_local! {
    /// What a simulation writes into. Memory that is fetched and given back for each of them costs a tenth of the time.
    static BUFFERS: Cell<Simulation> = Cell::default();
}

/// A run with the start speed of each set.
pub struct Compared<'a> {
    /// The run.
    pub run: &'a GridRun,
    /// Reading of the speed from which each set goes on.
    pub starts: Vec<f64>,
}

/// Simulates runs with several plants and appends the weighted residuals of each to its own place of `out`. `finest`: longest
/// inner step as a part of the time constant. Plants that are alike advance together; the numbers do not depend on it.
pub fn lockstep(runs: &[Compared], plants: &[Physics], parts: &[Part], finest: f64, out: &mut [Vec<f64>]) {
    let mut left: Vec<(usize, &mut Vec<f64>)> = out.iter_mut().enumerate().collect();
    let mut packs: Vec<Pack> = Vec::new();
    while let Some(first) = left.first().map(|(first, _)| *first) {
        let alike = |(set, _): &(usize, _)| *set == first || alike(&plants[first], &plants[*set]);
        let (mut group, others): (Vec<_>, Vec<_>) = left.into_iter().partition(alike);
        left = others;
        while !group.is_empty() {
            let rest = group.split_off(group.len().min(PACK));
            packs.push(Pack { runs, plants, parts, finest, sets: std::mem::replace(&mut group, rest) });
        }
    }
    match packs.len() {
        0 | 1 => packs.into_iter().for_each(Pack::simulate),
        _ => each(packs).for_each(Pack::simulate),
    }
}

/// Some plants that are alike, with the places of their residuals.
struct Pack<'a, 'o> {
    runs: &'a [Compared<'a>],
    plants: &'a [Physics],
    parts: &'a [Part],
    finest: f64,
    sets: Vec<(usize, &'o mut Vec<f64>)>,
}

impl WithSimd for &mut Pack<'_, '_> {
    /// Steps of one set.
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u64 {
        if const { S::F64_LANES == 1 } {
            self.one_by_one()
        } else {
            self.side_by_side(Register::splat(simd, 0.0))
        }
    }
}

impl Pack<'_, '_> {
    /// Counts as one pack, whoever simulates it.
    fn simulate(self) {
        let (sets, steps) = (self.sets.len(), self.shared());
        effort::simulated(sets, steps);
    }

    /// Simulates the pack; in two halves where a thread is free, since half of a pack takes little more than half of the time.
    fn shared(mut self) -> u64 {
        let busy = Busy::begin();
        if self.sets.len() <= HALF || !busy.helper_is_free() {
            return self.in_registers();
        }
        let half = Self { sets: self.sets.split_off(HALF), ..self };
        let (steps, _) = join(|| self.in_registers(), || half.shared());
        steps
    }

    /// The one place where the plant is compiled for the processor's registers: in line, each caller would have a copy of all of it.
    #[inline(never)]
    fn in_registers(&mut self) -> u64 {
        Arch::new().dispatch(self)
    }

    /// Advances the pack in registers as wide as the processor's, two at a time.
    #[inline(always)]
    fn side_by_side<F: Lanes>(&mut self, one: F) -> u64 {
        let mut steps = 0;
        let mut sets = std::mem::take(&mut self.sets);
        for some in sets.chunks_mut(2 * F::COUNT) {
            steps = match some.len() {
                1 => self.alone(&mut some[0]),
                few if few <= F::COUNT => self.together(one, some),
                _ => self.together(Pair(one, one), some),
            };
        }
        steps
    }

    fn one_by_one(&mut self) -> u64 {
        let mut sets = std::mem::take(&mut self.sets);
        sets.iter_mut().fold(0, |_, set| self.alone(set))
    }

    fn alone(&self, (set, out): &mut (usize, &mut Vec<f64>)) -> u64 {
        let (mut simulation, mut steps) = (BUFFERS.take(), 0);
        for Compared { run, starts } in self.runs {
            let detail = Detail { finest: self.finest, keep: Keep::sensed(run) };
            let (predicted, taken) = simulation.sensed(run, &self.plants[*set], starts[*set], detail);
            steps += taken;
            Compare::new(self.parts, &run.speed).one(predicted, 1, 0, out);
            if !run.current.is_empty() {
                Compare::new(self.parts, &run.current).one(simulation.current(run), 1, 0, out);
            }
        }
        BUFFERS.set(simulation);
        steps
    }

    #[inline(always)]
    fn together<F: Lanes>(&self, like: F, group: &mut [(usize, &mut Vec<f64>)]) -> u64 {
        let sets: Vec<Physics> = group.iter().map(|(set, _)| self.plants[*set].clone()).collect();
        let (features, plant) = (Features::of(&sets[0]), Physics::side_by_side(&sets, like));
        let (mut steps, Simulation { mut traces, mut predicted }) = (0, BUFFERS.take());
        for Compared { run, starts } in self.runs {
            let starts = group.iter().map(|(set, _)| starts[*set]);
            let states: Vec<State> =
                sets.iter().zip(starts).map(|(plant, start)| run.start(plant, start)).collect();
            let state = State::side_by_side(&states, like);
            let mut input = AppliedInput::new(run, &sets, &plant);
            let detail = Detail { finest: self.finest, keep: Keep::sensed(run) };
            steps += run.advance(&plant, features, &mut input, state, detail, &mut traces);
            let seen = first(&mut predicted, run.speed.len() * F::COUNT);
            run.speed.predict(like, &run.time, &traces.reading, &traces.integral, seen);
            let compare = Compare::new(self.parts, &run.speed);
            for (lane, (_, out)) in group.iter_mut().enumerate() {
                compare.one(&predicted, F::COUNT, lane, out);
            }
            if run.current.is_empty() {
                continue;
            }
            let seen = first(&mut predicted, run.current.len() * F::COUNT);
            run.current.predict(like, &run.time, &traces.current, &traces.charge, seen);
            let compare = Compare::new(self.parts, &run.current);
            for (lane, (_, out)) in group.iter_mut().enumerate() {
                compare.one(&predicted, F::COUNT, lane, out);
            }
        }
        BUFFERS.set(Simulation { traces, predicted });
        steps
    }
}

/// The first places of a buffer, which only grows: one that is cut and filled again would be cleared each time.
fn first(buffer: &mut Vec<f64>, places: usize) -> &mut [f64] {
    if buffer.len() < places {
        buffer.resize(places, 0.0);
    }
    &mut buffer[..places]
}

/// What is compared of a signal.
struct Compare<'a> {
    parts: &'a [Part],
    probes: &'a Probes,
    /// True if every sample belongs to a part that counts.
    whole: bool,
}

impl<'a> Compare<'a> {
    fn new(parts: &'a [Part], probes: &'a Probes) -> Self {
        Self { parts, probes, whole: probes.part.iter().all(|part| parts.contains(part)) }
    }

    /// Appends the weighted residuals of one set of `width`.
    fn one(&self, predicted: &[f64], width: usize, set: usize, out: &mut Vec<f64>) {
        let Self { parts, probes, whole } = self;
        if probes.is_empty() {
            return;
        }
        let samples = probes.measured.iter().zip(&probes.weight).zip(predicted[set..].iter().step_by(width));
        let residuals = samples.map(|((measured, weight), predicted)| (measured - predicted) * weight);
        if *whole {
            return out.extend(residuals);
        }
        let counted = residuals.zip(&probes.part).filter(|(_, part)| parts.contains(part));
        out.extend(counted.map(|(residual, _)| residual));
    }
}
