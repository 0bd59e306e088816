//! What the commands that run the firmware have in common.

use crate::device::aftermath::fault_text;
use crate::device::axis_file;
use crate::device::link::{Client, Wire, current_text, fault_advice};
use crate::device::motor::{Door, qemu};
use crate::device::run_log::RunLog;
use crate::device::session::{self, Done, Listener, SessionResult, Task};
use crate::device::setup::Setup;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use servo::config::Config;
use servo::protect::Fault;
use std::path::{Path, PathBuf};
use truing_core::text::input_error::NotDone;
use truing_report::console::files::Files;

/// The axis, as a file tells it.
#[derive(Args, Debug)]
pub struct AxisFile {
    /// What the firmware may know: axis.toml.
    #[arg(long)]
    pub config: PathBuf,
}

impl AxisFile {
    /// Reads it.
    pub fn read(&self) -> anyhow::Result<Setup> {
        Ok(axis_file::read(&self.config)?)
    }
}

/// Which servo.
#[derive(Args, Debug)]
pub struct Firmware {
    /// The motor: builtin:FILE.toml, exec:COMMAND or serial:PORT.
    #[arg(long)]
    pub motor: Door,
    /// The axis.
    #[command(flatten)]
    pub axis_file: AxisFile,
    /// Orders the excitation, and feeds the builtin motor's noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// The firmware image for QEMU, by default that of `cargo xtask images`: target/images/qemu.elf.
    #[arg(long, default_value_os_t = qemu::default_image(), hide_default_value = true)]
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
    /// The files that these options name; the flash is written, too.
    pub fn files(&self) -> Files {
        Files::default()
            .reads("--config", [&self.axis_file.config])
            .reads("--image", [&self.image])
            .reads("--motor", motor_files(&self.motor))
            .writes("--flash", &self.flash)
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

    /// Runs the tasks with a progress bar. What was recorded before an error is kept; it stands in the result.
    pub fn run(&self, setup: &Setup, tasks: &[Task]) -> anyhow::Result<SessionResult> {
        self.run_telling(setup, tasks, &mut |_, _| {})
    }

    /// The same with the log written; an error that has ended the session is one here.
    pub fn run_logged(&self, setup: &Setup, tasks: &[Task], log: &Log) -> anyhow::Result<SessionResult> {
        let result = self.run(setup, tasks)?;
        log.save(&result.log)?;
        Ok(result.complete()?)
    }

    /// The same; `done` is told as soon as a task is done, with the log so far.
    pub fn run_telling(
        &self,
        setup: &Setup,
        tasks: &[Task],
        done: &mut dyn FnMut(&Done, &RunLog),
    ) -> anyhow::Result<SessionResult> {
        let bar = ProgressBar::new(1000);
        bar.set_style(ProgressStyle::with_template("{msg:14} {wide_bar} {percent:>3} %")?);
        let result = self.run_with(setup, tasks, &mut |progress| match progress.done {
            Some(what) => bar.suspend(|| done(what, progress.log)),
            None => {
                bar.set_message(progress.task.to_owned());
                bar.set_position((progress.share * 1000.0) as u64);
            }
        });
        bar.finish_and_clear();
        result
    }

    /// Runs the tasks; `progress` is told about every 512 control ticks, and when a task is done.
    pub fn run_with(
        &self,
        setup: &Setup,
        tasks: &[Task],
        progress: &mut Listener,
    ) -> anyhow::Result<SessionResult> {
        // A servo that is to use what it has stored is not configured anew.
        let excites = matches!(tasks.last(), Some(Task::Excite(_)));
        let start = match tasks.first().filter(|_| !excites) {
            Some(
                Task::Track { .. } | Task::Capture { .. } | Task::Fit | Task::Reference(_) | Task::Move(_),
            ) => session::Start::Stored,
            _ => session::Start::Configure(*setup),
        };
        let listening =
            session::Listening { axis: self.axis, every: session::decimation(&self.motor, &setup.config) };
        let result = session::run_kept(self.connect(&setup.config)?, start, listening, tasks, progress)?;
        if result.cleared != Fault::None {
            errln!("cleared: {}", fault_advice(result.cleared));
        }
        let last = result.log.rows.last();
        if let Some(text) = last.and_then(|row| current_text(row.record.current_raw)) {
            errln!("current: {text}");
        }
        if self.verbose {
            result.firmware_log.iter().for_each(|line| errln!("firmware: {line}"));
        }
        Ok(result)
    }
}

/// A fault that has ended a motion, as a line of the report and as the reason of exit status 1.
pub fn fault_ended(log: &RunLog) -> NotDone {
    let text = format!("a fault ended the motion: {}", fault_text(log));
    outln!("{text}");
    NotDone(text)
}

/// Where the log goes.
#[derive(Args, Debug)]
pub struct Log {
    /// Write every control tick as a log in format 1.
    #[arg(long)]
    pub log: Option<PathBuf>,
}

impl Log {
    /// Writes the log of a session as far as it came; an empty one says nothing.
    pub fn save(&self, log: &RunLog) -> anyhow::Result<()> {
        match &self.log {
            Some(path) if !log.rows.is_empty() => log.save(path),
            _ => Ok(()),
        }
    }
}

/// The builtin motor's file; of a program every word of the command that is a file.
fn motor_files(motor: &Door) -> Vec<&Path> {
    match motor {
        Door::Builtin(file) => vec![file],
        Door::Exec(command) => {
            let words = command.split_whitespace().map(Path::new);
            words.filter(|word| word.is_file()).collect()
        }
        Door::Serial(_) => Vec::new(),
    }
}
