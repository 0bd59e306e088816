//! What the project needs beyond Rust itself: the targets of chip and browser, and QEMU. Installs what it may, else says in one
//! sentence what to type.

use crate::process::{find, run};
use anyhow::{Context, Result, bail};
use boards::BOARDS;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// For what the workbench's engine is checked, beside the host.
pub const BROWSER: &str = "wasm32-unknown-unknown";
const QEMU: &str = "qemu-system-arm";

/// Installs everything that is missing.
pub fn everything() -> Result<()> {
    rust_targets()?;
    rust_target(BROWSER)?;
    qemu()
}

/// Installs the target of every chip: enough to build an image.
pub fn rust_targets() -> Result<()> {
    let targets: BTreeSet<_> = BOARDS.iter().map(|board| board.chip.target).collect();
    targets.into_iter().try_for_each(rust_target)
}

fn rust_target(target: &str) -> Result<()> {
    if is_installed(target)? {
        return Ok(());
    }
    println!("set-up: installing the Rust target {target}");
    let added =
        run(Command::new("rustup").args(["target", "add", target]).current_dir(crate::process::root()));
    if added.is_err() || !is_installed(target)? {
        bail!(
            "the Rust target {target} is missing and could not be installed: type `rustup target add {target}` (rustup: https://rustup.rs)"
        );
    }
    Ok(())
}

/// Asks the compiler, not rustup: a distribution's Rust brings its targets without it.
fn is_installed(target: &str) -> Result<bool> {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", target])
        .current_dir(crate::process::root())
        .output()
        .context("`rustc` cannot be started: install Rust from https://rustup.rs")?;
    let folder = String::from_utf8_lossy(&output.stdout).trim().to_string();
    Ok(output.status.success() && Path::new(&folder).is_dir())
}

fn qemu() -> Result<()> {
    if find(QEMU).is_some() {
        return Ok(());
    }
    if find("apt-get").is_none() {
        bail!(
            "{QEMU} is missing: install QEMU for Arm with your system's package manager (https://www.qemu.org/download)"
        );
    }
    if !is_root() {
        bail!(
            "{QEMU} is missing: type `sudo apt-get install --yes qemu-system-arm` and run this command again"
        );
    }
    println!("set-up: installing {QEMU}");
    apt(&["update", "--quiet=2"])?;
    apt(&["install", "--yes", "--quiet=2", "--no-install-recommends", "--no-remove", "qemu-system-arm"])?;
    if find(QEMU).is_none() {
        bail!(
            "{QEMU} is missing although apt-get reported success: install the package qemu-system-arm by hand"
        );
    }
    Ok(())
}

fn apt(arguments: &[&str]) -> Result<()> {
    run(Command::new("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive")).context(
        "QEMU could not be installed: type `apt-get install --yes qemu-system-arm` and see what it says",
    )
}

fn is_root() -> bool {
    let output = Command::new("id").arg("-u").output();
    output.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim() == "0")
}
