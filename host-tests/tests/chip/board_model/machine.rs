//! A behavioural model of what the board uses of the STM32F405, from the reference manual RM0090: ports, TIM1 and TIM8, ADC1 and ADC2 with
//! injected sequences, TIM2 to TIM5 in encoder mode. Time counts clocks of 168 MHz; between two events nothing changes.

use super::clocks::{self, Clocks};
use super::drv8301::Drv8301;
use super::motor::{Leg, Motor};
use super::timer::PwmTimer;
use super::wires::{self, Lines, Pin, Sensor, Supply, Wires};

/// Clocks of the converters' clock, 21 MHz (APB2 / 4).
const CONVERTER_CLOCK: u64 = 8;
/// Of one conversion beside the sampling, converter clocks (section 13.5).
const CONVERSION: u64 = 12;
const MHZ: f64 = 168.0;
/// Gain with which [`Sensor::BelowLegs`] is written down, V/V.
const WIRED_GAIN: f64 = 80.0;
/// What an amplifier of a driver whose enable line is low puts out, V: read by somebody on a board (TI's forum).
const OFF_V: f64 = 0.3;
/// An amplifier at 80 V/V is within 1 % after 2.4 µs (SLOS719, current shunt amplifiers): its time constant, clocks.
const AMPLIFIER: f64 = 2.4 * MHZ / 4.6;

pub const TIM1: u32 = 0x4001_0000;
pub const TIM8: u32 = 0x4001_0400;
const TIM2: u32 = 0x4000_0000;
const ADC: u32 = 0x4001_2000;
const PORTS: u32 = 0x4002_0000;

/// Ports A to D.
pub const A: usize = 0;
pub const B: usize = 1;
pub const C: usize = 2;
pub const D: usize = 3;

/// Numbers of MODER, AFRL and AFRH in a port, and MODER's code of alternate functions.
const MODER: usize = 0;
const AFR: usize = 8;
/// MODER, OTYPER, OSPEEDR and PUPDR of the ports with the pins of the probe (section 8.4).
const A_AFTER_RESET: [u32; 16] =
    [0xA800_0000, 0, 0x0C00_0000, 0x6400_0000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
const B_AFTER_RESET: [u32; 16] = [0x280, 0, 0xC0, 0x100, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
const OUTPUT: u32 = 1;
const ALTERNATE: u32 = 2;
const ANALOGUE: u32 = 3;

/// A converter with its injected sequence.
#[derive(Clone, Copy, Default)]
struct Converter {
    /// CR1, CR2, SMPR1, SMPR2, JSQR.
    cr1: u32,
    cr2: u32,
    smpr: [u32; 2],
    jsqr: u32,
    /// JEOC is bit 2.
    sr: u32,
    results: [u16; 4],
    /// The conversion under way: when it samples, and its number.
    next: Option<(u64, usize)>,
    ends: Option<u64>,
}

impl Converter {
    fn length(&self) -> usize {
        (self.jsqr >> 20 & 3) as usize + 1
    }

    /// A sequence of n channels sits in the last n places (section 13.13.12).
    fn channel(&self, number: usize) -> usize {
        (self.jsqr >> (5 * (4 - self.length() + number)) & 31) as usize
    }

    /// Sampling time in converter clocks (section 13.13.4).
    fn sampling(&self, channel: usize) -> u64 {
        let code = match channel {
            0..10 => self.smpr[1] >> (3 * channel),
            _ => self.smpr[0] >> (3 * (channel - 10)),
        };
        [3, 15, 28, 56, 84, 112, 144, 480][(code & 7) as usize]
    }

    /// JEXTEN 01 and JEXTSEL 0001: rising edge of TIM1's trigger output; ADON.
    fn trigger(&mut self, now: u64) {
        let waits = self.cr2 >> 16 & 0xF == 1 && self.cr2 >> 20 & 3 == 1 && self.cr2 & 1 != 0;
        if waits && self.next.is_none() && self.ends.is_none() {
            self.next = Some((now + self.sampling(self.channel(0)) * CONVERTER_CLOCK, 0));
        }
    }
}

/// The chip and the motors around it.
pub struct Chip {
    pub now: u64,
    pub timers: [PwmTimer; 2],
    counters: [[u32; 5]; 4],
    converters: [Converter; 2],
    outputs: [u16; 4],
    /// Levels of inputs, by port.
    inputs: [u16; 4],
    /// Other registers of the ports, which have no effect here.
    setup: [[u32; 16]; 4],
    pub clocks: Clocks,
    wires: Wires,
    pub drivers: Vec<Drv8301>,
    /// Somebody holds a fault line of a driver low.
    shorted: bool,
    pub motors: Vec<Motor>,
    /// What every current sensor reads too much, counts: offsets drift with temperature.
    pub drift: f64,
    /// What flows up through the shunts below the legs of every motor as their amplifiers follow it, A.
    followed: Vec<[f64; 2]>,
    /// Times at which the current of axis 0 was sampled, since the last look.
    pub sampled: Vec<u64>,
    /// Changes of the levels of all legs, since the last look.
    pub edges: Vec<(u64, Vec<[Leg; 2]>)>,
    /// Current of the first motor at every event, since the last look.
    pub trace: Vec<(u64, f64)>,
    ticks: u32,
}

impl Chip {
    /// After reset: enable contact closed, fault lines high. `late`: the repetition counter begins half a period later, about
    /// which the manuals disagree.
    pub fn new(motors: Vec<Motor>, wires: Wires, late: bool) -> Self {
        let drivers = wires.drivers.iter().flat_map(|drivers| &drivers.selects).map(|_| Drv8301::new());
        let mut chip = Self {
            now: 0,
            timers: [PwmTimer::new(late), PwmTimer::new(late)],
            counters: [[0; 5]; 4],
            converters: [Converter::default(); 2],
            outputs: [0; 4],
            inputs: [0; 4],
            setup: [A_AFTER_RESET, B_AFTER_RESET, [0; 16], [0; 16]],
            clocks: Clocks::new(8e6, 1.0),
            drivers: drivers.collect(),
            wires,
            shorted: false,
            drift: 0.0,
            followed: vec![[0.0; 2]; motors.len()],
            motors,
            sampled: Vec::new(),
            edges: Vec::new(),
            trace: Vec::new(),
            ticks: 0,
        };
        chip.enable(true);
        for fault in chip.wires.bridges.iter().map(|bridge| bridge.fault).collect::<Vec<_>>() {
            chip.level(fault.0, fault.1, true);
        }
        chip
    }

    /// MODER, OSPEEDR and PUPDR of the two pins of the probe, PA13 and PA14.
    pub fn probe_pins(&self) -> [u32; 3] {
        [0, 2, 3].map(|register| self.setup[A][register] >> 26 & 0xF)
    }

    /// Opens or closes the enable contact.
    pub fn enable(&mut self, closed: bool) {
        let (port, pin) = self.wires.enable;
        self.level(port, pin, closed);
    }

    /// The fault line of the first motor as a level; it is TIM1's break input where its pin is one.
    pub fn hold_fault(&mut self, low: bool) {
        self.shorted = low;
        let (port, pin) = self.wires.bridges[0].fault;
        self.level(port, pin, !low);
        if self.wires.drivers.is_none() {
            self.timers[0].break_input(low);
        }
        self.look();
    }

    /// A pulse of the fault line of a timer, far shorter than a tick.
    pub fn pulse_fault(&mut self, timer: usize) {
        self.timers[timer].break_input(true);
        self.timers[timer].break_input(false);
        self.look();
    }

    /// MODER's code of a pin, and its alternate function.
    fn function(&self, pin: Pin) -> (u32, u32) {
        let ((port, number), setup) = (pin, self.setup[pin.0]);
        let alternate = setup[AFR + usize::from(number / 8)] >> (4 * (number % 8)) & 15;
        (setup[MODER] >> (2 * number) & 3, if port == pin.0 { alternate } else { 0 })
    }

    /// Is this pin an output, and high?
    pub fn drives(&self, pin: Pin) -> Option<bool> {
        (self.function(pin).0 == OUTPUT).then(|| self.is_high(pin))
    }

    /// Is this output high? A pin that nobody drives is pulled down by what is behind it.
    pub fn is_high(&self, pin: Pin) -> bool {
        match self.function(pin) {
            (OUTPUT, _) => self.outputs[pin.0] >> pin.1 & 1 != 0,
            (ALTERNATE, function) => {
                wires::output(pin, function).is_some_and(|(timer, channel, low_side)| {
                    let (high, low) = self.timers[timer].output(channel, self.now);
                    if low_side { low } else { high }
                })
            }
            _ => false,
        }
    }

    /// The drivers see their lines, and the chip sees theirs.
    fn drive_drivers(&mut self) {
        let Some(wires) = self.wires.drivers.clone() else { return };
        let [enable, clock, data] = [wires.enable, wires.clock, wires.to_driver].map(|pin| self.is_high(pin));
        let mut from = true;
        for number in 0..self.drivers.len() {
            let select = wires.selects[number];
            let selected = self.function(select).0 == OUTPUT && !self.is_high(select);
            let terminal = self.motors.get(number).map_or(0.0, |motor| motor.back_emf().abs());
            let (driver, now) = (&mut self.drivers[number], self.now);
            driver.enable(enable, now, terminal);
            driver.lines(selected, clock, data, now);
            from &= driver.out(now).unwrap_or(true);
        }
        let low = self.shorted || self.drivers.iter().any(|driver| driver.complains(self.now));
        self.level(wires.from_driver.0, wires.from_driver.1, from);
        self.level(wires.fault.0, wires.fault.1, !low);
    }

    fn level(&mut self, port: usize, pin: u8, high: bool) {
        self.inputs[port] = self.inputs[port] & !(1 << pin) | u16::from(high) << pin;
    }

    /// Passes time until the measurement ends that runs the control tick.
    pub fn run_to_tick(&mut self) {
        let before = self.ticks;
        let patience = self.now + 168_000 * 4;
        while self.ticks == before {
            assert!(self.now < patience, "no measurement ends any more");
            self.pass(patience);
        }
    }

    /// Passes so many clocks.
    pub fn run(&mut self, clocks: u64) {
        let end = self.now + clocks;
        while self.now < end {
            self.pass(end);
        }
    }

    /// Passes time until the next event, at most until `end`.
    fn pass(&mut self, end: u64) {
        let timers = self.timers.iter().filter_map(|timer| timer.next_event(self.now));
        let converters = self.converters.iter().flat_map(|one| [one.next.map(|next| next.0), one.ends]);
        let next = timers.chain(converters.flatten()).min().unwrap_or(end).min(end).max(self.now);
        let seconds = (next - self.now) as f64 / (MHZ * 1e6);
        let levels = self.legs();
        for (motor, legs) in self.motors.iter_mut().zip(&levels) {
            motor.pass(*legs, seconds);
        }
        let left = (-((next - self.now) as f64) / AMPLIFIER).exp();
        for ((motor, legs), followed) in self.motors.iter().zip(&levels).zip(&mut self.followed) {
            for leg in 0..2 {
                let ampere = motor.up_through(leg, legs[leg]);
                followed[leg] = ampere + (followed[leg] - ampere) * left;
            }
        }
        self.now = next;
        self.trace.extend(self.motors.first().map(|motor| (next, motor.ampere)));
        self.convert();
        let [one, eight] = &mut self.timers;
        eight.event(next);
        if one.event(next) && one.triggers_on_update() {
            self.converters.iter_mut().for_each(|converter| converter.trigger(next));
        }
        self.look();
    }

    /// Forgets the edges up to now; the levels of this moment are the first.
    pub fn watch(&mut self) {
        self.edges = vec![(self.now, self.legs())];
        self.sampled.clear();
        self.trace.clear();
    }

    /// Notes the levels if they have changed.
    fn look(&mut self) {
        self.drive_drivers();
        let legs = self.legs();
        if self.edges.last().is_none_or(|(_, before)| *before != legs) {
            self.edges.push((self.now, legs));
        }
    }

    fn convert(&mut self) {
        for number in 0..2 {
            let converter = &self.converters[number];
            if let Some((at, place)) = converter.next.filter(|next| next.0 <= self.now) {
                let channel = converter.channel(place);
                let end = at + CONVERSION * CONVERTER_CLOCK;
                let last = place + 1 == converter.length();
                let next = (!last).then(|| {
                    (end + converter.sampling(converter.channel(place + 1)) * CONVERTER_CLOCK, place + 1)
                });
                let result = self.analogue(channel);
                let converter = &mut self.converters[number];
                converter.results[place] = result;
                (converter.next, converter.ends) = (next, last.then_some(end));
            }
            let converter = &mut self.converters[number];
            if converter.ends.is_some_and(|end| end <= self.now) {
                converter.ends = None;
                converter.sr |= 1 << 2;
                // JEOCIE: the interrupt of the control tick.
                self.ticks += converter.cr1 >> 7 & 1;
            }
        }
    }

    /// What a converter finds at a channel.
    fn analogue(&mut self, channel: usize) -> u16 {
        let Supply(supply, per_volt) = self.wires.supply;
        if channel == wires::channel(supply) {
            assert_eq!(self.function(supply).0, ANALOGUE, "the supply's pin");
            return (Motor::SUPPLY_V * per_volt).round() as u16;
        }
        for (number, bridge) in self.wires.bridges.iter().enumerate() {
            let pins = match bridge.current {
                Sensor::Mirror(pin, _) | Sensor::InLine(pin, _) => vec![pin],
                Sensor::BelowLegs(pins, _) => pins.to_vec(),
            };
            let Some(leg) = pins.iter().position(|pin| wires::channel(*pin) == channel) else { continue };
            assert_eq!(self.function(pins[leg]).0, ANALOGUE, "pin of channel {channel}");
            if number == 0 && leg == 0 {
                self.sampled.push(self.now);
            }
            let Some(motor) = self.motors.get(number) else { return 0 };
            let raw = match bridge.current {
                Sensor::Mirror(_, gain) => motor.ampere.abs() * gain,
                Sensor::InLine(_, gain) => 2048.0 + motor.ampere * gain,
                Sensor::BelowLegs(_, gain) => match self.drivers[number].gain(self.now) {
                    Some(set) => 2048.0 + self.followed[number][leg] * gain * set / WIRED_GAIN,
                    None => OFF_V * wires::PER_VOLT,
                },
            };
            return (raw + self.drift).round().clamp(0.0, 4095.0) as u16;
        }
        panic!("channel {channel} is not wired");
    }

    /// What the legs of every motor do.
    fn legs(&self) -> Vec<[Leg; 2]> {
        let legs = |number: usize| match self.wires.bridges[number].lines {
            Lines::Inputs(inputs, sleep) => match inputs.map(|pin| self.is_high(pin)) {
                [false, false] => [Leg::Open; 2],
                _ if !self.is_high(sleep) => [Leg::Open; 2],
                inputs => inputs.map(|high| if high { Leg::High } else { Leg::Low }),
            },
            Lines::Gates(_) if self.drivers.get(number).is_some_and(|driver| !driver.drives(self.now)) => {
                [Leg::Open; 2]
            }
            Lines::Gates(gates) => gates.map(|[high, low]| match (self.is_high(high), self.is_high(low)) {
                (true, true) => Leg::Shoot,
                (true, false) => Leg::High,
                (false, true) => Leg::Low,
                (false, false) => Leg::Open,
            }),
        };
        (0..self.motors.len()).map(legs).collect()
    }

    /// A register as the program reads it.
    pub fn read(&mut self, address: u32) -> u32 {
        let offset = address & 0x3FF;
        match address & !0x3FF {
            TIM1 => self.timers[0].read(offset, self.now),
            TIM8 => self.timers[1].read(offset, self.now),
            clocks::RCC | clocks::FLASH | clocks::TIM11 | clocks::DBGMCU => self.clocks.read(address),
            // DWT_CYCCNT.
            0xE000_1000 if offset == 4 => self.now as u32,
            ADC if offset >= 0x300 => 0,
            ADC => self.converter(offset),
            base if (PORTS..PORTS + 0x1000).contains(&base) => self.port(address),
            base if (TIM2..TIM2 + 0x1000).contains(&base) => self.counter(address),
            _ => panic!("{address:#x} is not modelled"),
        }
    }

    fn converter(&self, offset: u32) -> u32 {
        let converter = &self.converters[(offset >> 8) as usize];
        match offset & 0xFF {
            0x00 => converter.sr,
            0x04 => converter.cr1,
            0x08 => converter.cr2,
            offset @ 0x3C..0x4C => converter.results[((offset - 0x3C) / 4) as usize].into(),
            _ => 0,
        }
    }

    fn port(&self, address: u32) -> u32 {
        let port = ((address - PORTS) >> 10) as usize;
        match address & 0x3FF {
            0x10 => self.inputs[port].into(),
            0x14 => self.outputs[port].into(),
            offset => self.setup[port][(offset / 4) as usize % 16],
        }
    }

    /// CNT of a counter in encoder mode 3 follows the shaft.
    fn counter(&self, address: u32) -> u32 {
        const CNT: usize = 1;
        let number = ((address - TIM2) >> 10) as usize;
        let [cr1, _, smcr, _, arr] = self.counters[number];
        match (address & 0x3FF, Self::place(address)) {
            (0x24, _) if cr1 & 1 != 0 && smcr & 7 == 3 => {
                let on = |(_, bridge): &(&Motor, &wires::Bridge)| {
                    wires::counter(bridge.encoder).is_some_and(|(counter, function)| {
                        let set = bridge.encoder.map(|pin| self.function(pin));
                        counter == number && set == [(ALTERNATE, function); 2]
                    })
                };
                let mut pairs = self.motors.iter().zip(&self.wires.bridges);
                pairs.find(on).map_or(0, |(motor, _)| motor.count() & arr)
            }
            (_, Some(place)) if place != CNT => self.counters[number][place],
            _ => 0,
        }
    }

    fn place(address: u32) -> Option<usize> {
        match address & 0x3FF {
            0x00 => Some(0),
            0x24 => Some(1),
            0x08 => Some(2),
            0x18 => Some(3),
            0x2C => Some(4),
            _ => None,
        }
    }

    /// A register that the program writes.
    pub fn write(&mut self, address: u32, value: u32) {
        let (offset, now) = (address & 0x3FF, self.now);
        match address & !0x3FF {
            TIM1 => self.timers[0].write(offset, value, now),
            TIM8 => self.timers[1].write(offset, value, now),
            clocks::RCC | clocks::FLASH | clocks::TIM11 => self.clocks.write(address, value),
            // ADC_CCR: ADCPRE 01 is by 4.
            ADC if offset == 0x304 => assert_eq!(value >> 16 & 3, 1),
            ADC => self.write_converter(offset, value),
            base if (PORTS..PORTS + 0x1000).contains(&base) => self.write_port(address, value),
            base if (TIM2..TIM2 + 0x1000).contains(&base) => {
                if let Some(place) = Self::place(address) {
                    self.counters[((address - TIM2) >> 10) as usize][place] = value;
                }
            }
            _ => panic!("{address:#x} is not modelled"),
        }
        self.look();
    }

    fn write_converter(&mut self, offset: u32, value: u32) {
        let converter = &mut self.converters[(offset >> 8) as usize];
        match offset & 0xFF {
            // Flags are cleared by zeros.
            0x00 => converter.sr &= value,
            0x04 => converter.cr1 = value,
            0x08 => converter.cr2 = value,
            0x0C => converter.smpr[0] = value,
            0x10 => converter.smpr[1] = value,
            0x38 => converter.jsqr = value,
            other => panic!("ADC register {other:#x} is not modelled"),
        }
    }

    fn write_port(&mut self, address: u32, value: u32) {
        let port = ((address - PORTS) >> 10) as usize;
        match address & 0x3FF {
            // BSRR: the lower half sets, the upper one resets; setting wins (section 8.4.7).
            0x18 => {
                self.outputs[port] = self.outputs[port] & !((value >> 16) as u16) | value as u16;
            }
            offset => self.setup[port][(offset / 4) as usize % 16] = value,
        }
    }
}
