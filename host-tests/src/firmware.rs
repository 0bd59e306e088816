//! The firmware image in QEMU, built when a test needs it, and sessions with it.

use crate::families::Plant;
use crate::virtual_motor::VirtualMotor;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use truing::input_error::InputError;
use truing::motor::qemu::Options;
use truing::replay::{self, Verdict};
use truing::servo_link::Lockstep;
use truing::session::{self, SessionResult, Task};

/// QEMU with an image of the sources as they are. Panics with the compiler's words if it cannot be built: tests in QEMU
/// are never skipped.
pub fn qemu() -> Options {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    Options {
        image: IMAGE.get_or_init(build).clone(),
        ..Options::default()
    }
}

fn build() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the workspace");
    let target = "thumbv7em-none-eabihf";
    let status = Command::new(env!("CARGO"))
        .current_dir(root)
        .args(["build", "--quiet", "--package", "servo", "--bin", "firmware"])
        .args(["--target", target, "--profile", "firmware", "--features", "qemu"])
        .status()
        .expect("cargo runs");
    assert!(
        status.success(),
        "the image does not build; try `cargo xtask setup`, then `cargo xtask images`"
    );
    let built = root.join("target").join(target).join("firmware/firmware");
    let own = root.join("target/images/qemu-tested.elf");
    std::fs::create_dir_all(root.join("target/images")).expect("a folder for images");
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
