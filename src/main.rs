//! The firmware image.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware of an STM32F405. `cargo xtask demo` builds and runs it in QEMU; `cargo flash` flashes a board."
    );
}
