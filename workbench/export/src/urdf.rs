//! URDF: one joint with inertia, damping and dry friction. Its input is a torque; what a motor makes of a voltage stands in a comment.

use crate::numbers::{Of, spread, with_spread};
use std::fmt::Write;
use truing_core::system::model::Model;
use truing_core::system::plant::physics::{Drive, Physics};
use truing_core::text::figures::significant;

/// Mass of a link that turns in place and feels no weight, kg.
const MASS: f64 = 0.01;

/// The file. `head`: lines of its first comment.
pub fn written(model: &Model, head: &[String]) -> String {
    let p = model.physics();
    let kind = if model.linear() { "prismatic" } else { "continuous" };
    let friction: Of = |p| (p.friction_pos + p.friction_neg) / 2.0;
    let (level, _) = spread(model, friction);
    let numbers: [(&str, Of, &str); 3] = [
        ("inertia", |p| p.inertia, "kg m²"),
        ("damping", |p| p.viscous, "N m s/rad"),
        ("friction", friction, "N m"),
    ];
    let mut text = format!("<?xml version=\"1.0\"?>\n<!--\n  {}\n", head.join("\n  ").replace("--", "– –"));
    text += "  Of the joint:\n";
    for (name, of, unit) in numbers {
        let (value, std) = spread(model, of);
        let _ = writeln!(text, "  {name} = {} {unit}", with_spread(value, Some(std)));
    }
    let _ = writeln!(text, "  The joint takes a torque, N m: {}", torque(&p));
    text += "  PyBullet brakes by `friction` only through a velocity motor of that force; Drake does not read it.\n  PyBullet has damping of its own and a limit of 100 rad/s: changeDynamics takes them away (linearDamping, angularDamping, maxJointVelocity).\n-->\n";
    let (mass, inertia) = if model.linear() { (p.inertia, p.inertia) } else { (MASS, p.inertia) };
    let _ = write!(
        text,
        "<robot name=\"servo\">\n  <link name=\"base\"/>\n  <link name=\"rotor\">\n    <inertial>\n      <origin xyz=\"0 0 0\"/>\n      <mass value=\"{mass}\"/>\n      \
         <inertia ixx=\"{inertia}\" iyy=\"{inertia}\" izz=\"{inertia}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>\n    </inertial>\n  </link>\n  \
         <joint name=\"shaft\" type=\"{kind}\">\n    <parent link=\"base\"/>\n    <child link=\"rotor\"/>\n    <axis xyz=\"0 0 1\"/>\n    \
         <dynamics damping=\"{}\" friction=\"{level}\"/>\n{}  </joint>\n</robot>\n",
        p.viscous,
        limits(model, &p)
    );
    text
}

/// What the joint is given for an input.
fn torque(p: &Physics) -> String {
    let number = |x: f64| significant(x, 6);
    match p.drive {
        Drive::Voltage => format!(
            "{} N m/V · u − {} N m s/rad · ω.",
            number(p.kt / p.resistance),
            number(p.kt * p.ke / p.resistance)
        ),
        Drive::Torque => format!("{} · input.", number(p.force_gain)),
    }
}

/// Stall torque and no-load speed at the supply.
fn limits(model: &Model, p: &Physics) -> String {
    let Some(supply) = model.supply_limit_v.or(model.supply_nominal_v) else { return String::new() };
    // A prismatic joint must have ends; nothing says where.
    let ends = if model.linear() { "lower=\"-1e3\" upper=\"1e3\" " } else { "" };
    let (effort, velocity) = (p.torque_per_input() * supply, p.dc_gain() * supply);
    format!("    <limit {ends}effort=\"{effort}\" velocity=\"{velocity}\"/>\n")
}
