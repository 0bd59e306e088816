//! Interruptions at random instants: `cargo run -p evaluation -- interruptions --instants 200`.
//!
//! A command that moves a motor is started on the firmware in QEMU and interrupted by Ctrl-C, a termination or a hang-up, at a random
//! instant from its start on. Afterwards the motor must have seen its bridge open, every file that was written must be whole, and
//! neither a process nor a temporary folder may be left.

use evaluation::Results;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::Bridge;
use servo::link::protocol::Command;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use trials::exec_bench::{ExecBench, Said, send};
use truing::device::axis_file;
use truing::device::run_log::Tape;

/// Interrupts commands that move a motor.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Interruptions.
    #[arg(long, default_value_t = 200)]
    instants: u64,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    first: u64,
    #[command(flatten)]
    results: Results,
}

/// The commands, each longer than any instant.
const COMMANDS: [&[&str]; 5] = [
    &["commission", "--budget-s", "60", "--log", "run.csv"],
    &["track", "--profile", "voltage_sine:6,1,60", "--log", "run.csv"],
    &["move", "--by", "1", "--budget-s", "60", "--log", "run.csv"],
    &["capture", "--profile", "voltage_sine:6,1,60", "--out", "run.csv"],
    &["monitor", "--fast", "--profile", "voltage_sine:6,1,60"],
];
/// Instants lie between the start of the program and this, s: the motor turns after some tenths of a second.
const LATEST_S: f64 = 3.0;
/// An interrupted command has ended by then.
const PROMPT: Duration = Duration::from_secs(8);

/// How an interruption went.
struct Seen {
    command: &'static str,
    /// The motor turned before the signal came.
    turned: bool,
    /// What is wrong.
    faults: Vec<String>,
}

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    let mut rows: BTreeMap<&str, [u64; 3]> = BTreeMap::new();
    let mut faults = Vec::new();
    for seed in arguments.first..arguments.first + arguments.instants {
        let seen = interrupted(seed);
        let row = rows.entry(seen.command).or_default();
        row[0] += 1;
        row[1] += u64::from(seen.turned);
        row[2] += u64::from(seen.faults.is_empty());
        faults.extend(seen.faults.iter().map(|fault| format!("- seed {seed}, `{}`: {fault}", seen.command)));
    }
    page.line("| command | interrupted | while the motor program ran | bridge off, files whole, nothing left |\n|---|---|---|---|");
    let sum = |k: usize| rows.values().map(|row| row[k]).sum::<u64>();
    for (command, row) in &rows {
        page.line(format!("| `{command}` | {} | {} | {} |", row[0], row[1], row[2]));
    }
    page.line(format!("| **all** | {} | {} | {} |", sum(0), sum(1), sum(2)));
    faults.iter().for_each(|fault| page.line(fault));
    page.close(&format!("{} … {}", arguments.first, arguments.first + arguments.instants - 1));
}

/// Starts a command, sends a signal, looks at what is left.
fn interrupted(seed: u64) -> Seen {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let command = COMMANDS[random.random_range(0..COMMANDS.len())];
    let signal = ["INT", "TERM", "HUP"][random.random_range(0..3)];
    let instant = Duration::from_secs_f64(random.random_range(0.0..LATEST_S));
    let bench = ExecBench::default();
    let child = bench.command(command, "2").spawn().expect("the program runs");
    std::thread::sleep(instant);
    let turned = bench.path("motor.tick").exists();
    send(signal, &child);
    let begin = Instant::now();
    let said = Said::from(child.wait_with_output().expect("its end"));
    let mut faults = wrong(&bench, &said);
    if begin.elapsed() > PROMPT {
        faults.push(format!("ended after {:.1} s", begin.elapsed().as_secs_f64()));
    }
    faults.extend(bench.left_behind());
    Seen { command: command[0], turned, faults }
}

/// What is wrong with how a command ended and with its files.
fn wrong(bench: &ExecBench, said: &Said) -> Vec<String> {
    let mut faults = Vec::new();
    // Before anything moves a signal may end the program as it ends any other.
    if said.status != Some(130) && said.status.is_some() {
        faults.push(format!("status {:?}: {}", said.status, said.err.trim()));
    }
    if bench.path("motor.end").exists() && bench.text("motor.end") != "bridge 0" {
        faults.push(format!("the motor ended with {}", bench.text("motor.end")));
    }
    if bench.path("motor.tick").exists() && !bench.path("motor.end").exists() {
        faults.push("the motor was not told to end".into());
    }
    if bench.path("run.csv").exists() {
        faults.extend(torn(bench));
    }
    faults
}

/// What is wrong with a log that was written.
fn torn(bench: &ExecBench) -> Option<String> {
    let config = axis_file::read(&bench.path("axis.toml")).expect("the axis").config;
    let tape = match Tape::read(&bench.path("run.csv"), &config) {
        Ok(tape) => tape,
        Err(error) => return Some(format!("the log cannot be read: {error}")),
    };
    let stopped = tape.commands.last().is_some_and(|(_, command)| matches!(command, Command::Stop));
    let open = tape.traces.last().is_none_or(|row| row.bridge == Bridge::Open);
    (!stopped || !open).then(|| "the log does not end with a stop and an open bridge".into())
}
