//! What goes with the turn of a shaft. A torque that belongs to a place, or a friction that grips in one sector, leaves little
//! beside an effect that does not know the place, but it leaves it there; no imperfect form of another effect knows the turn.

use super::left::{Left, SAMPLES, explained};
use super::regression::{Sums, predicted};
use super::structure::Structure;
use crate::gap::dataset::Part;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};
use crate::system::threads::of_each;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Periods per turn that are looked for together: an unround shaft, a bent one, a sector of a third. Chosen by
/// judgement; not studied.
const PERIODS: usize = 3;
/// Phases of a turn. Chosen by judgement; not studied.
const PHASES: usize = 12;
/// What goes with the turn is worth a word from this share of the residual on. Origin: design cases; right names in
/// another form leave 0.3 to 1.3 % there, friction that grips in a sector of the turn 9 to 45 %.
const SHARE: f64 = 0.05;
/// A friction that goes with the turn is worth a word from this share on. Origin: design cases; with this and the two
/// limits below, 22 of 24 gripping sectors are told and no right friction of 14.
const GRIP_SHARE: f64 = 0.1;
/// What goes with the turn counts only if other "turns", whose periods are no simple part of one, explain so much
/// less: by this many of their standard deviations. Origin: as [`GRIP_SHARE`].
const BEYOND_CHANCE: f64 = 1.5;
const NO_TURNS: [f64; 12] = [0.55, 0.61, 0.66, 0.72, 0.79, 0.87, 1.13, 1.17, 1.21, 1.28, 1.39, 1.45];
/// A torque or a reading of the place, which the form of another effect may imitate, must explain so many times what
/// the best of them does. Origin: design cases; gripping sectors explain about twice as much and more.
const BEYOND_BEST: f64 = 2.0;
/// A friction must change by this part of its level. Origin: design cases; the imperfect form of a right friction
/// asks for 1 to 15 %, a gripping sector for 25 to 90 %.
const CHANGE: f64 = 0.2;
/// The torque that is tried, as a part of the torque at the largest input: small, its trace is proportional to it.
/// Chosen by judgement; not studied.
const TRIED: f64 = 1e-2;

/// Phases of a wave that is tried: the same wave and one a quarter of a period further.
const WAVES: [f64; 2] = [0.0, FRAC_PI_2];

/// What goes with the turn of the encoder's shaft or of the load.
pub(super) fn goes_with(left: &Left) -> Option<Structure> {
    if left.scored.hypothesis.dataset.linear || left.residual.len() < SAMPLES {
        return None;
    }
    let plant = left.scored.plant();
    let level = 0.5 * (plant.friction_pos + plant.friction_neg);
    let load = (plant.gear_ratio != 1.0).then_some(1.0 / plant.gear_ratio);
    [1.0].into_iter().chain(load).find_map(|shaft| {
        let gripping = (level > 0.0).then(|| gripping(left, shaft, level)).flatten();
        let pushing = || goes(|turns| waves(left, Acts::Motor, turns).map_or(0.0, |it| it.share), shaft);
        let read = || goes(|turns| phases(left, turns), shaft);
        gripping.or_else(pushing).or_else(read)
    })
}

/// A torque or a reading that changes over the turn.
fn goes(share: impl Fn(f64) -> f64, shaft: f64) -> Option<Structure> {
    let found = share(shaft);
    let best = || NO_TURNS.iter().map(|turns| share(shaft * turns)).fold(0.0, f64::max);
    (found > SHARE && found > BEYOND_BEST * best()).then_some(Structure::Turn { share: found })
}

/// A friction whose level changes over the turn.
fn gripping(left: &Left, shaft: f64, level: f64) -> Option<Structure> {
    let found = waves(left, Acts::Friction, shaft)?;
    if found.share < GRIP_SHARE || found.torque < CHANGE * level {
        return None;
    }
    let others = NO_TURNS.iter().filter_map(|turns| waves(left, Acts::Friction, shaft * turns));
    let chance: Vec<f64> = others.map(|waves| waves.share).collect();
    let mean = chance.iter().sum::<f64>() / chance.len() as f64;
    let square = chance.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / chance.len() as f64;
    let beyond = found.share > mean + BEYOND_CHANCE * square.sqrt();
    beyond.then_some(Structure::FrictionOfTurn { share: found.share })
}

/// Share of the residual's square that its means over phases of a turn explain.
fn phases(left: &Left, turns: f64) -> f64 {
    let mean = left.residual.iter().sum::<f64>() / left.residual.len() as f64;
    let centred: Vec<f64> = left.residual.iter().map(|residual| residual - mean).collect();
    let phase = |position: f64| (position / (TAU / turns)).rem_euclid(1.0) * PHASES as f64;
    explained(&centred, left.seen.iter().map(|sample| (phase(sample.position) as usize).min(PHASES - 1)))
}

/// What waves of one kind explain together.
struct Waves {
    /// Share of the residual's square.
    share: f64,
    /// Their torque, N m.
    torque: f64,
}

/// What waves of a turn of the shaft explain together.
fn waves(left: &Left, acts: Acts, turns: f64) -> Option<Waves> {
    let waves: Vec<(usize, f64)> =
        (1..=PERIODS).flat_map(|period| WAVES.map(|phase| (period, phase))).collect();
    let columns = of_each(&waves, |(period, phase)| trace(left, *phase, acts, *period as f64 * turns));
    let residual = DVector::from_column_slice(&left.residual);
    let Sums { information, projected } = Sums::of(&DMatrix::from_columns(&columns), &residual);
    let solved = information.cholesky()?.solve(&projected);
    Some(Waves {
        share: solved.dot(&projected) / residual.norm_squared(),
        torque: solved.norm() * TRIED * left.scored.hypothesis.dataset.scales.torque,
    })
}

/// What a small torque, or a little more friction, does to the prediction, in units of the noise.
fn trace(left: &Left, phase: f64, acts: Acts, periods: f64) -> DVector<f64> {
    let hypothesis = &left.scored.hypothesis;
    let mut plant = left.scored.plant();
    let parameters = [TRIED * hypothesis.dataset.scales.torque, periods, phase];
    plant.torques.push(TorqueLaw { law: Law::Wave, parameters, acts });
    let parts = hypothesis.dataset.runs.iter().flat_map(|run| &run.speed.part);
    let all = predicted(hypothesis, &left.scored.fit.x, &plant).into_iter().zip(parts);
    let log = all.filter(|(_, part)| matches!(part, Part::A | Part::B));
    let change = log.zip(&left.seen).map(|((value, _), seen)| (value - seen.predicted) * seen.weight);
    DVector::from_vec(change.collect())
}
