//! The keys of a model file, one row each: the one place that names section, key, kind of model, value, unit, range, default,
//! meaning and an example. The reader, its messages and `docs/model.md` follow from the rows.

use indexmap::IndexSet;

/// What a value may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Takes {
    /// A number greater than 0.
    Positive,
    /// A number of at least 0.
    NotNegative,
    /// `true` or `false`.
    Flag,
    /// One of these texts.
    Choice(&'static [&'static str]),
    /// One of these texts, or a description in other words.
    ChoiceOrWords(&'static [&'static str]),
    /// Any text.
    Text,
}

/// What happens without the key, or with a value that it does not take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Need {
    /// The file cannot be read without it.
    Required,
    /// A number of the motor: absent or `"unknown"`, it is fitted to the log with a wide prior.
    Fitted,
    /// A number of the motor that is taken as this where it is absent, and fitted to the log where it is `"unknown"`.
    FittedOr(&'static str),
    /// It has this default, and a value that it does not take stops a run.
    Default(&'static str),
    /// Nothing needs it: a value that it does not take is told in a note, and the key is ignored.
    Ignored(&'static str),
}

/// One key.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The section; empty: outside of sections.
    pub section: &'static str,
    /// The key.
    pub name: &'static str,
    /// Kinds of model that read it; empty: all.
    pub kinds: &'static [&'static str],
    /// What its value may be.
    pub takes: Takes,
    /// Its unit; empty: none.
    pub unit: &'static str,
    /// What happens without it.
    pub need: Need,
    /// Its meaning in a sentence.
    pub about: &'static str,
    /// A line of a file.
    pub example: &'static str,
}

/// Text that stands for a number that nobody knows.
pub const UNKNOWN: &str = "unknown";

/// Values of `[model] kind`.
pub const KINDS: [&str; 3] = ["dc_motor", "first_order", "inertia"];
/// Values of `[encoder] side`.
pub const SIDES: [&str; 3] = ["motor", "load", "output"];
/// Values of `[sensors] speed` that the program knows; others are a description.
pub const SPEEDS: [&str; 3] = ["encoder_difference_centred", "encoder_difference_causal", "analog_tacho"];

/// Sections that hold the numbers of the base, the first of them those of a motor.
pub const BASE: [&str; 2] = ["motor", "model"];

const DC: &[&str] = &["dc_motor"];
const FIRST: &[&str] = &["first_order"];
const INERTIA: &[&str] = &["inertia"];
const ALL: &[&str] = &[];

macro_rules! keys {
    ($([$section:literal] $name:literal $kinds:ident $takes:expr, $unit:literal, $need:expr, $about:literal, $example:literal;)+) => {
        &[$(Key {
            section: $section,
            name: $name,
            kinds: $kinds,
            takes: $takes,
            unit: $unit,
            need: $need,
            about: $about,
            example: $example,
        },)+]
    };
}

use Need::{Default, Fitted, FittedOr, Ignored, Required};
use Takes::{Choice, ChoiceOrWords, Flag, NotNegative, Positive, Text};

/// Every key outside `[tolerance]` and `[known]`, whose keys follow from other keys and from the library of effects.
pub const KEYS: &[Key] = keys! {
    [""] "schema" ALL Choice(&["truing-model/1"]), "", Required, "Format of the file.", "schema = \"truing-model/1\"";
    [""] "id" ALL Text, "", Ignored("none"), "A name for the rig.", "id = \"bench 3\"";
    [""] "description" ALL Text, "", Ignored("none"), "What the rig is.", "description = \"12 V gearmotor on a bench\"";
    ["model"] "kind" ALL Choice(&KINDS), "", Default("`dc_motor`"), "Which equation the model has.", "kind = \"first_order\"";
    ["model"] "fitted_to_log" ALL Flag, "", Default("false"), "The numbers are a fit or a guess: they are refitted freely, and names are judged by the share of the gap that they remove, where none reaches the noise. The same is done where no tolerance is stated and nothing explains a log.", "fitted_to_log = true";
    ["model"] "equation" ALL Text, "", Ignored("none"), "The equation in words, for a reader.", "equation = \"T dw/dt + w = K u\"";
    ["model"] "source" ALL Text, "", Ignored("none"), "Where the numbers come from, for a reader.", "source = \"data sheet of 2019\"";
    ["motor"] "R_ohm" DC Positive, "Ω", Fitted, "Resistance of winding, brushes, leads and bridge.", "R_ohm = 2.2";
    ["motor"] "L_h" DC NotNegative, "H", FittedOr("0: neglected"), "Inductance of the winding.", "L_h = 0.0011";
    ["motor"] "Kt_nm_per_a" DC Positive, "N m/A", FittedOr("`Ke_vs_per_rad`"), "Torque constant; in SI units the same number as Ke.", "Kt_nm_per_a = 0.06";
    ["motor"] "Ke_vs_per_rad" DC Positive, "V s/rad", FittedOr("`Kt_nm_per_a`"), "Back-EMF constant.", "Ke_vs_per_rad = 0.06";
    ["motor"] "J_kgm2" DC Positive, "kg m²", Fitted, "Inertia of rotor, gear and load, at the shaft with the encoder.", "J_kgm2 = 6.2e-5";
    ["motor"] "b_nms_per_rad" DC NotNegative, "N m s/rad", FittedOr("0"), "Viscous friction.", "b_nms_per_rad = 1e-5";
    ["motor"] "gear_ratio" ALL Positive, "1", Default("1"), "Turns of the encoder's shaft per turn of the load; 1 where the encoder sits at the load.", "gear_ratio = 20.0";
    ["model"] "gain_rad_s_per_v" FIRST Positive, "rad/s/V", Fitted, "Steady speed per volt.", "gain_rad_s_per_v = 16.0";
    ["model"] "time_constant_s" FIRST Positive, "s", Fitted, "Time constant of the speed.", "time_constant_s = 0.09";
    ["model"] "viscous_vs_per_rad" FIRST NotNegative, "V s/rad", FittedOr("0"), "Friction linear in the speed, as a voltage. Gain and time constant hold it; with an open bridge it acts alone.", "viscous_vs_per_rad = 0.004";
    ["model"] "electrical_time_constant_s" FIRST NotNegative, "s", FittedOr("0: neglected"), "Time constant of the winding, L/R.", "electrical_time_constant_s = 0.002";
    ["motor"] "inertia_kgm2" INERTIA Positive, "kg m²", Fitted, "Inertia of a turning axis.", "inertia_kgm2 = 0.05";
    ["motor"] "mass_kg" INERTIA Positive, "kg", Fitted, "Mass of a linear axis, instead of the inertia.", "mass_kg = 95.0";
    ["motor"] "viscous" INERTIA NotNegative, "N m s/rad or N s/m", FittedOr("0"), "Viscous friction.", "viscous = 0.03";
    ["motor"] "drive_gain" INERTIA Positive, "N m or N per unit of input", FittedOr("1"), "Torque or force per unit of the input.", "drive_gain = 35.15";
    ["motor"] "drive_gain_unit" INERTIA Text, "", Ignored("none"), "Its unit, for a reader.", "drive_gain_unit = \"N/V\"";
    ["supply"] "nominal_v" ALL Positive, "V", Ignored("no limit"), "Supply. The drive cannot give more, and a `duty` is a share of it.", "nominal_v = 12.0";
    ["supply"] "limit_v" ALL Positive, "V", Ignored("no limit"), "Known limit of the drive.", "limit_v = 11.5";
    ["encoder"] "counts_per_rev" ALL Positive, "counts", Ignored("not known"), "Counts per turn after ×4 decoding: how coarse a position or a speed is.", "counts_per_rev = 2048";
    ["encoder"] "side" ALL Choice(&SIDES), "", Default("`motor`"), "The shaft that carries the encoder; `output` is another word for `load`.", "side = \"load\"";
    ["sensors"] "speed" ALL ChoiceOrWords(&SPEEDS), "", Ignored("instantaneous"), "How the speed came about: the mean over a window centred on the row, or one that ends at the row, or an analogue signal. Any other text is a description, and no window is known.", "speed = \"encoder_difference_causal\"";
    ["sensors"] "speed_window_s" ALL NotNegative, "s", Ignored("0"), "Length of that window.", "speed_window_s = 0.02";
    ["sensors"] "current_logged" ALL Flag, "", Ignored("the columns decide"), "Whether the winding current is logged, for a reader.", "current_logged = true";
    ["sensors"] "vbus_logged" ALL Flag, "", Ignored("the columns decide"), "Whether the supply is logged, for a reader.", "vbus_logged = false";
    ["log"] "columns" ALL Text, "", Ignored("the names of the columns"), "What the columns of a log are, as `--columns` has it; `truing start` writes it, and `--columns` goes before it.", "columns = \"t_ms=time,duty=pwm/255\"";
    ["log"] "sample_hz" ALL Positive, "Hz", Ignored("the time column decides"), "Rate of the log. A time column that agrees with it is in seconds.", "sample_hz = 500";
};

impl Key {
    /// Whether a kind of model reads it.
    pub fn read_by(&self, kind: &str) -> bool {
        self.kinds.is_empty() || self.kinds.contains(&kind)
    }

    /// Whether it may stand in a section: the numbers of the base may stand under `[motor]` and under `[model]`.
    pub fn stands_in(&self, section: &str) -> bool {
        let of_the_base = ["gear_ratio", "drive_gain_unit"].contains(&self.name) || self.has_tolerance();
        self.section == section || (of_the_base && [section, self.section].iter().all(|it| BASE.contains(it)))
    }

    /// Whether it is a number that a fit may move.
    pub fn has_tolerance(&self) -> bool {
        matches!(self.need, Fitted | FittedOr(_))
    }

    /// Its default in words.
    pub fn default(&self) -> &'static str {
        match self.need {
            Required => "required",
            Fitted => "fitted to the log",
            FittedOr(words) | Default(words) | Ignored(words) => words,
        }
    }

    /// The values that it takes, in words.
    pub fn range(&self) -> String {
        let listed = |all: &[&str]| all.iter().map(|it| format!("`{it}`")).collect::<Vec<_>>().join(", ");
        let range = match self.takes {
            Positive => "> 0".into(),
            NotNegative => "≥ 0".into(),
            Flag => "`true`, `false`".into(),
            Choice(values) => listed(values),
            ChoiceOrWords(values) => format!("{}, or a description", listed(values)),
            Text => "any text".into(),
        };
        if self.has_tolerance() { format!("{range}, or `\"unknown\"`") } else { range }
    }
}

/// The key of this name that may stand in a section.
pub fn find(section: &str, name: &str) -> Option<&'static Key> {
    KEYS.iter().find(|key| key.name == name && key.stands_in(section))
}

/// The names of the keys that may stand in a section.
pub fn names(section: &str) -> Vec<&'static str> {
    match section {
        "tolerance" => std::iter::once("default").chain(moved()).collect(),
        _ => KEYS.iter().filter(|key| key.stands_in(section)).map(|key| key.name).collect(),
    }
}

/// The numbers that a fit may move: they may have a tolerance.
pub fn moved() -> impl Iterator<Item = &'static str> {
    KEYS.iter().filter(|key| key.has_tolerance()).map(|key| key.name)
}

/// The sections of a file.
pub fn sections() -> Vec<&'static str> {
    let of_keys = KEYS.iter().map(|key| key.section).filter(|name| !name.is_empty());
    let once: IndexSet<&str> = of_keys.chain(["tolerance", "known"]).collect();
    once.into_iter().collect()
}

/// A larger tolerance is probably meant in per cent: 1.0 is a number that is not known. Chosen by judgement; not
/// studied.
pub const WIDEST_TOLERANCE: f64 = 1.5;
