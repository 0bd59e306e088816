//! `truing completions`: what a shell and `man` want to know of the command line, written from the command line's own description.

use crate::cli::Cli;
use anyhow::Context;
use clap::{Args, CommandFactory, ValueEnum};
use clap_complete::{Shell, generate_to};
use std::path::PathBuf;

/// Where they belong.
const WHERE: &str = "\
Examples:
  truing completions --out completions
  bash:   . completions/truing.bash
  zsh:    a folder of $fpath takes completions/_truing
  fish:   ~/.config/fish/completions takes completions/truing.fish
  man:    man completions/truing-gap.1";

/// Arguments of `truing completions`.
#[derive(Args, Debug)]
#[command(after_long_help = WHERE)]
pub struct Arguments {
    /// Folder for the files; it is made if it is missing.
    #[arg(long)]
    pub out: PathBuf,
}

/// Writes the completions of every shell that is known, and a manual page for each subcommand.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let folder = &arguments.out;
    let complaint =
        || format!("{}: cannot be written; check the folder and its permissions", folder.display());
    std::fs::create_dir_all(folder).with_context(complaint)?;
    let mut command = Cli::command();
    for shell in Shell::value_variants() {
        generate_to(*shell, &mut command, "truing", folder).with_context(complaint)?;
    }
    let without_help = command.disable_help_subcommand(true);
    clap_mangen::generate_to(without_help, folder).with_context(complaint)?;
    Ok(())
}
