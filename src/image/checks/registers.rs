//! A test image: the board's own initialisation, clocks left out, then every kind of command to the bridge. In QEMU, which
//! lacks the timers of the bridge, ports, converters' clock, watchdog and DMA, each write to them is recorded; the test
//! `board_registers` compares the record with values derived from the reference manual. What QEMU models is read back
//! here and printed.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[allow(dead_code, unused_imports)]
#[path = "../board"]
mod board {
    mod interface;
    pub mod stm32f405;

    pub use interface::{Board, Drive, Idle, Line, Started};

    /// Axes of an image without features.
    pub const AXES: usize = 1;
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is a test image for QEMU: `cargo test --package host-tests --test image board_registers::` builds and runs it."
    );
}

#[cfg(target_os = "none")]
mod image {

    use crate::board::stm32f405::board::{Board as BoardData, Link};
    use crate::board::stm32f405::chosen::OWN;
    use crate::board::stm32f405::{DriveOf, SETTLING, Stm32f405, set_up, stage};
    use crate::board::{Board, Drive, Idle, Line};
    use cortex_m_rt::entry;
    use servo::axis::Bridge;
    use servo::config::Config;
    use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, ADC2, Peripherals, RNG, TIM2, USART2};

    const CARRIER: BoardData = BoardData { stage: &stage::DRV8874, ..OWN };
    const OTHER_PORT: BoardData = BoardData { link: Link::Usart3, ..CARRIER };
    const DISCRETE: BoardData = BoardData { stage: &stage::DISCRETE, ..OWN };

    #[entry]
    fn main() -> ! {
        let device = Peripherals::take().expect("first and only");
        one_axis(device);
        // SAFETY: the owners of the first set-up are gone.
        commands(unsafe { Peripherals::steal() });
        read_back();
        // SAFETY: as above.
        four_axes(unsafe { Peripherals::steal() });
        // SAFETY: as above.
        discrete_bridge(unsafe { Peripherals::steal() });
        // SAFETY: as above.
        zero_of_current(unsafe { Peripherals::steal() });
        // SAFETY: as above.
        other_port(unsafe { Peripherals::steal() });
        mark(Step::End);
        semihosting::process::exit(0)
    }

    fn one_axis(device: Peripherals) {
        mark(Step::SetUp);
        let (mut drive, _line, mut idle) = set_up::<1>(device, &CARRIER, SETTLING);
        mark(Step::FirstTick);
        read_sensors(&mut drive);
        drive.set(0, Bridge::Open, 0);
        drive.end_tick();
        mark(Step::Feed);
        idle.turn();
        mark(Step::Starve);
        idle.turn();
        mark(Step::Early);
        drive.set(0, Bridge::Driven, 1050);
        mark(Step::Settle);
        for _ in 0..29 {
            read_sensors(&mut drive);
            drive.set(0, Bridge::Open, 0);
        }
        mark(Step::Denied);
        // The ports read as zero: the enable input is low.
        read_sensors(&mut drive);
        drive.set(0, Bridge::Driven, 1050);
    }

    /// A drive that has not looked at its lines, which read as zero here, yet permits.
    fn commands(device: Peripherals) {
        mark(Step::SetUpAwake);
        let (mut drive, _line, _idle) = set_up::<1>(device, &CARRIER, 0);
        drive.set(0, Bridge::Open, 0);
        for (step, bridge, duty) in [
            (Step::Forward, Bridge::Driven, 1050),
            (Step::Reverse, Bridge::Driven, -4200),
            (Step::Short, Bridge::Shorted, 1050),
            (Step::Open, Bridge::Open, 1050),
        ] {
            mark(step);
            drive.set(0, bridge, duty);
        }
        mark(Step::Off);
        Stm32f405::bridge_off();
    }

    fn read_sensors<const N: usize>(drive: &mut DriveOf<N>) {
        drive.begin_tick();
        drive.sample(0);
    }

    fn four_axes(device: Peripherals) {
        mark(Step::SetUpFour);
        let (mut drive, _line, _idle) = set_up::<4>(device, &CARRIER, 0);
        mark(Step::FourDuties);
        for axis in 0..4 {
            drive.set(axis, Bridge::Open, 0);
            drive.set(axis, Bridge::Driven, 100 * (axis as i16 + 1));
        }
    }

    fn discrete_bridge(device: Peripherals) {
        mark(Step::SetUpDiscrete);
        let (mut drive, _line, _idle) = set_up::<1>(device, &DISCRETE, 0);
        mark(Step::DiscreteForward);
        drive.set(0, Bridge::Open, 0);
        drive.set(0, Bridge::Driven, 4200);
        mark(Step::DiscreteOpen);
        drive.set(0, Bridge::Open, 0);
    }

    /// Looks for the zero of the current sensor, which QEMU's converter delivers, and configures twice: to another PWM scale
    /// and to the same. Each time the current goes into the record.
    fn zero_of_current(device: Peripherals) {
        mark(Step::ZeroOfCurrent);
        let (mut drive, _line, _idle) = set_up::<1>(device, &CARRIER, SETTLING);
        let first = current(&mut drive);
        for _ in 0..1100 {
            current(&mut drive);
        }
        let found = current(&mut drive);
        let [other, same] = [8400, 8400].map(|full_scale| {
            drive.configure(0, &config(full_scale));
            current(&mut drive)
        });
        for (number, current) in (READ_BACK..).zip([first, found, other, same]) {
            note(0, number);
            note(1, current as u16 as u32);
        }
    }

    /// A board whose link is another port.
    fn other_port(device: Peripherals) {
        mark(Step::OtherPort);
        let (_drive, mut line, _idle) = set_up::<1>(device, &OTHER_PORT, SETTLING);
        mark(Step::OtherPortSends);
        line.write(&[0x55]);
    }

    /// One tick with the bridge open.
    fn current(drive: &mut DriveOf<1>) -> i16 {
        drive.begin_tick();
        let sample = drive.sample(0);
        drive.set(0, Bridge::Open, 0);
        sample.current_raw
    }

    fn config(pwm_full_scale: u16) -> Config {
        Config {
            supply_nominal_v: 12.0,
            counts_per_rev: 4000,
            rated_speed_rad_s: 125.0,
            tick_hz: 10_000,
            gear_ratio: 1.0,
            pwm_delay_ticks: 1,
            pwm_full_scale,
            vbus_v_per_lsb: 0.01,
            current_a_per_lsb: 0.001,
            ..Config::EXAMPLE
        }
    }

    /// Where in the record a step begins.
    #[repr(u32)]
    enum Step {
        SetUp = 1,
        FirstTick,
        Feed,
        Starve,
        Forward,
        Reverse,
        Short,
        Open,
        Settle,
        Denied,
        Off,
        SetUpFour,
        FourDuties,
        SetUpDiscrete,
        DiscreteForward,
        DiscreteOpen,
        ZeroOfCurrent,
        SetUpAwake,
        Early,
        OtherPort,
        OtherPortSends,
        End,
    }

    fn mark(step: Step) {
        note(2, step as u32);
    }

    /// Puts a word of our own into the record: the random number generator is off on the chip and missing in QEMU, so a
    /// write to its registers is recorded and does nothing.
    fn note(register: usize, value: u32) {
        // SAFETY: see above.
        unsafe { RNG::ptr().cast::<u32>().cast_mut().add(register).write_volatile(value) };
    }

    /// Registers that [`read_back`] reads.
    const READ_BACK: u32 = 16;

    /// What QEMU models and therefore does not record: number of the register, then its value.
    fn read_back() {
        // SAFETY: reading; the board's owners are idle.
        let (tim2, adc1, adc2) = unsafe { (&*TIM2::ptr(), &*ADC1::ptr(), &*ADC2::ptr()) };
        // SAFETY: as above.
        let (common, usart) = unsafe { (&*ADC_COMMON::ptr(), &*USART2::ptr()) };
        let values = [
            tim2.cr1().read().bits(),
            tim2.smcr().read().bits(),
            tim2.ccmr1_input().read().bits(),
            tim2.arr().read().bits(),
            common.ccr().read().bits(),
            adc1.cr1().read().bits(),
            adc1.cr2().read().bits(),
            adc1.smpr1().read().bits(),
            adc1.jsqr().read().bits(),
            adc2.cr1().read().bits(),
            adc2.cr2().read().bits(),
            adc2.smpr1().read().bits(),
            adc2.jsqr().read().bits(),
            u32::from(usart.brr().read().bits()),
            u32::from(usart.cr1().read().bits()),
            u32::from(usart.cr3().read().bits()),
        ];
        for (number, value) in values.into_iter().enumerate() {
            note(0, number as u32);
            note(1, value);
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        Stm32f405::bridge_off();
        semihosting::process::exit(101)
    }
}
