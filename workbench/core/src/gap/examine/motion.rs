//! What a first-order motion explains of a record, with friction, a constant load, gravity and a spring left free.

use super::stretch::{FORCES, Stretch, TAKEN, driven};
use crate::system::log::{Dynamic, Input, median};
use crate::system::model::Kind;
use crate::system::threads::*;
use nalgebra::{DMatrix, DVector};

/// Rows that are looked at. A budget of computing time, chosen by judgement.
const ROWS: usize = 20_000;
/// Rates that are tried around that of the model: a quarter to four times. Half octaves; chosen by judgement.
const AROUND: [f64; 9] = [0.25, 0.35, 0.5, 0.71, 1.0, 1.4, 2.0, 2.8, 4.0];
/// And nearer to the best of them. Origin: 2^(1/4), 2^(1/8) and 2^(1/16), each half of the step before.
const FINER: [f64; 3] = [1.19, 1.09, 1.045];
/// A gain within this factor of the model's is an effect, not a mistake. Origin: a published motor is off by 2.3.
pub(super) const GAIN: f64 = 3.0;
/// Limits and thresholds of the input that are tried, as parts of the largest one. Half octaves; chosen by judgement.
const LIMITS: [f64; 8] = [0.06, 0.09, 0.13, 0.19, 0.27, 0.38, 0.53, 0.75];
/// Dead zones that are tried, up to this part of the largest input. Chosen by judgement, tried with the others of
/// `examine`.
const ZONES: usize = 8;
const WIDEST: f64 = 0.32;
/// Responses that agree so far cannot be told apart: of more than two levels they agree to 0.95. Chosen by judgement,
/// tried with the others of `examine`.
const ALIKE: f64 = 0.985;
/// From here on they are one response to rounding. Chosen by judgement; not studied.
const SAME: f64 = 1.0 - 1e-9;
/// Below this part of the fastest motion no direction is certain. Chosen by judgement, tried with the others of
/// `examine`.
const STANDS: f64 = 0.02;
/// Faster than this part of the fastest motion it is no noise. Chosen by judgement, tried with the others of
/// `examine`.
const BACKWARDS: f64 = 0.1;

/// The model as dω/dt = slope · input − rate · ω.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    /// Acceleration per unit of input at rest.
    pub slope: f64,
    /// One over the time constant; 0 without damping.
    pub rate: f64,
}

impl Base {
    /// A model of this kind under this input; `None` if a voltage drives one that knows none.
    pub fn of(kind: &Kind, input: Input) -> Option<Self> {
        let base = match (*kind, input) {
            (
                Kind::DcMotor { r_ohm, kt_nm_per_a, ke_vs_per_rad, j_kgm2, b_nms_per_rad, .. },
                Input::Voltage,
            ) => Self {
                slope: kt_nm_per_a / (r_ohm * j_kgm2),
                rate: (kt_nm_per_a * ke_vs_per_rad / r_ohm + b_nms_per_rad) / j_kgm2,
            },
            (Kind::DcMotor { kt_nm_per_a, j_kgm2, b_nms_per_rad, .. }, _) => {
                let torque = if input == Input::Current { kt_nm_per_a } else { 1.0 };
                Self { slope: torque / j_kgm2, rate: b_nms_per_rad / j_kgm2 }
            }
            (Kind::FirstOrder { gain_rad_s_per_v, time_constant_s, .. }, Input::Voltage) => {
                Self { slope: gain_rad_s_per_v / time_constant_s, rate: 1.0 / time_constant_s }
            }
            (Kind::FirstOrder { .. }, _) => return None,
            (Kind::Inertia { inertia, viscous, drive_gain, .. }, _) => {
                Self { slope: drive_gain / inertia, rate: viscous / inertia }
            }
        };
        (base.slope.is_finite() && base.slope > 0.0 && base.rate.is_finite()).then_some(base)
    }
}

/// The driven stretches of a record.
pub struct Motion {
    stretches: Vec<Stretch>,
    /// Squared variation of all speeds.
    variation: f64,
    fastest: f64,
}

/// A fit at one rate.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// Acceleration per unit of input.
    pub slope: f64,
    /// The rate that it was fitted at.
    pub rate: f64,
    /// The size of every force.
    forces: [f64; FORCES],
    /// Share of the variation that it explains, 1: all.
    pub explained: f64,
}

impl Fitted {
    /// What acts whatever happens.
    pub fn constant(&self) -> f64 {
        self.forces[2]
    }

    /// The settled speed per unit of input over that of a model.
    pub fn gain_over(&self, base: &Base) -> f64 {
        self.slope / base.slope * if base.rate > 0.0 { base.rate / self.rate } else { 1.0 }
    }
}

impl Motion {
    /// The driven stretches of a record, if there is motion in them.
    pub fn of(record: &Dynamic) -> Option<Self> {
        let mut left = ROWS;
        let mut stretches = Vec::new();
        for mut stretch in record.runs.iter().flat_map(driven) {
            if left == 0 {
                break;
            }
            let Stretch { time, input, speed, place } = &mut stretch;
            [time, input, speed, place].into_iter().for_each(|values| values.truncate(left));
            left -= stretch.time.len();
            stretches.push(stretch);
        }
        Self::from(stretches)
    }

    fn from(stretches: Vec<Stretch>) -> Option<Self> {
        let speeds = || stretches.iter().flat_map(|stretch| &stretch.speed);
        let mean = speeds().sum::<f64>() / speeds().count().max(1) as f64;
        let variation: f64 = speeds().map(|speed| (speed - mean).powi(2)).sum();
        let fastest = speeds().fold(0.0_f64, |most, speed| most.max(speed.abs()));
        (variation > 0.0).then_some(Self { stretches, variation, fastest })
    }

    /// Rows of all stretches.
    pub fn rows(&self) -> usize {
        self.stretches.iter().map(|stretch| stretch.time.len()).sum()
    }

    /// The record with the mean of its inputs over rows before and after in the place of each: a linear motion under a mean of inputs
    /// is the mean of motions.
    pub fn smoothed(&self, reach: usize) -> Self {
        self.with_inputs(|input| {
            let rows = |k: usize| k.saturating_sub(reach)..(k + reach + 1).min(input.len());
            let mean = |k: usize| input[rows(k)].iter().sum::<f64>() / rows(k).len() as f64;
            (0..input.len()).map(mean).collect()
        })
    }

    /// The record without the inputs of rows in which the shaft stands, and still stands in the next one: friction holds them.
    pub fn while_moving(&self) -> Self {
        let moves = |speed: &f64| speed.abs() > STANDS * self.fastest;
        let moving = |stretch: &Stretch| {
            let driven = |k: usize| stretch.speed[k..].iter().take(2).any(moves);
            let input = (0..stretch.input.len()).map(|k| if driven(k) { stretch.input[k] } else { 0.0 });
            Stretch { input: input.collect(), ..stretch.clone() }
        };
        Self { stretches: self.stretches.iter().map(moving).collect(), ..*self }
    }

    /// Length of the longest stretch, s.
    pub fn longest_s(&self) -> f64 {
        let length = |stretch: &Stretch| stretch.time[stretch.time.len() - 1] - stretch.time[0];
        self.stretches.iter().map(length).fold(0.0, f64::max)
    }

    /// Share of the square of the speeds that a fit leaves.
    pub fn left(&self, fit: &Fitted) -> f64 {
        let speeds = self.stretches.iter().flat_map(|stretch| &stretch.speed);
        (1.0 - fit.explained) * self.variation / speeds.map(|speed| speed * speed).sum::<f64>()
    }

    /// Both records as one, each with a variation of its own.
    pub fn joined(&self, other: &Self) -> Self {
        Self {
            stretches: self.stretches.iter().chain(&other.stretches).cloned().collect(),
            variation: self.variation + other.variation,
            fastest: self.fastest.max(other.fastest),
        }
    }

    /// The record with another column in the place of its speed, and the speed in the place of its input.
    pub fn swapped(&self) -> Option<Self> {
        let swap = |stretch: &Stretch| Stretch {
            time: stretch.time.clone(),
            input: stretch.speed.clone(),
            speed: stretch.input.clone(),
            place: vec![0.0; stretch.time.len()],
        };
        Self::from(self.stretches.iter().map(swap).collect())
    }

    /// The share that the model explains with any gain within a factor of three and any time constant within four. The gain of a model
    /// that is a fit may be any that is positive.
    pub fn explained_within(&self, base: &Base, fitted: bool) -> f64 {
        let allowed = |fit: &Fitted| {
            let gain = fit.gain_over(base);
            gain > 0.0 && (fitted || (1.0 / GAIN..=GAIN).contains(&gain))
        };
        let fits = of_each(&AROUND, |times| self.fit(times * base.rate)).into_iter();
        fits.filter(allowed).map(|fit| fit.explained).fold(0.0, f64::max)
    }

    /// The best fit at time constants around the model's, itself `times` as fast.
    pub fn near(&self, base: &Base, times: f64) -> Option<Fitted> {
        let mut best = self.best(&AROUND[2..7], base.rate * times)?;
        // A gain is as exact as its rate.
        for step in FINER.into_iter().filter(|_| base.rate > 0.0) {
            for fit in [best.rate * step, best.rate / step].map(|rate| self.fit(rate)) {
                best = if fit.explained > best.explained { fit } else { best };
            }
        }
        Some(best)
    }

    /// The gain over that of the model, where the time constant is about that of the model, and the share that is then explained.
    pub fn gain(&self, base: &Base) -> Option<(f64, f64)> {
        let best = self.best(&AROUND, base.rate)?;
        let gain = best.gain_over(base);
        (gain > 0.0).then_some((gain, best.explained))
    }

    /// The gain of a straight line through the whole record over that of the model: no force takes a part of the input.
    pub fn straight_gain(&self, base: &Base) -> f64 {
        let fits = AROUND.map(|times| self.fit_of(times * base.rate, 1)).into_iter();
        fits.max_by(|a, b| a.explained.total_cmp(&b.explained)).map_or(0.0, |fit| fit.gain_over(base))
    }

    /// The best fit at these multiples of a rate.
    fn best(&self, times: &[f64], rate: f64) -> Option<Fitted> {
        let fits = each(times).map(|times| self.fit(times * rate));
        fits.max_by(|a, b| a.explained.total_cmp(&b.explained))
    }

    /// The share that is explained with any gain near the model's time constant, and with the dead zone that explains most: what it takes
    /// from small inputs would hide a row or two of time.
    pub fn explained_with_a_dead_zone(&self, base: &Base) -> Option<f64> {
        let plain = self.near(base, 1.0).filter(|fit| fit.slope > 0.0)?;
        let largest = self.largest_input();
        let explained = of_each(1..ZONES + 1, |k| {
            let z = largest * WIDEST * k as f64 / ZONES as f64;
            self.driven_by(|u| u - u.clamp(-z, z)).fit(plain.rate).explained
        });
        Some(explained.into_iter().fold(plain.explained, f64::max))
    }

    /// The share that is explained with a gain within a factor of three where the drive clamps its input, or gives nothing below a
    /// threshold: a low limit and a wide dead zone look like a small gain.
    pub fn explained_by_a_drive(&self, base: &Base, fitted: bool) -> f64 {
        let within = |drive: &dyn Fn(f64) -> f64| self.driven_by(drive).explained_within(base, fitted);
        let tried =
            |level: f64| within(&|u| u.clamp(-level, level)).max(within(&|u| u - u.clamp(-level, level)));
        each(&LIMITS).map(|share| tried(share * self.largest_input())).max_by(f64::total_cmp).unwrap_or(0.0)
    }

    fn inputs(&self) -> impl Iterator<Item = &f64> {
        self.stretches.iter().flat_map(|stretch| &stretch.input)
    }

    /// The largest input.
    pub fn largest_input(&self) -> f64 {
        self.inputs().fold(0.0, |most, u| most.max(u.abs()))
    }

    /// Is a twentieth of the rows driven against the others, as hard as those that are fast?
    pub fn is_driven_both_ways(&self) -> bool {
        let rows = self.stretches.iter().flat_map(|it| it.input.iter().zip(&it.speed));
        let fast = rows.filter(|row| row.1.abs() > 0.5 * self.fastest);
        let hard = median(&mut fast.map(|it| it.0.abs()).collect::<Vec<_>>()).max(0.5 * self.largest_input());
        // Rows at the largest input itself always count, whatever its noise. Chosen by judgement; not studied.
        let hard = hard.min(0.95 * self.largest_input());
        let rows = |sign: f64| self.inputs().filter(|u| sign * **u > hard).count();
        20 * rows(1.0).min(rows(-1.0)) > self.rows()
    }

    /// Does hardly a row move against this sign?
    pub fn turns_one_way(&self, sign: f64) -> bool {
        let against = |speed: &&f64| sign * **speed < -BACKWARDS * self.fastest;
        let rows = self.stretches.iter().flat_map(|it| &it.speed).filter(against).count();
        rows as f64 <= STANDS * self.rows() as f64
    }

    /// The record with what a drive makes of its inputs in their place.
    pub fn driven_by(&self, drive: impl Fn(f64) -> f64) -> Self {
        self.with_inputs(|input| input.iter().map(|u| drive(*u)).collect())
    }

    fn with_inputs(&self, of: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let driven = |stretch: &Stretch| Stretch { input: of(&stretch.input), ..stretch.clone() };
        Self { stretches: self.stretches.iter().map(driven).collect(), ..*self }
    }

    /// The best fit at any rate around a first guess.
    pub fn free(&self, base: &Base) -> Option<Fitted> {
        self.best(&std::array::from_fn::<f64, 17, _>(|k| 2f64.powi(k as i32 - 8)), base.rate)
    }

    /// The forces that explain most at a rate.
    pub fn fit(&self, rate: f64) -> Fitted {
        self.fit_of(rate, FORCES)
    }

    /// The same of the first so many forces alone.
    pub fn fit_of(&self, rate: f64, forces: usize) -> Fitted {
        let rows = self.rows();
        let mut matrix = DMatrix::zeros(rows, forces);
        let mut wanted = DVector::zeros(rows);
        let mut row = 0;
        self.responses(rate, |response, free| {
            for (column, value) in response.iter().take(forces).enumerate() {
                matrix[(row, column)] = *value;
            }
            wanted[row] = free;
            row += 1;
        });
        let scales: Vec<f64> = matrix.column_iter().map(|column| column.norm().max(1e-300)).collect();
        for (column, scale) in scales.iter().enumerate() {
            matrix.column_mut(column).scale_mut(1.0 / scale);
        }
        // Under inputs of two levels what a dead zone takes is the input itself, and under one level every force is.
        for column in 1..forces {
            let alike = matrix.column(0).dot(&matrix.column(column));
            if alike.abs() > SAME || column == TAKEN && alike > ALIKE {
                matrix.column_mut(column).fill(0.0);
            }
        }
        let normal = matrix.tr_mul(&matrix) + DMatrix::identity(forces, forces) * 1e-10;
        let solved = normal.cholesky().map(|factor| factor.solve(&matrix.tr_mul(&wanted)));
        let Some(solved) = solved else {
            return Fitted { slope: 0.0, rate, forces: [0.0; FORCES], explained: 0.0 };
        };
        let left = (&wanted - &matrix * &solved).norm_squared();
        let mut forces = [0.0; FORCES];
        for (force, (size, scale)) in forces.iter_mut().zip(solved.iter().zip(&scales)) {
            *force = size / scale;
        }
        Fitted { slope: forces[0], rate, forces, explained: 1.0 - left / self.variation }
    }

    /// The share that a fit to another record explains of this one.
    pub fn explained_by(&self, fit: &Fitted) -> f64 {
        let mut left = 0.0;
        self.responses(fit.rate, |response, free| {
            let said: f64 = fit.forces.iter().zip(response).map(|(size, response)| size * response).sum();
            left += (free - said).powi(2);
        });
        1.0 - left / self.variation
    }

    /// The responses of all stretches, row after row.
    fn responses(&self, rate: f64, mut each: impl FnMut([f64; FORCES], f64)) {
        for stretch in &self.stretches {
            stretch.responses(rate, STANDS * self.fastest, &mut each);
        }
    }
}
