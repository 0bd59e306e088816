//! What the commands that run the firmware have in common.

use crate::axis_file;
use crate::motor::{Door, qemu};
use crate::servo_link::{Client, Wire, fault_advice};
use crate::session;
use crate::setup::Setup;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use servo::config::Config;
use servo::protect::Fault;
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
    /// The flash of the firmware in QEMU: a file in which stored parameters survive from one command to the next.
    #[arg(long)]
    pub flash: Option<PathBuf>,
    /// Axis of the servo, from 0.
    #[arg(long, default_value_t = 0)]
    pub axis: u8,
    /// Print the firmware's own log.
    #[arg(long, short)]
    pub verbose: bool,
}

impl Firmware {
    /// Reads the axis file.
    pub fn axis(&self) -> anyhow::Result<Setup> {
        Ok(axis_file::read(&self.config)?)
    }

    /// Opens the way to the servo.
    pub fn connect(&self, config: &Config) -> anyhow::Result<Box<dyn Wire>> {
        let qemu = qemu::Options {
            image: self.image.clone(),
            flash: self.flash.clone(),
            ..qemu::Options::default()
        };
        Ok(session::connect(&self.motor, config, self.seed, &qemu)?)
    }

    /// A client on the axis that was asked for, without any command sent.
    pub fn client(&self, config: &Config) -> anyhow::Result<Client> {
        let mut client = Client::new(self.connect(config)?);
        client.select(self.axis);
        Ok(client)
    }

    /// Runs the tasks with a progress bar.
    pub fn run(&self, setup: &Setup, tasks: &[session::Task]) -> anyhow::Result<session::SessionResult> {
        let bar = ProgressBar::new(1000);
        bar.set_style(ProgressStyle::with_template(
            "{msg:14} {wide_bar} {percent:>3} %",
        )?);
        let result = self.run_with(setup, tasks, &mut |progress| {
            bar.set_message(progress.task.to_owned());
            bar.set_position((progress.share * 1000.0) as u64);
        });
        bar.finish_and_clear();
        result
    }

    /// Runs the tasks; `progress` is told about every 512 control ticks.
    pub fn run_with(
        &self,
        setup: &Setup,
        tasks: &[session::Task],
        progress: &mut dyn FnMut(session::Progress),
    ) -> anyhow::Result<session::SessionResult> {
        // A servo that is to use what it has stored is not configured anew.
        let excites = matches!(tasks.last(), Some(session::Task::Excite(_)));
        let start = match tasks.first() {
            Some(_) if excites => session::Start::Configure(*setup),
            Some(
                session::Task::Track { .. }
                | session::Task::Capture { .. }
                | session::Task::Fit
                | session::Task::Reference(_)
                | session::Task::Move(_),
            ) => session::Start::Stored,
            _ => session::Start::Configure(*setup),
        };
        let listening = session::Listening {
            axis: self.axis,
            every: session::decimation(&self.motor, &setup.config),
        };
        let result = session::run_from(self.connect(&setup.config)?, start, listening, tasks, progress)?;
        if result.cleared != Fault::None {
            eprintln!("cleared: {}", fault_advice(result.cleared));
        }
        if self.verbose {
            result
                .firmware_log
                .iter()
                .for_each(|line| eprintln!("firmware: {line}"));
        }
        Ok(result)
    }
}
