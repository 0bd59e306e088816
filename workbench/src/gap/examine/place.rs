//! Do position and speed agree, where a log has both?

use super::clearly;
use crate::outcome::DataFault;
use crate::system::log::Dynamic;
use std::f64::consts::{PI, TAU};

/// A factor that is found lies so near the one of the list, in its logarithm.
const NEAR: f64 = 0.1;
/// Rows between two positions that are compared.
const STRIDE: usize = 8;

/// A position that does not integrate to the speed.
pub fn fault(record: &Dynamic) -> Option<DataFault> {
    let mut pairs: Vec<(f64, f64)> = Vec::new();
    for run in &record.runs {
        let (Some(position), Some(speed)) = (&run.position, &run.speed) else {
            continue;
        };
        let mut way = 0.0;
        for row in 1..run.rows() {
            way += 0.5 * (speed[row] + speed[row - 1]) * (run.t_s[row] - run.t_s[row - 1]);
            if row % STRIDE == 0 {
                pairs.push((way, position[row] - position[row - STRIDE]));
                way = 0.0;
            }
        }
    }
    let square: f64 = pairs.iter().map(|pair| pair.0 * pair.0).sum();
    let product: f64 = pairs.iter().map(|pair| pair.0 * pair.1).sum();
    let total: f64 = pairs.iter().map(|pair| pair.1 * pair.1).sum();
    if square <= 0.0 || total <= 0.0 {
        return None;
    }
    let explained =
        |factor: f64| 1.0 - pairs.iter().map(|pair| (pair.1 - factor * pair.0).powi(2)).sum::<f64>() / total;
    let (found, as_it_stands) = (product / square, explained(1.0));
    let names = match record.linear {
        true => ("q_m", "v_m_s"),
        false => ("theta_rad", "omega_rad_s"),
    };
    let (position, speed) = names;
    let listed = [
        (
            -1.0,
            format!("{position} or {speed} has the wrong sign"),
            format!("--columns \"{position}={position}*-1\""),
        ),
        (
            180.0 / PI,
            format!("{position} is in degrees"),
            format!("--columns \"{position}={position}*{:.6}\"", PI / 180.0),
        ),
        (
            1.0 / TAU,
            format!("{position} is in turns"),
            format!("--columns \"{position}={position}*{TAU:.6}\""),
        ),
        (
            TAU / 60.0,
            format!("{speed} is in rpm"),
            format!("--columns \"{speed}={speed}*{:.6}\"", TAU / 60.0),
        ),
        (
            PI / 180.0,
            format!("{speed} is in °/s"),
            format!("--columns \"{speed}={speed}*{:.6}\"", PI / 180.0),
        ),
        (
            1000.0,
            format!("{position} is in thousandths, or t_s in ms"),
            format!("--columns \"{position}={position}*0.001\""),
        ),
        (
            0.001,
            format!("{speed} is in thousandths, or t_s in ms"),
            format!("--columns \"{speed}={speed}*0.001\""),
        ),
    ];
    let near = |factor: f64| found * factor > 0.0 && (found / factor).ln().abs() < NEAR;
    let (factor, what, remedy) = listed.into_iter().find(|(factor, ..)| near(*factor))?;
    let with_it = explained(factor);
    clearly(as_it_stands, with_it).then(|| DataFault {
        place: format!("{position}, {speed}"),
        what,
        explained_as_it_stands: as_it_stands.max(0.0),
        explained_with_it: with_it,
        remedy,
    })
}
