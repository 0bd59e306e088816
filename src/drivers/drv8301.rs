//! DRV8301: three gate drivers with two shunt amplifiers, set up over SPI. Source: TI's data sheet SLOS719.
//!
//! A frame has 16 bits, clocked in mode 1 (data change with the rising edge and are taken with the falling one), with the
//! select line high between two frames:
//!
//! | bits | to the driver | from the driver, about the frame before |
//! |---|---|---|
//! | 15 | 1: read, 0: write | 1: that frame was faulty |
//! | 14 … 11 | address | address |
//! | 10 … 0 | data | data |
//!
//! There is neither parity nor checksum, so what is written is read back. Reading a status register clears it: a flag that
//! is there again when it is read twice is a fault, one that is not is left over, for example from the start.

use embedded_hal::spi::SpiDevice;

const READ: u16 = 1 << 15;
const ADDRESS_SHIFT: u32 = 11;
const DATA: u16 = (1 << ADDRESS_SHIFT) - 1;
/// Times that control registers are written until they hold. The firmware of ODrive writes repeatedly, too: the first write
/// after the start may be ignored.
const ATTEMPTS: u8 = 8;
/// GVDD_OV in status register 2.
const OVER_VOLTAGE: u16 = 1 << 7;

/// Registers, by address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Register {
    /// Faults.
    Status1 = 0,
    /// Over-voltage of the gate supply, and the number of the chip.
    Status2 = 1,
    /// Gate current, PWM mode, over-current.
    Control1 = 2,
    /// Amplifiers.
    Control2 = 3,
}

impl Register {
    /// The frame that asks for this register; the frame after it brings the answer.
    pub const fn read(self) -> u16 {
        READ | (self as u16) << ADDRESS_SHIFT
    }

    /// The frame that writes this register.
    pub const fn write(self, data: u16) -> u16 {
        (self as u16) << ADDRESS_SHIFT | data & DATA
    }
}

/// Gain of the shunt amplifiers, V/V.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Gain {
    /// 10.
    Ten = 0,
    /// 20.
    Twenty = 1,
    /// 40.
    Forty = 2,
    /// 80.
    Eighty = 3,
}

impl Gain {
    /// V/V.
    pub const fn volt_per_volt(self) -> f32 {
        match self {
            Gain::Ten => 10.0,
            Gain::Twenty => 20.0,
            Gain::Forty => 40.0,
            Gain::Eighty => 80.0,
        }
    }
}

/// What is set up. Six separate inputs, gate current 1.7 A, and an over-current latches the driver off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Of both amplifiers.
    pub gain: Gain,
    /// OC_ADJ_SET 0 … 31: the voltage across a transistor at which it counts as overloaded, 0.060 … 2.4 V (table of the data
    /// sheet; 16: 0.403 V, 21: 0.730 V).
    pub trip: u8,
}

impl Settings {
    /// Control registers 1 and 2.
    pub const fn controls(self) -> [(Register, u16); 2] {
        const LATCH: u16 = 1 << 4;
        let trip = ((self.trip & 31) as u16) << 6;
        [(Register::Control1, trip | LATCH), (Register::Control2, (self.gain as u16) << 2)]
    }
}

/// What is wrong with a driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// The answer is none of a DRV8301: not there, not awake, no supply.
    NoAnswer(u16),
    /// A control register does not hold what was written: the word that was read instead.
    NotKept(Register, u16),
    /// It reports faults.
    Faulty(Faults),
    /// Its fault line is low, and it reports nothing.
    LineLow,
}

impl Trouble {
    /// As a number, for whoever asks over the link: kind above, word below.
    pub const fn code(self) -> u32 {
        let (kind, word) = match self {
            Trouble::NoAnswer(word) => (1, word),
            Trouble::NotKept(Register::Control1, word) => (2, word),
            Trouble::NotKept(_, word) => (3, word),
            Trouble::Faulty(faults) => (4, faults.0),
            Trouble::LineLow => (5, 0),
        };
        kind << 16 | word as u32
    }

    /// Back from [`Trouble::code`].
    pub const fn of_code(code: u32) -> Option<Self> {
        let word = code as u16;
        match code >> 16 {
            1 => Some(Trouble::NoAnswer(word)),
            2 => Some(Trouble::NotKept(Register::Control1, word)),
            3 => Some(Trouble::NotKept(Register::Control2, word)),
            4 => Some(Trouble::Faulty(Faults(word))),
            5 => Some(Trouble::LineLow),
            _ => None,
        }
    }

    /// In a word, and the number beside it.
    pub fn words(self) -> (&'static str, u16) {
        match self {
            Trouble::NoAnswer(word) => ("no answer", word),
            Trouble::NotKept(Register::Control1, word) => ("control register 1 not kept", word),
            Trouble::NotKept(_, word) => ("control register 2 not kept", word),
            Trouble::Faulty(faults) => (faults.worst(), faults.0),
            Trouble::LineLow => ("fault line low without a report", 0),
        }
    }
}

/// Faults as in status register 1; bit 11 is GVDD_OV of status register 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults(pub u16);

impl Faults {
    const OVER_VOLTAGE: u16 = 1 << 11;
    /// Over-temperature warning: says something, and switches nothing off.
    const WARNING: u16 = 1 << 6;
    /// Worst first: bits and their names.
    const NAMES: [(u16, &'static str); 6] = [
        (Self::OVER_VOLTAGE, "gate supply too high: inspect the board"),
        (0b11_1111, "over-current"),
        (1 << 7, "over-temperature"),
        (1 << 8, "supply too low"),
        (1 << 9, "gate supply too low"),
        (1 << 10, "fault"),
    ];

    /// Nothing that switches off.
    pub const fn is_none(self) -> bool {
        self.0 & !Self::WARNING == 0
    }

    /// The first to look at.
    pub fn worst(self) -> &'static str {
        let found = Self::NAMES.iter().find(|(bits, _)| self.0 & bits != 0);
        found.map_or("no fault", |(_, name)| name)
    }
}

/// One driver.
pub struct Drv8301<S> {
    spi: S,
    settings: Settings,
}

impl<S: SpiDevice<u16>> Drv8301<S> {
    /// A driver that is to be set up so.
    pub const fn new(spi: S, settings: Settings) -> Self {
        Self { spi, settings }
    }

    /// Sets an enabled driver up, and asks it how it is. Its supplies were low when it started, and it says so until it is
    /// read: that is returned, and is no fault.
    ///
    /// # Errors
    /// What is wrong.
    pub fn configure(&mut self) -> Result<Faults, Trouble> {
        let mut result = Ok(());
        for _ in 0..ATTEMPTS {
            for (register, data) in self.settings.controls() {
                let _ = self.exchange(register.write(data));
            }
            result = self.check();
            if result.is_ok() {
                break;
            }
        }
        result?;
        let left_over = self.faults()?;
        match self.faults()? {
            faults if faults.is_none() => Ok(left_over),
            faults => Err(Trouble::Faulty(faults)),
        }
    }

    /// Does it hold what was written? It forgets with its supply, and the current would be measured wrong from then on.
    ///
    /// # Errors
    /// It does not, or it does not answer.
    pub fn check(&mut self) -> Result<(), Trouble> {
        for (register, data) in self.settings.controls() {
            let read = self.read(register)?;
            if read != data {
                return Err(Trouble::NotKept(register, read));
            }
        }
        Ok(())
    }

    /// What it reports since the last look: both registers are cleared by it.
    ///
    /// # Errors
    /// It does not answer.
    pub fn faults(&mut self) -> Result<Faults, Trouble> {
        let (first, second) = (self.read(Register::Status1)?, self.read(Register::Status2)?);
        let over_voltage = if second & OVER_VOLTAGE != 0 { Faults::OVER_VOLTAGE } else { 0 };
        Ok(Faults(first | over_voltage))
    }

    /// The answer comes with the frame after the question. That one asks for a control register, which has no effect.
    fn read(&mut self, register: Register) -> Result<u16, Trouble> {
        let _ = self.exchange(register.read());
        let answer = self.exchange(Register::Control1.read()).unwrap_or(u16::MAX);
        // A faulty frame has bit 15 set, which no echo has.
        let echo = (register as u16) << ADDRESS_SHIFT;
        match answer & !DATA == echo {
            true => Ok(answer & DATA),
            false => Err(Trouble::NoAnswer(answer)),
        }
    }

    fn exchange(&mut self, word: u16) -> Result<u16, S::Error> {
        let mut words = [word];
        self.spi.transfer_in_place(&mut words)?;
        Ok(words[0])
    }
}
