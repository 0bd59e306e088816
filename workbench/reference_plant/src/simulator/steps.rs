//! Steps between two breaks of the inputs: their length from the error, their end at a switching if there is one.

use super::Simulator;
use crate::modes::GUARDS;
use crate::rosenbrock::{self, State, Step};
use crate::state::CURRENT;

/// Switchings at one instant before one is overlooked for a moment (see [`Simulator::overlooked`]).
const MOST_SWITCHINGS_AT_ONCE: u32 = 40;

impl Simulator {
    /// Integrates to `stop` with constant inputs.
    pub(super) fn integrate(&mut self, stop: f64) {
        let mut at_once = 0;
        // Below this length a rest is rounding.
        let least = 1e-14 * stop.abs().max(1e-3);
        while stop - self.time > least {
            let rest = stop - self.time;
            // Two equal steps rather than a long one and a sliver.
            let h = if self.next_step >= rest { rest } else { self.next_step.min(0.5 * rest).max(least) };
            let step = rosenbrock::step(self, self.time, &self.state, h);
            self.steps += 1;
            let ratio = step.error / self.tolerance;
            let factor = if ratio > 0.0 { (0.9 * ratio.powf(-0.25)).clamp(0.1, 5.0) } else { 5.0 };
            if ratio > 1.0 && h > 10.0 * least {
                self.next_step = h * factor.min(0.9);
                continue;
            }
            if h == self.next_step || factor < 1.0 {
                self.next_step = h * factor;
            } else {
                self.next_step = self.next_step.max(h * factor);
            }
            at_once = if at_once > MOST_SWITCHINGS_AT_ONCE {
                self.overlooked += 1;
                self.accept(&step);
                0
            } else {
                self.accept_up_to_switching(step, at_once)
            };
        }
    }

    /// Accepts the step, or the part of it before the first switching. Returns the number of switchings in a row that
    /// took no time.
    fn accept_up_to_switching(&mut self, step: Step, at_once: u32) -> u32 {
        let start = self.guards(self.time, &self.state);
        let end = self.guards(self.time + step.h, &step.end);
        if let Some(which) = (0..GUARDS).find(|&g| start[g] <= 0.0 && end[g] < 0.0) {
            self.switch(which);
            return at_once + 1;
        }
        let crossed = |guards: &[f64; GUARDS]| (0..GUARDS).any(|g| start[g] > 0.0 && guards[g] < 0.0);
        let middle = self.guards(self.time + 0.5 * step.h, &step.at(0.5));
        let bracket = if crossed(&middle) {
            rosenbrock::step(self, self.time, &self.state, 0.5 * step.h)
        } else {
            step
        };
        let end = self.guards(self.time + bracket.h, &bracket.end);
        if !crossed(&end) {
            self.accept(&bracket);
            return 0;
        }
        let (which, step) = self.locate(bracket, &start);
        self.accept(&step);
        self.switch(which);
        0
    }

    /// Shortens the step to the first switching: false position with halved ends (the Illinois rule) on real steps, so that
    /// the switching is as exact as the solution. Ends just beyond the switching.
    fn locate(&self, mut beyond: Step, start: &[f64; GUARDS]) -> (usize, Step) {
        let worst = |guards: &[f64; GUARDS]| {
            let active = |g: usize| start[g] > 0.0 && start[g].is_finite();
            let relative = |g: usize| {
                if active(g) { guards[g] / start[g] } else { f64::INFINITY }
            };
            (0..GUARDS).map(|g| (g, relative(g))).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
        };
        let (mut which, mut high) = worst(&self.guards(self.time + beyond.h, &beyond.end));
        let (mut before, mut low) = (0.0, 1.0);
        let (mut side, mut value_beyond) = (0, high);
        for _ in 0..80 {
            let width = beyond.h - before;
            if width <= 4.0 * f64::EPSILON * (self.time.abs() + beyond.h) || value_beyond > -1e-14 {
                break;
            }
            let guess =
                (before + width * low / (low - high)).clamp(before + 0.001 * width, beyond.h - 0.001 * width);
            let step = rosenbrock::step(self, self.time, &self.state, guess);
            let (guard, value) = worst(&self.guards(self.time + guess, &step.end));
            if value < 0.0 {
                (beyond, high, value_beyond, which) = (step, value, value, guard);
                low *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (before, low) = (guess, value.min(1.0));
                high *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        (which, beyond)
    }

    fn guards(&self, t: f64, y: &State) -> [f64; GUARDS] {
        self.modes.guards(&self.motor, &self.held, t, y)
    }

    fn switch(&mut self, which: usize) {
        self.switchings += 1;
        self.modes.switch(which, &self.motor, &self.held, self.time, &mut self.state);
    }

    fn accept(&mut self, step: &Step) {
        // Simpson's rule on the continuous extension.
        let middle = step.at(0.5)[CURRENT];
        self.charge += step.h / 6.0 * (self.state[CURRENT] + 4.0 * middle + step.end[CURRENT]);
        self.time += step.h;
        self.state = step.end;
    }
}
