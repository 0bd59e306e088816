//! `truing capture`: 1,024 control ticks around an event, at full rate, whatever the link carries.

use super::commission::{BUDGET_S, Knowledge};
use super::firmware::Firmware;
use super::profile;
use crate::motor::write_whole;
use crate::session::{Captured, Task};
use anyhow::Context;
use clap::{Args, ValueEnum};
use servo::capture::{Stage, Trigger};
use servo::config::Config;
use servo::record::Activity;
use std::fmt::Write as _;
use std::path::PathBuf;

/// What starts the end of the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Event {
    /// At once.
    Now,
    /// A fault is latched.
    Fault,
    /// A limit acts.
    Limit,
    /// The motion begins.
    Motion,
    /// The motion is over and the hold begins.
    Hold,
}

/// Arguments of `truing capture`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// What is known about the motor.
    #[command(flatten)]
    pub knowledge: Knowledge,
    /// The motion, as in `truing track`.
    #[arg(long)]
    pub profile: String,
    /// What to wait for.
    #[arg(long, value_enum, default_value = "motion")]
    pub trigger: Event,
    /// Control ticks to keep from before the event, up to 1023.
    #[arg(long, default_value_t = 256)]
    pub before: u16,
    /// Where to write the capture, CSV.
    #[arg(long)]
    pub out: PathBuf,
}

/// Runs and writes.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let setup = arguments.firmware.axis()?;
    let config = setup.config;
    let motion = profile::task(&arguments.profile, true, &config)?;
    arguments.knowledge.allows(&motion, &config)?;
    let first = arguments
        .knowledge
        .tasks(&motion, BUDGET_S, arguments.firmware.seed, &config)?;
    let begins = match motion {
        Task::Excite(_) => Activity::Driving,
        _ => Activity::Tracking,
    };
    let capture = Task::Capture {
        trigger: match arguments.trigger {
            Event::Now => Trigger::Now,
            Event::Fault => Trigger::Fault,
            Event::Limit => Trigger::Limit,
            Event::Motion => Trigger::Activity(begins),
            Event::Hold => Trigger::Activity(Activity::Holding),
        },
        before: arguments.before,
    };
    let tasks: Vec<Task> = first.into_iter().chain([capture, motion]).collect();
    let result = arguments.firmware.run(&setup, &tasks)?;
    let captured = result
        .captured
        .context("the commissioning was refused, so nothing was captured; see `truing commission`")?;
    write_whole(&arguments.out, &csv(&captured, &config))?;
    println!(
        "{} control ticks, {}, in {}",
        captured.shots.len(),
        match captured.stage {
            Stage::Done => format!("event at tick {}", captured.extent.trigger_tick),
            _ => "the event has not come".to_owned(),
        },
        arguments.out.display()
    );
    Ok(())
}

/// Time 0 is the event. Units as in the log.
fn csv(captured: &Captured, config: &Config) -> String {
    let tick_s = 1.0 / f64::from(config.tick_hz);
    let rad = std::f64::consts::TAU / f64::from(config.counts_per_rev);
    let mut text = String::from(
        "tick,t_s,theta_rad,reference_rad,speed_estimate_rad_s,bridge,duty_raw,command_raw,vbus_raw,current_raw,activity,limit,fault\n",
    );
    for (index, shot) in captured.shots.iter().enumerate() {
        let _ = writeln!(
            text,
            "{index},{:.7},{:.7},{:.7},{:.5},{},{},{},{},{},{},{},{}",
            (index as f64 - f64::from(captured.extent.trigger_index)) * tick_s,
            f64::from(shot.count) * rad,
            f64::from(shot.reference_q8) / 256.0 * rad,
            f64::from(shot.speed_q20) / f64::from(1 << 20) * rad / tick_s,
            shot.bridge as u8,
            shot.duty,
            shot.command_duty,
            shot.vbus_raw,
            shot.current_raw,
            shot.activity as u8,
            shot.limit as u8,
            shot.fault as u8,
        );
    }
    text
}
