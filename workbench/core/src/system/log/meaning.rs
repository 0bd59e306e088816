//! What a column's name says where it is none of ours: a quantity, a unit, or both, in the spellings that loggers and
//! spreadsheets use.

use super::names::{Quantity, quantity_of};
use super::words::{BOTH, COMMANDED, HARMLESS, Measure, TOPICS, Topic, WANTED, holds, unit};

/// How a name is understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sure {
    /// A name of ours, as the format knows it.
    Exact,
    /// Quantity and unit are both stated, and no other word is there.
    Stated,
    /// The quantity is likely; unit or scale is not stated, or a word is there that says something else.
    Likely,
}

/// What a column seems to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meaning {
    /// What its words speak of.
    pub topic: Topic,
    /// What its unit measures and its factor to the SI unit, if the name or the row of units states one.
    pub unit: Option<(Measure, f64)>,
    /// How sure that is.
    pub sure: Sure,
    /// The quantity and its factor, where topic and unit make one.
    pub quantity: Option<(Quantity, f64)>,
    /// A unit is written there that is not known.
    pub strange_unit: bool,
}

/// A column of times in this unit, s.
pub fn of_time(unit_s: f64) -> Meaning {
    let (unit, quantity) = (Some((Measure::Time, unit_s)), Some((Quantity::Time, unit_s)));
    Meaning { topic: Topic::Time, unit, sure: Sure::Stated, quantity, strange_unit: false }
}

/// Seconds since 1970 in the years 2001 to 2099. Origin: definition.
const SINCE_1970_S: std::ops::Range<f64> = 9.7e8..4.1e9;

impl Meaning {
    /// The unit of a time without one is told by its size where it counts from 1970.
    pub fn since_1970(self, least: impl Fn() -> f64) -> Self {
        if self.topic != Topic::Time || self.unit.is_some() {
            return self;
        }
        let least = least();
        let fits = |unit: &f64| SINCE_1970_S.contains(&(least * unit));
        [1.0, 1e-3, 1e-6, 1e-9].into_iter().find(fits).map_or(self, of_time)
    }
}

/// What a column's name and the row of units below it say.
pub fn recognise(name: &str, below: Option<&str>) -> Option<Meaning> {
    if let Some((quantity, factor)) = quantity_of(name.trim()) {
        let (topic, measure) = topic_of(quantity);
        let unit = measure.map(|measure| (measure, factor));
        let quantity = Some((quantity, factor));
        return Some(Meaning { topic, unit, sure: Sure::Exact, quantity, strange_unit: false });
    }
    let parts = Parts::of(name, below);
    let mut topics: Vec<Topic> = Vec::new();
    let (mut foreign, mut commanded, mut unit) = (false, false, parts.unit);
    for word in &parts.words {
        if holds(WANTED, word) {
            return None;
        }
        if let Some(both) = BOTH.iter().find(|both| holds(both.0, word)) {
            topics.push(both.1);
            unit = unit.or_else(|| super::words::unit(both.2));
        } else if let Some(known) = topic_of_word(word) {
            topics.push(known);
        } else if holds(COMMANDED, word) {
            commanded = true;
        } else if !holds(HARMLESS, word) {
            foreign = true;
        }
    }
    let topic = the_one(&topics, &unit)?;
    let driven =
        matches!(topic, Topic::Voltage | Topic::Duty | Topic::Torque | Topic::Force | Topic::Current);
    let quantity = quantity(topic, unit);
    // A held current and a measured one have the same name: only the format's own names tell them apart.
    // `u_kv`: two letters at the end that are no word are more likely a unit.
    let last = parts.words.last().is_some_and(|word| word.len() == 2 && !is_known(word) && unit.is_none());
    let strange = parts.strange || last && parts.words.len() > 1;
    let sure = match quantity.is_some() && !foreign && (driven || !commanded) && !strange {
        true => Sure::Stated,
        false => Sure::Likely,
    };
    Some(Meaning { topic, unit, sure, quantity, strange_unit: strange })
}

/// A number behind a word is its full scale or its channel: `pwm255`, `velocity0`.
fn topic_of_word(word: &str) -> Option<Topic> {
    let word = match word.trim_end_matches(|c: char| c.is_ascii_digit()) {
        bare if bare.len() > 2 => bare,
        _ => word,
    };
    TOPICS.iter().find(|known| holds(known.1, word)).map(|known| known.0)
}

fn is_known(word: &str) -> bool {
    topic_of_word(word).is_some()
        || BOTH.iter().any(|both| holds(both.0, word))
        || holds(HARMLESS, word)
        || holds(COMMANDED, word)
}

/// The topic of several words: a battery's voltage is a supply, an encoder's speed is a speed.
fn the_one(topics: &[Topic], unit: &Option<(Measure, f64)>) -> Option<Topic> {
    let has = |topic| topics.contains(&topic);
    if has(Topic::Supply) && topics.iter().all(|topic| matches!(topic, Topic::Supply | Topic::Voltage)) {
        return Some(Topic::Supply);
    }
    // A unit alone speaks for a position in counts and for a speed.
    let by_unit = || match unit {
        Some((Measure::AngularSpeed | Measure::LinearSpeed, _)) => Some(Topic::Speed),
        Some((Measure::Counts, _)) => Some(Topic::Position),
        _ => None,
    };
    let mut others = topics.iter().filter(|topic| **topic != Topic::Position);
    match (others.next(), others.next()) {
        (Some(first), None) => Some(*first),
        (Some(first), Some(_)) if topics.iter().all(|topic| topic == first) => Some(*first),
        (Some(_), Some(_)) => None,
        (None, _) => topics.first().copied().filter(|_| by_unit() != Some(Topic::Speed)).or_else(by_unit),
    }
}

/// What a topic in a unit is.
const PAIRS: [(Topic, Measure, Quantity); 12] = [
    (Topic::Time, Measure::Time, Quantity::Time),
    (Topic::Voltage, Measure::Voltage, Quantity::Voltage),
    (Topic::Supply, Measure::Voltage, Quantity::Supply),
    (Topic::Duty, Measure::Percent, Quantity::Duty),
    (Topic::Current, Measure::Current, Quantity::Current),
    (Topic::Current, Measure::Current, Quantity::CurrentInput),
    (Topic::Torque, Measure::Torque, Quantity::Torque),
    (Topic::Force, Measure::Force, Quantity::Force),
    (Topic::Position, Measure::Angle, Quantity::Angle),
    (Topic::Position, Measure::Length, Quantity::Position),
    (Topic::Speed, Measure::AngularSpeed, Quantity::AngularSpeed),
    (Topic::Speed, Measure::LinearSpeed, Quantity::LinearSpeed),
];

/// Topic and measure of a quantity of ours; a share, a state and a number have no measure.
fn topic_of(quantity: Quantity) -> (Topic, Option<Measure>) {
    match (quantity, PAIRS.iter().find(|pair| pair.2 == quantity)) {
        (Quantity::Bridge, _) => (Topic::Bridge, None),
        (Quantity::Duty, _) => (Topic::Duty, None),
        (_, Some(pair)) => (pair.0, Some(pair.1)),
        (_, None) => (Topic::Run, None),
    }
}

/// The quantity that a topic in a unit is.
fn quantity(topic: Topic, unit: Option<(Measure, f64)>) -> Option<(Quantity, f64)> {
    let (measure, factor) = unit?;
    let pair = PAIRS.iter().find(|pair| (pair.0, pair.1) == (topic, measure))?;
    Some((pair.2, factor))
}

/// A name taken apart.
struct Parts {
    /// In lower case, the unit apart.
    words: Vec<String>,
    unit: Option<(Measure, f64)>,
    /// A unit is written, in brackets or in the row below, that is not known.
    strange: bool,
}

impl Parts {
    fn of(name: &str, below: Option<&str>) -> Self {
        let (stem, written) = bracketed(name.trim());
        let written = written.or(below).filter(|text| !text.trim().is_empty());
        let mut words = words(stem);
        let Some(written) = written else {
            let unit = ending(&mut words);
            return Self { words, unit, strange: false };
        };
        let mut said = written.split([',', ';']);
        let first = said.next().unwrap_or("");
        words.extend(said.flat_map(self::words));
        let unit = unit(first);
        // Brackets may hold a word instead of a unit: `speed (filtered)`.
        let word = self::words(first);
        let harmless = unit.is_none() && word.iter().all(|word| holds(HARMLESS, word));
        let unit = if harmless { ending(&mut words) } else { unit };
        // The name may say its unit a second time: `time_ms [ms]`.
        if unit.is_some() && words.len() > 1 && ending(&mut words.clone()) == unit {
            ending(&mut words);
        }
        Self { words, strange: unit.is_none() && !harmless, unit }
    }
}

/// A unit in brackets, behind a stroke, behind a comma or behind `in`.
fn bracketed(name: &str) -> (&str, Option<&str>) {
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        if let (Some(from), true) = (name.find(open), name.ends_with(close))
            && !name[from + 1..name.len() - 1].bytes().all(|byte| byte.is_ascii_digit())
        {
            return (&name[..from], Some(&name[from + 1..name.len() - 1]));
        }
    }
    for mark in [" / ", ", ", " in ", "/"] {
        if let Some((stem, written)) = name.rsplit_once(mark).filter(|pair| unit(pair.1).is_some())
            && unit(name).is_none()
            && !stem.is_empty()
        {
            return (stem, Some(written));
        }
    }
    (name, None)
}

/// The words of a name: parted by blanks, lines, points and by a change from small to capital letters.
pub(super) fn words(stem: &str) -> Vec<String> {
    let mut spaced = String::new();
    let mut before = ' ';
    for letter in stem.chars() {
        if before.is_lowercase() && letter.is_uppercase() {
            spaced.push(' ');
        }
        spaced.push(letter);
        before = letter;
    }
    let parted = spaced.split(|c: char| c.is_whitespace() || "_-.:#()[],/%".contains(c));
    parted.filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
}

/// Takes the unit off the end of a name: `rad_s`, `ms`. A name that is nothing but a unit keeps its word.
fn ending(words: &mut Vec<String>) -> Option<(Measure, f64)> {
    for length in [3, 2, 1] {
        if words.len() > length {
            let start = words.len() - length;
            if let Some(unit) = unit(&words[start..].join("_")) {
                words.truncate(start);
                return Some(unit);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::log::names::name_of;

    fn said(name: &str) -> String {
        match recognise(name, None) {
            None => "nothing".into(),
            Some(meaning) => match meaning.quantity {
                Some((quantity, factor)) => format!("{:?} {}", meaning.sure, name_of(quantity, factor)),
                None => format!("{:?} {:?}", meaning.sure, meaning.topic),
            },
        }
    }

    #[test]
    fn names_are_understood_as_far_as_they_go() {
        let cases = [
            ("t_s", "Exact t_s"),
            ("Omega_RPM", "Exact omega_rpm"),
            ("Time [s]", "Stated t_s"),
            ("Zeit in ms", "Stated t_ms"),
            ("timeMs", "Stated t_ms"),
            ("millis", "Stated t_ms"),
            ("time", "Likely Time"),
            ("Speed (rpm)", "Stated omega_rpm"),
            ("rpm", "Stated omega_rpm"),
            ("RPM", "Stated omega_rpm"),
            ("motor speed [rad/s]", "Stated omega_rad_s"),
            ("Drehzahl [1/min]", "Stated omega_rpm"),
            ("rpm (1/min, filtered)", "Stated omega_rpm"),
            ("Speed [m/s]", "Stated v_m_s"),
            ("Spannung [V]", "Stated u_v"),
            ("cmd_voltage_v", "Stated u_v"),
            ("V_batt_V", "Likely vbus_v"),
            ("Battery Voltage [V]", "Stated vbus_v"),
            ("PWM", "Likely Duty"),
            ("pwm [%]", "Stated duty_percent"),
            ("left_cmd_pwm255", "Likely Duty"),
            ("pos_counts", "Likely Position"),
            ("encoder", "Likely Position"),
            ("Winkel [°]", "Stated theta_deg"),
            ("position [mm]", "Stated q_mm"),
            ("left_rpm", "Likely omega_rpm"),
            ("target_rpm", "nothing"),
            ("qref_m", "nothing"),
            ("pulse_N", "nothing"),
            ("Strom [A]", "Stated i_a"),
            ("speed", "Likely Speed"),
            ("omega [furlong/s]", "Likely Speed"),
            ("note", "nothing"),
            ("temperature [°C]", "nothing"),
        ];
        for (name, expected) in cases {
            assert_eq!(said(name), expected, "`{name}`");
        }
    }

    #[test]
    fn a_row_of_units_completes_a_name() {
        let meaning = recognise("Zeit", Some("ms")).unwrap();
        assert_eq!((meaning.sure, meaning.quantity), (Sure::Stated, Some((Quantity::Time, 1e-3))));
        assert!(recognise("Zeit", Some("fortnight")).unwrap().strange_unit);
    }
}
