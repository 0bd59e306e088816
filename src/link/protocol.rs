//! What host and servo say to each other, and how it travels.
//!
//! A [`Frame`] is versioned and numbered. On the wire it is `postcard`, followed by a CRC-32, inside one COBS block that
//! ends with a zero byte: a receiver that starts in the middle of the stream is in step after the next zero, and a
//! damaged frame is dropped as a whole. `postcard` numbers the variants of an enum in order, so new variants are
//! appended and published ones stay where they are; a change that breaks this raises [`VERSION`].

pub use crate::axis::{Command, Refusal};
use crate::commission::Outcome;
use crate::link::board::Board;
use crate::link::capture::{Extent, Shot, Stage};
use crate::record::Record;
use crate::store::StoreEvent;
use crate::store::checksum::CHECKSUM;
use crate::store::{AxisParameters, Found, LAYOUT};
use core::marker::PhantomData;
use crc::{Digest, NoTable};
use postcard::ser_flavors::{Cobs, Flavor, Slice};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// Changes of the frames that changed nothing that is stored.
const OF_FRAMES_ALONE: u16 = 1;
/// Version of the frames; first byte of every frame. What is stored travels, too: a new layout is a new version.
pub const VERSION: u8 = (LAYOUT + OF_FRAMES_ALONE) as u8;

/// Room for the longest frame on the wire, bytes: 254 of content fit into one COBS group.
pub const FRAME_CAPACITY: usize = 256;

const CHECKSUM_BYTES: usize = 4;

/// A command and the axis that it is for: the content of a frame to the servo.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Number of the axis on this chip, from 0.
    pub axis: u8,
    /// What it shall do.
    pub command: Command,
}

/// Why the chip has started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ResetCause {
    /// Supply switched on or dipped.
    #[default]
    Power,
    /// Reset pin.
    Pin,
    /// The image asked for it.
    Software,
    /// The control tick or idle stopped coming.
    Watchdog,
}

/// Ticks in one [`Message::Captured`]: they fit a frame.
pub const CAPTURE_PIECE: usize = 5;

/// What the servo says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub enum Message {
    /// The answer to one command.
    Answer {
        /// Sequence number of the command.
        to: u16,
        /// Control tick in which it acted.
        tick: u32,
        /// True if it was executed.
        result: Result<(), Refusal>,
    },
    /// One control tick.
    Telemetry {
        /// Number of the axis on this chip.
        axis: u8,
        /// Number of the tick since power-up; a gap tells of records that the link could not carry.
        tick: u32,
        /// What the tick cost, in counts of the board's clock (see the board); not part of the record, which is the
        /// same on every machine.
        cost: u32,
        /// Everything else.
        record: Record,
    },
    /// A commissioning has ended, with or without result.
    Commissioned {
        /// Number of the axis on this chip.
        axis: u8,
        /// Control tick in which it ended.
        tick: u32,
        /// What it found.
        outcome: Outcome,
    },
    /// A piece of a capture.
    Captured {
        /// Number of the axis on this chip.
        axis: u8,
        /// Where the capture stands; it can be read while it runs, but only a finished one stands still.
        stage: Stage,
        /// What there is to read.
        extent: Extent,
        /// Number of the first one here.
        from: u16,
        /// Up to [`CAPTURE_PIECE`] ticks.
        shots: heapless::Vec<Shot, CAPTURE_PIECE>,
    },
    /// Sent once after power-up, and when asked.
    Hello {
        /// Axes of this image.
        axes: u8,
        /// Why the chip has started.
        cause: ResetCause,
        /// What was found in the store.
        stored: Found,
        /// The board, and how it is.
        board: Board,
    },
    /// What is in force.
    Parameters {
        /// Number of the axis on this chip.
        axis: u8,
        /// `None`: not configured.
        parameters: Option<AxisParameters>,
    },
    /// How the storing of parameters goes on.
    Store(StoreEvent),
}

impl Message {
    /// The axis that it is about; `None`: the chip, or a command by its number.
    #[must_use]
    pub fn axis(&self) -> Option<u8> {
        match *self {
            Message::Telemetry { axis, .. }
            | Message::Commissioned { axis, .. }
            | Message::Captured { axis, .. }
            | Message::Parameters { axis, .. } => Some(axis),
            Message::Answer { .. } | Message::Hello { .. } | Message::Store(_) => None,
        }
    }
}

/// The envelope of a [`Request`] or a [`Message`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame<T> {
    /// [`VERSION`].
    pub version: u8,
    /// Counts the frames of one sender; wraps.
    pub sequence: u16,
    /// Content.
    pub body: T,
}

/// Why bytes are not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FrameError {
    /// More than [`FRAME_CAPACITY`] bytes without a zero.
    TooLong,
    /// Not a COBS block, or too short for a checksum.
    Broken,
    /// Checksum does not match.
    Checksum,
    /// Another version of the protocol.
    Version(u8),
    /// Intact, but not what this version knows.
    Content,
}

/// Writes one frame, zero byte included, and returns the part of `buffer` that it fills.
pub fn encode<T: Serialize>(sequence: u16, body: T, buffer: &mut [u8]) -> Result<&mut [u8], FrameError> {
    let frame = Frame { version: VERSION, sequence, body };
    Cobs::try_new(Slice::new(buffer))
        .and_then(|cobs| postcard::serialize_with_flavor(&frame, Line { cobs, checksum: CHECKSUM.digest() }))
        .map_err(|_| FrameError::TooLong)
}

/// Checksum and framing as one function: inlined wherever a byte is written, they would take 3 KiB of the image. The checksum's own
/// flavour of `postcard` knows checksums with a table alone.
struct Line<'a> {
    cobs: Cobs<Slice<'a>>,
    checksum: Digest<'static, u32, NoTable>,
}

impl<'a> Flavor for Line<'a> {
    type Output = &'a mut [u8];

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.checksum.update(&[byte]);
        self.cobs.try_push(byte)
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        bytes.iter().try_for_each(|&byte| self.try_push(byte))
    }

    fn finalize(self) -> postcard::Result<Self::Output> {
        let Line { mut cobs, checksum } = self;
        cobs.try_extend(&checksum.finalize().to_le_bytes())?;
        cobs.finalize()
    }
}

/// Reads one COBS block (without its zero byte); decodes in place.
pub fn decode<T: DeserializeOwned>(block: &mut [u8]) -> Result<Frame<T>, FrameError> {
    let length = cobs::decode_in_place(block).map_err(|_| FrameError::Broken)?;
    let (content, checksum) = block
        .get(..length)
        .and_then(|bytes| bytes.split_last_chunk::<CHECKSUM_BYTES>())
        .ok_or(FrameError::Broken)?;
    if CHECKSUM.checksum(content) != u32::from_le_bytes(*checksum) {
        return Err(FrameError::Checksum);
    }
    match content.first() {
        Some(&VERSION) => postcard::from_bytes(content).map_err(|_| FrameError::Content),
        Some(&other) => Err(FrameError::Version(other)),
        None => Err(FrameError::Broken),
    }
}

/// Collects bytes until a frame is complete.
#[derive(Clone, Debug)]
pub struct Receiver<T> {
    block: [u8; FRAME_CAPACITY],
    length: usize,
    overflow: bool,
    content: PhantomData<T>,
}

impl<T: DeserializeOwned> Receiver<T> {
    /// An empty one.
    pub const fn new() -> Self {
        Receiver { block: [0; FRAME_CAPACITY], length: 0, overflow: false, content: PhantomData }
    }

    /// Takes one byte; `Some` at the end of a frame. Empty blocks (idle zeros) are silent.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<T>, FrameError>> {
        if byte != 0 {
            self.collect(byte);
            return None;
        }
        let (length, overflow) = (self.length, self.overflow);
        (self.length, self.overflow) = (0, false);
        match (overflow, length) {
            (true, _) => Some(Err(FrameError::TooLong)),
            (false, 0) => None,
            (false, _) => Some(decode(&mut self.block[..length])),
        }
    }

    fn collect(&mut self, byte: u8) {
        match self.block.get_mut(self.length) {
            Some(place) => {
                *place = byte;
                self.length += 1;
            }
            None => self.overflow = true,
        }
    }
}

impl<T: DeserializeOwned> Default for Receiver<T> {
    fn default() -> Self {
        Self::new()
    }
}
