//! From a log to other numbers for the servo: a first model, the gap workflow, what the firmware can take of its answer.

use anyhow::bail;
use servo::config::Config;
use servo::store::AxisParameters;
use std::path::{Path, PathBuf};
use truing_core::gap;
use truing_core::outcome::{Outcome, Verdict};
use truing_core::system::model::{self, Model};
use truing_core::text::input_error::InputError;
use truing_files::log::{self, Columns, Dynamic};
use truing_report::report::{Exporter, model_file::ModelFile};
use truing_servo::device::commission_report::{Found, Params};
use truing_servo::device::compensation;
use truing_servo::device::parameters::adopt;

/// Relative tolerance (1 σ) of a first model's numbers: commissionings of drawn motors are off by a few percent.
const FIRST_TOLERANCE: f64 = 0.05;
/// Friction linear in the speed as a part of the damping, to begin with; a recording with an open bridge shows it. Bearings and grease of
/// small motors lose a few per cent.
const VISCOUS: f64 = 0.05;
/// Numbers that differ by less than this share are the same to the loops.
const SAME: f64 = 0.02;

/// What was found in a log, and what came of it.
#[derive(Clone)]
pub struct Analysed {
    /// The verdict.
    pub outcome: Outcome,
    /// The extended model.
    pub extended: Model,
}

/// The linear model of what the servo knows of its motor; `None`: it knows no gain.
pub fn first_model(parameters: &AxisParameters) -> Option<Model> {
    let known = known(parameters)?;
    let (gain, seconds) = (known.gain_rad_s_per_v.value?, known.time_constant_s.value?);
    let Config { supply_nominal_v: supply, counts_per_rev, .. } = parameters.config;
    let text = format!(
        "schema = \"truing-model/1\"\n\n[model]\nkind = \"first_order\"\ndescription = \"what the servo knows of its motor\"\n\
         gain_rad_s_per_v = {gain:?}\ntime_constant_s = {seconds:?}\nviscous_vs_per_rad = {:?}\n\n[tolerance]\n\
         default = {FIRST_TOLERANCE}\nviscous_vs_per_rad = 1.0\n\n\
         [supply]\nnominal_v = {supply:?}\nlimit_v = {supply:?}\n\n[encoder]\ncounts_per_rev = {counts_per_rev}\nside = \"motor\"\n",
        VISCOUS / gain
    );
    model::parse("first-model.toml", &text).ok()
}

/// What is known of the motor, in SI units.
pub fn known(parameters: &AxisParameters) -> Option<Found> {
    let scale = parameters.config.build().ok()?;
    Some((&parameters.estimates.report(&scale)).into())
}

/// Runs the gap workflow on all logs as one record.
pub fn analysed(model: &Model, logs: &[PathBuf]) -> anyhow::Result<Analysed> {
    let record = record(logs)?;
    let outcome = gap::run(model, &record, &[], &gap::Options::default(), &|_| {})?;
    let extended = match outcome.verdict {
        Verdict::Data | Verdict::InsufficientExcitation => model.clone(),
        _ => {
            let text = ModelFile { original: &model.source_text, origin: &record.source }.export(&outcome)?;
            model::parse(&model.source, &text)?
        }
    };
    Ok(Analysed { outcome, extended })
}

/// The runs of all logs.
fn record(logs: &[PathBuf]) -> anyhow::Result<Dynamic> {
    let read = |path: &Path| gap::as_record(log::read(path, &Columns::default())?);
    let Some((first, rest)) = logs.split_first() else { bail!("there is no log") };
    let mut record = read(first)?;
    for path in rest {
        record.runs.extend(read(path)?.runs);
    }
    record.runs.iter_mut().zip(0..).for_each(|(run, number)| run.id = number);
    Ok(record)
}

/// What the firmware would do with this model on top of what it knows; only trusted numbers replace others.
///
/// # Errors
/// The model is of another axis, or a number in it is none.
pub fn candidate(extended: &Model, base: &AxisParameters) -> Result<AxisParameters, InputError> {
    let params = compensation::from_model(extended, &base.config)?.params;
    let Params { dead_zone_pos_v, dead_zone_neg_v, saturation_pos_v, saturation_neg_v, .. } = params;
    let voltages = [dead_zone_pos_v, dead_zone_neg_v, saturation_pos_v, saturation_neg_v];
    let numbers = voltages.into_iter().chain([params.gain_rad_s_per_v, params.time_constant_s]).flatten();
    if !numbers.flat_map(|kept| [kept.value, kept.u95]).all(f64::is_finite) {
        let what = "a number that follows from it is none; look at the model";
        return Err(InputError::file(&extended.source, what));
    }
    let mut candidate = *base;
    adopt(&mut candidate, &params);
    candidate.compensation = true;
    candidate
        .check()
        .map_err(|error| InputError(format!("the model asks for numbers that cannot be: {error:?}")))?;
    Ok(candidate)
}

/// Does the candidate say anything else than what is in force, beyond what both are sure of?
pub fn differs(candidate: &AxisParameters, base: &AxisParameters) -> bool {
    let numbers = |parameters: &AxisParameters| {
        known(parameters).map(|found| found.numbers().map(|(.., number)| number))
    };
    let (Some(new), Some(old)) = (numbers(candidate), numbers(base)) else { return true };
    let apart = candidate.compensation != base.compensation;
    apart
        || new.iter().zip(&old).any(|(new, old)| {
            match (new.value.filter(|_| new.trusted), old.value.filter(|_| old.trusted)) {
                (Some(a), Some(b)) => (a - b).abs() > SAME * b.abs(),
                (None, None) => false,
                _ => true,
            }
        })
}
