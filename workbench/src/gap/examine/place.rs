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
    let mistakes = mistakes(position, speed);
    let mistake = mistakes.into_iter().find(|mistake| near(mistake.times))?;
    let with_it = explained(mistake.times);
    clearly(as_it_stands, with_it).then(|| DataFault {
        place: format!("{position}, {speed}"),
        what: mistake.what,
        explained_as_it_stands: as_it_stands.max(0.0),
        explained_with_it: with_it,
        remedy: record.names.times(mistake.column, mistake.mended),
    })
}

/// The way by the speed and the way by the position, some rows at a time.
fn ways(record: &Dynamic) -> Vec<(f64, f64)> {
    let mut pairs = Vec::new();
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
    pairs
}

/// What a logger may have written.
struct Mistake<'a> {
    /// The way by the position is so many times the way by the speed.
    times: f64,
    what: String,
    column: &'a str,
    /// The factor that mends the column.
    mended: f64,
}

fn mistakes<'a>(position: &'a str, speed: &'a str) -> Vec<Mistake<'a>> {
    let of = |column: &'a str, times: f64, unit: &str| Mistake {
        times,
        what: format!("{column} is in {unit}"),
        column,
        mended: if column == position { 1.0 / times } else { times },
    };
    let sign = Mistake {
        times: -1.0,
        what: format!("{position} or {speed} has the wrong sign"),
        column: position,
        mended: -1.0,
    };
    vec![
        sign,
        of(position, 180.0 / PI, "degrees"),
        of(position, 1.0 / TAU, "turns"),
        of(speed, TAU / 60.0, "rpm"),
        of(speed, PI / 180.0, "°/s"),
        of(position, 1000.0, "thousandths, or t_s in ms"),
        of(speed, 0.001, "thousandths, or t_s in ms"),
    ]
}
