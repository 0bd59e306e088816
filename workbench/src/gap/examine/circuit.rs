//! Does the measured current agree with voltage and speed: u = R i + Ke ω + L di/dt?

use super::{MOST, SHRINKS};
use crate::outcome::DataFault;
use crate::system::log::{Dynamic, Input};
use crate::system::model::{Kind, Model};
use servo::axis::Bridge;

/// What a logger may have done to a current.
const MISTAKES: [(f64, &str, &str); 4] = [
    (1e-3, "i_a is in mA", "--columns \"i_a=i_a*0.001\""),
    (1e3, "i_a is in kA", "--columns \"i_a=i_a*1000\""),
    (-1.0, "i_a has the wrong sign", "--columns \"i_a=i_a*-1\""),
    (-1e-3, "i_a is in mA and has the wrong sign", "--columns \"i_a=i_a*-0.001\""),
];

/// A current that is not the winding's.
pub fn fault(model: &Model, record: &Dynamic) -> Option<DataFault> {
    let Kind::DcMotor { r_ohm, l_h, ke_vs_per_rad, .. } = model.kind else { return None };
    if record.input != Input::Voltage || model.fitted_to_log {
        return None;
    }
    // Voltage across the resistance, and what the logged current says it is.
    let mut pairs: Vec<(f64, f64, f64)> = Vec::new();
    for run in &record.runs {
        let (Some(speed), Some(current)) = (&run.speed, &run.current_a) else {
            continue;
        };
        for row in 1..run.rows().saturating_sub(1) {
            let driven = run.bridge[row] == Bridge::Driven && run.bridge[row - 1] == Bridge::Driven;
            // A row in which the voltage jumps belongs to both.
            if driven && run.input[row] == run.input[row - 1] {
                let slope = (current[row + 1] - current[row - 1]) / (run.t_s[row + 1] - run.t_s[row - 1]);
                let across = run.input[row] - ke_vs_per_rad * speed[row];
                pairs.push((across, r_ohm * current[row] + l_h * slope, run.input[row].signum()));
            }
        }
    }
    let total: f64 = pairs.iter().map(|pair| pair.0 * pair.0).sum();
    if pairs.len() < 50 || total <= 0.0 {
        return None;
    }
    // Brushes and a dead zone of the drive take a constant part of the voltage.
    let explained = |factor: f64| {
        let drop =
            pairs.iter().map(|pair| (pair.0 - factor * pair.1) * pair.2).sum::<f64>() / pairs.len() as f64;
        let left = pairs.iter().map(|pair| (pair.0 - factor * pair.1 - drop * pair.2).powi(2));
        1.0 - left.sum::<f64>() / total
    };
    let as_it_stands = explained(1.0);
    let told = |(factor, what, remedy): (f64, &str, &str)| {
        let with_it = explained(factor);
        let clear = with_it > MOST && 1.0 - with_it < SHRINKS * SHRINKS * (1.0 - as_it_stands);
        clear.then(|| DataFault {
            place: "i_a".into(),
            what: what.into(),
            explained_as_it_stands: as_it_stands.max(0.0),
            explained_with_it: with_it,
            remedy: remedy.into(),
        })
    };
    MISTAKES.into_iter().find_map(told)
}
