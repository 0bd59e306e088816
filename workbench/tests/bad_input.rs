//! The command line on bad input: one sentence that names file, place and remedy, exit status 2, earlier output stays.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const MODEL: &str = "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = 2.0\nKt_nm_per_a = 0.05\nKe_vs_per_rad = 0.05\nJ_kgm2 = 1e-4\nb_nms_per_rad = 1e-5\n";

/// A folder with a good model and a log.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new(log: &str) -> Self {
        let desk = Desk(tempfile::tempdir().unwrap());
        desk.put("model.toml", MODEL);
        desk.put("log.csv", log);
        desk.put("report.html", "an earlier report");
        desk
    }

    fn put(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn gap(&self, more: &[&str]) -> Output {
        truing()
            .current_dir(self.0.path())
            .args([
                "gap",
                "--model",
                "model.toml",
                "--log",
                "log.csv",
                "--report",
                "report.html",
                "--json",
                "gap.json",
            ])
            .args(more)
            .output()
            .unwrap()
    }

    /// Asserts that the analysis is refused with one line that holds all of `words`, and that nothing was written.
    fn refuses(&self, words: &[&str]) {
        let output = self.gap(&[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.trim_end().lines().count(), 1, "one sentence, but:\n{said}");
        for word in words {
            assert!(said.contains(word), "`{word}` is not in: {said}");
        }
        assert_eq!(read(&self.path("report.html")), "an earlier report");
        assert!(!self.path("gap.json").exists());
    }
}

fn truing() -> Command {
    Command::new(env!("CARGO_BIN_EXE_truing"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// A log of `rows` rows that turns the motor back and forth.
fn log(rows: usize) -> Vec<String> {
    let row = |k: usize| format!("{},{},{}", k as f64 * 0.01, if k % 40 < 20 { 6 } else { -6 }, k % 7);
    std::iter::once("t_s,u_v,omega_rad_s".to_string()).chain((0..rows).map(row)).collect()
}

#[test]
fn a_log_that_is_missing_or_empty_is_named() {
    let desk = Desk::new("");
    desk.refuses(&["log.csv"]);
    std::fs::remove_file(desk.path("log.csv")).unwrap();
    desk.refuses(&["log.csv", "cannot be read"]);
}

#[test]
fn a_truncated_row_is_named_by_its_line() {
    let mut lines = log(200);
    lines[150] = "1.49,6".into();
    Desk::new(&lines.join("\n")).refuses(&["log.csv", "151"]);
}

#[test]
fn a_value_that_is_no_number_is_named_by_line_and_column() {
    for bad in ["inf", "fast"] {
        let mut lines = log(200);
        lines[10] = format!("0.09,6,{bad}");
        Desk::new(&lines.join("\n")).refuses(&["log.csv", "11", "omega_rad_s"]);
    }
}

#[test]
fn many_cells_without_a_number_are_named_once() {
    let mut lines = log(200);
    for row in [10, 40, 90, 120, 121] {
        lines[row] = format!("{},6,NaN", 0.01 * (row - 1) as f64);
    }
    Desk::new(&lines.join("\n")).refuses(&["log.csv", "line 11", "omega_rad_s", "5 of 200 rows"]);
}

#[test]
fn a_clock_that_is_coarser_than_the_rows_is_told() {
    let mut lines = log(200);
    for row in 0..100 {
        let (first, second) = (lines[2 * row + 1].clone(), &mut lines[2 * row + 2]);
        *second = format!("{},{}", first.split(',').next().unwrap(), second.split_once(',').unwrap().1);
    }
    Desk::new(&lines.join("\n")).refuses(&["log.csv", "100 of 200 rows repeat", "t_s=row*"]);
}

#[test]
fn a_missing_column_is_named() {
    let text = log(50).join("\n").replace("omega_rad_s", "speed");
    Desk::new(&text).refuses(&["log.csv", "omega_rad_s"]);
}

#[test]
fn an_unknown_unit_is_named_with_its_column() {
    let text = log(50).join("\n").replace("omega_rad_s", "omega_furlong_s");
    Desk::new(&text).refuses(&["log.csv", "omega_furlong_s"]);
}

#[test]
fn a_model_that_cannot_be_is_named_by_its_field() {
    let desk = Desk::new(&log(200).join("\n"));
    desk.put("model.toml", &MODEL.replace("J_kgm2 = 1e-4", "J_kgm2 = -1e-4"));
    desk.refuses(&["model.toml", "J_kgm2"]);
    desk.put("model.toml", &MODEL.replace("R_ohm", "R_ohn"));
    desk.refuses(&["model.toml", "R_ohn", "R_ohm"]);
}

#[test]
fn a_log_that_never_moves_is_an_answer_and_no_error() {
    let desk = Desk::new(&still());
    let output = desk.gap(&[]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(read(&desk.path("gap.json")).contains("\"verdict\": \"insufficient_excitation\""));
}

/// A log that is answered at once.
fn still() -> String {
    let rows: Vec<String> = (0..300).map(|k| format!("{},6,0", k as f64 * 0.01)).collect();
    format!("t_s,u_v,omega_rad_s\n{}", rows.join("\n"))
}

#[test]
fn the_extended_model_leaves_the_model_beside_it_alone() {
    let desk = Desk::new(&still());
    let output = desk.gap(&["--out", "."]);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(read(&desk.path("model.toml")), MODEL);
    assert!(read(&desk.path("model.extended.toml")).starts_with("schema"));
}

#[test]
fn no_command_replaces_a_file_that_it_reads() {
    let axis = ["--motor", "builtin:model.toml", "--config", "axis.toml"];
    let motion = ["--profile", "file:log.csv", "--params", "params.toml"];
    let firmware = |command: &'static str, more: &[&'static str]| {
        let all = [command].into_iter().chain(axis).chain(more.iter().copied());
        all.collect::<Vec<_>>()
    };
    let moved = |command, more: &[&'static str]| firmware(command, &[&motion[..], more].concat());
    let gap = |more: &[&'static str]| [&["gap", "--model", "model.toml", "--log", "log.csv"], more].concat();
    let export = ["params", "export", "model.toml", "--config", "axis.toml"];
    let cases = [
        gap(&["--report", "log.csv"]),
        gap(&["--json", "model.toml"]),
        gap(&["--holdout", "outcome.json", "--out", "."]),
        gap(&["--holdout", "model.extended.toml", "--out", "."]),
        vec!["simulate", "--model", "model.toml", "--input", "log.csv", "--out", "log.csv"],
        [&export[..], &["--out", "model.toml"]].concat(),
        [&export[..], &["--out", "axis.toml"]].concat(),
        firmware("commission", &["--save", "axis.toml"]),
        firmware("commission", &["--json", "model.toml"]),
        firmware("commission", &["--log", "axis.toml"]),
        firmware("commission", &["--flash", "model.toml"]),
        moved("track", &["--json", "params.toml"]),
        moved("track", &["--log", "log.csv"]),
        moved("capture", &["--out", "axis.toml"]),
        moved("monitor", &["--flash", "params.toml"]),
        firmware("move", &["--by", "1", "--log", "model.toml"]),
    ];
    let desk = Desk::new(&still());
    let names = ["model.toml", "log.csv", "axis.toml", "params.toml", "outcome.json", "model.extended.toml"];
    names[2..].iter().for_each(|name| desk.put(name, "an input"));
    let held = || names.map(|name| read(&desk.path(name)));
    let before = held();
    for case in cases {
        let output = truing().current_dir(desk.0.path()).args(&case).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{case:?}: {said}");
        assert!(said.contains("would replace the input of"), "{case:?}: {said}");
        assert!(said.contains("name another place for --"), "{case:?}: {said}");
        assert!(held() == before, "{case:?}");
    }
}

/// A log of a motor of 0.08 s with a row every 10 ms, the time counted in `unit` seconds.
fn turned(unit: f64) -> String {
    let (mut omega, mut random) = (0.0, 1_u32);
    let row = |k: usize| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(random) / f64::from(u32::MAX) - 0.5;
        let u = if k % 40 < 20 { 6.0 } else { -3.0 };
        let line = format!("{},{u},{}", k as f64 * 0.01 / unit, omega + noise);
        omega += (20.0 * u - omega) * 0.01 / 0.08;
        line
    };
    let rows: Vec<String> = (0..400).map(row).collect();
    format!("t_s,u_v,omega_rad_s\n{}", rows.join("\n"))
}

#[test]
fn milliseconds_under_seconds_are_asked_about() {
    let desk = Desk::new(&turned(1e-3));
    desk.refuses(&["log.csv", "time were in ms", "--columns \"t_s=t_s*0.001\""]);
    assert_eq!(desk.gap(&["--columns", "t_s=t_s*0.001"]).status.code(), Some(0));
}

#[test]
fn a_time_column_never_goes_unused_in_silence() {
    let rows: Vec<String> = (0..30).map(|k| format!("{k},{k},{}", 20 * k)).collect();
    let desk = Desk::new(&format!("t_s,u_v,omega_rad_s\n{}", rows.join("\n")));
    let output = desk.gap(&[]);
    assert_eq!(output.status.code(), Some(0));
    assert!(read(&desk.path("gap.json")).contains("the time is not used"));
}

#[test]
fn a_script_reads_the_result_and_the_exit_status() {
    let desk = Desk::new(&turned(1.0));
    let asked = |more: &[&str]| {
        let files = ["gap", "--model", "model.toml", "--log", "log.csv"];
        truing().current_dir(desk.0.path()).args(files).args(more).output().unwrap()
    };
    assert_eq!(asked(&["--check"]).status.code(), Some(0), "nothing is missing");
    desk.put("model.toml", &MODEL.replace("J_kgm2 = 1e-4", "J_kgm2 = 2e-4"));
    let checked = asked(&["--check", "--json", "-"]);
    assert_eq!(checked.status.code(), Some(1), "the model has twice the inertia");
    let result: serde_json::Value = serde_json::from_slice(&checked.stdout).expect("nothing but the result");
    assert_ne!(result["verdict"], "nothing_missing");
    let said = String::from_utf8_lossy(&checked.stderr).into_owned();
    assert!(said.trim_end().lines().last().unwrap().starts_with("error: --check: the verdict is"), "{said}");
    assert!(!desk.path("-").exists());
    assert_eq!(asked(&[]).status.code(), Some(0), "a verdict is no failure");
}

#[test]
fn every_shell_and_man_get_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let output = truing().args(["completions", "--out"]).arg(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    for (name, word) in [("truing.bash", "--holdout"), ("_truing", "--holdout"), ("truing-gap.1", "holdout")]
    {
        assert!(read(&folder.path().join(name)).contains(word), "{name}");
    }
}
