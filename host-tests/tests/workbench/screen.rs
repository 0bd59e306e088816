//! What the command line prints, and what it does when nobody reads it or the disk is full.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use trials::exec_bench::Said;
use trials::firmware::truing;
use truing::synthetic::cases::{Case, Set, Spec, draw};

/// A pipe whose reader has gone, as behind `| head`.
fn closed_pipe() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

fn full_disk() -> Stdio {
    let device = File::options().write(true).open("/dev/full");
    device.expect("the device that is always full").into()
}

fn said(command: &mut Command, stdout: Stdio) -> Said {
    command.stdout(stdout).stderr(Stdio::piped());
    command.spawn().expect("it runs").wait_with_output().expect("its end").into()
}

fn case() -> Case {
    let spec = Spec { rows: 600, dirty: Some(false), ..Spec::new(Set::Single) };
    draw(&spec, 1)
}

/// The commands that print, on files in this folder.
fn commands(folder: &Path) -> Vec<Command> {
    let (case, file) = (case(), |name: &str| folder.join(name));
    std::fs::write(file("model.toml"), &case.model).expect("a file");
    std::fs::write(file("log.csv"), case.log.to_csv()).expect("a file");
    let arguments: [&[&str]; 3] = [
        &["effects"],
        &["simulate", "--model", "model.toml", "--input", "log.csv"],
        &["gap", "--model", "model.toml", "--log", "log.csv"],
    ];
    let command = |arguments: &&[&str]| {
        let mut command = truing();
        command.args(*arguments).current_dir(folder);
        command
    };
    arguments.iter().map(command).collect()
}

#[test]
fn a_reader_that_has_gone_ends_the_output_quietly() {
    let folder = tempfile::tempdir().expect("a folder");
    for mut command in commands(folder.path()) {
        let said = said(&mut command, closed_pipe());
        assert_eq!(said.status, Some(0), "{command:?}: {said:?}");
        assert!(!said.err.contains("error") && !said.err.contains("panicked"), "{said:?}");
    }
}

#[test]
fn a_full_disk_behind_the_output_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    for mut command in commands(folder.path()) {
        let said = said(&mut command, full_disk());
        assert_eq!(said.status, Some(2), "{command:?}: {said:?}");
        assert!(said.err.contains("standard output cannot be written (No space left"), "{said:?}");
        assert!(!said.err.contains("panicked"), "{said:?}");
    }
}

#[test]
fn complaints_that_cannot_be_written_change_nothing() {
    let mut command = truing();
    command.args(["effects", "no_such_effect"]).stderr(full_disk());
    let status = command.stdout(Stdio::null()).status().expect("it runs");
    assert_eq!(status.code(), Some(2));
}

/// Without a terminal there is no spinner; a line a round says that it lives, on standard error alone.
#[test]
fn a_gap_without_a_terminal_tells_every_round() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut gap = commands(folder.path()).pop().expect("gap");
    let said = said(&mut gap, Stdio::piped());
    assert_eq!(said.status, Some(0), "{said:?}");
    let rounds: Vec<&str> = said.err.lines().filter(|line| line.contains("round ")).collect();
    assert!(rounds[0].contains("candidates fitted, round 1"), "{said:?}");
    assert!(rounds.len() >= 2, "{said:?}");
    assert!(!said.out.contains("candidates fitted"), "{said:?}");
}

/// The first call compiles for minutes: Cargo shows it.
#[test]
fn the_alias_shows_the_compile() {
    let config = include_str!("../../../.cargo/config.toml");
    let alias = config.lines().find(|line| line.starts_with("truing =")).expect("the alias");
    assert!(!alias.contains("quiet"), "{alias}");
}
