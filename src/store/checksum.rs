//! The checksum of frames and of stored records: CRC-32 as in IEEE 802.3. One table of a kilobyte for both.

use crc::{CRC_32_ISO_HDLC, Crc};

pub(crate) static CHECKSUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
