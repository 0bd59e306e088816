//! Images that are made for a test: built, and run by QEMU to their end, without a motor behind them.

use boards::QEMU;
use std::path::{Path, PathBuf};
use std::process::Command;

const TARGET: &str = QEMU.chip.target;

/// Builds a binary of a package for the chip. Panics with the compiler's words if it cannot be built: tests in QEMU are
/// never skipped.
pub fn built(package: &str, binary: &str) -> PathBuf {
    built_as("firmware", package, binary)
}

/// The same, with this profile of Cargo's.
pub fn built_as(profile: &str, package: &str, binary: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    // For speed without what `.cargo/config.toml` does for size.
    let fast = (profile == "bench-image").then_some(("RUSTFLAGS", "-C target-cpu=cortex-m4"));
    let status = Command::new(cargo)
        .current_dir(root)
        .envs(fast)
        .args(["build", "--quiet", "--package", package, "--bin", binary])
        .args(["--target", TARGET, "--profile", profile])
        .status()
        .expect("cargo starts");
    assert!(status.success(), "{binary} does not build");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    target.join(TARGET).join(profile).join(binary)
}

/// QEMU's board with an image; it ends when the image does.
pub fn qemu(image: &Path) -> Command {
    let program = std::env::var_os("TRUING_QEMU").unwrap_or_else(|| "qemu-system-arm".into());
    let machine = QEMU.machine.expect("QEMU plays a machine");
    let mut command = Command::new(program);
    command
        .args(["-M", machine, "-nographic"])
        .args(["-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-kernel")
        .arg(image);
    command
}
