//! Words for quantities and units, in lower case, as loggers and spreadsheets write them.

use std::f64::consts::{PI, TAU};

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

/// Words that speak of a quantity, in lower case.
pub const TOPICS: &[(Topic, &str)] = &[
    (
        Topic::Time,
        "t|ts|time|zeit|temps|tiempo|tempo|timestamp|stamp|clock|elapsed|uhrzeit|zeitstempel|date|datetime|datum",
    ),
    (Topic::Voltage, "u|voltage|volt|spannung|klemmenspannung|motorspannung|tension|voltaje|umot"),
    (Topic::Duty, "duty|pwm|dutycycle|tastgrad|tastverhaeltnis|tastverhältnis|throttle"),
    (Topic::Current, "i|current|strom|motorstrom|courant|corriente|corrente"),
    (Topic::Torque, "torque|tau|drehmoment|moment|couple"),
    (Topic::Force, "force|kraft|fuerza"),
    (Topic::Position, "theta|q|position|pos|angle|winkel|phi|alpha|encoder|enc|lage|drehwinkel|angulo"),
    (
        Topic::Speed,
        "omega|w|speed|spd|velocity|vel|drehzahl|geschwindigkeit|winkelgeschwindigkeit|n|vitesse|velocidad|velocita",
    ),
    (Topic::Supply, "vbus|vbat|vbatt|ubat|ubatt|batt|battery|batterie|supply|versorgung|vin|vcc|vsupply|bus"),
    (Topic::Bridge, "bridge"),
    (Topic::Run, "run"),
];

/// Words that state quantity and unit at once.
pub const BOTH: &[(&str, Topic, &str)] = &[
    ("rpm", Topic::Speed, "rpm"),
    ("rps", Topic::Speed, "rev/s"),
    ("erpm", Topic::Speed, "erpm"),
    ("seconds|sekunden", Topic::Time, "s"),
    ("ms|millis|milliseconds", Topic::Time, "ms"),
    ("micros", Topic::Time, "us"),
    ("volts", Topic::Voltage, "v"),
    ("counts|ticks", Topic::Position, "counts"),
    ("degrees", Topic::Position, "deg"),
    ("radians", Topic::Position, "rad"),
    ("revolutions", Topic::Position, "rev"),
];

/// Words that change nothing about what a column is.
pub const HARMLESS: &str = "motor|measured|meas|actual|act|ist|istwert|gemessen|terminal|shaft|filtered|filt|applied|\
    armature|winding|anker|mean|avg|signal|rotor|shaft|axis|angular|rotational|rotation|elapsed|of|\
    the|cycle|welle|today|since|start|boot|feedback|state|states|joint|present";

/// Words of inputs: a commanded voltage is what the format asks for.
pub const COMMANDED: &str = "command|commanded|cmd|output|out|stell";

/// What is wanted and not measured, and what is a difference: never an output.
pub const WANTED: &str = "target|ref|reference|setpoint|set|desired|des|goal|soll|sollwert|demand|error|err|fehler|limit|\
    max|min|qref|std|temp|temperature";

/// Spellings of units with the factor to the SI unit.
const UNITS: &[(&str, Measure, f64)] = &[
    ("s|sec|secs|second|seconds|sek|sekunden", Measure::Time, 1.0),
    ("ms|msec|millis|milliseconds|millisecond", Measure::Time, 1e-3),
    ("us|µs|μs|usec|micros|microseconds", Measure::Time, 1e-6),
    ("ns|nsec|nanos|nanosec|nanoseconds", Measure::Time, 1e-9),
    ("v|volt|volts", Measure::Voltage, 1.0),
    ("mv|millivolt|millivolts", Measure::Voltage, 1e-3),
    ("a|amp|amps|ampere", Measure::Current, 1.0),
    ("ma|milliamp|milliamps", Measure::Current, 1e-3),
    ("nm|n m|n·m|n*m|n_m", Measure::Torque, 1.0),
    ("mnm|mn m|mn·m|mn*m", Measure::Torque, 1e-3),
    ("n|newton", Measure::Force, 1.0),
    ("rad|radian|radians", Measure::Angle, 1.0),
    ("deg|°|degree|degrees|grad|º", Measure::Angle, PI / 180.0),
    ("rev|revs|turn|turns|revolutions|umdrehungen|rotations", Measure::Angle, TAU),
    ("m|meter|meters", Measure::Length, 1.0),
    ("cm", Measure::Length, 1e-2),
    ("mm", Measure::Length, 1e-3),
    (
        "rad/s|rad/sec|rad_s|rad_sec|radps|rad_per_s|rad s^-1|rad·s⁻¹|rads|rad per s",
        Measure::AngularSpeed,
        1.0,
    ),
    ("deg/s|°/s|deg_s|deg/sec|degps|deg_per_s|dps|grad/s", Measure::AngularSpeed, PI / 180.0),
    (
        "rpm|1/min|u/min|min^-1|min-1|min⁻¹|rev/min|r/min|upm|rev_min|1_min|tr/min",
        Measure::AngularSpeed,
        TAU / 60.0,
    ),
    (
        "rev/s|rps|rev_s|rev_per_s|turns/s|turn/s|u/s|rotations/s|rotations_per_s|rot_per_s",
        Measure::AngularSpeed,
        TAU,
    ),
    ("m/s|m_s|mps|m_per_s|m/sec", Measure::LinearSpeed, 1.0),
    ("cm/s|cm_s", Measure::LinearSpeed, 1e-2),
    ("mm/s|mm_s|mm_per_s", Measure::LinearSpeed, 1e-3),
    ("%|percent|pct|prozent", Measure::Percent, 1e-2),
    (
        "steps/s|step/s|counts/s|count/s|counts/sec|ticks/s|pulses/s|inc/s|imp/s|cps|erpm|count|counts|cnt|cnts|tick|ticks|step|steps|pulse|pulses|inc|ink|inkremente|increments|imp|impulse|raw|qc",
        Measure::Counts,
        1.0,
    ),
];

/// Is this one of the words between the strokes?
pub fn holds(words: &str, word: &str) -> bool {
    words.split('|').any(|known| known == word)
}

/// What a unit's spelling means.
pub fn unit(text: &str) -> Option<(Measure, f64)> {
    let text = text.trim().to_lowercase();
    let text = text.trim_matches(|c| "[](){}<>".contains(c)).trim();
    let text = text.replace("per_second", "per_s").replace("per_sec", "per_s");
    UNITS.iter().find(|known| holds(known.0, &text)).map(|known| (known.1, known.2))
}
