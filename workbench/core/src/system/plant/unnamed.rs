//! A term without a name: a table over what the motion is doing at the moment. It describes what no effect of the library explains.

use std::f64::consts::TAU;

worded! {
    /// What a term depends on.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Variable: key {
        /// Speed of the shaft, rad/s.
        Speed = "speed",
        /// Place within a turn of the encoder's shaft, 0 … 2π rad.
        TurnOfMotor = "turn_of_motor",
        /// Place within a turn of the load, 0 … 2π rad of the load.
        TurnOfLoad = "turn_of_load",
        /// Position of the encoder's shaft, rad.
        Position = "position",
        /// Travel since the last reversal, rad, not negative.
        TravelSinceReversal = "travel_since_reversal",
        /// Time since the last reversal, s.
        TimeSinceReversal = "time_since_reversal",
        /// Direction of the motion, −1 … 1; a ramp around standstill.
        Direction = "direction",
        /// Winding current, A; where a current or a torque drives the axis, that input.
        Current = "current",
        /// Input behind the input chain, in its own unit.
        Input = "input",
        /// Acceleration that the plant would have without the term, rad/s².
        Acceleration = "acceleration",
        /// Time since the start of the run, s.
        Time = "time",
    }
}

impl Variable {
    /// The variable of that key.
    pub fn find(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|variable| variable.key() == key)
    }

    /// True if its end is its beginning.
    pub fn is_periodic(self) -> bool {
        matches!(self, Self::TurnOfMotor | Self::TurnOfLoad)
    }
}

/// What the motion is doing at the moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// Time since the start of the run, s.
    pub time_s: f64,
    /// Position of the encoder's shaft, rad.
    pub theta: f64,
    /// Speed, rad/s.
    pub omega: f64,
    /// Acceleration without any term, rad/s².
    pub acceleration: f64,
    /// Current, A.
    pub current: f64,
    /// Input behind the input chain.
    pub input: f64,
    /// Turns of the encoder's shaft per turn of the load.
    pub gear_ratio: f64,
    /// Travel since the last reversal, rad.
    pub travel: f64,
    /// Time since the last reversal, s.
    pub since_s: f64,
}

impl Moment {
    /// The value of a variable. `standstill`: speed below which the direction is not certain, rad/s.
    #[inline]
    pub fn of(&self, variable: Variable, standstill: f64) -> f64 {
        match variable {
            Variable::Speed => self.omega,
            Variable::TurnOfMotor => self.theta.rem_euclid(TAU),
            Variable::TurnOfLoad => (self.theta / self.gear_ratio).rem_euclid(TAU),
            Variable::Position => self.theta,
            Variable::TravelSinceReversal => self.travel,
            Variable::TimeSinceReversal => self.since_s,
            Variable::Direction => (self.omega / standstill).clamp(-1.0, 1.0),
            Variable::Current => self.current,
            Variable::Input => self.input,
            Variable::Acceleration => self.acceleration,
            Variable::Time => self.time_s,
        }
    }
}

/// Where and when the motion last changed its direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reversal {
    /// Direction since then: −1, 1, or 0 before the first motion.
    direction: f64,
    /// Position, rad.
    theta: f64,
    /// Time, s.
    time_s: f64,
}

impl Reversal {
    /// Follows the motion. A reversal counts once the speed exceeds `standstill`, rad/s: a shaft that trembles does not reverse.
    #[inline]
    pub fn follow(&mut self, time_s: f64, theta: f64, omega: f64, standstill: f64) {
        if omega.abs() > standstill && omega * self.direction <= 0.0 {
            *self = Self { direction: omega.signum(), theta, time_s };
        }
    }

    /// Travel and time since then.
    #[inline]
    pub fn since(&self, time_s: f64, theta: f64) -> (f64, f64) {
        ((theta - self.theta).abs(), time_s - self.time_s)
    }
}

/// The places of a variable at which a table has values.
#[derive(Clone, Debug, PartialEq)]
pub struct Knots {
    /// The variable.
    pub variable: Variable,
    /// Rising; of a place in a turn the values at the last knot and at the first knot, a turn later, are joined.
    pub at: Vec<f64>,
}

impl Knots {
    /// The two knots around a value and the share of the second; constant outside.
    #[inline]
    pub fn around(&self, value: f64) -> (usize, usize, f64) {
        let last = self.at.len() - 1;
        let after = self.at.partition_point(|knot| *knot <= value);
        if after > 0 && after <= last {
            let (low, high) = (self.at[after - 1], self.at[after]);
            return (after - 1, after, (value - low) / (high - low));
        }
        if !self.variable.is_periodic() {
            let end = if after == 0 { 0 } else { last };
            return (end, end, 0.0);
        }
        let gap = self.at[0] + TAU - self.at[last];
        (last, 0, (value - self.at[last]).rem_euclid(TAU) / gap)
    }
}

worded! {
    /// On what a term acts, and in which unit its values are.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Acting: key {
        /// A torque on the motor's shaft, N m (a force, N, on a linear axis).
        Torque = "torque",
        /// The same in the unit of the input: of a model that does not know torques.
        Input = "input",
        /// Relative error of the speed's reading.
        Reading = "reading",
    }
}

/// A table over one variable or two, linear between its knots and constant outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// The variables with their knots: one or two.
    pub over: Vec<Knots>,
    /// The values, those of the last variable side by side.
    pub values: Vec<f64>,
    /// On what it acts.
    pub acts: Acting,
    /// Speed below which the direction of the motion is not certain, rad/s.
    pub standstill: f64,
}

impl Term {
    /// Number of values that the knots ask for.
    pub fn size(over: &[Knots]) -> usize {
        over.iter().map(|knots| knots.at.len()).product()
    }

    /// The value at a moment.
    #[inline]
    pub fn at(&self, moment: &Moment) -> f64 {
        let mut sum = 0.0;
        self.weights(moment, |k, weight| sum += weight * self.values[k]);
        sum
    }

    /// The weights of the values that count at a moment.
    #[inline]
    pub fn weights(&self, moment: &Moment, mut each: impl FnMut(usize, f64)) {
        let around = |knots: &Knots| knots.around(moment.of(knots.variable, self.standstill));
        let (a, b, second) = around(&self.over[0]);
        let Some(inner) = self.over.get(1) else {
            each(a, 1.0 - second);
            each(b, second);
            return;
        };
        let (c, d, inner_second) = around(inner);
        let width = inner.at.len();
        for (row, share) in [(a, 1.0 - second), (b, second)] {
            each(row * width + c, share * (1.0 - inner_second));
            each(row * width + d, share * inner_second);
        }
    }

    /// True if it acts on the motion, not on what is read of it.
    pub fn moves(&self) -> bool {
        self.acts != Acting::Reading
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn over(variable: Variable, at: &[f64]) -> Knots {
        Knots { variable, at: at.to_vec() }
    }

    fn term(over: Vec<Knots>, values: &[f64]) -> Term {
        Term { over, values: values.to_vec(), acts: Acting::Torque, standstill: 1.0 }
    }

    #[test]
    fn a_table_is_linear_between_its_knots_and_constant_outside() {
        let made = term(vec![over(Variable::Speed, &[-1.0, 0.0, 2.0])], &[5.0, 1.0, 3.0]);
        let at = |omega: f64| made.at(&Moment { omega, ..Moment::default() });
        assert_eq!([at(-9.0), at(-0.5), at(1.0), at(9.0)], [5.0, 3.0, 2.0, 3.0]);
    }

    #[test]
    fn the_last_knot_of_a_turn_is_joined_to_the_first() {
        let made = term(vec![over(Variable::TurnOfMotor, &[0.0, 2.0, 4.0])], &[6.0, 0.0, 2.0]);
        let at = |theta: f64| made.at(&Moment { theta, ..Moment::default() });
        let middle = 4.0 + 0.5 * (TAU - 4.0);
        assert!((at(middle) - 4.0).abs() < 1e-12 && (at(middle - 3.0 * TAU) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn two_variables_are_bilinear() {
        let knots = vec![over(Variable::Position, &[0.0, 1.0]), over(Variable::Direction, &[-1.0, 1.0])];
        let made = term(knots, &[0.0, 2.0, 10.0, 20.0]);
        let at = |theta: f64, omega: f64| made.at(&Moment { theta, omega, ..Moment::default() });
        assert_eq!([at(0.0, -3.0), at(0.0, 3.0), at(0.5, 0.0), at(1.0, 0.5)], [0.0, 2.0, 8.0, 17.5]);
    }

    #[test]
    fn a_trembling_shaft_does_not_reverse() {
        let mut reversal = Reversal::default();
        for (time_s, omega) in [(0.0, 2.0), (1.0, -0.5), (2.0, 0.5), (3.0, -2.0)] {
            reversal.follow(time_s, time_s, omega, 1.0);
        }
        assert_eq!(reversal.since(5.0, 7.0), (4.0, 2.0));
    }
}
