//! `truing demo`: the main job end to end. `cargo xtask demo` runs it after set-up.

use crate::cli::demo::{self, Event, Options, survey};
use crate::device::motor::qemu;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Arguments of `truing demo`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Draws the hidden servo.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Instead of one report: the servo case for the seeds 1 to N, as a table.
    #[arg(long, value_name = "N", value_parser = crate::cli::at_least_one::<u64>)]
    pub seeds: Option<u64>,
    /// Folder for the report and everything else.
    #[arg(long, default_value = "target/demo")]
    pub out: PathBuf,
    /// The firmware image for QEMU.
    #[arg(long, default_value_os_t = qemu::default_image())]
    pub image: PathBuf,
}

/// Runs and tells.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let options =
        Options { seed: arguments.seed, out: arguments.out.clone(), image: arguments.image.clone() };
    let bar = ProgressBar::new(1000);
    bar.set_style(ProgressStyle::with_template("  {msg:24} {bar:40} {percent:>3} %")?);
    if let Some(last) = arguments.seeds {
        return survey(last, &options, &bar);
    }
    let mut step = 0;
    demo::run(&options, &mut |event| match event {
        Event::Step(title) => {
            step += 1;
            bar.reset();
            outln!("\n{step}. {title}");
        }
        Event::Found(text) => {
            bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
            bar.finish_and_clear();
            text.lines().for_each(|line| outln!("   {line}"));
        }
        Event::Progress(task, share) => {
            bar.set_message(task.to_owned());
            share.map_or_else(|| bar.tick(), |share| bar.set_position((share * 1000.0) as u64));
        }
    })?;
    let out = options.out.display();
    outln!("\nThe report: {out}/report.html");
    outln!("Beside it: summary.json, model-before.toml, model-after.toml, run.csv, hidden-motor.toml");
    Ok(())
}

/// Runs the servo case for each seed and closes with the figures over all of them.
fn survey(last: u64, options: &Options, bar: &ProgressBar) -> anyhow::Result<()> {
    outln!("{}", survey::HEAD);
    let mut rows = Vec::new();
    for seed in 1..=last {
        let row = survey::Row::run(seed, options, &mut |event| {
            if let Event::Progress(task, share) = event {
                bar.set_message(format!("seed {seed}: {task}"));
                share.map_or_else(|| bar.tick(), |share| bar.set_position((share * 1000.0) as u64));
            }
        })?;
        bar.suspend(|| outln!("{}", row.text()));
        rows.push(row);
    }
    bar.finish_and_clear();
    outln!("{}", survey::closing(&rows));
    Ok(())
}
