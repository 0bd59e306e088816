//! What would make the next record better, in sentences for the person who logs.

use super::answer::{Answer, Time, smallest_step, speed};
use super::column_plan::{Plan, Proposal};
use super::spelling::short;
use super::{Dynamic, Quantity, Run};

/// Rows of an answer that a comparison needs. Chosen by judgement; not studied.
const FEW_ROWS: usize = 5;
/// Half the central 90 % of the steps, relative to the usual step, beyond which the time stamps are uneven. Chosen by
/// judgement; not studied.
const UNEVEN: f64 = 0.1;
/// An output in fewer steps than this over its range is coarse. Chosen by judgement; not studied.
const COARSE: f64 = 200.0;
/// Fewer levels of the input than this show no curve. Chosen by judgement; not studied.
const FEW_LEVELS: usize = 4;
/// The weaker direction, relative to the stronger one, below which there is one direction alone. Chosen by judgement;
/// not studied.
const ONE_SIDED: f64 = 0.05;

/// What would make the next record better.
pub(super) fn ask(record: &Dynamic, plan: &Plan, time: Time, answer: Option<Answer>) -> Vec<String> {
    let asked = [about_answer(answer), about_motion(record), about_time(time), about_columns(record, plan)];
    asked.into_iter().flatten().filter(|asked| asked.0).map(|asked| asked.1).collect()
}

fn about_answer(answer: Option<Answer>) -> Vec<(bool, String)> {
    let Some(answer) = answer else {
        let what = "No change of the input shows in the output: log from before a step until it has settled. If the log does, check that both belong to one motor.";
        return vec![(true, what.into())];
    };
    let against = "The speed falls when the input rises: unless a brake is measured, turn one sign round with *-1 in --columns.";
    let before = "The speed changes before the input does. Write both in the same moment, the input that acts until the next row; \
                  if a controller answers the speed, this is its answer.";
    let fast = "Log faster if you can: an answer of the speed is over within a few rows.";
    vec![
        (answer.correlation < 0.0, against.into()),
        (answer.rows < 1, before.into()),
        (answer.fades_rows.is_some_and(|rows| rows < FEW_ROWS), fast.into()),
    ]
}

fn about_motion(record: &Dynamic) -> Vec<(bool, String)> {
    let input = || record.runs.iter().flat_map(|run| run.input.iter().copied());
    let (one_way, levels) = (one_sided(input()), few_levels(input()));
    let turns_one_way = || one_sided(record.runs.iter().filter_map(speed).flat_map(|it| it.into_owned()));
    vec![
        (one_way, format!("Drive both directions: {} has one sign only.", record.input.column())),
        (
            !one_way && turns_one_way(),
            "Let the motor turn in both directions: the speed has one sign only.".into(),
        ),
        (
            levels < FEW_LEVELS,
            format!("Use more levels of the input than {levels}: steps, and a slow ramp through zero."),
        ),
    ]
}

fn about_time(time: Time) -> Vec<(bool, String)> {
    let uneven = "Take the time in the controller, in the moment of the measurement: the steps are uneven.";
    vec![
        (time.jitter > UNEVEN, uneven.into()),
        (time.gaps > 0, format!("Lose no rows: a step of {} s is longer than usual.", short(time.longest_s))),
    ]
}

fn about_columns(record: &Dynamic, plan: &Plan) -> Vec<(bool, String)> {
    let proposed = plan.proposals.iter().any(|proposal| proposal.item.starts_with("duty"));
    let duty = proposed || plan.has(Quantity::Duty) && !plan.has(Quantity::Voltage);
    let supply = plan.origin(Quantity::Supply);
    let is_supply = |proposal: &Proposal| proposal.item.starts_with("vbus") && proposal.column.is_some();
    let supply = supply.is_some_and(|origin| !origin.formula.indices().is_empty())
        || plan.proposals.iter().any(is_supply);
    let current =
        record.input != super::Input::Voltage || record.runs.iter().all(|run| run.current_a.is_some());
    let coarse = "Log the position in counts beside the speed: the speed comes in coarse steps.";
    let sags = "Log the supply voltage: a duty is multiplied by it, and it sags under load.";
    let tells = "Log the winding current if you can measure it: it tells friction from a weak motor.";
    vec![
        (is_coarse(&record.runs), coarse.into()),
        (duty && !supply, sags.into()),
        (!current, tells.into()),
        (record.runs.len() == 1, "Keep a second record of the same motor for --holdout.".into()),
    ]
}

fn one_sided(values: impl Iterator<Item = f64>) -> bool {
    let (min, max) = values.fold((0.0_f64, 0.0_f64), |(min, max), value| (min.min(value), max.max(value)));
    (-min).min(max) < ONE_SIDED * (-min).max(max)
}

/// How many different values there are, up to as many as are enough.
fn few_levels(values: impl Iterator<Item = f64>) -> usize {
    let mut levels: Vec<f64> = Vec::new();
    for value in values {
        if !levels.contains(&value) {
            levels.push(value);
        }
        if levels.len() == FEW_LEVELS {
            break;
        }
    }
    levels.len()
}

/// A measured speed in few steps.
fn is_coarse(runs: &[Run]) -> bool {
    let speeds = || runs.iter().filter_map(|run| run.speed.as_ref()).flatten().copied();
    let range = speeds().fold(0.0, f64::max) - speeds().fold(0.0, f64::min);
    smallest_step(speeds()).is_some_and(|step| range < COARSE * step)
}
