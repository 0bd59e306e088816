//! The firmware images.

use crate::process::{root, run};
use crate::programs::{self, Program};
use crate::raw;
use anyhow::{Context, Result};
use boards::{BOARDS, Board, DEFAULT};
use std::path::PathBuf;
use std::process::Command;

/// What an image is built for: a board, and a number of axes.
#[derive(Clone, Copy)]
pub struct Image {
    /// The board.
    pub board: &'static Board,
    /// The Cargo feature that chooses the number of axes; one axis without it.
    axes: Option<&'static str>,
}

impl Image {
    /// The image of a board for one axis.
    pub const fn of(board: &'static Board) -> Self {
        Image { board, axes: None }
    }

    /// The image of a board for as many axes as it can drive, if that is another one: built to see that it fits.
    fn full(board: &'static Board) -> Option<Self> {
        board.most_axes.filter(|_| board.machine.is_none()).map(|axes| Image { board, axes: Some(axes) })
    }

    /// The name of its file.
    pub fn name(self) -> String {
        let parts = [Some(self.board.name), self.axes];
        parts.into_iter().flatten().collect::<Vec<_>>().join("-")
    }

    /// A Cargo command on this image.
    pub fn command(self, verb: &str) -> Command {
        let mut command = Program::Firmware.cargo(verb);
        command.args(["--target", self.board.chip.target, "--profile", "firmware"]);
        let features = [self.board.feature, self.axes].into_iter().flatten();
        command.args(features.flat_map(|feature| ["--features", feature]));
        command.args(short_paths(self.board.chip.target));
        command
    }

    /// Builds it and returns where it lies; `.bin` and `.hex` lie beside it. All images share Cargo's output name, so the file is copied.
    pub fn build(self) -> Result<PathBuf> {
        run(&mut self.command("build"))?;
        let folder = root().join("target/images");
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let image = folder.join(format!("{}.elf", self.name()));
        let target = root().join("target").join(self.board.chip.target);
        let built = target.join("firmware/firmware");
        std::fs::copy(&built, &image)
            .with_context(|| format!("cannot copy {} to {}", built.display(), image.display()))?;
        raw::write(&image)?;
        Ok(image)
    }
}

/// A panic names its file. Without these arguments that is where the packages lie on this machine, which takes 1 KB of flash, more or
/// less of it from one machine to another.
fn short_paths(target: &str) -> Vec<String> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| std::env::home_dir().map(|home| home.join(".cargo")));
    let registries = home.and_then(|home| std::fs::read_dir(home.join("registry/src")).ok());
    let prefix = |folder: PathBuf| format!("--remap-path-prefix={}=", folder.display());
    let flags: Vec<_> =
        registries.into_iter().flatten().flatten().map(|entry| prefix(entry.path())).collect();
    if flags.is_empty() {
        return Vec::new();
    }
    vec!["--config".into(), format!("target.{target}.rustflags={flags:?}")]
}

/// For which boards images are built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boards {
    /// The default board and the one that QEMU plays; the others differ from them by a table of pins.
    Two,
    /// All of them.
    All,
}

impl Boards {
    /// They themselves.
    pub fn list(self) -> impl Iterator<Item = &'static Board> {
        let such = move |board: &&Board| {
            self == Boards::All || board.machine.is_some() || board.name == DEFAULT.name
        };
        BOARDS.into_iter().filter(such)
    }

    /// Without the one that is a program.
    pub fn real(self) -> impl Iterator<Item = &'static Board> {
        self.list().filter(|board| board.machine.is_none())
    }

    /// The images whose size is watched: that of each board, and the largest of each that is no program.
    pub fn watched(self) -> impl Iterator<Item = Image> {
        self.list().flat_map(|board| [Some(Image::of(board)), Image::full(board)]).flatten()
    }
}

/// A Cargo command on an example of the library for the default board's chip, with what the images have compiled already.
pub fn example(verb: &str, name: &str) -> Command {
    for_default_chip(programs::example(verb, name))
}

/// A Cargo command on the image that is counted beside published crates.
pub fn bench(verb: &str) -> Command {
    for_default_chip(Program::BenchOnChip.cargo(verb))
}

fn for_default_chip(mut command: Command) -> Command {
    command.args(["--target", DEFAULT.chip.target, "--profile", "firmware"]);
    command
}
