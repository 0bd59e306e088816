//! What goes with the turn of a shaft. A torque that belongs to a place, or a friction that grips in one sector, leaves little
//! beside an effect that does not know the place, but it leaves it there; no imperfect form of another effect knows the turn.

use crate::gap::dataset::Part;
use crate::gap::remainder::structure::Structure;
use crate::gap::samples::Sample;
use crate::gap::search::Scored;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Periods per turn that are looked for together: an unround shaft, a bent one, a sector of a third.
const PERIODS: usize = 3;
/// Phases of a turn.
const PHASES: usize = 12;
/// What goes with the turn is worth a word from this share of the residual on.
const SHARE: f64 = 0.05;
/// A friction that goes with the turn is worth a word from this share on.
const GRIP_SHARE: f64 = 0.1;
/// What goes with the turn counts only if other "turns", whose periods are no simple part of one, explain so much less: by this many of their standard deviations.
const BEYOND_CHANCE: f64 = 1.5;
const NO_TURNS: [f64; 12] = [0.55, 0.61, 0.66, 0.72, 0.79, 0.87, 1.13, 1.17, 1.21, 1.28, 1.39, 1.45];
/// A torque or a reading of the place, which the form of another effect may imitate, must explain so many times what the best of
/// them does.
const BEYOND_BEST: f64 = 2.0;
/// A friction must change by this part of its level: the imperfect form of a level, whose residual is small, asks for less.
const CHANGE: f64 = 0.2;
/// The torque that is tried, as a part of the torque at the largest input: small, its trace is proportional to it.
const TRIED: f64 = 1e-2;

/// Phases of a wave that is tried: the same wave and one a quarter of a period further.
const WAVES: [f64; 2] = [0.0, FRAC_PI_2];

/// What goes with the turn of the encoder's shaft or of the load.
pub(super) fn goes_with(scored: &Scored, seen: &[Sample], residual: &[f64]) -> Option<Structure> {
    if scored.hypothesis.dataset.linear || residual.len() < 200 {
        return None;
    }
    let plant = scored.hypothesis.plant(&scored.fit.x);
    let level = 0.5 * (plant.friction_pos + plant.friction_neg);
    let mut shafts = vec![1.0];
    if plant.gear_ratio != 1.0 {
        shafts.push(1.0 / plant.gear_ratio);
    }
    let looked = Looked { scored, seen, residual };
    shafts.into_iter().find_map(|shaft| {
        let gripping = (level > 0.0).then(|| looked.gripping(shaft, level)).flatten();
        let pushing = || goes(|turns| looked.explained(Acts::Motor, turns).map_or(0.0, |it| it.share), shaft);
        let read = || goes(|turns| looked.phases(turns), shaft);
        gripping.or_else(pushing).or_else(read)
    })
}

/// Where is looked.
struct Looked<'s> {
    scored: &'s Scored<'s>,
    seen: &'s [Sample],
    residual: &'s [f64],
}

/// A torque or a reading that changes over the turn.
fn goes(share: impl Fn(f64) -> f64, shaft: f64) -> Option<Structure> {
    let found = share(shaft);
    let best = || NO_TURNS.iter().map(|turns| share(shaft * turns)).fold(0.0, f64::max);
    (found > SHARE && found > BEYOND_BEST * best()).then_some(Structure::Turn { share: found })
}

/// What waves of one kind explain.
struct Explained {
    /// Share of the residual's square.
    share: f64,
    /// Their torque, N m.
    torque: f64,
}

impl Looked<'_> {
    /// A friction whose level changes over the turn.
    fn gripping(&self, shaft: f64, level: f64) -> Option<Structure> {
        let found = self.explained(Acts::Friction, shaft)?;
        if found.share < GRIP_SHARE || found.torque < CHANGE * level {
            return None;
        }
        let chance: Vec<f64> = NO_TURNS
            .iter()
            .filter_map(|turns| self.explained(Acts::Friction, shaft * turns))
            .map(|explained| explained.share)
            .collect();
        let mean = chance.iter().sum::<f64>() / chance.len() as f64;
        let square = chance.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / chance.len() as f64;
        let beyond = found.share > mean + BEYOND_CHANCE * square.sqrt();
        beyond.then_some(Structure::FrictionOfTurn { share: found.share })
    }

    /// Share of the residual's square that its means over phases of a turn explain.
    fn phases(&self, turns: f64) -> f64 {
        let period = TAU / turns;
        let (mut sums, mut counts) = ([0.0; PHASES], [0.0; PHASES]);
        let mean = self.residual.iter().sum::<f64>() / self.residual.len() as f64;
        for (sample, residual) in self.seen.iter().zip(self.residual) {
            let phase = (sample.position / period).rem_euclid(1.0) * PHASES as f64;
            let bin = (phase as usize).min(PHASES - 1);
            sums[bin] += residual - mean;
            counts[bin] += 1.0;
        }
        let total: f64 = self.residual.iter().map(|residual| (residual - mean).powi(2)).sum();
        let bins = sums.iter().zip(&counts).filter(|(_, count)| **count > 0.0);
        bins.map(|(sum, count)| sum * sum / count).sum::<f64>() / total
    }

    /// What waves of a turn of the shaft explain together.
    fn explained(&self, acts: Acts, turns: f64) -> Option<Explained> {
        let waves: Vec<(usize, f64)> =
            (1..=PERIODS).flat_map(|period| WAVES.map(|phase| (period, phase))).collect();
        let columns: Vec<DVector<f64>> = waves
            .par_iter()
            .map(|(period, phase)| trace(self.scored, self.seen, *phase, acts, *period as f64 * turns))
            .collect();
        let matrix = DMatrix::from_columns(&columns);
        let residual = DVector::from_column_slice(self.residual);
        let projected = matrix.tr_mul(&residual);
        let solved = matrix.tr_mul(&matrix).cholesky()?.solve(&projected);
        Some(Explained {
            share: solved.dot(&projected) / residual.norm_squared(),
            torque: solved.norm() * TRIED * self.scored.hypothesis.dataset.scales.torque,
        })
    }
}

/// What a small torque, or a little more friction, does to the prediction, in units of the noise.
fn trace(scored: &Scored, seen: &[Sample], phase: f64, acts: Acts, periods: f64) -> DVector<f64> {
    let scales = &scored.hypothesis.dataset.scales;
    let mut plant = scored.hypothesis.plant(&scored.fit.x);
    let parameters = [TRIED * scales.torque, periods, phase];
    plant.torques.push(TorqueLaw { law: Law::Wave, parameters, acts });
    let mut predicted = Vec::with_capacity(seen.len());
    let hypothesis = &scored.hypothesis;
    hypothesis.simulated(&scored.fit.x, &plant, |index, _, values| {
        let run = &scored.hypothesis.dataset.runs[index];
        let compared = values.iter().zip(&run.speed.part);
        predicted.extend(compared.filter(|(_, part)| matches!(part, Part::A | Part::B)).map(|(v, _)| *v));
    });
    let changes = predicted.iter().zip(seen);
    DVector::from_iterator(
        seen.len(),
        changes.map(|(value, sample)| (value - sample.predicted) * sample.weight),
    )
}
