//! Same code, same bits, at length: sampled plants commission, track and are excited by a chirp through the image in
//! QEMU; every bit is compared with the host.
//!
//! `cargo run -p evaluation -- same-bits --plants 36`

use evaluation::Results;
use servo::motion::excitation::{Sweep, Waveform};
use servo::optional::Optional;
use std::process::ExitCode;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::firmware::compare;
use truing::device::session::{Profile, Task};

/// Commissions, tracks and excites sampled plants in QEMU and replays every session on the host.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// How many plants, dealt over families, severities and control rates.
    #[arg(long, default_value_t = 36)]
    plants: u32,
    /// First of them.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// The paper's motor at 1 kHz alone: at 20 kHz its minute takes hours in QEMU.
    #[arg(long)]
    short: bool,
    #[command(flatten)]
    results: Results,
}

/// Evaluation seeds of this suite start here.
const SEEDS: u32 = 500_000;

pub fn run(arguments: Arguments) -> ExitCode {
    let mut page = arguments.results.page();
    let (mut ticks, mut commissionings, mut different) = (0, 0, 0);
    for number in arguments.first..arguments.first + arguments.plants {
        let family = [Family::G1, Family::G2, Family::G3, Family::Paper][number as usize % 4];
        let severity = [Severity::Nominal, Severity::Harsh][number as usize / 4 % 2];
        let tick_hz = match [1_000, 10_000, 20_000][number as usize / 8 % 3] {
            _ if arguments.short && family == Family::Paper => 1_000,
            tick_hz => tick_hz,
        };
        let options = Options { tick_hz, ..Options::default() };
        let mut plant = Plant::draw(family, severity, Seeds::Evaluation(SEEDS + number), &options);
        // A motor that could not be identified in time is still to be tracked: the loops then take the hint.
        let truth = plant.truth.time_constant_s as f32;
        plant.config.time_constant_hint_s = plant.config.time_constant_hint_s.or(Optional::new(truth));
        match compare(&plant, &tasks(family, &plant, number)) {
            Ok((_, verdict)) => {
                page.line(format_args!("plant {number} ({family:?}, {severity:?}, {tick_hz} Hz): {verdict}"));
                ticks += verdict.ticks;
                commissionings += verdict.commissionings;
                different += u32::from(!verdict.identical());
            }
            Err(error) => {
                page.line(format_args!("plant {number} ({family:?}, {severity:?}, {tick_hz} Hz): {error}"));
                different += 1;
            }
        }
    }
    page.line(format_args!(
        "{} plants, {commissionings} commissionings, {ticks} control ticks: {different} differ",
        arguments.plants
    ));
    let first = SEEDS + arguments.first;
    page.close(&format!("evaluation, {first} to {}", first + arguments.plants.saturating_sub(1)));
    ExitCode::from(u8::from(different > 0))
}

/// The slow motor of the paper needs more time.
fn tasks(family: Family, plant: &Plant, seed: u32) -> Vec<Task> {
    let slow = family == Family::Paper;
    let frequency_hz = if slow { 0.1 } else { 1.0 };
    let peak = 0.15 * plant.config.rated_speed_rad_s;
    vec![
        Task::Commission { budget_s: if slow { 12.0 } else { 5.0 }, seed },
        Task::Track {
            profile: Profile::Sine {
                amplitude_rad: peak / (std::f32::consts::TAU * frequency_hz),
                frequency_hz,
                seconds: 2.0 / frequency_hz,
            },
            compensation: seed.is_multiple_of(2),
        },
        Task::Excite(Waveform {
            amplitude_v: 0.6 * plant.config.supply_nominal_v,
            from_hz: 0.5,
            to_hz: 20.0,
            sweep: Sweep::Logarithmic,
            duration_ms: 2_000,
        }),
    ]
}
