//! QEMU's STM32F405 (`netduinoplus2`) with the motor on the host.
//!
//! QEMU has the core, its interrupts and SysTick, but no working TIM1, encoder counter or converter. So idle exchanges
//! one message per control tick with the host, over two named pipes in QEMU's working directory, and then pends the
//! control interrupt. Nothing runs in real time, everything in lock-step: a run is a function of what the host sends.
//!
//! | to the host, [`TO_HOST`] | | from the host, [`FROM_HOST`] | |
//! |---|---|---|---|
//! | 0–3 | u32 number of the tick | 0–3 | i32 encoder count at the end of the tick |
//! | 4–5 | i16 duty, PWM counts | 4–5 | u16 supply, converter counts |
//! | 6 | u8 bridge | 6–7 | i16 winding current, converter counts |
//! | 7 | u8 zero | 8–9 | u16 length of what follows |
//! | 8–11 | u32 length of what follows | 10–11 | u16 1: stop, else 0 |
//! | 12– | bytes that the servo sent over its link | 12– | bytes for the servo's link |

mod exchange;

use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m::peripheral::{NVIC, SYST, syst::SystClkSource};
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use servo::axis::{Output, Sample};
use servo::config::Config;
use servo::protocol::{Command, Refusal};
use stm32f4xx_hal::pac::{CorePeripherals, Interrupt, Peripherals};

use defmt_semihosting as _;

/// For the log.
pub const NAME: &str = "QEMU netduinoplus2";

/// Named pipes in QEMU's working directory.
const TO_HOST: &core::ffi::CStr = c"to_host";
const FROM_HOST: &core::ffi::CStr = c"from_host";

/// SysTick counts 24 bits, downwards.
const CLOCK_MASK: u32 = 0x00FF_FFFF;

static BRIDGE_OFF: AtomicBool = AtomicBool::new(false);

/// Opens the pipes; the first exchange, with the bridge open, is the first turn of idle.
pub fn init(_device: Peripherals, mut core: CorePeripherals) -> (Drive, Line, Idle) {
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(CLOCK_MASK);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    let missing = "the host has not made the pipes";
    let to_host = File::create(TO_HOST).expect(missing);
    let from_host = File::open(FROM_HOST).expect(missing);
    (
        Drive,
        Line,
        Idle {
            to_host,
            from_host,
            tick: 0,
            frame: [0; exchange::FRAME],
        },
    )
}

/// Any control rate: time is what the host says.
pub fn supports(_command: &Command) -> Result<(), Refusal> {
    Ok(())
}

/// The virtual motor's bridge and sensors.
pub struct Drive;

impl Drive {
    /// What the host answered last.
    pub fn sample(&mut self) -> Sample {
        exchange::with(|exchange| exchange.sample)
    }

    /// Acts after the configured number of ticks, as a preloaded compare register would.
    pub fn apply(&mut self, output: &Output) {
        exchange::with(|exchange| exchange.drive(output.bridge, output.duty));
    }

    /// Takes over the delay of the PWM.
    pub fn configure(&mut self, config: &Config) {
        exchange::with(|exchange| exchange.delay_ticks = config.pwm_delay_ticks);
    }

    /// SysTick, turned to count upwards.
    pub fn clock(&self) -> u32 {
        CLOCK_MASK - SYST::get_current()
    }

    /// Counts of SysTick since `start`, modulo 2²⁴. Under `-icount shift=4` one instruction is 16 ns = 2.688 counts.
    pub fn clock_since(&self, start: u32) -> u32 {
        self.clock().wrapping_sub(start) & CLOCK_MASK
    }
}

/// The link, carried by the exchange.
pub struct Line;

impl Line {
    /// The next byte from the host.
    pub fn read(&mut self) -> Option<u8> {
        exchange::with(|exchange| exchange.incoming.pop_front())
    }

    /// Bytes that [`Line::write`] has room for.
    pub fn room(&self) -> usize {
        exchange::with(|exchange| exchange.outgoing.capacity() - exchange.outgoing.len())
    }

    /// Sends; what does not fit is lost.
    pub fn write(&mut self, bytes: &[u8]) {
        let _ = exchange::with(|exchange| exchange.outgoing.extend_from_slice(bytes));
    }
}

/// Keeps the lock-step.
pub struct Idle {
    to_host: File,
    from_host: File,
    tick: u32,
    frame: [u8; exchange::FRAME],
}

impl Idle {
    /// One tick: tell the host what the bridge does, take what the motor did, let control and link run.
    pub fn turn(&mut self) {
        let off = BRIDGE_OFF.load(Ordering::Relaxed);
        let length = exchange::with(|exchange| exchange.take_frame(self.tick, off, &mut self.frame));
        if self.to_host.write_all(&self.frame[..length]).is_err() {
            semihosting::process::exit(0);
        }
        self.receive();
        self.tick = self.tick.wrapping_add(1);
        NVIC::pend(Interrupt::ADC);
    }

    fn receive(&mut self) {
        let mut head = [0; exchange::HEAD];
        self.read(head.len())
            .iter()
            .zip(&mut head)
            .for_each(|(from, to)| *to = *from);
        let (length, stop) = exchange::with(|exchange| exchange.take_answer(&head));
        if stop {
            semihosting::process::exit(0);
        }
        let bytes = self.read(length);
        exchange::with(|exchange| exchange.hear(bytes));
    }

    /// End of input means: stop.
    fn read(&mut self, length: usize) -> &[u8] {
        if self.from_host.read_exact(&mut self.frame[..length]).is_err() {
            semihosting::process::exit(0);
        }
        &self.frame[..length]
    }
}

/// The next frame opens the bridge, and so do all later ones.
pub fn bridge_off() {
    BRIDGE_OFF.store(true, Ordering::Relaxed);
}

/// Ends QEMU; the host sees its pipe close and the status 101.
pub fn halt() -> ! {
    semihosting::process::exit(101)
}
