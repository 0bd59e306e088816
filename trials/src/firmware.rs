//! The firmware image in QEMU, built when a test needs it, and sessions with it.

use crate::families::Plant;
use crate::virtual_motor::VirtualMotor;
use boards::{FOUR_AXES, QEMU, TWO_AXES};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock};
use truing::device::link::Lockstep;
use truing::device::motor::qemu::Options;
use truing::device::replay::{self, Verdict};
use truing::device::session::{self, SessionResult, Task};
use truing::text::input_error::InputError;

/// QEMU with an image of the sources as they are. Panics with the compiler's words if it cannot be built: tests in QEMU
/// are never skipped.
pub fn qemu() -> Options {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    Options { image: IMAGE.get_or_init(|| build(None, "qemu-tested.elf")).clone(), ..Options::default() }
}

/// A power-up on this flash, with this motor behind the image.
pub fn power_up(flash: &Path, plant: &Plant) -> Lockstep {
    let options = Options { flash: Some(flash.to_owned()), ..qemu() };
    Lockstep::start(&options, Box::new(VirtualMotor::new(plant)), plant.config).expect("QEMU")
}

/// QEMU with an image of two axes.
pub fn qemu_two_axes() -> Options {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    Options {
        image: IMAGE.get_or_init(|| build(Some(TWO_AXES), "qemu-two-axes-tested.elf")).clone(),
        ..Options::default()
    }
}

/// The same with an image of four axes.
pub fn qemu_four_axes() -> Options {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    Options {
        image: IMAGE.get_or_init(|| build(Some(FOUR_AXES), "qemu-four-axes-tested.elf")).clone(),
        ..Options::default()
    }
}

/// The command line's program, of the sources as they are.
pub fn truing() -> Command {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    let build = || {
        cargo(&["build", "--quiet", "--package", "truing", "--bin", "truing"], "truing");
        root().join("target/debug/truing")
    };
    Command::new(PROGRAM.get_or_init(build))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace")
}

fn cargo(arguments: &[&str], what: &str) {
    let status =
        Command::new(env!("CARGO")).current_dir(root()).args(arguments).status().expect("cargo runs");
    assert!(status.success(), "{what} does not build; try `cargo xtask setup`, then `cargo xtask images`");
}

/// Builds QEMU's image, for one axis or as many as the feature says, and keeps it under a name of its own. One at a time:
/// every build leaves its image in the same file of Cargo's.
fn build(axes: Option<&str>, name: &str) -> PathBuf {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _turn = ONE_AT_A_TIME.lock().expect("no earlier build has failed");
    let target = QEMU.chip.target;
    let what = ["build", "--quiet", "--package", "firmware", "--bin", "firmware"];
    let how = ["--target", target, "--profile", "firmware"];
    let features = [QEMU.feature, axes].into_iter().flatten();
    let features: Vec<&str> = features.flat_map(|feature| ["--features", feature]).collect();
    cargo(&[&what[..], &how, &features].concat(), "the image");
    let built = root().join("target").join(target).join("firmware/firmware");
    let images = root().join("target/images");
    let own = images.join(name);
    std::fs::create_dir_all(&images).expect("a folder for images");
    std::fs::copy(built, &own).expect("a copy of the image");
    own
}

/// A session of a drawn plant with the image.
pub fn session(plant: &Plant, tasks: &[Task]) -> Result<SessionResult, InputError> {
    let wire = Lockstep::start(&qemu(), Box::new(VirtualMotor::new(plant)), plant.config)?;
    session::run(Box::new(wire), plant.config, 1, tasks, &mut |_| {})
}

/// Chip and host on a session of this plant.
pub fn compare(plant: &Plant, tasks: &[Task]) -> Result<(SessionResult, Verdict), InputError> {
    let result = session(plant, tasks)?;
    let verdict = replay::replay(&result.log.tape())?;
    Ok((result, verdict))
}
