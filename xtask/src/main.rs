//! `cargo xtask …`: what a newcomer types. Sets up what is missing, then runs the main job or every test.

mod bench;
mod dist;
mod documents;
mod engines;
mod figures;
mod flash;
mod image;
mod instructions;
mod motors;
mod mutants;
mod page;
mod panics;
mod peers;
mod process;
mod programs;
mod raw;
mod search;
mod setup;
mod size;
mod steps;
mod targets;
mod test;
mod wheel;

use anyhow::Result;
use clap::{Parser, Subcommand};
use image::{Boards, Image};
use programs::Program;
use std::process::ExitCode;

/// Set-up, demo, tests and measurements of Truing.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install what is missing: the chip's Rust target and QEMU.
    Setup,
    /// Run the main job: firmware in QEMU, commissioning, compensation, gap workflow, report.
    Demo {
        /// Passed on to `truing demo`, e.g. `--seed 7`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Build the image of every board into target/images/ as .elf, .bin and .hex, and print where it lies and what it occupies.
    Images,
    /// Build the image of a board, flash it with probe-rs, run it and show its log.
    Flash {
        /// Name of the board: see docs/boards/.
        #[arg(long, default_value = boards::DEFAULT.name, value_parser = flash::board)]
        board: &'static boards::Board,
        /// Check instead that the image fits the chip; needs no probe and no board.
        #[arg(long)]
        dry_run: bool,
    },
    /// Print what the images occupy in flash and RAM; fails when that grew by more than 3 % since docs/cost.toml.
    Size {
        /// Enter the figures into docs/cost.toml instead.
        #[arg(long)]
        accept: bool,
    },
    /// Print the instructions of a control tick, counted in QEMU; fails when they grew by more than 3 %.
    Instructions {
        /// Enter the figures into docs/cost.toml instead.
        #[arg(long)]
        accept: bool,
    },
    /// Count the steps of a fixed set of searches for names; fails when they grew by more than 3 %.
    Search {
        /// Enter the figures into docs/cost.toml instead.
        #[arg(long)]
        accept: bool,
    },
    /// Count our identifier, compensator and loop beside published crates, in QEMU.
    Bench,
    /// List what of control, link and idle can reach a panic; fails on anything that is not accepted with a reason.
    Panics,
    /// Change drivers, protection and image in thousands of small ways, and list the changes that no test notices. Takes
    /// hours; `--sample 80` takes some minutes.
    Mutants {
        #[command(flatten)]
        choice: mutants::Choice,
    },
    /// Build the page in the browser into target/page/.
    Page {
        #[command(flatten)]
        choice: page::Choice,
    },
    /// Print the figures of the code base: code lines, lengths of functions and files, rooms, arrows between them, circles.
    House,
    /// Build the Python package into target/wheel/out/.
    Wheel {
        /// Test it in a fresh environment as well: types, tests, notebooks, and the command line's bytes.
        #[arg(long)]
        check: bool,
    },
    /// Pack a static program and the wheel into target/dist/.
    Dist,
    /// Run other programs for system identification on the same data, and write docs/results/peers.md.
    Peers(peers::Choice),
    /// Run exported models in MuJoCo, PyBullet and Drake beside `truing simulate`, and print how far they are apart.
    Engines(engines::Choice),
    /// Run `truing improve` on motors of MuJoCo, scipy and gym-electric-motor behind the image in QEMU, and print what it was worth.
    Motors(motors::Choice),
    /// Run every test: formatting, lints, host tests, both images, the image in QEMU, the documentation.
    Test {
        /// The long proofs whole, of which the ordinary run does a part: all rigs, all power cuts, all boards. Takes twice as long.
        #[arg(long)]
        all: bool,
    },
}

fn main() -> ExitCode {
    match run(Arguments::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn run(command: Command) -> Result<()> {
    match command {
        Command::Setup => setup::everything(),
        Command::Demo { arguments } => demo(&arguments),
        Command::Images => setup::everything().and_then(|()| size::images(Boards::All)),
        Command::Flash { board, dry_run } => {
            setup::rust_targets().and_then(|()| flash::flash(board, dry_run))
        }
        Command::Size { accept } => setup::everything().and_then(|()| size::print(Boards::All, accept)),
        Command::Instructions { accept } => setup::everything().and_then(|()| instructions::print(accept)),
        Command::Search { accept } => search::print(accept),
        Command::Bench => setup::everything().and_then(|()| bench::print()),
        Command::Panics => setup::everything().and_then(|()| panics::check(Boards::All, false)),
        Command::Mutants { choice } => mutants::check(&choice),
        Command::Peers(choice) => peers::compare(&choice),
        Command::Engines(choice) => engines::compare(&choice),
        Command::Motors(choice) => motors::improve(&choice),
        Command::Page { choice } => page::page(&choice),
        Command::House => process::run(&mut Program::House.run()),
        Command::Wheel { check } => wheel::wheel(check),
        Command::Dist => dist::dist(),
        Command::Test { all } => test::everything(all),
    }
}

fn demo(arguments: &[String]) -> Result<()> {
    setup::everything()?;
    // Some minutes the first time, so Cargo shows what it does.
    process::run(&mut Program::Truing.cargo("build"))?;
    Image::of(&boards::QEMU).build()?;
    process::run(Program::Truing.run().arg("demo").args(arguments))
}
