//! The servo with a hidden nonlinearity: commissioned by the firmware in QEMU, tracked without and with compensation,
//! its log replayed through the library and given to the gap workflow.

use super::{Event, HiddenServo, Listener, Options};
use anyhow::{Context, Result, anyhow, bail};
use servo::config::Config;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;
use truing_core::gap;
use truing_core::outcome::{Curve, Outcome, Plot, Role, Series, Style};
use truing_core::system::model;
use truing_files::log::{self, Columns, Dynamic, Log};
use truing_report::report::section::{Check, Section};
use truing_report::report::{Exporter, model_file::ModelFile, write_atomically};
use truing_servo::device::axis_file;
use truing_servo::device::commission_report::CommissionJson;
use truing_servo::device::link::Wire;
use truing_servo::device::motor::{Door, qemu};
use truing_servo::device::replay::{self, Verdict};
use truing_servo::device::run_log::{RunLog, Tape};
use truing_servo::device::session::{self, Done, Profile, Span, Task};
use truing_servo::device::tracking::{TrackJson, position_error};

/// Length of the commissioning, s: the firmware's default.
const BUDGET_S: f64 = 5.0;
/// Frequency of the tracked sine, Hz.
const SINE_HZ: f64 = 1.0;
/// Peak speed of the sine relative to the rated speed.
const SINE_SPEED: f64 = 0.2;
/// Length of the sine, s.
const SINE_S: f32 = 5.0;
/// The log, as the report names it.
const LOG: &str = "run.csv";

/// Paragraphs in front of the gap workflow in the report.
pub const INTRODUCTION: [&str; 1] = [
    "The workbench starts from the linear model of the data sheet, whose values are off by their tolerance, and from the \
     log of the commissioning and of the sine without compensation. The sine with compensation is held out. It knows \
     nothing of what the chip has found.",
];

/// What the firmware did, and what came of it.
#[derive(Clone, Debug)]
pub struct ServoCase {
    /// Every control tick.
    pub log: RunLog,
    /// What the chip found.
    pub commission: CommissionJson,
    /// The sine without compensation.
    pub track_off: TrackJson,
    /// The sine with compensation.
    pub track_on: TrackJson,
    /// The log through the library on the host.
    pub replay: Verdict,
    spans: [Span; 2],
    csv: PathBuf,
}

impl ServoCase {
    /// Boots the image, commissions, tracks, replays. The log is written to the output folder.
    pub fn run(hidden: &HiddenServo, options: &Options, say: &mut Listener) -> Result<Self> {
        let axis = options.out.join("axis.toml");
        write_atomically(&axis, &hidden.axis_toml())?;
        let config = axis_file::read(&axis)?.config;
        let tasks = [
            Task::Commission { budget_s: BUDGET_S, seed: options.seed as u32 },
            sine(f64::from(config.rated_speed_rad_s), false),
            sine(f64::from(config.rated_speed_rad_s), true),
        ];
        let wire = connect(&hidden.motor_toml(), options, &config)?;
        let result =
            session::run(wire, config, 1, &tasks, &mut |at| say(Event::Progress(at.task, Some(at.share))))?;
        let commission = match result.done.first() {
            Some(Done::Commissioned(outcome)) => CommissionJson::new(outcome, &config)?,
            _ => bail!("the firmware did not report its commissioning"),
        };
        let [Some(off), Some(on)] = [1, 2].map(|at| span(result.done.get(at))) else {
            let refused =
                commission.refused.as_ref().map_or("no reason given", |refused| refused.text.as_str());
            bail!("the firmware refused its commissioning: {refused}");
        };
        let csv = options.out.join(LOG);
        result.log.save(&csv)?;
        let replay = replay::replay(&Tape::read(&csv, &config)?)?;
        if let Some(difference) = &replay.difference {
            bail!("chip and host disagree at tick {}: {}", difference.tick, difference.what);
        }
        Ok(ServoCase {
            track_off: TrackJson::new(&result.log, &off),
            track_on: TrackJson::new(&result.log, &on),
            log: result.log,
            commission,
            replay,
            spans: [off, on],
            csv,
        })
    }

    /// One paragraph for the terminal.
    pub fn describe(&self) -> String {
        let mut text = String::new();
        for (name, unit, number) in self.commission.found.numbers() {
            let value = number.value.map_or("not seen".into(), |value| format!("{value:.4} {unit}"));
            let interval = number.interval(unit).map_or(String::new(), |text| format!(", {text}"));
            let trust = if number.trusted { "trusted" } else { "not trusted" };
            text += &format!("{name:22} {value}{interval}, {trust}\n");
        }
        text += &format!(
            "sine, RMS position error: {:.5} rad without compensation, {:.5} rad with it: {:.1} times better\n",
            self.track_off.position_rms_rad,
            self.track_on.position_rms_rad,
            self.improvement()
        );
        text += &format!(
            "same code, same bits: {} control ticks and {} commissioning replayed on the host, every bit alike",
            self.replay.ticks, self.replay.commissionings
        );
        text
    }

    /// The gap workflow from the data sheet's model; also the text of the extended model.
    pub fn gap(&self, hidden: &HiddenServo, say: &mut Listener) -> Result<(Outcome, String)> {
        let source = hidden.datasheet_toml();
        let model = model::parse("model-before.toml", &source)?;
        let Log::Dynamic(whole) = log::read(&self.csv, &Columns::default())? else {
            bail!("{LOG} was read as a steady-state table");
        };
        let (fit, holdout) = split(whole)?;
        let say = Mutex::new(say);
        let progress = |what: &str| {
            if let Ok(mut say) = say.lock() {
                let what = if what.is_empty() { "fitting candidates" } else { what };
                say(Event::Progress(what, None));
            }
        };
        let begin = Instant::now();
        let outcome = gap::run(&model, &fit, &[holdout], &gap::Options::default(), &progress)?;
        let outcome = Outcome { runtime_s: begin.elapsed().as_secs_f64(), ..outcome };
        let extended = ModelFile { original: &source, origin: LOG }.export(&outcome)?;
        Ok((outcome, extended))
    }

    /// How many times smaller the error is with compensation.
    pub fn improvement(&self) -> f64 {
        self.track_off.position_rms_rad / self.track_on.position_rms_rad
    }

    /// The report's part on the firmware.
    pub fn section(&self) -> Section {
        Section {
            title: "The servo learns its own dead zone".into(),
            text: vec![
                "The firmware image runs in QEMU in lock-step with a motor whose dead zone and saturation it does not \
                 know. It excites the motor, identifies in fixed point, decides what to trust, and tracks a sine without \
                 and with the inverse dead zone; nothing else differs."
                    .into(),
            ],
            plots: self.plots(),
            checks: vec![
                Check {
                    claim: "The same raw integers give the same bits on the host".into(),
                    found: format!("{} control ticks compared, no bit differs", self.replay.ticks),
                    holds: self.replay.identical(),
                },
                Check {
                    claim: "Compensation makes tracking better".into(),
                    found: format!("{:.1} times smaller RMS position error", self.improvement()),
                    holds: self.improvement() > 1.0,
                },
            ],
            ..Section::default()
        }
    }

    fn plots(&self) -> Vec<Plot> {
        let error = |at: usize| self.curve(&self.spans[at], |log, row| position_error(log, row).to_degrees());
        vec![Plot {
            title: "Position error while tracking the sine".into(),
            x_label: "time, s".into(),
            y_label: "set-point − position, °".into(),
            series: vec![
                Series::new("without compensation", error(0), Style::Line).of(Role::Further(2)),
                Series::new("with compensation", error(1), Style::Line).of(Role::Further(0)),
            ],
            ..Plot::default()
        }]
    }

    /// A quantity over the time of a motion, every tenth tick: a plot is not wider than a few thousand points.
    fn curve(
        &self,
        span: &Span,
        quantity: impl Fn(&RunLog, &truing_servo::device::run_log::Row) -> f64,
    ) -> Curve {
        let rows = self.log.rows.iter().filter(|row| (span.start..span.hold).contains(&row.tick)).step_by(10);
        let tick_s = 1.0 / f64::from(self.log.config.tick_hz);
        let (x, y) =
            rows.map(|row| (f64::from(row.tick - span.start) * tick_s, quantity(&self.log, row))).unzip();
        Curve { x, y }
    }
}

fn sine(rated_speed: f64, compensation: bool) -> Task {
    let profile = Profile::Sine {
        amplitude_rad: (SINE_SPEED * rated_speed / (TAU * SINE_HZ)) as f32,
        frequency_hz: SINE_HZ as f32,
        seconds: SINE_S,
    };
    Task::Track { profile, compensation }
}

fn span(done: Option<&Done>) -> Option<Span> {
    match done {
        Some(Done::Tracked(span)) => Some(*span),
        _ => None,
    }
}

/// The hidden motor reaches the virtual motor alone, through a file that is removed when the session has begun.
pub fn connect(motor: &str, options: &Options, config: &Config) -> Result<Box<dyn Wire>> {
    let folder = tempfile::tempdir().context("no temporary folder can be made")?;
    let path = folder.path().join("motor.toml");
    write_atomically(&path, motor)?;
    let image = qemu::Options { image: options.image.clone(), ..qemu::Options::default() };
    Ok(session::connect(&Door::Builtin(path), config, options.seed, &image)?)
}

/// The last run, the sine with compensation, is held out.
fn split(mut whole: Dynamic) -> Result<(Dynamic, Dynamic)> {
    let last = whole.runs.pop().ok_or_else(|| anyhow!("{LOG} holds no run"))?;
    let source = format!("{LOG}, run {}: the sine with compensation", last.id);
    let holdout = Dynamic { source, runs: vec![last], ..whole.clone() };
    Ok((whole, holdout))
}
