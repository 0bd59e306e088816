//! `truing replay`: does the library on the host compute the same bits as the chip has?

use crate::device::run_log::Tape;
use crate::device::{axis_file, replay};
use clap::Args;
use servo::link::protocol::Command;
use std::path::PathBuf;
use truing_core::text::input_error::NotDone;

/// Arguments of `truing replay`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// A log of `truing track --log` or `truing commission --log`.
    #[arg(long)]
    pub log: PathBuf,
    /// The axis file it was made with.
    #[arg(long)]
    pub config: PathBuf,
}

/// Replays, tells what the servo told, and says whether every bit is the same.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let setup = axis_file::read(&arguments.config)?;
    let tape = Tape::read(&arguments.log, &setup.config)?;
    let same = tape.commands.iter().all(|(_, command)| match command {
        Command::Configure(other) => setup.agrees(other),
        Command::Restore(parameters) => setup.agrees(&parameters.config),
        _ => true,
    });
    anyhow::ensure!(
        same,
        "{}: was made with another axis file than {}; name the one it was made with",
        arguments.log.display(),
        arguments.config.display()
    );
    let verdict = replay::replay(&tape)?;
    for (tick, told) in &verdict.told {
        outln!("{:8.2} s   {told}", f64::from(*tick) / f64::from(setup.config.tick_hz));
    }
    if !verdict.identical() {
        return Err(NotDone(format!("{}: {verdict}", arguments.log.display())).into());
    }
    outln!("{verdict}");
    Ok(())
}
