//! What to measure next: both rivals are simulated on a catalogue of runs, and the run on which they differ most is
//! recommended.

use crate::gap::dataset::{Dataset, FINE, GridRun, Traces};
use crate::gap::fit::initial_guesses::span;
use crate::gap::fit::scored::Scored;
use crate::gap::residual::rms;
use crate::outcome::{Experiment, Segment};
use crate::system::log::Input;
use crate::system::model::Kind;
use crate::system::threads::*;
use crate::text::figures::figure;

/// Samples per time constant of a simulated experiment. Chosen by judgement; not studied.
const SAMPLES: f64 = 50.0;
/// χ² below which two rivals cannot be told apart. Chosen by judgement; not studied.
const SEPARABLE: f64 = 20.0;

/// A run of the catalogue, with its name.
type Protocol = (&'static str, Vec<Segment>);

/// What an experiment would tell about two rivals.
pub struct Separation {
    /// The recommendation.
    pub experiment: Experiment,
    /// In a sentence.
    pub text: String,
}

/// The run of the catalogue that separates two rivals best.
pub fn separation(a: &Scored, b: &Scored) -> Separation {
    let dataset = a.hypothesis.dataset;
    let judged = each(catalogue(dataset)).map(|protocol| (difference(dataset, &protocol.1, a, b), protocol));
    let ((speed, current, samples), (name, profile)) = judged
        .collect::<Vec<_>>()
        .into_iter()
        .max_by(|x, y| x.0.0.total_cmp(&y.0.0))
        .expect("the catalogue is not empty");
    let chi2 = samples * (speed / dataset.sigma).powi(2);
    let (left, right) = (a.label(), b.label());
    let unit = dataset.unit();
    // A first-order model stands for a motor of 1 Ω, whose current is no current.
    let no_current = matches!(a.hypothesis.model.kind, Kind::FirstOrder { .. });
    let by = if no_current { String::new() } else { format!(" by {} A rms", figure(current)) };
    let text = if chi2 > SEPARABLE {
        format!("{name}: {left} and {right} then differ by {} {unit} rms", figure(speed))
    } else if current > 0.0 {
        format!(
            "{name} with the winding current logged: {left} and {right} differ{by} there, but not in speed"
        )
    } else {
        format!("{left} and {right} cannot be separated with these sensors")
    };
    let needs_current = chi2 <= SEPARABLE && dataset.sigma_current.is_none();
    let experiment = Experiment::new(text.clone(), profile, dataset.input.unit());
    Separation { experiment: Experiment { needs_current, ..experiment }, text }
}

/// The experiment with what it takes, as the extended model sees it: nobody wants to find out at the motor.
pub fn with_needs(experiment: Experiment, kept: &Scored) -> Experiment {
    let (dataset, model) = (kept.hypothesis.dataset, kept.hypothesis.model);
    if experiment.profile.is_empty() {
        return experiment;
    }
    let run = bench_run(dataset, &experiment.profile);
    let mut traces = Traces::default();
    run.simulate(&kept.plant(), 0.0, FINE, &mut traces);
    let knows_current =
        matches!(model.kind, Kind::DcMotor { .. }) && dataset.input == Input::Voltage && !model.fitted_to_log;
    let peak = traces.current.iter().fold(0.0_f64, |most, current| most.max(current.abs()));
    Experiment {
        peak_current_a: knows_current.then_some(peak),
        travel: Some(span(&traces.integral)).filter(|travel| travel.is_finite()),
        linear: dataset.linear,
        ..experiment
    }
}

/// Differences of two rivals on a run: rms of speed and current, and the number of samples.
fn difference(dataset: &Dataset, profile: &[Segment], a: &Scored, b: &Scored) -> (f64, f64, f64) {
    let run = bench_run(dataset, profile);
    let (mut left, mut right) = (Traces::default(), Traces::default());
    run.simulate(&a.plant(), 0.0, FINE, &mut left);
    run.simulate(&b.plant(), 0.0, FINE, &mut right);
    let apart = |x: &[f64], y: &[f64]| rms(&x.iter().zip(y).map(|(p, q)| p - q).collect::<Vec<f64>>());
    let (one, other) =
        if dataset.of_position { (&left.integral, &right.integral) } else { (&left.reading, &right.reading) };
    (apart(one, other), apart(&left.current, &right.current), left.reading.len() as f64)
}

/// A profile on a grid.
fn bench_run(dataset: &Dataset, profile: &[Segment]) -> GridRun {
    let step = dataset.scales.time / SAMPLES;
    let mut run = GridRun { time: vec![0.0], ..GridRun::default() };
    for segment in profile {
        for _ in 0..(segment.seconds / step).round().max(1.0) as usize {
            run.time.push(run.time[run.time.len() - 1] + step);
            run.bridge.push(segment.bridge);
            run.input.push(segment.u_v.unwrap_or(0.0));
        }
    }
    run.row_time = run.time.clone();
    run.first_row = (0..run.time.len() as u32).collect();
    run
}

/// Runs that a test rig can do, in units of the largest input and the time constant. Three time constants bring a speed within
/// 5 % of where it goes, and a release to rest; 0.8 and 0.25 turn it back while it still changes, where winding and lag show;
/// 25 warm a winding; the small levels lie about a usual dead zone. Chosen by judgement along these lines; not studied.
fn catalogue(dataset: &Dataset) -> Vec<Protocol> {
    let inputs = Inputs::of(dataset);
    let drive = |share: f64, taus: f64| inputs.drive(share, taus);
    let coast = Segment::open(3.0 * inputs.tau);
    let stairs = inputs.levels(&[0.2, 0.4, 0.7, 1.0, -0.2, -0.4, -0.7, -1.0], 2.0);
    let crawl = inputs.levels(&[0.05, 0.1, 0.2, -0.05, -0.1, -0.2], 1.5);
    vec![
        ("square reversals at 80 % of the largest input", times(&[drive(0.8, 0.8), drive(-0.8, 0.8)], 6)),
        ("coast-downs from both directions", vec![drive(0.75, 3.0), coast.clone(), drive(-0.75, 3.0), coast]),
        ("a slow crawl through zero", times(&crawl, 2)),
        ("a staircase to the largest input in both directions", stairs),
        (
            "releases from the largest input to half of it",
            vec![drive(1.0, 3.0), drive(0.5, 2.0), drive(-1.0, 3.0), drive(-0.5, 2.0)],
        ),
        ("fast reversals at the largest input", times(&[drive(1.0, 0.25), drive(-1.0, 0.25)], 16)),
        ("a long run at the largest input and a step down", vec![drive(1.0, 25.0), drive(0.3, 4.0)]),
    ]
}

/// Inputs in units of the largest one, durations in time constants.
pub struct Inputs {
    full: f64,
    tau: f64,
}

impl Inputs {
    /// Those of a dataset.
    pub fn of(dataset: &Dataset) -> Self {
        Self { full: dataset.scales.input, tau: dataset.scales.time }
    }

    /// One input, held.
    pub fn drive(&self, share: f64, taus: f64) -> Segment {
        Segment::driven(share * self.full, taus * self.tau)
    }

    /// Several inputs, each held as long.
    pub fn levels(&self, shares: &[f64], taus: f64) -> Vec<Segment> {
        shares.iter().map(|share| self.drive(*share, taus)).collect()
    }
}

/// The same pieces several times.
pub fn times(pieces: &[Segment], times: usize) -> Vec<Segment> {
    std::iter::repeat_n(pieces, times).flatten().cloned().collect()
}
