//! Numbers and texts as a person reads and types them.

/// A text in the quotes of a shell.
pub fn in_shell(text: &str) -> String {
    match text.contains(['"', '$', '`', '\\', '!']) {
        true => format!("'{}'", text.replace('\'', "'\\''")),
        false => format!("\"{text}\""),
    }
}

/// A number in five digits.
pub fn short(value: f64) -> String {
    in_digits(value, 5)
}

/// A number in so many digits, without zeros behind its decimals.
pub fn in_digits(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { value.to_string() };
    }
    if value.abs() < 1e-4 {
        return format!("{value:.1e}").replace(".0e", "e");
    }
    let decimals = (digits - 1 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
