//! QEMU's STM32F405 (`netduinoplus2`) with the motor on the host.
//!
//! QEMU has the core, its interrupts and SysTick, but no working TIM1, encoder counter or converter. So idle exchanges
//! one message per control tick with the host, over two named pipes in QEMU's working directory, and then pends the
//! control interrupt. Nothing runs in real time, everything in lock-step: a run is a function of what the host sends.
//!
//! | to the host, [`TO_HOST`] | | from the host, [`FROM_HOST`] | |
//! |---|---|---|---|
//! | 0–3 | u32 number of the tick | 0–1 | u16 length of the link bytes |
//! | 4–5 | u16 length of the link bytes | 2–3 | u16 flags: 1 stop, 2 the last tick took too long, 4 enable contact open, 8 fault of the bridge, 16 index pulse |
//! | 6–7 | u16 number of axes | | |
//! | then for every axis | | then for every axis | |
//! | 0–1 | i16 duty, PWM counts | 0–3 | i32 encoder count at the end of the tick |
//! | 2 | u8 bridge | 4–5 | u16 supply, converter counts |
//! | 3 | u8 zero | 6–7 | i16 winding current, converter counts |
//! | then | bytes that the servo sent over its link | then | bytes for the servo's link |
//!
//! Host and image agree on the number of axes; the host learns it from the first message.

mod exchange;
mod flash;
mod stack;

use super::{AXES, Board, Drive, Idle, Line, Started};
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m::peripheral::{NVIC, SCB, SYST, syst::SystClkSource};
use flash::FileFlash;
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use servo::axis::{Bridge, Sample};
use servo::config::Config;
use servo::drivers::reach::Reach;
use servo::drivers::scales::Scales;
use servo::link::board::{Clock, Gates};
use servo::link::protocol::{Refusal, ResetCause};
use servo::optional::Optional;
use servo::protect::{Interlock, Settings};
use stm32f4xx_hal::pac::{CorePeripherals, Interrupt, Peripherals};

use defmt_semihosting as _;

/// Named pipes in QEMU's working directory.
const TO_HOST: &core::ffi::CStr = c"to_host";
const FROM_HOST: &core::ffi::CStr = c"from_host";
/// A file that the host makes to have this start pass for one by the watchdog.
const WATCHDOG: &core::ffi::CStr = c"started_by_watchdog";

/// A file that the image makes to know after a reset that it has asked for it.
const RESTARTED: &core::ffi::CStr = c"restarted";

/// SysTick counts 24 bits, downwards.
const CLOCK_MASK: u32 = 0x00FF_FFFF;

static BRIDGE_OFF: AtomicBool = AtomicBool::new(false);

/// The board.
pub struct Qemu;

impl Board for Qemu {
    const NAME: &'static str = "QEMU netduinoplus2";
    const MOST_AXES: usize = 4;
    /// The host makes counts of volts and amperes, by the configuration that it sends.
    const SCALES: Scales = Scales { supply: Optional::NONE, current: Optional::NONE };
    const PARAMETERS: u32 = flash::PARAMETERS;

    type Device = Peripherals;
    type Drive = PipeDrive;
    type Line = PipeLine;
    type Idle = LockStep;
    type Flash = FileFlash;

    /// Sets nothing up: time is what the host says.
    fn begin(_device: &Peripherals, _core: &mut CorePeripherals) -> Started {
        let cause = match (File::open(WATCHDOG), File::open(RESTARTED)) {
            (Ok(_), _) => ResetCause::Watchdog,
            (Err(_), Ok(_)) => ResetCause::Software,
            (Err(_), Err(_)) => ResetCause::Power,
        };
        Started { cause, clock: Clock::Simulated, brown_out_reset_off: false }
    }

    fn flash() -> FileFlash {
        FileFlash::open()
    }

    /// Opens the pipes; the first exchange, with the bridge open, is the first turn of idle.
    fn init(_device: Peripherals, mut core: CorePeripherals) -> (PipeDrive, PipeLine, LockStep) {
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(CLOCK_MASK);
        core.SYST.clear_current();
        core.SYST.enable_counter();
        let missing = "the host has not made the pipes";
        let to_host = File::create(TO_HOST).expect(missing);
        let from_host = File::open(FROM_HOST).expect(missing);
        (
            PipeDrive {
                samples: [Sample::NONE; AXES],
                interlock: Interlock::Granted,
                index: false,
                decided: [(Bridge::Open, 0); AXES],
            },
            PipeLine,
            LockStep { to_host, from_host, tick: 0, frame: [0; exchange::FRAME] },
        )
    }

    /// Supports any control rate: time is what the host says. Converters are as wide as their words.
    fn supports(config: &Config, protection: Option<&Settings>) -> Result<(), Refusal> {
        Ok(Reach::WORDS.allows(config, protection)?)
    }

    /// The next frame opens the bridge, and so do all later ones.
    fn bridge_off() {
        BRIDGE_OFF.store(true, Ordering::Relaxed);
    }

    /// Ends QEMU; the host sees its pipe close and the status 101.
    fn halt() -> ! {
        semihosting::process::exit(101)
    }
}

/// The virtual motors' bridges and sensors: one look at the exchange when a tick begins, one when it ends, so that what
/// only QEMU needs is not counted as part of the tick.
pub struct PipeDrive {
    samples: [Sample; AXES],
    interlock: Interlock,
    index: bool,
    decided: [(Bridge, i16); AXES],
}

impl Drive for PipeDrive {
    /// Takes what the host has sent. There is no interrupt to acknowledge.
    fn begin_tick(&mut self) {
        exchange::with(|exchange| {
            for (sample, axis) in self.samples.iter_mut().zip(&exchange.axes) {
                *sample = axis.sample;
            }
            self.interlock = exchange.interlock();
            self.index = exchange.index();
        });
    }

    /// The sample that the host sent last.
    fn sample(&self, axis: usize) -> Sample {
        self.samples[axis]
    }

    /// The host says one thing of the lines of all axes.
    fn interlock(&self, _axis: usize) -> Interlock {
        self.interlock
    }

    /// The host says one thing of the index lines of all axes.
    fn index(&self, _axis: usize) -> bool {
        self.index
    }

    /// Acts after the configured number of ticks, as a preloaded compare register would.
    fn apply(&mut self, axis: usize, bridge: Bridge, duty: i16) {
        self.decided[axis] = (bridge, duty);
    }

    /// The next exchange is idle's. No tick can be late, but the host can say that one was.
    fn end_tick(&mut self) -> bool {
        exchange::with(|exchange| {
            for (axis, &(bridge, duty)) in exchange.axes.iter_mut().zip(&self.decided) {
                axis.drive(bridge, duty);
            }
            exchange.overrun()
        })
    }

    /// The host takes the zero off.
    fn zeros(&self, axis: usize) -> [i16; 2] {
        let sensed = Sample::sensed(self.samples[axis].current_raw);
        [sensed.map_or(Sample::CURRENT_NOT_SENSED, |_| 0), Sample::CURRENT_NOT_SENSED]
    }

    fn gates(&self) -> Option<Gates> {
        None
    }

    /// The host counts 32 bits.
    fn goes_round(&self, _axis: usize) -> bool {
        false
    }

    /// Takes over the delay of the PWM.
    fn configure(&mut self, axis: usize, config: &Config) {
        exchange::with(|exchange| exchange.axes[axis].delay_ticks = config.pwm_delay_ticks);
    }

    /// QEMU resets its machine: the image begins again on the same pipes.
    fn restart(&mut self) {
        let _ = File::create(RESTARTED);
        SCB::sys_reset()
    }

    /// SysTick, turned to count upwards.
    #[inline(always)]
    fn clock(&self) -> u32 {
        CLOCK_MASK - SYST::get_current()
    }

    /// Counts of SysTick since `start`, modulo 2²⁴. Under `-icount shift=4` one instruction is 16 ns = 2.688 counts.
    fn clock_since(&self, start: u32) -> u32 {
        self.clock().wrapping_sub(start) & CLOCK_MASK
    }
}

/// The link, carried by the exchange.
pub struct PipeLine;

impl Line for PipeLine {
    /// The next byte from the host.
    fn read(&mut self) -> Option<u8> {
        exchange::with(|exchange| exchange.incoming.pop_front())
    }

    /// Bytes that [`Line::write`] has room for.
    fn room(&mut self) -> usize {
        exchange::with(|exchange| exchange.outgoing.capacity() - exchange.outgoing.len())
    }

    /// Sends; what does not fit is lost.
    fn write(&mut self, bytes: &[u8]) {
        let _ = exchange::with(|exchange| exchange.outgoing.extend_from_slice(bytes));
    }
}

/// Keeps the lock-step.
pub struct LockStep {
    to_host: File,
    from_host: File,
    tick: u32,
    frame: [u8; exchange::FRAME],
}

impl Idle for LockStep {
    /// One tick: tell the host what the bridge does, take what the motor did, let control and link run.
    fn turn(&mut self) {
        let off = BRIDGE_OFF.load(Ordering::Relaxed);
        let length = exchange::with(|exchange| exchange.take_frame(self.tick, off, &mut self.frame));
        if self.to_host.write_all(&self.frame[..length]).is_err() {
            semihosting::process::exit(0);
        }
        self.receive();
        self.tick = self.tick.wrapping_add(1);
        NVIC::pend(Interrupt::ADC);
    }

    /// There is no watchdog to be told.
    fn while_storing<R>(&mut self, work: impl FnOnce() -> R) -> R {
        work()
    }
}

impl LockStep {
    fn receive(&mut self) {
        let mut head = [0; exchange::HEAD];
        self.read(head.len()).iter().zip(&mut head).for_each(|(from, to)| *to = *from);
        let (length, stop) = exchange::with(|exchange| exchange.take_answer(&head));
        if stop {
            defmt::info!("stack: {=usize} bytes at most", stack::used());
            semihosting::process::exit(0);
        }
        let bytes = self.read(length);
        exchange::with(|exchange| exchange.hear(bytes));
    }

    /// Reads from the host. The end of its input ends QEMU.
    fn read(&mut self, length: usize) -> &[u8] {
        if self.from_host.read_exact(&mut self.frame[..length]).is_err() {
            semihosting::process::exit(0);
        }
        &self.frame[..length]
    }
}
