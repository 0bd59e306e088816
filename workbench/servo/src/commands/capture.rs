//! `truing capture`: 1,024 control ticks around an event, at full rate, whatever the link carries.

use super::commission::{self, Motion};
use crate::device::run_log::reference;
use crate::device::session::{Captured, Task};
use anyhow::Context;
use clap::{Args, ValueEnum};
use servo::config::Config;
use servo::link::capture::{LENGTH, Stage, Trigger};
use servo::record::Activity;
use std::fmt::Write as _;
use std::path::PathBuf;
use truing_core::text::input_error::NotDone;
use truing_report::console::interrupt;
use truing_report::report::write_atomically;

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

impl Event {
    /// What the servo waits for. A voltage that is applied is no motion that it tracks.
    fn of(self, motion: &Task) -> Trigger {
        let begins = match motion {
            Task::Excite(_) => Activity::Driving,
            _ => Activity::Tracking,
        };
        match self {
            Event::Now => Trigger::Now,
            Event::Fault => Trigger::Fault,
            Event::Limit => Trigger::Limit,
            Event::Motion => Trigger::Activity(begins),
            Event::Hold => Trigger::Activity(Activity::Holding),
        }
    }
}

/// Arguments of `truing capture`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo, and what is known about its motor.
    #[command(flatten)]
    pub motion: Motion,
    /// The motion, as in `truing track`.
    #[arg(long)]
    pub profile: String,
    /// What to wait for.
    #[arg(long, value_enum, default_value = "motion")]
    pub trigger: Event,
    /// Control ticks to keep from before the event, up to 1023.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u16).range(..=LENGTH as i64 - 1))]
    pub before: u16,
    /// Where to write the capture, CSV.
    #[arg(long)]
    pub out: PathBuf,
}

/// Runs and writes.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    let Arguments { motion: asked, profile, out, .. } = arguments;
    asked.files(profile).writes("--out", [out]).check_ready()?;
    let (setup, first, motion) = asked.follows(profile)?;
    let capture = Task::Capture { trigger: arguments.trigger.of(&motion), before: arguments.before };
    let tasks: Vec<Task> = first.into_iter().chain([capture, motion]).collect();
    let result = asked.firmware.run(&setup, &tasks)?;
    if let Some(captured) = &result.captured {
        write_atomically(out, &csv(captured, &setup.config))?;
    }
    let result = result.complete()?;
    if asked.knowledge.is_learned() && !matches!(tasks.last(), Some(Task::Excite(_))) {
        commission::succeeded(&result)?;
    }
    let captured = result.captured.context("the servo has not captured anything; update its firmware")?;
    reported(&captured, arguments)
}

/// The closing line, or what to do if the event has not come.
fn reported(captured: &Captured, arguments: &Arguments) -> anyhow::Result<()> {
    let (ticks, out) = (captured.shots.len(), arguments.out.display());
    if captured.stage != Stage::Done {
        let what = format!(
            "the event has not come: wait for another --trigger, or give a longer --profile ({ticks} control ticks up to its end are in {out})"
        );
        return Err(NotDone(what).into());
    }
    let event = captured.extent.trigger_tick;
    outln!("{ticks} control ticks, event at tick {event}, in {out}");
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
            reference(shot.reference_q8, shot.count, 0) * rad,
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
