//! What a case hides against what was found.

use std::collections::BTreeMap;
use trials::naming::group;
use truing::outcome::Outcome;
use truing::synthetic::cases::Answer;
use truing::system::effects::{self, Meaning};

/// Whether the names are those that are hidden, each as often.
pub fn names_are_right(answer: &Answer, outcome: &Outcome) -> bool {
    let names = |names: Vec<&str>| -> BTreeMap<String, usize> {
        let mut counted = BTreeMap::new();
        for name in names {
            *counted.entry(group(name).to_owned()).or_default() += 1;
        }
        counted
    };
    names(answer.hidden.iter().map(|effect| effect.name).collect())
        == names(outcome.effects.iter().map(|effect| effect.name.as_str()).collect())
}

/// (estimate − truth)/std of every parameter of an effect that is exactly right in name and form, in cases whose names are
/// all right: what a wrong partner does to a parameter is no matter of its interval.
pub fn deviations(answer: &Answer, outcome: &Outcome) -> Vec<(String, f64)> {
    if !names_are_right(answer, outcome) {
        return Vec::new();
    }
    let mut all = Vec::new();
    for effect in answer.hidden.iter().filter(|effect| effect.form_in_library) {
        let Some(found) = outcome.effects.iter().find(|found| found.name == effect.name) else {
            continue;
        };
        for (name, truth) in &effect.parameters {
            let Some(value) = found.parameters.get(*name) else {
                continue;
            };
            let Some(std) = value.std.filter(|std| *std > 0.0) else {
                continue;
            };
            let mut error = value.value - truth;
            if is_phase(effect.name, name) {
                let turn = std::f64::consts::TAU;
                error -= turn * (error / turn).round();
            }
            all.push((format!("{}.{name}", effect.name), error / std));
        }
    }
    all
}

/// Whether a parameter of an effect is the angle of a sine.
fn is_phase(effect: &str, parameter: &str) -> bool {
    let place = effects::find(effect).and_then(|effect| Some((effect, effect.place(Meaning::Phase)?)));
    place.is_some_and(|(effect, place)| effect.parameters[place].name == parameter)
}
