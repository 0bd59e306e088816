//! `truing record`: one log that tells effects apart.

use crate::record::{self, Limits, Plan};
use anyhow::ensure;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;
use truing_core::text::input_error::NotDone;
use truing_report::console::interrupt;
use truing_report::report::write_atomically;
use truing_servo::commands::firmware::Firmware;
use truing_servo::device::aftermath::fault_text;
use truing_servo::device::commission_report::Params;
use truing_servo::device::session::{self, Listening};

/// Below `--help`, not below `-h`.
const EXAMPLES: &str = "\
Examples:
  What would happen, without moving anything:
      truing record --motor serial:/dev/ttyACM0 --config axis.toml --dry-run
  A joint that may turn half a radian to each side of where it stands:
      truing record --motor serial:/dev/ttyACM0 --config axis.toml --travel-rad 0.5 --log run.csv
  Then:
      truing gap --model motor.toml --log run.csv";

/// Behind a recording that shows next to nothing.
const HARDLY_MOVED: &str = "so little is known of the motor that the travel allows no more voltage; commission it, and give the \
                            result with --params";

/// Arguments of `truing record`.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Which servo; --seed orders the segments too.
    #[command(flatten)]
    pub firmware: Firmware,
    /// Scale voltages and times by the result of an earlier commissioning (`truing commission --save`).
    #[arg(long)]
    pub params: Option<PathBuf>,
    /// Longest recording, s; 25 s suffice for a motor with a time constant of 0.15 s.
    #[arg(long)]
    pub budget_s: Option<f64>,
    /// Travel to each side of the start, rad at the joint; `axis.travel_limit_rad` holds besides.
    #[arg(long)]
    pub travel_rad: Option<f64>,
    /// Electrical energy that may be spent, J; it needs a current sensor. `limits.energy_j` holds besides.
    #[arg(long)]
    pub energy_j: Option<f64>,
    /// Print what would happen, and move nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Where the log goes: format 1, every record, the plan as comments.
    #[arg(long, required_unless_present = "dry_run")]
    pub log: Option<PathBuf>,
}

/// Plans, records, writes the log. What was recorded before an error or an interruption is written too.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    let firmware = &arguments.firmware;
    firmware.files().reads("--params", &arguments.params).writes("--log", &arguments.log).check_ready()?;
    let setup = firmware.axis_file.read()?;
    let plan = arguments.plan(&setup.config)?;
    out!("{}", plan.text());
    let Some(path) = arguments.log.as_ref().filter(|_| !arguments.dry_run) else { return Ok(()) };
    let every = session::decimation(&firmware.motor, &setup.config);
    let wire = firmware.connect(&setup.config)?;
    let bar = ProgressBar::new(1000);
    bar.set_style(ProgressStyle::with_template("{msg:14} {wide_bar} {percent:>3} %")?);
    let recorded =
        record::run(wire, &setup, Listening { axis: firmware.axis, every }, &plan, &mut |progress| {
            bar.set_message(progress.task.to_owned());
            bar.set_position((progress.share * 1000.0) as u64);
        });
    bar.finish_and_clear();
    let recorded = recorded?;
    let log = &recorded.session.log;
    write_atomically(path, &recorded.to_csv(&plan))?;
    if firmware.verbose {
        recorded.session.firmware_log.iter().for_each(|line| errln!("firmware: {line}"));
    }
    let seconds = log.rows.len() as f64 * f64::from(every) / f64::from(log.config.tick_hz);
    let kept = if every == 1 { "every control tick".into() } else { format!("one control tick in {every}") };
    outln!("{:21} {seconds:.1} s, {} rows, {kept}", "recorded", log.rows.len());
    let [lower, upper] = recorded.reach_rad;
    outln!("{:21} from {lower:.3} to {upper:.3} rad", "reached");
    if recorded.hardly_moved(&plan) {
        outln!("{:21} {HARDLY_MOVED}", "hardly moved");
    }
    if let Some(energy) = recorded.energy_j {
        let spent = if recorded.spent { ": the limit ended the recording" } else { "" };
        outln!("{:21} {energy:.2} J{spent}", "energy");
    }
    if log.fault() != servo::protect::Fault::None && !interrupt::asked() {
        let text = format!("a fault ended the recording: {}", fault_text(log));
        outln!("{text}");
        return Err(NotDone(text).into());
    }
    recorded.session.complete()?;
    Ok(())
}

impl Arguments {
    fn plan(&self, config: &servo::config::Config) -> anyhow::Result<Plan> {
        for (name, value) in
            [("--budget-s", self.budget_s), ("--travel-rad", self.travel_rad), ("--energy-j", self.energy_j)]
        {
            ensure!(
                value.is_none_or(|value| value > 0.0 && value.is_finite()),
                "{name} must be a finite number above 0"
            );
        }
        let known = self.params.as_ref().map(|path| Params::read(path)).transpose()?;
        let limits = Limits { budget_s: self.budget_s, travel_rad: self.travel_rad, energy_j: self.energy_j };
        Ok(Plan::new(config, known.map(|it| it.estimates(config)).as_ref(), &limits, self.firmware.seed)?)
    }
}
