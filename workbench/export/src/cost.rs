//! What the loss of an effect costs on a log: both models run on its input, and their speeds are compared.

use anyhow::ensure;
use truing_core::gap::dataset::{FINE, GridRun, Traces, driven_by};
use truing_core::system::effects::Effect;
use truing_core::system::log::Dynamic;
use truing_core::system::model::Model;
use truing_core::text::figures::percent;

/// A model without some of its effects.
pub fn without(model: &Model, effects: &[&Effect]) -> Model {
    let mut other = model.clone();
    other.known.retain(|known| !effects.contains(&known.effect));
    other
}

/// Rms of the difference of two models' speeds over the rms of the first one's, on a log's input.
pub fn between(model: &Model, other: &Model, log: &Dynamic) -> anyhow::Result<f64> {
    let (mut sum, mut difference) = (0.0, 0.0);
    for run in &log.runs {
        let grid = GridRun::of_rows(run);
        let [one, two] = [model, other].map(|model| {
            let mut traces = Traces::default();
            grid.simulate(&driven_by(&model.kind, model.physics(), log.input), 0.0, FINE, &mut traces);
            traces.reading
        });
        for (one, two) in one.iter().zip(two) {
            sum += one * one;
            difference += (one - two).powi(2);
        }
    }
    ensure!(
        sum > 0.0,
        "the model does not move on the input of the log; give a log in which the motor turns"
    );
    Ok((difference / sum).sqrt())
}

/// A line for each effect that is lost, and what it costs, if there is a log.
pub fn told(model: &Model, lost: &[&Effect], log: Option<&Dynamic>) -> anyhow::Result<Vec<String>> {
    let told = |effect: &&Effect| -> anyhow::Result<String> {
        let Some(log) = log else {
            return Ok(format!("not held: {}; --log tells what that costs", effect.name));
        };
        let share = between(model, &without(model, &[*effect]), log)?;
        Ok(format!("not held: {}; it costs {} of the rms of the speed", effect.name, percent(share)))
    };
    lost.iter().map(told).collect()
}
