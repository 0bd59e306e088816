//! `truing commission`: the firmware excites its motor and says what it is.

use super::firmware::{Firmware, Log};
use super::profile;
use crate::device::commission_report::{CommissionJson, Number, Params, Refused};
use crate::device::parameters::adopt;
use crate::device::run_log::RunLog;
use crate::device::session::{Done, SessionResult, Task};
use crate::device::setup::Setup;
use anyhow::Context;
use clap::Args;
use servo::commission::Outcome;
use servo::config::Config;
use servo::identify::estimate::Mechanism;
use servo::motion::referencing::Referencing;
use servo::store::AxisParameters;
use std::path::PathBuf;
use truing_core::text::input_error::NotDone;
use truing_report::console::files::Files;
use truing_report::console::interrupt;
use truing_report::report::write_atomically;

/// A mark is found again within so many counts, or this share of a turn: a stop gives way.
const MARK_COUNTS: i64 = 2;
const MARK_SHARE: i64 = 400;

/// Length of a commissioning when nothing else is asked for, s.
pub const BUDGET_S: f64 = 5.0;

/// Arguments of `truing commission`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// How long.
    #[command(flatten)]
    pub budget: Budget,
    /// Keep the result for `truing track --params`.
    #[arg(long)]
    pub save: Option<PathBuf>,
    /// Have the servo store the result, so that it survives a power cut.
    #[arg(long)]
    pub store: bool,
    /// Write the result as JSON, schema truing-commission/1.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Where the log goes.
    #[command(flatten)]
    pub log: Log,
}

/// How long a commissioning takes.
#[derive(Args, Debug)]
pub struct Budget {
    /// Length of the commissioning, s.
    #[arg(long, default_value_t = BUDGET_S, allow_negative_numbers = true)]
    pub budget_s: f64,
}

/// Runs and reports. What was found is printed and written before the servo stores it, which may fail.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    let files = arguments.firmware.files();
    files
        .writes("--json", &arguments.json)
        .writes("--log", &arguments.log.log)
        .writes("--save", &arguments.save)
        .check_ready()?;
    let setup = arguments.firmware.axis_file.read()?;
    let task = commission(arguments.budget.budget_s, arguments.firmware.seed)?;
    let tasks: Vec<Task> = [task].into_iter().chain(arguments.store.then_some(Task::Store)).collect();
    let mut told = None;
    let result = arguments.firmware.run_telling(&setup, &tasks, &mut |done, log| match done {
        Done::Commissioned(outcome) => told = Some(tell(arguments, outcome, log)),
        Done::Stored => outln!("{:21} by the servo", "stored"),
        _ => {}
    })?;
    arguments.log.save(&result.log)?;
    let report = told.transpose()?;
    result.complete()?;
    let refused = report.and_then(|report| report.refused);
    refused.map_or(Ok(()), |refused| Err(refusal(&refused).into()))
}

/// Prints what was found, and writes it; the log too, as far as it is.
fn tell(arguments: &Arguments, outcome: &Outcome, log: &RunLog) -> anyhow::Result<CommissionJson> {
    let report = CommissionJson::new(outcome, &log.config)?.beside(log);
    print(&report);
    if let Some(path) = &arguments.json {
        write_atomically(path, &(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    if let (Some(path), None) = (&arguments.save, &report.refused) {
        Params::new(report.mechanism, &report.found).save(path)?;
    }
    if arguments.store {
        arguments.log.save(log)?;
    }
    Ok(report)
}

/// The reason of exit status 1.
pub fn refusal(refused: &Refused) -> NotDone {
    NotDone(format!("the commissioning was refused: {}", refused.text))
}

/// Which servo is to move, and what is known about its motor.
#[derive(Args, Debug)]
pub struct Motion {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// What is known about the motor.
    #[command(flatten)]
    pub knowledge: Knowledge,
}

impl Motion {
    /// The files of a command that lets this servo follow this profile.
    pub fn files(&self, profile: &str) -> Files {
        let files = self.firmware.files().reads("--params", &self.knowledge.params);
        files.reads("--profile", profile.strip_prefix("file:"))
    }

    /// The axis, the tasks before the motion, and the motion; an error if it cannot be.
    pub fn follows(&self, profile: &str) -> anyhow::Result<(Setup, Vec<Task>, Task)> {
        let setup = self.firmware.axis_file.read()?;
        let motion = profile::task(profile, true, &setup.config)?;
        self.knowledge.allows(&motion, &setup.config)?;
        let first = self.tasks(&motion, BUDGET_S, &setup.config)?;
        Ok((setup, first, motion))
    }

    /// The tasks before the motion; none if the servo goes on with what it has stored. An excitation asks for no
    /// commissioning.
    pub fn tasks(&self, motion: &Task, budget_s: f64, config: &Config) -> anyhow::Result<Vec<Task>> {
        let Knowledge { params, stored, reference } = &self.knowledge;
        let excites = matches!(motion, Task::Excite(_));
        anyhow::ensure!(!(excites && *stored), "an excitation begins from --config; leave out --stored");
        let first = match params {
            _ if *stored => Vec::new(),
            Some(path) => adopted(&Params::read(path)?, config)?,
            None if excites => Vec::new(),
            None => vec![commission(budget_s, self.firmware.seed)?],
        };
        Ok(first.into_iter().chain(reference.map(Task::Reference)).collect())
    }
}

const OTHER_ENCODER: &str =
    "counts_per_rev of --params is not that of the axis file: correct encoder.counts_per_rev there";

/// The tasks that put these numbers in use.
fn adopted(params: &Params, config: &Config) -> anyhow::Result<Vec<Task>> {
    let mut known = AxisParameters::new(*config);
    adopt(&mut known, params)?;
    anyhow::ensure!(known.config == *config, OTHER_ENCODER);
    let load = params.position_load.as_ref().map(|_| Task::PositionLoad(known.position_load));
    let told = (!params.modelled.is_empty()).then_some(Task::Modelled(known.modelled));
    Ok([Task::Adopt(Box::new(params.estimates(config)))].into_iter().chain(load).chain(told).collect())
}

/// Where the numbers of a motion come from.
#[derive(Args, Debug)]
pub struct Knowledge {
    /// Use the result of an earlier commissioning instead of commissioning first.
    #[arg(long)]
    pub params: Option<PathBuf>,
    /// Use what the servo has stored (`truing commission --store`) instead of commissioning first.
    #[arg(long, conflicts_with = "params")]
    pub stored: bool,
    /// Find zero before the motion: `here:RAD`, or `stop:RAD_S,RAD,REACH_RAD[,AMPERE]`, or `index:RAD_S,RAD,REACH_RAD`,
    /// where the sign of the speed is the direction and RAD is what the place is to be called.
    #[arg(long, value_parser = referencing, allow_hyphen_values = true)]
    pub reference: Option<Referencing>,
}

/// The argument of `--reference`.
fn referencing(text: &str) -> Result<Referencing, String> {
    let shape = "expected here:RAD, stop:RAD_S,RAD,REACH_RAD[,AMPERE] or index:RAD_S,RAD,REACH_RAD";
    let (kind, rest) = text.split_once(':').ok_or(shape)?;
    let numbers: Result<Vec<f32>, _> = rest.split(',').map(|part| part.trim().parse()).collect();
    let numbers = numbers.map_err(|_| shape)?;
    match (kind, numbers.as_slice()) {
        ("here", &[position_rad]) => Ok(Referencing::Here { position_rad }),
        ("stop", &[speed_rad_s, position_rad, reach_rad, ref current @ ..]) if current.len() < 2 => {
            let current_a = current.first().copied();
            Ok(Referencing::EndStop { speed_rad_s, position_rad, reach_rad, current_a })
        }
        ("index", &[speed_rad_s, position_rad, reach_rad]) => {
            Ok(Referencing::Index { speed_rad_s, position_rad, reach_rad })
        }
        _ => Err(shape.into()),
    }
}

impl Knowledge {
    /// An error if the motion cannot be, by the axis file alone. A servo that goes on with what it has stored knows better.
    pub fn allows(&self, motion: &Task, config: &Config) -> anyhow::Result<()> {
        if self.stored { Ok(()) } else { profile::possible(motion, config) }
    }

    /// How far the mark is from where it was before the motion, if it was looked for again; an index is the same in every turn.
    pub fn lost_counts(&self, result: &SessionResult) -> anyhow::Result<()> {
        let mut places = result.done.iter().filter_map(|done| match done {
            Done::Referenced(place) => Some(*place),
            _ => None,
        });
        let (Some(before), Some(after)) = (places.next(), places.next()) else { return Ok(()) };
        let turn = i64::from(result.log.config.counts_per_rev);
        let lost = match self.reference {
            Some(Referencing::Index { .. }) => (after - before + turn / 2).rem_euclid(turn) - turn / 2,
            _ => after - before,
        };
        outln!("{:21} {lost}, by the mark that was found before and behind the motion", "counts lost");
        if lost.abs() <= MARK_COUNTS.max(turn / MARK_SHARE) {
            return Ok(());
        }
        let text = format!(
            "{lost} counts were lost or invented during the motion: check the encoder's cable, shield and supply, and its coupling"
        );
        Err(NotDone(text).into())
    }

    /// Is there a commissioning first?
    pub fn is_learned(&self) -> bool {
        !self.stored && self.params.is_none()
    }
}

/// The task, if it takes between 1 s and 10 minutes.
fn commission(budget_s: f64, seed: u64) -> anyhow::Result<Task> {
    anyhow::ensure!(
        (1.0..=600.0).contains(&budget_s),
        "--budget-s is {budget_s}; it must lie between 1 and 600 s"
    );
    Ok(Task::Commission { budget_s, seed: seed as u32 })
}

/// The first commissioning of a session; printed, if it was refused.
pub fn succeeded(result: &SessionResult) -> anyhow::Result<CommissionJson> {
    let outcome = result.done.iter().find_map(|done| match done {
        Done::Commissioned(outcome) => Some(outcome),
        _ => None,
    });
    let outcome = outcome.context("the session had no commissioning")?;
    let report = CommissionJson::new(outcome, &result.log.config)?.beside(&result.log);
    if let Some(refused) = &report.refused {
        print(&report);
        return Err(refusal(refused).into());
    }
    Ok(report)
}

/// One number, for people.
pub fn print_number(name: &str, unit: &str, number: &Number) {
    let trust = if number.trusted {
        "trusted".to_owned()
    } else {
        number.reason.unwrap_or("not trusted").replace('_', " ")
    };
    match (number.value, number.interval(unit)) {
        (Some(value), Some(interval)) => outln!("{name:21} {value:8.4}  {interval:33} {trust}"),
        _ => outln!("{name:21} {:>8}  {:33} {trust}", "-", ""),
    }
}

/// What makes the dead zone, for people.
fn in_words(mechanism: Mechanism) -> &'static str {
    match mechanism {
        Mechanism::Unclear => "unclear: not tested, or neither friction nor the input",
        Mechanism::Friction => "friction",
        Mechanism::InputDeadZone => "dead zone at the input",
        Mechanism::VoltageDrop => "a voltage drop of the drive",
    }
}

/// For people; a refusal first.
pub fn print(report: &CommissionJson) {
    if let Some(refused) = &report.refused {
        outln!("refused: {} ({})", refused.text, refused.code);
    }
    for (name, unit, number) in report.found.numbers() {
        print_number(name, unit, &number);
    }
    outln!("{:21} {}", "mechanism", in_words(report.mechanism));
    outln!("{:21} {:.2} s, {:.2} turns", "took", report.duration_s, report.travel_rev);
    for doubt in &report.doubts {
        outln!("{:21} {doubt}", "not used");
    }
}
