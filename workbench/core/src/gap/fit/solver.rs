//! The one least-squares solver: Levenberg–Marquardt with bounds by projection (Nocedal, Wright: Numerical Optimization,
//! 2006, chapter 10) and a numeric Jacobian. Records over time and tables of settled speeds are both a [`Problem`].
//!
//! A simulation is so cheap that nothing cleverer pays, but columns of the Jacobian that bend little are not computed
//! anew after a step: they follow it (Broyden, Math. Comp. 19, 1965).

use super::jacobian::{Beside, Jacobian};
use super::problem::{Problem, clipped, dot};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The smallest of Levenberg's dampings, which is as good as none. Chosen by judgement; not studied.
const LEAST_DAMPING: f64 = 1e-9;
/// The damping with which a descent begins. Chosen by judgement; not studied.
const FIRST_DAMPING: f64 = 1e-2;
/// By what the damping falls after a step that lowered the cost, grows after one that did not, and falls where it alone makes the
/// step too short to be worth a simulation. Marquardt (SIAM J. 11, 1963) takes ten; chosen by judgement beside it, not studied.
const FACTORS: [f64; 3] = [8.0, 6.0, 1e3];
/// Dampings that are tried for one step. Chosen by judgement; not studied.
const TRIES: usize = 6;
/// Slow steps in a row that end a descent. Chosen by judgement; not studied.
const SLOW_STEPS: usize = 2;

/// When a descent ends.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    /// Steps at most.
    pub iterations: usize,
    /// A step that lowers the cost by less than this part of it is slow.
    pub slow: f64,
    /// A step that promises less than this, times the cost per residual where that is above 1, is not taken.
    pub negligible: f64,
}

/// Where a descent ended.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The numbers.
    pub x: Vec<f64>,
    /// The residuals there.
    pub residuals: Vec<f64>,
    /// The sum of their squares.
    pub cost: f64,
}

/// Solves a problem from a start.
pub fn solve(problem: &mut impl Problem, start: &[f64], schedule: &Schedule) -> Solution {
    let empty = Jacobian::new(problem, vec![Vec::new(); start.len()]);
    Descent::new(problem, start, schedule, empty, 0..start.len()).run()
}

/// Solves a problem near another one, of which some columns of the Jacobian are known; those of the numbers that bend the
/// residuals are not used.
pub fn solve_near(
    problem: &mut impl Problem,
    start: &[f64],
    schedule: &Schedule,
    columns: Vec<Vec<f64>>,
) -> Solution {
    let bending = 0..problem.bending();
    let known = Jacobian::new(problem, columns);
    let descent = Descent::new(problem, start, schedule, known, bending);
    Descent { followed: true, ..descent }.run()
}

/// Goes on from a solution with differences to both sides: along a valley in which numbers are traded for each other, down to where their
/// priors are least strained. One-sided differences do not see that the valley is level.
pub fn settled(problem: &mut impl Problem, start: &[f64], schedule: &Schedule) -> Solution {
    let empty = Jacobian::new(problem, vec![Vec::new(); start.len()]);
    let mut descent = Descent::new(problem, start, schedule, empty, 0..0);
    for _ in 0..schedule.iterations {
        descent.jacobian = Jacobian::probed(descent.problem, &descent.x);
        (descent.late, descent.damping) = (false, LEAST_DAMPING);
        if !descent.lower() {
            break;
        }
    }
    Solution { x: descent.x, residuals: descent.residuals, cost: descent.cost }
}

/// Covariance of the numbers at a solution, (JᵀJ + ridge)⁻¹ with the priors inside; `None` where it is singular. `ridge`
/// is a function of the number's place and of its own information.
pub fn covariance(
    problem: &mut impl Problem,
    x: &[f64],
    ridge: impl Fn(usize, f64) -> f64,
) -> Option<DMatrix<f64>> {
    let mut information = Jacobian::probed(problem, x).normal();
    for k in 0..x.len() {
        information[(k, k)] += ridge(k, information[(k, k)]);
    }
    information.try_inverse()
}

/// Residuals and cost at a place, and the residuals beside it if they came along.
type Looked = (Vec<f64>, f64, Option<(Beside, Vec<Vec<f64>>)>);

/// A descent under way.
struct Descent<'p, P> {
    problem: &'p mut P,
    schedule: &'p Schedule,
    x: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
    jacobian: Jacobian,
    /// True if columns were corrected by steps since they were computed.
    followed: bool,
    /// True if the columns that bend belong to the numbers before the last step.
    late: bool,
    damping: f64,
}

impl<'p, P: Problem> Descent<'p, P> {
    /// At a start, with some columns of the Jacobian computed there.
    fn new(
        problem: &'p mut P,
        start: &[f64],
        schedule: &'p Schedule,
        jacobian: Jacobian,
        columns: Range<usize>,
    ) -> Self {
        let places = start.iter().enumerate();
        let x: Vec<f64> = places.map(|(k, v)| clipped(problem, k, *v)).collect();
        let mut descent = Self {
            problem,
            schedule,
            residuals: Vec::new(),
            cost: f64::INFINITY,
            jacobian,
            followed: false,
            late: false,
            damping: FIRST_DAMPING,
            x,
        };
        let (residuals, cost, beside) = descent.look(&descent.x.clone(), columns.clone());
        (descent.residuals, descent.cost) = (residuals, cost);
        match beside {
            Some((beside, moved)) => {
                descent.jacobian.take(&beside, std::slice::from_ref(&descent.residuals), &moved)
            }
            None => descent.jacobian.renew(descent.problem, &descent.x, &descent.residuals, columns),
        }
        descent
    }

    /// Residuals and cost at a place. Where derivatives are as fine as residuals, those beside it come along.
    fn look(&mut self, x: &[f64], columns: Range<usize>) -> Looked {
        if !self.problem.probes_alike() {
            let mut residuals = Vec::with_capacity(self.residuals.len());
            self.problem.residuals(x, &mut residuals);
            let cost = dot(&residuals, &residuals);
            return (residuals, cost, None);
        }
        let beside = Beside::new(self.problem, x, columns);
        let places: Vec<&[f64]> = std::iter::once(x).chain(beside.places.iter().map(Vec::as_slice)).collect();
        let mut moved = vec![Vec::new(); places.len()];
        self.problem.residuals_near(x, &places, &mut moved);
        let residuals = moved.remove(0);
        let cost = dot(&residuals, &residuals);
        (residuals, cost, Some((beside, moved)))
    }

    fn run(mut self) -> Solution {
        let mut slow = 0;
        for left in (0..self.schedule.iterations).rev() {
            let before = self.cost;
            if self.lower() {
                let gained = before - self.cost >= self.schedule.slow * before;
                slow = if gained { 0 } else { slow + 1 };
                if slow >= SLOW_STEPS {
                    break;
                }
            } else if self.followed && left > 0 {
                // The columns that only followed may be to blame.
                self.jacobian.renew(self.problem, &self.x, &self.residuals, 0..self.x.len());
                self.followed = false;
            } else {
                break;
            }
        }
        Solution { x: self.x, residuals: self.residuals, cost: self.cost }
    }

    /// One step that lowers the cost; false if there is none worth taking.
    fn lower(&mut self) -> bool {
        if self.late {
            let bending = 0..self.problem.bending();
            self.jacobian.renew(self.problem, &self.x, &self.residuals, bending);
            self.late = false;
        }
        let normal = Normal::new(self);
        let negligible = self.schedule.negligible * (self.cost / self.residuals.len() as f64).max(1.0);
        // Where numbers can be traded against each other, only their priors pull along the valley, and the least
        // damping hides that: whether there is anything to gain is asked without.
        if (normal.step(LEAST_DAMPING)).is_some_and(|step| normal.predicted_decrease(&step) < negligible) {
            return false;
        }
        for _ in 0..TRIES {
            if let Some(step) = normal.step(self.damping) {
                if normal.predicted_decrease(&step) < negligible && self.damping > LEAST_DAMPING {
                    self.damping = (self.damping / FACTORS[2]).max(LEAST_DAMPING);
                    continue;
                }
                if self.steps(&step) {
                    self.damping = (self.damping / FACTORS[0]).max(LEAST_DAMPING);
                    return true;
                }
            }
            self.damping *= FACTORS[1];
        }
        false
    }

    /// Takes a step if it lowers the cost. The columns that bend little follow; the others are computed anew before the
    /// next step.
    fn steps(&mut self, step: &DVector<f64>) -> bool {
        let places = self.x.iter().zip(step.iter()).enumerate();
        let next: Vec<f64> = places.map(|(k, (x, step))| clipped(self.problem, k, x + step)).collect();
        let bending = 0..self.problem.bending();
        let (residuals, cost, beside) = self.look(&next, bending);
        // Not a number is no gain either.
        let lower = cost < self.cost;
        if lower {
            let step: Vec<f64> = next.iter().zip(&self.x).map(|(a, b)| a - b).collect();
            self.jacobian.follow(&step, &self.residuals, &residuals);
            (self.followed, self.late) = (true, beside.is_none());
            if let Some((beside, moved)) = beside {
                self.jacobian.take(&beside, std::slice::from_ref(&residuals), &moved);
            }
            (self.x, self.residuals, self.cost) = (next, residuals, cost);
        }
        lower
    }
}

/// The normal equations at one place.
struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Numbers that sit at a bound which the descent would cross.
    held: Vec<bool>,
}

impl Normal {
    fn new<P: Problem>(descent: &Descent<P>) -> Self {
        let gradient = descent.jacobian.gradient(&descent.residuals);
        let held = |(k, x): (usize, &f64)| {
            let (lower, upper) = descent.problem.bounds(k);
            (*x <= lower && gradient[k] > 0.0) || (*x >= upper && gradient[k] < 0.0)
        };
        Self {
            matrix: descent.jacobian.normal(),
            held: descent.x.iter().enumerate().map(held).collect(),
            gradient,
        }
    }

    /// By how much a step lowers the cost where the residuals are linear.
    fn predicted_decrease(&self, step: &DVector<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + step.dot(&(&self.matrix * step)))
    }

    /// Solves (JᵀJ + λ·diag) d = −Jᵀr with some numbers held.
    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut matrix = self.matrix.clone();
        let mut right = -&self.gradient;
        for (k, held) in self.held.iter().enumerate() {
            let diagonal = self.matrix[(k, k)];
            // Some thousand times the rounding of a double: a number without influence leaves the equations solvable.
            matrix[(k, k)] = diagonal * (1.0 + damping) + 1e-12 * (1.0 + diagonal);
            if *held {
                matrix.row_mut(k).fill(0.0);
                matrix.column_mut(k).fill(0.0);
                matrix[(k, k)] = 1.0;
                right[k] = 0.0;
            }
        }
        matrix.cholesky().map(|factor| factor.solve(&right))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley (Computer Journal 3, 1960) as residuals, its minimum at (1, 1).
    struct Valley {
        most_x: f64,
        bending: usize,
    }

    impl Problem for Valley {
        fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
            *out = vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
        }

        fn bounds(&self, slot: usize) -> (f64, f64) {
            (-2.0, if slot == 0 { self.most_x } else { 2.0 })
        }

        fn step(&self, _: usize) -> f64 {
            1e-6
        }

        fn bending(&self) -> usize {
            self.bending
        }
    }

    const LONG: Schedule = Schedule { iterations: 200, slow: 0.0, negligible: 1e-20 };

    #[test]
    fn the_bottom_of_a_bent_valley_is_found_whether_columns_follow_or_not() {
        for bending in 0..=2 {
            let mut valley = Valley { most_x: 2.0, bending };
            let solution = solve(&mut valley, &[-1.2, 1.0], &LONG);
            assert!(solution.cost < 1e-9, "{solution:?}, {bending} columns anew");
        }
    }

    #[test]
    fn a_number_may_rest_at_its_bound() {
        let mut valley = Valley { most_x: 0.5, bending: 2 };
        let solution = solve(&mut valley, &[-1.2, 1.0], &LONG);
        assert_eq!(solution.x[0], 0.5);
        assert!((solution.x[1] - 0.25).abs() < 1e-6, "{solution:?}");
    }

    /// Two numbers of which only the difference shows, nearly without noise: a valley that is level but for the priors, 0 and 2.
    struct Traded;

    impl Problem for Traded {
        fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
            *out = vec![1e4 * ((x[0] - x[1]).exp() - 1.0), x[0], x[1] - 2.0];
        }

        fn bounds(&self, _: usize) -> (f64, f64) {
            (-5.0, 5.0)
        }

        fn step(&self, _: usize) -> f64 {
            1e-3
        }

        fn bending(&self) -> usize {
            2
        }
    }

    #[test]
    fn what_can_be_traded_does_not_pass_for_seen() {
        let found = settled(&mut Traded, &[3.0, 3.0], &Schedule { iterations: 5, ..LONG });
        assert!(found.x.iter().all(|x| (x - 1.0).abs() < 1e-3), "{found:?}");
        let spread = covariance(&mut Traded, &found.x, |_, _| 0.0).expect("not singular");
        assert!((spread[(0, 0)] - 0.5).abs() < 0.01, "{spread}");
    }

    #[test]
    fn the_covariance_is_the_inverse_of_the_information() {
        let mut valley = Valley { most_x: 2.0, bending: 2 };
        let found = covariance(&mut valley, &[1.0, 1.0], |_, _| 0.0).expect("not singular");
        // J = [[−20, 10], [−1, 0]]: (JᵀJ)⁻¹ = [[1, 2], [2, 4.01]].
        let expected = [[1.0, 2.0], [2.0, 4.01]];
        for (i, row) in expected.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                assert!((found[(i, j)] - value).abs() < 1e-3, "{found}");
            }
        }
    }
}
