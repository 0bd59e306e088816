//! One commissioning of one plant, and how far its outcome lies from the truth.

use crate::bench::Board;
use crate::families::{Cause, Plant};
use servo::axis::{Bridge, Sample};
use servo::commission::{CommissionReport, Input, Outcome, Params, State};
use servo::config::Scale;
use servo::identify::estimate::{Mechanism, Reported};
use servo::units::VoltageQ14;

/// The outcome in the chip's integers, and the scale that gives them meaning.
///
/// # Panics
/// If the library refuses the plant's configuration.
pub fn commission_outcome(plant: &Plant, budget_s: f64, seed: u32) -> (Outcome, Scale) {
    run(plant, budget_s, seed, &mut |_, _| {})
}

/// Commissions `plant` within `budget_s`; `watch` sees every tick.
///
/// # Panics
/// If the library refuses the plant's configuration.
pub fn commission(
    plant: &Plant,
    budget_s: f64,
    seed: u32,
    mut watch: impl FnMut(&State, &Input),
) -> CommissionReport {
    let (outcome, scale) = run(plant, budget_s, seed, &mut watch);
    outcome.report(&scale)
}

fn run(plant: &Plant, budget_s: f64, seed: u32, watch: &mut dyn FnMut(&State, &Input)) -> (Outcome, Scale) {
    let scale = plant.config.build().unwrap_or_else(|error| panic!("{error:?}: {:?}", plant.config));
    let params = Params::new(&scale, (budget_s * 1000.0) as u32, seed);
    let mut board = Board::new(plant);
    let mut acting = [(Bridge::Open, 0i16); 2];
    let mut state = None;
    loop {
        let sample = board.sample();
        let state = state.get_or_insert_with(|| State::new(&params, sample.count));
        let (bridge, duty) = acting[0];
        let input = input(&scale, &sample, bridge, duty);
        let request = params.step(state, &input);
        watch(state, &input);
        if let Some(&outcome) = state.outcome() {
            return (outcome, scale);
        }
        let duty = duty_for(&scale, request.voltage.0, input.supply.unwrap_or(VoltageQ14::NOMINAL).0);
        acting = [(request.bridge, duty), acting[0]];
        board.pass(request.bridge, duty);
    }
}

/// What the axis would hand over.
fn input(scale: &Scale, sample: &Sample, bridge: Bridge, duty: i16) -> Input {
    let supply = scale.supply.voltage(sample.vbus_raw);
    let full = i32::from(scale.config.pwm_full_scale as i16);
    Input {
        count: sample.count,
        voltage: VoltageQ14((i32::from(duty) * supply.0 + full / 2).div_euclid(full)),
        load: VoltageQ14(0),
        bridge,
        supply: (sample.vbus_raw != Sample::VBUS_NOT_MEASURED).then_some(supply),
        current_raw: Sample::sensed(sample.current_raw),
    }
}

/// Divided by the measured supply and clipped, as the axis does.
fn duty_for(scale: &Scale, voltage: i32, supply: i32) -> i16 {
    let full = i64::from(scale.config.pwm_full_scale);
    let duty = i64::from(voltage) * full / i64::from(supply.max(1));
    duty.clamp(-full, full) as i16
}

/// Relative errors in %, and what was claimed about them.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// Refused, with this code.
    pub refused: Option<&'static str>,
    /// Dead zone, per direction, signed.
    pub dead_zone: Vec<f64>,
    /// Its claimed half width, % of the truth.
    pub u95: Vec<f64>,
    /// The truth lies within the half width.
    pub covered: Vec<bool>,
    /// Per direction: trusted.
    pub trusted: Vec<bool>,
    /// Gain.
    pub gain: Option<f64>,
    /// Time constant.
    pub time_constant: Option<f64>,
    /// Saturation, where there is one and it was seen.
    pub saturation: Vec<f64>,
    /// Saturations that exist below the supply and were not seen.
    pub unseen: usize,
    /// Saturations that were claimed and do not exist.
    pub invented: usize,
    /// The mechanism: right, wrong, unclear.
    pub mechanism: Option<bool>,
    /// Reason of the first doubtful dead zone.
    pub doubt: Option<&'static str>,
}

impl Score {
    /// Compares.
    pub fn of(plant: &Plant, report: &CommissionReport) -> Self {
        let mut score = Score { refused: report.refused.map(|reason| reason.code()), ..Score::default() };
        if report.refused.is_some() {
            return score;
        }
        let (truth, found) = (&plant.truth, &report.estimates);
        for (side, value) in [found.dead_zone_pos_v, found.dead_zone_neg_v].iter().enumerate() {
            score.note_dead_zone(truth.dead_zone_v[side], value);
        }
        for (side, value) in [found.saturation_pos_v, found.saturation_neg_v].iter().enumerate() {
            match (truth.saturation_v[side], value.value) {
                (Some(level), Some(value)) => score.saturation.push(percent(f64::from(value), level)),
                (Some(_), None) => score.unseen += 1,
                (None, Some(_)) => score.invented += 1,
                (None, None) => {}
            }
        }
        score.gain = found.gain_rad_s_per_v.value.map(|value| percent(f64::from(value), truth.gain));
        score.time_constant =
            found.time_constant_s.value.map(|value| percent(f64::from(value), truth.time_constant_s));
        score.mechanism = match (found.mechanism, truth.cause) {
            (Mechanism::Unclear, _) => None,
            (Mechanism::Friction, cause) => Some(cause == Cause::Friction),
            (Mechanism::InputDeadZone, cause) => Some(cause == Cause::Input),
            (Mechanism::VoltageDrop, _) => Some(false),
        };
        score
    }

    fn note_dead_zone(&mut self, truth: f64, found: &Reported) {
        let Some(value) = found.value.map(f64::from) else {
            return;
        };
        let u95 = found.u95.map_or(0.0, f64::from);
        self.dead_zone.push(percent(value, truth));
        self.u95.push(100.0 * u95 / truth);
        self.covered.push((value - truth).abs() <= u95);
        self.trusted.push(found.trusted);
        if let (None, Some(reason)) = (self.doubt, found.reason) {
            self.doubt = Some(reason.code());
        }
    }

    /// Both directions trusted.
    pub fn all_trusted(&self) -> bool {
        self.trusted.len() == 2 && self.trusted.iter().all(|&trusted| trusted)
    }

    /// Trusted and more than `limit` % wrong.
    pub fn false_trust(&self, limit: f64) -> bool {
        self.dead_zone.iter().zip(&self.trusted).any(|(error, &trusted)| trusted && error.abs() > limit)
    }
}

fn percent(value: f64, truth: f64) -> f64 {
    100.0 * (value / truth - 1.0)
}

/// Median, 95th percentile and worst of the magnitudes.
pub fn quantiles(values: impl IntoIterator<Item = f64>) -> [f64; 3] {
    let mut magnitudes: Vec<f64> = values.into_iter().map(f64::abs).collect();
    magnitudes.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = share * (magnitudes.len().saturating_sub(1)) as f64;
        magnitudes.get(index.round() as usize).copied().unwrap_or(f64::NAN)
    };
    [at(0.5), at(0.95), at(1.0)]
}
