//! `truing move`: the firmware goes to a place and holds it.

use super::commission::{self, Budget, Motion};
use super::firmware::{Log, fault_ended};
use crate::device::session::{Done, Target, Task};
use anyhow::{bail, ensure};
use clap::Args;
use servo::protect::Fault;
use truing_core::text::input_error::NotDone;
use truing_report::console::interrupt;

/// Arguments of `truing move`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo, and what is known about its motor.
    #[command(flatten)]
    pub motion: Motion,
    /// How long a commissioning takes.
    #[command(flatten)]
    pub budget: Budget,
    /// Where to.
    #[command(flatten)]
    pub place: Place,
    /// Where the log goes.
    #[command(flatten)]
    pub log: Log,
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
    let Arguments { motion: asked, log, .. } = arguments;
    asked.files("").writes("--log", &log.log).check_ready()?;
    let setup = asked.firmware.axis_file.read()?;
    let motion = Task::Move(arguments.place.target()?);
    let mut tasks = asked.tasks(&motion, arguments.budget.budget_s, &setup.config)?;
    tasks.push(motion);
    let result = asked.firmware.run_logged(&setup, &tasks, log)?;
    if asked.knowledge.is_learned() {
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
