//! The board's initialisation and its commands to the bridge, as register writes recorded by QEMU.
//!
//! QEMU lacks TIM1, TIM8, RCC, GPIO, the watchdog and DMA: each write to them becomes a line of its log and reads give
//! zero, so a read-modify-write shows the bits that it sets alone. The test image `registers` runs the board's own code
//! with the clocks left out. Every expected value below is put together by hand from the fields of the reference manual
//! (RM0090), each with its reason; none is copied from a run. The sequences are complete: a write that is not expected
//! fails, and so does one in the wrong place.

use servo::axis::Sample;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use trials::test_image::{built, qemu};

/// One recorded write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Write {
    address: u32,
    value: u32,
}

/// One expected write: register, its fields as (name, lowest bit, value), reason.
struct Expected {
    register: &'static str,
    address: u32,
    fields: &'static [(&'static str, u32, u32)],
    why: &'static str,
}

impl Expected {
    fn value(&self) -> u32 {
        self.fields.iter().map(|(_, shift, value)| value << shift).sum()
    }
}

const fn expect(
    register: &'static str,
    address: u32,
    fields: &'static [(&'static str, u32, u32)],
    why: &'static str,
) -> Expected {
    Expected { register, address, fields, why }
}

// ── Recording ───────────────────────────────────────────────────────────────────────────────────────────────────────

/// Base addresses, RM0090 table 1, by the names that QEMU's log uses.
const BLOCKS: [(&str, u32); 9] = [
    ("timer[1]", 0x4001_0000),
    ("timer[8]", 0x4001_0400),
    ("RCC", 0x4002_3800),
    ("GPIOA", 0x4002_0000),
    ("GPIOB", 0x4002_0400),
    ("GPIOC", 0x4002_0800),
    ("DMA1", 0x4002_6000),
    ("RNG", 0x5006_0800),
    // QEMU names the block at this address after its neighbour; newer versions say IWDG.
    ("I2S2ext", 0x4000_3000),
];
const MARK: u32 = 0x5006_0800 + 8;
const NOTE_NUMBER: u32 = 0x5006_0800;
const NOTE_VALUE: u32 = 0x5006_0800 + 4;

fn base(block: &str) -> Option<u32> {
    let known = if block == "IWDG" { "I2S2ext" } else { block };
    BLOCKS.iter().find(|(name, _)| *name == known).map(|(_, base)| *base)
}

/// `timer[1]: unimplemented device write (size 4, offset 0x02c, value 0x00001068)`
fn parse(line: &str) -> Option<Write> {
    let (block, rest) = line.split_once(": unimplemented device write ")?;
    let hex = |key: &str| {
        let digits = rest.split_once(key)?.1.split([',', ')']).next()?;
        u32::from_str_radix(digits.trim().trim_start_matches("0x"), 16).ok()
    };
    let base =
        base(block).unwrap_or_else(|| panic!("a write to {block}, which the board does not use: {line}"));
    Some(Write { address: base + hex("offset ")?, value: hex("value ")? })
}

/// What the image did in each of its steps (see `src/image/checks/registers.rs`), and what it read back.
struct Record {
    steps: BTreeMap<u32, Vec<Write>>,
    read_back: Vec<u32>,
}

fn record() -> &'static Record {
    static RECORD: OnceLock<Record> = OnceLock::new();
    RECORD.get_or_init(|| split(&run(&built("firmware", "registers"))))
}

fn run(image: &Path) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let log = folder.path().join("unimplemented.log");
    let status = qemu(image)
        .args(["-d", "unimp", "-D"])
        .arg(&log)
        .status()
        .expect("QEMU can be started; try `cargo xtask setup`");
    assert!(status.success(), "the image ended with {status}");
    std::fs::read_to_string(&log).expect("QEMU has written its log")
}

fn split(log: &str) -> Record {
    let mut steps: BTreeMap<u32, Vec<Write>> = BTreeMap::new();
    let mut read_back = Vec::new();
    let mut step = 0;
    for write in log.lines().filter_map(parse) {
        match write.address {
            MARK => {
                step = write.value;
                assert!(steps.insert(step, Vec::new()).is_none(), "step {step} twice");
            }
            NOTE_NUMBER => assert_eq!(write.value as usize, read_back.len()),
            NOTE_VALUE => read_back.push(write.value),
            _ => steps.get_mut(&step).expect("nothing before the first step").push(write),
        }
    }
    assert_eq!(steps.len(), 22, "all steps of the image");
    Record { steps, read_back }
}

/// Writes of one step to addresses within `range`, in order.
fn writes(step: u32, range: std::ops::Range<u32>) -> Vec<Write> {
    let all = &record().steps[&step];
    all.iter().copied().filter(|write| range.contains(&write.address)).collect()
}

fn check(got: &[Write], expected: &[&[Expected]]) {
    let expected: Vec<&Expected> = expected.iter().flat_map(|part| part.iter()).collect();
    for (place, want) in expected.iter().enumerate() {
        let Some(write) = got.get(place) else {
            panic!("{} is never written ({})", want.register, want.why);
        };
        assert_eq!(
            *write,
            Write { address: want.address, value: want.value() },
            "write {place} should be {} = {:#010x} ({}); all: {got:#x?}",
            want.register,
            want.value(),
            want.why
        );
    }
    assert_eq!(got.len(), expected.len(), "more writes than expected: {got:#x?}");
}

const TIM1: u32 = 0x4001_0000;
const TIM8: u32 = 0x4001_0400;
const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const GPIOC: u32 = 0x4002_0800;
const RCC: u32 = 0x4002_3800;
const DMA1: u32 = 0x4002_6000;
const IWDG: u32 = 0x4000_3000;
/// Everything that the board can write.
const ALL: std::ops::Range<u32> = 0..0x5006_0000;

fn block(base: u32) -> std::ops::Range<u32> {
    base..base + 0x400
}

// Steps, as in `src/image/checks/registers.rs`.
const SET_UP: u32 = 1;
const FIRST_TICK: u32 = 2;
const FEED: u32 = 3;
const STARVE: u32 = 4;
const FORWARD: u32 = 5;
const REVERSE: u32 = 6;
const SHORT: u32 = 7;
const OPEN: u32 = 8;
const SETTLE: u32 = 9;
const DENIED: u32 = 10;
const OFF: u32 = 11;
const SET_UP_FOUR: u32 = 12;
const FOUR_DUTIES: u32 = 13;
const SET_UP_DISCRETE: u32 = 14;
const DISCRETE_FORWARD: u32 = 15;
const DISCRETE_OPEN: u32 = 16;
const EARLY: u32 = 19;
const OTHER_PORT: u32 = 20;
const OTHER_PORT_SENDS: u32 = 21;

// ── Clocks of the peripherals ───────────────────────────────────────────────────────────────────────────────────────

const CLOCKS: [Expected; 3] = [
    expect(
        "RCC_AHB1ENR",
        RCC + 0x30,
        &[("GPIOAEN", 0, 1), ("GPIOBEN", 1, 1), ("GPIOCEN", 2, 1), ("DMA1EN", 21, 1)],
        "ports A, B, C of the pin table; DMA1 carries USART2",
    ),
    expect(
        "RCC_APB1ENR",
        RCC + 0x40,
        &[("TIM2EN", 0, 1), ("TIM3EN", 1, 1), ("TIM4EN", 2, 1), ("TIM5EN", 3, 1), ("USART2EN", 17, 1)],
        "the encoder counters of four axes and the link",
    ),
    expect(
        "RCC_APB2ENR",
        RCC + 0x44,
        &[("TIM1EN", 0, 1), ("TIM8EN", 1, 1), ("ADC1EN", 8, 1), ("ADC2EN", 9, 1)],
        "PWM of four axes, converters of currents and supply",
    ),
];

#[test]
fn every_peripheral_gets_its_clock() {
    check(&writes(SET_UP, block(RCC)), &[&CLOCKS]);
}

// ── TIM1 ────────────────────────────────────────────────────────────────────────────────────────────────────────────

/// RM0090 section 17.4. The driver IC adds its own dead time.
const TIM1_SET_UP: [Expected; 13] = [
    expect("TIM1_CR1", TIM1, &[("ARPE", 7, 1), ("CMS", 5, 0b01)], "preloaded period; centre-aligned"),
    expect(
        "TIM1_CR2",
        TIM1 + 0x04,
        &[("MMS", 4, 0b010)],
        "update is the trigger of the converters; OISx 0: idle low",
    ),
    expect("TIM1_ARR", TIM1 + 0x2C, &[("ARR", 0, 4200)], "168 MHz / (2 · 4200) = 20 kHz"),
    expect(
        "TIM1_RCR",
        TIM1 + 0x30,
        &[("REP", 0, 3)],
        "update every 4th turning point: 20 kHz / 2 = 10 kHz ticks",
    ),
    expect(
        "TIM1_CCMR1",
        TIM1 + 0x18,
        &[("OC1PE", 3, 1), ("OC1M", 4, 0b110), ("OC2PE", 11, 1), ("OC2M", 12, 0b110)],
        "preloaded; PWM mode 1, so the low (driving) part is centred on the upper turning point",
    ),
    expect(
        "TIM1_CCMR2",
        TIM1 + 0x1C,
        &[("OC3PE", 3, 1), ("OC3M", 4, 0b110), ("OC4PE", 11, 1), ("OC4M", 12, 0b110)],
        "the second axis alike",
    ),
    expect("TIM1_CCR1", TIM1 + 0x34, &[], "always low"),
    expect("TIM1_CCR2", TIM1 + 0x38, &[], "always low: 0 0 opens the bridge"),
    expect("TIM1_CCR3", TIM1 + 0x3C, &[], "always low"),
    expect("TIM1_CCR4", TIM1 + 0x40, &[], "always low"),
    expect(
        "TIM1_CCER",
        TIM1 + 0x20,
        &[("CC1E", 0, 1), ("CC2E", 4, 1), ("CC3E", 8, 1), ("CC4E", 12, 1)],
        "outputs on, active high, no complementary ones",
    ),
    expect(
        "TIM1_BDTR",
        TIM1 + 0x44,
        &[("LOCK", 8, 1), ("OSSI", 10, 1), ("OSSR", 11, 1), ("BKE", 12, 1)],
        "low break input switches off (BKP 0), stays off (AOE 0), off means low (OSSI), MOE 0 still, fields locked",
    ),
    expect("TIM1_EGR", TIM1 + 0x14, &[("UG", 0, 1)], "loads the preload registers"),
];

/// The bridge driver is created (off), outputs follow the compare registers, the counter starts: in this order.
const TIM1_START: [Expected; 4] = [
    expect("TIM1_CCR1", TIM1 + 0x34, &[], "a new bridge is off"),
    expect("TIM1_CCR2", TIM1 + 0x38, &[], "a new bridge is off"),
    expect(
        "TIM1_BDTR",
        TIM1 + 0x44,
        &[("MOE", 15, 1)],
        "outputs follow; the other bits are read back in silicon",
    ),
    expect("TIM1_CR1", TIM1, &[("CEN", 0, 1)], "counts; the other bits are read back in silicon"),
];

#[test]
fn tim1_makes_20_khz_centre_aligned_pwm_and_starts_with_an_open_bridge() {
    check(&writes(SET_UP, block(TIM1)), &[&TIM1_SET_UP, &TIM1_START]);
    assert!(writes(SET_UP, block(TIM8)).is_empty(), "one axis leaves TIM8 alone");
}

#[test]
fn the_first_tick_checks_the_phase_of_the_update_and_opens_the_bridge() {
    // The counter reads as zero, that is counting up: the update seems to have come at the lower turning point, and one
    // interval is made half a period shorter.
    check(
        &writes(FIRST_TICK, block(TIM1)),
        &[&[
            expect(
                "TIM1_SR",
                TIM1 + 0x10,
                &[("all but BIF", 0, !(1 << 7))],
                "the break of power-up is forgotten",
            ),
            expect("TIM1_BDTR", TIM1 + 0x44, &[("MOE", 15, 1)], "outputs follow while the bridge is open"),
            expect("TIM1_RCR", TIM1 + 0x30, &[("REP", 0, 2)], "3 turning points instead of 4, once"),
            expect("TIM1_CCR1", TIM1 + 0x34, &[], "IN1 low"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[], "IN2 low"),
        ]],
    );
}

#[test]
fn the_phase_is_looked_at_twice_and_the_fault_line_not_before_the_driver_is_awake() {
    // Tick 2 restores the interval, tick 3 looks again (in QEMU the counter never turns), tick 4 restores; then no more.
    let repetitions: Vec<u32> =
        writes(SETTLE, TIM1 + 0x30..TIM1 + 0x34).iter().map(|write| write.value).collect();
    assert_eq!(repetitions, [3, 2, 3]);
    // 30 ticks forget the break flag, the first of them in its own step.
    let forgotten = writes(SETTLE, TIM1 + 0x10..TIM1 + 0x14);
    assert_eq!(forgotten.len(), 29);
    assert!(writes(DENIED, TIM1 + 0x10..TIM1 + 0x14).is_empty(), "from then on a break is a fault");
}

#[test]
fn each_command_sets_both_compare_registers_and_the_sleep_pin() {
    const AWAKE: Expected = expect("GPIOB_BSRR", GPIOB + 0x18, &[("BS0", 0, 1)], "nSLEEP high");
    check(
        &writes(FORWARD, ALL),
        &[&[
            expect("TIM1_CCR1", TIM1 + 0x34, &[("CCR", 0, 4200)], "IN1 always high"),
            expect(
                "TIM1_CCR2",
                TIM1 + 0x38,
                &[("CCR", 0, 3150)],
                "IN2 low for a quarter: a quarter of the supply forward",
            ),
            AWAKE,
        ]],
    );
    check(
        &writes(REVERSE, ALL),
        &[&[
            expect("TIM1_CCR1", TIM1 + 0x34, &[], "IN1 always low"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[("CCR", 0, 4200)], "IN2 always high: full reverse"),
            AWAKE,
        ]],
    );
    check(
        &writes(SHORT, ALL),
        &[&[
            expect("TIM1_CCR1", TIM1 + 0x34, &[("CCR", 0, 4200)], "1 1 brakes"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[("CCR", 0, 4200)], "1 1 brakes"),
            AWAKE,
        ]],
    );
    check(
        &writes(OPEN, ALL),
        &[&[
            expect("TIM1_CCR1", TIM1 + 0x34, &[], "0 0 opens"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[], "0 0 opens"),
            AWAKE,
        ]],
    );
}

#[test]
fn while_the_driver_wakes_up_the_bridge_stays_open_whatever_the_axis_wants() {
    check(
        &writes(EARLY, TIM1 + 0x34..TIM1 + 0x3C),
        &[&[
            expect("TIM1_CCR1", TIM1 + 0x34, &[], "0 0 opens although a quarter was asked for"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[], "0 0 opens"),
        ]],
    );
}

#[test]
fn an_open_enable_contact_opens_the_bridge_whatever_the_axis_wants() {
    check(
        &writes(DENIED, TIM1 + 0x34..TIM1 + 0x3C),
        &[&[
            expect("TIM1_CCR1", TIM1 + 0x34, &[], "0 0 opens although a quarter was asked for"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[], "0 0 opens"),
        ]],
    );
    assert!(writes(DENIED, TIM1 + 0x44..TIM1 + 0x48).is_empty(), "and nothing is re-armed");
}

#[test]
fn panic_and_fault_handlers_switch_off_by_two_direct_writes() {
    check(
        &writes(OFF, ALL),
        &[&[
            expect(
                "TIM1_BDTR",
                TIM1 + 0x44,
                &[],
                "MOE 0: outputs forced low at once, without a compare register",
            ),
            expect("GPIOB_BSRR", GPIOB + 0x18, &[("BR0", 16, 1)], "nSLEEP low: the driver opens by itself"),
        ]],
    );
}

// ── Ports ───────────────────────────────────────────────────────────────────────────────────────────────────────────

/// RM0090 section 8.4: MODER 00 input, 01 output, 10 alternate, 11 analogue; PUPDR 01 up, 10 down; OSPEEDR 01 medium.
const PORTS: [Expected; 15] = [
    expect("GPIOA_AFRL", GPIOA + 0x20, &[("PA2", 8, 7), ("PA3", 12, 7)], "USART2"),
    expect("GPIOA_AFRH", GPIOA + 0x24, &[("PA8", 0, 1), ("PA9", 4, 1), ("PA15", 28, 1)], "TIM1, TIM2"),
    expect(
        "GPIOA_PUPDR",
        GPIOA + 0x0C,
        &[("PA2", 4, 1), ("PA3", 6, 1), ("PA8", 16, 2), ("PA9", 18, 2), ("PA15", 30, 1)],
        "idle line high; PWM low; open-collector encoder high",
    ),
    expect(
        "GPIOA_OSPEEDR",
        GPIOA + 0x08,
        &[("PA2", 4, 1), ("PA3", 6, 1), ("PA8", 16, 1), ("PA9", 18, 1), ("PA15", 30, 1)],
        "25 MHz",
    ),
    expect(
        "GPIOA_MODER",
        GPIOA,
        &[("PA2", 4, 2), ("PA3", 6, 2), ("PA8", 16, 2), ("PA9", 18, 2), ("PA15", 30, 2)],
        "alternate; PA13 and PA14 (probe) untouched",
    ),
    expect("GPIOB_AFRL", GPIOB + 0x20, &[("PB3", 12, 1)], "TIM2"),
    expect("GPIOB_AFRH", GPIOB + 0x24, &[("PB12", 16, 1)], "TIM1 break"),
    expect(
        "GPIOB_PUPDR",
        GPIOB + 0x0C,
        &[("PB0", 0, 2), ("PB3", 6, 1), ("PB8", 16, 2), ("PB12", 24, 1)],
        "asleep; encoder; no index unless one drives it; open-drain fault",
    ),
    expect("GPIOB_OSPEEDR", GPIOB + 0x08, &[("PB0", 0, 1), ("PB3", 6, 1), ("PB12", 24, 1)], "25 MHz"),
    expect(
        "GPIOB_MODER",
        GPIOB,
        &[("PB0", 0, 1), ("PB3", 6, 2), ("PB8", 16, 0), ("PB12", 24, 2)],
        "output; alternate; index input",
    ),
    expect("GPIOC_AFRL", GPIOC + 0x20, &[], "none"),
    expect("GPIOC_AFRH", GPIOC + 0x24, &[], "none"),
    expect("GPIOC_PUPDR", GPIOC + 0x0C, &[("PC10", 20, 2)], "an open enable contact reads low"),
    expect("GPIOC_OSPEEDR", GPIOC + 0x08, &[("PC12", 24, 1)], "25 MHz"),
    expect(
        "GPIOC_MODER",
        GPIOC,
        &[("PC0", 0, 3), ("PC4", 8, 3), ("PC10", 20, 0), ("PC12", 24, 1)],
        "current and supply analogue; enable input; tick output",
    ),
];

const ASLEEP: Expected = expect("GPIOB_BSRR", GPIOB + 0x18, &[("BR0", 16, 1)], "nSLEEP low");

#[test]
fn pins_get_their_function_before_their_mode_and_the_driver_sleeps_from_the_first_write_on() {
    check(&writes(SET_UP, GPIOA..GPIOC + 0x400), &[&[ASLEEP], &PORTS, &[ASLEEP]]);
}

#[test]
fn timers_are_set_up_before_their_pins_leave_the_reset_state_and_start_last_of_all() {
    let all = &record().steps[&SET_UP];
    let place = |address: u32| all.iter().position(|write| write.address == address).expect("written");
    let last = |address: u32| all.iter().rposition(|write| write.address == address).expect("written");
    assert!(place(GPIOB + 0x18) < place(TIM1), "sleep before anything else");
    assert!(place(TIM1 + 0x44) < place(GPIOA), "break and idle levels before the pins are switched over");
    assert!(last(GPIOC) < last(TIM1 + 0x44), "outputs enabled after that");
    assert_eq!(last(TIM1), all.len() - 1, "the counter starts last");
}

#[test]
fn the_oscilloscope_pin_is_high_for_the_length_of_the_tick() {
    check(
        &writes(FIRST_TICK, block(GPIOC)),
        &[&[
            expect("GPIOC_BSRR", GPIOC + 0x18, &[("BS12", 12, 1)], "tick begins"),
            expect("GPIOC_BSRR", GPIOC + 0x18, &[("BR12", 28, 1)], "tick ends"),
        ]],
    );
}

// ── Watchdog ────────────────────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn the_watchdog_runs_at_16_ms() {
    check(
        &writes(SET_UP, block(IWDG)),
        &[&[
            expect("IWDG_KR", IWDG, &[("KEY", 0, 0xCCCC)], "start"),
            expect("IWDG_KR", IWDG, &[("KEY", 0, 0x5555)], "unlock"),
            expect("IWDG_PR", IWDG + 0x04, &[("PR", 0, 0)], "32 kHz / 4 = 8 kHz"),
            expect("IWDG_RLR", IWDG + 0x08, &[("RL", 0, 127)], "128 / 8 kHz = 16 ms"),
            expect("IWDG_KR", IWDG, &[("KEY", 0, 0xAAAA)], "reload"),
        ]],
    );
}

#[test]
fn the_watchdog_is_fed_by_idle_and_only_after_a_control_tick() {
    check(&writes(FEED, ALL), &[&[expect("IWDG_KR", IWDG, &[("KEY", 0, 0xAAAA)], "a tick has run")]]);
    assert!(writes(STARVE, ALL).is_empty(), "no tick since: not fed");
    assert!(writes(FIRST_TICK, block(IWDG)).is_empty(), "the control tick does not feed by itself");
}

// ── DMA of the link ─────────────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn the_links_receiver_fills_a_ring_by_dma() {
    let got = writes(SET_UP, block(DMA1));
    // RM0090 section 10.5; stream 5 at 0x88, stream 6 at 0xA0. The ring's address is the linker's choice.
    let (ring, fixed): (Vec<Write>, Vec<Write>) =
        got.into_iter().partition(|write| write.address == DMA1 + 0x94);
    assert_eq!(ring.len(), 1);
    assert!((0x2000_0000..0x2002_0000).contains(&ring[0].value), "in SRAM, not in the core-coupled memory");
    check(
        &fixed,
        &[&[
            expect("DMA_S5PAR", DMA1 + 0x90, &[("PAR", 0, 0x4000_4404)], "USART2_DR"),
            expect("DMA_S6PAR", DMA1 + 0xA8, &[("PAR", 0, 0x4000_4404)], "USART2_DR"),
            expect("DMA_S5NDTR", DMA1 + 0x8C, &[("NDT", 0, 512)], "bytes of the ring"),
            expect(
                "DMA_S5CR",
                DMA1 + 0x88,
                &[("CHSEL", 25, 4), ("MINC", 10, 1), ("CIRC", 8, 1), ("DIR", 6, 0), ("EN", 0, 1)],
                "USART2_RX is channel 4 of stream 5 (table 42); peripheral to memory, round and round",
            ),
        ]],
    );
}

/// RM0090 table 42: USART3_RX is channel 4 of stream 1 (at 0x28), USART3_TX that of stream 3 (at 0x58).
#[test]
fn another_port_of_the_link_has_its_own_clock_and_streams() {
    let clock = writes(OTHER_PORT, RCC + 0x40..RCC + 0x44)[0].value;
    assert_eq!(clock >> 17 & 0b11, 0b10, "USART3EN, not USART2EN");
    let without = |step, address| -> Vec<Write> {
        writes(step, block(DMA1)).into_iter().filter(|write| write.address != address).collect()
    };
    check(
        &without(OTHER_PORT, DMA1 + 0x34),
        &[&[
            expect("DMA_S1PAR", DMA1 + 0x30, &[("PAR", 0, 0x4000_4804)], "USART3_DR"),
            expect("DMA_S3PAR", DMA1 + 0x60, &[("PAR", 0, 0x4000_4804)], "USART3_DR"),
            expect("DMA_S1NDTR", DMA1 + 0x2C, &[("NDT", 0, 512)], "bytes of the ring"),
            expect(
                "DMA_S1CR",
                DMA1 + 0x28,
                &[("CHSEL", 25, 4), ("MINC", 10, 1), ("CIRC", 8, 1), ("DIR", 6, 0), ("EN", 0, 1)],
                "peripheral to memory, round and round",
            ),
        ]],
    );
    check(
        &without(OTHER_PORT_SENDS, DMA1 + 0x64),
        &[&[
            expect(
                "DMA_LIFCR",
                DMA1 + 0x08,
                &[
                    ("CTCIF3", 27, 1),
                    ("CHTIF3", 26, 1),
                    ("CTEIF3", 25, 1),
                    ("CDMEIF3", 24, 1),
                    ("CFEIF3", 22, 1),
                ],
                "flags of the last piece",
            ),
            expect("DMA_S3NDTR", DMA1 + 0x5C, &[("NDT", 0, 1)], "one byte"),
            expect(
                "DMA_S3CR",
                DMA1 + 0x58,
                &[("CHSEL", 25, 4), ("MINC", 10, 1), ("DIR", 6, 1), ("EN", 0, 1)],
                "memory to peripheral",
            ),
        ]],
    );
}

// ── What QEMU models: read back inside the image ────────────────────────────────────────────────────────────────────

#[test]
fn encoder_converters_and_link_read_back_as_configured() {
    let expected: [Expected; 16] = [
        expect("TIM2_CR1", 0, &[("CEN", 0, 1)], "counts"),
        expect("TIM2_SMCR", 0, &[("SMS", 0, 0b011)], "encoder mode 3: both edges of both inputs"),
        expect(
            "TIM2_CCMR1",
            0,
            &[("CC1S", 0, 1), ("IC1F", 4, 3), ("CC2S", 8, 1), ("IC2F", 12, 3)],
            "TI1, TI2; eight samples at the timer clock",
        ),
        expect("TIM2_ARR", 0, &[("ARR", 0, 0xFFFF_FFFF)], "the whole 32 bits"),
        expect("ADC_CCR", 0, &[("ADCPRE", 16, 0b01)], "84 MHz / 4 = 21 MHz, below the 36 MHz allowed"),
        expect(
            "ADC1_CR1",
            0,
            &[("SCAN", 8, 1), ("JEOCIE", 7, 1)],
            "whole sequence; its end runs the control tick",
        ),
        expect(
            "ADC1_CR2",
            0,
            &[("JEXTEN", 20, 0b01), ("JEXTSEL", 16, 0b0001), ("ADON", 0, 1)],
            "rising edge of TIM1's trigger",
        ),
        expect(
            "ADC1_SMPR1",
            0,
            &[("SMP10", 0, 2), ("SMP11", 3, 2), ("SMP12", 6, 2), ("SMP13", 9, 2), ("SMP14", 12, 2)],
            "28 clocks each",
        ),
        expect(
            "ADC1_JSQR",
            0,
            &[("JL", 20, 0), ("JSQ4", 15, 10)],
            "one conversion sits in JSQ4: channel 10, PC0",
        ),
        expect("ADC2_CR1", 0, &[("SCAN", 8, 1)], "no interrupt of its own"),
        expect(
            "ADC2_CR2",
            0,
            &[("JEXTEN", 20, 0b01), ("JEXTSEL", 16, 0b0001), ("ADON", 0, 1)],
            "the same trigger",
        ),
        expect(
            "ADC2_SMPR1",
            0,
            &[("SMP10", 0, 2), ("SMP11", 3, 2), ("SMP12", 6, 2), ("SMP13", 9, 2), ("SMP14", 12, 2)],
            "28 clocks each",
        ),
        expect("ADC2_JSQR", 0, &[("JL", 20, 0), ("JSQ4", 15, 14)], "channel 14, PC4"),
        expect(
            "USART2_BRR",
            0,
            &[("DIV_Mantissa", 4, 2), ("DIV_Fraction", 0, 14)],
            "42 MHz / (16 · 2.875) = 913 kBd",
        ),
        expect("USART2_CR1", 0, &[("UE", 13, 1), ("TE", 3, 1), ("RE", 2, 1)], "8N1, no interrupts"),
        expect("USART2_CR3", 0, &[("DMAT", 7, 1), ("DMAR", 6, 1)], "both directions by DMA"),
    ];
    let got = &record().read_back[..16];
    assert_eq!(got.len(), expected.len());
    for (value, want) in got.iter().zip(&expected) {
        assert_eq!(*value, want.value(), "{} should be {:#x} ({})", want.register, want.value(), want.why);
    }
}

/// The zero takes some ticks; another PWM scale does not change the converter.
#[test]
fn a_configuration_keeps_the_zero_of_the_current_sensor() {
    let sought = u32::from(Sample::CURRENT_ZERO_SOUGHT as u16);
    assert_eq!(record().read_back[16..], [sought, 0, 0, 0]);
}

// ── Four axes ───────────────────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn four_axes_set_tim8_up_exactly_like_tim1() {
    let moved = |writes: Vec<Write>, base: u32| -> Vec<(u32, u32)> {
        writes.iter().map(|write| (write.address - base, write.value)).collect()
    };
    let (first, second) =
        (moved(writes(SET_UP_FOUR, block(TIM1)), TIM1), moved(writes(SET_UP_FOUR, block(TIM8)), TIM8));
    assert_eq!(first, second);
    check(&writes(SET_UP_FOUR, block(TIM1))[..TIM1_SET_UP.len()], &[&TIM1_SET_UP]);
}

#[test]
fn four_axes_switch_these_pins_over() {
    let modes: Vec<u32> =
        [GPIOA, GPIOB, GPIOC].into_iter().map(|port| writes(SET_UP_FOUR, port..port + 4)[0].value).collect();
    let alternate = |pins: &[u32]| pins.iter().map(|pin| 0b10u32 << (2 * pin)).sum::<u32>();
    let output = |pins: &[u32]| pins.iter().map(|pin| 0b01u32 << (2 * pin)).sum::<u32>();
    let analogue = |pins: &[u32]| pins.iter().map(|pin| 0b11u32 << (2 * pin)).sum::<u32>();
    assert_eq!(modes[0], alternate(&[0, 1, 2, 3, 6, 8, 9, 10, 11, 15]), "port A");
    assert_eq!(modes[1], alternate(&[3, 4, 5, 6, 7, 12]) + output(&[0, 1, 10, 11]), "port B");
    assert_eq!(modes[2], alternate(&[6, 7, 8, 9]) + output(&[12]) + analogue(&[0, 1, 2, 3, 4]), "port C");
}

/// PB8, PB9, PC11 and PB15: inputs (MODER 00, so they show nowhere above), each with its pull-down (PUPDR 10).
#[test]
fn four_axes_have_an_index_line_each_that_rests_low() {
    let pulls = |port: u32| writes(SET_UP_FOUR, port + 0x0C..port + 0x10)[0].value;
    for (port, pin) in [(GPIOB, 8), (GPIOB, 9), (GPIOC, 11), (GPIOB, 15)] {
        assert_eq!(pulls(port) >> (2 * pin) & 0b11, 0b10, "{port:#x} {pin}");
        let mode = writes(SET_UP_FOUR, port..port + 4)[0].value;
        assert_eq!(mode >> (2 * pin) & 0b11, 0b00, "{port:#x} {pin}");
    }
}

#[test]
fn each_of_four_axes_commands_its_own_channels() {
    // Forward by 100, 200, 300, 400 counts: the b line is high for 4200 less that.
    for (timer, a, b, pin, level) in [
        (TIM1, 0x34, 0x38, 0, 4100),
        (TIM1, 0x3C, 0x40, 1, 4000),
        (TIM8, 0x34, 0x38, 10, 3900),
        (TIM8, 0x3C, 0x40, 11, 3800),
    ] {
        let of = |offset: u32| -> Vec<u32> {
            writes(FOUR_DUTIES, timer + offset..timer + offset + 4).iter().map(|write| write.value).collect()
        };
        assert_eq!(of(a), [0, 4200], "open, then driven");
        assert_eq!(of(b), [0, level], "open, then driven");
        let awake = writes(FOUR_DUTIES, GPIOB + 0x18..GPIOB + 0x1C);
        assert_eq!(awake.iter().filter(|write| write.value == 1 << pin).count(), 2, "its own sleep pin");
    }
}

// ── Discrete bridge ─────────────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn a_discrete_bridge_gets_complementary_outputs_with_dead_time() {
    let got = writes(SET_UP_DISCRETE, block(TIM1));
    let of = |offset: u32| -> Vec<u32> {
        got.iter().filter(|write| write.address == TIM1 + offset).map(|write| write.value).collect()
    };
    // CC1E, CC1NE, CC2E, CC2NE, CC3E, CC4E.
    assert_eq!(of(0x20), [1 | 1 << 2 | 1 << 4 | 1 << 6 | 1 << 8 | 1 << 12]);
    // 500 ns · 168 MHz = 84 clocks, below 128: DTG counts single clocks. LOCK 1, OSSI, OSSR, BKE as above. Then the enable
    // line of the new bridge, which is MOE, is low; nothing has set it.
    assert_eq!(of(0x44), [84 | 1 << 8 | 1 << 10 | 1 << 11 | 1 << 12, 0]);
    // PWM mode 2: the high, driving part is centred on the upper turning point.
    let mode_2 = 1 << 3 | 0b111 << 4 | 1 << 11 | 0b111 << 12;
    assert_eq!((of(0x18), of(0x1C)), (vec![mode_2], vec![mode_2]));
    // In mode 2 a compare value of full scale is a line that is always low; twice: set-up and new bridge.
    assert_eq!((of(0x34), of(0x38)), (vec![4200; 2], vec![4200; 2]));
    // PB13 and PB14 are switched over to their low sides.
    let modes = writes(SET_UP_DISCRETE, GPIOB..GPIOB + 4)[0].value;
    assert_eq!(modes >> 26 & 0b1111, 0b1010);
}

#[test]
fn a_discrete_bridge_is_driven_within_its_bootstrap_limit_and_opened_by_the_main_output_enable() {
    // Full duty is clipped to 96 %: 4032 of 4200 counts high, compare value 168. b stays low. MOE comes last.
    check(
        &writes(DISCRETE_FORWARD, block(TIM1)),
        &[&[
            expect("TIM1_BDTR", TIM1 + 0x44, &[], "open first: MOE 0"),
            expect("TIM1_CCR1", TIM1 + 0x34, &[("CCR", 0, 4200)], "a low"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[("CCR", 0, 4200)], "b low"),
            expect("TIM1_CCR1", TIM1 + 0x34, &[("CCR", 0, 168)], "a high for 4032 counts"),
            expect(
                "TIM1_CCR2",
                TIM1 + 0x38,
                &[("CCR", 0, 4200)],
                "b low: the current returns through its low side",
            ),
            expect("TIM1_BDTR", TIM1 + 0x44, &[("MOE", 15, 1)], "driven"),
        ]],
    );
    check(
        &writes(DISCRETE_OPEN, ALL),
        &[&[
            expect("TIM1_BDTR", TIM1 + 0x44, &[], "MOE 0 before anything else: all four transistors off"),
            expect("TIM1_CCR1", TIM1 + 0x34, &[("CCR", 0, 4200)], "a low"),
            expect("TIM1_CCR2", TIM1 + 0x38, &[("CCR", 0, 4200)], "b low"),
        ]],
    );
}
