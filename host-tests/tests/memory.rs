//! The image's own functions that copy and clear memory, with every alignment, on QEMU's core.

use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn copies_and_clears_are_right_with_every_alignment_and_length() {
    let status = Command::new("qemu-system-arm")
        .args([
            "-M",
            "netduinoplus2",
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
        ])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image())
        .status()
        .expect("qemu-system-arm starts: `cargo xtask setup` installs it");
    assert!(status.success(), "the image ended with {status}");
}

fn image() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let built = Command::new(cargo)
        .args(["build", "--quiet", "--package", "servo", "--bin", "memory-check"])
        .args(["--target", "thumbv7em-none-eabihf", "--profile", "firmware"])
        .current_dir(&root)
        .status()
        .expect("cargo starts");
    assert!(built.success(), "the test image does not build");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    target.join("thumbv7em-none-eabihf/firmware/memory-check")
}
