//! Linker arguments of this image, as in the build script of the firmware image.

#[path = "../../src/image/boards.rs"]
#[allow(dead_code, reason = "the table also serves the tools and the tests")]
mod boards;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=../../src/image/boards.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let memory = format!("{}/../../{}", env!("CARGO_MANIFEST_DIR"), boards::QEMU.chip.memory);
        println!("cargo::rerun-if-changed={memory}/memory.x");
        println!("cargo::rustc-link-arg-bins=-L{memory}");
        for argument in ["--nmagic", "-Tlink.x"] {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
    }
}
