//! From where the fits of a candidate start: its grid, quantiles of a signal, or a scan for a periodic torque.

use crate::gap::dataset::{COARSE, Dataset, GridRun, Part, Simulation, Traces};
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::problem::in_registers;
use crate::gap::order::by_least;
use crate::system::effects::{Effect, Scale, Signal, Starts};
use crate::system::plant::physics::Physics;
use servo::axis::Bridge;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A threshold is tried where the signal exceeds it in 0.2 % … 50 % of the samples. Chosen by judgement; not studied.
const QUANTILES: [f64; 7] = [0.998, 0.99, 0.97, 0.93, 0.85, 0.7, 0.5];
/// A threshold is also tried at these parts of the largest value of its signal: an input that holds that value for
/// long has no quantile just below it, where a limit of the drive often lies. Origin: design cases; with them 19 of
/// 19 limits of the voltage are named, without them 17.
const BELOW_LARGEST: [f64; 4] = [0.98, 0.95, 0.9, 0.83];
/// Thresholds nearer to each other than this part of the largest value are one start. Chosen by judgement; not
/// studied.
const SAME_THRESHOLD: f64 = 0.01;
/// No row of a log shows what lasts for less than this part of the time between two of them, such as teeth that give way, and its
/// simulation takes hundreds of steps a row. Chosen by judgement; not studied.
const TRACELESS: f64 = 0.01;
/// Periods per turn that are scanned on a rotary axis. Origin: brushed motors cog with the product of slots and
/// poles, 6 to 48 per turn for small ones.
const TURN_HARMONICS: usize = 60;
/// Frequencies that are scanned over a whole log: as many as [`CHANCE`] is computed for. Chosen by judgement,
/// together with it.
const LINES: usize = 400;
/// Peaks of a scan at which fits start. A budget of computing time, chosen by judgement.
const STRONGEST: usize = 3;
/// A line of a periodic torque leaves no other line that is larger than this part of it. Origin: design cases; true
/// lines left 0.2 to 7 %, others 31 to 117 %.
const LEFT: f64 = 0.3;
/// Gain below which a line may be chance. Origin: the largest of 400 lines gains 2·ln(400), about 12, by chance; the
/// reserve is judgement.
const CHANCE: f64 = 20.0;
/// Lines at these ratios belong to the same torque, whose shape is no sine. Chosen by judgement; not studied.
const SAME_TORQUE: [f64; 5] = [1.0, 2.0, 3.0, 0.5, 1.0 / 3.0];
/// Two lines have the same ratio if they agree to within this part. Chosen by judgement; not studied.
const SAME: f64 = 0.03;

/// Are the times of a start long enough for the rows of the log?
fn leaves_a_trace(dataset: &Dataset, effect: &Effect, row: &[f64]) -> bool {
    let run = &dataset.runs[0];
    let apart = (run.row_time[run.row_time.len() - 1] - run.row_time[0]) / (run.row_time.len() - 1) as f64;
    let long = |time: f64| time == 0.0 || time * dataset.scales.time > TRACELESS * apart;
    effect.parameters.iter().zip(row).all(|(parameter, value)| parameter.scale != Scale::Time || long(*value))
}

/// Simulation and residual of a fitted hypothesis: what starts are drawn from.
pub struct Basis {
    plant: Physics,
    traces: Vec<Traces>,
    /// Weighted residual of each run's speed samples; 0 where a sample does not count.
    residuals: Vec<Vec<f64>>,
}

impl Basis {
    /// Simulates the hypothesis on the log's own runs.
    pub fn new(hypothesis: &Hypothesis, x: &[f64]) -> Self {
        let plant = hypothesis.plant(x);
        let (mut traces, mut residuals) = (Vec::new(), Vec::new());
        for (index, run) in hypothesis.dataset.runs.iter().enumerate().filter(|(_, run)| run.log == 0) {
            let mut simulation = Simulation::default();
            let start = hypothesis.start_speed(index, x);
            let (trace, predicted) = simulation.speed(run, &plant, start, COARSE);
            let weighted = |k: usize| {
                let counts = matches!(run.speed.part[k], Part::A | Part::B);
                if counts { (run.speed.measured[k] - predicted[k]) * run.speed.weight[k] } else { 0.0 }
            };
            residuals.push((0..predicted.len()).map(weighted).collect());
            traces.push(trace.clone());
        }
        Self { plant, traces, residuals }
    }

    /// Starts of an effect, in units of its parameters' scales.
    pub fn starts(&self, dataset: &Dataset, effect: &Effect) -> Vec<Vec<f64>> {
        match effect.starts {
            Starts::Grid(rows) | Starts::Rugged(rows, _) => rows
                .iter()
                .filter(|row| leaves_a_trace(dataset, effect, row))
                .map(|row| row.to_vec())
                .collect(),
            Starts::Quantiles(signal, rest) => self.quantiles(dataset, effect, signal, rest),
            Starts::GravityScan => self.gravity(dataset, effect),
            Starts::PositionScan | Starts::TimeScan => self.lines(dataset, effect),
        }
    }

    fn quantiles(&self, dataset: &Dataset, effect: &Effect, signal: Signal, rest: &[f64]) -> Vec<Vec<f64>> {
        let traced = |of: fn(&Traces) -> &Vec<f64>| self.traces.iter().flat_map(of).copied().collect();
        let mut values: Vec<f64> = match signal {
            Signal::Input => own_runs(dataset).flat_map(|run| &run.input).copied().collect(),
            Signal::Speed => traced(|trace| &trace.reading),
            Signal::Current => traced(|trace| &trace.current),
        };
        values.iter_mut().for_each(|value| *value = value.abs());
        values.sort_by(f64::total_cmp);
        let scale = dataset.scales.of(effect.parameters[0].scale);
        let row = |threshold: f64| [&[threshold / scale], rest].concat();
        let largest = values[values.len() - 1];
        let quantiles = QUANTILES.map(|q| values[((values.len() - 1) as f64 * q) as usize]);
        let mut thresholds = [&quantiles[..], &BELOW_LARGEST.map(|part| part * largest)].concat();
        if signal == Signal::Speed {
            thresholds.push(dataset.scales.speed);
        }
        thresholds.sort_by(|a, b| b.total_cmp(a));
        thresholds.dedup_by(|next, kept| (*kept - *next).abs() < SAME_THRESHOLD * largest);
        thresholds.into_iter().map(row).collect()
    }

    fn gravity(&self, dataset: &Dataset, effect: &Effect) -> Vec<Vec<f64>> {
        let ratio = self.plant.gear_ratio;
        let torque = dataset.scales.of(effect.parameters[0].scale);
        // A twentieth of the largest torque is a start that any fit finds its way from. Chosen by judgement; not studied.
        let mut starts: Vec<Vec<f64>> =
            [0.0, FRAC_PI_2, PI, -FRAC_PI_2].iter().map(|phase| vec![0.05 * ratio, *phase]).collect();
        for line in self.scan(dataset, Axis::Position, 1.0 / ratio, 1) {
            starts.push(vec![line.amplitude * ratio / torque, line.phase]);
        }
        starts
    }

    /// Whether what the strongest line of an effect is among these residuals, if its period is looked for, goes with the
    /// effect: `fitted` are the residuals with it. What another effect leaves spreads over many lines, and one of them
    /// takes no other along. `dispersion`: of the residuals, with their correlation.
    pub fn line_goes(&self, fitted: &Self, dataset: &Dataset, effect: &Effect, dispersion: f64) -> bool {
        let Some(line) = self.peaks(dataset, effect).into_iter().next() else { return false };
        let same = |other: &Line| {
            let ratio = other.number / line.number;
            SAME_TORQUE.iter().any(|it| (ratio / it - 1.0).abs() < SAME)
        };
        let left = fitted.peaks(dataset, effect).into_iter().find(|other| !same(other));
        left.is_none_or(|left| left.gain < LEFT * line.gain + CHANCE * dispersion)
    }

    /// Peaks of an effect's scan, the strongest first.
    fn peaks(&self, dataset: &Dataset, effect: &Effect) -> Vec<Line> {
        match effect.starts {
            Starts::PositionScan => self.position_peaks(dataset),
            _ => self.time_peaks(dataset),
        }
    }

    /// Peaks of the scan over the position, the strongest first.
    fn position_peaks(&self, dataset: &Dataset) -> Vec<Line> {
        let span = own_runs(dataset).map(|run| span(&run.position)).fold(0.0, f64::max);
        let (unit, count) = if dataset.linear { (PI / span.max(1e-9), LINES) } else { (1.0, TURN_HARMONICS) };
        // One period per turn without a gear is gravity.
        let gravity = |n: f64| !dataset.linear && n < 1.5 && self.plant.gear_ratio == 1.0;
        let mut lines = self.scan(dataset, Axis::Position, unit, count);
        lines.retain(|line| !gravity(line.number));
        lines
    }

    /// Peaks of the scan over the time, the strongest first.
    fn time_peaks(&self, dataset: &Dataset) -> Vec<Line> {
        let unit = PI / dataset.scales.duration;
        // Twenty times above its corner a motor answers with a twentieth. Chosen by judgement; not studied.
        let count = ((20.0 / dataset.scales.time / unit) as usize).clamp(1, 3 * LINES);
        let mut lines = self.scan(dataset, Axis::Time, unit, count);
        // Fewer than three periods in the log are a drift.
        lines.retain(|line| line.number > 6.0 * unit);
        lines
    }

    fn lines(&self, dataset: &Dataset, effect: &Effect) -> Vec<Vec<f64>> {
        let torque = dataset.scales.of(effect.parameters[0].scale);
        let per = match effect.starts {
            Starts::PositionScan => 1.0,
            _ => TAU * dataset.scales.of(Scale::Frequency),
        };
        let lines = self.peaks(dataset, effect).into_iter().take(STRONGEST);
        lines.map(|line| vec![line.amplitude / torque, line.number / per, line.phase]).collect()
    }

    /// The peaks of a periodic torque, strongest first, among `unit`, 2·`unit`, … `count`·`unit`.
    fn scan(&self, dataset: &Dataset, axis: Axis, unit: f64, count: usize) -> Vec<Line> {
        let runs = own_runs(dataset).enumerate();
        let mut responses: Vec<Response> =
            runs.map(|(index, run)| self.response(index, run, axis, unit)).collect();
        let mut lines: Vec<Line> = Vec::new();
        while lines.len() < count {
            let mut sums = [Sums::default(); ABREAST];
            for response in &mut responses {
                in_registers(|| response.add(&mut sums));
            }
            let numbers = (lines.len() + 1..=count).map(|harmonic| harmonic as f64 * unit);
            let added: Vec<Line> = sums.iter().zip(numbers).map(|(sums, number)| sums.line(number)).collect();
            lines.extend(added);
        }
        let lower = |k: usize, other: Option<&Line>| other.is_none_or(|other| other.gain <= lines[k].gain);
        let peak = |k: &usize| lower(*k, lines[..*k].last()) && lower(*k, lines.get(k + 1));
        let mut peaks: Vec<Line> = (0..lines.len()).filter(peak).map(|k| lines[k]).collect();
        by_least(&mut peaks, |it| -it.gain);
        peaks
    }

    /// The linear motor's response to waves of k·`unit` periods, ready for the first harmonics.
    fn response<'a>(&'a self, index: usize, run: &'a GridRun, axis: Axis, unit: f64) -> Response<'a> {
        let (plant, trace) = (&self.plant, &self.traces[index]);
        let at = |point: usize| match axis {
            Axis::Position if run.position.is_empty() => trace.integral[point] / plant.sensor_scale,
            Axis::Position => run.shaft(plant, point),
            Axis::Time => run.time[point] - run.time[0] + run.since_s,
        };
        let phasor = |k: usize| {
            let half_way = 0.5 * unit * (at(k + 1) - at(k));
            let (base, half) = ((unit * (0.5 * (at(k) + at(k + 1)))).sin_cos(), half_way.sin_cos());
            Phasor { base, now: (0.0, 1.0), half, half_now: (0.0, 1.0), half_way }
        };
        let sign = if axis == Axis::Position { -1.0 } else { 1.0 };
        let block = |k: usize| {
            let h = run.time[k + 1] - run.time[k];
            let damping = if run.bridge[k] == Bridge::Open { plant.viscous } else { plant.total_damping() };
            let half = 0.5 * h * damping / plant.inertia;
            ((1.0 - half) / (1.0 + half), sign * h / plant.inertia / (1.0 + half), h)
        };
        // A sensor that reports the magnitude turns what is missing with the sign of the speed.
        let turned = |k: usize| plant.sensor_rectified && trace.omega[run.speed.block[k] as usize] < 0.0;
        let weight = |k: usize| run.speed.weight[k] * if turned(k) { -1.0 } else { 1.0 };
        Response {
            run,
            residual: &self.residuals[index],
            blocks: (0..run.blocks()).map(block).collect(),
            phasors: (0..run.blocks()).map(phasor).collect(),
            harmonic: 0.0,
            weight: (0..run.speed.len()).map(weight).collect(),
        }
    }
}

/// The runs of the log, without those of held-out records.
fn own_runs(dataset: &Dataset) -> impl Iterator<Item = &GridRun> {
    dataset.runs.iter().filter(|run| run.log == 0)
}

/// From the smallest to the largest.
pub fn span(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    (high - low).max(0.0)
}

#[derive(Clone, Copy, PartialEq)]
enum Axis {
    Position,
    Time,
}

/// A line of a scan: torque amplitude·sin(number·x + phase), with the sign convention of the axis.
#[derive(Clone, Copy)]
struct Line {
    number: f64,
    amplitude: f64,
    phase: f64,
    gain: f64,
}

/// Harmonics that are scanned side by side: one alone waits for its own sums most of the time. Chosen by judgement;
/// not studied.
const ABREAST: usize = 4;

/// One number of each harmonic.
type Each = [f64; ABREAST];

/// exp(i·k·unit·x) in the middle of a block, turned by some harmonics at a time.
#[derive(Clone, Copy)]
struct Phasor {
    base: (f64, f64),
    now: (f64, f64),
    /// The same for half of the way of the block, and that way: a torque that passes many periods in a block is averaged away.
    half: (f64, f64),
    half_now: (f64, f64),
    half_way: f64,
}

impl Phasor {
    /// Turns on by [`ABREAST`] harmonics behind `harmonic`: the means of their sines and cosines over the block.
    #[inline(always)]
    fn turned(&mut self, harmonic: f64) -> (Each, Each) {
        let turn = |(s, c): (f64, f64), (bs, bc): (f64, f64)| (s * bc + c * bs, c * bc - s * bs);
        let (mut sines, mut cosines) = ([0.0; ABREAST], [0.0; ABREAST]);
        for k in 0..ABREAST {
            self.now = turn(self.now, self.base);
            self.half_now = turn(self.half_now, self.half);
            let x = (harmonic + (k + 1) as f64) * self.half_way;
            let kept = if x.abs() < 1e-3 { 1.0 } else { self.half_now.0 / x };
            (sines[k], cosines[k]) = (kept * self.now.0, kept * self.now.1);
        }
        (sines, cosines)
    }
}

/// The linear motor's response to a torque, block by block, and the samples that see it.
struct Response<'a> {
    run: &'a GridRun,
    residual: &'a [f64],
    /// What is left of the speed at the end of each block, what a torque adds to it, and how long the block lasts.
    blocks: Vec<(f64, f64, f64)>,
    /// The wave in every block, and the harmonic that it has been turned to.
    phasors: Vec<Phasor>,
    harmonic: f64,
    /// Weight of each sample, with the sign in which it sees a speed.
    weight: Vec<f64>,
}

impl Response<'_> {
    /// Adds what the next harmonics do to the run.
    #[inline(always)]
    fn add(&mut self, sums: &mut [Sums; ABREAST]) {
        let probes = &self.run.speed;
        let (mut sine, mut cosine) = ([0.0; ABREAST], [0.0; ABREAST]);
        // Ways of both up to the start of each block, for a compared position.
        let mut ways = vec![([0.0; ABREAST], [0.0; ABREAST])];
        let mut sample = 0;
        for (block, ((keep, push, h), phasor)) in self.blocks.iter().zip(&mut self.phasors).enumerate() {
            let (was_sine, was_cosine) = (sine, cosine);
            let (sines, cosines) = phasor.turned(self.harmonic);
            for k in 0..ABREAST {
                sine[k] = keep * sine[k] + push * sines[k];
                cosine[k] = keep * cosine[k] + push * cosines[k];
            }
            let middle = (halfway(&was_sine, &sine), halfway(&was_cosine, &cosine));
            if !probes.from.is_empty() {
                let way = ways[block];
                ways.push((went(&way.0, *h, &middle.0), went(&way.1, *h, &middle.1)));
            }
            while sample < probes.len() && probes.block[sample] as usize == block {
                let seen = match probes.from.get(sample) {
                    None => middle,
                    Some(from) => {
                        let (from, to) = (&ways[*from as usize], &ways[block + 1]);
                        (went(&to.0, -1.0, &from.0), went(&to.1, -1.0, &from.1))
                    }
                };
                let (weight, residual) = (self.weight[sample], self.residual[sample]);
                if residual != 0.0 {
                    for (k, sums) in sums.iter_mut().enumerate() {
                        sums.add(weight * seen.0[k], weight * seen.1[k], residual);
                    }
                }
                sample += 1;
            }
        }
        self.harmonic += ABREAST as f64;
    }
}

#[inline(always)]
fn halfway(from: &Each, to: &Each) -> Each {
    std::array::from_fn(|k| 0.5 * (from[k] + to[k]))
}

#[inline(always)]
fn went(from: &Each, time: f64, speed: &Each) -> Each {
    std::array::from_fn(|k| from[k] + time * speed[k])
}

/// Sums of a two-column least-squares fit of the residual by the linear motor's response to sine and cosine.
#[derive(Clone, Copy, Default)]
struct Sums {
    ss: f64,
    sc: f64,
    cc: f64,
    sr: f64,
    cr: f64,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, s: f64, c: f64, r: f64) {
        self.ss += s * s;
        self.sc += s * c;
        self.cc += c * c;
        self.sr += s * r;
        self.cr += c * r;
    }

    fn line(&self, number: f64) -> Line {
        let determinant = (self.ss * self.cc - self.sc * self.sc).max(1e-300);
        let a = (self.cc * self.sr - self.sc * self.cr) / determinant;
        let b = (self.ss * self.cr - self.sc * self.sr) / determinant;
        Line { number, amplitude: a.hypot(b), phase: b.atan2(a), gain: a * self.sr + b * self.cr }
    }
}
