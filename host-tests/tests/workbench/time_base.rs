//! The time of a record: milliseconds under `t_s` are asked about, slow records in seconds are not.

use std::path::Path;
use trials::case_files::opened;
use trials::measured::measured;
use truing::files::log::{self, Columns, Dynamic, Log};
use truing::files::model::{self, Model};
use truing::gap::time_base::check;
use truing::synthetic::cases::{Set, Spec, draw};

const MODEL: &str = "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\ngain_rad_s_per_v = 10\ntime_constant_s = 0.1\n";
const FILES: [&str; 2] = ["log.csv", "holdout.csv"];
const RIGS: [&str; 14] = [
    "andromeda_drive",
    "angel_drive",
    "basebot_drive",
    "durham_arm",
    "durham_elevator",
    "eagle_swerve",
    "frc501_drive",
    "frc5409_drive",
    "laas_acc",
    "odrive_cog",
    "spectrum_shooter",
    "thomas_drive",
    "un_map",
    "xl330_pwm",
];

/// The same rows with the time counted in another unit.
fn counted(log: &Dynamic, factor: f64) -> Dynamic {
    let mut other = log.clone();
    let times = other.runs.iter_mut().flat_map(|run| &mut run.t_s);
    times.for_each(|t| *t *= factor);
    other
}

fn said(model: &Model, log: &Dynamic) -> Option<String> {
    let checked = check(model, log, &Columns::default());
    checked.err().map(|error| error.to_string())
}

fn undeclared(model: &Model) -> Model {
    Model { sample_hz: None, ..model.clone() }
}

/// A record of the first-order motor with a row every `step` seconds.
fn record(step: f64, rows: usize, volts: impl Fn(f64) -> f64, speed: impl Fn(f64, f64) -> f64) -> Dynamic {
    let row = |k: usize| {
        let t = k as f64 * step;
        format!("{t},{},{}", volts(t), speed(t, volts(t)))
    };
    let rows: Vec<String> = (0..rows).map(row).collect();
    let text = format!("t_s,u_v,omega_rad_s\n{}\n", rows.join("\n"));
    match log::parse("log.csv", &text, &Columns::default()).unwrap() {
        Log::Dynamic(log) => log,
        Log::Table(_) => panic!("read as a table"),
    }
}

#[test]
fn milliseconds_under_seconds_are_asked_about() {
    let spec = Spec { rows: 1200, ..Spec::new(Set::Single) };
    for seed in 1..=12 {
        let files = opened(&draw(&spec, seed)).unwrap();
        assert_eq!(said(&files.model, &files.log), None, "seed {seed}");
        for model in [files.model.clone(), undeclared(&files.model)] {
            let text = said(&model, &counted(&files.log, 1e3)).unwrap_or_else(|| panic!("seed {seed}"));
            for part in ["log.csv", "time were in ms", "--columns \"t_s=t_s*0.001\"", "sample_hz"] {
                assert!(text.contains(part), "seed {seed}: `{part}` is not in: {text}");
            }
        }
    }
}

#[test]
fn the_remedy_names_the_file_s_own_column() {
    let files = opened(&draw(&Spec { rows: 1200, ..Spec::new(Set::Single) }, 1)).unwrap();
    let columns: Columns = "t_s=zeit".parse().unwrap();
    let text = check(&files.model, &counted(&files.log, 1e3), &columns).unwrap_err().to_string();
    assert!(text.contains("--columns \"t_s=zeit*0.001\""), "{text}");
}

#[test]
fn slow_records_in_seconds_are_believed() {
    let model = model::parse("model.toml", MODEL).unwrap();
    let dead_zone = |u: f64| 10.0 * u.signum() * (u.abs() - 1.0).max(0.0);
    let noise = |t: f64| 0.3 * (7919.0 * t).sin();
    let switched = |t: f64| {
        if ((t / 120.0) as u32).is_multiple_of(2) { 6.0 } else { -6.0 }
    };
    let warmed = |t: f64| 1.0 - 0.2 * (-(t / 100.0)).exp();
    let slow = [
        ("sweep", record(1.0, 50, |t| t / 2.0 - 12.0, |t, u| dead_zone(u) + noise(t))),
        ("sine", record(1.0, 600, |t| 8.0 * (t / 60.0).sin(), |t, u| dead_zone(u) + noise(t))),
        ("steps", record(1.0, 600, switched, |t, u| dead_zone(u) + noise(t))),
        ("heat", record(1.0, 600, |_| 6.0, |t, u| 10.0 * u * warmed(t) + noise(t))),
        ("heat, switched", record(1.0, 900, switched, |t, u| 10.0 * u * warmed(t % 120.0) + noise(t))),
    ];
    for (name, log) in slow {
        assert_eq!(said(&model, &log), None, "{name}");
    }
}

#[test]
fn a_declared_rate_is_believed() {
    let files = opened(&draw(&Spec { rows: 1200, ..Spec::new(Set::Single) }, 1)).unwrap();
    let slow = counted(&files.log, 1e3);
    let model = Model { sample_hz: Some(1.0 / slow.runs[0].sample_s()), ..files.model };
    assert_eq!(said(&model, &slow), None);
}

#[test]
fn no_measured_rig_is_accused() {
    for rig in RIGS {
        let Some(path) = measured(&format!("rigs/{rig}/model.toml")) else {
            return;
        };
        let declared = model::read(&path).unwrap();
        let read = |name: &str| match log::read(&path.with_file_name(name), &Columns::default()).unwrap() {
            Log::Dynamic(log) => log,
            Log::Table(_) => panic!("{}", Path::new(name).display()),
        };
        let logs = FILES.map(read);
        for model in [undeclared(&declared), declared] {
            for log in &logs {
                assert_eq!(said(&model, log), None, "{rig}");
            }
            // Of settled speeds, and of a current that cogging masks, nothing tells the unit but the declared rate.
            let asked = said(&model, &counted(&logs[0], 1e3)).is_some();
            let telling = model.sample_hz.is_some() || !["un_map", "odrive_cog"].contains(&rig);
            assert_eq!(asked, telling, "{rig} in milliseconds, rate {:?}", model.sample_hz);
        }
    }
}
