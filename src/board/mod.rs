//! The board behind the image. Both boards offer the same names, and nothing else in the image knows which it is:
//!
//! | item | what it is |
//! |---|---|
//! | `NAME` | for the log |
//! | `init(device, core) -> (Drive, Line, Idle)` | clocks, pins, timers; the bridge is open, control ticks start |
//! | `supports(&Command) -> Result<(), Refusal>` | refuses what the timers cannot do |
//! | `Drive` | owned by the control interrupt: `sample()` acknowledges the interrupt and reads counter and converters; `apply(&Output)` sets the bridge; `configure(&Config)` sets the tick; `clock()`, `clock_since(start)` measure the cost of a tick |
//! | `Line` | owned by the link task: `read() -> Option<u8>`, `room()` in bytes, `write(&[u8])` |
//! | `Idle` | `turn()` runs for ever below all interrupts |
//! | `bridge_off()` | from any context, even a fault: switches the bridge off |
//! | `halt() -> !` | after a fault |

#[cfg(not(feature = "qemu"))]
mod stm32f405;
#[cfg(not(feature = "qemu"))]
pub use stm32f405::{Drive, Idle, Line, NAME, bridge_off, halt, init, supports};

#[cfg(feature = "qemu")]
mod qemu;
#[cfg(feature = "qemu")]
pub use qemu::{Drive, Idle, Line, NAME, bridge_off, halt, init, supports};
