//! All rows of a long log and of its hold-outs, simulated one stretch after another, never all at once in memory.

use super::observation::Observation;
use super::prepare::{Start, started};
use super::stretches::Stretches;
use super::{Dataset, GridRun, Simulation, driven_by};
use crate::system::log::Dynamic;
use crate::system::model::Model;
use crate::system::threads::of_each;

/// The records behind a dataset that holds stretches of them.
pub struct FullPass<'a> {
    stretches: Stretches<'a>,
    positions: Vec<f64>,
    observation: Observation,
    start: Start,
}

impl<'a> FullPass<'a> {
    /// The records that a dataset was made of; `None` if it holds them as a whole.
    pub fn of(model: &Model, log: &'a Dynamic, holdouts: &[&'a Dynamic], dataset: &Dataset) -> Option<Self> {
        dataset.searched.as_ref()?;
        let observation = Observation::choose(model, log, &dataset.scales);
        let stretches = Stretches::of(log, holdouts, &dataset.scales, &observation, &mut Vec::new());
        let plant = driven_by(&model.kind, model.physics(), log.input);
        let start =
            Start { plant, sigma: dataset.sigma, scales: dataset.scales, of_position: dataset.of_position };
        Some(Self { positions: stretches.positions(), stretches, observation, start })
    }

    /// Simulates what `each` asks for, stretch by stretch, and returns what it made of each, in order. `held_out`: only stretches
    /// that are. `each` gets the index of the run, too.
    pub fn each<T: Send>(
        &self,
        held_out: bool,
        each: impl Fn(usize, &GridRun, &mut Simulation) -> T + Sync,
    ) -> Vec<T> {
        let wanted: Vec<usize> =
            (0..self.stretches.len()).filter(|k| !held_out || self.stretches.holds_out(*k)).collect();
        of_each(wanted, |k| {
            let run = self.stretches.made(k, &self.observation, self.positions[k]);
            let run = started(run, &self.start, self.stretches.begins(k));
            each(self.stretches.piece(k), &run, &mut Simulation::default())
        })
    }

    /// Number of stretches.
    pub fn count(&self) -> usize {
        self.stretches.len()
    }
}
