//! What a board tells of itself: the facts of its circuit, and what its start has found.

use crate::drivers::drv8301::Trouble;
use crate::drivers::gates::State;
use crate::drivers::scales::Scales;
use crate::store::MAX_AXES;
use serde::{Deserialize, Serialize};

/// Room for the name of a board, bytes.
pub const NAME_CAPACITY: usize = 16;

/// A board, and how it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Board {
    /// Its name, as the table of boards spells it.
    pub name: heapless::String<NAME_CAPACITY>,
    /// What one count of its converters is worth.
    pub scales: Scales,
    /// What its clocks come from.
    pub clock: Clock,
    /// The chip is not held in reset while its supply is too low for its flash (option bytes, BOR_LEV).
    pub brown_out_reset_off: bool,
    /// Its gate drivers, if they are set up by the firmware.
    pub gates: Option<Gates>,
    /// One entry an axis: counts at which its current converters read zero, or marks of [`crate::axis::Sample`].
    pub zeros: heapless::Vec<[i16; 2], MAX_AXES>,
}

/// What the clocks come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Clock {
    /// There is none: the host says what time it is.
    #[default]
    Simulated,
    /// The oscillator inside the chip, because no usable crystal was found: off by up to 1 %.
    Internal,
    /// A crystal of so many hertz.
    Crystal(u32),
}

/// Gate drivers, which all axes share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gates {
    /// What they do now.
    pub state: State,
    /// [`GateTrouble::code`] of the last trouble since the start; 0: none.
    pub trouble: u32,
}

/// The last trouble of gate drivers, and the number of the driver that has told it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GateTrouble {
    /// Number of the driver, from 0.
    pub driver: u8,
    /// What is wrong.
    pub trouble: Trouble,
}

impl GateTrouble {
    /// In 32 bits, which an interrupt can read while idle writes them.
    pub const fn code(self) -> u32 {
        (self.driver as u32) << 24 | self.trouble.code()
    }

    /// Back from [`GateTrouble::code`].
    pub const fn of_code(code: u32) -> Option<Self> {
        match Trouble::of_code(code & 0xFF_FFFF) {
            Some(trouble) => Some(GateTrouble { driver: (code >> 24) as u8, trouble }),
            None => None,
        }
    }
}
