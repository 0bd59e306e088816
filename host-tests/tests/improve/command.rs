//! The commands, with the firmware in QEMU.

use crate::rig::{DEAD_ZONE, text};
use std::process::{Output, Stdio};
use std::time::Duration;
use trials::exec_bench::send;
use trials::firmware::{qemu, truing};

const AXIS: &str = "[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 2048\n[axis]\nrated_speed_rad_s = 110.0\ntick_hz = 1000\n";

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn an_interrupted_improvement_leaves_nothing_and_a_whole_one_can_be_undone() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("motor.toml"), text(DEAD_ZONE)).expect("a file");
    std::fs::write(path("axis.toml"), AXIS).expect("a file");
    let command = |words: &[&str]| {
        let mut command = truing();
        command.current_dir(folder.path()).args(words);
        if words[0] != "history" {
            command.args(["--motor", "builtin:motor.toml", "--config", "axis.toml", "--flash", "flash.bin"]);
            command.arg("--image").arg(qemu().image);
        }
        command
    };
    let knows_nothing =
        || said(&command(&["params", "get"]).output().expect("it runs")).contains("is not configured");

    let child = command(&["improve", "--out", "better"]).stderr(Stdio::piped()).spawn().expect("it runs");
    std::thread::sleep(Duration::from_secs(2));
    // Not INT: who starts tests in the background has them ignore it.
    send("TERM", &child);
    let output = child.wait_with_output().expect("its end");
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    assert!(said(&output).contains("what was stored is in force again: interrupted"), "{}", said(&output));
    assert!(knows_nothing());

    let output = command(&["improve", "--out", "better", "--json", "found.json"]).output().expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let json = std::fs::read_to_string(path("found.json")).expect("a result");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(
        (&json["schema"], &json["improved"]),
        (&"truing-improve/1".into(), &true.into()),
        "{}",
        said(&output)
    );
    assert!(path("better/report.html").is_file() && path("better/model.extended.toml").is_file());
    assert!(!path("better/pending.json").exists());
    assert!(!knows_nothing(), "what was kept is stored");

    let output = command(&["history", "better"]).output().expect("it runs");
    assert!(said(&output).contains("kept"), "{}", said(&output));
    let output = command(&["undo", "better"]).output().expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(knows_nothing(), "as before");
}
