//! What the bench image counts, near the figures of docs/results/cost.md. Two-sided: a count far below means that the subject did
//! not do its work.

use trials::counts::{self, Count};

/// Subject, control rate → average, worst, share by which a count may differ. The crates that are compared with are fixed;
/// ours changes with what it does.
const DOCUMENTED: [(&str, u32, f64, u32, f64); 10] = [
    ("identifier, learning", 10_000, 72.0, 799, 0.1),
    ("identifier, learning", 1_000, 296.0, 934, 0.1),
    ("identifier, listening", 1_000, 310.0, 933, 0.1),
    ("loop, tracking", 10_000, 931.0, 1_519, 0.1),
    ("loop, commissioning", 10_000, 881.0, 3_940, 0.1),
    ("compensator", 0, 30.0, 38, 0.15),
    ("compensator, told", 0, 196.0, 212, 0.1),
    ("flight-solver RlsParallel, 4 parameters", 0, 329.0, 332, 0.05),
    ("flight-solver InverseQrRls, 6 parameters", 0, 3_268.0, 3_310, 0.05),
    ("pid", 0, 114.0, 115, 0.05),
];

#[test]
fn the_counts_are_the_documented_ones() {
    let counts = counts::run();
    for (name, tick_hz, average, worst, share) in DOCUMENTED {
        let fits = |count: &&Count| count.name == name && count.tick_hz == tick_hz;
        let count = counts.iter().find(fits).unwrap_or_else(|| panic!("{name} is missing: {counts:?}"));
        let near = |now: f64, then: f64| (now / then - 1.0).abs() < share;
        assert!(near(count.average, average), "{count:?}: documented {average} on average");
        assert!(near(f64::from(count.worst), f64::from(worst)), "{count:?}: documented {worst} at worst");
    }
}
