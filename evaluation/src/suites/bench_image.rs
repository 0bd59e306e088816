//! Instructions of our identifier, compensator and loop beside published crates: the table of docs/results/cost.md.
//!
//! `cargo xtask bench`

use evaluation::Results;
use trials::counts;

/// Subject → arithmetic, what it delivers.
const WHAT: [(&str, &str, &str); 11] = [
    ("loop, commissioning", "i32, i64", "the whole tick of an axis while it identifies"),
    (
        "identifier, learning",
        "i32, i64",
        "dead zone per direction, gain, time constant, uncertainty, trust; full regression",
    ),
    ("loop, tracking", "i32, i64", "the whole tick of an axis that follows a sine"),
    ("identifier, listening", "i32, i64", "the same regression, in ordinary motion"),
    ("compensator, told", "i32, i64", "the same, with all that a model tells"),
    ("compensator", "i32, i64", "inverse dead zone, asymmetric, smooth"),
    (
        "flight-solver RlsParallel, 4 parameters",
        "f32",
        "4 coefficients, covariance form; no uncertainty, no gates, needs a differentiated speed",
    ),
    ("flight-solver RlsParallel, 6 parameters", "f32", "6 coefficients, as above"),
    ("flight-solver InverseQrRls", "f32", "coefficients by inverse QR, as above"),
    ("pid", "f32", "P, I and D terms with limits; no feed-forward, no back-calculation"),
    ("idsp Biquad<i32>", "i32, i64", "a biquad, e.g. a PID, with clamped output"),
];

/// Counts instructions in QEMU: ours beside published crates.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    results: Results,
}

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    page.line("| subject | control rate | updates | average | worst | arithmetic | delivers |");
    page.line("|---|---|---|---|---|---|---|");
    for count in counts::run() {
        let (_, arithmetic, delivers) =
            WHAT.iter().find(|(name, ..)| count.name.starts_with(name)).copied().unwrap_or_default();
        let rate = match count.tick_hz {
            0 => "any".into(),
            hz => format!("{hz} Hz"),
        };
        page.line(format_args!(
            "| {} | {rate} | {} | {:.0} | {} | {arithmetic} | {delivers} |",
            count.name, count.updates, count.average, count.worst
        ));
    }
    page.close("none");
}
