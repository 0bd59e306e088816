//! What the commands that run the firmware have in common.

use crate::axis_file;
use crate::motor::{Door, qemu};
use crate::servo_link::Wire;
use crate::session;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use servo::config::Config;
use std::path::PathBuf;

/// Which servo.
#[derive(Args, Debug)]
pub struct Firmware {
    /// The motor: builtin:FILE.toml, exec:COMMAND or serial:PORT.
    #[arg(long)]
    pub motor: Door,
    /// What the firmware may know: axis.toml.
    #[arg(long)]
    pub config: PathBuf,
    /// Orders the excitation, and feeds the builtin motor's noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// The firmware image for QEMU.
    #[arg(long, default_value_os_t = qemu::default_image())]
    pub image: PathBuf,
    /// Print the firmware's own log.
    #[arg(long, short)]
    pub verbose: bool,
}

impl Firmware {
    /// Reads the axis file.
    pub fn axis(&self) -> anyhow::Result<Config> {
        Ok(axis_file::read(&self.config)?)
    }

    /// Opens the way to the servo.
    pub fn connect(&self, config: &Config) -> anyhow::Result<Box<dyn Wire>> {
        let qemu = qemu::Options {
            image: self.image.clone(),
            ..qemu::Options::default()
        };
        Ok(session::connect(&self.motor, config, self.seed, &qemu)?)
    }

    /// Runs the tasks with a progress bar.
    pub fn run(&self, config: Config, tasks: &[session::Task]) -> anyhow::Result<session::SessionResult> {
        let bar = ProgressBar::new(1000);
        bar.set_style(ProgressStyle::with_template(
            "{msg:14} {wide_bar} {percent:>3} %",
        )?);
        let result = self.run_with(config, tasks, &mut |progress| {
            bar.set_message(progress.task.to_owned());
            bar.set_position((progress.share * 1000.0) as u64);
        });
        bar.finish_and_clear();
        result
    }

    /// Runs the tasks; `progress` is told about every 512 control ticks.
    pub fn run_with(
        &self,
        config: Config,
        tasks: &[session::Task],
        progress: &mut dyn FnMut(session::Progress),
    ) -> anyhow::Result<session::SessionResult> {
        let wire = self.connect(&config)?;
        let every = session::decimation(&self.motor, &config);
        let result = session::run(wire, config, every, tasks, progress)?;
        if self.verbose {
            result
                .firmware_log
                .iter()
                .for_each(|line| eprintln!("firmware: {line}"));
        }
        Ok(result)
    }
}
