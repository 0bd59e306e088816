//! The plant under inputs that are held from one communication point to the next.
//!
//! It is simulated as `truing simulate` simulates a log with one row at every change of an input and one every `row_s` seconds after it.
//! What is read between two rows comes from a part of a row that is tried and dropped: results depend on inputs and time, never on
//! where the communication points lie.

use servo::axis::Bridge;
use std::collections::VecDeque;
use truing_core::gap::dataset::{FINE, pieces};
use truing_core::system::plant::dynamics::{Coefficients, Dynamics};
use truing_core::system::plant::features::Features;
use truing_core::system::plant::laws::{Acts, Law, TorqueLaw};
use truing_core::system::plant::physics::Physics;
use truing_core::system::plant::state::State;

/// Points of time that differ by less than this part of a row are the same: importers add up steps. By judgement:
/// far above rounding, far below a step.
const SAME_TIME: f64 = 1e-6;

/// What acts on the plant from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// Terminal voltage, V, or the input of an axis that is driven directly.
    pub drive: f64,
    /// External torque, N m, or force, N; positive drives the speed upwards.
    pub load: f64,
    /// Supply without load, V.
    pub supply_v: f64,
}

/// A run that goes on.
#[derive(Clone, Debug)]
pub struct Run {
    plant: Physics,
    features: Features,
    longest_s: f64,
    row_s: f64,
    inputs: Inputs,
    /// When the inputs last changed, s.
    since_s: f64,
    /// Whole rows since then.
    rows: u64,
    /// At the end of the last whole row.
    whole: Moment,
    /// At the last communication point.
    shown: Moment,
    /// Time since the start, s.
    pub now_s: f64,
}

/// All that changes on the way.
#[derive(Clone, Debug)]
struct Moment {
    time_s: f64,
    state: State,
    winding: Coefficients,
    /// The command behind the lag of the drive.
    lagged: f64,
    delayed: Delayed,
}

/// The integral of the input, read `delay` seconds back.
#[derive(Clone, Debug, Default)]
struct Delayed {
    /// Rows that still act: start, integral up to there, value.
    rows: VecDeque<(f64, f64, f64)>,
    /// The integral over all rows.
    area: f64,
    /// The integral up to where it was read.
    reached: f64,
}

impl Run {
    /// From rest at time 0. `row_s`: length of a row, s.
    pub fn new(mut plant: Physics, row_s: f64, inputs: Inputs) -> Self {
        plant.torques.push(TorqueLaw::new(Law::Constant, [inputs.load, 0.0, 0.0], Acts::Load));
        plant.supply_v = inputs.supply_v;
        let features = Features::of(&plant);
        let start = Moment {
            time_s: 0.0,
            state: State::moving(&plant, 0.0, 0.0),
            winding: Dynamics::new(&plant, features).coefficients,
            lagged: 0.0,
            delayed: Delayed::default(),
        };
        let longest_s = features.longest_step(FINE);
        let (whole, shown) = (start.clone(), start);
        Self { plant, features, longest_s, row_s, inputs, since_s: 0.0, rows: 0, whole, shown, now_s: 0.0 }
    }

    /// Supply without load, V.
    pub fn supply_v(&self) -> f64 {
        self.plant.supply_v
    }

    /// The state at the last communication point.
    pub fn state(&self) -> &State {
        &self.shown.state
    }

    /// Inputs from now on. Where they change, a new row begins.
    pub fn hold(&mut self, inputs: Inputs) {
        if inputs == self.inputs {
            return;
        }
        self.inputs = inputs;
        self.plant.supply_v = inputs.supply_v;
        if let Some(law) = self.plant.torques.last_mut() {
            law.parameters[0] = inputs.load;
        }
        self.shown.time_s = self.now_s;
        self.whole = self.shown.clone();
        (self.since_s, self.rows) = (self.now_s, 0);
    }

    /// Advances to a later time, s since the start.
    pub fn go_on(&mut self, to_s: f64) {
        let little = SAME_TIME * self.row_s;
        let mut whole = self.whole.clone();
        loop {
            let end = self.since_s + (self.rows + 1) as f64 * self.row_s;
            if end > to_s + little {
                break;
            }
            // The importer's time where it is the same: sums of steps differ in their last digits, and cogging makes more of them.
            let end = if end > to_s - little { to_s } else { end };
            let length = end - whole.time_s;
            self.row(&mut whole, length);
            whole.time_s = end;
            self.rows += 1;
        }
        let (mut shown, rest) = (whole.clone(), to_s - whole.time_s);
        if rest > little {
            self.row(&mut shown, rest);
        }
        (self.whole, self.shown, self.now_s) = (whole, shown, to_s);
    }

    fn row(&self, moment: &mut Moment, length: f64) {
        let applied = self.applied(moment, length);
        let delay = self.plant.delay_s;
        if delay > 0.0 {
            moment.delayed.rows.push_back((moment.time_s, moment.delayed.area, applied));
            moment.delayed.area += applied * length;
        }
        let pieces = pieces(length, self.longest_s);
        let h = length / pieces;
        let mut dynamics = Dynamics::resumed(&self.plant, self.features, moment.winding);
        for piece in 0..pieces as usize {
            let end = moment.time_s + (piece + 1) as f64 * h;
            let mean = if delay > 0.0 { moment.delayed.up_to(end - delay) * (1.0 / h) } else { applied };
            dynamics.advance(&mut moment.state, mean, Bridge::Driven, h, None);
        }
        moment.winding = dynamics.coefficients;
        moment.time_s += length;
    }

    /// Mean of the input over a row, behind the lag of the drive and the memoryless chain.
    fn applied(&self, moment: &mut Moment, length: f64) -> f64 {
        let (command, lag) = (self.inputs.drive, self.plant.lag_s);
        let chain = self.features.chain();
        if lag <= 0.0 {
            return self.plant.applied_to(chain, command);
        }
        let x = length / lag;
        let (rest, decay) = (moment.lagged - command, (-x).exp());
        moment.lagged = command + rest * decay;
        self.plant.applied_to(chain, command + rest * (1.0 - decay) / x)
    }
}

impl Delayed {
    /// What was added since the last piece ended. Nothing acted before the first row.
    fn up_to(&mut self, time: f64) -> f64 {
        while self.rows.get(1).is_some_and(|next| next.0 < time) {
            self.rows.pop_front();
        }
        let Some(&(start, area, applied)) = self.rows.front() else { return 0.0 };
        let since = time - start;
        let reached = if since < 0.0 { area } else { area + applied * since };
        reached - std::mem::replace(&mut self.reached, reached)
    }
}
