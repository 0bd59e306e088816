//! What a stranger would see in a log before any model is asked: columns, time, answer of the output to the input, and what
//! is missing for a good comparison.

use super::columns::{Columns, Plan};
use super::dialect::{Cells, missing};
use super::names::{Meaning, Sure, Topic, name_of};
use super::propose::{Extent, short};
use super::read::{Sheet, cells};
use super::{Dynamic, Log, Quantity, Reading, Run};
use crate::console::input_error::InputError;
use serde::Serialize;
use std::path::Path;

/// A step beyond this many usual ones is a gap.
const GAP: f64 = 1.5;
/// Lag from which on it is looked for, rows: below 1 the output is first.
const FIRST_LAG: i64 = -3;
/// Share of the peak at which the answer begins: a first-order answer jumps to its peak and fades from there, and noise moves
/// a flat peak, not its edge.
const ONSET: f64 = 0.5;
/// Rows over which an answer of the output is looked for.
const LONGEST_LAG: usize = 200;
/// Standard deviations of chance that a correlation has to exceed.
const CHANCE: f64 = 6.0;
/// Rows of an answer that a comparison needs.
const FEW_ROWS: usize = 5;
/// Half the central 90 % of the steps, relative to the usual step, beyond which the time stamps are uneven.
const UNEVEN: f64 = 0.1;
/// An output in fewer steps than this over its range is coarse.
const COARSE: f64 = 200.0;
/// The weaker direction, relative to the stronger one, below which there is one direction alone.
const ONE_SIDED: f64 = 0.05;

/// What is seen in a file.
#[derive(Clone, Debug, Serialize)]
pub struct Look {
    /// `truing-look/1`.
    pub schema: &'static str,
    /// The file.
    pub file: String,
    /// Name of the encoding.
    pub encoding: &'static str,
    /// What parts the cells.
    pub separator: &'static str,
    /// True: `0,5` is a half.
    pub decimal_comma: bool,
    /// Rows of the table.
    pub rows: usize,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Why the log cannot be read; none if it can, with `columns_argument` where it is not empty.
    pub refused: Option<String>,
    /// What `--columns` has to say; empty where the names say everything.
    pub columns_argument: String,
    /// What speaks for it, and what in it is guessed.
    pub guessed: Vec<String>,
    /// The time.
    pub time: Option<Time>,
    /// How the output answers the input.
    pub answer: Option<Answer>,
    /// How the file was read, in sentences.
    pub notes: Vec<String>,
    /// What would make the next record better, in sentences.
    pub ask: Vec<String>,
    /// The log, if it can be read.
    #[serde(skip)]
    pub log: Option<Log>,
}

/// One column of the file, in its own unit.
#[derive(Clone, Debug, Serialize)]
pub struct Column {
    /// Its name in the file.
    pub name: String,
    /// What it is taken for: a name of ours, or the quantity if the unit is not known.
    pub seems: Option<String>,
    /// Is it read?
    pub state: State,
    /// Least value.
    pub min: Option<f64>,
    /// Greatest value.
    pub max: Option<f64>,
    /// Smallest difference between two values.
    pub step: Option<f64>,
    /// Cells without a number.
    pub empty: usize,
}

/// Is a column read?
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Yes.
    Read,
    /// With `--columns`.
    Proposed,
    /// No.
    Unused,
}

/// The time of a record.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Time {
    /// Continuous records.
    pub records: usize,
    /// All of them together, s.
    pub seconds: f64,
    /// Rows a second: from the median step.
    pub rate_hz: f64,
    /// Half the central 90 % of the steps, relative to the median.
    pub jitter: f64,
    /// Steps beyond 1.5 times the median.
    pub gaps: usize,
    /// The longest step, s.
    pub longest_s: f64,
}

/// Where changes of the input and of the speed are most alike.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Answer {
    /// Rows from a change of the input to the beginning of the speed's. 1: at once, 0 or less: the speed is first.
    pub rows: i64,
    /// Time beyond the next row, s.
    pub delay_s: f64,
    /// The largest correlation of the changes; negative: the speed falls when the input rises.
    pub correlation: f64,
    /// Rows until the correlation has fallen to 1/e: about the slowest time constant.
    pub fades_rows: Option<usize>,
}

/// Looks at a file.
pub fn look(path: &Path, columns: &Columns) -> Result<Look, InputError> {
    let cells = cells(path)?;
    let source = path.display().to_string();
    let plan = columns.plan(&source, &cells, true)?;
    let assumed = columns.with(&plan.items)?;
    let read = || {
        if plan.missing.is_some() {
            plan.complete(&source, cells.header_line)?;
        }
        let plan = assumed.plan(&source, &cells, true)?;
        Sheet::of(&source, &cells, plan, &assumed, true).reading()
    };
    let (log, notes, refused) = match read() {
        Ok(Reading { log, notes }) => (Some(log), notes, None),
        Err(error) => (None, cells.dialect.sentence().into_iter().collect(), Some(error.0)),
    };
    let record = log.as_ref().and_then(|log| match log {
        Log::Dynamic(record) => Some(record),
        Log::Table(_) => None,
    });
    let (time, answer) = (record.map(Time::of), record.and_then(answer));
    Ok(Look {
        schema: "truing-look/1",
        file: source,
        encoding: cells.dialect.encoding,
        separator: cells.dialect.separated_by(),
        decimal_comma: cells.dialect.decimal_comma,
        rows: cells.rows.len(),
        columns: (0..cells.header.len()).map(|index| Column::of(&cells, &plan, index)).collect(),
        guessed: plan.proposals.iter().map(|proposal| proposal.why.clone()).collect(),
        columns_argument: if plan.proposals.is_empty() { String::new() } else { plan.items.clone() },
        ask: record.map_or(Vec::new(), |record| ask(record, &plan, time, answer)),
        refused,
        time,
        answer,
        notes,
        log,
    })
}

impl Column {
    fn of(cells: &Cells, plan: &Plan, index: usize) -> Self {
        let used = plan.sources.iter().find(|source| source.formula.indices().contains(&index));
        let proposed = plan.proposals.iter().find(|proposal| proposal.column == Some(index));
        let extent = Extent::of(cells, index);
        let number = |row: &(u64, csv::StringRecord)| cells.dialect.number(row.1.get(index).unwrap_or(""));
        let seems = used.map(|source| name_of(source.quantity, source.unit).to_owned());
        let seems = seems
            .or_else(|| proposed.and_then(|proposal| proposal.item.split('=').next()).map(str::to_owned));
        Self {
            name: cells.header[index].clone(),
            seems: seems.or_else(|| plan.meanings[index].map(|meaning| meaning.in_words())),
            state: match (used, proposed) {
                (Some(_), _) => State::Read,
                (None, Some(_)) => State::Proposed,
                (None, None) => State::Unused,
            },
            min: extent.map(|extent| extent.min),
            max: extent.map(|extent| extent.max),
            step: smallest_step(cells.rows.iter().filter_map(number).collect()),
            empty: cells.rows.iter().filter(|row| missing(row.1.get(index).unwrap_or(""))).count(),
        }
    }
}

impl Meaning {
    /// For the table of columns.
    fn in_words(self) -> String {
        let topic = match self.topic {
            Topic::Time => "time",
            Topic::Voltage => "voltage",
            Topic::Duty => "duty",
            Topic::Current => "current",
            Topic::Torque => "torque",
            Topic::Force => "force",
            Topic::Position => "position",
            Topic::Speed => "speed",
            Topic::Supply => "supply",
            Topic::Bridge => "bridge",
            Topic::Run => "run",
        };
        match self.quantity {
            Some((quantity, factor)) if self.sure != Sure::Likely => name_of(quantity, factor).to_owned(),
            Some((quantity, factor)) => format!("{}?", name_of(quantity, factor)),
            None => format!("{topic}?"),
        }
    }
}

/// The smallest difference between two values; differences that are rounding are none.
fn smallest_step(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    let rounding = 1e-9 * values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let steps = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > rounding);
    steps.min_by(f64::total_cmp)
}

impl Time {
    fn of(record: &Dynamic) -> Self {
        let steps = |run: &Run| run.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>();
        let mut steps: Vec<f64> = record.runs.iter().flat_map(steps).collect();
        steps.sort_by(f64::total_cmp);
        let at = |share: f64| steps[(share * (steps.len() - 1) as f64).round() as usize];
        let usual = at(0.5);
        Self {
            records: record.runs.len(),
            seconds: record.runs.iter().map(|run| run.t_s[run.rows() - 1] - run.t_s[0]).sum(),
            rate_hz: 1.0 / usual,
            jitter: 0.5 * (at(0.95) - at(0.05)) / usual,
            gaps: steps.iter().filter(|step| **step > GAP * usual).count(),
            longest_s: at(1.0),
        }
    }
}

/// The speed, or the change of the position a second.
pub fn speed(run: &Run) -> Option<Vec<f64>> {
    let from = |position: &Vec<f64>| {
        let rows = position.windows(2).zip(run.t_s.windows(2));
        let mut speed: Vec<f64> = rows.map(|(x, t)| (x[1] - x[0]) / (t[1] - t[0])).collect();
        speed.insert(0, speed[0]);
        speed
    };
    run.speed.clone().or_else(|| run.position.as_ref().map(from))
}

/// Changes from row to row.
fn changes(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Correlates the changes of the input with those of the speed.
fn answer(record: &Dynamic) -> Option<Answer> {
    let pieces: Vec<[Vec<f64>; 2]> =
        record.runs.iter().filter_map(|run| Some([changes(&run.input), changes(&speed(run)?)])).collect();
    let rows: usize = pieces.iter().map(|piece| piece[0].len()).sum();
    let power = |which: usize| {
        pieces.iter().flat_map(|piece| &piece[which]).map(|change| change * change).sum::<f64>()
    };
    let norm = (power(0) * power(1)).sqrt();
    if norm == 0.0 {
        return None;
    }
    let at = |lag: i64| -> f64 {
        let product = |[u, w]: &[Vec<f64>; 2]| -> f64 {
            let (u, w) = (u.iter().skip((-lag).max(0) as usize), w.iter().skip(lag.max(0) as usize));
            u.zip(w).map(|(u, w)| u * w).sum()
        };
        pieces.iter().map(product).sum::<f64>() / norm
    };
    let longest = LONGEST_LAG.min(rows / 4) as i64;
    let correlations: Vec<f64> = (FIRST_LAG..=longest).map(at).collect();
    let peak = correlations.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    if peak.abs() < CHANCE / (rows as f64).sqrt() {
        return None;
    }
    let onset = correlations.iter().position(|correlation| correlation / peak > ONSET)?;
    let faded = |three: &[f64]| three.iter().sum::<f64>() / (3.0 * peak) < (-1.0_f64).exp();
    let rows_later = FIRST_LAG + onset as i64;
    let usual = record.runs.iter().max_by_key(|run| run.rows())?.sample_s();
    Some(Answer {
        rows: rows_later,
        delay_s: (rows_later - 1).max(0) as f64 * usual,
        correlation: peak,
        fades_rows: correlations[onset..].windows(3).position(faded),
    })
}

/// What would make the next record better.
fn ask(record: &Dynamic, plan: &Plan, time: Option<Time>, answer: Option<Answer>) -> Vec<String> {
    let all = |pick: &dyn Fn(&Run) -> Vec<f64>| record.runs.iter().flat_map(pick).collect::<Vec<f64>>();
    let input = all(&|run| run.input.clone());
    let speeds = all(&|run| speed(run).unwrap_or_default());
    let mut asked = Vec::new();
    let mut ask = |when: bool, what: String| asked.extend(Some(what).filter(|_| when));
    match answer {
        None => ask(
            true,
            "The output does not visibly follow the input: check that both belong to one motor.".into(),
        ),
        Some(answer) => {
            ask(answer.correlation < 0.0, "The speed falls when the input rises: if the motor is not braked, turn one sign round, for example with *-1 in --columns.".into());
            ask(answer.rows < 1, "The speed changes before the input does: the columns may be shifted against each other. Write both in the same moment.".into());
            let fast = answer.fades_rows.is_some_and(|rows| rows < FEW_ROWS);
            ask(fast, "Log faster if you can: the speed answers within a few rows.".into());
        }
    }
    ask(one_sided(&input), format!("Drive both directions: {} has one sign only.", record.input.column()));
    ask(
        !one_sided(&input) && one_sided(&speeds),
        "Let the motor turn in both directions: the speed has one sign only.".into(),
    );
    let mut levels = input.clone();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    ask(
        levels.len() < 4,
        format!("Use more heights of the input than {}: steps, and a slow ramp through zero.", levels.len()),
    );
    if let Some(time) = time {
        ask(
            time.jitter > UNEVEN,
            "Take the time in the controller, in the moment of the measurement: the steps are uneven.".into(),
        );
        ask(
            time.gaps > 0,
            format!(
                "Lose no rows: {} steps are longer than usual, the longest is {} s.",
                time.gaps,
                short(time.longest_s)
            ),
        );
    }
    ask(
        is_coarse(&record.runs),
        "Log the position in counts beside the speed: the speed comes in coarse steps.".into(),
    );
    let duty = plan.any(&[Quantity::Duty])
        || plan.proposals.iter().any(|proposal| proposal.item.starts_with("duty"));
    let supply = record.runs.iter().all(|run| run.supply_v.is_some());
    ask(
        duty && !supply,
        "Log the supply voltage: a duty is multiplied by it, and it sags under load.".into(),
    );
    let current = record.runs.iter().all(|run| run.current_a.is_some());
    ask(
        record.input == super::Input::Voltage && !current,
        "Log the winding current if you can measure it: it tells friction from a weak motor.".into(),
    );
    ask(record.runs.len() == 1, "Keep a second record of the same motor for --holdout.".into());
    asked
}

fn one_sided(values: &[f64]) -> bool {
    let (min, max) =
        values.iter().fold((0.0_f64, 0.0_f64), |(min, max), value| (min.min(*value), max.max(*value)));
    (-min).min(max) < ONE_SIDED * (-min).max(max)
}

/// A measured speed in few steps.
fn is_coarse(runs: &[Run]) -> bool {
    let speeds: Vec<f64> = runs.iter().filter_map(|run| run.speed.as_ref()).flatten().copied().collect();
    let range = speeds.iter().copied().fold(0.0, f64::max) - speeds.iter().copied().fold(0.0, f64::min);
    smallest_step(speeds).is_some_and(|step| range < COARSE * step)
}
