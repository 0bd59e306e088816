//! `truing improve` and `truing undo`.

use crate::bench::{Bench, Moment};
use crate::history::{self, Entry};
use crate::improving::{self, Improved, Job, Stop};
use crate::motions::{Motion, ability, motions};
use crate::{candidate, recording, report, trial};
use anyhow::Context;
use clap::Args;
use servo::config::Config;
use std::path::{Path, PathBuf};
use truing_core::text::input_error::{InputError, NotDone};
use truing_report::console::interrupt;
use truing_report::report::write_atomically;
use truing_servo::commands::firmware::Firmware;
use truing_servo::device::session;
use truing_servo::device::setup::Setup;

/// Arguments of `truing improve`.
#[derive(Args, Debug)]
pub struct Improve {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// A model of the motor, TOML; without it, what the servo knows, or finds out in a commissioning.
    #[arg(long)]
    pub model: Option<PathBuf>,
    /// Folder for logs, history.jsonl, report.html and model.extended.toml; a later run adds to its history.
    #[arg(long)]
    pub out: PathBuf,
    /// How long the motor may be under way, s.
    #[arg(long, default_value_t = 60.0, allow_negative_numbers = true)]
    pub budget_s: f64,
    /// Tell what would be done, and move nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Write the result as JSON, schema truing-improve/1.
    #[arg(long)]
    pub json: Option<PathBuf>,
}

/// Arguments of `truing undo`.
#[derive(Args, Debug)]
pub struct Undo {
    /// The folder that `truing improve --out` has written.
    pub folder: PathBuf,
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// Number of the entry whose old parameters come back; without it, the last one that was kept.
    #[arg(long)]
    pub entry: Option<usize>,
}

/// Improves, and tells it while it goes on.
pub fn improve(arguments: &Improve) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    let Improve { firmware, out, budget_s, .. } = arguments;
    firmware.files().reads("--model", &arguments.model).writes("--json", &arguments.json).check_ready()?;
    anyhow::ensure!(
        (10.0..=3600.0).contains(budget_s),
        "--budget-s is {budget_s}; it must lie between 10 and 3600 s"
    );
    let setup = firmware.axis_file.read()?;
    let model = arguments.model.as_deref().map(truing_files::model::read).transpose()?;
    if arguments.dry_run {
        return plan(&bench(firmware, &setup)?, &setup.config, *budget_s);
    }
    let unwritable = |error| format!("is no folder that can be written ({error}); name another --out");
    std::fs::create_dir_all(out).map_err(|error| InputError::file(out.display(), unwritable(error)))?;
    let job = Job {
        setup,
        model,
        out: out.clone(),
        budget_s: *budget_s,
        seed: firmware.seed,
        analyse: Box::new(candidate::analysed),
    };
    let improved = improving::run(bench(firmware, &setup)?, job, &mut |text| outln!("{text}"))?;
    write(arguments, &improved)?;
    outln!("{}: {}", if improved.improved { "improved and stored" } else { "as it was" }, improved.why);
    outln!("motor time {:.1} s; the report: {}", improved.motor_s, out.join("report.html").display());
    anyhow::ensure!(improved.stop != Stop::Fault, NotDone(improved.why));
    Ok(())
}

fn bench(firmware: &Firmware, setup: &Setup) -> anyhow::Result<Bench> {
    let every = session::decimation(&firmware.motor, &setup.config);
    Ok(Bench::new(firmware.connect(&setup.config)?, session::Listening { axis: firmware.axis, every }))
}

fn write(arguments: &Improve, improved: &Improved) -> anyhow::Result<()> {
    let out = &arguments.out;
    let command = format!("truing improve --out {}", out.display());
    report::page(improved, &command).write(&out.join("report.html"))?;
    if let Some(model) = &improved.model {
        write_atomically(&out.join("model.extended.toml"), &model.source_text)?;
    }
    let Some(path) = &arguments.json else { return Ok(()) };
    write_atomically(path, &(serde_json::to_string_pretty(improved)? + "\n"))
}

/// What would be done.
fn plan(bench: &Bench, config: &Config, budget_s: f64) -> anyhow::Result<()> {
    match bench.in_force()? {
        Some(before) if ability(&before).is_some() => {
            let seconds = trial::seconds([&before; 2])?;
            let plan = recording::plan(&before, budget_s - seconds, 1)?;
            let short = "a recording takes more motor time than there is: raise --budget-s\n";
            out!("{}", plan.map_or(short.into(), |plan| plan.text()));
            outln!("{:21} {seconds:.1} s, {} pairs of runs:", "trial", trial::PAIRS);
            for Motion { name, amplitude_rad, frequency_hz, seconds } in motions([&before; 2])? {
                outln!("{name:21} ± {amplitude_rad:.4} rad at {frequency_hz:.2} Hz for {seconds:.2} s");
            }
        }
        _ => out!("{}", commissioning(config)),
    }
    outln!("at most {budget_s:.0} s of motor time; nothing was moved");
    Ok(())
}

/// The plan for a motor that the servo does not know.
fn commissioning(config: &Config) -> String {
    let way = improving::COMMISSION_S * f64::from(config.rated_speed_rad_s / config.gear_ratio);
    let free = format!("free, less than {way:.0} rad to each side");
    let kept = |[lower, upper]: [f32; 2]| format!("from {lower} to {upper} rad, kept by the servo");
    let travel = config.travel_limit_rad.map_or(free, kept);
    let energy = config.energy_limit_j.get();
    let energy = energy.map_or("no limit: limits.energy_j sets one".into(), |it| format!("at most {it} J"));
    let first = format!("{:.1} s, for the servo does not know its motor", improving::COMMISSION_S);
    let lines = [("commissioning", first), ("travel", travel), ("energy", energy)];
    let lines: String = lines.iter().map(|(what, told)| format!("{what:21} {told}\n")).collect();
    lines + "recording and trial are planned by what it finds\n"
}

/// Brings the parameters of before an entry back.
pub fn undo(arguments: &Undo) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    arguments.firmware.files().check()?;
    let setup = arguments.firmware.axis_file.read()?;
    let bench = bench(&arguments.firmware, &setup)?;
    let (number, entry) = undone(&bench, &arguments.folder, arguments.entry)?;
    outln!("the parameters of before entry {number} are in force and stored; {}", entry.date);
    Ok(())
}

/// Does it; which entry was undone, and the entry that tells so.
pub fn undone(bench: &Bench, folder: &Path, number: Option<usize>) -> anyhow::Result<(usize, Entry)> {
    improving::recover(bench, folder, &mut |text| outln!("{text}"))?;
    let entries = history::read(folder)?;
    let last = || entries.iter().rposition(|entry| entry.kept).map(|place| place + 1);
    let number = number.or_else(last).context("nothing was kept that could be undone")?;
    let entry = number.checked_sub(1).and_then(|place| entries.get(place));
    let entry = entry.with_context(|| format!("there is no entry {number}; `truing history` lists them"))?;
    let (now, at) = (bench.in_force()?, bench.moment()?);
    // Counters of two lives of a servo are none of one another: a table of the other one waits.
    let alive = |then: &Moment| now.is_some_and(|now| then.same_life(&at, now.config.tick_hz));
    let put = if entry.at.as_ref().is_some_and(alive) { Bench::put } else { Bench::restore };
    put(bench, entry.before.as_ref())?;
    bench.keep(entry.before.as_ref())?;
    let undone = Entry { at: Some(at), after: entry.before, ..Entry::now(now) };
    let undone = Entry { why: format!("entry {number} was undone"), ..undone };
    history::append(folder, &undone)?;
    Ok((number, undone))
}
