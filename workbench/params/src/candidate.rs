//! From a log to other numbers for the servo: a first model, the gap workflow, what the firmware can take of its answer.

use crate::compensation;
use anyhow::Context;
use servo::compensate::modelled::{Modelled, NAMES, PLAY};
use servo::compensate::position_load::PositionLoad;
use servo::config::Config;
use servo::identify::estimate::Estimates;
use servo::store::AxisParameters;
use std::path::PathBuf;
use truing_core::gap;
use truing_core::outcome::{Outcome, Verdict};
use truing_core::system::model::{self, Model};
use truing_core::text::input_error::InputError;
use truing_files::log::{self, Columns, Dynamic, Log};
use truing_report::report::{Exporter, model_file::ModelFile};
use truing_servo::device::commission_report::{Found, Kept};
use truing_servo::device::parameters::adopt;
use truing_servo::device::place_load::stiff_enough;

/// Relative tolerance (1 σ) of a first model's numbers: commissionings of drawn motors are off by a few percent.
const FIRST_TOLERANCE: f64 = 0.05;
/// The same of numbers that the servo does not trust: gravity moves them by tens of percent. A factor of e.
const DOUBTED_TOLERANCE: f64 = 1.0;
/// Numbers that differ by less than this share are the same to the loops.
const SAME: f64 = 0.02;
/// Loads that differ by less than this share of their largest voltage are the same.
const SAME_LOAD: f64 = 0.05;
/// Places at which loads are compared.
const PLACES: i32 = 4096;

/// What was found in a log, and what came of it.
#[derive(Clone)]
pub struct Analysed {
    /// The verdict.
    pub outcome: Outcome,
    /// The extended model.
    pub extended: Model,
}

/// The linear model of what the servo knows of its motor, and whether it trusts that; `None`: it knows no gain.
pub fn first_model(parameters: &AxisParameters, trusted: bool) -> Option<Model> {
    let known = known(parameters)?;
    let (gain, seconds) = (known.gain_rad_s_per_v.value?, known.time_constant_s.value?);
    let tolerance = if trusted { FIRST_TOLERANCE } else { DOUBTED_TOLERANCE };
    let Config { supply_nominal_v: supply, counts_per_rev, gear_ratio, .. } = parameters.config;
    let text = format!(
        "schema = \"truing-model/1\"\n\n[model]\nkind = \"first_order\"\ndescription = \"what the servo knows of its motor\"\n\
         gain_rad_s_per_v = {gain:?}\ntime_constant_s = {seconds:?}\nviscous_vs_per_rad = \"unknown\"\n\
         electrical_time_constant_s = \"unknown\"\n\n[tolerance]\ndefault = {tolerance:?}\n\n[motor]\ngear_ratio = {gear_ratio:?}\n\n\
         [supply]\nnominal_v = {supply:?}\nlimit_v = {supply:?}\n\n[encoder]\ncounts_per_rev = {counts_per_rev}\nside = \"motor\"\n"
    );
    // Coast-downs with an open bridge show how much of the damping is friction, fine rows the winding: the log completes both.
    model::parse_draft("first-model.toml", &text).ok().map(|draft| draft.stated().clone())
}

/// What is known of the motor, in SI units.
pub fn known(parameters: &AxisParameters) -> Option<Found> {
    let scale = parameters.config.build().ok()?;
    Some((&parameters.estimates.report(&scale)).into())
}

/// Runs the gap workflow on all logs as one record.
pub fn analysed(model: &Model, logs: &[PathBuf]) -> anyhow::Result<Analysed> {
    let log = Log::Dynamic(record(logs)?);
    let model = &gap::completed(model::parse_draft(&model.source, &model.source_text)?, &log)?;
    let record = gap::as_record(log)?;
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
    let mut records = logs.iter().map(|path| gap::as_record(log::read(path, &Columns::default())?));
    let mut record = records.next().context("there is no log")??;
    for other in records {
        record.runs.extend(other?.runs);
    }
    record.runs.iter_mut().zip(0..).for_each(|(run, number)| run.id = number);
    Ok(record)
}

/// What the firmware would do with this model, and what of the model it cannot do; of what a commissioning finds only trusted numbers
/// replace others, and what only a model tells is all of this one. `seen`: what a commissioning beside its load has found, which counts
/// most.
///
/// # Errors
/// The model is of another axis, or asks for numbers that cannot be.
pub fn candidate(
    extended: &Model,
    base: &AxisParameters,
    seen: Option<&Estimates>,
) -> Result<(AxisParameters, Vec<String>), InputError> {
    let export = compensation::from_model(extended, &base.config)?;
    let (mut remarks, mut params, play) = (export.remarks, export.params, NAMES[PLAY][0]);
    let way = |it: Kept| format!("left to you: identified.{play}={:.5}, for moves down", it.value);
    remarks.extend(params.modelled.remove(play).map(way));
    let modelled = Modelled { play: base.modelled.acting().play, ..Modelled::default() };
    let position_load = PositionLoad::default();
    let mut candidate = AxisParameters { compensation: true, modelled, position_load, ..*base };
    adopt(&mut candidate, &params)?;
    seen.into_iter().for_each(|seen| candidate.estimates.merge(seen));
    candidate.tuning.bandwidth = stiff_enough(&candidate);
    let cannot = |it| InputError(format!("the model asks for numbers that cannot be: {it:?}"));
    candidate.check().map_err(cannot)?;
    Ok((candidate, remarks))
}

/// Do both tables hold the same load?
fn alike(a: &PositionLoad, b: &PositionLoad) -> bool {
    let longest = i64::from(a.period_counts().max(b.period_counts()));
    let voltage = |table: &PositionLoad, place: i32| {
        if table.is_on() && table.is_trusted() { f64::from(table.voltage(place).0) } else { 0.0 }
    };
    let places = (0..PLACES).map(|n| (i64::from(n) * longest / i64::from(PLACES)) as i32);
    let both: Vec<[f64; 2]> = places.map(|place| [a, b].map(|table| voltage(table, place))).collect();
    let largest = both.iter().flatten().fold(0.0, |most: f64, volts| most.max(volts.abs()));
    both.iter().all(|[a, b]| (a - b).abs() <= SAME_LOAD * largest)
}

/// Does the candidate say anything else than what is in force, beyond what both are sure of?
pub fn differs(candidate: &AxisParameters, base: &AxisParameters) -> bool {
    let trusted = |parameters: &AxisParameters| {
        known(parameters).map(|found| found.numbers().map(|(.., it)| it.value.filter(|_| it.trusted)))
    };
    let (Some(new), Some(old)) = (trusted(candidate), trusted(base)) else { return true };
    candidate.compensation != base.compensation
        || candidate.tuning != base.tuning
        || candidate.modelled.differs(&base.modelled)
        || !alike(&candidate.position_load, &base.position_load)
        || new.into_iter().zip(old).any(|both| match both {
            (Some(a), Some(b)) => (a - b).abs() > SAME * b.abs(),
            (a, b) => a.is_some() || b.is_some(),
        })
}
