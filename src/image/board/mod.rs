//! The board behind the image. Both boards offer the same names, and nothing else in the image knows which it is:
//!
//! | item | what it is |
//! |---|---|
//! | `NAME` | for the log |
//! | `AXES` | number of axes, a constant of the image |
//! | `begin(&device, &mut core) -> ResetCause` | clocks |
//! | `flash() -> Flash`, `PARAMETERS` | the flash of the stored parameters, and where in it they begin |
//! | `init(device, core) -> (Drive, Line, Idle)` | pins, timers; the bridges are open, control ticks start |
//! | `supports(&Config) -> Result<(), Refusal>` | refuses what the timers cannot do |
//! | `Drive` | owned by the control interrupt: `begin_tick()` acknowledges the interrupt; `sample(axis)` reads counter and converters, `permit(axis)` the lines behind it; `apply(axis, &Output)` sets the bridge; `end_tick() -> bool` tells whether the next tick is already due; `configure(axis, &Config)` sets the tick; `clock()`, `clock_since(start)` measure the cost of a tick |
//! | `Line` | owned by the link task: `read() -> Option<u8>`, `room()` in bytes, `write(&[u8])` |
//! | `Idle` | `turn()` runs for ever below all interrupts; `while_storing(work)` runs what may stall the processor |
//! | `bridge_off()` | from any context, even a fault: switches the bridge off |
//! | `halt() -> !` | after a fault |

#[cfg(not(feature = "qemu"))]
mod stm32f405;
#[cfg(not(feature = "qemu"))]
pub use stm32f405::{
    AXES, Drive, Flash, Idle, Line, NAME, PARAMETERS, begin, bridge_off, flash, halt, init, supports,
};

#[cfg(feature = "qemu")]
mod qemu;
#[cfg(feature = "qemu")]
pub use qemu::{
    AXES, Drive, Flash, Idle, Line, NAME, PARAMETERS, begin, bridge_off, flash, halt, init, supports,
};
