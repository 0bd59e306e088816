//! What the log of a case holds: the truth through imperfect sensors.

use super::base::{Natural, log_range};
use super::hidden::Subject;
use super::sheet::Sheet;
use super::{Spec, protocol};
use crate::synthetic::reference_plant::noise::GaussMarkov;
use crate::synthetic::reference_plant::record::{Row, Truth, Window, simulate};
use crate::synthetic::reference_plant::{Command, Encoder, Simulator};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::Bridge;
use std::f64::consts::TAU;
use truing_core::outcome::Segment;

/// Error of one step of the truth, relative to full scale. The smallest noise is 1e-3; errors of steps die away with the
/// motor's own time constant, so that about fifty of them add up.
const TOLERANCE: f64 = 1e-7;
/// Rows per mechanical time constant.
pub const ROWS_PER_TAU: usize = 50;

/// Where the speed comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpeedFrom {
    /// A tacho: the speed at the row, with noise of its own.
    Tacho,
    /// Difference of encoder counts over so many rows.
    Encoder {
        /// Window in rows.
        rows: usize,
        /// Ends at the row; else centred.
        causal: bool,
    },
}

/// Sensors of one case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Where the speed comes from.
    pub speed: SpeedFrom,
    /// Rms of the tacho's noise, rad/s; for the encoder what its resolution is chosen for.
    pub sigma: f64,
    /// AR(1) coefficient of the noise.
    pub colour: f64,
    /// Share of rows with a spike of 15 σ.
    pub spikes: f64,
    /// The clamp of the tacho comes after its noise.
    pub clamps_noise: bool,
    /// Encoder, counts per turn.
    pub counts_per_rev: u32,
    /// True if the current is logged; rms of its noise, A.
    pub current: Option<f64>,
    /// Sample interval, s.
    pub interval_s: f64,
}

impl Sensors {
    /// Draws the sensors. `tacho`: the speed must come from a tacho. `dirty`: coloured noise with spikes.
    pub fn draw(rng: &mut ChaCha8Rng, natural: &Natural, tacho: bool, dirty: bool, spec: &Spec) -> Self {
        let drawn = log_range(rng, 0.001, 0.01);
        let sigma = spec.noise.unwrap_or(drawn) * natural.speed;
        let interval_s = truing_core::text::figures::rounded(natural.tau / ROWS_PER_TAU as f64, 3);
        let from_encoder = rng.random_bool(0.35) && !tacho && !dirty;
        let rows = 2 * rng.random_range(1..=4usize);
        let causal = rng.random_bool(0.4);
        // A difference of two counts over a window w has an rms error of a count over √6 · w.
        let for_noise = (TAU / (sigma * rows as f64 * interval_s * 6.0_f64.sqrt())).clamp(8.0, 1e6) as u32;
        let fine = 4 * rng.random_range(128..=2048u32);
        let logged = spec.current.unwrap_or_else(|| rng.random_bool(0.3));
        let current_noise = log_range(rng, 0.003, 0.01) * natural.current;
        Self {
            speed: if from_encoder { SpeedFrom::Encoder { rows, causal } } else { SpeedFrom::Tacho },
            sigma,
            colour: if dirty { 0.6 } else { 0.0 },
            spikes: if dirty { 0.003 } else { 0.0 },
            clamps_noise: rng.random_bool(0.5),
            counts_per_rev: if from_encoder { for_noise } else { fine },
            current: logged.then_some(current_noise),
            interval_s,
        }
    }

    fn window(&self) -> Window {
        match self.speed {
            // Short against everything that moves: the mean over a tenth of a row is the speed at the row.
            SpeedFrom::Tacho => Window { seconds: 0.1 * self.interval_s, causal: false },
            SpeedFrom::Encoder { rows, causal } => Window { seconds: rows as f64 * self.interval_s, causal },
        }
    }

    /// `[encoder]` and `[sensors]` of the model file.
    pub fn describe(&self, at_load: bool) -> String {
        let side = if at_load { "load" } else { "motor" };
        let (speed, window) = match self.speed {
            SpeedFrom::Tacho => ("analog_tacho", 0.0),
            SpeedFrom::Encoder { causal: true, .. } => ("encoder_difference_causal", self.window().seconds),
            SpeedFrom::Encoder { .. } => ("encoder_difference_centred", self.window().seconds),
        };
        format!(
            "[encoder]\ncounts_per_rev = {}\nside = \"{side}\"\n[sensors]\nspeed = \"{speed}\"\nspeed_window_s = {window}\ncurrent_logged = {}\n",
            self.counts_per_rev,
            self.current.is_some()
        )
    }
}

/// An input, to be simulated with several subjects.
#[derive(Clone, Debug)]
pub struct Input {
    rows: Vec<protocol::Row>,
    volts: f64,
    interval_s: f64,
}

impl Input {
    /// Draws an excitation of so many rows.
    pub fn draw(
        rng: &mut ChaCha8Rng,
        natural: &Natural,
        sensors: &Sensors,
        rows: usize,
        coast: bool,
    ) -> Self {
        let rows = protocol::draw(rng, rows, ROWS_PER_TAU, coast);
        Self { rows, volts: natural.volts, interval_s: sensors.interval_s }
    }

    /// The input of a suggested experiment.
    pub fn of_profile(profile: &[Segment], volts: f64, interval_s: f64) -> Self {
        let piece = |segment: &Segment| {
            let rows = (segment.seconds / interval_s).round().max(1.0) as usize;
            std::iter::repeat_n((segment.u_v.unwrap_or(0.0) / volts, segment.bridge), rows)
        };
        Self { rows: profile.iter().flat_map(piece).collect(), volts, interval_s }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    fn voltage(&self, row: protocol::Row) -> f64 {
        // Four decimals: what a command would carry.
        (row.0 * self.volts * 1e4).round() / 1e4
    }

    /// The subject's true answer.
    pub fn simulate(&self, subject: &Subject, sensors: &Sensors, seed: u64) -> Truth {
        let mut simulator = Simulator::new(subject.motor.clone(), TOLERANCE, seed);
        let row = |(k, &row): (usize, &protocol::Row)| Row {
            t: k as f64 * self.interval_s,
            command: Command::Volts(self.voltage(row)),
            bridge: row.1,
        };
        let rows: Vec<Row> = self.rows.iter().enumerate().map(row).collect();
        let mut truth = simulate(&mut simulator, &rows, sensors.window(), subject.encoder_at_load);
        for value in &mut truth.seen {
            *value = *value * subject.reading_scale + subject.reading_offset;
        }
        truth
    }

    /// The log of a truth. Speed, as a sensor without noise would report it, is `truth.seen`.
    pub fn measure(
        &self,
        truth: &Truth,
        subject: &Subject,
        sensors: &Sensors,
        run: Option<u32>,
        seed: u64,
    ) -> Sheet {
        let mut sheet = Sheet::default();
        if let Some(run) = run {
            sheet.add("run", vec![f64::from(run); self.rows.len()]);
        }
        sheet.add("t_s", (0..self.rows.len()).map(|k| k as f64 * self.interval_s).collect());
        sheet.add("u_v", self.rows.iter().map(|&row| self.voltage(row)).collect());
        if self.rows.iter().any(|row| row.1 == Bridge::Open) {
            sheet.add("bridge", self.rows.iter().map(|row| f64::from(row.1 as u8)).collect());
        }
        let rad_per_count = TAU / f64::from(sensors.counts_per_rev) * subject.reading_scale;
        // The encoder's zero lies anywhere within a count.
        let start =
            ChaCha8Rng::seed_from_u64(seed).random_range(0.0..1.0) * TAU / f64::from(sensors.counts_per_rev);
        let count = |angle: f64| {
            let mut encoder = Encoder::new(sensors.counts_per_rev, 0.0, 0);
            encoder.count(angle + start) as f64
        };
        sheet.add("theta_rad", truth.theta.iter().map(|&angle| count(angle) * rad_per_count).collect());
        let omega = match sensors.speed {
            SpeedFrom::Tacho => noisy(&truth.seen, subject, sensors, seed),
            SpeedFrom::Encoder { .. } => {
                let per_second = rad_per_count / sensors.window().seconds;
                let ends = truth.opened.iter().zip(&truth.closed);
                ends.map(|(&opened, &closed)| (count(closed) - count(opened)) * per_second).collect()
            }
        };
        sheet.add("omega_rad_s", omega);
        if let Some(rms) = sensors.current {
            let mut noise = GaussMarkov::new(rms, 0.0, seed ^ 0xc0);
            sheet.add("i_a", truth.current.iter().map(|i| i + noise.next_value()).collect());
        }
        sheet
    }
}

/// The tacho's reading.
fn noisy(seen: &[f64], subject: &Subject, sensors: &Sensors, seed: u64) -> Vec<f64> {
    let mut noise = GaussMarkov::new(sensors.sigma, sensors.colour, seed ^ 0x7ac0);
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5b1c);
    let limit = subject.motor.tacho.map_or(f64::INFINITY, |tacho| tacho.limit_rad_s);
    // What converts the reading scales and shifts the tacho's clamp with it.
    let edge = |limit: f64| limit * subject.reading_scale + subject.reading_offset;
    let clamp = |reading: f64| {
        if sensors.clamps_noise { reading.clamp(edge(-limit), edge(limit)) } else { reading }
    };
    seen.iter()
        .map(|&value| {
            let spike = if sensors.spikes > 0.0 && rng.random_bool(sensors.spikes) {
                sensors.sigma * if rng.random_bool(0.5) { 15.0 } else { -15.0 }
            } else {
                0.0
            };
            clamp(value + noise.next_value() + spike)
        })
        .collect()
}
