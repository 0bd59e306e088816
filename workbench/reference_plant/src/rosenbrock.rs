//! One step of RODAS, the L-stable Rosenbrock method of order 4 with an embedded solution of order 3 and a continuous
//! extension of order 3.
//!
//! ```text
//! (I/(γh) − J) kᵢ = f(t + cᵢh, y + Σ aᵢⱼ kⱼ) + Σ (cᵢⱼ/h) kⱼ + dᵢ h ∂f/∂t,    i = 1 … 6
//! ```
//!
//! Equations and coefficients: E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed., Springer
//! 1996, section IV.7 and table of the code RODAS (first coefficient set).

/// Largest number of states.
pub const N: usize = 11;
/// A state, or its rates. Entries that a motor does not use stay constant.
pub type State = [f64; N];

/// A smooth piece of the equations.
pub trait System {
    /// Indices of the states that move.
    fn moving(&self) -> &[usize];
    /// dy/dt.
    fn rates(&self, t: f64, y: &State) -> State;
    /// True if the rates depend on state `index`.
    fn depends_on(&self, index: usize) -> bool;
    /// True if the rates depend on time itself.
    fn depends_on_time(&self) -> bool;
    /// Natural size of each state: errors and differences are relative to it.
    fn scale(&self) -> &State;
}

/// A step that was tried.
#[derive(Clone, Debug)]
pub struct Step {
    /// Its length, s.
    pub h: f64,
    /// The state at its end.
    pub end: State,
    /// Estimated error relative to the natural sizes (largest of all states).
    pub error: f64,
    start: State,
    bend: [State; 2],
}

impl Step {
    /// The state inside the step, at `fraction` 0 … 1 of its length; third order.
    pub fn at(&self, fraction: f64) -> State {
        let (s, r) = (fraction, 1.0 - fraction);
        std::array::from_fn(|i| {
            self.start[i] * r + s * (self.end[i] + r * (self.bend[0][i] + s * self.bend[1][i]))
        })
    }
}

const GAMMA: f64 = 0.25;
const C: [f64; 6] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
const D: [f64; 6] = [0.25, -0.1043, 0.1035, -0.036_200_000_000_000_23, 0.0, 0.0];
const A: [[f64; 5]; 6] = [
    [0.0; 5],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.946_678_528_081_582_6, 0.255_701_169_898_328_4, 0.0, 0.0, 0.0],
    [3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7, 0.0, 0.0],
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 0.0],
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0],
];
const G: [[f64; 5]; 6] = [
    [0.0; 5],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430_093_356_833_875, -0.206_359_915_709_191_5, 0.0, 0.0, 0.0],
    [-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16, 0.0, 0.0],
    [7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6, 0.0],
    [
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];
const BEND: [[f64; 5]; 2] = [
    [
        10.126_235_083_445_86,
        -7.487_995_877_610_167,
        -34.800_918_615_557_47,
        -7.992_771_707_568_823,
        1.025_137_723_295_662,
    ],
    [
        -0.676_280_339_280_125_3,
        6.087_714_651_680_015,
        16.430_843_208_924_78,
        24.767_225_114_183_86,
        -6.594_389_125_716_872,
    ],
];

/// Tries one step of length `h` from `y` at `t`.
pub fn step(system: &impl System, t: f64, y: &State, h: f64) -> Step {
    let moving = system.moving();
    let f0 = system.rates(t, y);
    let matrix = Matrix::factor(system, t, y, &f0, h);
    let drift = time_slope(system, t, y, &f0, h);
    let mut k = [[0.0; N]; 6];
    let mut end = *y;
    for stage in 0..6 {
        let f = if stage == 0 {
            f0
        } else {
            end = *y;
            for &i in moving {
                end[i] += (0..stage.min(5)).map(|j| A[stage][j] * k[j][i]).sum::<f64>();
            }
            system.rates(t + C[stage] * h, &end)
        };
        let mut right = [0.0; N];
        for (row, &i) in moving.iter().enumerate() {
            let earlier: f64 = (0..stage).map(|j| G[stage][j] * k[j][i]).sum();
            right[row] = f[i] + earlier / h + D[stage] * h * drift[i];
        }
        matrix.solve(&mut right, moving.len());
        for (row, &i) in moving.iter().enumerate() {
            k[stage][i] = right[row];
        }
    }
    for &i in moving {
        end[i] += k[5][i];
    }
    let scale = system.scale();
    let error = moving.iter().map(|&i| (k[5][i] / scale[i]).abs()).fold(0.0, f64::max);
    let bend = BEND.map(|d| std::array::from_fn(|i| (0..5).map(|j| d[j] * k[j][i]).sum()));
    Step { h, end, error: if error.is_finite() { error } else { f64::INFINITY }, start: *y, bend }
}

/// ∂f/∂t by a forward difference over a small part of the step.
fn time_slope(system: &impl System, t: f64, y: &State, f0: &State, h: f64) -> State {
    if !system.depends_on_time() {
        return [0.0; N];
    }
    // 1e-4 of a step: truncation about 1e-4 of a curvature that the error control keeps small, rounding about 1e-12.
    let dt = 1e-4 * h;
    let f = system.rates(t + dt, y);
    std::array::from_fn(|i| (f[i] - f0[i]) / dt)
}

/// I/(γh) − J, factored with partial pivoting.
struct Matrix {
    lu: [[f64; N]; N],
    pivot: [usize; N],
}

impl Matrix {
    fn factor(system: &impl System, t: f64, y: &State, f0: &State, h: f64) -> Self {
        let moving = system.moving();
        let n = moving.len();
        let mut lu = [[0.0; N]; N];
        for (column, &j) in moving.iter().enumerate() {
            if system.depends_on(j) {
                let difference = 1e-7 * y[j].abs().max(system.scale()[j]);
                let mut moved = *y;
                moved[j] += difference;
                let f = system.rates(t, &moved);
                for (row, &i) in moving.iter().enumerate() {
                    lu[row][column] = -(f[i] - f0[i]) / (moved[j] - y[j]);
                }
            }
            lu[column][column] += 1.0 / (GAMMA * h);
        }
        let pivot = eliminate(&mut lu, n);
        Self { lu, pivot }
    }

    fn solve(&self, b: &mut [f64; N], n: usize) {
        for k in 0..n {
            b.swap(k, self.pivot[k]);
        }
        for k in 0..n {
            for row in k + 1..n {
                b[row] -= self.lu[row][k] * b[k];
            }
        }
        for k in (0..n).rev() {
            b[k] /= self.lu[k][k];
            for row in 0..k {
                b[row] -= self.lu[row][k] * b[k];
            }
        }
    }
}

/// In-place LU with row exchanges; returns the exchanges.
fn eliminate(lu: &mut [[f64; N]; N], n: usize) -> [usize; N] {
    let mut pivot = [0; N];
    for k in 0..n {
        let largest = (k..n).max_by(|&a, &b| lu[a][k].abs().total_cmp(&lu[b][k].abs())).unwrap_or(k);
        lu.swap(k, largest);
        pivot[k] = largest;
        let above = lu[k];
        for row in &mut lu[k + 1..n] {
            let factor = row[k] / above[k];
            for (entry, &pivot_entry) in row[k + 1..n].iter_mut().zip(&above[k + 1..n]) {
                *entry -= factor * pivot_entry;
            }
            row[k] = factor;
        }
    }
    pivot
}
