//! Messages of ROS 2: CDR, the wire format of DDS, after the definition of the message.

use crate::naming::{self, MOST_MEMBERS};
use crate::ros_schema::{Field, Kind, Many, Schema};
use crate::streams::Stream;
use crate::taken::Taken;

/// Bytes that name the encoding, before the message.
const HEADER: usize = 4;

struct Cdr<'a> {
    bytes: Taken<'a>,
    big_endian: bool,
    /// In the second version numbers of eight bytes stand on multiples of four.
    widest: usize,
}

/// Reads a message into a stream. `None`: it does not hold what its definition says.
pub fn read(schema: &Schema, message: &[u8], stream: &mut Stream) -> Option<()> {
    let header: [u8; HEADER] = message.get(..HEADER)?.try_into().ok()?;
    // 0, 1: plain; 6, 7: plain in the second version. Others carry a member's number or length before each.
    let widest = match header[1] {
        0 | 1 => 8,
        6 | 7 => 4,
        _ => return None,
    };
    let bytes = Taken::of(&message[HEADER..]);
    let mut cdr = Cdr { bytes, big_endian: header[1].is_multiple_of(2), widest };
    cdr.message(schema, 0, Some(stream))
}

impl<'a> Cdr<'a> {
    fn message(&mut self, schema: &Schema, at: usize, mut stream: Option<&mut Stream>) -> Option<()> {
        let fields = &schema[at];
        if fields.is_empty() {
            // A message without members holds a byte.
            self.bytes.take(1)?;
        }
        for field in fields {
            let back = stream.as_deref_mut().map(|stream| stream.enter(&field.name));
            self.field(schema, field, stream.as_deref_mut())?;
            stream.as_deref_mut().zip(back).into_iter().for_each(|(stream, back)| stream.leave(back));
        }
        Some(())
    }

    fn field(&mut self, schema: &Schema, field: &Field, mut stream: Option<&mut Stream>) -> Option<()> {
        let count = match field.many {
            Many::One => return self.member(schema, field.kind, stream),
            Many::Fixed(count) => count,
            Many::Counted => self.integer(4)? as usize,
        };
        // Each member has at least a byte.
        if count > self.bytes.left() {
            return None;
        }
        for k in 0..count {
            let shown = stream.as_deref_mut().filter(|_| count <= MOST_MEMBERS);
            if shown.is_none() && self.skip_rest(field.kind, count - k)? {
                break;
            }
            match shown {
                Some(stream) => {
                    let back = stream.member(k);
                    self.member(schema, field.kind, Some(stream))?;
                    stream.leave(back);
                }
                None => self.member(schema, field.kind, None)?,
            }
        }
        if let Some(stream) = stream {
            stream.close_list(count);
        }
        Some(())
    }

    /// Goes over numbers that nobody wants; false: they have no common length.
    fn skip_rest(&mut self, kind: Kind, count: usize) -> Option<bool> {
        let (Kind::Integer { bytes, .. } | Kind::Real(bytes)) = kind else { return Some(false) };
        self.align(bytes)?;
        self.bytes.take(count.checked_mul(bytes)?)?;
        Some(true)
    }

    fn member(&mut self, schema: &Schema, kind: Kind, stream: Option<&mut Stream>) -> Option<()> {
        let value = match kind {
            Kind::Message(at) => return self.message(schema, at, stream),
            Kind::Integer { bytes, signed: false } => Some(self.integer(bytes)? as f64),
            Kind::Integer { bytes, signed: true } => {
                let unused = 64 - 8 * bytes as u32;
                Some(((self.integer(bytes)? << unused) as i64 >> unused) as f64)
            }
            Kind::Real(4) => Some(f32::from_bits(self.integer(4)? as u32).into()),
            Kind::Real(_) => Some(f64::from_bits(self.integer(8)?)),
            Kind::Text { wide } => self.text(wide)?,
        };
        if let Some((stream, value)) = stream.zip(value) {
            stream.number(value);
        }
        Some(())
    }

    fn align(&mut self, bytes: usize) -> Option<()> {
        let to = bytes.min(self.widest);
        self.bytes.take((to - self.bytes.at % to) % to).map(|_| ())
    }

    fn integer(&mut self, bytes: usize) -> Option<u64> {
        self.align(bytes)?;
        let value = self.bytes.integer(bytes)?;
        Some(if self.big_endian { value.swap_bytes() >> (64 - 8 * bytes) } else { value })
    }

    /// The number that a text holds, if it does.
    fn text(&mut self, wide: bool) -> Option<Option<f64>> {
        let count = self.integer(4)? as usize;
        let bytes = self.bytes.take(if wide { count.checked_mul(2)? } else { count })?;
        let text = std::str::from_utf8(bytes).ok().filter(|_| !wide);
        Some(text.and_then(|text| naming::number(text.trim_end_matches('\0'))))
    }
}
