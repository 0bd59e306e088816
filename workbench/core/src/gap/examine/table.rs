//! Units and signs of a table of settled speeds.

use super::motion::GAIN;
use super::suspects::scales;
use super::{ENOUGH, clearly};
use crate::gap::residual::best_sum;
use crate::outcome::DataFault;
use crate::system::log::Table;
use crate::system::model::{Kind, Model};
use std::f64::consts::{PI, TAU};

/// A factor that is found lies so near to the one of the list, as a difference of logarithms. Chosen by judgement,
/// tried with the others of `examine`.
const NEAR: f64 = 0.35;

/// A factor or a sign without which the table does not rise as the model says.
pub fn fault(model: &Model, table: &Table) -> Option<DataFault> {
    let gain = match model.kind {
        Kind::DcMotor { r_ohm, kt_nm_per_a, ke_vs_per_rad, b_nms_per_rad, .. } => {
            kt_nm_per_a / (kt_nm_per_a * ke_vs_per_rad + r_ohm * b_nms_per_rad)
        }
        Kind::FirstOrder { gain_rad_s_per_v, .. } => gain_rad_s_per_v,
        Kind::Inertia { .. } => return None,
    };
    let (slope, explained) = line(table)?;
    let found = slope / gain;
    let right = found > 0.0 && (model.fitted_to_log || (1.0 / GAIN..=GAIN).contains(&found));
    if right || explained < ENOUGH {
        return None;
    }
    let largest = table.u_v.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    let times = |column, factor| table.names.times(column, factor);
    let mut listed = vec![
        (-1.0, "omega_rad_s or u_v has the wrong sign".to_owned(), times("u_v", -1.0)),
        (60.0 / TAU, "omega_rad_s is in rpm".into(), times("omega_rad_s", TAU / 60.0)),
        (180.0 / PI, "omega_rad_s is in °/s".into(), times("omega_rad_s", PI / 180.0)),
        (1e-3, "u_v is in mV".into(), times("u_v", 1e-3)),
    ];
    if let Some(supply) = model.supply_nominal_v {
        let read = |(name, full)| (supply / full, format!("u_v is {name}"), times("u_v", supply / full));
        listed.extend(scales(largest).map(read));
    }
    let near = |factor: f64| {
        let sign_alone = model.fitted_to_log && factor < 0.0 && found < 0.0;
        !model.fitted_to_log && found * factor > 0.0 && (found / factor).ln().abs() < NEAR || sign_alone
    };
    let (_, what, remedy) = listed.into_iter().find(|(factor, ..)| near(*factor))?;
    clearly(0.0, explained).then(|| super::fault("omega_rad_s, u_v", what, remedy, [0.0, explained]))
}

/// Slope of the speed over the voltage beside a step and a constant, and the share of the variation that they explain.
fn line(table: &Table) -> Option<(f64, f64)> {
    let step = |u: &f64| u.signum() * f64::from(*u != 0.0);
    let steps = table.u_v.iter().map(step).collect();
    let (weights, left) = best_sum(&[table.u_v.clone(), steps], &table.omega_rad_s)?;
    Some((weights[0], 1.0 - left * left))
}
