//! The checksum of frames and of stored records: CRC-32 as in IEEE 802.3, bit by bit. A table would take a kilobyte of the image, and
//! save 20 instructions a byte on a line of 92,000 bytes a second: one per cent of the processor.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

pub(crate) static CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
