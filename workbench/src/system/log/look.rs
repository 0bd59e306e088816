//! What a stranger would see in a log before any model is asked: columns, time, answer of the output to the input, and what
//! is missing for a good comparison.

use super::columns::{Columns, Plan};
use super::dialect::{Cells, missing};
use super::names::{Meaning, Sure, Topic, name_of};
use super::propose::{Extent, Proposal, short};
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
/// Rows between the values whose changes are compared.
const STRIDES: [usize; 3] = [1, 4, 16];
/// A correlation that is no chance however few the rows are.
const PLAIN: f64 = 0.6;
/// Correlation of an input's change with the next one beyond which the input is smooth.
const SMOOTH: f64 = 0.3;
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
/// Fewer levels of the input than this show no curve.
const FEW_LEVELS: usize = 4;
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
    /// The input changes smoothly: the lag of the motor is in `rows` and `delay_s`.
    pub smooth: bool,
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
        ask: record.map_or(Vec::new(), |record| ask(record, &plan, Time::of(record), answer)),
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

/// Correlates the changes of the input with those of the speed: from row to row, and if noise hides that, over more rows.
fn answer(record: &Dynamic) -> Option<Answer> {
    let usual = record.runs.iter().max_by_key(|run| run.rows())?.sample_s();
    STRIDES.into_iter().find_map(|stride| {
        let every = |values: Vec<f64>| changes(&values.into_iter().step_by(stride).collect::<Vec<_>>());
        let piece = |run: &Run| Some([every(run.input.clone()), every(speed(run)?)]);
        let seen = Changes(record.runs.iter().filter_map(piece).collect()).answer()?;
        // Within several rows the beginning is not known better.
        let rows = if stride == 1 { seen.rows } else { (seen.rows - 1).max(0) * stride as i64 + 1 };
        let delay_s = (rows - 1).max(0) as f64 * usual;
        Some(Answer { rows, delay_s, fades_rows: seen.fades_rows.map(|rows| rows * stride), ..seen })
    })
}

/// Changes of input and speed, a pair a run.
struct Changes(Vec<[Vec<f64>; 2]>);

impl Changes {
    /// Sum over all runs of one column times another, `lag` rows later.
    fn product(&self, first: usize, second: usize, lag: i64) -> f64 {
        let of_one = |piece: &[Vec<f64>; 2]| -> f64 {
            let first = piece[first].iter().skip((-lag).max(0) as usize);
            first.zip(piece[second].iter().skip(lag.max(0) as usize)).map(|(a, b)| a * b).sum()
        };
        self.0.iter().map(of_one).sum()
    }

    fn answer(&self) -> Option<Answer> {
        let rows: usize = self.0.iter().map(|piece| piece[0].len()).sum();
        let norm = (self.product(0, 0, 0) * self.product(1, 1, 0)).sqrt();
        if norm == 0.0 {
            return None;
        }
        let longest = LONGEST_LAG.min(rows / 4) as i64;
        let seen: Vec<f64> = (FIRST_LAG..=longest).map(|lag| self.product(0, 1, lag) / norm).collect();
        let at = (0..seen.len()).max_by(|a, b| seen[*a].abs().total_cmp(&seen[*b].abs()))?;
        let peak = seen[at];
        if peak.abs() < (CHANCE / (rows as f64).sqrt()).min(PLAIN) {
            return None;
        }
        // A smooth input spreads the peak to both sides.
        let smooth = self.product(0, 0, 1) > SMOOTH * self.product(0, 0, 0);
        let onset = if smooth { at } else { seen.iter().position(|value| value / peak > ONSET)? };
        let faded = |three: &[f64]| three.iter().sum::<f64>() / (3.0 * peak) < (-1.0_f64).exp();
        let fades_rows = if smooth { None } else { seen[onset..].windows(3).position(faded) };
        Some(Answer { rows: FIRST_LAG + onset as i64, delay_s: 0.0, correlation: peak, smooth, fades_rows })
    }
}

/// What would make the next record better.
fn ask(record: &Dynamic, plan: &Plan, time: Time, answer: Option<Answer>) -> Vec<String> {
    let asked = [about_answer(answer), about_motion(record), about_time(time), about_columns(record, plan)];
    asked.into_iter().flatten().filter(|asked| asked.0).map(|asked| asked.1).collect()
}

fn about_answer(answer: Option<Answer>) -> Vec<(bool, String)> {
    let Some(answer) = answer else {
        let what = "The output does not visibly follow the input: check that both belong to one motor.";
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
    let mut input: Vec<f64> = record.runs.iter().flat_map(|run| run.input.clone()).collect();
    let speeds: Vec<f64> = record.runs.iter().filter_map(speed).flatten().collect();
    let one_way = one_sided(&input);
    input.sort_by(f64::total_cmp);
    input.dedup();
    let levels = input.len();
    vec![
        (one_way, format!("Drive both directions: {} has one sign only.", record.input.column())),
        (
            !one_way && one_sided(&speeds),
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
    let supply = plan.sources.iter().find(|source| source.quantity == Quantity::Supply);
    let is_supply = |proposal: &Proposal| proposal.item.starts_with("vbus") && proposal.column.is_some();
    let supply = supply.is_some_and(|source| !source.formula.indices().is_empty())
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
