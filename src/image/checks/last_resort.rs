//! A test image: the image's own handlers of panics and faults, while a control interrupt drives the bridge in every tick.
//! The test `last_resort` runs it in QEMU, once for every way to end.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../last_resort.rs"]
mod last_resort;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is a test image for QEMU: `cargo test --package host-tests --test image last_resort::` builds and runs it."
    );
}

/// What the handlers need of a board; the bridge is a flag.
#[cfg(target_os = "none")]
mod board {
    use core::sync::atomic::{AtomicBool, Ordering};
    use defmt_rtt as _;

    /// Several control ticks, in turns of a loop of some instructions.
    const SEVERAL_TICKS: u32 = 100 * crate::image::TICK;

    static DRIVEN: AtomicBool = AtomicBool::new(false);

    pub fn drive() {
        DRIVEN.store(true, Ordering::SeqCst);
    }

    pub fn is_driven() -> bool {
        DRIVEN.load(Ordering::SeqCst)
    }

    pub fn bridge_off() {
        DRIVEN.store(false, Ordering::SeqCst);
    }

    /// Tells whether the bridge stays off.
    pub fn halt() -> ! {
        cortex_m::asm::delay(SEVERAL_TICKS);
        semihosting::process::exit(i32::from(is_driven()))
    }
}

#[cfg(target_os = "none")]
mod image {
    use crate::board;
    use cortex_m::peripheral::scb::SystemHandler;
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m::peripheral::{NVIC, Peripherals};
    use cortex_m_rt::{entry, exception};
    use semihosting::fs::File;
    use semihosting::io::Read;
    use stm32f4xx_hal::pac::{Interrupt, interrupt};

    /// Clocks of a control tick.
    pub const TICK: u32 = 10_000;
    /// Priorities as in the image: link 2 and control 3 of 16, in the upper four bits and counted downwards.
    const CONTROL: u8 = (16 - 3) << 4;
    const LINK: u8 = (16 - 2) << 4;

    #[entry]
    fn main() -> ! {
        let mut core = Peripherals::take().expect("first and only");
        // SAFETY: no interrupt is enabled yet.
        unsafe {
            core.SCB.set_priority(SystemHandler::SysTick, CONTROL);
            core.NVIC.set_priority(Interrupt::USART2, LINK);
            NVIC::unmask(Interrupt::USART2);
            NVIC::unmask(Interrupt::USART3);
        }
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(TICK);
        core.SYST.clear_current();
        core.SYST.enable_interrupt();
        core.SYST.enable_counter();
        while !board::is_driven() {}
        match way() {
            b'i' => panic!("in idle"),
            b'l' => NVIC::pend(Interrupt::USART2),
            b'f' => cortex_m::asm::udf(),
            b'u' => NVIC::pend(Interrupt::USART3),
            _ => {}
        }
        cortex_m::asm::delay(TICK);
        // None of the handlers ran.
        semihosting::process::exit(2)
    }

    /// The first letter of the file `way` in QEMU's working directory.
    fn way() -> u8 {
        let mut letter = [0];
        let read = File::open(c"way").and_then(|mut file| file.read_exact(&mut letter));
        if read.is_ok() { letter[0] } else { 0 }
    }

    /// Control.
    #[exception]
    fn SysTick() {
        board::drive();
    }

    /// Link.
    #[interrupt]
    fn USART2() {
        panic!("in link");
    }
}
