//! Times of day, dates, and numbers that carry their unit, as cells of a column hold them.

use super::words::{self, Measure};
use jiff::fmt::strtime::BrokenDownTime;

/// How a date may stand before a time of day. A record is short: whether 03/04 is in March or in April changes no step.
const DATES: &str = "|%Y-%m-%d |%Y/%m/%d |%d.%m.%Y |%m/%d/%Y |%d/%m/%Y |%d-%b-%Y |%Y%m%d |%a %b %d ";
/// How a time of day may be written; minutes and seconds alone are a spreadsheet's.
const TIMES: [&str; 4] = ["%H:%M:%S%.f", "%I:%M:%S%.f %p", "%H:%M:%S:%f", "%M:%S%.f"];
/// Nanoseconds of a day. Origin: definition.
const DAY_NS: i64 = 86_400_000_000_000;

/// How the cells of a column are to be read.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Times of day or dates, in a format of `jiff`; counted from the first one, nanoseconds.
    Clock { format: String, first_ns: i64 },
    /// Numbers behind which a unit stands: `0.01 sec`.
    Unit(String),
}

impl Form {
    /// The form of a cell that is no number.
    pub fn of(cell: &str) -> Option<Self> {
        if let Some((_, unit)) = parted(cell) {
            return Some(Self::Unit(unit.to_owned()));
        }
        let text = plain(cell)?;
        let formats = DATES.split('|').flat_map(|date| TIMES.map(|time| format!("{date}{time}")));
        let clock = |format: String| Some(Self::Clock { first_ns: nanoseconds(&format, &text)?, format });
        formats.into_iter().find_map(clock)
    }

    /// The number in another cell of this form. A time is in seconds since the first one.
    pub fn number(&self, cell: &str, number: impl Fn(&str) -> Option<f64>) -> Option<f64> {
        match self {
            Self::Clock { format, first_ns } => {
                Some((nanoseconds(format, &plain(cell)?)? - first_ns) as f64 * 1e-9)
            }
            Self::Unit(unit) => {
                let (value, own) = parted(cell).unwrap_or((cell, unit));
                number(value).filter(|_| own == unit)
            }
        }
    }
}

/// A number and the unit behind it.
fn parted(cell: &str) -> Option<(&str, &str)> {
    let end = cell.rfind(|c: char| c.is_ascii_digit())? + 1;
    let (value, unit) = (&cell[..end], cell[end..].trim());
    let is_number =
        !value.contains(|c: char| c.is_alphabetic() && c != 'e' && c != 'E') && !value.contains(':');
    let known = words::unit(unit).is_some_and(|known| known.0 != Measure::Counts);
    (is_number && known).then_some((value, unit))
}

/// A date and time with a blank between them and a decimal point, without its zone. `None`: no clock.
fn plain(cell: &str) -> Option<String> {
    let colon = cell.find(':').filter(|_| cell.starts_with(|c: char| c.is_ascii_alphanumeric()))?;
    let zone = cell[colon..].find(['Z', '+']).or_else(|| cell[colon..].find('-'));
    let text = zone.map_or(cell, |zone| &cell[..colon + zone]).trim_end_matches("UTC").trim();
    let text = match text.as_bytes().get(10) {
        Some(b'T' | b'_') => format!("{} {}", &text[..10], &text[11..]),
        _ => text.to_owned(),
    };
    Some(text.replace(',', "."))
}

fn nanoseconds(format: &str, text: &str) -> Option<i64> {
    let parts = BrokenDownTime::parse(format, text).ok()?;
    let days = parts.to_date().ok().map_or(0, |date| {
        i64::from(date.since(jiff::civil::date(1970, 1, 1)).map_or(0, |span| span.get_days()))
    });
    let minutes = format.starts_with("%M");
    let time = match minutes {
        true => i64::from(parts.minute()?) * 60 + i64::from(parts.second()?),
        false => {
            let time = parts.to_time().ok()?;
            i64::from(time.hour()) * 3600 + i64::from(time.minute()) * 60 + i64::from(time.second())
        }
    };
    Some(days * DAY_NS + time * 1_000_000_000 + i64::from(parts.subsec_nanosecond().unwrap_or(0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_are_read_to_the_microsecond() {
        for [first, second] in [
            ["09:12:01.010", "09:12:01.260"],
            ["2023-06-19 14:57:10.000000", "2023-06-19 14:57:10.25"],
            ["2023-06-19T23:59:59.900Z", "2023-06-20T00:00:00.150Z"],
            ["2023-06-19T14:57:10.000+02:00", "2023-06-19T14:57:10.250+02:00"],
            ["19.06.2023 14:57:10,000", "19.06.2023 14:57:10,250"],
            ["6/19/2023 2:57:10.000 PM", "6/19/2023 2:57:10.250 PM"],
            ["19-Jun-2023 14:57:10.000", "19-Jun-2023 14:57:10.250"],
            ["57:10.0", "57:10.25"],
            ["0.75 sec", "1.0 sec"],
        ] {
            let form = Form::of(first).unwrap_or_else(|| panic!("{first}"));
            let number = |cell: &str| form.number(cell, |cell| cell.parse().ok()).unwrap();
            assert!((number(second) - number(first) - 0.25).abs() < 1e-9, "{second}: {form:?}");
        }
        for none in ["fast", "12", "1:x", "a 5", "12:99:01", "5 enc"] {
            assert_eq!(Form::of(none), None, "{none}");
        }
    }
}
