//! Whether model, log and hold-outs speak of the same axis.

use crate::console::input_error::InputError;
use crate::system::log::{Dynamic, Input};
use crate::system::model::{Kind, Model};

/// Model, log and hold-outs must speak of the same axis.
pub(super) fn agree(model: &Model, log: &Dynamic, holdouts: &[Dynamic]) -> Result<(), InputError> {
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
    if let Some(what) = stands(log) {
        return Err(InputError::file(source, what));
    }
    for other in holdouts {
        if (other.input, other.linear) != (log.input, log.linear) {
            let what = format!(
                "has other columns than {source} (input {} against {})",
                other.input.column(),
                log.input.column()
            );
            return Err(InputError::file(&other.source, what));
        }
        if same(log, other) {
            let what = format!(
                "holds the same rows as {source}; a copy proves nothing, give another record or leave --holdout out"
            );
            return Err(InputError::file(&other.source, what));
        }
    }
    Ok(())
}

/// What to say of a log in which no reading of the shaft ever changes. Noise alone would: the sensor is silent, or the column is another.
fn stands(log: &Dynamic) -> Option<String> {
    let one = |values: &Option<Vec<f64>>| {
        values.as_ref().is_none_or(|values| values.iter().all(|value| *value == values[0]))
    };
    let driven = log.runs.iter().any(|run| run.input.iter().any(|u| *u != 0.0));
    let still = driven && log.runs.iter().all(|run| one(&run.speed) && one(&run.position));
    let speed = log.runs.iter().any(|run| run.speed.is_some());
    let column = match (log.linear, speed) {
        (false, true) => "omega_rad_s",
        (false, false) => "theta_rad",
        (true, true) => "v_m_s",
        (true, false) => "q_m",
    };
    still.then(|| {
        format!(
            "{column} has one value in every row, although {} drives: is the encoder connected, is the column the right one, is the shaft free?",
            log.input.column()
        )
    })
}

/// True if two logs hold the same measurements.
pub fn same(a: &Dynamic, b: &Dynamic) -> bool {
    let outputs = |log: &Dynamic| {
        log.runs.iter().map(|run| run.speed.clone().or(run.position.clone())).collect::<Vec<_>>()
    };
    outputs(a) == outputs(b)
}
