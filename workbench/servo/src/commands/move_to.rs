//! `truing move`: the firmware goes to a place and holds it.

use super::commission::{self, Knowledge};
use super::firmware::{Firmware, fault_ended, save_log};
use crate::device::session::{Done, Target, Task};
use anyhow::{bail, ensure};
use clap::Args;
use servo::protect::Fault;
use std::path::PathBuf;
use truing_core::text::input_error::NotDone;
use truing_report::console::interrupt;

/// Arguments of `truing move`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// What is known about the motor.
    #[command(flatten)]
    pub knowledge: Knowledge,
    /// Length of the commissioning, s.
    #[arg(long, default_value_t = commission::BUDGET_S, allow_negative_numbers = true)]
    pub budget_s: f64,
    /// Where to.
    #[command(flatten)]
    pub place: Place,
    /// Write every control tick as a log in format 1.
    #[arg(long)]
    pub log: Option<PathBuf>,
}

/// One of both.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
pub struct Place {
    /// To this absolute position, rad from the reference's zero: needs `--reference`, or a servo that has one.
    #[arg(long, allow_hyphen_values = true)]
    pub to: Option<f32>,
    /// By this angle from where the axis is, rad.
    #[arg(long, allow_hyphen_values = true)]
    pub by: Option<f32>,
}

impl Place {
    fn target(&self) -> anyhow::Result<Target> {
        let target = match (self.to, self.by) {
            (Some(rad), _) => Target::To(rad),
            (None, Some(rad)) => Target::By(rad),
            (None, None) => bail!("give --to or --by"),
        };
        ensure!(self.to.or(self.by).is_some_and(f32::is_finite), "--to and --by take a finite number of rad");
        Ok(target)
    }
}

/// Runs and reports.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    let files = arguments.knowledge.files(&arguments.firmware, "");
    files.writes("--log", &arguments.log).check_ready()?;
    let setup = arguments.firmware.axis()?;
    let config = setup.config;
    let motion = Task::Move(arguments.place.target()?);
    let mut tasks =
        arguments.knowledge.tasks(&motion, arguments.budget_s, arguments.firmware.seed, &config)?;
    tasks.push(motion);
    let result = arguments.firmware.run(&setup, &tasks)?;
    save_log(&result.log, arguments.log.as_ref())?;
    if let Some(error) = result.broken {
        return Err(error.into());
    }
    if arguments.knowledge.is_learned() {
        commission::succeeded(&result)?;
    }
    let Some(Done::Moved(arrival)) = result.done.last() else {
        bail!("the servo has not moved; run it again with --verbose");
    };
    if !arrival.held && result.log.fault() != Fault::None {
        return Err(fault_ended(&result.log).into());
    }
    if !arrival.held {
        let what = "the axis did not arrive: see that it moves freely, and look at a --log of the move";
        return Err(NotDone(what.into()).into());
    }
    outln!("{:21} {:.3} s", "arrived after", arrival.seconds);
    outln!("{:21} {:.6} rad", "position error", arrival.error_rad);
    Ok(())
}
