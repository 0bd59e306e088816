//! Linker arguments of the firmware image. They stand here and not in `.cargo/config.toml` because a `RUSTFLAGS`
//! variable in the environment would silently replace them there and leave an image without a vector table.

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo:rustc-link-arg-bins={argument}");
        }
    }
}
