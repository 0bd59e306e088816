//! The bench image in QEMU: what it counted.

use std::path::{Path, PathBuf};
use std::process::Command;

/// One subject.
#[derive(Clone, Debug, PartialEq)]
pub struct Count {
    /// What was counted.
    pub name: String,
    /// Control rate, Hz; 0 where there is none.
    pub tick_hz: u32,
    /// Updates counted.
    pub updates: u32,
    /// Instructions per update, mean.
    pub average: f64,
    /// Most instructions of one update.
    pub worst: u32,
}

/// Builds the bench image and runs it. Panics with the compiler's words if it cannot be built: tests in QEMU are never
/// skipped.
pub fn run() -> Vec<Count> {
    let program = std::env::var_os("TRUING_QEMU").unwrap_or_else(|| "qemu-system-arm".into());
    let output = Command::new(program)
        .args([
            "-M",
            "netduinoplus2",
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
        ])
        .args([
            "-semihosting-config",
            "enable=on,target=native",
            "-icount",
            "shift=4",
            "-kernel",
        ])
        .arg(build())
        .output()
        .expect("QEMU can be started; try `cargo xtask setup`");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(parse).collect()
}

fn build() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the workspace");
    let target = "thumbv7em-none-eabihf";
    let status = Command::new(env!("CARGO"))
        .current_dir(root)
        .args(["build", "--quiet", "--package", "bench-image", "--target", target])
        .args(["--profile", "firmware"])
        .status()
        .expect("cargo runs");
    assert!(status.success(), "the bench image does not build");
    root.join("target").join(target).join("firmware/bench-image")
}

fn parse(line: &str) -> Count {
    let cells: Vec<&str> = line.trim().split(';').collect();
    let [name, tick_hz, updates, average, worst] = cells[..] else {
        panic!("the bench image says: {line}");
    };
    let number = |cell: &str| {
        cell.parse::<u32>()
            .unwrap_or_else(|_| panic!("the bench image says: {line}"))
    };
    Count {
        name: name.into(),
        tick_hz: number(tick_hz),
        updates: number(updates),
        average: f64::from(number(average)) / 10.0,
        worst: number(worst),
    }
}
