//! One file a subcommand: its arguments and a recipe of a dozen lines. A new subcommand is one file, one variant of
//! [`Command`] and one arm of [`Cli::run`].

pub mod completions;
pub mod effects;
pub mod fleet;
pub mod gap;
pub mod look;
pub mod simulate;
pub mod start;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};
use proving::commands::{bench, cases, demo, instructions, judge};
use truing_core::text::input_error::nearest;
use truing_params::command as params;
use truing_servo::commands::{capture, commission, monitor, move_to, replay, track};

/// For the help.
const EXIT_STATUS: &str = "\
Exit status: 0 done, whatever was found; 1 the servo did not do what it was asked for (a refused commissioning, a fault, an event that did \
not come), something is missing (gap --check), or a rig is answered wrongly (judge); 2 the input is unusable or the output cannot be \
written; 130 interrupted, the servo stopped. docs/exit-codes.md has them all.";

/// Finds where a motor model and measured data disagree, names the missing effect, adds it and shows the gap shrink.
#[derive(Debug, Parser)]
#[command(name = "truing", version, after_help = EXIT_STATUS)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Compare a model with a log, name what is missing, extend the model.
    Gap(gap::Arguments),
    /// Show what is in a log: columns, units, rate, gaps, a plot, the ready --columns.
    Look(look::Arguments),
    /// Write a model file from a log and what is printed on a motor.
    Start(start::Arguments),
    /// Run the gap workflow on a folder of rigs and compare its answers with what is known of them.
    Judge(judge::Arguments),
    /// Count what a fixed set of searches costs: simulations, steps, time, memory.
    Bench(bench::Arguments),
    /// Judge many logs of many motors; tell how they differ and what changes.
    Fleet(fleet::Arguments),
    /// Run any model on any input.
    Simulate(simulate::Arguments),
    /// List the library of physical effects with their equations.
    Effects(effects::Arguments),
    /// Let the firmware excite its motor and identify it.
    Commission(commission::Arguments),
    /// Let the firmware follow a profile.
    Track(track::Arguments),
    /// Let the firmware go to a place and hold it.
    Move(move_to::Arguments),
    /// Those of the loop that closes itself.
    #[command(flatten)]
    Loop(truing_improve::commands::Command),
    /// Those that write and read files of other programs.
    #[command(flatten)]
    Elsewhere(truing_export::commands::Command),
    /// Count the instructions of a control tick of the firmware in QEMU.
    Instructions(instructions::Arguments),
    /// Run the main job end to end and write a report.
    Demo(demo::Options),
    /// Record 1,024 control ticks around an event at full rate.
    Capture(capture::Arguments),
    /// Watch the servo commission and track, live.
    Monitor(monitor::Arguments),
    /// Read, change, store and reset a servo's parameters; turn a model into parameters.
    Params(params::Arguments),
    /// Run a firmware log through the library on the host and compare every bit.
    Replay(replay::Arguments),
    /// Draw data in which an effect is hidden, answers apart.
    Cases(cases::Arguments),
    /// Write completions for every shell and the manual pages.
    Completions(completions::Arguments),
}

impl Cli {
    /// The command line. clap knows no neighbour of a short word: `gpa` is `gap`.
    pub fn read() -> Self {
        Self::try_parse().unwrap_or_else(|mut error| {
            if let (ErrorKind::InvalidSubcommand, Some(ContextValue::String(wrong))) =
                (error.kind(), error.get(ContextKind::InvalidSubcommand))
                && error.get(ContextKind::SuggestedSubcommand).is_none()
            {
                let command = Self::command();
                let near =
                    nearest(wrong, command.get_subcommands().map(clap::Command::get_name)).map(str::to_owned);
                if let Some(near) = near {
                    error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![near]));
                }
            }
            error.exit()
        })
    }

    /// Runs the chosen subcommand. An error is one sentence for the user.
    pub fn run(self) -> anyhow::Result<()> {
        match self.command {
            Command::Gap(arguments) => gap::run(&arguments),
            Command::Look(arguments) => look::run(&arguments),
            Command::Start(arguments) => start::run(&arguments),
            Command::Judge(arguments) => judge::run(&arguments),
            Command::Bench(arguments) => bench::run(&arguments),
            Command::Fleet(arguments) => fleet::run(&arguments),
            Command::Simulate(arguments) => simulate::run(&arguments),
            Command::Effects(arguments) => effects::run(&arguments),
            Command::Commission(arguments) => commission::run(&arguments),
            Command::Track(arguments) => track::run(&arguments),
            Command::Move(arguments) => move_to::run(&arguments),
            Command::Loop(command) => command.run(),
            Command::Elsewhere(command) => command.run(),
            Command::Instructions(arguments) => instructions::run(&arguments),
            Command::Demo(arguments) => demo::command::run(&arguments),
            Command::Capture(arguments) => capture::run(&arguments),
            Command::Monitor(arguments) => monitor::run(&arguments),
            Command::Params(arguments) => params::run(&arguments),
            Command::Replay(arguments) => replay::run(&arguments),
            Command::Cases(arguments) => cases::run(&arguments),
            Command::Completions(arguments) => completions::run(&arguments),
        }
    }
}
