//! Positions that begin anew after a turn, counters that wrap, and signs in a bit of their own.

use super::extent::Extent;
use super::spelling::short;

/// What whole numbers fold at: degrees, and counts of usual encoders. Chosen by judgement, from what is sold.
const COUNTS: [u32; 22] = [
    360, 400, 500, 600, 800, 1000, 1200, 1440, 1600, 2000, 2400, 2500, 3600, 4000, 5000, 8000, 10_000,
    20_000, 36_000, 40_000, 65_536, 100_000,
];
/// The same for counters and absolute encoders: their widths, bits. Chosen by judgement, from what is sold.
const BITS: [u32; 9] = [9, 10, 11, 12, 13, 14, 15, 24, 32];
/// Share of the full turn that the values of a folded column fill at least. Chosen by judgement; not studied.
const FILLED: f64 = 0.8;
/// A step over a seam, relative to the steps beside it, at most. Chosen by judgement; not studied.
const LIKE: f64 = 2.0;
/// The largest step of a column whose sign is understood, relative to that of the raw one. Chosen by judgement; not
/// studied.
const SMOOTH: f64 = 0.1;
/// The bit of the sign: of 16 bits, as bus servos send it, and of 32. Origin: definition.
const SIGNS: [f64; 2] = [32_768.0, 2_147_483_648.0];

/// Where a column folds. `None`: it does not. `turn`: one turn in its unit, where that is known.
pub fn full(values: &[f64], turn: Option<f64>) -> Option<f64> {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let Extent { min, max, whole, .. } = Extent::of(&finite)?;
    // A whole number never reaches the full turn, another one may by rounding.
    let most = |full: f64| if whole { full - 1.0 } else { full * (1.0 + 1e-3) };
    let fits = |full: &f64| {
        let above = min >= 0.0 && max <= most(*full);
        let around = min >= -0.5 * full * (1.0 + 1e-3) && max <= 0.5 * full * (1.0 + 1e-3);
        (above || around) && max - min > FILLED * full && has_seams(&finite, *full, whole)
    };
    let counts = COUNTS.map(f64::from).into_iter().chain(BITS.map(|bits| 2_f64.powi(bits as i32)));
    let counts = counts.filter(|_| whole);
    turn.filter(fits).or_else(|| counts.filter(fits).min_by(f64::total_cmp))
}

/// Some steps go over a seam, and unfolded they are like the steps beside them.
fn has_seams(values: &[f64], full: f64, whole: bool) -> bool {
    let step = |k: usize| {
        let step = values.get(k + 1).zip(values.get(k)).map_or(0.0, |(next, value)| (next - value).abs());
        if step > 0.5 * full { full - step } else { step }
    };
    let slack = if whole { 2.0 } else { 0.01 * full };
    let mut seams = (0..values.len().saturating_sub(1))
        .filter(|k| (values[k + 1] - values[*k]).abs() > 0.5 * full)
        .peekable();
    seams.peek().is_some()
        && seams.all(|k| step(k) <= LIKE * step(k + 1).max(if k > 0 { step(k - 1) } else { 0.0 }) + slack)
}

/// Unfolds a column, or gives it its signs; says what was done. `turn`: one turn in its unit, where that is known; `position`: it
/// is one, which folds anywhere.
pub fn unfold(values: &mut [f64], name: &str, turn: Option<f64>, position: bool) -> Option<String> {
    let read = |bit: f64| Some((bit, signed(values, bit)?));
    if let Some((bit, signed)) = SIGNS.into_iter().find_map(read) {
        values.copy_from_slice(&signed);
        let bit = short(bit);
        return Some(format!(
            "`{name}` has its sign in a bit of its own ({bit} and more are negative); it is read so."
        ));
    }
    let full = full(values, turn).filter(|full| position || *full >= 65_536.0)?;
    let (mut before, mut turns, mut seams) = (f64::NAN, 0.0, 0);
    for value in values.iter_mut().filter(|value| value.is_finite()) {
        let step = *value - before;
        if step.abs() > 0.5 * full {
            turns -= step.signum();
            seams += 1;
        }
        before = *value;
        *value += turns * full;
    }
    let at = short(full);
    Some(format!(
        "`{name}` is folded at {at} ({seams} times); it is unfolded, so that it goes on over the seam."
    ))
}

/// Whole numbers that jump between 0 and the bit, and go on smoothly with it as their sign.
fn signed(values: &[f64], bit: f64) -> Option<Vec<f64>> {
    let finite = || values.iter().filter(|value| value.is_finite());
    let steps = |values: &[f64]| {
        let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        finite.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
    };
    let may =
        finite().any(|value| *value >= bit) && finite().all(|value| *value >= 0.0 && value.fract() == 0.0);
    let raw = if may { steps(values) } else { 0.0 };
    let found = [0.0, -bit].map(|before| (raw > 0.5 * bit).then(|| with_sign(values, bit, before)));
    found.into_iter().flatten().find(|signed| steps(signed) < SMOOTH * raw)
}

/// Each value is that of its two meanings which is nearer to the value before: a counter may also pass the bit by counting.
fn with_sign(values: &[f64], bit: f64, mut before: f64) -> Vec<f64> {
    let mut read = |value: f64| {
        let negative = value >= bit && (bit - value - before).abs() < (value - before).abs();
        let value = if negative { bit - value } else { value };
        before = if value.is_finite() { value } else { before };
        value
    };
    values.iter().map(|value| read(*value)).collect()
}
