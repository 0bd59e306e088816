//! The image onto a board, or as if onto a board.

use crate::image::Image;
use crate::process::{find, run};
use crate::programs::Program;
use anyhow::{Result, bail};
use boards::DEFAULT;
use std::path::Path;
use std::process::Command;

const PROBE: &str = "probe-rs";

/// Builds the board's image, flashes and runs it, and shows its log until Ctrl-C. With `dry_run` it is checked against the
/// chip's memory map instead; that needs no probe, no board and no installed program.
pub fn flash(dry_run: bool) -> Result<()> {
    if !dry_run && find(PROBE).is_none() {
        bail!(
            "the program {PROBE} is missing: install it as https://probe.rs tells, or type `cargo xtask flash --dry-run`, which needs no probe"
        );
    }
    let image = Image::of(DEFAULT).build()?;
    match dry_run {
        true => check(&image),
        false => run(Command::new(PROBE).args(["run", "--chip", DEFAULT.chip.probe]).arg(image)),
    }
}

fn check(image: &Path) -> Result<()> {
    println!("dry run: {} for {}", image.display(), DEFAULT.chip.probe);
    run(Program::FlashDryRun.run().arg(image))
}
