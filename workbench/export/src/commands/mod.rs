//! One file a subcommand.

pub mod export;
pub mod import;

use clap::Subcommand;

/// The subcommands of the exports.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a model as a file of a simulator, or as the constants of a feed-forward.
    Export(export::Arguments),
    /// Write a nominal model out of an MJCF or URDF file.
    Import(import::Arguments),
}

impl Command {
    /// Runs the chosen one. An error is one sentence for the user.
    pub fn run(&self) -> anyhow::Result<()> {
        match self {
            Command::Export(arguments) => export::run(arguments),
            Command::Import(arguments) => import::run(arguments),
        }
    }
}
