//! What a column's name says: a quantity, a unit, or both, in the spellings that loggers and spreadsheets use.

use std::f64::consts::{PI, TAU};

/// A quantity that a log may carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Time, s.
    Time,
    /// Terminal voltage, V.
    Voltage,
    /// Duty −1 … 1, to be multiplied by the supply voltage.
    Duty,
    /// Current held by a current loop, A.
    CurrentInput,
    /// Torque, N m.
    Torque,
    /// Force, N.
    Force,
    /// Angle, rad.
    Angle,
    /// Position on a linear axis, m.
    Position,
    /// Angular speed, rad/s.
    AngularSpeed,
    /// Speed on a linear axis, m/s.
    LinearSpeed,
    /// 0 open, 1 driven, 2 shorted.
    Bridge,
    /// Measured winding current, A.
    Current,
    /// Measured supply voltage, V.
    Supply,
    /// Number of the run.
    Run,
}

/// Name of a column, the quantity, and the factor to its SI unit. The first name of a quantity and factor is the one that
/// is proposed.
const NAMES: &[(&str, Quantity, f64)] = &[
    ("t_s", Quantity::Time, 1.0),
    ("time_s", Quantity::Time, 1.0),
    ("t_ms", Quantity::Time, 1e-3),
    ("t_us", Quantity::Time, 1e-6),
    ("u_v", Quantity::Voltage, 1.0),
    ("voltage_v", Quantity::Voltage, 1.0),
    ("u_mv", Quantity::Voltage, 1e-3),
    ("duty", Quantity::Duty, 1.0),
    ("duty_percent", Quantity::Duty, 1e-2),
    ("current_a", Quantity::CurrentInput, 1.0),
    ("current_ma", Quantity::CurrentInput, 1e-3),
    ("torque_nm", Quantity::Torque, 1.0),
    ("tau_nm", Quantity::Torque, 1.0),
    ("torque_mnm", Quantity::Torque, 1e-3),
    ("force_n", Quantity::Force, 1.0),
    ("theta_rad", Quantity::Angle, 1.0),
    ("q_rad", Quantity::Angle, 1.0),
    ("theta_deg", Quantity::Angle, PI / 180.0),
    ("theta_rev", Quantity::Angle, TAU),
    ("q_m", Quantity::Position, 1.0),
    ("q_cm", Quantity::Position, 1e-2),
    ("q_mm", Quantity::Position, 1e-3),
    ("omega_rad_s", Quantity::AngularSpeed, 1.0),
    ("w_rad_s", Quantity::AngularSpeed, 1.0),
    ("omega_deg_s", Quantity::AngularSpeed, PI / 180.0),
    ("omega_rpm", Quantity::AngularSpeed, TAU / 60.0),
    ("speed_rpm", Quantity::AngularSpeed, TAU / 60.0),
    ("omega_rev_s", Quantity::AngularSpeed, TAU),
    ("v_m_s", Quantity::LinearSpeed, 1.0),
    ("v_cm_s", Quantity::LinearSpeed, 1e-2),
    ("v_mm_s", Quantity::LinearSpeed, 1e-3),
    ("bridge", Quantity::Bridge, 1.0),
    ("i_a", Quantity::Current, 1.0),
    ("i_ma", Quantity::Current, 1e-3),
    ("vbus_v", Quantity::Supply, 1.0),
    ("vbus_mv", Quantity::Supply, 1e-3),
    ("run", Quantity::Run, 1.0),
];

/// The quantity and the factor of a name of ours.
pub fn quantity_of(name: &str) -> Option<(Quantity, f64)> {
    let name = name.to_lowercase();
    NAMES.iter().find(|known| known.0 == name).map(|known| (known.1, known.2))
}

/// All names of ours.
pub fn ours() -> impl Iterator<Item = &'static str> {
    NAMES.iter().map(|known| known.0)
}

/// Our name of a quantity in this unit.
pub fn name_of(quantity: Quantity, factor: f64) -> &'static str {
    let of = |wanted: f64| NAMES.iter().find(|known| known.1 == quantity && known.2 == wanted);
    of(factor).or_else(|| of(1.0)).expect("every quantity has a name in its SI unit").0
}

/// What the words of a name speak of, its unit apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// Time.
    Time,
    /// Voltage, mostly at the terminals.
    Voltage,
    /// Duty or PWM.
    Duty,
    /// Current.
    Current,
    /// Torque.
    Torque,
    /// Force.
    Force,
    /// Angle or position.
    Position,
    /// Speed.
    Speed,
    /// Supply voltage.
    Supply,
    /// State of the bridge.
    Bridge,
    /// Number of the run.
    Run,
}

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// s.
    Time,
    /// V.
    Voltage,
    /// A.
    Current,
    /// N m.
    Torque,
    /// N.
    Force,
    /// rad.
    Angle,
    /// m.
    Length,
    /// rad/s.
    AngularSpeed,
    /// m/s.
    LinearSpeed,
    /// Per cent.
    Percent,
    /// Counts of an encoder: their number per turn is not in the name.
    Counts,
}

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

/// Words that speak of a quantity, in lower case.
const TOPICS: &[(Topic, &[&str])] = &[
    (Topic::Time, &["t", "time", "zeit", "temps", "tiempo", "tempo", "timestamp", "elapsed", "uhrzeit"]),
    (
        Topic::Voltage,
        &[
            "u",
            "voltage",
            "volt",
            "spannung",
            "klemmenspannung",
            "motorspannung",
            "tension",
            "voltaje",
            "umot",
        ],
    ),
    (Topic::Duty, &["duty", "pwm", "dutycycle", "tastgrad", "tastverhaeltnis", "tastverhältnis", "throttle"]),
    (Topic::Current, &["i", "current", "strom", "motorstrom", "courant", "corriente", "corrente"]),
    (Topic::Torque, &["torque", "tau", "drehmoment", "moment", "couple"]),
    (Topic::Force, &["force", "kraft", "fuerza"]),
    (
        Topic::Position,
        &[
            "theta",
            "q",
            "position",
            "pos",
            "angle",
            "winkel",
            "phi",
            "encoder",
            "enc",
            "lage",
            "drehwinkel",
            "angulo",
        ],
    ),
    (
        Topic::Speed,
        &[
            "omega",
            "w",
            "speed",
            "spd",
            "velocity",
            "vel",
            "drehzahl",
            "geschwindigkeit",
            "winkelgeschwindigkeit",
            "n",
            "vitesse",
            "velocidad",
            "velocita",
        ],
    ),
    (
        Topic::Supply,
        &[
            "vbus",
            "vbat",
            "vbatt",
            "ubat",
            "ubatt",
            "batt",
            "battery",
            "batterie",
            "supply",
            "versorgung",
            "vin",
            "vcc",
            "vsupply",
            "bus",
        ],
    ),
    (Topic::Bridge, &["bridge"]),
    (Topic::Run, &["run"]),
];

/// Words that state quantity and unit at once.
const BOTH: &[(&str, Topic, &str)] = &[
    ("rpm", Topic::Speed, "rpm"),
    ("rps", Topic::Speed, "rev/s"),
    ("millis", Topic::Time, "ms"),
    ("micros", Topic::Time, "us"),
    ("seconds", Topic::Time, "s"),
    ("sekunden", Topic::Time, "s"),
    ("milliseconds", Topic::Time, "ms"),
    ("volts", Topic::Voltage, "v"),
    ("counts", Topic::Position, "counts"),
    ("ticks", Topic::Position, "counts"),
    ("degrees", Topic::Position, "deg"),
    ("radians", Topic::Position, "rad"),
    ("revolutions", Topic::Position, "rev"),
];

/// Words that change nothing about what a column is.
const HARMLESS: &[&str] = &[
    "motor",
    "measured",
    "meas",
    "actual",
    "act",
    "ist",
    "istwert",
    "gemessen",
    "terminal",
    "shaft",
    "filtered",
    "filt",
    "applied",
    "armature",
    "winding",
    "anker",
    "mean",
    "avg",
    "signal",
    "rotor",
    "shaft",
    "axis",
    "angular",
    "rotational",
    "rotation",
    "elapsed",
    "of",
    "the",
    "cycle",
    "welle",
];

/// Words of inputs: a commanded voltage is what the format asks for.
const COMMANDED: &[&str] = &["command", "commanded", "cmd", "output", "out", "stell"];

/// What is wanted and not measured, and what is a difference: never an output.
const WANTED: &[&str] = &[
    "target",
    "ref",
    "reference",
    "setpoint",
    "set",
    "desired",
    "des",
    "goal",
    "soll",
    "sollwert",
    "demand",
    "error",
    "err",
    "fehler",
    "limit",
    "max",
    "min",
    "qref",
    "std",
    "temp",
    "temperature",
];

/// Spellings of units with the factor to the SI unit.
const UNITS: &[(&[&str], Measure, f64)] = &[
    (&["s", "sec", "secs", "second", "seconds", "sek", "sekunden"], Measure::Time, 1.0),
    (&["ms", "msec", "millis", "milliseconds", "millisecond"], Measure::Time, 1e-3),
    (&["us", "µs", "μs", "usec", "micros", "microseconds"], Measure::Time, 1e-6),
    (&["v", "volt", "volts"], Measure::Voltage, 1.0),
    (&["mv", "millivolt", "millivolts"], Measure::Voltage, 1e-3),
    (&["a", "amp", "amps", "ampere"], Measure::Current, 1.0),
    (&["ma", "milliamp", "milliamps"], Measure::Current, 1e-3),
    (&["nm", "n m", "n·m", "n*m", "n_m"], Measure::Torque, 1.0),
    (&["mnm", "mn m", "mn·m", "mn*m"], Measure::Torque, 1e-3),
    (&["n", "newton"], Measure::Force, 1.0),
    (&["rad", "radian", "radians"], Measure::Angle, 1.0),
    (&["deg", "°", "degree", "degrees", "grad", "º"], Measure::Angle, PI / 180.0),
    (&["rev", "revs", "turn", "turns", "revolutions", "umdrehungen", "rotations"], Measure::Angle, TAU),
    (&["m", "meter", "meters"], Measure::Length, 1.0),
    (&["cm"], Measure::Length, 1e-2),
    (&["mm"], Measure::Length, 1e-3),
    (
        &[
            "rad/s",
            "rad/sec",
            "rad_s",
            "rad_sec",
            "radps",
            "rad_per_s",
            "rad s^-1",
            "rad·s⁻¹",
            "rads",
            "rad per s",
        ],
        Measure::AngularSpeed,
        1.0,
    ),
    (
        &["deg/s", "°/s", "deg_s", "deg/sec", "degps", "deg_per_s", "dps", "grad/s"],
        Measure::AngularSpeed,
        PI / 180.0,
    ),
    (
        &[
            "rpm", "1/min", "u/min", "min^-1", "min-1", "min⁻¹", "rev/min", "r/min", "upm", "rev_min",
            "1_min", "tr/min",
        ],
        Measure::AngularSpeed,
        TAU / 60.0,
    ),
    (&["rev/s", "rps", "rev_s", "turns/s", "turn/s", "u/s", "rotations/s"], Measure::AngularSpeed, TAU),
    (&["m/s", "m_s", "mps", "m_per_s", "m/sec"], Measure::LinearSpeed, 1.0),
    (&["cm/s", "cm_s"], Measure::LinearSpeed, 1e-2),
    (&["mm/s", "mm_s", "mm_per_s"], Measure::LinearSpeed, 1e-3),
    (&["%", "percent", "pct", "prozent"], Measure::Percent, 1e-2),
    (
        &[
            "count",
            "counts",
            "cnt",
            "cnts",
            "tick",
            "ticks",
            "step",
            "steps",
            "pulse",
            "pulses",
            "inc",
            "ink",
            "inkremente",
            "increments",
            "imp",
            "impulse",
            "raw",
            "qc",
        ],
        Measure::Counts,
        1.0,
    ),
];

/// What a unit's spelling means.
pub fn unit(text: &str) -> Option<(Measure, f64)> {
    let text = text.trim().to_lowercase();
    let text = text.trim_matches(|c| "[](){}<>".contains(c)).trim();
    UNITS.iter().find(|known| known.0.contains(&text)).map(|known| (known.1, known.2))
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
        if WANTED.contains(&word.as_str()) {
            return None;
        }
        if let Some(both) = BOTH.iter().find(|both| both.0 == word) {
            topics.push(both.1);
            unit = unit.or_else(|| self::unit(both.2));
        } else if let Some(known) = topic_of_word(word) {
            topics.push(known);
        } else if COMMANDED.contains(&word.as_str()) {
            commanded = true;
        } else if !HARMLESS.contains(&word.as_str()) {
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

/// A number behind a PWM is its full scale or its channel: `pwm255`, `pwm1`.
fn topic_of_word(word: &str) -> Option<Topic> {
    let bare = word.trim_end_matches(|c: char| c.is_ascii_digit());
    let word = if bare == "pwm" { bare } else { word };
    TOPICS.iter().find(|known| known.1.contains(&word)).map(|known| known.0)
}

fn is_known(word: &str) -> bool {
    topic_of_word(word).is_some()
        || BOTH.iter().any(|both| both.0 == word)
        || HARMLESS.contains(&word)
        || COMMANDED.contains(&word)
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

/// Topic and measure of a quantity of ours.
fn topic_of(quantity: Quantity) -> (Topic, Option<Measure>) {
    match quantity {
        Quantity::Time => (Topic::Time, Some(Measure::Time)),
        Quantity::Voltage => (Topic::Voltage, Some(Measure::Voltage)),
        Quantity::Duty => (Topic::Duty, None),
        Quantity::CurrentInput | Quantity::Current => (Topic::Current, Some(Measure::Current)),
        Quantity::Torque => (Topic::Torque, Some(Measure::Torque)),
        Quantity::Force => (Topic::Force, Some(Measure::Force)),
        Quantity::Angle => (Topic::Position, Some(Measure::Angle)),
        Quantity::Position => (Topic::Position, Some(Measure::Length)),
        Quantity::AngularSpeed => (Topic::Speed, Some(Measure::AngularSpeed)),
        Quantity::LinearSpeed => (Topic::Speed, Some(Measure::LinearSpeed)),
        Quantity::Bridge => (Topic::Bridge, None),
        Quantity::Supply => (Topic::Supply, Some(Measure::Voltage)),
        Quantity::Run => (Topic::Run, None),
    }
}

/// The quantity that a topic in a unit is.
fn quantity(topic: Topic, unit: Option<(Measure, f64)>) -> Option<(Quantity, f64)> {
    let (measure, factor) = unit?;
    let quantity = match (topic, measure) {
        (Topic::Time, Measure::Time) => Quantity::Time,
        (Topic::Voltage, Measure::Voltage) => Quantity::Voltage,
        (Topic::Supply, Measure::Voltage) => Quantity::Supply,
        (Topic::Duty, Measure::Percent) => Quantity::Duty,
        (Topic::Current, Measure::Current) => Quantity::Current,
        (Topic::Torque, Measure::Torque) => Quantity::Torque,
        (Topic::Force, Measure::Force) => Quantity::Force,
        (Topic::Position, Measure::Angle) => Quantity::Angle,
        (Topic::Position, Measure::Length) => Quantity::Position,
        (Topic::Speed, Measure::AngularSpeed) => Quantity::AngularSpeed,
        (Topic::Speed, Measure::LinearSpeed) => Quantity::LinearSpeed,
        _ => return None,
    };
    Some((quantity, factor))
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
        let harmless = unit.is_none() && word.iter().all(|word| HARMLESS.contains(&word.as_str()));
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
        if let (Some(from), true) = (name.find(open), name.ends_with(close)) {
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
fn words(stem: &str) -> Vec<String> {
    let mut spaced = String::new();
    let mut before = ' ';
    for letter in stem.chars() {
        if before.is_lowercase() && letter.is_uppercase() {
            spaced.push(' ');
        }
        spaced.push(letter);
        before = letter;
    }
    let parted = spaced.split(|c: char| c.is_whitespace() || "_-.:#()[],".contains(c));
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
