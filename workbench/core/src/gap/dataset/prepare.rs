//! From model and logs to a [`Dataset`].

use super::agree::{agree, same_input};
use super::folds::{self, mask_spikes};
use super::noise::hf_noise;
use super::observation::{Observation, bench_run};
use super::position::{self, start_from_position};
use super::rows::{even_rows, unbroken};
use super::start::start_speed;
use super::stretches::Stretches;
use super::{Dataset, GridRun, Probes, Scales, driven_by};
use crate::outcome::Searched;
use crate::system::log::{Dynamic, Input, Run, median};
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::{Drive, Physics};
use crate::text::input_error::InputError;
use std::borrow::{Borrow, Cow};

/// Makes a log and its hold-outs ready: grid, noise, folds. The weights follow from a simulation ([`Dataset::weighed`]).
pub fn prepare(model: &Model, log: &Dynamic, others: &[impl Borrow<Dynamic>]) -> Result<Dataset, InputError> {
    let others: Vec<&Dynamic> = others.iter().map(Borrow::borrow).collect();
    agree(model, log, &others)?;
    let plant = driven_by(&model.kind, model.physics(), log.input);
    let scales = scales(&plant, log)?;
    let observation = Observation::choose(model, log, &scales);
    let gridded = Gridded::of(log, &others, &scales, &observation);
    let noise = Noise::of(&gridded, model, &observation, log, &scales);
    let start = Start { plant, sigma: noise.speed, scales, of_position: observation.of_position() };
    let Gridded { runs, stretches, searched, notes, .. } = gridded;
    let folded = |(index, run): (usize, GridRun)| {
        let current = if noise.current.is_some() { run.current } else { Probes::default() };
        let run = GridRun { current, ..run };
        match &searched {
            Some((some, _)) => started(run, &start, stretches.begins(some[index])),
            None => started(folds::assigned(run, !others.is_empty()), &start, true),
        }
    };
    let runs: Vec<GridRun> = runs.into_iter().enumerate().map(folded).collect();
    let logged = log.runs.iter().all(|run| run.speed.is_some()) && observation.thinning == 1;
    Ok(Dataset {
        input: log.input,
        linear: log.linear,
        signal: match (observation.of_position(), log.linear) {
            (false, true) => "v_m_s",
            (false, false) => "omega_rad_s",
            (true, true) => "q_m",
            (true, false) => "theta_rad",
        },
        noise_lag: observation.noise_lag,
        sigma: noise.speed,
        resolution: if logged { observation.resolution() } else { 0.0 },
        fastest: largest(runs.iter().flat_map(|run| run.speed.measured.iter().copied())),
        sigma_current: noise.current,
        twins: match &searched {
            Some((some, _)) => stretches.twins(some),
            None => twins(&runs, scales.input).into_iter().collect(),
        },
        runs,
        scales,
        of_position: observation.of_position(),
        position_logged: log.runs.iter().all(|run| run.position.is_some()),
        notes: notes.into_iter().chain([folds::said(&others)]).collect(),
        searched: searched.map(|(_, found)| found),
    })
}

/// Log and hold-outs on their grids: short ones as a whole, of long ones some stretches.
struct Gridded<'a> {
    runs: Vec<GridRun>,
    stretches: Stretches<'a>,
    /// The stretches that the search runs on.
    searched: Option<(Vec<usize>, Searched)>,
    /// Runs from which the noise is estimated where others are searched: those were chosen because much happens in them.
    evenly: Option<Vec<GridRun>>,
    notes: Vec<String>,
}

impl<'a> Gridded<'a> {
    fn of(log: &'a Dynamic, others: &[&'a Dynamic], scales: &Scales, observation: &Observation) -> Self {
        let (mut notes, mut gaps) = (observation.notes.clone(), Vec::new());
        let stretches = Stretches::of(log, others, scales, observation, &mut gaps);
        let Some(some) = stretches.searched() else {
            let logs = std::iter::once(&log).chain(others).enumerate();
            let mut runs = Vec::new();
            for (index, source) in logs {
                let whole = source
                    .runs
                    .iter()
                    .flat_map(|run| unbroken(&even_rows(run.clone()), scales.time, &mut notes));
                runs.extend(whole.map(|run| bench_run(&run, index, observation)));
            }
            return Self { runs, stretches, searched: None, evenly: None, notes };
        };
        let positions = stretches.positions();
        let runs = some.iter().map(|k| stretches.made(*k, observation, positions[*k])).collect();
        let own: Vec<usize> = some.iter().copied().filter(|k| stretches.fitted(*k)).collect();
        let all: Vec<usize> = (0..stretches.len()).filter(|k| stretches.of_log(*k)).collect();
        let found =
            Searched { rows: stretches.rows(&own), of_rows: stretches.rows(&all), stretches: own.len() };
        notes.append(&mut gaps);
        notes.push(found.sentence());
        let evenly = Some(stretches.evenly(observation));
        Self { runs, stretches, searched: Some((some, found)), evenly, notes }
    }
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
pub(super) fn started(mut run: GridRun, start: &Start, begins: bool) -> GridRun {
    mask_spikes(&mut run.speed, start.sigma);
    match (begins, start.of_position) {
        (true, true) => start_from_position(&mut run, start.sigma, &start.scales),
        (true, false) => start_speed(&mut run, &start.plant, start.sigma, start.scales.speed),
        // Its measured speed, which is forgotten before anything is compared.
        (false, false) if run.start_speed.abs() <= start.sigma => run.start_speed = 0.0,
        (false, _) => {}
    }
    run
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

/// Standard deviations of the sensors' noise.
struct Noise {
    /// Of the compared speed or position.
    speed: f64,
    /// Of the current, where every run has one and a winding is driven.
    current: Option<f64>,
}

impl Noise {
    /// From the signals' high frequencies, and not below the declared encoder's steps.
    fn of(
        gridded: &Gridded,
        model: &Model,
        observation: &Observation,
        log: &Dynamic,
        scales: &Scales,
    ) -> Self {
        let encoder = model.encoder.filter(|_| !log.linear);
        let runs = gridded.evenly.as_ref().unwrap_or(&gridded.runs);
        let currents = runs.iter().filter(|run| !run.current.is_empty());
        let mut currents: Vec<f64> = currents.map(|run| hf_noise(&run.current.measured, 0)).collect();
        let compared = currents.len() == runs.len()
            && log.input == Input::Voltage
            && matches!(model.kind, Kind::DcMotor { .. });
        // Files that were simulated without noise still hold the solver's errors: 1e-5 and 1e-4. Chosen by judgement; not studied.
        Self {
            speed: match observation.of_position() {
                true => position::noise(&gridded.runs, encoder),
                false => Self::of_speed(runs, observation).max(1e-5 * scales.speed),
            },
            current: compared.then(|| median(&mut currents).max(1e-4 * scales.current)),
        }
    }

    fn of_speed(runs: &[GridRun], observation: &Observation) -> f64 {
        let noise = |run: &GridRun| hf_noise(&run.speed.measured, observation.noise_lag);
        median(&mut runs.iter().map(noise).collect::<Vec<_>>()).max(observation.resolution())
    }
}

/// The first two runs of the log that have the same input.
fn twins(runs: &[GridRun], largest: f64) -> Option<(usize, usize)> {
    let alike = |a: usize, b: usize| runs[b].log == 0 && same_input(&runs[a].input, &runs[b].input, largest);
    let own = runs.iter().filter(|run| run.log == 0).count();
    let mut pairs = (0..own).flat_map(|a| (a + 1..own).map(move |b| (a, b)));
    pairs.find(|(a, b)| alike(*a, *b))
}
