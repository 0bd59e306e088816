//! What the remainder may depend on: one variable at a time, and a few pairs.

use super::track::Tracks;
use crate::gap::dataset::Dataset;
use crate::system::plant::physics::Physics;
use crate::system::plant::unnamed::{Acting, Knots, Term, Variable};
use std::f64::consts::TAU;

/// Knots over one variable: the bins in which a person would look at a residual. Chosen by judgement; not studied.
const KNOTS: usize = 16;
/// Knots over a turn. Origin: three a period show up to eight periods.
const KNOTS_OF_TURN: usize = 24;
/// Knots of the first and of the second variable of a pair. Chosen by judgement; not studied.
const KNOTS_OF_PAIR: (usize, usize) = (12, 5);
/// Knots over the time of a run: coarser than the pieces into which the folds cut it. Chosen by judgement; not
/// studied.
const KNOTS_OF_TIME: usize = 8;
/// Speed below which a direction is not certain, as a part of the largest speed. Chosen by judgement; not studied.
const STANDSTILL: f64 = 0.02;
/// The knots span the values but for this part on either side, where they are too rare to say anything. Chosen by
/// judgement; not studied.
const RARE: f64 = 0.005;

/// One dependence that is tried.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// A table without values.
    pub term: Term,
    /// True if it is one variable; what belongs to a reversal comes with the direction after it.
    pub simple: bool,
}

impl Candidate {
    /// The variables that a report tells.
    pub fn told(&self) -> Vec<Variable> {
        told(&self.term)
    }
}

/// The variables of a term that a report tells: since a reversal, the direction goes without saying.
pub fn told(term: &Term) -> Vec<Variable> {
    let all: Vec<Variable> = term.over.iter().map(|knots| knots.variable).collect();
    match all[..] {
        [since @ (Variable::TravelSinceReversal | Variable::TimeSinceReversal), Variable::Direction] => {
            vec![since]
        }
        _ => all,
    }
}

/// Speed below which no direction is certain.
pub fn standstill(dataset: &Dataset) -> f64 {
    STANDSTILL * dataset.scales.speed
}

/// All that are tried on these data, in the order in which the first of two equals is preferred.
pub fn all(dataset: &Dataset, plant: &Physics, tracks: &Tracks, acts: Acting) -> Vec<Candidate> {
    use Variable as V;
    let turns: &[V] = match (dataset.linear, plant.gear_ratio == 1.0) {
        (true, _) => &[],
        (_, true) => &[V::TurnOfMotor],
        _ => &[V::TurnOfMotor, V::TurnOfLoad],
    };
    let maker = Maker { tracks, acts, standstill: standstill(dataset) };
    let places = turns.iter().copied().chain([V::Position]);
    let mut made = vec![maker.one(V::Speed)];
    made.extend(turns.iter().map(|turn| maker.one(*turn)));
    made.extend(turns.iter().map(|turn| maker.reading(*turn)));
    made.push(maker.since(V::TravelSinceReversal));
    made.extend([V::Position, V::Direction, V::Current, V::Input].map(|it| maker.one(it)));
    made.push(maker.since(V::TimeSinceReversal));
    made.extend([V::Time, V::Acceleration].map(|it| maker.one(it)));
    for place in places {
        made.extend([V::Direction, V::Speed, V::Acceleration].map(|other| maker.pair(place, other)));
    }
    made.extend([V::Acceleration, V::Current, V::Time].map(|other| maker.pair(V::Speed, other)));
    made.retain(|it| it.term.over.iter().all(|knots| knots.at.len() > 1));
    made
}

struct Maker<'t> {
    tracks: &'t Tracks,
    acts: Acting,
    standstill: f64,
}

impl Maker<'_> {
    fn one(&self, variable: Variable) -> Candidate {
        self.made(&[(variable, KNOTS)], self.acts, true)
    }

    fn reading(&self, turn: Variable) -> Candidate {
        self.made(&[(turn, KNOTS)], Acting::Reading, true)
    }

    fn since(&self, variable: Variable) -> Candidate {
        self.made(&[(variable, KNOTS_OF_PAIR.0), (Variable::Direction, 2)], self.acts, true)
    }

    fn pair(&self, first: Variable, second: Variable) -> Candidate {
        self.made(&[(first, KNOTS_OF_PAIR.0), (second, KNOTS_OF_PAIR.1)], self.acts, false)
    }

    fn made(&self, over: &[(Variable, usize)], acts: Acting, simple: bool) -> Candidate {
        let over: Vec<Knots> = over.iter().map(|(variable, count)| self.knots(*variable, *count)).collect();
        let values = vec![0.0; Term::size(&over)];
        Candidate { term: Term { over, values, acts, standstill: self.standstill }, simple }
    }

    /// Knots halfway between even ones and those with as many samples between each two: the ends of a range and the places where
    /// the motion dwells both get their share.
    fn knots(&self, variable: Variable, count: usize) -> Knots {
        let at = match variable {
            Variable::Direction => vec![-1.0, 1.0],
            _ if variable.is_periodic() => {
                let count = if count == KNOTS { KNOTS_OF_TURN } else { count };
                (0..count).map(|k| TAU * k as f64 / count as f64).collect()
            }
            Variable::Time => self.spread(variable, count.min(KNOTS_OF_TIME)),
            _ => self.spread(variable, count),
        };
        Knots { variable, at }
    }

    fn spread(&self, variable: Variable, count: usize) -> Vec<f64> {
        let mut values = self.tracks.values(variable, self.standstill);
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
        let (low, high) = (at(RARE), at(1.0 - RARE));
        let width = high - low;
        let knot = |k: usize| {
            let share = k as f64 / (count - 1) as f64;
            0.5 * (low + width * share + at(RARE + (1.0 - 2.0 * RARE) * share))
        };
        let mut knots: Vec<f64> = (0..count).map(knot).collect();
        knots.dedup_by(|b, a| *b - *a <= 1e-3 * width || !b.is_finite());
        knots
    }
}
