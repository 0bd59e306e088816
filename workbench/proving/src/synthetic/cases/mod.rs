//! Hidden cases: data in which an effect is hidden, and the answer kept apart.
//!
//! ```text
//! seed → motor → hidden effects → excitation → truth (second integrator) → sensors → model.toml, log.csv, holdout.csv
//!                                                                               └→ answer.json, elsewhere
//! ```
//!
//! The model file claims the base motor within its tolerance; what is hidden is not in it. Design and evaluation seeds
//! are disjoint, and so are the cases of different sets.

pub mod base;
pub mod hidden;
pub mod outside;
pub mod protocol;
pub mod sensing;
pub mod sheet;

use base::{Claim, Natural};
use hidden::{Hidden, Subject};
use outside::{OUTSIDERS, Outsider};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sensing::{Input, Sensors};
use serde::Serialize;
use sheet::Sheet;
use std::collections::BTreeMap;
use truing_core::outcome::Segment;
use truing_core::system::effects::Effect;

/// What is hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Set {
    /// Nothing: the model is right within its tolerance.
    Nothing,
    /// One effect of the library, from barely visible to large.
    Single,
    /// Two effects, each visible.
    Pair,
    /// Three effects, each visible.
    Triple,
    /// One effect that the library does not hold, plainly visible.
    Outside,
    /// Four effects, each visible.
    Quadruple,
}

impl Set {
    /// Number of effects of the library that hide.
    fn effects(self) -> usize {
        match self {
            Self::Nothing | Self::Outside => 0,
            Self::Single => 1,
            Self::Pair => 2,
            Self::Triple => 3,
            Self::Quadruple => 4,
        }
    }
}

/// What to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// What is hidden.
    pub set: Set,
    /// Rows of log and hold-out.
    pub rows: usize,
    /// True if the current is logged; `None`: in three of ten cases.
    pub current: Option<bool>,
    /// Coloured noise with spikes, every input twice; `None`: in one of ten cases.
    pub dirty: Option<bool>,
    /// Rms noise of the speed as a part of full speed; `None`: 0.001 … 0.01.
    pub noise: Option<f64>,
    /// Evaluation seeds instead of design seeds.
    pub evaluation: bool,
}

impl Spec {
    /// The set with 3,000 rows and everything else at random.
    pub fn new(set: Set) -> Self {
        Self { set, rows: 3000, current: None, dirty: None, noise: None, evaluation: false }
    }

    /// The random source of a case: sets, and design against evaluation, in bits that the number cannot reach.
    fn rng(&self, seed: u32) -> ChaCha8Rng {
        let number = u64::from(seed) | (self.set as u64) << 40 | u64::from(self.evaluation) << 63;
        ChaCha8Rng::seed_from_u64(number)
    }
}

/// A hidden effect in the answer.
#[derive(Clone, Debug, Serialize)]
pub struct HiddenEffect {
    /// Name.
    pub name: &'static str,
    /// True parameters, in the library's convention.
    pub parameters: BTreeMap<&'static str, f64>,
    /// Rms change of the speed when this effect alone is taken away, in units of the noise; the smaller of log and
    /// hold-out.
    pub visibility: f64,
    /// True if the truth has the library's form.
    pub form_in_library: bool,
}

/// The answer, kept apart from the data.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// `truing-answer/1`.
    pub schema: &'static str,
    /// Set.
    pub set: Set,
    /// Seed within the set.
    pub seed: u32,
    /// What is hidden.
    pub hidden: Vec<HiddenEffect>,
    /// Kind outside the library.
    pub outside: Option<&'static str>,
    /// The motor's own base parameters.
    pub base: Claim,
    /// Those of the model file.
    pub claimed: Claim,
    /// Declared tolerance.
    pub tolerance: f64,
    /// Coloured noise with spikes.
    pub dirty: bool,
    /// True if the current is logged.
    pub current_logged: bool,
    /// Rms of the hold-out's speed noise, rad/s.
    pub noise_rms: f64,
    /// Steady speed at full voltage, rad/s.
    pub full_speed: f64,
}

/// A case: what the analysis gets, and what it does not.
#[derive(Clone, Debug)]
pub struct Case {
    /// Text of `model.toml`.
    pub model: String,
    /// The log.
    pub log: Sheet,
    /// The hold-out.
    pub holdout: Sheet,
    /// The answer.
    pub answer: Answer,
    /// Speed of the hold-out as a sensor without noise reports it, rad/s.
    pub noiseless: Vec<f64>,
    /// What was measured: it can be measured again.
    pub rig: Rig,
}

/// The motor of a case with its sensors.
#[derive(Clone, Debug)]
pub struct Rig {
    /// The motor, and what hides in it.
    pub subject: Subject,
    /// Its sensors.
    pub sensors: Sensors,
    /// The motor's natural scales.
    pub natural: Natural,
}

impl Rig {
    /// Runs a suggested experiment.
    pub fn follow(&self, profile: &[Segment], seed: u64) -> Sheet {
        let input = Input::of_profile(profile, self.natural.volts, self.sensors.interval_s);
        self.run(&input, seed)
    }

    /// Runs a random protocol of so many rows.
    pub fn excite(&self, rows: usize, seed: u64) -> Sheet {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        self.run(&Input::draw(&mut rng, &self.natural, &self.sensors, rows, true), seed)
    }

    fn run(&self, input: &Input, seed: u64) -> Sheet {
        let truth = input.simulate(&self.subject, &self.sensors, seed);
        input.measure(&truth, &self.subject, &self.sensors, None, seed)
    }
}

/// Smallest visibility of an effect beside others, σ.
const VISIBLE: f64 = 0.3;
/// Smallest visibility of an effect outside the library, σ.
const PLAIN: f64 = 5.0;
/// Draws until a case meets those.
const TRIES: usize = 40;

/// Draws case `seed` of a set.
pub fn draw(spec: &Spec, seed: u32) -> Case {
    let mut rng = spec.rng(seed);
    for _ in 1..TRIES {
        if let (true, case) = attempt(spec, seed, &mut rng) {
            return case;
        }
    }
    attempt(spec, seed, &mut rng).1
}

/// One try: the case, and whether everything hidden is visible enough.
fn attempt(spec: &Spec, seed: u32, rng: &mut ChaCha8Rng) -> (bool, Case) {
    let (motor, natural) = base::draw(rng);
    let hidden = hidden::choose(spec.set.effects(), rng, &natural);
    let outsider = (spec.set == Set::Outside).then(|| &OUTSIDERS[rng.random_range(0..OUTSIDERS.len())]);
    let draft =
        Draft { natural, motor, hidden, outsider, strength: rng.random_range(0.0..1.0), salt: rng.random() };
    let tacho = draft.hidden.iter().any(|effect| effect.kind.needs_tacho);
    let dirty = spec.dirty.unwrap_or_else(|| rng.random_bool(0.1));
    let sensors = Sensors::draw(rng, &natural, tacho, dirty, spec);
    let coast = rng.random_bool(0.8);
    let log = Input::draw(rng, &natural, &sensors, spec.rows, coast);
    let holdout = Input::draw(rng, &natural, &sensors, spec.rows, coast);
    let case = draft.build(spec, seed, rng, &sensors, dirty, [&log, &holdout]);
    let least = case.answer.hidden.iter().map(|effect| effect.visibility).fold(f64::INFINITY, f64::min);
    let enough = match spec.set {
        Set::Nothing | Set::Single => true,
        Set::Pair | Set::Triple | Set::Quadruple => least >= VISIBLE,
        Set::Outside => draft.visibilities(&sensors, &[&log, &holdout], &[None])[0] >= PLAIN,
    };
    (enough, case)
}

/// A case before it is simulated.
struct Draft {
    natural: Natural,
    motor: crate::synthetic::reference_plant::Motor,
    hidden: Vec<Hidden>,
    outsider: Option<&'static Outsider>,
    strength: f64,
    salt: u64,
}

impl Draft {
    /// The subject without effect `without`, and without the outsider if `inside`.
    fn subject(&self, without: Option<usize>, inside: bool) -> Subject {
        let mut subject = Subject {
            motor: self.motor.clone(),
            reading_scale: 1.0,
            reading_offset: 0.0,
            encoder_at_load: false,
        };
        for (k, effect) in self.hidden.iter().enumerate() {
            if without != Some(k) {
                effect.put_into(&self.natural, &mut subject);
            }
        }
        if let (Some(outsider), false) = (self.outsider, inside) {
            let mut rng = ChaCha8Rng::seed_from_u64(self.salt);
            (outsider.put)(&mut rng, self.strength, &self.natural, &mut subject);
        }
        subject
    }

    /// Rms change of the speed without each of these effects (`None`: without the outsider), over σ; the smaller of the
    /// two records.
    fn visibilities(&self, sensors: &Sensors, inputs: &[&Input; 2], without: &[Option<usize>]) -> Vec<f64> {
        let seen = |input: &Input, subject: &Subject| input.simulate(subject, sensors, self.salt).seen;
        let whole = inputs.map(|input| seen(input, &self.subject(None, false)));
        let change = |&without: &Option<usize>| {
            let less = self.subject(without, without.is_none());
            let of = |k: usize| rms_difference(&whole[k], &seen(inputs[k], &less)) / sensors.sigma;
            of(0).min(of(1))
        };
        without.iter().map(change).collect()
    }

    fn build(
        &self,
        spec: &Spec,
        seed: u32,
        rng: &mut ChaCha8Rng,
        sensors: &Sensors,
        dirty: bool,
        inputs: [&Input; 2],
    ) -> Case {
        let subject = self.subject(None, false);
        let mut noiseless = Vec::new();
        let [log, holdout] = inputs.map(|input| {
            let mut sheet = Sheet::default();
            noiseless.clear();
            for run in 0..if dirty { 2 } else { 1 } {
                let truth = input.simulate(&subject, sensors, rng.random());
                sheet.append(input.measure(&truth, &subject, sensors, dirty.then_some(run), rng.random()));
                noiseless.extend(truth.seen);
            }
            sheet
        });
        let hidden: Vec<&Effect> = self.hidden.iter().map(|hidden| hidden.kind.effect).collect();
        let base = Claim::true_values(&self.motor);
        let claimed = base.with_errors(rng, self.natural.tolerance, &hidden);
        let answer = Answer {
            schema: "truing-answer/1",
            set: spec.set,
            seed,
            hidden: self.reveal(sensors, &inputs),
            outside: self.outsider.map(|outsider| outsider.name),
            base,
            claimed,
            tolerance: self.natural.tolerance,
            dirty,
            current_logged: sensors.current.is_some(),
            noise_rms: rms_difference(holdout.column("omega_rad_s"), &noiseless),
            full_speed: self.natural.speed,
        };
        let model = self.model_file(&claimed, sensors, subject.encoder_at_load);
        let rig = Rig { subject, sensors: *sensors, natural: self.natural };
        Case { rig, model, log, holdout, answer, noiseless }
    }

    fn reveal(&self, sensors: &Sensors, inputs: &[&Input; 2]) -> Vec<HiddenEffect> {
        let each: Vec<Option<usize>> = (0..self.hidden.len()).map(Some).collect();
        let visibilities = self.visibilities(sensors, inputs, &each);
        let reveal = |(effect, visibility): (&Hidden, f64)| HiddenEffect {
            name: effect.kind.effect.name,
            parameters: effect.named_values().collect(),
            visibility,
            form_in_library: effect.form_in_library(),
        };
        self.hidden.iter().zip(visibilities).map(reveal).collect()
    }

    fn model_file(&self, claimed: &Claim, sensors: &Sensors, at_load: bool) -> String {
        let volts = self.natural.volts;
        format!(
            "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n{}gear_ratio = {:.1}\n[tolerance]\ndefault = {}\n\
             [supply]\nnominal_v = {volts:.1}\nlimit_v = {volts:.1}\n{}[log]\nsample_hz = {:.3}\n",
            claimed.table(),
            self.natural.gear_ratio,
            self.natural.tolerance,
            sensors.describe(at_load),
            1.0 / sensors.interval_s,
        )
    }
}

/// Root mean square of a difference.
pub fn rms_difference(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum();
    (sum / a.len().max(1) as f64).sqrt()
}
