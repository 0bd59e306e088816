//! What is printed on a motor, asked for in a terminal. An empty answer means: not known.

use super::sheet::Sheet;
use super::units::{
    CURRENT, INERTIA, Measure, PLAIN, RESISTANCE, SECONDS, SPEED, TORQUE, TORQUE_CONSTANT, VOLTAGE,
};
use anyhow::Result;
use dialoguer::{Confirm, Input};

/// A question about a number, what it measures, and where the answer belongs.
type Question = (&'static str, &'static Measure, fn(&mut Sheet) -> &mut Option<f64>);

const OF_THE_MOTOR: [Question; 9] = [
    ("Supply or rated voltage, V", &VOLTAGE, |it| &mut it.voltage),
    ("No-load speed, rpm", &SPEED, |it| &mut it.no_load_rad_s),
    ("No-load current, A", &CURRENT, |it| &mut it.no_load_current),
    ("Stall current, A", &CURRENT, |it| &mut it.stall_current),
    ("Stall torque, N m (or with a unit, such as 1.2 kgcm)", &TORQUE, |it| &mut it.stall_torque),
    ("Resistance between the terminals, ohm", &RESISTANCE, |it| &mut it.resistance),
    ("Torque constant, N m/A (or with a unit, such as 23.5 mNm/A)", &TORQUE_CONSTANT, |it| {
        &mut it.torque_constant
    }),
    ("Rotor inertia, kg m2 (or with a unit, such as 10.5 gcm2)", &INERTIA, |it| &mut it.inertia),
    ("Gear: turns of the motor per turn of the output", &PLAIN, |it| &mut it.gear),
];
const OF_THE_ENCODER: [Question; 2] = [
    ("Encoder: counts per turn, after ×4 decoding", &PLAIN, |it| &mut it.counts_per_rev),
    ("Over which time does the logger average the speed, s", &SECONDS, |it| &mut it.speed_window_s),
];

/// Asks for whatever the flags leave open.
pub fn ask(sheet: &mut Sheet) -> Result<()> {
    outln!("What does the label or the data sheet say? Leave empty what is not known.\n");
    numbers(sheet, &OF_THE_MOTOR)?;
    if sheet.gear.is_some() {
        let sides = "Are the printed speed and torque those of the output of the gear?";
        sheet.printed_at_output |= Confirm::new().with_prompt(sides).default(true).interact()?;
        let encoder = "Does the encoder sit at the output of the gear?";
        sheet.encoder_at_output |= Confirm::new().with_prompt(encoder).default(false).interact()?;
    }
    numbers(sheet, &OF_THE_ENCODER)
}

fn numbers(sheet: &mut Sheet, questions: &[Question]) -> Result<()> {
    for (text, measure, answer) in questions {
        let answer = answer(sheet);
        if answer.is_none() {
            *answer = number(text, measure)?;
        }
    }
    Ok(())
}

fn number(text: &str, measure: &'static Measure) -> Result<Option<f64>> {
    let check = |answer: &String| match answer.trim() {
        "" => Ok(()),
        given => measure.read(given).map(|_| ()),
    };
    let answer: String =
        Input::new().with_prompt(text).allow_empty(true).validate_with(check).interact_text()?;
    Ok(measure.read(&answer).ok())
}
