//! A folder with an axis file and a motor program, and `truing` run in it as a user would.

use crate::firmware::{qemu, truing};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// What the motor program of [`MOTOR`] is to the firmware.
const AXIS: &str = "[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 2048\n\
                    [axis]\nrated_speed_rad_s = 66.0\ntick_hz = 1000\n";
/// Needs Python 3 and nothing else.
const MOTOR: &str = include_str!("motor_program.py");
/// Nothing here takes longer.
const PATIENCE: Duration = Duration::from_secs(120);

/// A process that was ended has left the table by then.
const LEAVING: Duration = Duration::from_secs(20);

/// The folder.
pub struct ExecBench {
    folder: TempDir,
}

impl Default for ExecBench {
    fn default() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("axis.toml"), AXIS).expect("a file");
        std::fs::write(folder.path().join("motor.py"), MOTOR).expect("a file");
        std::fs::create_dir(folder.path().join("tmp")).expect("a folder");
        Self { folder }
    }
}

impl ExecBench {
    /// A file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// What stands in it.
    pub fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// `truing COMMAND` on the motor program with these words, with a temporary folder of its own. Signals that whoever
    /// runs the tests ignores are heeded.
    pub fn command(&self, command: &[&str], motor: &str) -> Command {
        let mut run = Command::new("env");
        run.arg("--default-signal=INT,TERM,HUP").arg(truing().get_program());
        run.args(command).args(["--config", "axis.toml", "--image"]).arg(qemu().image);
        run.arg("--motor").arg(format!("exec:python3 motor.py {motor}"));
        run.current_dir(self.folder.path()).env("TMPDIR", self.path("tmp"));
        run.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        run
    }

    /// Runs it to its end.
    pub fn run(&self, command: &[&str], motor: &str) -> Said {
        let output = self.command(command, motor).output().expect("the program runs");
        output.into()
    }

    /// Waits until the motor program has come this far.
    pub fn wait_for_tick(&self, tick: u32) {
        self.wait_for("the motor's tick", || {
            let text = std::fs::read_to_string(self.path("motor.tick")).ok()?;
            (text.parse::<u32>().ok()? >= tick).then_some(())
        });
    }

    /// Waits for a file.
    pub fn wait_for_file(&self, name: &str) {
        self.wait_for(name, || self.path(name).exists().then_some(()));
    }

    fn wait_for<T>(&self, what: &str, mut found: impl FnMut() -> Option<T>) -> T {
        let begin = Instant::now();
        loop {
            if let Some(found) = found() {
                return found;
            }
            assert!(begin.elapsed() < PATIENCE, "{what} does not come");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Nothing that was started still runs, no temporary folder is left.
    pub fn assert_clean(&self) {
        assert_eq!(self.left_behind(), Vec::<String>::new());
    }

    /// Processes that still run and temporary files that are left.
    pub fn left_behind(&self) -> Vec<String> {
        // A killed process needs a moment until it has left the table.
        let begin = Instant::now();
        while !running_in(self.folder.path()).is_empty() && begin.elapsed() < LEAVING {
            std::thread::sleep(Duration::from_millis(5));
        }
        let processes = running_in(self.folder.path()).into_iter().map(|number| format!("process {number}"));
        let files = std::fs::read_dir(self.path("tmp")).expect("the temporary folder");
        processes.chain(files.map(|entry| entry.expect("an entry").path().display().to_string())).collect()
    }
}

/// Numbers of the processes that work in this folder or below it.
fn running_in(folder: &Path) -> Vec<String> {
    let processes = std::fs::read_dir("/proc").expect("the process table");
    processes
        .flatten()
        .filter(|entry| {
            std::fs::read_link(entry.path().join("cwd")).is_ok_and(|place| place.starts_with(folder))
        })
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect()
}

/// How a command has ended.
#[derive(Debug)]
pub struct Said {
    /// Exit status; `None`: a signal has ended it.
    pub status: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        Said {
            status: output.status.code(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// Sends a signal by its name, as `kill` does.
pub fn send(signal: &str, child: &Child) {
    let status =
        Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().expect("kill runs");
    assert!(status.success());
}
