//! Excitation: the identification protocol, with amplitudes and order drawn anew for every record.
//!
//! Slow triangle (dead zone, breakaway) · staircases in both directions up to full voltage (knees, drag, sag) · drive, then
//! coast with the bridge open (friction without the winding) · square reversals (dead zone against friction, current limit,
//! play, delay) · logarithmic chirp (inertia, lags) · crawl (cogging, gravity) · at the end the first piece again (drift).

use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use servo::axis::Bridge;
use std::f64::consts::TAU;

/// One row: volts, relative to full voltage, and bridge.
pub type Row = (f64, Bridge);

/// Draws a record of `rows` rows, `rows_per_tau` rows a time constant. `coast`: whether the bridge may open.
pub fn draw(rng: &mut ChaCha8Rng, rows: usize, rows_per_tau: usize, coast: bool) -> Vec<Row> {
    // The whole protocol is 60 time constants long; a shorter or longer record shrinks or stretches its pieces.
    let unit = rows as f64 / 60.0;
    let mut pieces: Vec<Vec<Row>> = vec![
        triangle(rng, unit),
        staircase(rng, unit, 1.0),
        staircase(rng, unit, -1.0),
        coast_down(rng, unit, 1.0, coast),
        coast_down(rng, unit, -1.0, coast),
        reversals(rng, unit),
        chirp(rng, unit, rows_per_tau as f64),
        crawl(rng, unit),
    ];
    pieces.shuffle(rng);
    let first = pieces[0].clone();
    let mut record: Vec<Row> = pieces.into_iter().flatten().collect();
    record.extend(first);
    let rest = (0.0, Bridge::Driven);
    record.resize(rows, rest);
    record
}

fn about(rng: &mut ChaCha8Rng, value: f64) -> f64 {
    value * rng.random_range(0.85..1.15)
}

fn driven(length: f64, voltage: impl Fn(f64) -> f64) -> Vec<Row> {
    let rows = length.round().max(1.0);
    (0..rows as usize).map(|k| (voltage(k as f64 / rows).clamp(-1.0, 1.0), Bridge::Driven)).collect()
}

fn triangle(rng: &mut ChaCha8Rng, unit: f64) -> Vec<Row> {
    let amplitude = about(rng, 0.25);
    driven(8.0 * unit, |s| amplitude * 2.0 / std::f64::consts::PI * (TAU * 2.0 * s).sin().asin())
}

/// The top step is always full voltage: a knee that only one record reaches cannot be judged on the other.
fn staircase(rng: &mut ChaCha8Rng, unit: f64, sign: f64) -> Vec<Row> {
    let levels = [about(rng, 0.15), about(rng, 0.35), about(rng, 0.6), about(rng, 0.8), 1.0];
    driven(7.5 * unit, |s| sign * levels[((s * 5.0) as usize).min(4)])
}

fn coast_down(rng: &mut ChaCha8Rng, unit: f64, sign: f64, open: bool) -> Vec<Row> {
    let level = about(rng, 0.75);
    let mut rows = driven(2.3 * unit, |_| sign * level);
    let idle = (0.0, if open { Bridge::Open } else { Bridge::Driven });
    rows.extend(std::iter::repeat_n(idle, (2.7 * unit) as usize));
    rows
}

fn reversals(rng: &mut ChaCha8Rng, unit: f64) -> Vec<Row> {
    let level = about(rng, 0.8);
    driven(4.8 * unit, |s| if (s * 4.0).fract() < 0.5 { level } else { -level })
}

/// 0.1 … 4 cycles per time constant / 2π.
fn chirp(rng: &mut ChaCha8Rng, unit: f64, rows_per_tau: f64) -> Vec<Row> {
    let level = about(rng, 0.4);
    let length = 10.0 * unit;
    let (low, high) = (0.1_f64, 4.0);
    let sweep = (high / low).ln();
    let taus = length / rows_per_tau;
    driven(length, |s| level * (taus * low * ((sweep * s).exp() - 1.0) / sweep).sin())
}

fn crawl(rng: &mut ChaCha8Rng, unit: f64) -> Vec<Row> {
    let level = about(rng, 0.15);
    driven(5.5 * unit, |s| if s < 0.5 { level } else { -level })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn record_has_its_length_reaches_full_voltage_both_ways_and_repeats_its_first_piece() {
        for seed in 0..20 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let record = draw(&mut rng, 3000, 50, true);
            assert_eq!(record.len(), 3000);
            let highest = record.iter().map(|row| row.0).fold(0.0, f64::max);
            let lowest = record.iter().map(|row| row.0).fold(0.0, f64::min);
            assert_eq!((highest, lowest), (1.0, -1.0));
            let open = record.iter().filter(|row| row.1 == Bridge::Open).count();
            assert!((200..500).contains(&open), "{open}");
            let moving = record.iter().rposition(|row| row.0 != 0.0 || row.1 == Bridge::Open).unwrap_or(0);
            assert!(moving > 2600, "{moving}");
        }
    }
}
