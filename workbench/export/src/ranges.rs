//! Ranges for domain randomisation: events of mjlab and of IsaacLab, from each number's deviation.

use crate::numbers::{Of, spread};
use std::fmt::Write;
use truing_core::system::model::Model;
use truing_core::text::figures::significant;

/// A range reaches so many standard deviations to each side: 95 % of what the number may be.
const REACH: f64 = 2.0;

/// A Python file with the events of both. `head`: lines of its comment.
pub fn written(model: &Model, head: &[String]) -> String {
    let numbers: [(&str, Of); 3] = [
        ("friction", |p| (p.friction_pos + p.friction_neg) / 2.0),
        ("armature", |p| p.inertia),
        ("damping", |p| p.viscous),
    ];
    let ranges = numbers.map(|(name, of)| {
        let (value, std) = spread(model, of);
        let [low, high] = [-REACH, REACH].map(|reach| significant((value + reach * std).max(0.0), 5));
        (name, format!("({low}, {high})"))
    });
    let mut text: String = head.iter().map(|line| format!("# {line}\n")).collect();
    let _ = writeln!(text, "# Each range is its number ± {REACH} standard deviations.\n");
    text += "def mjlab_events(entity=\"robot\", joint=\"shaft\"):\n    \
             \"\"\"For `ManagerBasedRlEnvCfg.events` of mjlab.\"\"\"\n    \
             from mjlab.envs.mdp import dr\n    from mjlab.managers.event_manager import EventTermCfg\n    \
             from mjlab.managers.scene_entity_config import SceneEntityCfg\n    where = SceneEntityCfg(entity, joint_names=(joint,))\n    return {\n";
    for (name, range) in &ranges {
        let _ = writeln!(
            text,
            "        \"joint_{name}\": EventTermCfg(mode=\"startup\", func=dr.joint_{name},\n            \
             params={{\"asset_cfg\": where, \"operation\": \"abs\", \"ranges\": {range}}}),"
        );
    }
    text += "    }\n\n\ndef isaaclab_event(entity=\"robot\", joint=\"shaft\"):\n    \
             \"\"\"A term of the events of IsaacLab, which randomises damping with the gains of an actuator.\"\"\"\n    \
             from isaaclab.envs import mdp\n    from isaaclab.managers import EventTermCfg, SceneEntityCfg\n    \
             return EventTermCfg(func=mdp.randomize_joint_parameters, mode=\"startup\", params={\n        \
             \"asset_cfg\": SceneEntityCfg(entity, joint_names=[joint]),\n        \"operation\": \"abs\", \"distribution\": \"uniform\",\n";
    for (name, range) in &ranges[..2] {
        let _ = writeln!(text, "        \"{name}_distribution_params\": {range},");
    }
    text + "    })\n"
}
