//! From model and logs to a [`Bench`].

use super::noise::{hf_noise, median};
use super::probe::{Grid, Probes};
use super::{Bench, BenchRun, Part, Scales, Traces, driven_by};
use crate::fit::COARSE;
use crate::input_error::InputError;
use crate::log::{Dynamic, Input, Run};
use crate::model::{Kind, Model, SpeedSensor};
use crate::plant::physics::{Drive, Physics};
use std::f64::consts::TAU;

/// More rows than this are thinned for the search: fits cost in proportion, and say no more about a motor.
const MOST_BLOCKS: usize = 12_000;
/// A block is never longer than this part of the time constant.
const LONGEST_BLOCK: f64 = 1.0 / 40.0;
/// Pieces into which a run is cut for fitting, choosing and holding out.
const PIECES: usize = 16;
/// A gap of so many samples, and of a part of the time constant, starts a new run.
const GAP_SAMPLES: f64 = 20.0;

/// Makes a log and its hold-outs ready.
pub fn prepare(model: &Model, log: &Dynamic, holdouts: &[Dynamic]) -> Result<Bench, InputError> {
    agree(model, log, holdouts)?;
    let plant = driven_by(&model.kind, model.physics(), log.input);
    let scales = scales(&plant, log)?;
    let view = View::choose(model, log, &scales);
    let mut bench = Bench {
        input: log.input,
        linear: log.linear,
        runs: Vec::new(),
        scales,
        signal: if log.linear { "v_m_s" } else { "omega_rad_s" },
        noise_lag: 0,
        sigma: 0.0,
        sigma_current: None,
        twins: None,
        from_position: view.derived_rows.is_some(),
        notes: view.notes.clone(),
    };
    for (index, source) in std::iter::once(log).chain(holdouts).enumerate() {
        for run in source
            .runs
            .iter()
            .flat_map(|run| unbroken(&on_its_grid(run), scales.time, &mut bench.notes))
        {
            bench.runs.push(bench_run(&run, index, &view));
        }
    }
    bench.noise_lag = view.noise_lag;
    noise(&mut bench, model, &view);
    for run in &mut bench.runs {
        parts(run, !holdouts.is_empty());
        mask_spikes(&mut run.speed, bench.sigma);
        start_speed(run, &plant, bench.sigma, bench.scales.speed);
    }
    bench.twins = twins(&bench);
    suspect_units(&mut bench, plant.drive);
    say_holdout(&mut bench, holdouts);
    Ok(bench)
}

/// Model, log and hold-outs must speak of the same axis.
fn agree(model: &Model, log: &Dynamic, holdouts: &[Dynamic]) -> Result<(), InputError> {
    let source = &log.source;
    if matches!(model.kind, Kind::DcMotor { .. } | Kind::FirstOrder { .. }) && log.linear {
        return Err(InputError::file(
            source,
            "has a linear axis (m), but the model turns; use kind = \"inertia\" with mass_kg",
        ));
    }
    if matches!(model.kind, Kind::FirstOrder { .. }) && log.input != Input::Voltage {
        let what = format!(
            "drives the axis by {}, but a first_order model needs u_v",
            log.input.column()
        );
        return Err(InputError::file(source, what));
    }
    if matches!(model.kind, Kind::Inertia { .. }) && model.linear() != log.linear {
        return Err(InputError::file(
            source,
            "and the model disagree on whether the axis is linear (mass_kg, q_m) or turns (inertia_kgm2, theta_rad)",
        ));
    }
    for other in holdouts {
        if (other.input, other.linear) != (log.input, log.linear) {
            let what = format!(
                "has other columns than {source} (input {} against {})",
                other.input.column(),
                log.input.column()
            );
            return Err(InputError::file(&other.source, what));
        }
        if same(log, other) {
            let what = format!(
                "holds the same rows as {source}; a copy proves nothing, give another record or leave --holdout out"
            );
            return Err(InputError::file(&other.source, what));
        }
    }
    Ok(())
}

/// True if two logs hold the same measurements.
fn same(a: &Dynamic, b: &Dynamic) -> bool {
    let outputs = |log: &Dynamic| {
        log.runs
            .iter()
            .map(|run| run.speed.clone().or(run.position.clone()))
            .collect::<Vec<_>>()
    };
    outputs(a) == outputs(b)
}

/// Largest magnitude but for one sample in a thousand.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.map(f64::abs).collect();
    if values.is_empty() {
        return 0.0;
    }
    let rank = (values.len() - 1) - (values.len() - 1) / 1000;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

fn scales(plant: &Physics, log: &Dynamic) -> Result<Scales, InputError> {
    let input = largest(log.runs.iter().flat_map(|run| run.input.iter().copied()));
    if input <= 0.0 {
        let what = format!(
            "the input {} is 0 throughout; nothing drives the axis",
            log.input.column()
        );
        return Err(InputError::file(&log.source, what));
    }
    let speed = largest(log.runs.iter().flat_map(rough_speed));
    let torque = plant.torque_per_input() * input;
    let settling = plant.inertia / plant.total_damping().max(1e-300);
    let rising = plant.inertia * speed.max(1e-9) / torque;
    Ok(Scales {
        input,
        torque,
        speed: if speed > 0.0 {
            speed
        } else {
            plant.dc_gain() * input
        },
        motion: speed,
        time: if plant.drive == Drive::Voltage {
            settling
        } else {
            settling.min(4.0 * rising)
        },
        current: if plant.drive == Drive::Voltage {
            input / plant.resistance
        } else {
            input
        },
        resistance: plant.resistance,
        inertia: plant.inertia,
        reachable: plant.dc_gain() * input,
        duration: log
            .runs
            .iter()
            .map(|run| run.t_s[run.rows() - 1] - run.t_s[0])
            .fold(0.0, f64::max),
    })
}

/// Speeds good enough for a scale: as logged, or position differences over some rows.
fn rough_speed(run: &Run) -> Vec<f64> {
    if let Some(speed) = &run.speed {
        return speed.clone();
    }
    let position = run.position.as_ref().expect("a log has an output");
    let span = (run.rows() / 200).clamp(1, 50);
    let pair = |k: usize| (position[k + span] - position[k]) / (run.t_s[k + span] - run.t_s[k]);
    (0..run.rows() - span).map(pair).collect()
}

/// Cuts a run where samples were dropped for long: what happened there is unknown.
fn unbroken(run: &Run, time_constant: f64, notes: &mut Vec<String>) -> Vec<Run> {
    let longest = (GAP_SAMPLES * run.sample_s()).max(time_constant);
    let mut cuts = vec![0];
    cuts.extend((1..run.rows()).filter(|row| run.t_s[*row] - run.t_s[*row - 1] > longest));
    cuts.push(run.rows());
    let pieces: Vec<Run> = cuts
        .windows(2)
        .filter(|cut| cut[1] - cut[0] >= 8)
        .map(|cut| run.rows_between(cut[0], cut[1], run.id))
        .collect();
    if cuts.len() > 2 {
        notes.push(format!(
            "run {}: {} gaps in time; it is analysed in {} pieces",
            run.id,
            cuts.len() - 2,
            pieces.len()
        ));
    }
    pieces
}

/// Time stamps that a file rounded go back on their even grid; a real jitter stays as it is.
fn on_its_grid(run: &Run) -> Run {
    let mut run = run.clone();
    let last = run.rows() - 1;
    let (start, step) = (run.t_s[0], (run.t_s[last] - run.t_s[0]) / last as f64);
    let even = |k: usize| start + k as f64 * step;
    let rounding = (0..=last)
        .map(|k| (run.t_s[k] - even(k)).abs())
        .fold(0.0, f64::max);
    if rounding < 0.01 * step {
        (0..=last).for_each(|k| run.t_s[k] = even(k));
    }
    run
}

/// Speeds beyond what the largest input can reach by about the factor between rpm and rad/s, 9.55, are called out: less where a
/// missing dead zone or friction takes half of the speed, more where the drive or the model is off besides.
const RPM: std::ops::Range<f64> = 5.0..14.0;

/// Calls out units that cannot be.
fn suspect_units(bench: &mut Bench, drive: Drive) {
    let reachable = bench.scales.reachable;
    let factor = bench.scales.speed / reachable;
    if drive == Drive::Voltage && RPM.contains(&factor) {
        bench.notes.push(format!(
            "the speeds lie {factor:.1} times above the no-load speed of {reachable:.0} rad/s: is the column in rpm? (then: --columns \"omega_rad_s=NAME*0.104720\")"
        ));
    }
}

/// How the outputs are looked at.
struct View {
    sensor: SpeedSensor,
    window_s: f64,
    /// Rows per block.
    thinning: usize,
    /// Rows over which a position is differenced, when the speed is derived from it.
    derived_rows: Option<usize>,
    noise_lag: usize,
    notes: Vec<String>,
}

impl View {
    fn choose(model: &Model, log: &Dynamic, scales: &Scales) -> Self {
        let sample = log.runs[0].sample_s();
        let most = (LONGEST_BLOCK * scales.time / sample).floor().max(1.0) as usize;
        let thinning = log.rows().div_ceil(MOST_BLOCKS).clamp(1, most);
        let mut view = Self {
            sensor: model.sensors.speed,
            window_s: model.sensors.speed_window_s,
            thinning,
            derived_rows: None,
            noise_lag: 0,
            notes: Vec::new(),
        };
        if thinning > 1 {
            view.notes.push(format!(
                "{} rows are taken together in blocks of {thinning} for the fits",
                log.rows()
            ));
        }
        if log.runs.iter().any(|run| run.speed.is_none()) {
            view.derive(model, log, scales, sample);
        } else if view.windowed() {
            let rows = (view.window_s / sample).round() as usize;
            view.noise_lag = if thinning == 1 { rows } else { 0 };
        }
        view
    }

    fn windowed(&self) -> bool {
        let difference = [
            SpeedSensor::EncoderDifferenceCentred,
            SpeedSensor::EncoderDifferenceCausal,
        ];
        difference.contains(&self.sensor) && self.window_s > 0.0
    }

    /// Speed from position differences: the shortest window, from a 40th to a 6th of the time constant, in which the
    /// encoder's steps stay below 0.3 % of full speed.
    fn derive(&mut self, model: &Model, log: &Dynamic, scales: &Scales, sample: f64) {
        let step = model
            .encoder
            .filter(|_| !log.linear)
            .map_or(0.0, |encoder| TAU / encoder.counts_per_rev / 12f64.sqrt());
        let rough = log.runs[0]
            .position
            .as_ref()
            .map_or(0.0, |position| hf_noise(position, 0));
        let noise = step.max(rough);
        let wanted = 2f64.sqrt() * noise / (0.003 * scales.speed);
        let window = wanted.clamp(scales.time / 40.0, scales.time / 6.0).max(sample);
        let rows = (window / sample).round().max(1.0) as usize;
        self.derived_rows = Some(rows);
        self.noise_lag = 1;
        self.window_s = rows as f64 * sample;
        self.notes.push(format!(
            "the speed is the position's difference over {:.4} s, in measurement and simulation alike",
            self.window_s
        ));
    }
}

fn bench_run(run: &Run, log: usize, view: &View) -> BenchRun {
    let first_row = blocks(run, view.thinning);
    let time: Vec<f64> = first_row.iter().map(|row| run.t_s[*row as usize]).collect();
    let rows = run.rows() - 1;
    let mut made = BenchRun {
        id: run.id,
        log,
        bridge: first_row[..first_row.len() - 1]
            .iter()
            .map(|row| run.bridge[*row as usize])
            .collect(),
        position: position(run, &first_row),
        row_time: run.t_s.clone(),
        input: run.input[..rows].to_vec(),
        first_row,
        time,
        ..BenchRun::default()
    };
    made.speed = match view.derived_rows {
        Some(rows) => derived(run, &made.time, rows),
        None => logged(run, &made, view),
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

fn logged(run: &Run, made: &BenchRun, view: &View) -> Probes {
    let speed = run.speed.as_ref().expect("logged");
    let (grid, mut probes) = (Grid(&made.time), Probes::default());
    let end = made.time[made.time.len() - 1];
    for block in 0..made.blocks() {
        let (a, b) = (made.first_row[block] as usize, made.first_row[block + 1] as usize);
        let (start, stop) = (run.t_s[a], run.t_s[b]);
        // The trapezoid over the block's rows is the mean over the block; one row stands for itself.
        let inner: f64 = speed[a + 1..b].iter().sum();
        let measured = if b - a == 1 {
            speed[a]
        } else {
            (inner + 0.5 * (speed[a] + speed[b])) / (b - a) as f64
        };
        let span = if b - a == 1 { 0.0 } else { stop - start };
        let at = |share: f64| view.window_at(start + share * span);
        if view.windowed() {
            // Two-point Gauss quadrature of the moving window over the block.
            let windows = if span == 0.0 {
                vec![at(0.0)]
            } else {
                vec![at(0.211_324_865), at(0.788_675_135)]
            };
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

impl View {
    /// The sensor's window for a reading at a time.
    fn window_at(&self, time: f64) -> (f64, f64) {
        match self.sensor {
            SpeedSensor::EncoderDifferenceCausal => (time - self.window_s, time),
            _ => (time - 0.5 * self.window_s, time + 0.5 * self.window_s),
        }
    }
}

/// Currents at their rows' own time; in blocks of several rows, means over the block.
fn currents(current: &[f64], made: &BenchRun) -> Probes {
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

/// The noise of speed and current: from the signals' high frequencies, and not below the declared encoder's steps.
fn noise(bench: &mut Bench, model: &Model, view: &View) {
    let mut each: Vec<f64> = bench
        .runs
        .iter()
        .map(|run| hf_noise(&run.speed.measured, bench.noise_lag))
        .collect();
    let step = match model.encoder {
        Some(encoder) if view.window_s > 0.0 && !bench.linear => {
            TAU / encoder.counts_per_rev / (6f64.sqrt() * view.window_s)
        }
        _ => 0.0,
    };
    bench.sigma = median(&mut each).max(step).max(1e-5 * bench.scales.speed);
    let mut each: Vec<f64> = bench
        .runs
        .iter()
        .filter(|run| !run.current.is_empty())
        .map(|run| hf_noise(&run.current.measured, 0))
        .collect();
    if each.len() == bench.runs.len()
        && bench.input == Input::Voltage
        && matches!(model.kind, Kind::DcMotor { .. })
    {
        bench.sigma_current = Some(median(&mut each).max(1e-4 * bench.scales.current));
    } else {
        bench
            .runs
            .iter_mut()
            .for_each(|run| run.current = Probes::default());
    }
}

/// Speed at the start from a line through the first samples. A run moves at its start only if its first sample does, and
/// if the plant predicts the first time constant better with that speed than from rest.
fn start_speed(run: &mut BenchRun, plant: &Physics, sigma: f64, full_speed: f64) {
    let samples = run.speed.len().min(6);
    if samples < 3 {
        return;
    }
    let t = |k: usize| run.speed.time[k] - run.time[0];
    let (mut n, mut st, mut sy, mut stt, mut sty) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for k in 0..samples {
        let y = run.speed.measured[k];
        (n, st, sy, stt, sty) = (n + 1.0, st + t(k), sy + y, stt + t(k) * t(k), sty + t(k) * y);
    }
    let slope = (n * sty - st * sy) / (n * stt - st * st).max(1e-300);
    let start = (sy - slope * st) / n;
    let (first, uncertain) = (run.speed.measured[0], 1.2 * sigma);
    let moves = first * start > 0.0 && first.abs().min(start.abs()) > 4.0 * uncertain;
    if moves && sy.abs() / n > 0.01 * full_speed && predicts_better(run, plant, start) {
        run.start_speed = start;
        run.start_sigma = 2.0 * uncertain;
    }
}

/// Whether the plant is nearer to the first time constant of a run from this speed than from rest.
fn predicts_better(run: &BenchRun, plant: &Physics, start: f64) -> bool {
    let end = run.time[0] + plant.time_constant_s();
    let samples = run.speed.time.partition_point(|time| *time < end).max(6);
    let (mut traces, mut predicted) = (Traces::default(), Vec::new());
    let mut error = |speed: f64| {
        run.simulate(plant, speed, COARSE, &mut traces);
        run.speed
            .predict(&run.time, &traces.reading, &traces.integral, &mut predicted);
        let pairs = run.speed.measured.iter().zip(&predicted).take(samples);
        pairs.map(|(y, p)| (y - p) * (y - p)).sum::<f64>()
    };
    error(start) < error(0.0)
}

/// The first two runs of the log that have the same input.
fn twins(bench: &Bench) -> Option<(usize, usize)> {
    let runs = &bench.runs;
    let alike = |a: usize, b: usize| {
        let (x, y) = (&runs[a].input, &runs[b].input);
        let close = |(u, v): (&f64, &f64)| (u - v).abs() <= 1e-6 * bench.scales.input;
        runs[b].log == 0 && x.len() == y.len() && x.iter().zip(y).all(close)
    };
    let own = runs.iter().filter(|run| run.log == 0).count();
    let mut pairs = (0..own).flat_map(|a| (a + 1..own).map(move |b| (a, b)));
    pairs.find(|(a, b)| alike(*a, *b))
}

/// Alternating pieces of a run: fit, choose, and, without hold-out logs, every fourth one held out.
fn parts(run: &mut BenchRun, holdout_given: bool) {
    let (start, end) = (run.time[0], run.time[run.time.len() - 1]);
    for (k, time) in run.speed.time.iter().enumerate() {
        let piece = ((time - start) / (end - start) * PIECES as f64)
            .floor()
            .min(PIECES as f64 - 1.0) as usize;
        run.speed.part[k] = part(piece, run.log, holdout_given);
    }
    for (k, time) in run.current.time.iter().enumerate() {
        let piece = ((time - start) / (end - start) * PIECES as f64)
            .floor()
            .min(PIECES as f64 - 1.0) as usize;
        run.current.part[k] = part(piece, run.log, holdout_given);
    }
}

fn part(piece: usize, log: usize, holdout_given: bool) -> Part {
    match (log, holdout_given, piece % 4) {
        (0, false, 3) => Part::HoldOut,
        (0, _, fold) => {
            if fold % 2 == 0 {
                Part::A
            } else {
                Part::B
            }
        }
        _ => Part::HoldOut,
    }
}

/// Isolated samples far from their neighbours are no motion.
fn mask_spikes(probes: &mut Probes, sigma: f64) {
    let measured = &probes.measured;
    for k in 2..measured.len().saturating_sub(2) {
        let mut near = [
            measured[k - 2],
            measured[k - 1],
            measured[k],
            measured[k + 1],
            measured[k + 2],
        ];
        let middle = median(&mut near);
        let spread = (measured[k + 1] - measured[k - 1]).abs();
        if (measured[k] - middle).abs() > 7.0 * sigma + 2.0 * spread {
            probes.part[k] = Part::Masked;
        }
    }
}

fn say_holdout(bench: &mut Bench, holdouts: &[Dynamic]) {
    let text = if holdouts.is_empty() {
        format!("held out: every fourth of {PIECES} equal pieces of each run")
    } else {
        format!(
            "held out: {}",
            holdouts
                .iter()
                .map(|log| log.source.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        )
    };
    bench.notes.push(text);
}
