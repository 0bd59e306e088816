//! From a solution to estimates: half widths, and whether the loops may use them.
//!
//! A least-squares deviation cannot see that the model is not the motor. On motors with drag, cogging, unequal gain and
//! Stribeck friction that bias stays within 4 % of the dead zone in 19 of 20 (docs/results/README.md), hence
//! u95 = 2σ + 4 %.

use super::Params;
use super::estimate::{Estimate, Estimates, GAIN_FRAC, Mechanism, Reason, Standing, TIME_FRAC, share};
use super::plausible::{contradict, starts_higher};
use super::positive::Positive;
use super::regression::Sums;
use super::saturation;
use super::slices::Spread;
use super::solve::{RELATIVE_FRAC, Solution, VOLTAGE_FRAC};
use super::spline::{Lengths, ROW_FRAC};
use crate::units::Direction;

/// Share of a value that its model error may be, in 1/1024: dead zone, gain and time constant 4 %, saturation 1.5 %.
const MODEL_ERROR_1024: i32 = 41;
/// More of it when the supply is not measured, in 1/1024: 3 %, for a source of 5 % of the winding's resistance.
const BLIND_ERROR_1024: i32 = 31;
const SATURATION_ERROR_1024: i32 = 15;
/// A dead zone is trusted while its half width is below this share, in 1/1024: 12 %.
const TRUST_LIMIT_1024: i32 = 123;
/// Counts per time constant at rated speed below which nothing is trusted, and below which a wide uncertainty is the
/// encoder's fault: on harsh motors 50 are enough, 20 leave 18 % at worst, 10 fail.
const LEAST_COUNTS: u64 = 20;
const FINE_COUNTS: u64 = 50;
/// Unknowns of one direction: γ, β, α; δ is settled by the steps.
const UNKNOWNS: u32 = 3;
/// Least span of speeds used in a direction, in 1/1024 of rated speed: 15 %.
const SPAN_1024: i64 = 154;
/// The same where the dead zone is at the input: 8 %.
const SPAN_INPUT_1024: i64 = 82;
/// Least speed that ordinary motion must have reached, in 1/1024 of the no-load speed that was identified: 13 %. At 10 %
/// u95 does not cover what Stribeck friction does any more.
const FASTEST_1024: i64 = 133;
/// Largest mean residual of the verification, Q20 of nominal: 1.2 %.
pub const VERIFY_LIMIT: i32 = 12_583;
/// The same as a share of the dead zone, in 1/1024: 9 %. A load that steps by a tenth of a dead zone shows there; drag
/// and random torque leave 98 of 100 directions below.
const VERIFY_SHARE_1024: i32 = 92;

/// Mean residual of the verification windows of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Check {
    sum: i64,
    windows: u32,
}

impl Check {
    /// Notes the residual of one window, Q20 of nominal.
    pub fn note(&mut self, residual: i32) {
        self.sum = self.sum.wrapping_add(i64::from(residual));
        self.windows = self.windows.saturating_add(1);
    }

    /// Windows noted.
    pub fn windows(&self) -> u32 {
        self.windows
    }

    /// Forgets the older half beyond `most` windows.
    pub fn keep(&mut self, most: u32) {
        if self.windows >= most {
            self.windows /= 2;
            self.sum >>= 1;
        }
    }

    /// Mean, Q20 of nominal; `None` without windows.
    pub fn mean(&self) -> Option<i32> {
        // |sum| < 2³¹ · windows; the hardware divides 32 bits only, so both are halved until they fit.
        let shift = 33u32.saturating_sub(self.sum.unsigned_abs().leading_zeros());
        let windows = (self.windows >> shift) as i32;
        (windows > 0).then(|| (self.sum >> shift) as i32 / windows)
    }
}

/// How the speeds of the rows came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Excitation {
    /// They were chosen: a span of them is demanded.
    Chosen,
    /// Whatever the motion was: the line is drawn on from the slowest of them to zero, and what the model errs between
    /// slowest and fastest errs more there the shorter the span is.
    Ordinary,
}

/// What is decided in one call: a number, or the same number of one direction. Later ones build on earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Dead zone of a direction and its half width.
    DeadZone(Direction),
    /// Whether that is trusted.
    Trust(Direction),
    /// Gain and its difference between the directions.
    Gain,
    /// Time constant and mechanism.
    TimeConstant,
}

impl Part {
    /// All of them in their order, the saturation apart.
    pub const ALL: [Part; 6] = [
        Part::DeadZone(Direction::Positive),
        Part::Trust(Direction::Positive),
        Part::DeadZone(Direction::Negative),
        Part::Trust(Direction::Negative),
        Part::Gain,
        Part::TimeConstant,
    ];
}

/// Evidence beside the solution.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// Rows that the solution rests on: per direction, all sets that count together.
    pub sums: &'a [&'a [Sums; 2]],
    /// Disagreement of the time slices per direction.
    pub spread: &'a [Spread; 2],
    /// Verification per direction.
    pub checks: &'a [Check; 2],
    /// Friction or input dead zone.
    pub mechanism: Mechanism,
    /// The supply is measured, so that the voltage at the terminals is known.
    pub supply_measured: bool,
    /// Travel cut the excitation short.
    pub short_of_travel: bool,
    /// Voltages that the starts took, per direction, Q14 of nominal; 0: not seen.
    pub starts: &'a [i32; 2],
    /// How the speeds came about.
    pub excitation: Excitation,
}

impl Params {
    /// Decides one part of the estimates: a few divisions and roots in software, short enough for one tick.
    #[cold]
    #[inline(never)]
    pub fn decide(
        &self,
        part: Part,
        estimates: &mut Estimates,
        lengths: &Lengths,
        solution: &Solution,
        evidence: &Evidence,
    ) {
        match part {
            Part::DeadZone(direction) => {
                estimates.dead_zone[direction] = dead_zone(solution, evidence, direction);
            }
            Part::Trust(direction) => {
                let found = estimates.dead_zone[direction];
                let doubt = self.doubt(lengths, solution, evidence, direction, &found);
                let dead_zone = &mut estimates.dead_zone[direction];
                dead_zone.standing = doubt.map_or(Standing::Trusted, Standing::Doubtful);
                if doubt == Some(Reason::StartsHigher) {
                    // Its interval reaches up to where the shaft starts.
                    dead_zone.u95 = (evidence.starts[direction] << 6).saturating_sub(found.value);
                }
            }
            Part::Gain => {
                let pushed = estimates.dead_zone.iter().any(|side| side.value < 0);
                if pushed || evidence.excitation == Excitation::Chosen {
                    share_doubt(&mut estimates.dead_zone);
                }
                estimates.gain_skew = gain_skew(solution);
                estimates.gain = self.gain(lengths, solution, evidence, standing(estimates));
                contradict(estimates, evidence.excitation == Excitation::Chosen);
            }
            Part::TimeConstant => {
                estimates.mechanism = evidence.mechanism;
                let standing = worse(standing(estimates), estimates.gain.standing);
                estimates.time_constant = self.time_constant(lengths, solution, evidence, standing);
            }
        }
    }

    /// Why a dead zone is not trusted, which [`dead_zone`] has found.
    fn doubt(
        &self,
        lengths: &Lengths,
        solution: &Solution,
        evidence: &Evidence,
        direction: Direction,
        found: &Estimate,
    ) -> Option<Reason> {
        let (value, uncertain) = (found.value, found.reason());
        let coarse = |least| self.counts_per_time_constant(lengths, solution).below(Positive::new(least, 0));
        let verify_limit = match evidence.excitation {
            Excitation::Chosen => VERIFY_LIMIT.min(share(value, VERIFY_SHARE_1024)),
            Excitation::Ordinary => VERIFY_LIMIT,
        };
        match evidence.checks[direction].mean() {
            _ if coarse(LEAST_COUNTS) || uncertain.is_some() && coarse(FINE_COUNTS) => {
                Some(Reason::EncoderTooSlow)
            }
            _ if value <= 0 => Some(Reason::Implausible),
            _ if uncertain.is_some() => uncertain,
            _ if !self.spans(lengths, solution, evidence, direction) => Some(Reason::NotExcited),
            None if evidence.short_of_travel => Some(Reason::TravelTooShort),
            None => Some(Reason::NotVerified),
            Some(mean) if mean.saturating_abs() > verify_limit => Some(Reason::LoadChanged),
            Some(_) if starts_higher(evidence.starts[direction], value) => Some(Reason::StartsHigher),
            Some(_) => None,
        }
    }

    /// Encoder counts in one time constant at rated speed.
    fn counts_per_time_constant(&self, lengths: &Lengths, solution: &Solution) -> Positive {
        let rated = Positive::of(self.rated_speed(lengths), ROW_FRAC);
        solution.time_constant.times(rated).shifted(lengths.counts as i32)
    }

    /// Did the rows used cover enough speed? At low speed friction bends the line; an input dead zone does not.
    fn spans(
        &self,
        lengths: &Lengths,
        solution: &Solution,
        evidence: &Evidence,
        direction: Direction,
    ) -> bool {
        let (slowest, fastest) = speeds(evidence, direction);
        let rated = self.rated_speed(lengths);
        let (reached, whole, least) = match (evidence.excitation, evidence.mechanism) {
            (Excitation::Ordinary, _) => (fastest, solution.gain.to_q(ROW_FRAC), FASTEST_1024),
            (Excitation::Chosen, Mechanism::InputDeadZone) => {
                (fastest.saturating_sub(slowest), rated, SPAN_INPUT_1024)
            }
            (Excitation::Chosen, _) => (fastest.saturating_sub(slowest), rated, SPAN_1024),
        };
        i64::from(reached) * 1024 >= i64::from(whole) * least
    }

    fn gain(
        &self,
        lengths: &Lengths,
        solution: &Solution,
        evidence: &Evidence,
        standing: Standing,
    ) -> Estimate {
        let rated = Positive::of(self.rated_speed(lengths), ROW_FRAC);
        let value = solution.gain.over(rated).to_q(GAIN_FRAC);
        let u95 = half_width(value, solution.gain_sigma, linear_error(evidence));
        linear(value, u95, evidence.excitation, standing)
    }

    fn time_constant(
        &self,
        lengths: &Lengths,
        solution: &Solution,
        evidence: &Evidence,
        standing: Standing,
    ) -> Estimate {
        let block = Positive::new(u64::from(self.block_ticks(lengths)), 0);
        let value = solution.time_constant.times(block).to_q(TIME_FRAC);
        let u95 = half_width(value, solution.time_constant_sigma, linear_error(evidence));
        linear(value, u95, evidence.excitation, standing)
    }
}

/// The first of two doubts.
fn worse(first: Standing, second: Standing) -> Standing {
    if first == Standing::Trusted { second } else { first }
}

/// Dead zone of a direction, and whether its half width lets it be trusted.
fn dead_zone(solution: &Solution, evidence: &Evidence, direction: Direction) -> Estimate {
    let value = solution.dead_zone[direction];
    let blind = if evidence.supply_measured { 0 } else { BLIND_ERROR_1024 };
    let model = model_error(evidence, direction) + blind;
    let inflation = evidence.spread[direction].inflation(solution.row_variance, UNKNOWNS).sqrt();
    let plain = solution.dead_zone_sigma[direction];
    let sigma = Positive::of(plain, VOLTAGE_FRAC).times(inflation).to_q(VOLTAGE_FRAC);
    let half_width =
        |sigma: i32| sigma.saturating_mul(2).saturating_add(share(value.saturating_abs(), model));
    let (limit, u95) = (share(value, TRUST_LIMIT_1024), half_width(sigma));
    let standing = if u95 <= limit {
        Standing::Trusted
    } else if half_width(plain) <= limit {
        // The time slices alone make it so.
        Standing::Doubtful(Reason::LoadChanged)
    } else {
        Standing::Doubtful(Reason::TooUncertain)
    };
    Estimate { value, u95, standing }
}

/// Gain or time constant: trusted with the dead zones; in ordinary motion it must be certain enough by itself.
fn linear(value: i32, u95: i32, excitation: Excitation, standing: Standing) -> Estimate {
    let uncertain = excitation == Excitation::Ordinary && u95 > share(value, TRUST_LIMIT_1024);
    let standing = match standing {
        Standing::Trusted if uncertain => Standing::Doubtful(Reason::TooUncertain),
        other => other,
    };
    Estimate { value, u95, standing }
}

/// (β₊ − β₋)/(β₊ + β₋), Q20.
fn gain_skew(solution: &Solution) -> i32 {
    let [positive, negative] = solution.coefficients.map(|c| c.beta);
    let sum = Positive::of(positive, 0).plus(Positive::of(negative, 0));
    let skew = Positive::of(positive.saturating_sub(negative), 0).over(sum).to_q(GAIN_FRAC);
    if positive < negative { -skew } else { skew }
}

/// A load that moves acts in both directions: where one of them has seen it, or has become uncertain by it, the other was
/// merely lucky. A joint under gravity shows so. And where no voltage is needed to one side, what is needed to the other one is a
/// constant load or an offset of the drive, which does not end when the motion turns back.
fn share_doubt(dead_zones: &mut [Estimate; 2]) {
    let doubt = |estimate: &Estimate| {
        let reason = estimate.reason()?;
        matches!(reason, Reason::LoadChanged | Reason::TooUncertain | Reason::Implausible).then_some(reason)
    };
    let Some(reason) = dead_zones.iter().find_map(doubt) else {
        return;
    };
    for estimate in dead_zones {
        if estimate.standing == Standing::Trusted {
            estimate.standing = Standing::Doubtful(reason);
        }
    }
}

/// Gain, time constant and saturation are trusted with the dead zones of both directions.
fn standing(estimates: &Estimates) -> Standing {
    match estimates.dead_zone.iter().find_map(Estimate::reason) {
        Some(reason) => Standing::Doubtful(reason),
        None => Standing::Trusted,
    }
}

/// The saturation of a direction whose dead zone is decided. An excess within the half width of the voltage that a motion
/// needs and the margin is no saturation.
pub fn saturation(
    seen: &saturation::Seen,
    direction: Direction,
    estimates: &Estimates,
    short_of_travel: bool,
) -> Estimate {
    let (needed_u95, standing) = (estimates.dead_zone[direction].u95, standing(estimates));
    match seen.level {
        Some(value) if seen.excess > saturation::MARGIN.saturating_add(needed_u95) => {
            let u95 = share(value, SATURATION_ERROR_1024).saturating_add(seen.deviation);
            Estimate { value, u95, standing }
        }
        _ if seen.tested => Estimate::missing(Reason::NotSeen),
        _ if short_of_travel => Estimate::missing(Reason::TravelTooShort),
        _ => Estimate::missing(Reason::NotExcited),
    }
}

/// Slowest and fastest speed of the rows of a direction, Q20 of W₀.
fn speeds(evidence: &Evidence, direction: Direction) -> (i32, i32) {
    let sums = evidence.sums.iter().map(|set| &set[direction]);
    sums.fold((i32::MAX, 0), |(slowest, fastest), sums| {
        (slowest.min(sums.slowest), fastest.max(sums.fastest))
    })
}

/// Share of a dead zone that the model may err by, in 1/1024: in ordinary motion half as much again for every span
/// that the slowest row is away from zero.
fn model_error(evidence: &Evidence, direction: Direction) -> i32 {
    let (slowest, fastest) = speeds(evidence, direction);
    let spans = match evidence.excitation {
        Excitation::Chosen => 0,
        Excitation::Ordinary if fastest <= slowest => return 1024,
        Excitation::Ordinary => {
            slowest.min(i32::MAX >> 5).saturating_mul(32) / fastest.saturating_sub(slowest)
        }
    };
    MODEL_ERROR_1024.saturating_add((MODEL_ERROR_1024 / 2).saturating_mul(spans) / 32)
}

/// The same for gain and time constant.
fn linear_error(evidence: &Evidence) -> i32 {
    model_error(evidence, Direction::Positive).max(model_error(evidence, Direction::Negative))
}

fn half_width(value: i32, relative_sigma: i32, model: i32) -> i32 {
    let sigma = (i64::from(value) * i64::from(relative_sigma)) >> (RELATIVE_FRAC - 1);
    (sigma.clamp(0, i64::from(i32::MAX)) as i32).saturating_add(share(value, model))
}
