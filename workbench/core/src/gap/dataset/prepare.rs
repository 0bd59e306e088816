//! From model and logs to a [`Dataset`].

use super::agree::{agree, same_input};
use super::folds::{self, mask_spikes, say_holdout};
use super::noise::{hf_noise, median};
use super::observation::{Observation, bench_run};
use super::position::{self, start_from_position};
use super::probe::Probes;
use super::rows::{on_its_grid, unbroken};
use super::start::start_speed;
use super::stretches::Stretches;
use super::{Dataset, PreparedRun, Scales, driven_by};
use crate::outcome::Searched;
use crate::system::log::{Dynamic, Input, Run};
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::{Drive, Physics};
use crate::text::input_error::InputError;
use std::borrow::{Borrow, Cow};
use std::f64::consts::TAU;

/// Makes a log and its hold-outs ready.
pub fn prepare(model: &Model, log: &Dynamic, others: &[impl Borrow<Dynamic>]) -> Result<Dataset, InputError> {
    let others: Vec<&Dynamic> = others.iter().map(Borrow::borrow).collect();
    agree(model, log, &others)?;
    let plant = driven_by(&model.kind, model.physics(), log.input);
    let scales = scales(&plant, log)?;
    let observation = Observation::choose(model, log, &scales);
    let mut dataset = empty(log, &observation, scales);
    let mut notes = Vec::new();
    let stretches = Stretches::of(log, &others, &scales, &observation, &mut notes);
    let searched = stretches.searched();
    match &searched {
        Some(searched) => {
            dataset.notes.append(&mut notes);
            stretched(&mut dataset, &stretches, searched, &observation);
        }
        None => {
            for (index, source) in std::iter::once(&log).chain(&others).enumerate() {
                let notes = &mut dataset.notes;
                let runs = source.runs.iter().flat_map(|run| unbroken(&on_its_grid(run), scales.time, notes));
                dataset.runs.extend(runs.map(|run| bench_run(&run, index, &observation)));
            }
        }
    }
    dataset.noise_lag = observation.noise_lag;
    let quiet = searched.as_ref().map(|_| stretches.evenly(&observation));
    noise(&mut dataset, model, &observation, quiet.as_deref());
    let start = Start { plant, sigma: dataset.sigma, scales, of_position: dataset.of_position };
    for (index, run) in dataset.runs.iter_mut().enumerate() {
        let stretch = searched.as_ref().map(|searched| searched[index]);
        if stretch.is_none() {
            folds::assign(run, !others.is_empty());
        }
        started(run, &start, stretch.is_none_or(|stretch| stretches.begins(stretch)));
    }
    if searched.is_none() {
        dataset.twins = twins(&dataset).into_iter().collect();
    }
    suspect_units(&mut dataset, &start.plant);
    say_holdout(&mut dataset, &others);
    Ok(dataset)
}

/// A dataset without runs.
fn empty(log: &Dynamic, observation: &Observation, scales: Scales) -> Dataset {
    Dataset {
        input: log.input,
        linear: log.linear,
        runs: Vec::new(),
        scales,
        signal: match (observation.of_position(), log.linear) {
            (false, true) => "v_m_s",
            (false, false) => "omega_rad_s",
            (true, true) => "q_m",
            (true, false) => "theta_rad",
        },
        noise_lag: 0,
        sigma: 0.0,
        sigma_current: None,
        twins: Vec::new(),
        of_position: observation.of_position(),
        position_logged: log.runs.iter().all(|run| run.position.is_some()),
        notes: observation.notes.clone(),
        searched: None,
    }
}

/// Takes stretches of a long log, and says so.
fn stretched(dataset: &mut Dataset, stretches: &Stretches, searched: &[usize], observation: &Observation) {
    let positions = stretches.positions();
    let made = searched.iter().map(|k| stretches.made(*k, observation, positions[*k]));
    dataset.runs = made.collect();
    dataset.twins = stretches.twins(searched);
    let own: Vec<usize> = searched.iter().copied().filter(|k| stretches.fitted(*k)).collect();
    let all: Vec<usize> = (0..stretches.len()).filter(|k| stretches.of_log(*k)).collect();
    let found = Searched { rows: stretches.rows(&own), of_rows: stretches.rows(&all), stretches: own.len() };
    dataset.notes.push(found.sentence());
    dataset.searched = Some(found);
}

/// By what the start of a run is found.
pub(super) struct Start {
    pub plant: Physics,
    pub sigma: f64,
    pub scales: Scales,
    pub of_position: bool,
}

/// Masks spikes and finds the speed from which a run goes on. `begins`: nothing is simulated before its first compared row, so
/// that an error of that speed would be compared.
pub(super) fn started(run: &mut PreparedRun, start: &Start, begins: bool) {
    mask_spikes(&mut run.speed, start.sigma);
    if !begins {
        // Its measured speed, which is forgotten before anything is compared.
        if run.start_speed.abs() <= start.sigma && !start.of_position {
            run.start_speed = 0.0;
        }
        return;
    }
    match start.of_position {
        true => start_from_position(run, start.sigma, &start.scales),
        false => start_speed(run, &start.plant, start.sigma, start.scales.speed),
    }
}

fn scales(plant: &Physics, log: &Dynamic) -> Result<Scales, InputError> {
    let input = largest(log.runs.iter().flat_map(|run| run.input.iter().copied()));
    if input <= 0.0 {
        let what = format!("the input {} is 0 throughout; nothing drives the axis", log.input.column());
        return Err(InputError::file(&log.source, what));
    }
    let speed = largest(log.runs.iter().map(rough_speed).flat_map(Cow::into_owned));
    let torque = plant.torque_per_input() * input;
    let settling = plant.inertia / plant.total_damping().max(1e-300);
    let rising = plant.inertia * speed.max(1e-9) / torque;
    Ok(Scales {
        input,
        torque,
        speed: if speed > 0.0 { speed } else { plant.dc_gain() * input },
        motion: speed,
        time: if plant.drive == Drive::Voltage { settling } else { settling.min(4.0 * rising) },
        current: if plant.drive == Drive::Voltage { input / plant.resistance } else { input },
        resistance: plant.resistance,
        inertia: plant.inertia,
        reachable: (plant.dc_gain() * input).min(plant.torque_per_input() / plant.inertia * swing(log)),
        duration: log.runs.iter().map(|run| run.t_s[run.rows() - 1] - run.t_s[0]).fold(0.0, f64::max),
    })
}

/// The largest change of the input's integral over time within a run.
fn swing(log: &Dynamic) -> f64 {
    let of_run = |run: &Run| {
        let pieces = run.input.iter().zip(run.t_s.windows(2)).map(|(input, t)| input * (t[1] - t[0]));
        let add = |(sum, low, high): (f64, f64, f64), piece| {
            (sum + piece, low.min(sum + piece), high.max(sum + piece))
        };
        let (_, low, high) = pieces.fold((0.0, 0.0, 0.0), add);
        high - low
    };
    log.runs.iter().map(of_run).fold(0.0, f64::max)
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

/// Speeds good enough for a scale: as logged, or position differences over some rows.
fn rough_speed(run: &Run) -> Cow<'_, [f64]> {
    if let Some(speed) = &run.speed {
        return speed.into();
    }
    let position = run.position.as_ref().expect("a log has an output");
    let span = (run.rows() / 200).clamp(1, 50);
    let pair = |k: usize| (position[k + span] - position[k]) / (run.t_s[k + span] - run.t_s[k]);
    (0..run.rows() - span).map(pair).collect()
}

/// Speeds beyond what the largest input can reach by about the factor between rpm and rad/s, 9.55, are called out: less where a
/// missing dead zone or friction takes half of the speed, more where the drive or the model is off besides.
const RPM: std::ops::Range<f64> = 5.0..14.0;

/// Calls out units that cannot be.
fn suspect_units(dataset: &mut Dataset, plant: &Physics) {
    let reachable = plant.dc_gain() * dataset.scales.input;
    let factor = dataset.scales.speed / reachable;
    if plant.drive == Drive::Voltage && RPM.contains(&factor) {
        dataset.notes.push(format!(
            "the speeds lie {factor:.1} times above the no-load speed of {reachable:.0} rad/s: is the column in rpm? (then: --columns \"omega_rad_s=NAME*0.104720\")"
        ));
    }
}

/// The noise of speed and current: from the signals' high frequencies, and not below the declared encoder's steps. `evenly`: runs
/// in place of those of the dataset, which were chosen because much happens in them.
fn noise(dataset: &mut Dataset, model: &Model, observation: &Observation, evenly: Option<&[PreparedRun]>) {
    if observation.of_position() {
        dataset.sigma = position::noise(dataset, model.encoder);
        return;
    }
    let runs = evenly.unwrap_or(&dataset.runs);
    let mut each: Vec<f64> = runs.iter().map(|it| hf_noise(&it.speed.measured, dataset.noise_lag)).collect();
    let mut of_currents: Vec<f64> = runs
        .iter()
        .filter(|run| !run.current.is_empty())
        .map(|run| hf_noise(&run.current.measured, 0))
        .collect();
    let all_currents = of_currents.len() == runs.len();
    let step = match model.encoder {
        Some(encoder) if observation.window_s > 0.0 && !dataset.linear => {
            TAU / encoder.counts_per_rev / (6f64.sqrt() * observation.window_s)
        }
        _ => 0.0,
    };
    dataset.sigma = median(&mut each).max(step).max(1e-5 * dataset.scales.speed);
    if all_currents && dataset.input == Input::Voltage && matches!(model.kind, Kind::DcMotor { .. }) {
        dataset.sigma_current = Some(median(&mut of_currents).max(1e-4 * dataset.scales.current));
    } else {
        dataset.runs.iter_mut().for_each(|run| run.current = Probes::default());
    }
}

/// The first two runs of the log that have the same input.
fn twins(dataset: &Dataset) -> Option<(usize, usize)> {
    let runs = &dataset.runs;
    let alike = |a: usize, b: usize| {
        runs[b].log == 0 && same_input(&runs[a].input, &runs[b].input, dataset.scales.input)
    };
    let own = runs.iter().filter(|run| run.log == 0).count();
    let mut pairs = (0..own).flat_map(|a| (a + 1..own).map(move |b| (a, b)));
    pairs.find(|(a, b)| alike(*a, *b))
}
