//! What a result says against the model file: base parameters that the log contradicts, and the lines that mend the file.

use crate::outcome::{Contradiction, NamedEffect, Outcome, Tie};
use crate::system::effects::{self, Effect, INERTIA, MOTOR_GAIN};
use crate::system::model::{Kind, Model};

/// The base parameters among the names of a result, in the order of naming. A model whose numbers are a fit has no data sheet.
pub fn contradicted(model: &Model, outcome: &Outcome) -> Vec<Contradiction> {
    if model.fitted_to_log {
        return Vec::new();
    }
    let named = outcome.effects.iter().enumerate();
    named.filter_map(|(place, named)| contradiction(model, outcome, place, named)).collect()
}

fn contradiction(model: &Model, found: &Outcome, place: usize, named: &NamedEffect) -> Option<Contradiction> {
    let effect = effects::find(&named.name).filter(|effect| effect.is_base_parameter())?;
    let given = named.parameters.get(effect.parameters[0].name)?;
    let (key, power) = key(model, effect)?;
    let (_, stated) = model.parameters().into_iter().find(|(name, _)| *name == key)?;
    let ratio = given.value.powf(power);
    let shift = found.within_tolerance.iter().find(|shift| shift.parameter == key);
    let fitted = stated * ratio * (1.0 + shift.map_or(0.0, |shift| shift.shift_percent) / 100.0);
    // Before an effect of another kind is added, the gap is what the parameters alone leave.
    let alone = found.effects[..=place].iter().all(is_base_parameter);
    let section = if matches!(model.kind, Kind::FirstOrder { .. }) { "model" } else { "motor" };
    Some(Contradiction {
        parameter: key.to_owned(),
        ratio,
        std: given.std.map(|std| std * ratio / given.value),
        stated,
        fitted,
        fit_percent: alone.then(|| fit_percent(found, named.gap_after)),
        or: others(model, &found.ties, named),
        mends: vec![
            format!("[{section}] {key} = {}", crate::text::figures::figure(fitted)),
            format!("[tolerance] {key} = 1.0"),
        ],
    })
}

fn is_base_parameter(named: &NamedEffect) -> bool {
    effects::find(&named.name).is_some_and(Effect::is_base_parameter)
}

/// The key of the file that an effect multiplies, and the power of its ratio.
fn key(model: &Model, effect: &Effect) -> Option<(&'static str, f64)> {
    match (model.kind, effect) {
        // A first-order model stands for a motor of 1 Ω with Kt = Ke = 1/gain.
        (Kind::FirstOrder { .. }, effect) if *effect == INERTIA => Some(("time_constant_s", 1.0)),
        (Kind::FirstOrder { .. }, effect) if *effect == MOTOR_GAIN => Some(("gain_rad_s_per_v", -1.0)),
        (Kind::FirstOrder { .. }, _) => None,
        (Kind::Inertia { linear, .. }, effect) if *effect == INERTIA => {
            Some((if linear { "mass_kg" } else { "inertia_kgm2" }, 1.0))
        }
        (Kind::Inertia { .. }, _) => Some(("viscous", 1.0)),
        (Kind::DcMotor { .. }, effect) => {
            effect.relations.multiplies.map(|number| (number.tolerance_key(false), 1.0))
        }
    }
}

/// The parameters that explain the same in its place.
fn others(model: &Model, ties: &[Tie], named: &NamedEffect) -> Vec<String> {
    let rest = |set: &[String], of: &[String]| {
        set.iter().filter(|name| !of.contains(name)).cloned().collect::<Vec<_>>()
    };
    let mut found: Vec<String> = Vec::new();
    for tie in ties.iter().filter(|tie| tie.rivals.first().is_some_and(|set| set.contains(&named.name))) {
        let own = &tie.rivals[0];
        for rival in tie.rivals[1..].iter().filter(|rival| rest(own, rival) == [named.name.clone()]) {
            let [instead] = &rest(rival, own)[..] else { continue };
            let effect = effects::find(instead).filter(|effect| effect.is_base_parameter());
            let other = effect.and_then(|effect| key(model, effect));
            found.extend(other.map(|(key, _)| key.to_owned()).filter(|key| !found.contains(key)));
        }
    }
    found
}

/// 100·(1 − ‖y−ŷ‖/‖y−ȳ‖) of another rms on the same held-out data.
fn fit_percent(outcome: &Outcome, gap: f64) -> f64 {
    100.0 - (100.0 - outcome.holdout.fit_percent_before) * gap / outcome.holdout.rmse_before
}
