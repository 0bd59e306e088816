//! The main job end to end: the paper's own case, a servo with a hidden nonlinearity in QEMU, the gap workflow on its
//! log, the loop that closes itself, and one report.

pub mod command;
mod comparison;
mod hidden;
mod last_act;
mod paper_case;
mod servo_case;

pub use comparison::{Comparison, Line};
pub use hidden::HiddenServo;
pub use servo_case::ServoCase;

use crate::commands::paper;
use anyhow::Result;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use truing_core::outcome::Outcome;
use truing_improve::improving::Improved;
use truing_report::report::html::Document;
use truing_report::report::{Exporter, terminal::Terminal, write_atomically};
use truing_servo::device::motor::qemu;
use truing_servo::device::tracking::TrackJson;

/// What the user chooses.
#[derive(Args, Clone, Debug)]
pub struct Options {
    /// Draws the hidden servo.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for the report and everything else.
    #[arg(long, default_value = "target/demo")]
    pub out: PathBuf,
    /// The firmware image for QEMU, by default that of `cargo xtask images`: target/images/qemu.elf.
    #[arg(long, default_value_os_t = qemu::default_image(), hide_default_value = true)]
    pub image: PathBuf,
}

/// What the demo has to say while it works.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// A step begins.
    Step(&'a str),
    /// Something was found.
    Found(String),
    /// A step is at this, and this far (0 … 1) where that is known.
    Progress(&'a str, Option<f64>),
}

/// Listens to the demo.
pub type Listener<'a> = dyn FnMut(Event) + Send + 'a;

/// `summary.json`.
#[derive(Debug, Serialize)]
pub struct Summary {
    /// `truing-demo/1`.
    pub schema: &'static str,
    /// Draws the hidden servo.
    pub seed: u64,
    /// The paper's table under the gap workflow.
    pub paper: Outcome,
    /// The servo's log under the gap workflow.
    pub servo: Outcome,
    /// Chip, workbench and truth side by side.
    pub comparison: Comparison,
    /// The sine without compensation.
    pub track_off: TrackJson,
    /// The sine with compensation.
    pub track_on: TrackJson,
    /// Control ticks of which the replay on the host gave the same bits.
    pub replayed_ticks: usize,
    /// What `truing improve` made of a motor with cogging.
    pub improved: Improved,
}

/// Runs it all. An error leaves earlier output in place.
pub fn run(options: &Options, say: &mut Listener) -> Result<Summary> {
    say(Event::Step("The paper's own case: its motor model against its table of measured speeds"));
    let paper = paper_case::analyse();
    say(Event::Found(Terminal.export(&paper)?));

    say(Event::Step("A servo with a hidden nonlinearity: the firmware commissions itself in QEMU"));
    let hidden = HiddenServo::draw(options.seed);
    let case = ServoCase::run(&hidden, options, say)?;
    say(Event::Found(case.describe()));

    say(Event::Step("The gap workflow on the servo's log, from the data sheet's linear model"));
    let (servo, extended) = case.gap(&hidden, say)?;
    say(Event::Found(Terminal.export(&servo)?));

    say(Event::Step("Chip, workbench and hidden truth side by side"));
    let comparison = Comparison::new(&hidden, &case.commission, &extended)?;
    say(Event::Found(comparison.text()));

    say(Event::Step("The loop closes itself: `truing improve` on that motor, with hidden cogging"));
    let improved = last_act::run(&hidden, options, say)?;
    say(Event::Found(last_act::describe(&improved)));

    let summary = Summary {
        schema: "truing-demo/1",
        seed: options.seed,
        paper,
        servo,
        comparison,
        track_off: case.track_off.clone(),
        track_on: case.track_on.clone(),
        replayed_ticks: case.replay.ticks,
        improved,
    };
    write(&options.out, &hidden, &case, &extended, &summary)?;
    Ok(summary)
}

fn write(
    out: &Path,
    hidden: &HiddenServo,
    case: &ServoCase,
    extended: &str,
    summary: &Summary,
) -> Result<()> {
    let file = |name: &str, text: &str| write_atomically(&out.join(name), text);
    file("model-before.toml", &hidden.datasheet_toml())?;
    file("model-after.toml", extended)?;
    file("hidden-motor.toml", &hidden.motor_toml())?;
    file("commission.json", &(serde_json::to_string_pretty(&case.commission)? + "\n"))?;
    file("summary.json", &(serde_json::to_string_pretty(summary)? + "\n"))?;
    Document::new(
        "Truing: the main job, end to end",
        format!("Hidden servo drawn from seed {}", summary.seed),
    )
    .section(summary.comparison.section())
    .section(case.section())
    .section(last_act::section(&summary.improved))
    .gap("The gap workflow on the servo's log", &servo_case::INTRODUCTION, &summary.servo)
    .gap("The paper's table", &paper_case::INTRODUCTION, &summary.paper)
    .section(paper::claims())
    .write(&out.join("report.html"))
}
