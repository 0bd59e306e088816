//! The one result of the gap workflow. Every report (terminal, HTML, JSON, model file) is written from it; a report
//! computes nothing. The serialised part is `truing-gap/1`; the curves for plots are not serialised.

mod contradiction;
mod left;
mod plot;
mod searched;
mod verdict;
pub mod volts;

pub use contradiction::Contradiction;
pub use left::{Unexplained, UnnamedTerm};
pub use plot::{Curve, Plot, Role, Series, Stage, Style};
pub use searched::Searched;
pub use verdict::{Grade, Verdict};

use serde::Serialize;
use servo::axis::Bridge;
use std::collections::BTreeMap;

/// The schema of the serialised result.
const SCHEMA: &str = "truing-gap/1";

/// A name that is left out of the headline because a simulation is hardly better with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Small {
    /// Its name in the library.
    pub name: String,
    /// Points of held-out fit that it brings, %.
    pub fit_points: f64,
}

/// A number is told from nothing if it lies further from it than so many of its standard deviations. Origin: decision
/// 0032; two of them are met by chance in one case of twenty.
pub const DEVIATIONS: f64 = 3.0;

/// A fitted number with its standard deviation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Value {
    /// The estimate.
    pub value: f64,
    /// One standard deviation; `None`: not determined.
    pub std: Option<f64>,
    /// Unit as text.
    pub unit: String,
}

/// One accepted effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedEffect {
    /// Its name in the library.
    pub name: String,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, Value>,
    /// Figures that follow from the parameters and the rest of the model, e.g. the command at which a knee lies.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub derived: BTreeMap<String, Value>,
    /// Root mean square of the held-out residual without it (and without those named after it).
    pub gap_before: f64,
    /// Root mean square of the held-out residual with it.
    pub gap_after: f64,
    /// One sentence a person understands.
    pub evidence: String,
    /// Where it shows, in its own variable; absent where it is no curve over one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
    /// Index into [`Outcome::ties`], if it is the first rival of a tie.
    pub tie: Option<usize>,
}

/// Explanations that the data cannot tell apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tie {
    /// Each rival is a set of names.
    pub rivals: Vec<Vec<String>>,
    /// The experiment that would tell.
    pub separated_by: String,
}

/// How well the model predicts data that were not fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HoldOut {
    /// The compared column.
    pub signal: String,
    /// RMSE of the model as given.
    pub rmse_before: f64,
    /// RMSE of the extended model.
    pub rmse_after: f64,
    /// RMSE of a perfect model: the sensor's noise.
    pub noise_floor: f64,
    /// 100·(1 − ‖y−ŷ‖/‖y−ȳ‖) of the model as given.
    pub fit_percent_before: f64,
    /// 100·(1 − ‖y−ŷ‖/‖y−ȳ‖) of the extended model.
    pub fit_percent_after: f64,
}

/// The second judge beside a speed: where the shaft is, in free run from the first row of each held-out record. A friction that differs
/// by direction may win the speed and lose the position.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionGap {
    /// RMSE of the model as given.
    pub rmse_before: f64,
    /// RMSE of the extended model.
    pub rmse_after: f64,
    /// rad, or m on a linear axis.
    pub unit: &'static str,
}

/// A base parameter that moved within its tolerance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shift {
    /// Key in the model file.
    pub parameter: String,
    /// Fitted against nominal, %.
    pub shift_percent: f64,
    /// Standard deviation of the shift, %.
    pub std_percent: f64,
    /// The model was fitted to the log, so that its parameters are fitted anew with the effects.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub refitted: bool,
}

/// A region that holds a share of the gap.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Where {
    /// The region in words, e.g. `0 < |u| < 1.2 V`.
    pub region: String,
    /// Its share of the squared error, 0 … 1.
    pub share_of_squared_error: f64,
    /// Other ways to say nearly the same region: most of the squared error lies in both.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub also: Vec<String>,
}

/// What is wrong with a file, and what mends it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DataFault {
    /// The column, the key or the file.
    pub place: String,
    /// What is wrong, in words that follow "it looks as if".
    pub what: String,
    /// The share of the motion that is explained as the files stand, 0 … 1.
    pub explained_as_it_stands: f64,
    /// The share that is explained once the mistake is put right.
    pub explained_with_it: f64,
    /// What mends it: an option of the command line, or a line of the model file.
    pub remedy: String,
}

/// One piece of a suggested experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Segment {
    /// State of the bridge; in JSON its number: 0 open, 1 driven, 2 shorted.
    #[serde(serialize_with = "as_number")]
    pub bridge: Bridge,
    /// Voltage, V; absent when the bridge is open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u_v: Option<f64>,
    /// Duration, s.
    pub seconds: f64,
}

fn as_number<S: serde::Serializer>(bridge: &Bridge, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u8(*bridge as u8)
}

impl Segment {
    /// A voltage, or whatever else drives the axis, held for a time.
    pub fn driven(input: f64, seconds: f64) -> Self {
        let (bridge, u_v) = (Bridge::Driven, Some(input));
        Self { bridge, u_v, seconds }
    }

    /// The bridge left open.
    pub fn open(seconds: f64) -> Self {
        let (bridge, u_v) = (Bridge::Open, None);
        Self { bridge, u_v, seconds }
    }
}

/// What to measure next.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Experiment {
    /// What it would tell.
    pub why: String,
    /// What to apply.
    pub profile: Vec<Segment>,
    /// Unit of the input: `V`, or that of a current, torque or force that drives the axis.
    pub unit: &'static str,
    /// The largest winding current that the extended model sees in it, A; absent where the model knows none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_current_a: Option<f64>,
    /// How far the axis goes from one end to the other, rad or m; absent for a table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub travel: Option<f64>,
    /// True on a linear axis.
    #[serde(skip)]
    pub linear: bool,
    /// It tells nothing without the winding's current, which the logs do not hold.
    #[serde(skip)]
    pub needs_current: bool,
}

impl Experiment {
    /// What to apply and why; what it takes is not known yet.
    pub fn new(why: String, profile: Vec<Segment>, unit: &'static str) -> Self {
        Self { why, profile, unit, peak_current_a: None, travel: None, linear: false, needs_current: false }
    }
}

/// The gap after one more effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What was added.
    pub label: String,
    /// Held-out RMSE after it.
    pub gap: f64,
}

/// An explanation that was considered and why it lost.
#[derive(Clone, Debug, PartialEq)]
pub struct Rival {
    /// Set of names.
    pub names: Vec<String>,
    /// Held-out RMSE with it in place of the winner.
    pub gap: f64,
    /// Why it lost, in a sentence.
    pub reason: String,
}

/// The result of the gap workflow.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Outcome {
    /// `truing-gap/1`.
    pub schema: &'static str,
    /// What holds.
    pub verdict: Verdict,
    /// How sure it is.
    pub grade: Grade,
    /// What the log says against the model file; told before any effect.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub data_sheet: Vec<Contradiction>,
    /// What is wrong with the files: with the verdict *data* nothing else is told.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub data: Vec<DataFault>,
    /// The accepted set in the order of naming.
    pub effects: Vec<NamedEffect>,
    /// Names that hardly lift the held-out fit; they are not in the extended model.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub small: Vec<Small>,
    /// Explanations that cannot be told apart.
    pub ties: Vec<Tie>,
    /// Names that resemble the unexplained rest.
    pub closest_known: Vec<String>,
    /// Prediction of data that were not fitted.
    pub holdout: HoldOut,
    /// Prediction of the logged position of the held-out records; absent where none is logged, or where it is what is compared anyhow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<PositionGap>,
    /// Prediction of records that nobody chose by, given with `--final`; absent without them.
    #[serde(rename = "final", skip_serializing_if = "Option::is_none")]
    pub final_records: Option<HoldOut>,
    /// Base parameters that moved within tolerance.
    pub within_tolerance: Vec<Shift>,
    /// Where simulation and data disagree.
    #[serde(rename = "where")]
    pub places: Vec<Where>,
    /// What is left.
    pub unexplained: Unexplained,
    /// What to measure next.
    pub next_experiment: Option<Experiment>,
    /// Wall time, s; 0 where nobody took it. The engine has no clock.
    pub runtime_s: f64,
    /// On how much of a long log effects were searched for; absent where it was all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub searched: Option<Searched>,
    /// Things the reader must know: what was held out, warnings about the input.
    pub notes: Vec<String>,
    /// The gap from the given model to the final one, first entry: the given model.
    #[serde(skip)]
    pub steps: Vec<Step>,
    /// Explanations that lost.
    #[serde(skip)]
    pub rivals: Vec<Rival>,
    /// Steady curve, traces before and after, residual over the axis that localises it, …
    #[serde(skip)]
    pub plots: Vec<Plot>,
    /// Unit of the gap.
    #[serde(skip)]
    pub gap_unit: String,
}

impl Outcome {
    /// A result in which nothing but this is told yet.
    pub fn new(verdict: Verdict, holdout: HoldOut, gap_unit: &str) -> Self {
        Self {
            schema: SCHEMA,
            verdict,
            grade: Grade::of(verdict, false, true),
            holdout,
            unexplained: Unexplained::new(0.0, None),
            gap_unit: gap_unit.into(),
            ..Self::default()
        }
    }

    /// The result when nothing could be tested: a gap that nobody measured is no number.
    pub fn untested(signal: &str, noise_floor: f64, gap_unit: &str) -> Self {
        let unknown = f64::NAN;
        let holdout = HoldOut {
            signal: signal.into(),
            rmse_before: unknown,
            rmse_after: unknown,
            noise_floor,
            fit_percent_before: unknown,
            fit_percent_after: unknown,
        };
        Self::new(Verdict::InsufficientExcitation, holdout, gap_unit)
    }

    /// Files that are at fault: nothing was simulated.
    pub fn at_fault(signal: &str, gap_unit: &str, data: Vec<DataFault>) -> Self {
        let (verdict, grade) = (Verdict::Data, Grade::Data);
        Self { verdict, grade, data, ..Self::untested(signal, f64::NAN, gap_unit) }
    }

    /// False if there are no figures: the files are at fault, or the log does not move enough.
    pub fn tested(&self) -> bool {
        !matches!(self.verdict, Verdict::Data | Verdict::InsufficientExcitation)
    }
}
