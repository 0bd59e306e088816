//! The paired trial: the same motion with the old numbers and the new ones, in turns, and whether the new ones follow better.
//!
//! A pair is one run of each kind, next to each other in time, so that a winding that warms up or grease that thins speaks
//! for neither; every other pair begins with the new numbers. Of each pair counts the logarithm of old over new error. The
//! 95 % interval of their mean is Student's: errors of one motor scatter by a factor, alike in both directions.

use crate::bench::{Bench, Followed};
use crate::motions::{Motion, ability, motions};
use serde::{Deserialize, Serialize};
use servo::config::Config;
use servo::store::AxisParameters;
use std::f64::consts::TAU;
use truing_core::text::input_error::InputError;

/// Pairs of a trial.
pub const PAIRS: usize = 5;
/// Student's t for 95 % and four degrees of freedom.
const T_FOUR: f64 = 2.776;
/// An encoder that steps by a count cannot show a smaller error than its steps make, counts rms.
pub const COUNT_RMS: f64 = 0.288_675;
/// A motion that scatters so much that it may be followed worse than this is taken for worse. Chosen by judgement; not studied.
const LEAST_SURE: f64 = 0.9;
/// How many times smaller the error must be where the model's gap is not explained. Chosen by judgement; not studied.
const LEAST_UNEXPLAINED: f64 = 2.0;
/// Below this, counts rms, an error is the encoder's and not the loop's.
const FLOOR_COUNTS: f64 = 1.0;
/// Between two runs: to go home, to come to rest and to be stopped, s; and as many time constants of the motor.
const PAUSE_S: f64 = 0.5;
const PAUSE_TAUS: f64 = 4.0;

/// A mean and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Of the logarithms of [`PAIRS`] pairs, as factors.
    fn of(logarithms: &[f64]) -> Self {
        let n = logarithms.len() as f64;
        let mean = logarithms.iter().sum::<f64>() / n;
        let variance = logarithms.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let half = T_FOUR * (variance / n).sqrt();
        let [mean, low, high] = [mean, mean - half, mean + half].map(f64::exp);
        Self { mean, low, high }
    }

    /// `1.82 (95 %: 1.74 … 1.91)`
    pub fn text(&self) -> String {
        format!("{:.3} (95 %: {:.3} … {:.3})", self.mean, self.low, self.high)
    }
}

/// One motion of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// What was followed.
    pub motion: Motion,
    /// Rms of the position error with the old numbers, run by run, rad.
    pub old_rms_rad: Vec<f64>,
    /// The same with the new ones.
    pub new_rms_rad: Vec<f64>,
    /// How many times smaller the error is.
    pub ratio: Interval,
    /// Both errors are the encoder's own steps.
    pub at_floor: bool,
}

impl Compared {
    /// A motor that warms up or cools while it is tried is followed better by the one set when it is warm and by the other when
    /// it is cold. So where the errors with the old numbers went one way throughout, which chance does once in sixty, each of
    /// them must be larger than any with the new ones; where it is not understood why they did, nothing is kept.
    ///
    /// Where every new error is smaller than every old one, which chance does once in 252 times, they may scatter as they will: a run
    /// depends on how the one before has left the shaft.
    fn is_worse(&self, understood: bool) -> bool {
        let (old, new) = (&self.old_rms_rad, &self.new_rms_rad);
        let one_way = old.is_sorted() || old.is_sorted_by(|a, b| a >= b);
        let apart = old.iter().all(|old| new.iter().all(|new| new < old));
        let doubtful = self.ratio.mean < 1.0 || self.ratio.low < LEAST_SURE;
        !self.at_floor && (!apart && (doubtful || one_way) || one_way && !understood)
    }
}

/// What a trial has shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Motion by motion.
    pub motions: Vec<Compared>,
    /// How many times smaller the error is, all motions alike.
    pub improvement: Interval,
}

/// How a trial ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Tried {
    /// All runs were made.
    Whole(Trial),
    /// Another run would not fit in what is left of the motor time.
    OutOfTime,
    /// A fault ended a run with the old numbers (`false`) or the new ones (`true`).
    Faulted(bool, String),
}

/// How long a trial of these sets takes, s.
pub fn seconds(sets: [&AxisParameters; 2]) -> Result<f64, InputError> {
    let run: f64 = motions(sets)?.iter().map(|motion| motion.seconds).sum();
    let slow = sets.into_iter().filter_map(ability).map(|able| able.time_constant_s).fold(0.0, f64::max);
    Ok(2.0 * PAIRS as f64 * (run + PAUSE_S + PAUSE_TAUS * slow))
}

/// Makes the runs until the motor has been under way for so long, s. Behind an error it is not known which set is in force.
pub fn run(bench: &mut Bench, sets: [&AxisParameters; 2], until_s: f64) -> Result<Tried, InputError> {
    let motions = motions(sets)?;
    let mut longest = seconds(sets)? / (2.0 * PAIRS as f64);
    let mut rms = [Vec::new(), Vec::new()];
    let mut runs = bench.runs(sets[0])?;
    for pair in 0..PAIRS {
        for which in [pair % 2, 1 - pair % 2] {
            if bench.motor_s + longest > until_s {
                return Ok(Tried::OutOfTime);
            }
            let followed = runs.follow(sets[which], &motions);
            longest = longest.max(runs.seconds);
            bench.motor_s += std::mem::take(&mut runs.seconds);
            match followed? {
                Followed::Whole(errors) => rms[which].push(errors),
                Followed::Faulted(what) => return Ok(Tried::Faulted(which == 1, what)),
            }
        }
    }
    Ok(Tried::Whole(Trial::of(motions, &rms, &sets[0].config)))
}

impl Trial {
    /// Of the errors of the old runs and the new ones, each run with all motions.
    fn of(motions: Vec<Motion>, rms: &[Vec<Vec<f64>>; 2], config: &Config) -> Self {
        let count = TAU / f64::from(config.counts_per_rev);
        let logarithm = |old: f64, new: f64| (old.max(COUNT_RMS * count) / new.max(COUNT_RMS * count)).ln();
        let mut all = vec![0.0; PAIRS];
        let number = motions.len() as f64;
        let compared = |(at, motion): (usize, Motion)| {
            let of = |runs: &Vec<Vec<f64>>| runs.iter().map(|run| run[at]).collect::<Vec<f64>>();
            let [old_rms_rad, new_rms_rad] = rms.each_ref().map(of);
            let pairs = old_rms_rad.iter().zip(&new_rms_rad);
            let logarithms: Vec<f64> = pairs.map(|(old, new)| logarithm(*old, *new)).collect();
            all.iter_mut().zip(&logarithms).for_each(|(sum, x)| *sum += x / number);
            let at_floor = old_rms_rad.iter().chain(&new_rms_rad).all(|rms| *rms < FLOOR_COUNTS * count);
            Compared { motion, ratio: Interval::of(&logarithms), at_floor, old_rms_rad, new_rms_rad }
        };
        let motions = motions.into_iter().enumerate().map(compared).collect();
        Self { motions, improvement: Interval::of(&all) }
    }

    /// Are the new numbers to be kept? They follow better beyond doubt, and no motion worse. What is not understood may act
    /// otherwise at another place or at another time: they then follow far better.
    pub fn won(&self, understood: bool) -> bool {
        let least = if understood { 1.0 } else { LEAST_UNEXPLAINED };
        self.improvement.low > least && !self.motions.iter().any(|it| it.is_worse(understood))
    }

    /// Is all that is left the encoder's own error?
    pub fn at_floor(&self) -> bool {
        self.motions.iter().all(|compared| compared.at_floor)
    }

    /// All motions alike, and each.
    pub fn text(&self, between: &str) -> String {
        let all = format!("error smaller by a factor of {}", self.improvement.text());
        let each = self.motions.iter().map(|it| format!("{} {}", it.motion.name, it.ratio.text()));
        std::iter::once(all).chain(each).collect::<Vec<_>>().join(between)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: five times 0.1, 0.2, 0.3, 0.4, 0.5: mean 0.3, deviation 0.1581, half width 2.776·0.0707 = 0.1963.
    #[test]
    fn the_interval_is_students() {
        let found = Interval::of(&[0.1, 0.2, 0.3, 0.4, 0.5]);
        let ends = [found.mean.ln(), found.low.ln(), found.high.ln()];
        for (end, right) in ends.into_iter().zip([0.3, 0.1037, 0.4963]) {
            assert!((end - right).abs() < 1e-4, "{end} instead of {right}");
        }
    }

    fn trial(sine: f64, crawl: f64) -> Trial {
        let noise = [0.99, 1.01, 1.0, 0.995, 1.005];
        let runs =
            |sine: f64, crawl: f64| noise.iter().map(|n| vec![sine * n, crawl / n]).collect::<Vec<_>>();
        let rms = [runs(1.0, 1.0), runs(sine, crawl)];
        Trial::of(vec![motion("sine"), motion("crawl")], &rms, &Config::EXAMPLE)
    }

    fn motion(name: &str) -> Motion {
        Motion { name: name.into(), amplitude_rad: 1.0, frequency_hz: 1.0, seconds: 1.0 }
    }

    /// A winding that cools: what is better now need not be better in an hour.
    #[test]
    fn a_motor_that_changes_beyond_the_improvement_is_not_judged() {
        let tried = |old: [f64; PAIRS], new: [f64; PAIRS]| {
            let rms = [old, new].map(|runs| runs.map(|it| vec![it]).to_vec());
            Trial::of(vec![motion("sine")], &rms, &Config::EXAMPLE).won(true)
        };
        let cooling = [0.33, 0.23, 0.21, 0.16, 0.145];
        assert!(!tried(cooling, [0.18, 0.15, 0.08, 0.06, 0.02]));
        assert!(tried(cooling, [0.08, 0.06, 0.05, 0.04, 0.02]), "better at every temperature seen");
        assert!(tried([0.23, 0.33, 0.21, 0.16, 0.145], [0.18, 0.15, 0.08, 0.06, 0.02]), "noise");
    }

    /// A run that begins a count beside home, where friction holds the shaft, has five times the error of one that does not.
    #[test]
    fn an_error_that_scatters_below_all_of_before_is_better() {
        let tried = |new: [f64; PAIRS]| {
            let old = [[8.08, 11.0], [8.01, 11.0], [7.68, 11.0], [8.01, 11.0], [7.7, 11.0]];
            let rms = [old.map(Vec::from).to_vec(), new.map(|sine| vec![sine, 2.2]).to_vec()];
            Trial::of(vec![motion("sine"), motion("crawl")], &rms, &Config::EXAMPLE).won(true)
        };
        assert!(tried([6.55, 1.26, 6.24, 1.26, 6.58]));
        assert!(!tried([7.9, 1.26, 7.9, 1.26, 7.9]), "as bad as some of before");
    }

    #[test]
    fn what_makes_one_motion_better_and_another_worse_is_not_kept() {
        assert!(trial(0.5, 0.9).won(true));
        assert!(!trial(0.3, 1.1).won(true), "the crawl is worse");
        assert!(!trial(1.0, 1.0).won(true), "nothing has changed");
        assert!(!trial(1.3, 1.2).won(true));
        assert!(!trial(0.6, 0.6).won(false), "a small gain that nobody understands");
        assert!(trial(0.4, 0.3).won(false));
    }
}
