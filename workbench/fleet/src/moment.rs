//! When a log was taken.

use jiff::civil::DateTime;
use jiff::tz::TimeZone;
use jiff::{SignedDuration, Timestamp};
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display};
use std::ops::Add;
use std::str::FromStr;

/// Nanoseconds of a day.
const DAY_NS: f64 = 86_400e9;

/// When a log was taken: a date (its midnight), or a date with a time; UTC where nothing else is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Moment(Timestamp);

impl Moment {
    /// Days since another moment, with parts of a day.
    pub fn days_since(self, first: Self) -> f64 {
        // Whole numbers first: days far from 1970 keep their parts.
        (self.0.as_nanosecond() - first.0.as_nanosecond()) as f64 / DAY_NS
    }
}

impl Add<u32> for Moment {
    type Output = Self;

    /// So many days later.
    fn add(self, days: u32) -> Self {
        Self(self.0 + SignedDuration::from_hours(24 * i64::from(days)))
    }
}

impl FromStr for Moment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let plain = || text.parse::<DateTime>().and_then(|it| TimeZone::UTC.to_timestamp(it));
        let read = text.parse::<Timestamp>().or_else(|_| plain());
        read.map(Self).map_err(|_| format!("`{text}` is no time: write 2026-03-01 or 2026-03-01T08:30:00Z"))
    }
}

impl Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl From<Moment> for String {
    fn from(moment: Moment) -> Self {
        moment.to_string()
    }
}

impl TryFrom<String> for Moment {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_its_midnight_and_a_zone_is_heeded() {
        let at = |text: &str| text.parse::<Moment>().unwrap();
        assert_eq!(at("2026-03-01"), at("2026-03-01T00:00:00Z"));
        assert_eq!(at("2026-03-01T08:30"), at("2026-03-01T09:30:00+01:00"));
        assert_eq!(at("2026-03-02T12:00").days_since(at("2026-03-01")), 1.5);
        assert_eq!(at("2026-02-27") + 2, at("2026-03-01"));
        assert_eq!(at("2026-03-01").to_string(), "2026-03-01T00:00:00Z");
        assert!("yesterday".parse::<Moment>().unwrap_err().contains("write 2026-03-01"));
    }
}
