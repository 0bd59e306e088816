//! A whole record: a protocol in, sampled truth out, with the ends of the speed sensor's window hit exactly.

use super::drive::Command;
use super::simulator::Simulator;
use super::state::{ANGLE, CURRENT, LOAD_ANGLE, LOAD_SPEED, SENSED_ANGLE, SPEED};
use servo::axis::Bridge;

/// One row: held from its time to the next row's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t: f64,
    /// Command.
    pub command: Command,
    /// Bridge.
    pub bridge: Bridge,
}

/// Where the averaging window of the speed sensor lies around a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Length, s; > 0.
    pub seconds: f64,
    /// Ends at the sample (true), or is centred on it.
    pub causal: bool,
}

/// Truth at the rows' times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Angle of the body that carries the encoder, rad.
    pub theta: Vec<f64>,
    /// Its speed, rad/s.
    pub omega: Vec<f64>,
    /// Encoder angle where the window opens, rad.
    pub opened: Vec<f64>,
    /// Encoder angle where it closes, rad.
    pub closed: Vec<f64>,
    /// Mean over the window of what the speed sensor sees, rad/s.
    pub seen: Vec<f64>,
    /// Winding current, A.
    pub current: Vec<f64>,
    /// Supply, V.
    pub supply: Vec<f64>,
}

/// Simulates the rows. `on_load`: the encoder sits at the load of a train of two bodies. Before the first row the motor
/// rests, and the last row is held for the rest of its window.
pub fn simulate(simulator: &mut Simulator, rows: &[Row], window: Window, on_load: bool) -> Truth {
    let origin = rows.first().map_or(0.0, |row| row.t) - simulator.time();
    let mut truth = Truth::with_length(rows.len());
    let mut sensed = vec![[0.0; 2]; rows.len()];
    let two = simulator.motor().has_two_bodies();
    let body = if on_load && two { (LOAD_ANGLE, LOAD_SPEED) } else { (ANGLE, SPEED) };
    let sensor = if simulator.motor().tacho.is_some() { SENSED_ANGLE } else { body.0 };
    for (t, k, probe) in stops(rows, window) {
        simulator.advance(t - origin);
        let state = *simulator.state();
        // Before the start: straight back along the initial speed.
        let early = (simulator.time() - (t - origin)).max(0.0);
        let (angle, integral) =
            (state[body.0] - early * state[body.1], state[sensor] - early * state[body.1]);
        match probe {
            Probe::Opens => (truth.opened[k], sensed[k][0]) = (angle, integral),
            Probe::Closes => (truth.closed[k], sensed[k][1]) = (angle, integral),
            Probe::Row => {
                (truth.theta[k], truth.omega[k]) = (angle, state[body.1]);
                truth.current[k] = state[CURRENT];
                truth.supply[k] = simulator.supply();
                simulator.command(rows[k].command, rows[k].bridge);
            }
        }
    }
    for (k, [opened, closed]) in sensed.into_iter().enumerate() {
        truth.seen[k] = (closed - opened) / window.seconds;
    }
    truth
}

/// Where the simulation stops, in the order of time, with the row that the stop belongs to.
fn stops(rows: &[Row], window: Window) -> Vec<(f64, usize, Probe)> {
    let mut stops = Vec::with_capacity(3 * rows.len());
    let (back, ahead) =
        if window.causal { (window.seconds, 0.0) } else { (0.5 * window.seconds, 0.5 * window.seconds) };
    for (k, row) in rows.iter().enumerate() {
        stops.push((row.t - back, k, Probe::Opens));
        stops.push((row.t, k, Probe::Row));
        stops.push((row.t + ahead, k, Probe::Closes));
    }
    // A window that closes at a row closes before the row's command acts; at equal times the order is Closes, Opens, Row.
    stops.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.order().cmp(&b.2.order())).then(a.1.cmp(&b.1)));
    stops
}

#[derive(Clone, Copy, Debug)]
enum Probe {
    Opens,
    Row,
    Closes,
}

impl Probe {
    fn order(self) -> u8 {
        match self {
            Self::Closes => 0,
            Self::Opens => 1,
            Self::Row => 2,
        }
    }
}

impl Truth {
    fn with_length(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            theta: zeros(),
            omega: zeros(),
            opened: zeros(),
            closed: zeros(),
            seen: zeros(),
            current: zeros(),
            supply: zeros(),
        }
    }
}
