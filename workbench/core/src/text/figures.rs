//! Numbers and lists in sentences.

use std::borrow::Borrow;

/// Four significant digits, without trailing zeros; powers of ten where plain digits would not be readable.
pub fn figure(x: f64) -> String {
    significant(x, 4)
}

/// A gap with four significant digits, zeros kept: gaps are read one below the other.
pub fn gap(rms: f64) -> String {
    match 3.0 - rms.abs().log10().floor() {
        decimals if (0.0..=7.0).contains(&decimals) => format!("{rms:.0$}", decimals as usize),
        _ => figure(rms),
    }
}

/// A number with so many digits, for a file: what it says beyond them is noise.
pub fn rounded(number: f64, digits: usize) -> f64 {
    format!("{number:.*e}", digits - 1).parse().unwrap_or(number)
}

/// `digits` significant digits, without trailing zeros.
pub fn significant(x: f64, digits: usize) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !x.is_finite() {
        return "–".into();
    }
    let magnitude = x.abs().log10().floor() as i32;
    if !(-4..6).contains(&magnitude) {
        return format!("{:.*e}", digits.saturating_sub(1), x);
    }
    let decimals = (digits as i32 - 1 - magnitude).max(0) as usize;
    without_trailing_zeros(format!("{x:.decimals$}"))
}

fn without_trailing_zeros(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

/// `J_kgm2, Kt_nm_per_a and R_ohm`
pub fn listing(names: &[impl Borrow<str>]) -> String {
    match names {
        [] => "nothing".into(),
        [one] => one.borrow().to_owned(),
        [first @ .., last] => format!("{} and {}", first.join(", "), last.borrow()),
    }
}

/// `48 %`; small shares keep a digit.
pub fn percent(share: f64) -> String {
    let p = 100.0 * share;
    if p.abs() < 10.0 { format!("{} %", significant(p, 2)) } else { format!("{p:.0} %") }
}
