//! `truing params`: the parameters of a servo, in force and stored; and from a model to parameters.

use crate::compensation;
use anyhow::Context;
use clap::{Args, Subcommand};
use servo::link::protocol::{Command, Message};
use std::path::PathBuf;
use truing_core::text::input_error::InputError;
use truing_files::model;
use truing_report::console::files::Files;
use truing_report::report::write_atomically;
use truing_servo::commands::firmware::{AxisFile, Firmware};
use truing_servo::device::commission_report::Params;
use truing_servo::device::link::{Client, found_text, store_text};
use truing_servo::device::parameters;

/// Arguments of `truing params`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub action: Action,
}

/// What can be done with parameters.
#[derive(Subcommand, Debug)]
pub enum Action {
    /// Print what is in force, one `key = value` a line.
    Get(Firmware),
    /// Put other values in force; what is not stored is lost with the power.
    Set(Set),
    /// Store what is in force on all axes.
    Save(Firmware),
    /// Forget everything about this axis, in force and stored.
    Reset(Firmware),
    /// Turn the effects of a model into the parameters of the compensation: a file for `--params`.
    Export(Export),
}

/// What to change.
#[derive(Args, Debug)]
pub struct Set {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// `key=value`, keys as `get` prints them; `none` unsets. Without any, an axis that knows nothing takes the axis file.
    pub assignments: Vec<String>,
    /// Take what an earlier commissioning or `truing params export` has found.
    #[arg(long)]
    pub params: Option<PathBuf>,
    /// Store it too.
    #[arg(long)]
    pub save: bool,
}

/// Which model.
#[derive(Args, Debug)]
pub struct Export {
    /// The extended model, as `truing gap --out` writes it: model.extended.toml.
    pub model: PathBuf,
    /// The axis.
    #[command(flatten)]
    pub axis: AxisFile,
    /// Where to write the parameters; without it they are printed.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Does it.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    match &arguments.action {
        Action::Get(firmware) => print(&mut open(firmware)?),
        Action::Set(set) => change(set),
        Action::Save(firmware) => save(&mut open(firmware)?),
        Action::Reset(firmware) => reset(&mut open(firmware)?),
        Action::Export(export) => write(export),
    }
}

fn open(firmware: &Firmware) -> anyhow::Result<Client> {
    firmware.files().check()?;
    firmware.client(&firmware.axis_file.read()?.config)
}

fn print(client: &mut Client) -> anyhow::Result<()> {
    let hello = client.hello()?;
    outln!("# {}; started by {}", found_text(hello.stored), format!("{:?}", hello.cause).to_lowercase());
    match client.parameters()? {
        Some(parameters) => out!("{}", parameters::print(&parameters)),
        None => outln!("# this axis is not configured"),
    }
    Ok(())
}

fn change(set: &Set) -> anyhow::Result<()> {
    set.firmware.files().reads("--params", &set.params).check()?;
    let setup = set.firmware.axis_file.read()?;
    let mut client = set.firmware.client(&setup.config)?;
    let known = client.parameters()?;
    if known.is_some() && set.assignments.is_empty() && set.params.is_none() {
        let what = "nothing is set: write key=value, with a key that `truing params get` prints, or --params";
        return Err(InputError(what.into()).into());
    }
    let mut parameters = match known {
        Some(known) => known,
        None => setup.on(&client.board(&mut |_| {})?)?.parameters(None),
    };
    for assignment in &set.assignments {
        parameters::set(&mut parameters, assignment)?;
    }
    if let Some(path) = &set.params {
        parameters::adopt(&mut parameters, &Params::read(path)?)?;
    }
    client.command(Command::Restore(parameters), &mut |_| {})?;
    if set.save { save(&mut client) } else { Ok(()) }
}

fn save(client: &mut Client) -> anyhow::Result<()> {
    client.save(&mut |message| {
        if let Message::Store(event) = message {
            outln!("{}", store_text(event));
        }
    })?;
    outln!("{}", store_text(servo::store::StoreEvent::Saved));
    Ok(())
}

fn reset(client: &mut Client) -> anyhow::Result<()> {
    client.command(Command::Reset, &mut |_| {})?;
    save(client)
}

fn write(export: &Export) -> anyhow::Result<()> {
    let read = Files::default().reads("MODEL", [&export.model]).reads("--config", [&export.axis.config]);
    read.writes("--out", &export.out).check()?;
    let config = export.axis.read()?.config;
    let model = model::read(&export.model)?;
    let found = compensation::corrected(&model, &config)?;
    for remark in &found.remarks {
        errln!("{remark}");
    }
    match &export.out {
        Some(path) => {
            write_atomically(path, &found.text()?)?;
            outln!("written to {}", path.display());
        }
        None => out!("{}", found.text().context("the parameters cannot be written")?),
    }
    Ok(())
}
