//! The experiment that separates rivals which are equal in steady state: both fitted plants run every protocol of a small
//! catalogue over time, and the one in which they differ most is proposed.

use crate::outcome::Segment;
use crate::system::plant::Motor;
use crate::system::plant::physics::Physics;

/// Samples per mechanical time constant in the trial runs. Chosen by judgement; not studied.
const SAMPLES_PER_TAU: f64 = 40.0;
/// A protocol that cannot show the rivals 3 noise standard deviations apart anywhere separates nothing. Chosen by
/// judgement; not studied.
const SEEN: f64 = 3.0;

/// A protocol of the catalogue.
#[derive(Clone, Debug)]
pub struct Protocol {
    /// In words.
    pub name: String,
    /// What is applied.
    pub profile: Vec<Segment>,
}

/// What a protocol shows of two plants.
#[derive(Clone, Debug)]
pub struct Contrast {
    /// The protocol.
    pub protocol: Protocol,
    /// Largest difference of the readings, rad/s.
    pub speed_rad_s: f64,
    /// Largest difference of the winding currents, A.
    pub current_a: f64,
}

/// The catalogue for a motor that takes `top` volts and settles in `tau` seconds. After four and five time constants 2 and 0.7 %
/// of a step are left. The smaller inputs stay above a usual dead zone. Chosen by judgement; not studied.
fn catalogue(top: f64, tau: f64) -> Vec<Protocol> {
    let driven = |u: f64, spans: f64| Segment::driven(rounded(u), rounded(spans * tau));
    let open = |spans: f64| Segment::open(rounded(spans * tau));
    let volts = |u: f64| format!("{} V", rounded(u));
    vec![
        Protocol {
            name: format!("a release from {} to {}", volts(top), volts(0.4 * top)),
            profile: vec![driven(top, 5.0), driven(0.4 * top, 5.0)],
        },
        Protocol {
            name: format!("reversals between +{0} and -{0}", volts(0.6 * top)),
            profile: vec![driven(0.6 * top, 4.0), driven(-0.6 * top, 4.0), driven(0.6 * top, 4.0)],
        },
        Protocol {
            name: format!("a coast-down from {} with the bridge open", volts(0.6 * top)),
            profile: vec![driven(0.6 * top, 5.0), open(5.0)],
        },
        Protocol { name: format!("a step to {} from rest", volts(top)), profile: vec![driven(top, 5.0)] },
    ]
}

/// Three significant digits: nobody types more.
fn rounded(x: f64) -> f64 {
    let digit = 10f64.powf(x.abs().max(f64::MIN_POSITIVE.sqrt()).log10().floor() - 2.0);
    ((x / digit).round() * digit * 1e9).round() / 1e9
}

/// The protocol that shows most between two plants; speed counts before current, which not everybody can log.
pub fn best(a: &Physics, b: &Physics, top: f64, noise: f64) -> Option<Contrast> {
    let tau = a.time_constant_s().max(b.time_constant_s());
    let all = catalogue(top, tau).into_iter().map(|p| contrast(a, b, p, tau));
    all.max_by(|x, y| merit(x, noise).total_cmp(&merit(y, noise)))
}

fn merit(c: &Contrast, noise: f64) -> f64 {
    if c.visible_in_speed(noise) { 1e6 + c.speed_rad_s / noise } else { c.current_a }
}

impl Contrast {
    /// True if the speed alone separates.
    pub fn visible_in_speed(&self, noise: f64) -> bool {
        self.speed_rad_s > SEEN * noise.max(1e-9)
    }
}

fn contrast(a: &Physics, b: &Physics, protocol: Protocol, tau: f64) -> Contrast {
    let (first, second) = (run(a, &protocol, tau), run(b, &protocol, tau));
    let largest = |f: fn(&(f64, f64)) -> f64| {
        first.iter().zip(&second).map(|(x, y)| (f(x) - f(y)).abs()).fold(0.0_f64, f64::max)
    };
    Contrast { speed_rad_s: largest(|r| r.0), current_a: largest(|r| r.1), protocol }
}

/// Reading and current over a protocol.
fn run(plant: &Physics, protocol: &Protocol, tau: f64) -> Vec<(f64, f64)> {
    let mut motor = Motor::new(plant.clone(), 4096.0);
    let dt = tau / SAMPLES_PER_TAU;
    let mut rows = Vec::new();
    for piece in &protocol.profile {
        for _ in 0..(piece.seconds / dt).round() as usize {
            let answer = motor.step(piece.u_v.unwrap_or(0.0), piece.bridge, dt);
            rows.push((answer.omega_rad_s, answer.current_a));
        }
    }
    rows
}
