//! Whether a table excites anything, and what it cannot show.

use crate::system::log::Table;

/// Different voltages that a table needs before a name can be trusted. Origin: three for a line and its noise, three
/// for a bend.
pub const FEWEST_VOLTAGES: usize = 6;

/// Fails with the reason why nothing can be tested.
pub fn rich_enough(log: &Table) -> Result<(), String> {
    let mut volts: Vec<f64> = log.u_v.clone();
    volts.sort_by(f64::total_cmp);
    volts.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs().max(1e-9));
    if volts.len() < FEWEST_VOLTAGES {
        let n = volts.len();
        return Err(format!(
            "the table holds {n} different voltages; measure at least {FEWEST_VOLTAGES}, from rest to full"
        ));
    }
    let moving = log.omega_rad_s.iter().filter(|w| **w != 0.0).count();
    if moving < 3 {
        return Err("the motor does not move in this table; raise the voltage until it turns".into());
    }
    let first = log.omega_rad_s[0];
    if log.omega_rad_s.iter().all(|w| (w - first).abs() <= 1e-9 * first.abs()) {
        return Err("the speed is the same in every row; add voltages at which it is lower".into());
    }
    Ok(())
}

/// What the table cannot show, in words.
pub fn blind_spots(log: &Table) -> Vec<String> {
    let lowest = log.u_v.iter().fold(f64::INFINITY, |m, u| m.min(u.abs()));
    let one_way = log.u_v.iter().all(|u| *u >= 0.0) || log.u_v.iter().all(|u| *u <= 0.0);
    let mut spots = Vec::new();
    if one_way {
        spots.push(
            "The table holds one direction only: a difference between the directions would not be seen."
                .into(),
        );
    }
    if log.omega_rad_s.iter().all(|w| *w != 0.0) {
        spots.push(format!(
            "The motor moves in every row; the lowest voltage is {lowest} V. What happens below it, a dead zone included, is \
             not in the data."
        ));
    }
    spots
}
