//! What a board tells of itself: the facts of its circuit, and what its start has found.

use crate::drivers::drv8301::Trouble;
use crate::drivers::gates::State;
use crate::drivers::scales::Scales;
use crate::optional::Optional;
use crate::sample::Sample;
use crate::store::MAX_AXES;
use serde::{Deserialize, Serialize};

/// Name of a board as the table of boards spells it, at most 16 bytes of UTF-8; zeros behind it. An array, because it is constant
/// in an image, which then needs no code for strings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Name([u8; Name::CAPACITY]);

impl Name {
    /// Room for it, bytes.
    pub const CAPACITY: usize = 16;

    /// A name; what has no room is left out.
    pub const fn new(name: &str) -> Self {
        let (from, mut bytes, mut at) = (name.as_bytes(), [0; Name::CAPACITY], 0);
        while at < from.len() && at < Name::CAPACITY {
            bytes[at] = from[at];
            at += 1;
        }
        Name(bytes)
    }

    /// As text.
    pub fn as_str(&self) -> &str {
        let length = self.0.iter().position(|byte| *byte == 0).unwrap_or(Name::CAPACITY);
        core::str::from_utf8(self.0.get(..length).unwrap_or_default()).unwrap_or_default()
    }
}

/// A board, and how it is. It travels as words: field by field the image would take 200 bytes more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "Words", from = "Words")]
pub struct Board {
    /// Its name.
    pub name: Name,
    /// What one count of its converters is worth.
    pub scales: Scales,
    /// What its clocks come from.
    pub clock: Clock,
    /// The chip is not held in reset while its supply is too low for its flash (option bytes, BOR_LEV).
    pub brown_out_reset_off: bool,
    /// Its gate drivers, if they are set up by the firmware.
    pub gates: Option<Gates>,
    /// Of each axis the counts at which its current converters read zero, or marks of [`Sample`]. Axes that the image has not
    /// are not sensed.
    pub zeros: [[i16; 2]; MAX_AXES],
}

/// Name, supply, current, clock, state of the gate drivers and brown-out reset, their trouble, zeros.
type Words = [u32; 9 + MAX_AXES];

/// State of gate drivers that are not there.
const NO_GATES: u32 = 0xFF;
const BROWN_OUT: u32 = 1 << 8;
const INTERNAL: u32 = 1;

impl From<Board> for Words {
    fn from(board: Board) -> Self {
        let Board { name, scales, clock, brown_out_reset_off, gates, zeros } = board;
        let mut words = [0; 9 + MAX_AXES];
        let (names, rest) = words.split_at_mut(4);
        for (word, bytes) in names.iter_mut().zip(name.0.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        let (facts, axes) = rest.split_at_mut(5);
        let clock = match clock {
            Clock::Simulated => 0,
            Clock::Internal => INTERNAL,
            Clock::Crystal(hertz) => hertz,
        };
        let (state, trouble) = gates.map_or((NO_GATES, 0), |gates| (gates.state as u32, gates.trouble));
        let state = if brown_out_reset_off { state | BROWN_OUT } else { state };
        facts.copy_from_slice(&[scales.supply.to_bits(), scales.current.to_bits(), clock, state, trouble]);
        for (word, [a, b]) in axes.iter_mut().zip(zeros) {
            *word = u32::from(a as u16) | u32::from(b as u16) << 16;
        }
        words
    }
}

impl From<Words> for Board {
    fn from(words: Words) -> Self {
        let [n0, n1, n2, n3, supply, current, clock, state, trouble, zeros @ ..] = words;
        let mut name = Name::default();
        for (bytes, word) in name.0.as_chunks_mut().0.iter_mut().zip([n0, n1, n2, n3]) {
            *bytes = word.to_le_bytes();
        }
        Board {
            name,
            scales: Scales { supply: Optional::from_bits(supply), current: Optional::from_bits(current) },
            clock: match clock {
                0 => Clock::Simulated,
                INTERNAL => Clock::Internal,
                hertz => Clock::Crystal(hertz),
            },
            brown_out_reset_off: state & BROWN_OUT != 0,
            gates: (state & NO_GATES != NO_GATES).then(|| Gates { state: State::of(state as u8), trouble }),
            zeros: zeros.map(|word| [word as u16 as i16, (word >> 16) as u16 as i16]),
        }
    }
}

impl Board {
    /// A board of which nothing but its name and its scales is known.
    pub const fn new(name: Name, scales: Scales) -> Self {
        Board {
            name,
            scales,
            clock: Clock::Simulated,
            brown_out_reset_off: false,
            gates: None,
            zeros: [[Sample::CURRENT_NOT_SENSED; 2]; MAX_AXES],
        }
    }
}

/// What the clocks come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
