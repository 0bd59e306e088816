//! Numbers that `truing start` leaves open: `cargo run -p evaluation -- start-models --motors 200 --design`.
//!
//! Motors with one hidden effect are logged without a current. The model states what a label tells, resistance and motor constant with a
//! tenth of error, and the inertia is unknown. Asked is whether the effect is named, how far its size in volts is off, and whether the
//! truth lies within two of the ± that are told.

use evaluation::Results;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use truing::gap::{self, Options};
use truing::outcome::{Outcome, Value};
use truing::system::effects;
use truing::system::log::{Dynamic, Input, Log, Run};
use truing::system::model::{self, Model};

#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Motors to draw.
    #[arg(long, default_value_t = 200)]
    motors: u64,
    /// Use design seeds: to look at single motors while building.
    #[arg(long)]
    design: bool,
    /// Show each motor.
    #[arg(long)]
    each: bool,
    #[command(flatten)]
    results: Results,
}

/// Evaluation seeds begin here, design seeds at 0.
const EVALUATION: u64 = 1_000_000;
/// Relative error of what a label tells, one standard deviation; `truing start` writes the same tolerance.
const LABEL: f64 = 0.1;
/// Steps of the simulation a row.
const STEPS: usize = 40;
/// Inputs as parts of the supply.
const LEVELS: [f64; 14] = [0.0, 1.0, -0.5, 0.25, -1.0, 0.4, 0.12, -0.12, 0.8, 0.0, 0.6, -0.7, 0.3, -0.2];

/// What is hidden: a torque, N m, or a voltage, V.
#[derive(Clone, Copy, Debug)]
enum Hidden {
    Friction(f64),
    Load(f64),
    DeadZone(f64),
    Saturation(f64),
}

impl Hidden {
    /// The effect, its parameter, the figure in volts and the truth of the parameter. A load that brakes is a negative torque.
    fn told(self) -> (&'static str, &'static str, &'static str, f64) {
        match self {
            Self::Friction(torque) => (effects::COULOMB_FRICTION.name, "level_nm", "level_v", torque),
            Self::Load(torque) => (effects::CONSTANT_LOAD.name, "torque_nm", "torque_v", -torque),
            Self::DeadZone(volts) => (effects::DEAD_ZONE.name, "half_width_v", "half_width_v", volts),
            Self::Saturation(volts) => (effects::VOLTAGE_SATURATION.name, "limit_v", "limit_v", volts),
        }
    }
}

struct Motor {
    supply: f64,
    resistance: f64,
    constant: f64,
    inertia: f64,
    viscous: f64,
    hidden: Hidden,
    /// Relative to the fastest speed.
    noise: f64,
}

impl Motor {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        let mut between = |low: f64, high: f64| (rng.random_range(low.ln()..high.ln())).exp();
        let (supply, resistance, constant) = (between(6.0, 24.0), between(0.5, 20.0), between(0.01, 0.1));
        let damping = constant * constant / resistance;
        let (time_constant, part, viscous) =
            (between(0.03, 0.3), between(0.03, 0.15), damping * between(0.002, 0.05));
        let noise = between(0.0005, 0.01);
        let torque = part * supply * constant / resistance;
        let hidden = match rng.random_range(0..4) {
            0 | 1 => Hidden::Friction(torque),
            2 => Hidden::DeadZone(part * supply),
            _ if rng.random_bool(0.5) => Hidden::Load(torque),
            _ => Hidden::Saturation((1.0 - 2.0 * part) * supply),
        };
        let inertia = time_constant * (damping + viscous);
        Self { supply, resistance, constant, inertia, viscous, hidden, noise }
    }

    fn time_constant(&self) -> f64 {
        self.inertia / (self.constant * self.constant / self.resistance + self.viscous)
    }

    /// Speed after a step of the simulation.
    fn stepped(&self, omega: f64, input: f64, h: f64) -> f64 {
        let (input, friction, load) = match self.hidden {
            Hidden::Friction(torque) => (input, torque, 0.0),
            Hidden::Load(torque) => (input, 0.0, torque),
            Hidden::DeadZone(volts) => (input - input.clamp(-volts, volts), 0.0, 0.0),
            Hidden::Saturation(volts) => (input.clamp(-volts, volts), 0.0, 0.0),
        };
        let current = (input - self.constant * omega) / self.resistance;
        let free = omega + h / self.inertia * (self.constant * current - self.viscous * omega - load);
        let grip = h / self.inertia * friction;
        if free > 0.0 { (free - grip).max(0.0) } else { (free + grip).min(0.0) }
    }

    fn log(&self, rng: &mut ChaCha8Rng) -> Dynamic {
        let (row, hold) = (self.time_constant() / 15.0, 60);
        let mut run = Run::default();
        let mut omega = 0.0;
        for k in 0..hold * LEVELS.len() * 2 {
            // The second time the levels come in another order, so that held-out pieces are no copies.
            let place = k / hold;
            let level = LEVELS[if place < LEVELS.len() { place } else { (5 * place + 3) % LEVELS.len() }];
            run.t_s.push(k as f64 * row);
            run.input.push(level * self.supply);
            run.speed.get_or_insert_default().push(omega);
            for _ in 0..STEPS {
                omega = self.stepped(omega, level * self.supply, row / STEPS as f64);
            }
        }
        let fastest = run.speed.iter().flatten().fold(0.0, |most: f64, it| most.max(it.abs()));
        for reading in run.speed.iter_mut().flatten() {
            let noise: f64 = StandardNormal.sample(rng);
            *reading += self.noise * fastest * noise;
        }
        run.bridge = vec![servo::axis::Bridge::Driven; run.t_s.len()];
        Dynamic {
            source: "log.csv".into(),
            input: Input::Voltage,
            linear: false,
            runs: vec![run],
            names: Default::default(),
        }
    }

    /// What `truing start --resistance --kt` writes.
    fn model(&self, log: &Dynamic, rng: &mut ChaCha8Rng) -> Model {
        let mut label = |value: f64| {
            let error: f64 = StandardNormal.sample(rng);
            value * (1.0 + LABEL * error.clamp(-2.0, 2.0))
        };
        let (resistance, constant) = (label(self.resistance), label(self.constant));
        let text = format!(
            "schema = \"truing-model/1\"\n[motor]\nR_ohm = {resistance}\nKt_nm_per_a = {constant}\n[tolerance]\ndefault = 0.05\n\
             R_ohm = {LABEL}\nKt_nm_per_a = {LABEL}\nJ_kgm2 = 1.0\n"
        );
        let draft = model::parse_draft("model.toml", &text).expect("a model");
        gap::completed(draft, &Log::Dynamic(log.clone())).expect("completed from the log")
    }
}

/// What became of a motor.
struct Answer {
    /// The effect is named, or stands in a tie.
    named: bool,
    /// Relative error of the size in volts.
    volts: Option<f64>,
    /// Errors of the parameter and of the volts in their ±.
    sigmas: [Option<f64>; 2],
}

fn answered(motor: &Motor, outcome: &Outcome) -> Answer {
    let (name, parameter, figure, truth) = motor.hidden.told();
    let found = outcome.effects.iter().find(|effect| effect.name == name);
    // Without a current a load is an offset of the input: that stands for it in a tie.
    let offset = outcome.effects.iter().find(|effect| effect.name == effects::VOLTAGE_OFFSET.name);
    let tied = outcome.ties.iter().flat_map(|tie| &tie.rivals).any(|rival| *rival == [name]);
    let in_volts = match motor.hidden {
        Hidden::Friction(_) | Hidden::Load(_) => truth * motor.resistance / motor.constant,
        Hidden::DeadZone(volts) | Hidden::Saturation(volts) => volts,
    };
    let sigmas = |value: Option<&Value>, truth: f64| {
        value.and_then(|value| Some((value.value - truth).abs() / value.std?))
    };
    let size = found.and_then(|effect| effect.parameters.get(parameter));
    let volts = found.and_then(|effect| effect.derived.get(figure)).or(size.filter(|_| figure == parameter));
    let volts = volts.or(offset.filter(|_| tied).and_then(|effect| effect.parameters.get("offset_v")));
    Answer {
        named: found.is_some() || tied,
        volts: volts.map(|volts| (volts.value / in_volts - 1.0).abs()),
        sigmas: [sigmas(size, truth), sigmas(volts, in_volts)],
    }
}

pub fn run(arguments: Arguments) {
    let first = if arguments.design { 0 } else { EVALUATION };
    let of_seed = |seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let motor = Motor::draw(&mut rng);
        let log = motor.log(&mut rng);
        let model = motor.model(&log, &mut rng);
        let outcome = gap::run(&model, &log, &[], &Options::default(), &|_| {}).expect("files that agree");
        let answer = answered(&motor, &outcome);
        if arguments.each {
            let names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
            println!(
                "{seed} {:?} {:?} {names:?} volts off {:?}, off in ± {:?}",
                motor.hidden, outcome.verdict, answer.volts, answer.sigmas
            );
        }
        answer
    };
    let answers: Vec<Answer> = (first..first + arguments.motors).into_par_iter().map(of_seed).collect();
    let mut page = arguments.results.page();
    let share = |holds: &dyn Fn(&Answer) -> bool, of: usize| {
        let count = answers.iter().filter(|answer| holds(answer)).count();
        format!("{count} of {of} ({:.1} %)", 100.0 * count as f64 / of.max(1) as f64)
    };
    let named = answers.iter().filter(|answer| answer.named).count();
    let told = |which: usize| answers.iter().filter(|answer| answer.sigmas[which].is_some()).count();
    page.line("| figure | motors |\n|---|---|");
    page.line(format!("| the hidden effect is named | {} |", share(&|it| it.named, answers.len())));
    page.line(format!(
        "| its size in volts is within 3 % | {} |",
        share(&|it| it.volts.is_some_and(|off| off < 0.03), named)
    ));
    for (which, what) in ["its parameter", "its size in volts"].into_iter().enumerate() {
        let within = |it: &Answer| it.sigmas[which].is_some_and(|off| off <= 2.0);
        page.line(format!("| {what} is within 2 ± | {} |", share(&within, told(which))));
    }
    page.close(&format!("{first} to {}", first + arguments.motors - 1));
}
