//! `truing instructions`: instructions per control tick, counted by QEMU. Counts, not cycles: a Cortex-M4 needs about 1.3 to 1.6 cycles for
//! one.
//!
//! Under `-icount shift=4` an instruction takes 16 ns of QEMU's time, in which SysTick (168 MHz) counts 2.688. The
//! image reads SysTick at the beginning of the control interrupt and behind the bridge command, so the count covers
//! encoder, identifier, loops, compensation, protection and the record, but not the entry into the interrupt and not
//! the copy of the record into the telemetry queue.

use anyhow::{Context, bail};
use clap::Args;
use servo::record::Activity;
use std::path::{Path, PathBuf};
use truing_core::system::model;
use truing_servo::device::axis_file;
use truing_servo::device::link::Lockstep;
use truing_servo::device::motor::{Builtin, qemu};
use truing_servo::device::run_log::Row;
use truing_servo::device::session::{self, Profile, Task};

/// SysTick counts per instruction: 2⁴ ns · 168 MHz.
const COUNTS_PER_INSTRUCTION: f64 = 2.688;
const ICOUNT_SHIFT: u8 = 4;

/// A gear motor in the middle of what the identifier is made for.
const MOTOR: &str = include_str!("instructions.toml");

/// Arguments of `truing instructions`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The firmware image for QEMU, by default that of `cargo xtask images`: target/images/qemu.elf.
    #[arg(long, default_value_os_t = qemu::default_image(), hide_default_value = true)]
    pub image: PathBuf,
}

/// Runs the image at 1 and 10 kHz and prints a table, as docs/results/cost.md shows it.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    outln!("| control rate | activity | ticks | average | worst |");
    outln!("|---|---|---|---|---|");
    for tick_hz in [1_000, 10_000] {
        let rows = measure(&arguments.image, tick_hz)?;
        for (activity, name) in [
            (Activity::Commissioning, "identifying"),
            (Activity::Tracking, "tracking"),
            (Activity::Holding, "holding"),
            (Activity::Idle, "idle"),
        ] {
            line(tick_hz, name, rows.iter().filter(|row| row.record.activity == activity))?;
        }
    }
    Ok(())
}

fn measure(image: &Path, tick_hz: u32) -> anyhow::Result<Vec<Row>> {
    let axis = format!(
        "[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 2048\n[axis]\nrated_speed_rad_s = 170.0\ntick_hz = {tick_hz}\n"
    );
    let config = axis_file::parse("the measured axis", &axis)?.config;
    let model = model::parse("the measured motor", MOTOR)?;
    let options = qemu::Options {
        image: image.to_owned(),
        icount_shift: Some(ICOUNT_SHIFT),
        ..qemu::Options::default()
    };
    let motor = Box::new(Builtin::new(&model, &config, 1));
    let wire = Box::new(Lockstep::start(&options, motor, config)?);
    let tasks = [
        Task::Commission { budget_s: 5.0, seed: 1 },
        Task::Track {
            profile: Profile::Sine { amplitude_rad: 4.0, frequency_hz: 1.0, seconds: 3.0 },
            compensation: true,
        },
    ];
    let result = session::run(wire, config, 1, &tasks, &mut |_| {})?;
    if result.done.len() != tasks.len() {
        bail!("the commissioning was refused, so there is no tracking to measure");
    }
    Ok(result.log.rows)
}

fn line<'a>(tick_hz: u32, name: &str, rows: impl Iterator<Item = &'a Row>) -> anyhow::Result<()> {
    let counts: Vec<f64> = rows.map(|row| f64::from(row.cost) / COUNTS_PER_INSTRUCTION).collect();
    let worst = counts.iter().copied().reduce(f64::max).context("no ticks of this kind")?;
    let average = counts.iter().sum::<f64>() / counts.len() as f64;
    outln!("| {tick_hz} Hz | {name} | {} | {average:.0} | {worst:.0} |", counts.len());
    Ok(())
}
