//! Do position and speed agree, where a log has both?

use super::clearly;
use crate::outcome::DataFault;
use crate::system::log::Dynamic;
use std::f64::consts::{PI, TAU};

/// A factor that is found lies so near to the one of the list, as a difference of logarithms. Chosen by judgement,
/// tried with the others of `examine`.
const NEAR: f64 = 0.1;
/// Rows between two positions that are compared. Chosen by judgement, tried with the others of `examine`.
const STRIDE: usize = 8;
/// One of the two has the wrong sign. Origin: definition.
const SIGN: f64 = -1.0;

/// A position that does not integrate to the speed.
pub fn fault(record: &Dynamic) -> Option<DataFault> {
    let pairs = ways(record);
    let square: f64 = pairs.iter().map(|pair| pair.0 * pair.0).sum();
    let product: f64 = pairs.iter().map(|pair| pair.0 * pair.1).sum();
    let total: f64 = pairs.iter().map(|pair| pair.1 * pair.1).sum();
    if square <= 0.0 || total <= 0.0 {
        return None;
    }
    let explained =
        |factor: f64| 1.0 - pairs.iter().map(|pair| (pair.1 - factor * pair.0).powi(2)).sum::<f64>() / total;
    let (found, as_it_stands) = (product / square, explained(1.0));
    let (position, speed) = if record.linear { ("q_m", "v_m_s") } else { ("theta_rad", "omega_rad_s") };
    let near = |factor: f64| found * factor > 0.0 && (found / factor).ln().abs() < NEAR;
    let thousandths = "thousandths, or t_s in ms";
    // The way by the position is so many times the way by the speed where a column is in this unit.
    let mistakes = [
        (SIGN, position, ""),
        (180.0 / PI, position, "degrees"),
        (1.0 / TAU, position, "turns"),
        (TAU / 60.0, speed, "rpm"),
        (PI / 180.0, speed, "°/s"),
        (1000.0, position, thousandths),
        (0.001, speed, thousandths),
    ];
    let (times, column, unit) = mistakes.iter().find(|mistake| near(mistake.0))?;
    let what = match *times {
        SIGN => format!("{position} or {speed} has the wrong sign"),
        _ => format!("{column} is in {unit}"),
    };
    let mended = if *column == position { 1.0 / times } else { *times };
    let explained = [as_it_stands, explained(*times)];
    let remedy = record.names.times(column, mended);
    clearly(explained[0], explained[1])
        .then(|| super::fault(format!("{position}, {speed}"), what, remedy, explained))
}

/// The way by the speed and the way by the position, some rows at a time.
fn ways(record: &Dynamic) -> Vec<(f64, f64)> {
    let mut pairs = Vec::new();
    for run in &record.runs {
        let (Some(position), Some(speed)) = (&run.position, &run.speed) else { continue };
        let mut way = 0.0;
        for row in 1..run.rows() {
            way += 0.5 * (speed[row] + speed[row - 1]) * (run.t_s[row] - run.t_s[row - 1]);
            if row % STRIDE == 0 {
                pairs.push((way, position[row] - position[row - STRIDE]));
                way = 0.0;
            }
        }
    }
    pairs
}
