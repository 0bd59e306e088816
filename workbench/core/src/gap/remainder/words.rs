//! A dependence in words, and the experiment that narrows it down.

use crate::gap::dataset::Dataset;
use crate::gap::experiment::{Inputs, times};
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

/// What the remainder depends on, in a sentence without its end.
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
    let (what, profile) = narrowing(&Inputs::of(dataset), variables);
    let why = format!("what is left depends on {}: {what}", names(variables));
    Experiment::new(why, profile, dataset.input.unit())
}

/// What to measure where the remainder looks like noise.
pub fn repeat(dataset: &Dataset) -> Experiment {
    let once = Inputs::of(dataset).levels(&[0.3, 0.7, -0.3, -0.7], 4.0);
    let why =
        "the same input twice from the same start: what both runs have in common is no noise".to_owned();
    Experiment::new(why, times(&once, 2), dataset.input.unit())
}

/// The run that shows one variable while the others stay, in units of the largest input and the time constant. Four and five
/// time constants settle a speed within 2 and 0.7 %, 8 and 20 leave room for turns at that speed, 0.15 hardly changes it.
/// Chosen by judgement along these lines; not studied.
fn narrowing(inputs: &Inputs, variables: &[Variable]) -> (&'static str, Vec<Segment>) {
    let drive = |share: f64, taus: f64| inputs.drive(share, taus);
    let pair = variables.len() > 1;
    let place =
        |variable| matches!(variable, Variable::TurnOfMotor | Variable::TurnOfLoad | Variable::Position);
    let first = if variables.iter().any(|it| place(*it)) { Variable::Position } else { variables[0] };
    let what = match first {
        Variable::Position if pair => "cross the same places at several constant speeds, in both directions",
        Variable::Position => "cross every place slowly at one constant speed, in both directions",
        Variable::TravelSinceReversal => "reverse after short, middle and long ways at the same small input",
        Variable::TimeSinceReversal => "reverse with pauses of different length between",
        Variable::Current => BRIEFLY,
        Variable::Acceleration => "reach the same speeds quickly and slowly",
        Variable::Time => "run at one constant input for as long as the log lasts, twice",
        Variable::Direction => "the same speeds in both directions",
        _ => "hold many constant speeds in both directions until they settle",
    };
    let reversed = |pause: f64| [drive(0.4, 3.0), drive(0.0, pause), drive(-0.4, 3.0)];
    let profile = match first {
        Variable::Position if pair => inputs.levels(&[0.2, -0.2, 0.5, -0.5, 0.9, -0.9], 8.0),
        Variable::Position => inputs.levels(&[0.2, -0.2, 0.3, -0.3], 20.0),
        Variable::TravelSinceReversal => {
            [0.5, 1.0, 2.0, 4.0, 8.0].map(|taus| [drive(0.4, taus), drive(-0.4, taus)]).concat()
        }
        Variable::TimeSinceReversal => [0.1, 1.1, 4.1, 12.1].map(reversed).concat(),
        Variable::Current => {
            times(&[drive(0.5, 3.0), drive(0.9, 0.15), drive(0.5, 2.0), drive(0.1, 0.15)], 3)
        }
        Variable::Acceleration => [times(&[drive(0.8, 1.0), drive(-0.8, 1.0)], 3), ramp(inputs, 24)].concat(),
        Variable::Time => times(&[drive(0.5, 40.0), drive(0.0, 4.0)], 2),
        Variable::Direction => inputs.levels(&[0.3, -0.3, 0.6, -0.6, 0.9, -0.9], 4.0),
        _ => {
            let up = [0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0];
            inputs.levels(&[up, up.map(|share| -share)].concat(), 5.0)
        }
    };
    (what, profile)
}

const BRIEFLY: &str =
    "change the current at a speed that hardly changes: short steps of the input around a constant one";

/// A slow ramp up and down through both directions.
fn ramp(inputs: &Inputs, steps: usize) -> Vec<Segment> {
    let share = |k: usize| 0.8 * (std::f64::consts::TAU * k as f64 / steps as f64).sin();
    (0..steps).map(|k| inputs.drive(share(k), 1.5)).collect()
}
