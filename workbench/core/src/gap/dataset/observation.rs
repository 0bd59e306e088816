//! How the outputs of a log are looked at, and one run of it looked at in that way.

use super::noise::hf_noise;
use super::probe::{Grid, Probes};
use super::{GridRun, Scales, position};
use crate::system::log::{Dynamic, Run};
use crate::system::model::{Model, SpeedSensor};
use std::f64::consts::TAU;

/// More rows than this are thinned for the search: fits cost in proportion, and say no more about a motor. A budget
/// of computing time, chosen by judgement.
pub(super) const MOST_BLOCKS: usize = 12_000;
/// A block is never longer than this part of the time constant. Origin: a longer one could not be told from a delay.
const LONGEST_BLOCK: f64 = 1.0 / 40.0;

/// How the outputs are looked at.
pub(super) struct Observation {
    sensor: SpeedSensor,
    pub(super) window_s: f64,
    /// Step of the encoder, as it is declared or as a position shows it, rad or m; 0: neither.
    pub(super) step: f64,
    /// Rows per block.
    pub(super) thinning: usize,
    /// Rows over which a position is differenced, when the speed is derived from it.
    derived_rows: Option<usize>,
    /// Length of the windows over which a position is compared, s.
    pub(super) way_s: Option<f64>,
    pub(super) noise_lag: usize,
    pub(super) notes: Vec<String>,
}

impl Observation {
    pub(super) fn choose(model: &Model, log: &Dynamic, scales: &Scales) -> Self {
        let sample = log.runs[0].sample_s();
        let most = (LONGEST_BLOCK * scales.time / sample).floor().max(1.0) as usize;
        let thinning = log.rows().div_ceil(MOST_BLOCKS).clamp(1, most);
        let mut observation = Self {
            sensor: model.sensors.speed,
            window_s: model.sensors.speed_window_s,
            step: model.encoder.filter(|_| !log.linear).map_or(0.0, |encoder| TAU / encoder.counts_per_rev),
            thinning,
            derived_rows: None,
            way_s: None,
            noise_lag: 0,
            notes: Vec::new(),
        };
        if thinning > 1 {
            observation
                .notes
                .push(format!("{} rows are taken together in blocks of {thinning} for the fits", log.rows()));
        }
        if log.runs.iter().any(|run| run.speed.is_none()) {
            observation.derive(log, scales, sample);
        } else if observation.windowed() {
            let rows = (observation.window_s / sample).round() as usize;
            observation.noise_lag = if thinning == 1 { rows } else { 0 };
        }
        observation
    }

    fn windowed(&self) -> bool {
        let difference = [SpeedSensor::EncoderDifferenceCentred, SpeedSensor::EncoderDifferenceCausal];
        difference.contains(&self.sensor) && self.window_s > 0.0
    }

    /// Standard deviation of the speed by the encoder's steps: both ends of a window are rounded to a count. 0 without a window.
    pub(super) fn resolution(&self) -> f64 {
        if self.window_s > 0.0 && !self.of_position() {
            self.step / (6f64.sqrt() * self.window_s)
        } else {
            0.0
        }
    }

    /// Whether the position is compared and not the speed.
    pub(super) fn of_position(&self) -> bool {
        self.way_s.is_some()
    }

    /// Speed from position differences: the shortest window, from a 40th to a 6th of the time constant, in which the
    /// encoder's steps stay below 0.3 % of full speed. Where they are far above that, the position is compared.
    fn derive(&mut self, log: &Dynamic, scales: &Scales, sample: f64) {
        self.step =
            self.step.max(position::seen_step(log.runs.iter().filter_map(|run| run.position.as_deref())));
        let rough = log.runs[0].position.as_ref().map_or(0.0, |position| hf_noise(position, 0));
        let noise = rough.max(self.step / 12f64.sqrt());
        // Noise of 0.3 % of the speed hides little of what is searched for; a window of a sixth of the time constant smooths it by
        // less than a tenth, one of a fortieth by nothing. Chosen by judgement; not studied.
        let wanted = 2f64.sqrt() * noise / (0.003 * scales.speed);
        let window = wanted.clamp(scales.time / 40.0, scales.time / 6.0).max(sample);
        if 2f64.sqrt() * noise / window > position::COARSE * scales.speed {
            return self.compare_position(log, scales);
        }
        let rows = (window / sample).round().max(1.0) as usize;
        self.derived_rows = Some(rows);
        self.noise_lag = 1;
        self.window_s = rows as f64 * sample;
        self.notes.push(format!(
            "the speed is the position's difference over {:.4} s, in measurement and simulation alike",
            self.window_s
        ));
    }

    /// The position itself, as the way from where a window begins. A simulation of the speed forgets where it came from within
    /// some time constants, while its integral drifts as long as it runs.
    fn compare_position(&mut self, log: &Dynamic, scales: &Scales) {
        let window = position::LONGEST_S.max(position::LONGEST_TIMES * scales.time);
        self.way_s = Some(window);
        let name = if log.linear { "q_m" } else { "theta_rad" };
        self.notes.push(match scales.duration > 1.5 * window {
            true => format!(
                "the log has no speed, so {name} is compared: the way within windows of {window:.2} s, each from the measured position"
            ),
            false => format!("the log has no speed, so {name} is compared: the way from the start of each run"),
        });
    }

    /// The sensor's window for a reading at a time.
    fn window_at(&self, time: f64) -> (f64, f64) {
        match self.sensor {
            SpeedSensor::EncoderDifferenceCausal => (time - self.window_s, time),
            _ => (time - 0.5 * self.window_s, time + 0.5 * self.window_s),
        }
    }
}

pub(super) fn bench_run(run: &Run, log: usize, observation: &Observation) -> GridRun {
    let first_row = blocks(run, observation.thinning);
    let time: Vec<f64> = first_row.iter().map(|row| run.t_s[*row as usize]).collect();
    let rows = run.rows() - 1;
    let mut made = GridRun {
        id: run.id,
        log,
        bridge: first_row[..first_row.len() - 1].iter().map(|row| run.bridge[*row as usize]).collect(),
        position: position(run, &first_row),
        row_time: run.t_s.clone(),
        input: run.input[..rows].to_vec(),
        first_row,
        time,
        ..GridRun::default()
    };
    made.speed = match (observation.way_s, observation.derived_rows) {
        (Some(window), _) => position::ways(&made, window),
        (_, Some(rows)) => derived(run, &made.time, rows),
        _ => logged(run, &made, observation),
    };
    if let Some(current) = &run.current_a {
        made.current = currents(current, &made);
    }
    made
}

/// First row of each block and the last row: blocks end after `thinning` rows and where the bridge changes.
fn blocks(run: &Run, thinning: usize) -> Vec<u32> {
    let last = run.rows() - 1;
    let mut starts = vec![0u32];
    for row in 1..last {
        let full = row - *starts.last().expect("never empty") as usize >= thinning;
        if full || run.bridge[row] != run.bridge[row - 1] {
            starts.push(row as u32);
        }
    }
    starts.push(last as u32);
    starts
}

/// Where the shaft is at the grid's points: measured, or the integral of the measured speed.
fn position(run: &Run, rows: &[u32]) -> Vec<f64> {
    if let Some(position) = &run.position {
        return rows.iter().map(|row| position[*row as usize]).collect();
    }
    let speed = run.speed.as_ref().expect("a log has an output");
    let mut sum = 0.0;
    let mut integral = vec![0.0];
    for k in 1..run.rows() {
        sum += 0.5 * (speed[k] + speed[k - 1]) * (run.t_s[k] - run.t_s[k - 1]);
        integral.push(sum);
    }
    rows.iter().map(|row| integral[*row as usize]).collect()
}

fn derived(run: &Run, time: &[f64], rows: usize) -> Probes {
    let position = run.position.as_ref().expect("derived from it");
    let (grid, mut probes) = (Grid(time), Probes::default());
    let mut row = 0;
    while row + rows < run.rows() {
        let (from, to) = (run.t_s[row], run.t_s[row + rows]);
        let speed = (position[row + rows] - position[row]) / (to - from);
        probes.push_windows(&grid, 0.5 * (from + to), speed, &[(from, to)]);
        row += rows;
    }
    probes
}

fn logged(run: &Run, made: &GridRun, observation: &Observation) -> Probes {
    let speed = run.speed.as_ref().expect("logged");
    let (grid, mut probes) = (Grid(&made.time), Probes::default());
    let end = made.time[made.time.len() - 1];
    for block in 0..made.blocks() {
        let (a, b) = (made.first_row[block] as usize, made.first_row[block + 1] as usize);
        let (start, stop) = (run.t_s[a], run.t_s[b]);
        // The trapezoid over the block's rows is the mean over the block; one row stands for itself.
        let inner: f64 = speed[a + 1..b].iter().sum();
        let measured =
            if b - a == 1 { speed[a] } else { (inner + 0.5 * (speed[a] + speed[b])) / (b - a) as f64 };
        let span = if b - a == 1 { 0.0 } else { stop - start };
        let at = |share: f64| observation.window_at(start + share * span);
        if observation.windowed() {
            // Two-point Gauss quadrature of the moving window over the block.
            let windows =
                if span == 0.0 { vec![at(0.0)] } else { vec![at(0.211_324_865), at(0.788_675_135)] };
            if windows[0].0 >= made.time[0] - 1e-9 && windows[windows.len() - 1].1 <= end + 1e-9 {
                probes.push_windows(&grid, start + 0.5 * span, measured, &windows);
            }
        } else if span == 0.0 {
            probes.push_instant(&grid, start, measured);
        } else {
            probes.push_windows(&grid, start + 0.5 * span, measured, &[(start, stop)]);
        }
    }
    probes
}

/// Currents at their rows' own time; in blocks of several rows, means over the block.
fn currents(current: &[f64], made: &GridRun) -> Probes {
    let (grid, mut probes) = (Grid(&made.time), Probes::default());
    for block in 0..made.blocks() {
        let (a, b) = (made.first_row[block] as usize, made.first_row[block + 1] as usize);
        let (start, stop) = (made.time[block], made.time[block + 1]);
        if b - a == 1 {
            probes.push_instant(&grid, start, current[a]);
        } else {
            let measured = current[a..b].iter().sum::<f64>() / (b - a) as f64;
            probes.push_windows(&grid, start, measured, &[(start, stop)]);
        }
    }
    probes
}
