//! What a board with this chip is, as data: everything in which one differs from another. The other files of this folder are
//! code of the chip, and ask this one; each board is a file of `boards/`.

use super::pins::Pin;
use super::stage::PowerStage;
use heapless::Vec;
use servo::drivers::drv8301::Settings;
use servo::drivers::reach::Reach;
use servo::drivers::scales::Scales;
use servo::drivers::sense::{CurrentKind, Divider, Rises, Scale};
use servo::optional::Optional;

/// Channels of one injected sequence of a converter.
pub const MOST_CHANNELS: usize = 4;

/// A board.
pub struct Board {
    /// For the log.
    pub name: &'static str,
    /// The power stage of every axis.
    pub stage: &'static PowerStage,
    /// Its axes, in the order in which an image takes them.
    pub axes: &'static [Axis],
    /// As many of them can have a discrete bridge.
    pub most_discrete: usize,
    /// What the fault lines of the axes do.
    pub fault: FaultLine,
    /// The enable contact: high permits motion.
    pub enable: Pin,
    /// High while a tick runs: for the oscilloscope.
    pub tick: Pin,
    /// Outputs that are high from the beginning.
    pub high: &'static [Pin],
    /// Measurement of the supply.
    pub supply: Supply,
    /// The port of the link.
    pub link: Link,
}

/// One axis.
pub struct Axis {
    /// The timer of its legs.
    pub timer: PwmTimer,
    /// Channels of the lines a and b, from 0.
    pub legs: [u8; 2],
    /// The timer that counts its encoder.
    pub encoder: EncoderTimer,
    /// The index line of its encoder.
    pub index: Option<Pin>,
    /// How its winding current is measured.
    pub current: Current,
    /// Sleep or enable pin of its driver, low at power-up and after a panic.
    pub sleep: Pin,
    /// Its fault line, low in case of fault.
    pub fault: Pin,
}

/// Timers with complementary outputs and a break input. TIM1 paces the control tick and belongs to every board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PwmTimer {
    /// TIM1.
    One,
    /// TIM8.
    Eight,
}

/// Timers with an encoder mode that no PWM needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderTimer {
    /// 32 bits.
    Two,
    /// 16 bits.
    Three,
    /// 16 bits.
    Four,
    /// 32 bits.
    Five,
}

/// Converter channels of a winding current.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Current {
    /// One sensor for both directions.
    Sensor(u8),
    /// A shunt below each leg, a and b: the leg that stays low carries the current.
    LowLegs([u8; 2], Rises),
}

/// Gate drivers that are set up over SPI and share an enable line: one chip an axis.
pub struct Gates {
    /// High enables all of them; low at reset.
    pub enable: Pin,
    /// Their fault line, low in case of fault.
    pub fault: Pin,
    /// Clock, data to the drivers, data from them. The firmware moves the pins itself: a few frames at the start.
    pub spi: [Pin; 3],
    /// The select line of each.
    pub selects: &'static [Pin],
    /// What is written into each.
    pub settings: Settings,
}

/// What a fault line does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultLine {
    /// It is the break input of the PWM timer: outputs off in hardware.
    Breaks,
    /// It is read once a tick.
    Polled,
}

/// The supply behind its divider.
pub struct Supply {
    /// Converter channel.
    pub channel: u8,
    /// Resistors.
    pub divider: Divider,
}

/// The port of the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// USART2, for example on PA2 and PA3.
    Usart2,
    /// USART3, for example on PB10 and PB11.
    Usart3,
}

/// The converters: 12 bits of their 3.3 V supply.
pub const SCALE: Scale = Scale { reference_v: 3.3, bits: 12 };

impl Board {
    /// As many axes as an image for this board can have.
    pub const fn most_axes(&self) -> usize {
        if self.stage.has_low_sides() { self.most_discrete } else { self.axes.len() }
    }

    /// What its sensors can tell at most.
    pub const fn reach(&self) -> Reach {
        Reach { supply: SCALE.most(), current: self.stage.current_reach() }
    }

    /// What one count of its converters is worth.
    pub const fn scales(&self) -> Scales {
        let current = match self.stage.current {
            CurrentKind::Absent => Optional::NONE,
            CurrentKind::Signed | CurrentKind::Magnitude => {
                Optional::new(SCALE.ampere_per_lsb(self.stage.volt_per_ampere))
            }
        };
        Scales { supply: Optional::new(SCALE.supply_volt_per_lsb(self.supply.divider)), current }
    }

    /// Converter channels of the winding currents of the first `axes` axes, in the order in which they are measured. A list: the
    /// chain of iterators takes 600 bytes more of the image.
    #[inline(never)]
    pub fn currents(&self, axes: usize) -> Vec<u8, MOST_CHANNELS> {
        let mut list = Vec::new();
        for axis in self.axes.iter().take(axes) {
            let channels = match &axis.current {
                Current::Sensor(channel) => core::slice::from_ref(channel),
                Current::LowLegs(channels, _) => channels,
            };
            for channel in channels {
                // No board has more.
                let _ = list.push(*channel);
            }
        }
        list
    }

    /// True if one of the first `axes` axes has its legs on this timer.
    pub fn uses(&self, timer: PwmTimer, axes: usize) -> bool {
        self.axes.iter().take(axes).any(|axis| axis.timer == timer)
    }

    /// Channels of the timer with a low side, for the first `axes` axes: one bit each.
    pub fn low_sides(&self, timer: PwmTimer, axes: usize) -> u8 {
        let mut bits = 0;
        for axis in self.axes.iter().take(axes) {
            if axis.timer == timer && self.stage.has_low_sides() {
                bits |= 1 << axis.legs[0] | 1 << axis.legs[1];
            }
        }
        bits
    }

    /// True if this channel is a line b.
    pub fn is_line_b(&self, timer: PwmTimer, channel: u8) -> bool {
        self.axes.iter().any(|axis| axis.timer == timer && axis.legs[1] == channel)
    }
}

/// The board of this image, its pins, its gate drivers, and what measures its winding currents. The pins stand beside the board,
/// not in it: they become registers when the image is built, and take no flash.
pub use super::chosen::{BOARD, CurrentOf, GATES, LINES as PINS};
