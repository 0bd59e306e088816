//! Which format holds which effect: natively, by a shipped helper, or not at all. A test asks every effect of the library for its row.

use clap::ValueEnum;
use truing_core::system::effects::*;
use truing_core::system::model::Model;

/// A format that a model is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// MuJoCo, 4.0 or later.
    Mjcf,
    /// ROS, PyBullet, Drake, Isaac and others.
    Urdf,
    /// kS, kV, kA and kG of a feed-forward (WPILib).
    SysidConstants,
    /// Functional mock-up unit, FMI 3.0.
    Fmu3,
    /// Functional mock-up unit, FMI 2.0.
    Fmu2,
}

impl Format {
    /// As tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mjcf => "MJCF",
            Self::Urdf => "URDF",
            Self::SysidConstants => "kS kV kA kG",
            Self::Fmu3 => "FMU 3.0",
            Self::Fmu2 => "FMU 2.0",
        }
    }

    /// An archive, where the others are texts; it holds the whole plant.
    pub fn is_fmu(self) -> bool {
        matches!(self, Self::Fmu2 | Self::Fmu3)
    }
}

/// How a format holds an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// By words of its own.
    Native(&'static str),
    /// By a program of a few lines that is written beside it.
    Helper,
    /// Not at all.
    Not,
}
use Held::{Helper, Native, Not};

impl Held {
    /// As tables tell it.
    pub fn told(self) -> String {
        match self {
            Self::Native("") => "native".into(),
            Self::Native(word) => format!("`{word}`"),
            Self::Helper => "helper".into(),
            Self::Not => "–".into(),
        }
    }
}

/// What MJCF, URDF and the constants make of an effect.
type Row = (&'static Effect, Held, Held, Held);

/// In the order of the library. What the constants hold of an effect is its level or slope.
static TABLE: &[Row] = &[
    (&DEAD_ZONE, Helper, Not, Native("kS")),
    (&DEAD_ZONE_ASYMMETRIC, Helper, Not, Not),
    (&VOLTAGE_SATURATION, Native("ctrlrange"), Not, Not),
    (&VOLTAGE_SATURATION_ASYMMETRIC, Native("ctrlrange"), Not, Not),
    (&DRIVE_GAIN, Native("resistance"), Not, Native("all")),
    (&VOLTAGE_OFFSET, Native("biasprm"), Not, Not),
    (&TRANSPORT_DELAY, Native("delay"), Not, Not),
    (&ACTUATOR_LAG, Native("filterexact"), Not, Not),
    (&VOLTAGE_DROP, Helper, Not, Native("kS")),
    (&SUPPLY_SAG, Helper, Not, Not),
    (&CURRENT_LIMIT, Native("forcerange"), Not, Not),
    (&RESISTANCE, Native("resistance"), Not, Native("all")),
    (&MOTOR_GAIN, Native("motorconst"), Not, Native("all")),
    (&INERTIA, Native("armature"), Native("inertia"), Native("kA")),
    (&VISCOUS_FRICTION, Native("damping"), Native("damping"), Native("kV")),
    (&THERMAL_RESISTANCE, Native("thermal"), Not, Not),
    (&KT_SATURATION, Helper, Not, Not),
    (&COULOMB_FRICTION, Native("frictionloss"), Native("friction"), Native("kS")),
    (&COULOMB_ASYMMETRIC, Native("frictionloss"), Not, Not),
    (&STRIBECK_FRICTION, Helper, Not, Not),
    (&LOAD_DEPENDENT_FRICTION, Helper, Not, Not),
    (&VISCOUS_ASYMMETRIC, Helper, Not, Not),
    (&QUADRATIC_DRAG, Native("damping"), Not, Not),
    (&CONSTANT_LOAD, Native("cogging"), Not, Native("kG")),
    (&GRAVITY, Native("cogging"), Not, Native("kG")),
    (&TORSIONAL_SPRING, Native("stiffness"), Not, Not),
    (&COGGING, Native("cogging"), Not, Not),
    (&PERIODIC_LOAD, Helper, Not, Not),
    (&BACKLASH, Helper, Not, Not),
    (&FLEXIBLE_COUPLING, Native("body"), Not, Not),
    (&ENCODER_SCALE, Native("tendon"), Not, Not),
    (&SPEED_SATURATION, Native("cutoff"), Not, Not),
    (&SENSOR_LAG, Helper, Not, Not),
    (&SENSOR_RECTIFIED, Helper, Not, Not),
    (&SENSOR_OFFSET, Helper, Not, Not),
];

/// How a format holds an effect; `None`: nobody has said it yet, which a test finds. An FMU is the plant itself.
pub fn held(effect: &Effect, format: Format) -> Option<Held> {
    let (_, mjcf, urdf, constants) = TABLE.iter().find(|(row, ..)| *row == effect)?;
    Some(match format {
        Format::Mjcf => *mjcf,
        Format::Urdf => *urdf,
        Format::SysidConstants => *constants,
        Format::Fmu3 | Format::Fmu2 => Native(""),
    })
}

/// The effects of a model that a format cannot hold.
pub fn lost(model: &Model, format: Format) -> Vec<&'static Effect> {
    let effects = model.known.iter().map(|known| known.effect);
    effects.filter(|effect| held(effect, format).is_none_or(|held| held == Not)).collect()
}

/// Does the firmware compensate an effect? A part: some of its parameters have no number there.
fn in_the_servo(effect: &Effect) -> &'static str {
    let known = |on_chip: OnChip| on_chip == OnChip::Known;
    match known(effect.on_chip) {
        false => "–",
        true if effect.parameters.iter().all(|it| known(it.on_chip)) => "yes",
        true => "part",
    }
}

/// The table as Markdown, for the document, without blanks.
pub fn table() -> String {
    let formats = [Format::Mjcf, Format::Urdf, Format::SysidConstants, Format::Fmu3];
    let row = |first: &str, cells: Vec<String>| format!("|{first}|{}|\n", cells.join("|"));
    let heads = formats.iter().map(|format| format.name().into());
    let mut text = row("effect", heads.chain(["servo".into()]).collect());
    text += &row("---", vec!["---".into(); formats.len() + 1]);
    for effect in LIBRARY {
        let told = |format: &Format| held(effect, *format).map_or_else(String::new, Held::told);
        let cells = formats.iter().map(told).chain([in_the_servo(effect).into()]);
        text += &row(&format!("`{}`", effect.name), cells.collect());
    }
    text
}
