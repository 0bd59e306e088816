//! Chooses board and chip of the firmware image, and gives the linker its arguments. Those stand here and not in
//! `.cargo/config.toml` because a `RUSTFLAGS` variable in the environment would silently replace them there and leave an
//! image without a vector table.

#[path = "boards.rs"]
#[allow(dead_code, reason = "the table also serves the tools and the tests")]
mod boards;

use boards::{BOARDS, Board};
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=boards.rs");
    let chips = BOARDS.map(|board| board.chip.name);
    declare("board", &BOARDS.map(|board| board.name));
    declare("chip", &chips);
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        choose(boards::chosen(has_feature).unwrap_or_else(|error| panic!("{error}")));
    }
}

/// Tells the compiler which values a configuration key can have, so that it reports any other.
fn declare(key: &str, values: &[&str]) {
    let values: Vec<_> = values.iter().map(|value| format!("{value:?}")).collect();
    println!("cargo::rustc-check-cfg=cfg({key}, values({}))", values.join(", "));
}

fn has_feature(name: &str) -> bool {
    let name = name.to_uppercase().replace('-', "_");
    std::env::var_os(format!("CARGO_FEATURE_{name}")).is_some()
}

fn choose(board: &Board) {
    println!("cargo::rustc-cfg=board={:?}", board.name);
    println!("cargo::rustc-env=BOARD={}", board.name);
    println!("cargo::rustc-cfg=chip={:?}", board.chip.name);
    let memory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(board.chip.memory);
    println!("cargo::rerun-if-changed={}", memory.join("memory.x").display());
    println!("cargo::rustc-link-arg-bins=-L{}", memory.display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
