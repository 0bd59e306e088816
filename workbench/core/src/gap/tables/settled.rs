//! Records over time whose rows are so far apart that each shows a settled speed.

use super::time_constant_s;
use crate::gap::order::by_least;
use crate::system::log::{Dynamic, Input, Run, Table};
use crate::system::model::Model;
use servo::axis::Bridge;

/// Rows further apart than this many time constants of the model are steady states. Chosen by judgement: e⁻⁶ is 0.25
/// %.
const SETTLED: f64 = 6.0;
/// Each row answers its own input, against the format of a log, only if the speeds then scatter by this factor less.
/// Chosen by judgement; not studied.
const CLEARLY: f64 = 0.7;

/// Multiples of the golden ratio, without their whole part, stand far from those next to them. Origin: the three-distance theorem.
const GOLDEN: f64 = 0.618_033_988_75;

/// Which input the speed of a row answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answers {
    /// That of the row before: it was held until this row was read.
    Previous,
    /// That of the same row: the speed was written down once it had settled.
    Own,
}

/// The record as a table; `None` if it is not one.
pub fn settled(model: &Model, log: &Dynamic) -> Option<Table> {
    let [run] = &log.runs[..] else { return None };
    let omega_rad_s = run.speed.clone()?;
    let apart = run.sample_s() > SETTLED * time_constant_s(model);
    let driven = run.bridge.iter().all(|bridge| *bridge == Bridge::Driven);
    (apart && driven && log.input == Input::Voltage && !log.linear).then(|| {
        let (u_v, omega_rad_s) = match answers(run) {
            Answers::Previous => (run.input[..run.rows() - 1].to_vec(), omega_rad_s[1..].to_vec()),
            Answers::Own => (run.input.clone(), omega_rad_s),
        };
        Table {
            source: log.source.clone(),
            u_v,
            omega_rad_s,
            speed_unit_rad_s: 1.0,
            names: log.names.clone(),
        }
    })
}

/// Which input the speeds of a run answer. A log says the input that is held from a row on, so a settled speed answers the row before;
/// many loggers write it beside its own input all the same. The pairing in which the same input has the same speed, and the opposite input the
/// opposite speed, is the right one.
pub fn answers(run: &Run) -> Answers {
    let Some(speed) = run.speed.as_ref().filter(|_| run.rows() > 3) else {
        return Answers::Previous;
    };
    let last = run.rows() - 1;
    let previous = scatter(&run.input[..last], &speed[1..], true);
    let own = scatter(&run.input[1..=last], &speed[1..], true);
    if own < CLEARLY * previous { Answers::Own } else { Answers::Previous }
}

/// Share of the square of the speeds that settled speeds would leave unexplained, in the better pairing.
pub fn left_if_settled(run: &Run) -> Option<f64> {
    let speed = run.speed.as_ref().filter(|_| run.rows() > 3)?;
    let last = run.rows() - 1;
    // A motor whose directions differ does not repeat turned round; one sweep repeats nothing else.
    let scatters = [&run.input[..last], &run.input[1..=last]]
        .map(|input| scatter(input, &speed[1..], true).min(scatter(input, &speed[1..], false)));
    let left = scatters[0].min(scatters[1]);
    let mean_square = speed.iter().map(|omega| omega * omega).sum::<f64>() / speed.len() as f64;
    (mean_square > 0.0).then(|| left / mean_square)
}

/// Mean square by which each speed differs from what the other rows say of its input; with `turned`, turned round too.
fn scatter(input: &[f64], speed: &[f64], turned: bool) -> f64 {
    // Rows of one input are compared with rows far away in time: on the way to a settled speed neighbours in time are alike, too.
    let mut rows: Vec<usize> = (0..input.len()).collect();
    by_least(&mut rows, |k| (*k as f64 * GOLDEN).fract());
    let mut pairs: Vec<(f64, f64, usize)> = rows.into_iter().map(|k| (input[k], speed[k], k)).collect();
    pairs.extend((0..input.len()).filter(|_| turned).map(|k| (-input[k], -speed[k], k)));
    by_least(&mut pairs, |it| it.0);
    let mut squares = Vec::new();
    for place in 1..pairs.len() - 1 {
        let (u, omega, row) = pairs[place];
        let below = pairs[..place].iter().rev().find(|pair| pair.2 != row);
        let above = pairs[place + 1..].iter().find(|pair| pair.2 != row);
        if let (Some(below), Some(above)) = (below, above) {
            let width = above.0 - below.0;
            let share = if width > 0.0 { (u - below.0) / width } else { 0.5 };
            squares.push((omega - below.1 - share * (above.1 - below.1)).powi(2));
        }
    }
    squares.iter().sum::<f64>() / squares.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motor with a dead zone that is stepped through a triangle of levels, each read when it has settled.
    fn swept(late: bool) -> Run {
        let levels: Vec<f64> =
            (0..40).map(|k| 6.0 * (std::f64::consts::TAU * f64::from(k) / 20.0).sin()).collect();
        let settled = |u: f64| 10.0 * (u.abs() - 0.8).max(0.0) * u.signum();
        let speed = (0..40).map(|k| settled(if late { levels[usize::max(k, 1) - 1] } else { levels[k] }));
        Run {
            t_s: (0..40).map(f64::from).collect(),
            speed: Some(speed.collect()),
            bridge: vec![Bridge::Driven; 40],
            input: levels,
            ..Run::default()
        }
    }

    #[test]
    fn a_speed_answers_the_input_with_which_it_repeats() {
        assert_eq!(answers(&swept(true)), Answers::Previous);
        assert_eq!(answers(&swept(false)), Answers::Own);
    }

    /// A slow vehicle that speeds up under one voltage: neighbours in time are alike, and nothing has settled.
    #[test]
    fn a_speed_that_rises_under_one_input_has_not_settled() {
        let mut run = swept(true);
        run.input = vec![6.0; 40];
        run.speed = Some((0..40).map(|k| 14.0 * (1.0 - (-f64::from(k) / 15.0).exp())).collect());
        assert!(left_if_settled(&run).is_some_and(|left| left > 0.05));
        run.speed = Some(vec![14.0; 40]);
        assert_eq!(left_if_settled(&run), Some(0.0));
    }

    /// One sweep in one direction, away from zero, nearly fits both ways; then the format of a log decides.
    #[test]
    fn where_both_fit_the_row_before_is_answered() {
        let mut run = swept(true);
        let level = |k: i32| 2.0 + 0.05 * f64::from(k);
        run.input = (0..40).map(level).collect();
        run.speed = Some((0..40).map(|k| 10.0 * level(k - 1)).collect());
        assert_eq!(answers(&run), Answers::Previous);
    }
}
