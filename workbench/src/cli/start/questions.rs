//! What is printed on a motor, asked for in a terminal. An empty answer means: not known.

use super::Arguments;
use super::units::{self, Measure};
use anyhow::Result;
use dialoguer::{Confirm, Input};

/// One question about a number.
struct Question {
    text: &'static str,
    measure: &'static Measure,
    answer: fn(&mut Arguments) -> &mut Option<f64>,
}

const QUESTIONS: [Question; 8] = [
    Question { text: "Supply or rated voltage, V", measure: &units::VOLTAGE, answer: |it| &mut it.voltage },
    Question { text: "No-load speed, rpm", measure: &units::SPEED, answer: |it| &mut it.no_load_rpm },
    Question { text: "No-load current, A", measure: &units::CURRENT, answer: |it| &mut it.no_load_current },
    Question { text: "Stall current, A", measure: &units::CURRENT, answer: |it| &mut it.stall_current },
    Question {
        text: "Stall torque, N m (or with a unit, such as 1.2 kgcm)",
        measure: &units::TORQUE,
        answer: |it| &mut it.stall_torque,
    },
    Question {
        text: "Resistance between the terminals, ohm",
        measure: &units::RESISTANCE,
        answer: |it| &mut it.resistance,
    },
    Question {
        text: "Torque constant, N m/A (or with a unit, such as 23.5 mNm/A)",
        measure: &units::TORQUE_CONSTANT,
        answer: |it| &mut it.kt,
    },
    Question {
        text: "Rotor inertia, kg m2 (or with a unit, such as 10.5 gcm2)",
        measure: &units::INERTIA,
        answer: |it| &mut it.inertia,
    },
];

/// Asks for whatever the flags leave open.
pub fn ask(arguments: &mut Arguments) -> Result<()> {
    outln!("What does the label or the data sheet say? Leave empty what is not known.\n");
    for question in &QUESTIONS {
        let answer = (question.answer)(arguments);
        if answer.is_none() {
            *answer = number(question.text, question.measure)?;
        }
    }
    if arguments.gear.is_none() {
        arguments.gear = plain("Gear: turns of the motor per turn of the output")?;
    }
    if arguments.gear.is_some() {
        let sides = "Are the printed speed and torque those of the output of the gear?";
        arguments.printed_at_output |= Confirm::new().with_prompt(sides).default(true).interact()?;
        let encoder = "Does the encoder sit at the output of the gear?";
        arguments.encoder_at_output |= Confirm::new().with_prompt(encoder).default(false).interact()?;
    }
    if arguments.counts_per_rev.is_none() {
        arguments.counts_per_rev = plain("Encoder: counts per turn, after ×4 decoding")?;
    }
    if arguments.speed_window.is_none() {
        let window = "Over which time does the logger average the speed, s";
        arguments.speed_window = number(window, &units::SECONDS)?;
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

fn plain(text: &str) -> Result<Option<f64>> {
    const NONE: Measure = Measure::plain();
    number(text, &NONE)
}
