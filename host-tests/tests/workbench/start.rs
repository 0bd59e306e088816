//! From a stranger's log and what is printed on a motor to a verdict: `truing start`, then `truing gap`. Numbers that nobody knows, and
//! a data sheet that is wrong.

use clap::Parser;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use truing::cli::Cli;

/// What is true of the motor: 16 rad/s/V and 90 ms, 9.375 Ω, 0.0625 N m/A, 3.75e-5 kg m².
const GAIN: f64 = 16.0;
const TIME_CONSTANT_S: f64 = 0.09;
const R_OHM: f64 = 9.375;
const KT: f64 = 1.0 / GAIN;
const J_KGM2: f64 = TIME_CONSTANT_S * KT * KT / R_OHM;

/// What stands between command and shaft, V at the terminals.
#[derive(Clone, Copy)]
enum Hidden {
    Friction(f64),
    DeadZone(f64),
    /// Friction that falls from the first value at rest to the second one within some 10 rad/s.
    BreakAway(f64, f64),
}

impl Hidden {
    /// The friction at a speed.
    fn friction(self, omega: f64) -> f64 {
        match self {
            Self::Friction(level) | Self::DeadZone(level) => level,
            Self::BreakAway(start, level) => level + (start - level) * (-(omega / 10.0).powi(2)).exp(),
        }
    }
}

/// A row of a simulation: time, voltage, speed, angle.
type Row = [f64; 4];

/// An own small simulation, nothing of the product's: Euler, 40 steps a row, with the current that the shaft draws.
fn simulated(step_s: f64, seconds: f64, volts: f64, hidden: Hidden) -> Vec<Row> {
    const LEVELS: [f64; 10] = [0.0, 1.0, -0.5, 0.25, -1.0, 0.4, 0.12, -0.12, 0.8, 0.0];
    const SUB: usize = 40;
    let (mut omega, mut theta, mut rows) = (0.0_f64, 0.0, Vec::new());
    for k in 0..(seconds / step_s) as usize {
        let t = k as f64 * step_s;
        let u = volts * LEVELS[(t / 0.8) as usize % LEVELS.len()];
        rows.push([t, u, omega, theta]);
        for _ in 0..SUB {
            let (h, level) = (step_s / SUB as f64, hidden.friction(omega));
            let rubs = !matches!(hidden, Hidden::DeadZone(_));
            let drive = match rubs && omega.abs() > 1e-3 {
                true => u - level * omega.signum(),
                false => u - u.clamp(-level, level),
            };
            let next = omega + (GAIN * drive - omega) / TIME_CONSTANT_S * h;
            let stops = rubs && u.abs() < level && next * omega < 0.0;
            omega = if stops { 0.0 } else { next };
            theta += omega * h;
        }
    }
    rows
}

/// White noise of 0.2 rad/s.
fn noise(rows: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(290);
    let normal = Normal::new(0.0, 0.2).unwrap();
    (0..rows).map(|_| normal.sample(&mut rng)).collect()
}

struct Desk(tempfile::TempDir);

impl Desk {
    fn new(log: &str) -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        std::fs::write(desk.path("log.csv"), log).unwrap();
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, command: &str, more: &[&str]) -> Result<(), String> {
        let log = self.path("log.csv").display().to_string();
        let words = ["truing", command, "--log", &log].into_iter().chain(more.iter().copied());
        let cli = Cli::try_parse_from(words).map_err(|error| error.to_string())?;
        cli.run().map_err(|error| format!("{error:#}"))
    }

    fn start(&self, columns: &str, printed: &[&str]) -> String {
        let out = self.path("model.toml").display().to_string();
        let fixed = ["--columns", columns, "--out", &out];
        self.run("start", &[&fixed[..], printed].concat()).unwrap();
        std::fs::read_to_string(out).unwrap()
    }

    fn gap(&self, columns: &str) -> serde_json::Value {
        let (model, json) = (self.path("model.toml"), self.path("gap.json"));
        let (model, json) = (model.display().to_string(), json.display().to_string());
        let out = self.path("result").display().to_string();
        self.run("gap", &["--columns", columns, "--model", &model, "--json", &json, "--out", &out]).unwrap();
        serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap()
    }

    fn report(&self) -> String {
        std::fs::read_to_string(self.path("result/report.html")).unwrap()
    }
}

fn names(outcome: &serde_json::Value) -> Vec<&str> {
    let effects = outcome["effects"].as_array().unwrap();
    effects.iter().map(|effect| effect["name"].as_str().unwrap()).collect()
}

fn near(value: &serde_json::Value, truth: f64, relative: f64) {
    let value = value.as_f64().unwrap_or_else(|| panic!("{value}"));
    assert!((value / truth - 1.0).abs() < relative, "{value}, but the truth is {truth}");
}

/// Milliseconds, an 8-bit PWM of 12 V, and rpm from 64 counts a turn over 20 ms.
fn arduino(hidden: Hidden) -> String {
    let mut text = String::from("time_ms,pwm,rpm\n");
    let mut last = 0.0;
    for [t, u, _, theta] in simulated(0.02, 24.0, 12.0, hidden) {
        let counts = (theta / TAU * 64.0).round();
        let rpm = (counts - last) / 64.0 / 0.02 * 60.0;
        last = counts;
        let _ = writeln!(text, "{:.0},{:.0},{rpm:.1}", t * 1000.0, u / 12.0 * 255.0);
    }
    text
}

const ARDUINO: &str = "t_ms=time_ms,u_v=pwm*0.0470588,omega_rpm=rpm";

/// Angles alone, and levels of which half do not start the motor: a drag that grows with the speed would explain a part of what the
/// fall of the friction explains whole.
#[test]
fn a_break_away_is_not_taken_for_constant_friction_and_drag() {
    for (volts, counts) in [(6.0, 1440.0), (7.0, 400.0)] {
        let mut log = String::from("t_s,u_v,theta_rad\n");
        for [t, u, _, theta] in simulated(0.02, 24.0, volts, Hidden::BreakAway(3.2, 2.0)) {
            let angle = (theta / TAU * counts).floor() / counts * TAU;
            let _ = writeln!(log, "{t:.3},{u},{angle:.6}");
        }
        let desk = Desk::new(&log);
        desk.start("", &["--voltage", "12"]);
        let outcome = desk.gap("");
        assert_eq!(
            (outcome["verdict"].as_str(), names(&outcome)),
            (Some("named"), vec!["stribeck_friction"])
        );
        near(&outcome["effects"][0]["derived"]["breakaway_v"]["value"], 3.2, 0.02);
        near(&outcome["effects"][0]["derived"]["level_v"]["value"], 2.0, 0.02);
    }
}

#[test]
fn a_microcontroller_s_log_and_a_voltage_are_enough() {
    let desk = Desk::new(&arduino(Hidden::Friction(0.675)));
    let text = desk.start(ARDUINO, &["--voltage", "12", "--counts-per-rev", "64"]);
    assert!(text.contains("kind = \"first_order\"") && text.contains("speed_window_s = 0.02"), "{text}");
    let outcome = desk.gap(ARDUINO);
    assert_eq!((outcome["verdict"].as_str(), names(&outcome)), (Some("named"), vec!["coulomb_friction"]));
    let derived = &outcome["effects"][0]["derived"];
    near(&derived["level_v"]["value"], 0.675, 0.03);
    near(&derived["level_rad_s2"]["value"], 0.675 * GAIN / TIME_CONSTANT_S, 0.05);
    // Nothing is told in a unit that the model does not know.
    let report = desk.report();
    assert!(report.contains("rad/s²") && !report.contains("N m"), "a torque of a motor of 1 Ω");
}

#[test]
fn resistance_and_constant_are_printed_and_the_load_is_unknown() {
    let (mut text, noise) = (String::from("t_s,u_v,omega_rad_s\n"), noise(2000));
    for (k, [t, u, omega, _]) in simulated(0.01, 16.0, 12.0, Hidden::DeadZone(1.2)).into_iter().enumerate() {
        let _ = writeln!(text, "{t:.3},{u:.2},{:.3}", omega + noise[k]);
    }
    let desk = Desk::new(&text);
    let text = desk.start("", &["--voltage", "12", "--resistance", "9.4 ohm", "--kt", "62.5mNm/A"]);
    assert!(text.contains("kind = \"dc_motor\"") && text.contains("from the log, fitted"), "{text}");
    let outcome = desk.gap("");
    assert_eq!((outcome["verdict"].as_str(), names(&outcome)), (Some("named"), vec!["dead_zone"]));
    near(&outcome["effects"][0]["parameters"]["half_width_v"]["value"], 1.2, 0.03);
    let extended = truing::files::model::read(&desk.path("result/model.extended.toml")).unwrap();
    near(&extended.parameters()[4].1.into(), J_KGM2, 0.1);
}

#[test]
fn a_position_in_counts_and_a_label_are_enough() {
    let mut text = String::from("time,volts,position\n");
    for [t, u, _, theta] in simulated(0.002, 16.0, 24.0, Hidden::Friction(0.675)) {
        let _ = writeln!(text, "{t:.3},{u:.3},{:.0}", theta / TAU * 2048.0);
    }
    let columns = "t_s=time,u_v=volts,theta_rad=position*0.00306796157577128";
    let desk = Desk::new(&text);
    // 24 V: I0 = 0.675 V/9.375 Ω, n0 = 16·(24 − 0.675) rad/s, I_stall = 24 V/9.375 Ω.
    let printed =
        ["--voltage", "24", "--no-load-rpm", "3564", "--no-load-current", "72mA", "--stall-current", "2.56"];
    let text = desk.start(columns, &[&printed[..], &["--counts-per-rev", "2048"]].concat());
    assert!(text.contains("U/I_stall") && text.contains("(U − R I0)/ω0"), "{text}");
    let outcome = desk.gap(columns);
    assert_eq!((outcome["verdict"].as_str(), names(&outcome)), (Some("named"), vec!["coulomb_friction"]));
    near(&outcome["effects"][0]["parameters"]["level_nm"]["value"], 0.675 * KT / R_OHM, 0.1);
}

/// The inertia of the sheet is three times too large, and no tolerance says so.
#[test]
fn a_data_sheet_that_the_log_contradicts_is_told_before_any_effect() {
    let (mut text, noise) = (String::from("t_s,u_v,omega_rad_s\n"), noise(2000));
    for (k, [t, u, omega, _]) in simulated(0.01, 16.0, 12.0, Hidden::Friction(0.675)).into_iter().enumerate()
    {
        let _ = writeln!(text, "{t:.3},{u:.2},{:.3}", omega + noise[k]);
    }
    let desk = Desk::new(&text);
    let sheet = format!(
        "schema = \"truing-model/1\"\n[motor]\nR_ohm = {R_OHM}\nKt_nm_per_a = {KT}\nJ_kgm2 = {:e}\n",
        3.0 * J_KGM2
    );
    std::fs::write(desk.path("model.toml"), &sheet).unwrap();
    let outcome = desk.gap("");
    let told = &outcome["data_sheet"][0];
    assert_eq!(told["parameter"], "J_kgm2", "{outcome}");
    near(&told["ratio"], 1.0 / 3.0, 0.05);
    near(&told["fitted"], J_KGM2, 0.05);
    assert_eq!(told["or"][0], "R_ohm", "without a current the log shows their product");
    assert_eq!(told["mends"][1], "[tolerance] J_kgm2 = 1.0");
    assert_eq!(names(&outcome), ["inertia", "coulomb_friction"], "{outcome}");
    near(&outcome["effects"][1]["parameters"]["level_nm"]["value"], 0.675 * KT / R_OHM, 0.05);
    let report = desk.report();
    let (first, verdict) = (
        report.find("The log contradicts the data sheet: J_kgm2").unwrap(),
        report.find("Found: coulomb_friction").unwrap(),
    );
    assert!(first < verdict);
    assert!(report.contains("<title>Tie: J_kgm2 of the data sheet and coulomb_friction"), "{report:.900}");
    // The lines that it asks for mend the file.
    for mended in [
        sheet.replace(
            "\nJ_kgm2",
            &format!("\n{}\n#", told["mends"][0].as_str().unwrap().trim_start_matches("[motor] ")),
        ),
        format!("{sheet}[tolerance]\nJ_kgm2 = 1.0\n"),
    ] {
        std::fs::write(desk.path("model.toml"), &mended).unwrap();
        let outcome = desk.gap("");
        assert!(outcome.get("data_sheet").is_none(), "{mended}: {outcome}");
        assert_eq!(names(&outcome), ["coulomb_friction"], "{mended}");
    }
}

#[test]
fn any_one_number_of_a_motor_may_be_unknown_and_a_current_shows_all() {
    let friction = 0.675;
    let (mut text, noise) = (String::from("t_s,u_v,omega_rad_s\n"), noise(2000));
    let mut measured = String::from("t_s,u_v,omega_rad_s,i_a\n");
    for (k, [t, u, omega, _]) in
        simulated(0.01, 16.0, 12.0, Hidden::Friction(friction)).into_iter().enumerate()
    {
        let current = (u - KT * omega) / R_OHM + 0.02 * noise[k + 1];
        let _ = writeln!(text, "{t:.3},{u:.2},{:.3}", omega + noise[k]);
        let _ = writeln!(measured, "{t:.3},{u:.2},{:.3},{current:.4}", omega + noise[k]);
    }
    let numbers = [("R_ohm", R_OHM), ("Kt_nm_per_a", KT), ("J_kgm2", J_KGM2)];
    let model = |unknown: &[&str]| {
        let known = numbers.iter().filter(|(key, _)| !unknown.contains(key));
        let lines: String = known.map(|(key, value)| format!("{key} = {value:e}\n")).collect();
        let stated: String = unknown.iter().skip(1).map(|key| format!("{key} = \"unknown\"\n")).collect();
        format!("schema = \"truing-model/1\"\n[motor]\n{lines}{stated}")
    };
    let cases: [(&str, &[&str]); 4] = [
        (&text, &["J_kgm2"]),
        (&text, &["R_ohm"]),
        (&text, &["Kt_nm_per_a"]),
        (&measured, &["R_ohm", "Kt_nm_per_a", "J_kgm2"]),
    ];
    for (log, unknown) in cases {
        let desk = Desk::new(log);
        std::fs::write(desk.path("model.toml"), model(unknown)).unwrap();
        let outcome = desk.gap("");
        assert_eq!(
            (outcome["verdict"].as_str(), names(&outcome)),
            (Some("named"), vec!["coulomb_friction"]),
            "{unknown:?}"
        );
        near(&outcome["effects"][0]["parameters"]["level_nm"]["value"], friction * KT / R_OHM, 0.1);
        let notes = outcome["notes"].to_string();
        assert!(unknown.iter().all(|key| notes.contains(key)) && notes.contains("not known"), "{notes}");
    }
    // Two of them, and no current.
    let desk = Desk::new(&text);
    std::fs::write(desk.path("model.toml"), model(&["R_ohm", "J_kgm2"])).unwrap();
    let outcome = desk.gap("");
    assert_eq!(names(&outcome), ["coulomb_friction"]);
    near(&outcome["effects"][0]["derived"]["level_v"]["value"], friction, 0.03);
    assert!(outcome["notes"].to_string().contains("the model is first_order here"));
}

#[test]
fn nothing_is_overwritten_that_was_there() {
    let desk = Desk::new(&arduino(Hidden::Friction(0.675)));
    let out = |name: &str| desk.path(name).display().to_string();
    let start =
        |more: &[&str]| desk.run("start", &[&["--columns", ARDUINO, "--voltage", "12"], more].concat());
    let said = start(&["--out", &out("log.csv")]).unwrap_err();
    assert!(said.contains("input of --log"), "{said}");
    start(&["--out", &out("model.toml")]).unwrap();
    let said = start(&["--out", &out("model.toml")]).unwrap_err();
    assert!(said.contains("exists") && said.contains("--force"), "{said}");
    start(&["--out", &out("model.toml"), "--force"]).unwrap();
    let said = desk.run("start", &["--inertia", "3 furlong"]).unwrap_err();
    assert!(said.contains("furlong") && said.contains("gcm2"), "{said}");
    assert!(Path::new(&out("log.csv")).metadata().unwrap().len() > 1000);
}

/// Every number of the written file says where it comes from.
#[test]
fn every_line_of_the_written_file_has_its_reason() {
    let desk = Desk::new(&arduino(Hidden::DeadZone(1.0)));
    let printed = [
        "--voltage",
        "12",
        "--no-load-rpm",
        "92",
        "--gear",
        "20",
        "--printed-at-output",
        "--stall-current",
        "1.28",
        "--inertia",
        "12gcm2",
        "--encoder-at-output",
    ];
    let text = desk.start(ARDUINO, &printed);
    let lines: Vec<&str> = text.lines().collect();
    let entry = |line: &str| line.contains(" = ") && !line.starts_with('#') && !line.starts_with("schema");
    for pair in lines.windows(2).filter(|pair| entry(pair[1])) {
        assert!(pair[1].contains('#') || pair[0].starts_with('#'), "{}\n{text}", pair[1]);
    }
    let model = truing::files::model::read(&desk.path("model.toml")).unwrap();
    assert!(model.notes.is_empty(), "{:?}", model.notes);
}

/// A log over time with white noise on the speed; the input is that of so many rows earlier.
fn noisy(hidden: Hidden, late: usize) -> String {
    let (mut text, noise) = (String::from("t_s,u_v,omega_rad_s\n"), noise(2000));
    let rows = simulated(0.01, 16.0, 12.0, hidden);
    for (k, [t, _, omega, _]) in rows.iter().enumerate() {
        let ahead = rows[(k + late).min(rows.len() - 1)][1];
        let _ = writeln!(text, "{t:.3},{ahead:.2},{:.3}", omega + noise[k]);
    }
    text
}

/// The label is off by a tenth each, and the inertia is on none.
const LABEL: [&str; 6] = ["--voltage", "12", "--resistance", "10.3", "--kt", "0.0563"];

#[test]
fn friction_is_told_in_volts_and_its_torque_is_as_uncertain_as_the_label() {
    let desk = Desk::new(&noisy(Hidden::Friction(0.675), 0));
    desk.start("", &LABEL);
    let outcome = desk.gap("");
    assert_eq!((outcome["verdict"].as_str(), names(&outcome)), (Some("named"), vec!["coulomb_friction"]));
    let friction = &outcome["effects"][0];
    near(&friction["derived"]["level_v"]["value"], 0.675, 0.01);
    near(&friction["derived"]["level_rad_s2"]["value"], 0.675 * GAIN / TIME_CONSTANT_S, 0.02);
    let number = |key: &str| friction["parameters"]["level_nm"][key].as_f64().unwrap();
    let (torque, std) = (number("value"), number("std"));
    assert!((0.05..0.2).contains(&(std / torque)) && (torque - 0.675 * KT / R_OHM).abs() < 2.0 * std);
    let report = desk.report();
    assert!(
        report.contains("The model lacks coulomb_friction of 0.6") && report.contains(" V."),
        "volts first"
    );
    // Kt and Ke are one number, which the log shows.
    let text = std::fs::read_to_string(desk.path("result/model.extended.toml")).unwrap();
    assert!(text.contains("stands for level_v: 0.6"), "{text}");
    let extended = truing::files::model::read(&desk.path("result/model.extended.toml")).unwrap();
    near(&extended.parameters()[2].1.into(), KT, 0.01);
}

#[test]
fn a_delay_is_found_although_the_inertia_is_unknown() {
    for late in [1, 2] {
        let desk = Desk::new(&noisy(Hidden::DeadZone(0.0), late));
        desk.start("", &LABEL);
        let outcome = desk.gap("");
        assert_eq!(names(&outcome), ["transport_delay"], "{late} rows: {}", outcome["verdict"]);
        near(&outcome["effects"][0]["parameters"]["seconds"]["value"], 0.01 * late as f64, 0.05);
    }
}

/// Without a released bridge no log shows what of the damping is friction, and in coarse rows no winding shows.
#[test]
fn a_number_that_is_unknown_and_does_not_show_is_left_out() {
    let desk = Desk::new(&noisy(Hidden::Friction(0.6), 0));
    let unknown = ["gain_rad_s_per_v", "time_constant_s", "viscous_vs_per_rad", "electrical_time_constant_s"];
    let lines: String = unknown.iter().map(|key| format!("{key} = \"unknown\"\n")).collect();
    let model = format!("schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\n{lines}");
    std::fs::write(desk.path("model.toml"), model).unwrap();
    let outcome = desk.gap("");
    assert!(names(&outcome)[0].contains("friction"), "{}", outcome["verdict"]);
    let extended = std::fs::read_to_string(desk.path("result/model.extended.toml")).unwrap();
    for key in &unknown[2..] {
        let line = extended.lines().find(|line| line.starts_with(key)).unwrap();
        assert!(line.contains("the log does not show it"), "{line}");
    }
}

#[test]
fn a_linear_axis_and_a_torque_lead_to_a_verdict() {
    let mut text = String::from("t_s,u_v,v_m_s\n");
    for (k, [t, u, omega, _]) in simulated(0.01, 16.0, 12.0, Hidden::Friction(0.675)).into_iter().enumerate()
    {
        let _ = writeln!(text, "{t:.3},{u:.2},{:.5}", 0.01 * omega + 1e-6 * (k % 7) as f64);
    }
    let desk = Desk::new(&text);
    assert!(desk.start("", &[]).contains("kind = \"inertia\""));
    let outcome = desk.gap("");
    assert_eq!(names(&outcome), ["coulomb_friction"], "{}", outcome["verdict"]);
    near(&outcome["effects"][0]["parameters"]["level_n"]["value"], 0.675, 0.05);
    // A pendulum on a motor whose torque is logged: nothing brakes it but what is missing.
    let (mut omega, mut theta) = (0.0_f64, 0.0_f64);
    let mut text = String::from("t_s,torque_nm,omega_rad_s,theta_rad\n");
    for k in 0..1500 {
        let t = 0.01 * f64::from(k);
        let torque = 0.3 * (1.3 * t).sin() + 0.25 * (0.4 * t * t).sin();
        let _ = writeln!(text, "{t:.3},{torque:.5},{omega:.5},{theta:.5}");
        for _ in 0..40 {
            let free = omega + 2.5e-4 / 0.02 * (torque - 0.4 * theta.sin());
            let grip = 2.5e-4 / 0.02 * 0.05;
            omega = if free > 0.0 { (free - grip).max(0.0) } else { (free + grip).min(0.0) };
            theta += 2.5e-4 * omega;
        }
    }
    let desk = Desk::new(&text);
    desk.start("", &[]);
    let outcome = desk.gap("");
    assert_ne!(outcome["verdict"], "insufficient_excitation", "{outcome}");
}

/// Angles alone, in one direction, and half of the levels do not start the motor: a load would explain the levels that do, and move the motor where
/// it stood.
#[test]
fn a_motor_that_stood_is_not_moved_by_a_named_load() {
    let desk = Desk::new(&levels(&[0.2, 0.5, 0.7, 0.9, 1.2, 0.4, 1.6, 2.0]));
    desk.start("", &[]);
    let [model, json, held_out] =
        ["model.toml", "gap.json", "other.csv"].map(|name| desk.path(name).display().to_string());
    std::fs::write(&held_out, levels(&[0.3, 0.6, 1.0, 0.7, 1.4, 1.8])).unwrap();
    desk.run("gap", &["--model", &model, "--holdout", &held_out, "--json", &json]).unwrap();
    let outcome: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let names = names(&outcome);
    assert!(names.iter().any(|name| name.contains("friction") || name.contains("dead_zone")), "{names:?}");
    assert!(!names.iter().any(|name| ["constant_load", "voltage_offset"].contains(name)), "{names:?}");
    let position = &outcome["position"];
    assert!(position["rmse_after"].as_f64().unwrap() < 0.02, "{position}");
}

/// The angles of a motor with friction, in counts: each level for 1.5 s, then a second without voltage.
fn levels(levels: &[f64]) -> String {
    let (friction, breakaway, gain, tau) = (0.6_f64, 0.8_f64, 8.0_f64, 0.15_f64);
    let (mut omega, mut theta) = (0.0_f64, 0.0_f64);
    let mut text = String::from("t_s,u_v,theta_rad\n");
    for row in 0..250 * levels.len() {
        let volts = if row % 250 < 150 { levels[row / 250] } else { 0.0 };
        let count = (theta * 1024.0 / TAU).floor() * TAU / 1024.0;
        let _ = writeln!(text, "{:.2},{volts},{count:.6}", 0.01 * row as f64);
        for _ in 0..20 {
            let starts = omega > 0.0 || volts > breakaway;
            let pull = if starts { gain * (volts - friction) - omega } else { 0.0 };
            omega = (omega + 5e-4 * pull / tau).max(0.0);
            theta += 5e-4 * omega;
        }
    }
    text
}

#[test]
fn what_no_fit_shows_is_no_name() {
    // A ramp in whole turns a minute, and nothing hidden.
    let mut text = String::from("t_s,u_v,omega_rpm\n");
    let mut omega = 0.0;
    for k in 0..2400 {
        let u = 12.0 * (1.0 - (f64::from(k) / 600.0 - 2.0).abs());
        let _ = writeln!(text, "{:.3},{u:.3},{:.0}", 0.01 * f64::from(k), omega * 60.0 / TAU);
        for _ in 0..40 {
            omega += (GAIN * u - omega) / TIME_CONSTANT_S * 2.5e-4;
        }
    }
    let desk = Desk::new(&text);
    desk.start("", &[]);
    let outcome = desk.gap("");
    assert_eq!(outcome["verdict"], "nothing_missing", "{:?}", names(&outcome));
    assert!(!desk.report().contains("extended model"), "a legend of what is not drawn");
}

#[test]
fn a_report_says_which_runs_it_leaves_out() {
    let mut text = String::from("t_s,u_v,omega_rad_s,run\n");
    for (k, [t, u, omega, _]) in simulated(0.01, 11.2, 12.0, Hidden::Friction(0.675)).into_iter().enumerate()
    {
        let _ = writeln!(text, "{t:.3},{u:.2},{:.3},{}", omega + 0.001 * (k % 7) as f64, k / 80);
    }
    let desk = Desk::new(&text);
    desk.start("", &LABEL);
    desk.gap("");
    assert!(desk.report().contains("Shown are 12 of 14 runs"));
}

fn number(model: &str, key: &str) -> f64 {
    let line = model.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{key}: {model}"));
    line.split(['=', '#']).nth(1).unwrap().trim().parse().unwrap()
}

/// One level in one direction tells no friction from a weaker motor, and all of the speed is the gain's.
#[test]
fn a_single_step_gives_the_gain_that_it_shows() {
    let mut text = String::from("t_s,u_v,omega_rad_s\n");
    for (k, noise) in noise(200).iter().enumerate() {
        let t = 0.01 * k as f64;
        let _ = writeln!(text, "{t:.2},12.0,{:.3}", 12.0 * 6.2 * (1.0 - (-t / 0.227).exp()) + noise);
    }
    let model = Desk::new(&text).start("t_s=t_s", &[]);
    assert!((number(&model, "gain_rad_s_per_v") / 6.2 - 1.0).abs() < 0.01, "{model}");
    assert!((number(&model, "time_constant_s") / 0.227 - 1.0).abs() < 0.02, "{model}");
}

/// What is missing is counted from the best that the plain model can do.
#[test]
fn the_model_that_is_written_is_the_best_linear_fit() {
    let desk = Desk::new(&arduino(Hidden::Friction(2.0)));
    desk.start(ARDUINO, &[]);
    let outcome = desk.gap(ARDUINO);
    assert_eq!(names(&outcome)[..1], ["coulomb_friction"]);
    assert!(outcome["holdout"]["fit_percent_before"].as_f64().unwrap() > 80.0, "{}", outcome["holdout"]);
}
