//! What an update costs: the identifier, the compensator and the whole loop step of `servo` beside what one would
//! otherwise take from published crates, counted in one run of QEMU under `-icount shift=4`.
//!
//! SysTick then counts 2.688 for every instruction (16 ns at 168 MHz). One line a subject goes to the host:
//! `name;updates;average in tenths;worst`. Instructions, not cycles.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod motor;
#[cfg(target_os = "none")]
mod ours;
#[cfg(target_os = "none")]
mod rivals;
#[cfg(target_os = "none")]
mod tally;

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This is an image for QEMU: `cargo xtask bench` builds and runs it.");
}

#[cfg(target_os = "none")]
mod image {
    use cortex_m_rt::{ExceptionFrame, entry, exception};
    // The interrupt vectors.
    use stm32f4xx_hal as _;

    #[entry]
    fn main() -> ! {
        let core = cortex_m::Peripherals::take().expect("first and only");
        crate::tally::start(core.SYST);
        for tick_hz in [1_000, 10_000] {
            crate::ours::run(tick_hz);
        }
        crate::ours::compensator();
        crate::rivals::run();
        semihosting::process::exit(0)
    }

    #[panic_handler]
    fn panic(info: &core::panic::PanicInfo) -> ! {
        semihosting::println!("{info}");
        semihosting::process::exit(101)
    }

    #[exception]
    unsafe fn HardFault(_: &ExceptionFrame) -> ! {
        semihosting::process::exit(102)
    }
}
