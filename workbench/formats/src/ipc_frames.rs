//! The messages of a stream of Arrow, looked through before they are decoded: the library gives the memory that a length asks
//! for, whatever stands there.

use crate::taken::Taken;
use arrow_ipc::{CompressionType, Message, RecordBatch, root_as_message};

/// The mark before the length of a message; old files lack it.
const CONTINUED: u32 = u32::MAX;
/// What LZ4 and zstd make of a byte at most: the longest run that LZ4 writes with a byte, and a block of zstd in four.
const LZ4: i64 = 255;
const ZSTD: i64 = 1 << 15;
/// Bytes of a buffer before its compressed ones: how long it was.
const PREFIX: i64 = 8;
/// Bytes of a buffer, and rows of a batch that has no buffers, which are no mistake.
const LONGEST: i64 = 1 << 31;
const ROWS: i64 = 1 << 20;

/// How far the messages of a stream are sound, and why not to its end.
pub fn sound(stream: &[u8]) -> (usize, Option<String>) {
    let mut bytes = Taken::of(stream);
    loop {
        let begin = bytes.at;
        match message(&mut bytes) {
            Some(Ok(true)) => {}
            Some(Ok(false)) => return (bytes.at, None),
            Some(Err(why)) => {
                return (begin, Some(format!("is broken in the message at byte {begin} ({why})")));
            }
            None => return (begin, Some(format!("is cut in the message at byte {begin}"))),
        }
    }
}

/// Takes a message. False: it was the last; `None`: the bytes are over.
fn message(bytes: &mut Taken) -> Option<Result<bool, &'static str>> {
    let mut length = bytes.integer(4)? as u32;
    if length == CONTINUED {
        length = bytes.integer(4)? as u32;
    }
    if length == 0 {
        return Some(Ok(false));
    }
    let Ok(message) = root_as_message(bytes.take(length as usize)?) else {
        return Some(Err("it cannot be understood"));
    };
    let Ok(length) = usize::try_from(message.bodyLength()) else {
        return Some(Err("its length is negative"));
    };
    let body = bytes.take(length)?;
    Some(if is_sound(&message, body) { Ok(true) } else { Err("it promises more than it holds") })
}

fn is_sound(message: &Message, body: &[u8]) -> bool {
    let of_dictionary = || message.header_as_dictionary_batch().and_then(|batch| batch.data());
    message.header_as_record_batch().or_else(of_dictionary).is_none_or(|batch| fits(&batch, body))
}

/// The buffers of a batch lie in its body, and are no longer than what they are decompressed from allows.
fn fits(batch: &RecordBatch, body: &[u8]) -> bool {
    let ratio = batch.compression().map(|it| if it.codec() == CompressionType::ZSTD { ZSTD } else { LZ4 });
    let mut bits = 0_i64;
    for buffer in batch.buffers().into_iter().flatten() {
        let (Ok(at), Ok(length)) = (usize::try_from(buffer.offset()), usize::try_from(buffer.length()))
        else {
            return false;
        };
        let Some(held) = at.checked_add(length).and_then(|end| body.get(at..end)) else { return false };
        let held_length = length as i64;
        let whole = match (ratio, held.first_chunk::<8>()) {
            (Some(ratio), Some(prefix)) => {
                let whole = i64::from_le_bytes(*prefix);
                if whole > LONGEST || whole > (held_length - PREFIX).saturating_mul(ratio) {
                    return false;
                }
                if whole < 0 { held_length } else { whole }
            }
            _ => held_length,
        };
        bits = bits.saturating_add(whole.saturating_mul(8));
    }
    (0..=bits.max(ROWS)).contains(&batch.length())
}
