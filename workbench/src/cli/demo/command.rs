//! `truing demo`: the main job end to end. `cargo xtask demo` runs it after set-up.

use crate::cli::demo::{self, Event, Options};
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
    /// Folder for the report and everything else.
    #[arg(long, default_value = "target/demo")]
    pub out: PathBuf,
    /// The firmware image for QEMU, by default that of `cargo xtask images`: target/images/qemu.elf.
    #[arg(long, default_value_os_t = qemu::default_image(), hide_default_value = true)]
    pub image: PathBuf,
}

/// Runs and tells.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let options =
        Options { seed: arguments.seed, out: arguments.out.clone(), image: arguments.image.clone() };
    let bar = ProgressBar::new(1000);
    bar.set_style(ProgressStyle::with_template("  {msg:24} {bar:40} {percent:>3} %")?);
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
