//! Every output under faults: a full disk, a folder that takes no file, two instances at once, a signal at any instant. What was there
//! before stays or is replaced as a whole, nothing is left behind, and the complaint names the file.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use trials::exec_bench::{ExecBench, send};
use trials::firmware::truing;
use truing::synthetic::cases::{Case, Set, Spec, draw};

/// What stands at every output before the command runs.
const EARLIER: &str = "an earlier result\n";

/// A command line, and a file that it writes.
const OUTPUTS: &[(&str, &str)] = &[
    ("gap --model model.toml --log log.csv --json out/gap.json", "out/gap.json"),
    ("gap --model model.toml --log log.csv --report out/gap.html", "out/gap.html"),
    ("gap --model model.toml --log log.csv --out out", "out/model.extended.toml"),
    ("gap --model model.toml --log log.csv --pictures out", "out/gap.svg"),
    ("simulate --model model.toml --input log.csv --out out/simulated.csv", "out/simulated.csv"),
    ("look log.csv --json out/look.json", "out/look.json"),
    ("start --log log.csv --out out/new.toml --force", "out/new.toml"),
    ("cases --count 1 --rows 600 --out out --answers answers", "out/case-00001"),
    ("completions --out out", "out/truing.bash"),
    ("params export model.toml --config axis.toml --out out/params.toml", "out/params.toml"),
    ("bench --drawn 0 --only paper --json out/bench.json", "out/bench.json"),
    ("judge rigs --out out", "out/rig.json"),
];

const EXPECT: &str = "schema = \"truing-expect/1\"\nfit_percent = 0.0\nbest_known_percent = 0.0\n";

const AXIS: &str =
    "[supply]\nnominal_v = 24.0\n[encoder]\ncounts_per_rev = 1348\n[axis]\nrated_speed_rad_s = 190.0\n";

fn case() -> Case {
    draw(&Spec { rows: 1200, dirty: Some(false), ..Spec::new(Set::Single) }, 1)
}

struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        let case = case();
        for (name, text) in
            [("model.toml", case.model.as_str()), ("log.csv", &case.log.to_csv()), ("axis.toml", AXIS)]
        {
            std::fs::write(desk.path(name), text).unwrap();
        }
        std::fs::create_dir_all(desk.path("rigs/rig")).unwrap();
        for (name, text) in [
            ("model.toml", case.model.as_str()),
            ("log.csv", &case.log.to_csv()),
            ("holdout.csv", &case.holdout.to_csv()),
            ("expect.toml", EXPECT),
        ] {
            std::fs::write(desk.path("rigs/rig").join(name), text).unwrap();
        }
        std::fs::create_dir(desk.path("out")).unwrap();
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// `truing` behind some words of the shell.
    fn shell(&self, before: &str, line: &str) -> Output {
        let line = format!("{before} exec $GUARD \"$TRUING\" {line}");
        let mut shell = Command::new("sh");
        shell.args(["-c", &line]).env("TRUING", truing().get_program()).current_dir(self.0.path());
        shell.stdin(Stdio::null()).output().unwrap()
    }

    fn drafts(&self) -> Vec<String> {
        let mut found = Vec::new();
        for folder in [self.path("."), self.path("out")] {
            let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
            found.extend(
                names.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.starts_with('.')),
            );
        }
        found
    }
}

/// The command fails as it should: status 2, a sentence with the file or its folder, what was there before.
fn assert_refused(desk: &Desk, output: &Output, line: &str, file: &str) {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{line}: {errors}");
    let folder = file.split('/').next().unwrap();
    assert!(
        errors.contains(file)
            || errors.contains(&format!("{folder}: "))
            || errors.contains(&format!("/{folder}")),
        "{line}: {errors}"
    );
    assert!(!errors.contains("panicked"), "{line}: {errors}");
    if !file.ends_with("00001") {
        let kept = std::fs::read_to_string(desk.path(file)).unwrap();
        assert_eq!(kept, EARLIER, "{line}: what was there before is lost");
    }
    assert_eq!(desk.drafts(), Vec::<String>::new(), "{line}");
}

fn with_earlier(file: &str) -> Desk {
    let desk = Desk::new();
    if !file.ends_with("00001") {
        std::fs::write(desk.path(file), EARLIER).unwrap();
    }
    desk
}

/// No file may grow: as on a full disk, every write fails.
#[test]
fn a_full_disk_is_told_and_earlier_results_stay() {
    for (line, file) in OUTPUTS.iter().filter(|(_, file)| !file.ends_with(".bash")) {
        let desk = with_earlier(file);
        let output = desk.shell("trap '' XFSZ; ulimit -f 0;", line);
        assert_refused(&desk, &output, line, file);
    }
}

/// The log of a commissioning takes more than 32 KiB, what QEMU needs takes less: the disk is full only when the log is written.
#[test]
fn a_commissioning_whose_log_finds_the_disk_full_is_printed_all_the_same() {
    let bench = ExecBench::default();
    let words = ["commission", "--save", "found.toml", "--log", "ticks.csv"];
    let command = bench.command(&words, "0.1");
    let mut limited = Command::new("sh");
    limited.args(["-c", "trap '' XFSZ; ulimit -f 64; exec \"$0\" \"$@\""]).arg(command.get_program());
    limited.args(command.get_args()).current_dir(command.get_current_dir().unwrap());
    limited.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let output = limited.output().unwrap();
    let (text, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(2), "{text}{errors}");
    assert!(errors.contains("ticks.csv") && !errors.contains("panicked"), "{errors}");
    assert!(text.contains("dead zone"), "the result is lost: {text}{errors}");
    assert!(bench.text("found.toml").contains("dead_zone"), "the result is not kept");
    assert!(!bench.path("ticks.csv").exists(), "half a log is left");
    bench.assert_clean();
}

/// Root may write anywhere, unless it gives that up.
fn guard(folder: &Path) -> Option<&'static str> {
    let as_root = "setpriv --bounding-set=-dac_override,-dac_read_search";
    for guard in ["", as_root] {
        let probe = format!("{guard} sh -c ': > {}/probe'", folder.display());
        let refused = Command::new("sh").args(["-c", &probe]).output().is_ok_and(|out| !out.status.success());
        let runs =
            Command::new("sh").args(["-c", &format!("{guard} true")]).status().is_ok_and(|it| it.success());
        let _ = std::fs::remove_file(folder.join("probe"));
        if refused && runs {
            return Some(guard);
        }
    }
    None
}

#[cfg(unix)]
#[test]
fn a_folder_that_takes_no_file_is_told_and_earlier_results_stay() {
    use std::os::unix::fs::PermissionsExt;
    for (line, file) in OUTPUTS {
        let desk = with_earlier(file);
        let closed = std::fs::Permissions::from_mode(0o555);
        std::fs::set_permissions(desk.path("out"), closed).unwrap();
        if !file.ends_with("00001") {
            std::fs::set_permissions(desk.path(file), std::fs::Permissions::from_mode(0o444)).unwrap();
        }
        let Some(guard) = guard(&desk.path("out")) else {
            println!("skipped: nothing here makes a folder closed to this user");
            return;
        };
        let output = desk.shell(&format!("GUARD='{guard}';"), line);
        assert_refused(&desk, &output, line, file);
        std::fs::set_permissions(desk.path("out"), std::fs::Permissions::from_mode(0o755)).unwrap();
    }
}

#[test]
fn two_instances_that_write_the_same_files_leave_whole_ones() {
    let desk = Desk::new();
    let line = ["gap", "--model", "model.toml", "--log", "log.csv", "--out", "out"];
    let run = || truing().args(line).current_dir(desk.path(".")).output().unwrap();
    for _ in 0..3 {
        std::thread::scope(|scope| {
            let both = [scope.spawn(run), scope.spawn(run)];
            assert!(both.into_iter().all(|it| it.join().unwrap().status.success()));
        });
        let text = |name: &str| std::fs::read_to_string(desk.path("out").join(name)).unwrap();
        serde_json::from_str::<serde_json::Value>(&text("outcome.json")).unwrap();
        assert!(text("report.html").trim_end().ends_with("</html>"));
        truing::system::model::parse("model.extended.toml", &text("model.extended.toml")).unwrap();
        assert_eq!(desk.drafts(), Vec::<String>::new());
    }
}

#[test]
fn a_flash_belongs_to_one_servo_at_a_time() {
    let bench = ExecBench::default();
    let command = |motor: &str| bench.command(&["commission", "--flash", "flash.bin"], motor);
    let mut first = command("0.1").stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    bench.wait_for_tick(100);
    // Halted, so that it cannot end before the second one asks.
    send("STOP", &first);
    let second = command("0.1").output().unwrap();
    send("TERM", &first);
    send("CONT", &first);
    first.wait().unwrap();
    let errors = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(2), "{errors}");
    assert!(errors.contains("flash.bin") && errors.contains("in use by another servo"), "{errors}");
}

/// A signal at instants from the start to beyond the end: each file is the earlier one or whole, and no draft stays.
#[test]
fn a_signal_at_any_instant_leaves_whole_files() {
    let desk = Desk::new();
    let files = ["outcome.json", "report.html", "model.extended.toml"];
    let line = ["gap", "--model", "model.toml", "--log", "log.csv", "--out", "out"];
    let run = || {
        let mut command = truing();
        command.args(line).current_dir(desk.path(".")).stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    let began = std::time::Instant::now();
    assert!(run().wait().unwrap().success());
    let (whole, took) =
        (files.map(|name| std::fs::read(desk.path("out").join(name)).unwrap()), began.elapsed());
    for part in 0..24_u32 {
        for name in files {
            std::fs::write(desk.path("out").join(name), EARLIER).unwrap();
        }
        let mut child = run();
        std::thread::sleep(took * part / 20);
        send("TERM", &child);
        child.wait().unwrap();
        for (name, whole) in files.iter().zip(&whole) {
            let found = std::fs::read(desk.path("out").join(name)).unwrap();
            // Run time and date differ from run to run: the length tells whole from cut.
            let near = found.len().abs_diff(whole.len()) < 64;
            assert!(
                found == EARLIER.as_bytes() || near,
                "{name} is cut at part {part}: {} bytes",
                found.len()
            );
        }
        assert_eq!(desk.drafts(), Vec::<String>::new(), "part {part}");
    }
}
