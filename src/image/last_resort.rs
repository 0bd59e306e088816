//! Handlers of panics and faults. Whatever happens, they switch the bridge off before they write to the log.

use super::board;
use cortex_m_rt::{ExceptionFrame, exception};

/// Masks all interrupts, then switches the bridge off: the control interrupt outranks idle and link, and would drive the
/// bridge again in its next tick.
fn bridge_off() {
    cortex_m::interrupt::disable();
    board::bridge_off();
}

/// Tells the place alone: the words would bring 10 KiB of formatting into the image. Within the function that has put them together the
/// compiler sees that nobody reads them, and leaves out 2 KB more.
#[panic_handler]
#[allow(unused_attributes, reason = "said to be ignored for a handler; the linker's optimisation goes by it")]
#[inline(always)]
fn panic(info: &core::panic::PanicInfo) -> ! {
    bridge_off();
    match info.location() {
        Some(place) => defmt::error!("panic at {=str}:{=u32}", place.file(), place.line()),
        None => defmt::error!("panic"),
    }
    board::halt()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    bridge_off();
    defmt::error!("hard fault at {=u32:#010x}", frame.pc());
    board::halt()
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    bridge_off();
    defmt::error!("unexpected interrupt {=i16}", number);
    board::halt()
}
