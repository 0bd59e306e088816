//! A nominal model out of MJCF or URDF: the first joint that an actuator drives, or the first that moves.

use anyhow::{Context, anyhow, bail, ensure};
use roxmltree::{Document, Node};
use std::fmt::Write;
use truing_core::system::effects::{COULOMB_FRICTION, QUADRATIC_DRAG, TORSIONAL_SPRING};
use truing_core::system::model::parse_draft;

/// What is read of a joint.
#[derive(Default)]
struct Joint {
    linear: bool,
    inertia: f64,
    damping: [f64; 3],
    friction: f64,
    spring: [f64; 3],
    rest: f64,
}

/// The text of a model file. `name`: that of the file, for messages and as the source of the numbers.
pub fn model(name: &str, text: &str) -> anyhow::Result<String> {
    let document =
        Document::parse(text).with_context(|| format!("{name}: is no XML; give an MJCF or a URDF file"))?;
    let model = match document.root_element().tag_name().name() {
        "mujoco" => mjcf(name, document.root_element())?,
        "robot" => urdf(name, document.root_element())?,
        other => bail!("{name}: begins with <{other}>; an MJCF begins with <mujoco>, a URDF with <robot>"),
    };
    // What is written can be read.
    parse_draft(name, &model)?;
    Ok(model)
}

fn numbers<const N: usize>(node: Node, key: &str) -> [f64; N] {
    let mut all = [0.0; N];
    let words = node.attribute(key).unwrap_or_default().split_whitespace();
    all.iter_mut().zip(words).for_each(|(number, word)| *number = word.parse().unwrap_or(0.0));
    all
}

fn number(node: Node, key: &str) -> f64 {
    numbers::<1>(node, key)[0]
}

fn find<'a>(root: Node<'a, 'a>, tag: &str, with: impl Fn(&Node) -> bool) -> Option<Node<'a, 'a>> {
    root.descendants().find(|node| node.has_tag_name(tag) && with(node))
}

fn mjcf(name: &str, root: Node) -> anyhow::Result<String> {
    let drives = |node: &Node| {
        node.parent().is_some_and(|it| it.has_tag_name("actuator"))
            && node.has_attribute("joint")
            && node.attribute("input") != Some("none")
    };
    let actuator = root.descendants().find(drives);
    let named = actuator.and_then(|it| it.attribute("joint"));
    let node = find(root, "joint", |it| {
        it.has_attribute("name") && (named.is_none() || it.attribute("name") == named)
    })
    .ok_or_else(|| {
        anyhow!("{name}: has no <joint> with a name; give a file with a joint that an actuator drives")
    })?;
    let body = node.parent().and_then(|it| it.children().find(|it| it.has_tag_name("inertial")));
    let turning = body.map_or(0.0, |it| numbers::<3>(it, "diaginertia")[2]);
    let linear = node.attribute("type") == Some("slide");
    let mass = body.map_or(0.0, |it| number(it, "mass"));
    let joint = Joint {
        linear,
        inertia: number(node, "armature") + if linear { mass } else { turning },
        damping: numbers(node, "damping"),
        friction: number(node, "frictionloss"),
        spring: numbers(node, "stiffness"),
        rest: number(node, "springref"),
    };
    if let Some(motor) = actuator.filter(|it| it.has_tag_name("dcmotor") && it.has_attribute("resistance")) {
        let [kt, ke] = numbers::<2>(motor, "motorconst");
        let constant = if kt > 0.0 && ke > 0.0 { (kt * ke).sqrt() } else { kt.max(ke) };
        let gear = if motor.has_attribute("gear") { number(motor, "gear") } else { 1.0 };
        return Ok(dc_motor(
            name,
            &joint,
            number(motor, "resistance"),
            constant * gear,
            number(motor, "inductance"),
        ));
    }
    let gain =
        actuator.map_or(1.0, |it| if it.has_attribute("gainprm") { number(it, "gainprm") } else { 1.0 });
    ensure!(
        gain != 0.0,
        "{name}: its actuator gives nothing (gainprm 0), a callback drives the joint; give the model that it was exported from"
    );
    let gear = actuator.map_or(1.0, |it| if it.has_attribute("gear") { number(it, "gear") } else { 1.0 });
    let bias = actuator.map_or([0.0; 3], |it| numbers::<3>(it, "biasprm"));
    let mut joint = joint;
    // What a motor brakes in proportion to the speed is damping where no resistance is known.
    joint.damping[0] -= bias[2] * gear * gear;
    Ok(inertia(name, &joint, gain * gear))
}

fn urdf(name: &str, root: Node) -> anyhow::Result<String> {
    let node = find(root, "joint", |it| {
        !matches!(it.attribute("type"), None | Some("fixed" | "floating" | "planar"))
    })
    .ok_or_else(|| {
        anyhow!("{name}: has no joint that moves; give a file with a revolute, continuous or prismatic joint")
    })?;
    let child = |tag: &str| node.children().find(|it| it.has_tag_name(tag));
    let link = child("child").and_then(|it| it.attribute("link"));
    let link = find(root, "link", |it| it.attribute("name") == link);
    let of_link = |tag: &str| link.and_then(|it| it.descendants().find(|it| it.has_tag_name(tag)));
    let axis = child("axis").map_or([1.0, 0.0, 0.0], |it| numbers::<3>(it, "xyz"));
    let about = of_link("inertia").map_or(0.0, |it| {
        [("ixx", axis[0]), ("iyy", axis[1]), ("izz", axis[2])]
            .iter()
            .map(|(key, part)| number(it, key) * part * part)
            .sum()
    });
    let linear = node.attribute("type") == Some("prismatic");
    let mass = of_link("mass").map_or(0.0, |it| number(it, "value"));
    let dynamics = child("dynamics");
    let of_joint = |key: &str| dynamics.map_or(0.0, |it| number(it, key));
    let joint = Joint {
        linear,
        inertia: if linear { mass } else { about },
        damping: [of_joint("damping"), 0.0, 0.0],
        friction: of_joint("friction"),
        ..Joint::default()
    };
    Ok(inertia(name, &joint, 1.0))
}

/// A number of the file, or one that a log must tell.
fn known(value: f64) -> String {
    if value > 0.0 { format!("{value:?}") } else { "\"unknown\"".into() }
}

fn begun(name: &str, kind: &str) -> String {
    format!(
        "schema = \"truing-model/1\"\n[model]\nkind = \"{kind}\"\nsource = {:?}\n[motor]\n",
        format!("imported from {name}")
    )
}

fn dc_motor(name: &str, joint: &Joint, resistance: f64, constant: f64, inductance: f64) -> String {
    let mut text = begun(name, "dc_motor");
    let _ = writeln!(
        text,
        "R_ohm = {}\nL_h = {inductance:?}\nKt_nm_per_a = {}",
        known(resistance),
        known(constant)
    );
    let _ = writeln!(text, "J_kgm2 = {}\nb_nms_per_rad = {:?}", known(joint.inertia), joint.damping[0]);
    text + &effects(joint)
}

fn inertia(name: &str, joint: &Joint, gain: f64) -> String {
    let mut text = begun(name, "inertia");
    let key = if joint.linear { "mass_kg" } else { "inertia_kgm2" };
    let _ = writeln!(
        text,
        "{key} = {}\nviscous = {:?}\ndrive_gain = {gain:?}",
        known(joint.inertia),
        joint.damping[0]
    );
    text + &effects(joint)
}

/// The effects that a joint holds.
fn effects(joint: &Joint) -> String {
    let mut text = String::new();
    let mut add = |effect: &truing_core::system::effects::Effect, values: &[f64]| {
        let _ = writeln!(text, "[known.{}]", effect.name);
        for (parameter, value) in effect.parameters.iter().zip(values) {
            let name = if joint.linear {
                truing_core::system::effects::linear_key(parameter.name)
            } else {
                parameter.name.into()
            };
            let _ = writeln!(text, "{name} = {value:?}");
        }
    };
    if joint.friction > 0.0 {
        add(&COULOMB_FRICTION, &[joint.friction]);
    }
    if joint.damping[1] > 0.0 {
        add(&QUADRATIC_DRAG, &[joint.damping[1]]);
    }
    if joint.spring[0] > 0.0 || joint.spring[2] > 0.0 {
        add(&TORSIONAL_SPRING, &[joint.spring[0], joint.rest, joint.spring[2]]);
    }
    text
}
