//! STM32F405RG at 168 MHz: TIM1 drives the H-bridge and paces the control ticks, TIM2 counts the encoder, USART2 is the
//! link. Register descriptions: reference manual RM0090.
//!
//! | pin | function | |
//! |---|---|---|
//! | PA8, PA9 | TIM1 CH1, CH2 (AF1) | inputs IN1, IN2 of a bridge driver that adds its own dead time |
//! | PA15, PB3 | TIM2 CH1, CH2 (AF1) | encoder A, B (JTAG is given up, SWD stays) |
//! | PA2, PA3 | USART2 TX, RX (AF7) | link, 921,600 baud |
//!
//! Supply and winding current are not measured yet and are reported so.

mod timer;

use cortex_m::peripheral::DWT;
use heapless::Deque;
use servo::axis::{Output, Sample};
use servo::config::Config;
use servo::protocol::{Command, FRAME_CAPACITY, Refusal};
use stm32f4xx_hal::pac::{CorePeripherals, Peripherals, TIM2, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::qei::Qei;
use stm32f4xx_hal::rcc::Config as Clocks;
use stm32f4xx_hal::serial::{self, Rx, Serial, Tx};
use stm32f4xx_hal::watchdog::IndependentWatchdog;
use timer::Timer;

use defmt_rtt as _;

/// For the log.
pub const NAME: &str = "STM32F405";

/// Crystal of the common boards.
const CRYSTAL_HZ: u32 = 8_000_000;
const SYSTEM_HZ: u32 = 168_000_000;
const BAUD: u32 = 921_600;
/// Many of the slowest ticks (1 ms), yet short enough that a motor does not run away.
const WATCHDOG_MS: u32 = 20;

/// Clocks, pins, timers; the bridge is open when it returns and control ticks begin.
pub fn init(device: Peripherals, mut core: CorePeripherals) -> (Drive, Line, Idle) {
    let mut rcc = device
        .RCC
        .freeze(Clocks::hse(CRYSTAL_HZ.Hz()).sysclk(SYSTEM_HZ.Hz()));
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let port_a = device.GPIOA.split(&mut rcc);
    let port_b = device.GPIOB.split(&mut rcc);
    let encoder = Qei::new(
        device.TIM2,
        (
            port_a.pa15.into_alternate::<1>(),
            port_b.pb3.into_alternate::<1>(),
        ),
        &mut rcc,
    );
    let (mut tx, mut rx) = Serial::new(
        device.USART2,
        (port_a.pa2, port_a.pa3),
        serial::Config::default().baudrate(BAUD.bps()),
        &mut rcc,
    )
    .expect("921,600 baud divides the 42 MHz of APB1")
    .split();
    rx.listen();
    tx.listen();
    let mut watchdog = IndependentWatchdog::new(device.IWDG);
    watchdog.start(WATCHDOG_MS.millis());
    let timer = Timer::new(
        device.TIM1,
        port_a.pa8.into_alternate(),
        port_a.pa9.into_alternate(),
        &mut rcc,
    );
    let drive = Drive {
        timer,
        encoder,
        watchdog,
    };
    (
        drive,
        Line {
            rx,
            tx,
            outgoing: Deque::new(),
        },
        Idle,
    )
}

/// The PWM has to fit the control ticks.
pub fn supports(command: &Command) -> Result<(), Refusal> {
    match command {
        Command::Configure(config) => timer::ticks_of(config).map(|_| ()).ok_or(Refusal::TickRate),
        _ => Ok(()),
    }
}

/// Bridge, encoder, converters.
pub struct Drive {
    timer: Timer,
    encoder: Qei<TIM2>,
    watchdog: IndependentWatchdog,
}

impl Drive {
    /// Acknowledges the tick, feeds the watchdog, reads the encoder.
    pub fn sample(&mut self) -> Sample {
        self.timer.acknowledge();
        self.watchdog.feed();
        Sample {
            count: self.encoder.count() as i32,
            vbus_raw: Sample::VBUS_NOT_MEASURED,
            current_raw: Sample::CURRENT_NOT_SENSED,
        }
    }

    /// Acts from the next tick on: the compare registers are preloaded.
    pub fn apply(&mut self, output: &Output) {
        self.timer.drive(output.bridge, output.duty);
    }

    /// Sets PWM scale and control rate; the link has asked [`supports`] before.
    pub fn configure(&mut self, config: &Config) {
        self.timer.configure(config);
    }

    /// Cycles of the core.
    pub fn clock(&self) -> u32 {
        DWT::cycle_count()
    }

    /// Cycles since `start`.
    pub fn clock_since(&self, start: u32) -> u32 {
        self.clock().wrapping_sub(start)
    }
}

/// The link.
pub struct Line {
    rx: Rx<USART2>,
    tx: Tx<USART2>,
    outgoing: Deque<u8, { 4 * FRAME_CAPACITY }>,
}

impl Line {
    /// The next byte; also moves one byte on its way out, since both ends interrupt.
    pub fn read(&mut self) -> Option<u8> {
        self.pump();
        self.rx.read().ok()
    }

    /// Bytes that [`Line::write`] has room for.
    pub fn room(&self) -> usize {
        self.outgoing.capacity() - self.outgoing.len()
    }

    /// Queues; what does not fit is lost.
    pub fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let _ = self.outgoing.push_back(byte);
        }
        self.tx.listen();
        self.pump();
    }

    fn pump(&mut self) {
        match self.outgoing.front().copied() {
            Some(byte) if self.tx.write(byte).is_ok() => {
                self.outgoing.pop_front();
            }
            Some(_) => {}
            None => self.tx.unlisten(),
        }
    }
}

/// Sleeps between interrupts.
pub struct Idle;

impl Idle {
    /// Until the next interrupt.
    pub fn turn(&mut self) {
        cortex_m::asm::wfi();
    }
}

/// Switches both outputs of TIM1 to their idle level, low: the driver floats its outputs.
pub fn bridge_off() {
    timer::outputs_off();
}

/// The watchdog is not fed any more and resets the chip.
pub fn halt() -> ! {
    cortex_m::interrupt::disable();
    loop {
        cortex_m::asm::nop();
    }
}
