//! The last act: `truing improve` on the hidden motor, in which cogging hides beside the dead zone. It knows supply, encoder and rated
//! speed, and nothing of what came before.

use super::servo_case::connect;
use super::{Event, HiddenServo, Listener, Options};
use anyhow::Result;
use truing_improve::bench::Bench;
use truing_improve::history::Gap;
use truing_improve::improving::{self, Improved, Job};
use truing_improve::trial::Compared;
use truing_improve::{candidate, report};
use truing_report::report::section::Section;
use truing_servo::device::axis_file;
use truing_servo::device::session::Listening;

/// Control rate, Hz: QEMU takes a tenth of the time of the servo before. Chosen by judgement; not studied.
const TICK_HZ: u32 = 1000;
/// Motor time, s: what the command takes unless it is told otherwise. Origin: with 45 s a motor with a time constant of 0.1 s was left
/// untried.
const BUDGET_S: f64 = 60.0;

/// Improves the motor.
pub fn run(hidden: &HiddenServo, options: &Options, say: &mut Listener) -> Result<Improved> {
    let mut setup = axis_file::read(&options.out.join("axis.toml"))?;
    setup.config.tick_hz = TICK_HZ;
    let wire = connect(&hidden.cogging_motor_toml(), options, &setup.config)?;
    let (out, seed, analyse) = (options.out.join("improve"), options.seed, Box::new(candidate::analysed));
    let job = Job { setup, model: None, out, budget_s: BUDGET_S, seed, analyse };
    improving::run(Bench::new(wire, Listening { axis: 0, every: 1 }), job, &mut |text| {
        say(Event::Progress(text.lines().next().unwrap_or_default(), None));
    })
}

/// What was named, and model and motor before and after, in plain words.
pub fn describe(improved: &Improved) -> String {
    let Some(entry) = improved.entries.last() else { return format!("Nothing was tried: {}", improved.why) };
    let mut text = format!("The model lacked {}.\n", entry.names.join(", "));
    if let Some(Gap { unit, rms: [Some(before), Some(after), _], .. }) = &entry.gap {
        text += &format!("Gap between model and motor: {before:.3} {unit} before, {after:.3} {unit} after\n");
    }
    let motions = entry.trial.iter().flat_map(|trial| &trial.motions);
    for Compared { motion, old_rms_rad, new_rms_rad, ratio, .. } in motions {
        let mean = |runs: &Vec<f64>| runs.iter().sum::<f64>() / runs.len() as f64;
        let [old, new] = [old_rms_rad, new_rms_rad].map(|runs| mean(runs).to_degrees());
        let (name, times) = (&motion.name, ratio.mean);
        text +=
            &format!("Error of the {name}: {old:.2}° before, {new:.2}° after: {times:.1} times smaller\n");
    }
    let end = if entry.kept { "The new numbers are stored" } else { "The old numbers are in force again" };
    text + &format!("{end}; the motor was under way for {:.0} s.", improved.motor_s)
}

/// The same in the report.
pub fn section(improved: &Improved) -> Section {
    let mut section = report::summary(improved);
    section.title = "The loop closes itself: cogging beside the dead zone".into();
    section.text.extend(describe(improved).lines().map(String::from));
    section
}
