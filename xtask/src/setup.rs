//! What the project needs beyond Rust itself: the targets of chip and browser, and QEMU. Installs what it may, else says in one
//! sentence what to type.

use crate::process::{QEMU, find, qemu_folder, root, run, unpacked_qemu};
use anyhow::{Context, Result, bail};
use boards::BOARDS;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// For what the workbench's engine is checked, beside the host.
pub const BROWSER: &str = "wasm32-unknown-unknown";

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

/// Installs one target.
pub fn rust_target(target: &str) -> Result<()> {
    if is_installed(target)? {
        return Ok(());
    }
    println!("set-up: installing the Rust target {target}");
    let added = run(Command::new("rustup").args(["target", "add", target]).current_dir(root()));
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
        .current_dir(root())
        .output()
        .context("`rustc` cannot be started: install Rust from https://rustup.rs")?;
    let folder = String::from_utf8_lossy(&output.stdout).trim().to_string();
    Ok(output.status.success() && Path::new(&folder).is_dir())
}

fn qemu() -> Result<()> {
    if find(QEMU).is_some() || unpacked_qemu().is_some() {
        return Ok(());
    }
    if find("apt-get").is_none() {
        bail!(
            "{QEMU} is missing: install QEMU for Arm with your system's package manager (https://www.qemu.org/download)"
        );
    }
    println!("set-up: installing {QEMU}");
    if is_root() {
        apt(&["update", "--quiet=2"])?;
        if !asked()?.lines().any(|line| line.starts_with("Remv ")) {
            apt(&["install", "--yes", "--quiet=2", "--no-install-recommends", "--no-remove", QEMU])?;
            return Ok(());
        }
    }
    unpack()
}

/// What apt-get would do to install QEMU, line by line.
fn asked() -> Result<String> {
    let mut command = Command::new("apt-get");
    command.args(["install", "--simulate", "--no-install-recommends", QEMU]);
    let output = command.output().context("`apt-get` cannot be started")?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Unpacks the system's own packages into `target/qemu`: where nobody may install, or where an installation would remove what
/// is there (another QEMU's tools).
fn unpack() -> Result<()> {
    let (folder, script) = (qemu_folder(), qemu_folder().join(QEMU));
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let plan = asked()?;
    let packages: Vec<&str> =
        plan.lines().filter_map(|line| line.strip_prefix("Inst ")?.split(' ').next()).collect();
    if packages.is_empty() {
        bail!(ADVICE);
    }
    run(Command::new("apt-get").args(["download", "--quiet=2"]).args(&packages).current_dir(&folder))
        .context(ADVICE)?;
    for entry in std::fs::read_dir(&folder)? {
        let package = entry?.path();
        if package.extension().is_some_and(|ending| ending == "deb") {
            run(Command::new("dpkg-deb").arg("--extract").arg(&package).arg(&folder)).context(ADVICE)?;
            std::fs::remove_file(&package)?;
        }
    }
    // The libraries lie below folders that are named after the processor.
    let text = format!(
        "#!/bin/sh\nhere=$(dirname \"$0\")\nfor folder in \"$here\"/usr/lib/*-linux-gnu* \"$here\"/lib/*-linux-gnu*; do libraries=$folder:$libraries; done\n\
         LD_LIBRARY_PATH=$libraries$LD_LIBRARY_PATH exec \"$here/usr/bin/{QEMU}\" -L \"$here/usr/share/qemu\" \"$@\"\n"
    );
    std::fs::write(&script, text)?;
    run(Command::new("chmod").arg("+x").arg(&script))?;
    if let Err(error) = run(Command::new(&script).arg("--version").stdout(std::process::Stdio::null())) {
        std::fs::remove_file(&script)?;
        return Err(error.context(ADVICE));
    }
    println!(
        "set-up: {QEMU} is unpacked; commands of your own find it by `export TRUING_QEMU={}`",
        script.display()
    );
    Ok(())
}

const ADVICE: &str =
    "QEMU could not be installed: type `sudo apt-get install --yes qemu-system-arm` and see what it says";

fn apt(arguments: &[&str]) -> Result<()> {
    run(Command::new("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive")).context(ADVICE)
}

fn is_root() -> bool {
    let output = Command::new("id").arg("-u").output();
    output.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim() == "0")
}
