//! The firmware image.
//!
//! ```text
//! priority 3  control  every tick: read the encoders, step the axes, set the bridges, queue the records
//! priority 2  link     commands in, answers and telemetry out
//! priority 0  idle     the stored parameters, and the board's own business (in QEMU: the motors on the host)
//! ```
//!
//! The image for QEMU and the one for the board differ in `image/board/` alone.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod image;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware of an STM32F405. `cargo xtask demo` builds and runs it in QEMU; `cargo flash` flashes a board."
    );
}
