//! The integer identifier against a twin in double precision that shares no arithmetic with it: windows by direct
//! convolution with the spline instead of running sums, normal equations by Gaussian elimination instead of LDLᵀ.

use servo::commission::Phase;
use servo::identify::regression::Row;
use servo::identify::solve::{Progress, Solver, Structure};
use servo::identify::spline::Lengths;
use servo::identify::{Params, State};
use servo::units::VoltageQ14;
use trials::commissioning::commission;
use trials::families::{Family, Options, Plant, Seeds, Severity};

/// One tick of a recorded commissioning.
struct Tick {
    count: i32,
    voltage: i32,
    learning: bool,
}

fn record(plant: &Plant) -> Vec<Tick> {
    let mut ticks = Vec::new();
    commission(plant, 5.0, 0, |state, input| {
        let learning = state.phase() == Phase::Learn;
        ticks.push(Tick { count: input.count, voltage: input.voltage.0, learning });
    });
    ticks
}

/// Signals decimated as the identifier does, in double precision; the voltage acts from its tick to the next.
struct Signals {
    count: Vec<f64>,
    voltage: Vec<f64>,
}

impl Signals {
    fn new(ticks: &[Tick], lengths: &Lengths) -> Self {
        let every = 1usize << lengths.decimation;
        let start = ticks[0].count;
        let counts: Vec<f64> = ticks.iter().map(|tick| f64::from(tick.count.wrapping_sub(start))).collect();
        let mut acted = vec![0.0];
        acted.extend(ticks.iter().map(|tick| f64::from(tick.voltage) / 16_384.0));
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        Signals {
            count: counts.chunks_exact(every).map(mean).collect(),
            voltage: acted[..counts.len()].chunks_exact(every).map(mean).collect(),
        }
    }
}

/// `order` boxes of `length` samples, convolved, of unit area.
fn spline(order: usize, length: usize) -> Vec<f64> {
    (0..order).fold(vec![1.0], |kernel, _| {
        let mut wider = vec![0.0; kernel.len() + length - 1];
        for (i, weight) in kernel.iter().enumerate() {
            for slot in &mut wider[i..i + length] {
                *slot += weight / length as f64;
            }
        }
        wider
    })
}

fn filtered(kernel: &[f64], signal: &[f64], last: usize) -> f64 {
    kernel.iter().enumerate().map(|(lag, weight)| weight * signal[last - lag]).sum()
}

/// Speed, acceleration, jerk, voltage of the window that ends with sample `last`; blocks, W₀, nominal supply.
fn window(signals: &Signals, lengths: &Lengths, last: usize) -> [f64; 4] {
    let block = 1usize << lengths.block;
    let scale = f64::from(1u32 << lengths.counts);
    let shift = 1.0 - 0.5 / f64::from(1u32 << lengths.decimation);
    let at = |order: usize, back: usize| filtered(&spline(order, block), &signals.count, last - back);
    let speed = |back: usize| 0.5 * (at(3, back) + at(3, back + 1));
    let speed = speed(0) - speed(block);
    let acceleration = at(2, 0) - 2.0 * at(2, block) + at(2, 2 * block);
    let jerk = at(1, 0) - 3.0 * at(1, block) + 3.0 * at(1, 2 * block) - at(1, 3 * block);
    let kernel = spline(4, block);
    let voltage = (1.0 - shift) * filtered(&kernel, &signals.voltage, last)
        + shift * filtered(&kernel, &signals.voltage, last - 1);
    [speed / scale, acceleration / scale, jerk / scale, voltage]
}

/// Shared structure: γ₊ γ₋ β₊ β₋ α δ.
fn solve(mut system: Vec<Vec<f64>>) -> Vec<f64> {
    let order = system.len();
    for pivot in 0..order {
        for row in pivot + 1..order {
            let (above, below) = system.split_at_mut(row);
            let factor = below[0][pivot] / above[pivot][pivot];
            for (value, reference) in below[0].iter_mut().zip(&above[pivot]).skip(pivot) {
                *value -= factor * reference;
            }
        }
    }
    let mut unknowns = vec![0.0; order];
    for row in (0..order).rev() {
        let known: f64 = (row + 1..order).map(|column| system[row][column] * unknowns[column]).sum();
        unknowns[row] = (system[row][order] - known) / system[row][row];
    }
    unknowns
}

struct Compared {
    dead_zone: [f64; 2],
    gain: f64,
    time_constant: f64,
    rows: usize,
}

/// Largest difference of a window's signals from the twin's, and both solutions' relative differences in %.
fn compare(plant: &Plant) -> (f64, Compared) {
    let scale = plant.config.build().unwrap();
    let params = Params::new(&scale);
    let ticks = record(plant);
    let mut state = State::new(&params, ticks[0].count);
    let lengths = state.lengths;
    let signals = Signals::new(&ticks, &lengths);
    let mut system = vec![vec![0.0; 7]; 6];
    let mut rows = 0;
    let mut worst: f64 = 0.0;
    for (index, tick) in ticks.iter().enumerate() {
        let Some(found) = params.observe(&mut state, tick.count, VoltageQ14(tick.voltage)) else {
            continue;
        };
        if !tick.learning {
            continue;
        }
        if let Some(direction) = params.direction(&state, &found) {
            state.sums[direction].add(&Row::new(&found, direction));
            // The window ended one tick ago; samples are complete every 2^decimation ticks.
            let last = (index >> lengths.decimation) - 1;
            let [w, a, j, u] = window(&signals, &lengths, last);
            let integer = [found.speed, found.acceleration, found.jerk, found.voltage]
                .map(|q| f64::from(q) / 1_048_576.0);
            worst = integer.iter().zip([w, a, j, u]).fold(worst, |worst, (x, y)| worst.max((x - y).abs()));
            add(&mut system, direction as usize, w, a, j, u);
            rows += 1;
        }
    }
    let mut solver = Solver::default();
    solver.start(Structure::Shared);
    while solver.step(&[&state.sums]) != Progress::Solved {
        assert!(solver.busy(), "singular");
    }
    let x = solve(system);
    let found = solver.solution();
    let percent = |value: f64, reference: f64| 100.0 * (value / reference - 1.0).abs();
    let q = |value: i32| f64::from(value) / 1_048_576.0;
    let gain = 0.5 * (x[2] + x[3]) / x[4];
    let compared = Compared {
        dead_zone: [percent(q(found.dead_zone[0]), x[0] / x[2]), percent(q(found.dead_zone[1]), x[1] / x[3])],
        gain: percent(f64::from(found.gain.to_q(24)) / 16_777_216.0, gain),
        time_constant: percent(f64::from(found.time_constant.to_q(20)) / 1_048_576.0, 1.0 / x[4]),
        rows,
    };
    (worst, compared)
}

fn add(system: &mut [Vec<f64>], direction: usize, w: f64, a: f64, j: f64, u: f64) {
    let s = if direction == 0 { 1.0 } else { -1.0 };
    let mut columns = [0.0; 7];
    columns[direction] = -1.0;
    columns[2 + direction] = s * u;
    columns[4] = -s * w;
    columns[5] = -s * j;
    columns[6] = s * a;
    for (i, row) in system.iter_mut().enumerate() {
        for (k, word) in row.iter_mut().enumerate() {
            *word += columns[i] * columns[k];
        }
    }
}

#[test]
fn integers_agree_with_double_precision() {
    for (family, tick_hz) in
        [(Family::G1, 1_000), (Family::G2, 1_000), (Family::G3, 2_000), (Family::G2, 10_000)]
    {
        for number in 0..3 {
            let options = Options { tick_hz, ..Options::default() };
            let plant = Plant::draw(family, Severity::Harsh, Seeds::Evaluation(710_000 + number), &options);
            let (window, found) = compare(&plant);
            println!(
                "{family:?} {tick_hz} Hz: windows {window:.1e}, d {:?} %, K {:.5} %, tau {:.5} %, {} rows",
                found.dead_zone, found.gain, found.time_constant, found.rows
            );
            assert!(found.rows > 100, "{} rows", found.rows);
            // Rounding of Q20 alone is 5e-7.
            assert!(window < 2e-6, "{family:?} {tick_hz} Hz: window differs by {window}");
            let worst =
                found.dead_zone.into_iter().chain([found.gain, found.time_constant]).fold(0.0, f64::max);
            assert!(worst <= 0.01, "{family:?} {tick_hz} Hz: {worst} %");
        }
    }
}
