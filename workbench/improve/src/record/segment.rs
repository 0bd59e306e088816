//! What a recording is made of: stretches of voltage, each of which tells some effects apart.
//!
//! | segment | what it tells apart |
//! |---|---|
//! | slow triangle | break-away, dead zone, the friction that falls with speed |
//! | staircase | the slope of speed over voltage, its knee, a supply that sags |
//! | coast-downs | friction without the electrical side: a dead zone of the drive does not act then |
//! | square reversals | dry friction from a dead zone, play, delay, a current limit |
//! | chirp | inertia, inductance, lags, delay |
//! | crawl | cogging, gravity, eccentric loads |

use super::scale::Scale;
use servo::motion::excitation::{Sweep, Waveform};

/// A stretch of time with one kind of input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// The voltage goes from one value to the other, evenly; a level where both are the same.
    Drive {
        /// At the beginning, V.
        from_v: f64,
        /// At the end, V.
        to_v: f64,
        /// Length, s.
        seconds: f64,
    },
    /// The bridge is open.
    Open {
        /// Length, s.
        seconds: f64,
    },
    /// The servo plays a chirp by itself.
    Chirp(Waveform),
}

impl Part {
    /// Length, s.
    pub fn seconds(&self) -> f64 {
        match self {
            Part::Drive { seconds, .. } | Part::Open { seconds } => *seconds,
            Part::Chirp(waveform) => f64::from(waveform.duration_ms) / 1000.0,
        }
    }

    /// Largest voltage, V.
    pub fn most_v(&self) -> f64 {
        match self {
            Part::Drive { from_v, to_v, .. } => from_v.abs().max(to_v.abs()),
            Part::Open { .. } => 0.0,
            Part::Chirp(waveform) => f64::from(waveform.amplitude_v),
        }
    }
}

/// A named stretch of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// For the plan and the log.
    pub name: &'static str,
    /// In the order of time.
    pub parts: Vec<Part>,
}

/// Levels of the staircase, shares of the largest voltage; the highest reaches it.
const STAIRS: [f64; 7] = [0.15, 0.35, 0.6, 0.85, 1.0, 0.5, 0.2];
/// The frequency of the chirp grows by this factor at least, also where the travel asks for a high one to begin with.
const LEAST_SWEEP: f64 = 3.0;

/// A level for so many units of time.
fn level(scale: &Scale, share: f64, units: f64) -> Part {
    let volts = scale.volts(share);
    Part::Drive { from_v: volts, to_v: volts, seconds: units * scale.unit_s }
}

impl Segment {
    /// Two slow triangles up and down, to this share of the largest voltage; a negative share begins with the negative side.
    pub fn triangle(scale: &Scale, share: f64) -> Self {
        let (peak, quarter) = (scale.volts(share), 1.25 * scale.unit_s);
        let side = [(0.0, peak, 1.0), (peak, -peak, 2.0), (-peak, 0.0, 1.0)];
        let drive = |(from_v, to_v, quarters)| Part::Drive { from_v, to_v, seconds: quarters * quarter };
        Self { name: "triangle", parts: [side, side].concat().into_iter().map(drive).collect() }
    }

    /// Levels up to this share of the largest voltage and down again, in both directions.
    pub fn staircase(scale: &Scale, share: f64) -> Self {
        let stairs = STAIRS.iter().chain(&STAIRS).enumerate();
        let side = |place: usize| if place < STAIRS.len() { share } else { -share };
        let parts = stairs.map(|(place, part)| level(scale, side(place) * part, 1.6));
        Self { name: "staircase", parts: parts.collect() }
    }

    /// A run-up with this share of the largest voltage, then an open bridge; in both directions.
    pub fn coast_downs(scale: &Scale, share: f64) -> Self {
        let open = Part::Open { seconds: 3.0 * scale.unit_s };
        let parts = [share, -share].into_iter().flat_map(|share| [level(scale, share, 2.5), open]);
        Self { name: "coast-downs", parts: parts.collect() }
    }

    /// Eight levels of this share of the largest voltage with alternating signs.
    pub fn reversals(scale: &Scale, share: f64) -> Self {
        let units = 0.6 + 2.0 * scale.swing_s(scale.volts(share)) / scale.unit_s;
        let parts = (0..8).map(|turn| level(scale, if turn % 2 == 0 { share } else { -share }, units));
        Self { name: "reversals", parts: parts.collect() }
    }

    /// A logarithmic chirp of this share of the largest voltage, over the corner of the motor. Where the travel is short it begins
    /// at the frequency whose swing fits.
    pub fn chirp(scale: &Scale, share: f64) -> Self {
        let amplitude_v = scale.volts(share).abs();
        let to_hz = (4.0 / scale.tau_s).min(scale.highest_hz);
        let from_hz = scale.lowest_hz(amplitude_v).max(0.1 / scale.unit_s).min(to_hz / LEAST_SWEEP);
        let waveform = Waveform {
            amplitude_v: amplitude_v as f32,
            from_hz: from_hz as f32,
            to_hz: to_hz as f32,
            sweep: Sweep::Logarithmic,
            duration_ms: (12_000.0 * scale.unit_s).max(100.0) as u32,
        };
        Self { name: "chirp", parts: vec![Part::Chirp(waveform)] }
    }

    /// As slow as the dead zone allows, in both directions.
    pub fn crawl(scale: &Scale, share: f64) -> Self {
        Self { name: "crawl", parts: [share, -share].map(|share| level(scale, share, 3.0)).to_vec() }
    }

    /// Length, s.
    pub fn seconds(&self) -> f64 {
        self.parts.iter().map(Part::seconds).sum()
    }

    /// Largest voltage, V.
    pub fn most_v(&self) -> f64 {
        self.parts.iter().map(Part::most_v).fold(0.0, f64::max)
    }
}
