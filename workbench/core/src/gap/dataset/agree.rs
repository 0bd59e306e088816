//! Whether model, log and hold-outs speak of the same axis.

use crate::system::log::{Dynamic, Input, Run};
use crate::system::model::{Kind, Model};
use crate::text::input_error::InputError;

/// Model, log and hold-outs must speak of the same axis.
pub(super) fn agree(model: &Model, log: &Dynamic, holdouts: &[&Dynamic]) -> Result<(), InputError> {
    let source = &log.source;
    if matches!(model.kind, Kind::DcMotor { .. } | Kind::FirstOrder { .. }) && log.linear {
        return Err(InputError::file(
            source,
            "has a linear axis (m), but the model turns; use kind = \"inertia\" with mass_kg",
        ));
    }
    if matches!(model.kind, Kind::FirstOrder { .. }) && log.input != Input::Voltage {
        let what = format!("drives the axis by {}, but a first_order model needs u_v", log.input.column());
        return Err(InputError::file(source, what));
    }
    if matches!(model.kind, Kind::Inertia { .. }) && model.linear() != log.linear {
        return Err(InputError::file(
            source,
            "and the model disagree on whether the axis is linear (mass_kg, q_m) or turns (inertia_kgm2, theta_rad)",
        ));
    }
    for other in holdouts {
        if (other.input, other.linear) != (log.input, log.linear) {
            let [ours, theirs] = [log, other].map(|it| it.input.column());
            let what = format!("has other columns than {source} (input {theirs} against {ours})");
            return Err(InputError::file(&other.source, what));
        }
        if reads(log) && same(log, other) {
            let what = format!(
                "holds the same rows as {source}; a copy proves nothing, give another record or leave --holdout out"
            );
            return Err(InputError::file(&other.source, what));
        }
    }
    Ok(())
}

/// True if a reading of the shaft ever changes: records in which none does are alike, and no copies.
fn reads(log: &Dynamic) -> bool {
    let changes = |values: &Option<Vec<f64>>| {
        values.iter().any(|values| values.iter().any(|value| *value != values[0]))
    };
    log.runs.iter().any(|run| changes(&run.speed) || changes(&run.position))
}

/// True if two logs hold the same measurements.
pub fn same(a: &Dynamic, b: &Dynamic) -> bool {
    let output = |run| output(run).unwrap_or_default();
    a.runs.len() == b.runs.len() && a.runs.iter().zip(&b.runs).all(|(a, b)| output(a) == output(b))
}

fn output(run: &Run) -> Option<&[f64]> {
    run.speed.as_deref().or(run.position.as_deref())
}

/// True if two runs were driven alike.
pub(super) fn same_input(x: &[f64], y: &[f64], largest: f64) -> bool {
    let close = |(u, v): (&f64, &f64)| (u - v).abs() <= 1e-6 * largest;
    x.len() == y.len() && x.iter().zip(y).all(close)
}
