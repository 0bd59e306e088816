//! A dependence in words, and the experiment that narrows it down.

use crate::gap::dataset::Dataset;
use crate::outcome::{Experiment, Segment};
use crate::system::plant::unnamed::Variable;

/// A variable as a reader knows it.
pub fn name(variable: Variable) -> &'static str {
    match variable {
        Variable::Speed => "the speed",
        Variable::TurnOfMotor => "the place within a turn of the encoder's shaft",
        Variable::TurnOfLoad => "the place within a turn of the load",
        Variable::Position => "the position",
        Variable::TravelSinceReversal => "the travel since the last reversal",
        Variable::TimeSinceReversal => "the time since the last reversal",
        Variable::Direction => "the direction of the motion",
        Variable::Current => "the current",
        Variable::Input => "the input",
        Variable::Acceleration => "the acceleration",
        Variable::Time => "the time since the start",
    }
}

/// Its unit.
pub fn unit(variable: Variable, linear: bool, input: &'static str) -> &'static str {
    match (variable, linear) {
        (Variable::Speed, false) => "rad/s",
        (Variable::Speed, true) => "m/s",
        (Variable::Position | Variable::TravelSinceReversal, true) => "m",
        (Variable::Acceleration, false) => "rad/s²",
        (Variable::Acceleration, true) => "m/s²",
        (Variable::Time | Variable::TimeSinceReversal, _) => "s",
        (Variable::Direction, _) => "1",
        (Variable::Current, _) => "A",
        (Variable::Input, _) => input,
        _ => "rad",
    }
}

/// Variables joined by "and".
pub fn names(variables: &[Variable]) -> String {
    variables.iter().map(|variable| name(*variable)).collect::<Vec<_>>().join(" and ")
}

/// What the rest depends on, in a sentence without its end.
pub fn sentence(variables: &[Variable], share: f64) -> String {
    let verb = format!("predicts {:.0} % of what is left on held-out data", 100.0 * share);
    match variables {
        [one] => format!("depends on {}, which {verb}", name(*one)),
        _ => format!(
            "depends on {}; together they {}",
            names(variables),
            verb.replacen("predicts", "predict", 1)
        ),
    }
}

/// What to measure next to see the dependence by itself.
pub fn experiment(variables: &[Variable], dataset: &Dataset) -> Experiment {
    let rig = Rig { full: dataset.scales.input, tau: dataset.scales.time };
    let (what, profile) = rig.narrowing(variables);
    let why = format!("what is left depends on {}: {what}", names(variables));
    Experiment::new(why, profile, dataset.input.unit())
}

/// What to measure where the rest looks like noise.
pub fn repeat(dataset: &Dataset) -> Experiment {
    let rig = Rig { full: dataset.scales.input, tau: dataset.scales.time };
    let once = [rig.drive(0.3, 4.0), rig.drive(0.7, 4.0), rig.drive(-0.3, 4.0), rig.drive(-0.7, 4.0)];
    let why =
        "the same input twice from the same start: what both runs have in common is no noise".to_owned();
    Experiment::new(why, rig.times(&once, 2), dataset.input.unit())
}

/// Inputs in units of the largest one, durations in time constants.
struct Rig {
    full: f64,
    tau: f64,
}

impl Rig {
    fn drive(&self, share: f64, taus: f64) -> Segment {
        Segment::driven(share * self.full, taus * self.tau)
    }

    fn times(&self, pieces: &[Segment], times: usize) -> Vec<Segment> {
        std::iter::repeat_n(pieces, times).flatten().cloned().collect()
    }

    fn levels(&self, shares: &[f64], taus: f64) -> Vec<Segment> {
        shares.iter().map(|share| self.drive(*share, taus)).collect()
    }

    /// The run that shows one variable while the others stay.
    fn narrowing(&self, variables: &[Variable]) -> (&'static str, Vec<Segment>) {
        let pair = variables.len() > 1;
        let has = |variable| variables.contains(&variable);
        let place = has(Variable::TurnOfMotor) || has(Variable::TurnOfLoad) || has(Variable::Position);
        if place && pair {
            return (
                "cross the same places at several constant speeds, in both directions",
                self.levels(&[0.2, -0.2, 0.5, -0.5, 0.9, -0.9], 8.0),
            );
        }
        match variables[0] {
            _ if place => (
                "cross every place slowly at one constant speed, in both directions",
                self.levels(&[0.2, -0.2, 0.3, -0.3], 20.0),
            ),
            Variable::TravelSinceReversal => (
                "reverse after short, middle and long ways at the same small input",
                [0.5, 1.0, 2.0, 4.0, 8.0]
                    .iter()
                    .flat_map(|taus| [self.drive(0.4, *taus), self.drive(-0.4, *taus)])
                    .collect(),
            ),
            Variable::TimeSinceReversal => (
                "reverse with pauses of different length between",
                [0.0, 1.0, 4.0, 12.0]
                    .iter()
                    .flat_map(|taus| {
                        [self.drive(0.4, 3.0), self.drive(0.0, *taus + 0.1), self.drive(-0.4, 3.0)]
                    })
                    .collect(),
            ),
            Variable::Current => (
                "change the current at a speed that hardly changes: short steps of the input around a constant one",
                self.times(
                    &[
                        self.drive(0.5, 3.0),
                        self.drive(0.9, 0.15),
                        self.drive(0.5, 2.0),
                        self.drive(0.1, 0.15),
                    ],
                    3,
                ),
            ),
            Variable::Acceleration => (
                "reach the same speeds quickly and slowly",
                [self.times(&[self.drive(0.8, 1.0), self.drive(-0.8, 1.0)], 3), self.ramp(24)].concat(),
            ),
            Variable::Time => (
                "run at one constant input for as long as the log lasts, twice",
                self.times(&[self.drive(0.5, 40.0), self.drive(0.0, 4.0)], 2),
            ),
            Variable::Direction => {
                ("the same speeds in both directions", self.levels(&[0.3, -0.3, 0.6, -0.6, 0.9, -0.9], 4.0))
            }
            _ => (
                "hold many constant speeds in both directions until they settle",
                self.levels(
                    &[0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0, -0.1, -0.2, -0.3, -0.45, -0.6, -0.8, -1.0],
                    5.0,
                ),
            ),
        }
    }

    /// A slow ramp up and down through both directions.
    fn ramp(&self, steps: usize) -> Vec<Segment> {
        let share = |k: usize| 0.8 * (std::f64::consts::TAU * k as f64 / steps as f64).sin();
        (0..steps).map(|k| self.drive(share(k), 1.5)).collect()
    }
}
