//! Numbers of a model that nobody knows: start values from the log, and a wide prior. Where a log cannot tell them apart the
//! model becomes `first_order`.
//!
//! What is found is written into the text of the model file, which is then read as if a person had written it. So an extended
//! model holds every number, with the reason beside it.

mod line;
mod split;
mod text;

pub use line::Line;
pub use text::{GUESSED, START};

use crate::gap::record::made_ready;
use crate::gap::search::base_fit;
use crate::gap::tables;
use crate::system::log::{Dynamic, Input, Log};
use crate::system::model::{self, DRIVEN_DIRECTLY, Draft, Kind, Model};
use crate::text::figures::{figure, listing};
use crate::text::input_error::InputError;
use split::{Split, Winding};

/// Relative tolerance (1 σ) of a number that is not known: a factor of e, which two of them let move by 7.4 either
/// way. Start values from the linear fit lie within a factor of 2 wherever dry friction and dead zone take less than
/// half of the input. Chosen by judgement (decision 0290).
pub const WIDE: f64 = 1.0;

/// The same of resistance and motor constant where a measured current shows them. Kt and Ke are one number in SI
/// units, but a fit moves them apart, and of Kt and J a log shows the ratio alone: with a wide prior both drift along
/// it. Chosen by judgement (decision 0290).
pub const MEASURED: f64 = 0.1;

/// What follows on a linear axis.
const DIRECTLY: &str =
    ". The axis is linear, so the model is an inertia here: mass and forces count per unit of the input";
/// What follows without a measured current.
const PRODUCTS: &str = ". Without a measured current (i_a) a log shows only products of resistance, torque constant and inertia, so the \
                        model is first_order here: friction is stated in volts at the terminals and in rad/s²";

/// The model of a draft, with what is unknown in it filled from a log. A model that lacks nothing stays as it is.
pub fn completed(draft: Draft, log: &Log) -> Result<Model, InputError> {
    if draft.unknown().is_empty() {
        return draft.complete();
    }
    let line = line_of(log);
    let mut evidence = Evidence { line: line.unwrap_or(Line::typical(log)), shown: line, log };
    let mut split = evidence.split(&draft)?;
    let read = |split: &Split| model::parse(&draft.stated().source, &text::completed(&draft, split));
    let mut model = read(&split)?;
    if let Some(fitted) = evidence.fitted(&model, &split) {
        (evidence.line, evidence.shown) = (fitted, Some(fitted));
        split = evidence.split(&draft)?;
        model = read(&split)?;
    }
    // The lines in these are those of the file that the user has.
    model.notes.clone_from(&draft.stated().notes);
    model.notes.push(evidence.sentence(&draft, &split));
    Ok(model)
}

/// The best linear model of a log; `None` if nothing moves.
pub fn line_of(log: &Log) -> Option<Line> {
    match log {
        Log::Dynamic(record) => Line::of_record(record).map(|lines| settled(record, lines)),
        Log::Table(table) => Line::of_table(table),
    }
}

/// Rows closer than this, s, are no settled speeds of a motor: the time constant that stands in for one that does not
/// show is a sixth of it. Chosen by judgement; not studied.
const APART_S: f64 = 0.65;

/// The line of a record; without a time constant and a limit where each row shows a settled speed rather than a response.
fn settled(record: &Dynamic, [free, limited]: [Line; 2]) -> Line {
    let Some(run) = record.runs.first().filter(|run| run.sample_s() > APART_S) else { return limited };
    match tables::left_if_settled(run).is_some_and(|left| left < free.left) {
        true => Line { time_constant_s: None, ..free },
        false => limited,
    }
}

/// What a log says about the numbers of a model.
pub(crate) struct Evidence<'l> {
    /// The best linear model, or a typical one where nothing moves.
    line: Line,
    /// The best linear model, if anything moves.
    shown: Option<Line>,
    log: &'l Log,
}

impl Evidence<'_> {
    /// The line without the friction beside it, fitted in free run, if every number is the log's own: what is missing is counted from there.
    fn fitted(&self, model: &Model, split: &Split) -> Option<Line> {
        let line =
            self.shown.filter(|line| split.fit && line.gain > 0.0 && line.time_constant_s.is_some())?;
        let Log::Dynamic(record) = self.log else { return None };
        let dataset = made_ready(model, record, &[] as &[Dynamic]).ok()?;
        let base = base_fit(&dataset, model);
        let kind = base.hypothesis.kind(&base.fit.x);
        let Kind::FirstOrder { gain_rad_s_per_v: gain, time_constant_s, .. } = kind else { return None };
        Some(Line { gain, time_constant_s: Some(time_constant_s), ..line })
    }

    fn split(&self, draft: &Draft) -> Result<Split, InputError> {
        let (input, linear) = axis(self.log);
        match draft.stated().kind {
            Kind::DcMotor { .. } if linear => Ok(split::linear(&self.line)),
            Kind::FirstOrder { .. } => Ok(split::first_order(draft, &self.line, self.log)),
            Kind::Inertia { .. } => Ok(split::inertia(draft, &self.line)),
            Kind::DcMotor { .. } if input == Input::Voltage => {
                let winding = if let Log::Dynamic(record) = self.log { Winding::of(record) } else { None };
                split::motor(draft, &self.line, self.log, winding)
            }
            Kind::DcMotor { .. } => split::held_current(draft, &self.line, input),
        }
    }

    /// What was unknown, where its start value comes from, and what follows.
    fn sentence(&self, draft: &Draft, split: &Split) -> String {
        let keys: Vec<&str> = draft.unknown().iter().map(|unknown| unknown.key).collect();
        let (list, is) = (listing(&keys), if keys.len() == 1 { "is" } else { "are" });
        let seen = match (self.shown, split.measured_winding) {
            (None, _) => "typical values, because the log does not move".to_owned(),
            (Some(line), false) => line.sentence(self.log),
            (Some(line), true) => format!("{} and the measured current", line.sentence(self.log)),
        };
        let mut said =
            format!("{list} {is} not known: start values come from {seen}, and are fitted with a wide prior");
        said += split.kind.map_or("", |kind| if kind == DRIVEN_DIRECTLY { DIRECTLY } else { PRODUCTS });
        if split.fit {
            said += ". Every number is the log's own, as fitted_to_log = true says: names that do not reach the noise are judged by the share of the gap that they remove";
        }
        for more in &split.notes {
            said += &format!(". {more}");
        }
        said
    }
}

/// What drives the axis of a log, and whether it is linear.
fn axis(log: &Log) -> (Input, bool) {
    match log {
        Log::Dynamic(record) => (record.input, record.linear),
        Log::Table(_) => (Input::Voltage, false),
    }
}

impl Line {
    /// What stands in where nothing moves: the analysis will say so.
    fn typical(log: &Log) -> Self {
        let table = matches!(log, Log::Table(_));
        Self { gain: 10.0, time_constant_s: (!table).then_some(0.1), left: 1.0 }
    }

    /// `the log's best linear fit (gain 16.0 rad/s per V, time constant 0.0899 s)`
    fn sentence(&self, log: &Log) -> String {
        let (input, linear) = axis(log);
        let (unit, speed) = (input.unit(), if linear { "m/s" } else { "rad/s" });
        let gain = format!("gain {} {speed} per {unit}", figure(self.gain.abs()));
        match self.time_constant_s.map(figure) {
            Some(seconds) => format!("the log's best linear fit ({gain}, time constant {seconds} s)"),
            None => format!("the slope of the settled speeds ({gain})"),
        }
    }
}
