//! `truing track`: the firmware follows a profile; how well?

use super::commission::{self, Budget, Motion};
use super::firmware::{Log, fault_ended};
use super::profile;
use crate::device::link::advisory_text;
use crate::device::loops::LoopShape;
use crate::device::run_log::RunLog;
use crate::device::session::{Done, SessionResult, Task};
use crate::device::tracking::{Learned, TrackJson};
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;
use truing_report::console::interrupt;
use truing_report::report::write_atomically;

/// Arguments of `truing track`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo, and what is known about its motor.
    #[command(flatten)]
    pub motion: Motion,
    /// How long a commissioning takes.
    #[command(flatten)]
    pub budget: Budget,
    /// A motion: sine:amp_rad,hz,seconds or step:amp_rad,seconds or file:CSV with the columns t_s and theta_ref_rad, and,
    /// where they are known, omega_ref_rad_s and alpha_ref_rad_s2; the points are streamed and joined smoothly.
    /// Or a voltage at the terminals, with which nothing is commissioned first and no loop is closed:
    /// voltage_sine:amp_v,hz,seconds or chirp:amp_v,from_hz,to_hz,seconds or log_chirp:amp_v,from_hz,to_hz,seconds.
    #[arg(long)]
    pub profile: String,
    /// Use the inverse dead zone. Without it: as `loops.compensation` of the axis file says, on by default.
    #[arg(long, value_parser = ["on", "off"])]
    pub compensation: Option<String>,
    /// If the motion takes more voltage than is left, scale it so that it fits: a sine's amplitude, the times of a file.
    #[arg(long)]
    pub fit: bool,
    /// Look for the mark of --reference once more behind the motion, and tell how many counts were lost meanwhile.
    #[arg(long, requires = "reference")]
    pub check: bool,
    /// Write the result as JSON, schema truing-track/1.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Where the log goes.
    #[command(flatten)]
    pub log: Log,
}

/// Runs and reports.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    let Motion { firmware, knowledge } = &arguments.motion;
    let files = arguments.motion.files(&arguments.profile);
    files.writes("--json", &arguments.json).writes("--log", &arguments.log.log).check_ready()?;
    let setup = firmware.axis_file.read()?;
    let config = setup.config;
    let chosen = setup.choices.loops.compensation.unwrap_or(true);
    let compensation = arguments.compensation.as_ref().map_or(chosen, |it| it == "on");
    let motion = profile::task(&arguments.profile, compensation, &config)?;
    if !arguments.fit {
        knowledge.allows(&motion, &config)?;
    }
    let first = arguments.motion.tasks(&motion, arguments.budget.budget_s, &config)?;
    let fit = arguments.fit.then_some(Task::Fit);
    // The mark of `--reference`, once more.
    let again = knowledge.reference.filter(|_| arguments.check).map(Task::Reference);
    let tasks: Vec<Task> = first.into_iter().chain(fit).chain([motion]).chain(again).collect();
    let result = firmware.run_logged(&setup, &tasks, &arguments.log)?;
    let moved = result.done.iter().rfind(|done| !matches!(done, Done::Referenced(_)));
    match moved {
        Some(Done::Excited(span, learned)) => {
            let report = TrackJson::excited(&result.log, span, learned);
            concluded(arguments, &result.log, &report, &|| print_learned(&report))
        }
        Some(Done::Tracked(span)) => {
            let fitted = result.fitted.map(|short| short.fitted);
            let report = TrackJson { fitted, ..TrackJson::new(&result.log, span) };
            let learned = knowledge.is_learned().then(|| commission::succeeded(&result));
            let learned = learned.transpose()?;
            concluded(arguments, &result.log, &report, &|| {
                learned.iter().for_each(commission::print);
                print_loop(&result, &tasks);
                print_fitted(&result);
                print_tracked(&result.log, &report);
            })?;
            knowledge.lost_counts(&result)
        }
        _ => {
            commission::succeeded(&result)?;
            bail!("the servo has not tracked; run it again with --verbose")
        }
    }
}

/// Prints and writes; a fault first.
fn concluded(
    arguments: &Arguments,
    log: &RunLog,
    report: &TrackJson,
    print: &dyn Fn(),
) -> anyhow::Result<()> {
    let fault = report.faulted.then(|| fault_ended(log));
    print();
    if let Some(path) = &arguments.json {
        write_atomically(path, &(serde_json::to_string_pretty(report)? + "\n"))?;
    }
    fault.map_or(Ok(()), |fault| Err(fault.into()))
}

fn print_loop(result: &SessionResult, tasks: &[Task]) {
    let known = match (result.done.first(), tasks.first()) {
        (Some(Done::Commissioned(outcome)), _) => Some(&outcome.estimates),
        (_, Some(Task::Adopt(estimates))) => Some(&**estimates),
        _ => None,
    };
    let shape = |known| LoopShape::of(&result.log.config, result.tuning, known);
    if let Some(LoopShape { crossover_rad_s: crossover, phase_margin_deg: margin }) = known.and_then(shape) {
        outln!("{:21} crossover {crossover:.1} rad/s, phase margin {margin:.0}°", "position loop");
    }
}

fn print_fitted(result: &SessionResult) {
    if let Some(fitted) = &result.fitted {
        outln!("{:21} {}", "scaled to fit", fitted.fitted_text());
    }
}

fn print_tracked(log: &RunLog, report: &TrackJson) {
    let [position, peak] = [report.position_rms_rad, report.position_peak_rad];
    outln!("{:21} {position:.6} rad, peak {peak:.6} rad", "position error, rms");
    let [speed, peak] = [report.speed_rms_rad_s, report.speed_peak_rad_s];
    outln!("{:21} {speed:.4} rad/s, peak {peak:.4} rad/s", "speed error, rms");
    if report.saturated_share > 0.0 {
        outln!("{:21} {:.1} % of the time", "limits acted", 100.0 * report.saturated_share);
    }
    let last = log.rows.last();
    if let Some(text) = last.and_then(|row| advisory_text(row.record.advisory)) {
        outln!("{:21} {text}", "advisory");
    }
}

/// An excitation has no set-point that could be missed; what was learned from it is its result.
fn print_learned(report: &TrackJson) {
    for (name, unit, number) in report.learned.iter().flat_map(Learned::numbers) {
        commission::print_number(name, unit, &number);
    }
}
