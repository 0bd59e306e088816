//! The constants of a feed-forward as robot teams have them: V = kS·sgn(ω) + kV·ω + kA·α, and kG for a weight (WPILib).

use crate::numbers::{Of, spread, with_spread};
use truing_core::system::model::Model;
use truing_core::system::plant::laws::Law;
use truing_core::system::plant::physics::{Drive, Physics};
use truing_core::text::figures::significant;

/// Input per torque: R/Kt for a voltage, behind the gain of the drive.
fn per_torque(p: &Physics) -> f64 {
    1.0 / (p.torque_per_input() * p.drive_gain)
}

/// What overcomes dry friction: dead zone and brushes count, because the input has to cover them too.
fn k_s(p: &Physics) -> f64 {
    let input = (p.dead_pos + p.dead_neg) / 2.0 + if p.drive == Drive::Voltage { p.drop_v } else { 0.0 };
    input / p.drive_gain + (p.friction_pos + p.friction_neg) / 2.0 * per_torque(p)
}

/// Input per speed: back-EMF and viscous friction.
fn k_v(p: &Physics) -> f64 {
    (p.total_damping() + (p.viscous_pos + p.viscous_neg) / 2.0) * per_torque(p)
}

fn k_a(p: &Physics) -> f64 {
    p.inertia * per_torque(p)
}

/// What holds a weight: of an arm where it is level, of a lift everywhere.
fn k_g(p: &Physics) -> f64 {
    let weight = |law: Law, sign: f64| {
        p.torques.iter().filter(|it| it.law == law).map(|it| sign * it.parameters[0]).sum::<f64>()
    };
    (weight(Law::Gravity, 1.0 / p.gear_ratio) + weight(Law::Constant, -1.0)) * per_torque(p)
}

/// The constants, each on a line with its deviation, then the line of code that takes them. `head`: lines of origin.
pub fn written(model: &Model, head: &[String]) -> String {
    let plant = model.physics();
    let length = if model.linear() { "m" } else { "rad" };
    let volt = if plant.drive == Drive::Voltage { "V" } else { "input" };
    let arm = plant.torques.iter().any(|law| law.law == Law::Gravity);
    let weighs = arm || plant.torques.iter().any(|law| law.law == Law::Constant);
    let mut lines: Vec<String> = head.iter().map(|line| format!("// {line}")).collect();
    type Constant = (&'static str, Of, String);
    let linear: [Constant; 3] = [
        ("kS", k_s, volt.to_owned()),
        ("kV", k_v, format!("{volt} s/{length}")),
        ("kA", k_a, format!("{volt} s²/{length}")),
    ];
    let mut constants = Vec::from(linear);
    if weighs {
        constants.insert(1, ("kG", k_g, volt.to_owned()));
    }
    for (name, of, unit) in &constants {
        let (value, std) = spread(model, of);
        let value_text = significant(value, 5);
        lines.push(format!("double {name} = {value_text};  // {}, {unit}", with_spread(value, Some(std))));
    }
    let names: Vec<&str> = constants.iter().map(|(name, ..)| *name).collect();
    let class = match (weighs, arm) {
        (false, _) => "SimpleMotorFeedforward",
        (true, true) => "ArmFeedforward",
        (true, false) => "ElevatorFeedforward",
    };
    lines.push(format!("{class} feedforward = new {class}({});", names.join(", ")));
    lines.join("\n") + "\n"
}
