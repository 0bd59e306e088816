//! A recording that tells effects apart: planned from what is known of a motor, run on a servo, kept as one log.

mod drive;
mod scale;
mod segment;
mod watch;

pub use drive::{Recorded, run};
pub use scale::Scale;
pub use segment::{Part, Segment};

use rand::{RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use servo::config::Config;
use servo::identify::estimate::Estimates;
use std::fmt::Write as _;
use truing_core::text::input_error::InputError;
use truing_servo::device::link::range_text;

/// A motor whose time constant is no longer than 0.15 s is recorded within this time, s.
pub const BUDGET_S: f64 = 25.0;
/// Amplitudes are drawn within this share around their middle.
const SPREAD: f64 = 0.1;
/// Slow segments are made again so far from the middle, as a share of the way to an end stop: a weight pulls otherwise there. Chosen by
/// judgement; not studied.
const POSES: [(&str, f64); 2] = [("triangle", 0.5), ("crawl", -0.5)];
/// Going to where a segment begins takes so long at most, s.
pub(crate) const RETURN_S: f64 = 1.5;

/// What a recording must stay within beside the limits of the axis file. `None`: the axis file alone decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Length, s; by default [`BUDGET_S`], more for a slow motor.
    pub budget_s: Option<f64>,
    /// Travel to each side of the start, rad at the joint.
    pub travel_rad: Option<f64>,
    /// Electrical energy, J; it needs a current sensor.
    pub energy_j: Option<f64>,
}

/// What a recording does.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What order and amplitudes were drawn from.
    pub seed: u64,
    /// In the order of time.
    pub segments: Vec<Segment>,
    /// Length, s.
    pub seconds: f64,
    /// Limit of the travel to each side of the start, rad at the controlled shaft.
    pub travel_rad: Option<f64>,
    /// End stops of the axis file, rad at the controlled shaft from power-up.
    pub stops_rad: Option<[f64; 2]>,
    /// Limit of the electrical energy, J.
    pub energy_j: Option<f64>,
    /// What voltages and times were scaled by.
    pub scale: Scale,
    /// What protection knows of the motor meanwhile: a dead zone that it does not know looks like a shaft that is held. Not the saturation,
    /// which bounds what the servo drives.
    pub known: Estimates,
}

impl Plan {
    /// Every input twice, the first one once more at the end.
    ///
    /// # Errors
    /// The time constant is not known, or travel or budget are too short.
    pub fn new(
        config: &Config,
        known: Option<&Estimates>,
        limits: &Limits,
        seed: u64,
    ) -> Result<Self, InputError> {
        let gear = f64::from(config.gear_ratio);
        let stops_rad = config.travel_limit_rad.map(|stops| stops.map(|stop| f64::from(stop) * gear));
        let between = stops_rad.map(|[lower, upper]| upper.min(-lower));
        let asked = limits.travel_rad.map(|travel| travel * gear);
        let travel_rad = between.into_iter().chain(asked).reduce(f64::min);
        let own = config.energy_limit_j.get().map(f64::from);
        let energy_j = own.into_iter().chain(limits.energy_j).reduce(f64::min);
        let units = config.build().map_err(|error| InputError(range_text(&error)))?;
        let scale = Scale::new(config, known.map(|known| known.report(&units)).as_ref(), travel_rad)?;
        let known = Estimates { saturation: Default::default(), ..known.copied().unwrap_or_default() };
        let (segments, seconds) = (Vec::new(), 0.0);
        let plan = Self { seed, segments, seconds, travel_rad, stops_rad, energy_j, scale, known };
        plan.with(plan.shuffled()).within(limits.budget_s)
    }

    /// The same motor and limits with other segments, for an experiment that tells two effects apart.
    #[must_use]
    pub fn with(&self, segments: Vec<Segment>) -> Self {
        let returns = self.travel_rad.map_or(0.0, |_| RETURN_S) * segments.len() as f64;
        let seconds = segments.iter().map(Segment::seconds).sum::<f64>() + returns + self.scale.tau_s;
        Self { segments, seconds, ..self.clone() }
    }

    /// Shortens the segments until they fit.
    fn within(mut self, budget_s: Option<f64>) -> Result<Self, InputError> {
        let Some(budget) = budget_s else { return Ok(self) };
        let (least, asked) = (0.5 * self.scale.unit_s, self.seconds);
        for _ in 0..4 {
            if self.seconds > budget {
                self.scale.unit_s *= 0.98 * budget / self.seconds;
                self = self.with(self.shuffled());
            }
        }
        if self.scale.unit_s >= least && self.seconds <= budget {
            return Ok(self);
        }
        Err(InputError(format!(
            "--budget-s is {budget}; a motor with this time constant is recorded in {asked:.0} s, and in half of that at least"
        )))
    }

    /// Order and amplitudes from the seed.
    fn shuffled(&self) -> Vec<Segment> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut share = |middle: f64| {
            let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
            sign * middle * random.random_range(1.0 - SPREAD..=1.0 + SPREAD)
        };
        let scale = &self.scale;
        let first = Segment::triangle(scale, share(0.25));
        let mut rest = vec![
            // Full scale is reached in every recording: what is not seen there is not there.
            Segment::staircase(scale, share(1.0).signum()),
            Segment::coast_downs(scale, share(0.75)),
            Segment::reversals(scale, share(0.8)),
            Segment::chirp(scale, share(0.4)),
            Segment::crawl(scale, share(0.15)),
        ];
        rest.shuffle(&mut random);
        let pass: Vec<Segment> = std::iter::once(first.clone()).chain(rest).collect();
        [pass.clone(), pass, vec![first]].concat()
    }

    /// Where between end stops a segment begins: 0 in the middle, ±1 at a stop.
    fn pose(&self, place: usize) -> f64 {
        let again = self.segments.len() / 2..self.segments.len() - 1;
        let segment = self.segments.get(place).filter(|_| again.contains(&place));
        let pose = |segment: &Segment| POSES.iter().find(|(slow, _)| *slow == segment.name);
        segment.and_then(pose).map_or(0.0, |(_, pose)| *pose)
    }

    /// The plan for people.
    pub fn text(&self) -> String {
        let Scale { tau_s, gain, most_v, .. } = self.scale;
        let mut text = format!(
            "{:21} {:.1} s, seed {}\n{:21} time constant {tau_s:.3} s, {gain:.2} rad/s per V, at most {most_v:.2} V\n",
            "recording", self.seconds, self.seed, "scaled by"
        );
        let room = |travel| format!("{travel:.3} rad to each side of the start, kept by the host");
        let far = |way| format!("free, about {way:.0} rad to and fro in all");
        let travel = self.travel_rad.map_or_else(|| far(self.way_rad()), room);
        let _ = writeln!(text, "{:21} {travel}", "travel");
        if let Some(limit) = self.energy_j {
            let _ = writeln!(text, "{:21} at most {limit} J, by voltage and measured current", "energy");
        }
        for segment in &self.segments {
            let (seconds, most) = (segment.seconds(), segment.most_v());
            let _ = writeln!(text, "{:21} {seconds:6.2} s  up to {most:6.2} V", segment.name);
        }
        text
    }

    /// About how far a free shaft turns to and fro, rad.
    pub fn way_rad(&self) -> f64 {
        let parts = self.segments.iter().flat_map(|segment| &segment.parts);
        let way = |part: &Part| match part {
            Part::Drive { from_v, to_v, seconds } => 0.5 * (from_v.abs() + to_v.abs()) * seconds,
            // A chirp is mostly above the corner of the motor.
            Part::Chirp(_) => 0.3 * part.most_v() * part.seconds(),
            Part::Open { .. } => 0.0,
        };
        self.scale.gain * parts.map(way).sum::<f64>()
    }
}
