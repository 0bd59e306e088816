//! WPILOG, the log of FRC robots: entries, each at its own rate.

use crate::naming;
use crate::streams::{Stream, Streams};
use crate::taken::Taken;
use std::collections::HashMap;
use std::io::{self, Read};
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Logs of FRC robots.
pub struct Wpilog;

/// How such a file begins.
const MAGIC: &[u8] = b"WPILOG";
/// Stamps are microseconds.
const TICKS: f64 = 1e6;
/// The entry that starts and ends others.
const CONTROL: u64 = 0;

impl Source for Wpilog {
    fn takes(&self, _: &str, head: &[u8]) -> bool {
        head.starts_with(MAGIC)
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let mut reader = (bytes.open)().map_err(|error| InputError::unreadable(bytes.name, error))?;
        let mut log = Log::default();
        let end = log.read(&mut reader);
        log.finish(end).map_err(|what| InputError::file(bytes.name, what))
    }
}

/// What the values of an entry are.
#[derive(Clone, Copy)]
enum Kind {
    Flag,
    Integer,
    Single,
    Double,
    Text,
}

/// An entry that is open: where it goes, and whether its values are lists.
struct Entry {
    stream: usize,
    kind: Kind,
    list: bool,
}

#[derive(Default)]
struct Log {
    streams: Streams,
    entries: HashMap<u64, Entry>,
    /// Where each name goes: an entry may be ended and started anew.
    known: HashMap<String, usize>,
    left_out: Vec<String>,
    payload: Vec<u8>,
    at: u64,
}

/// A whole number of so many bytes, up to eight.
fn number(reader: &mut dyn Read, bytes: usize) -> io::Result<u64> {
    let mut all = [0; 8];
    reader.read_exact(&mut all[..bytes])?;
    Ok(u64::from_le_bytes(all))
}

impl Log {
    /// Reads to the end, or says why not.
    fn read(&mut self, reader: &mut dyn Read) -> Result<(), String> {
        let failed = |error: io::Error| error.to_string();
        io::copy(&mut reader.take(MAGIC.len() as u64 + 2), &mut io::sink()).map_err(failed)?;
        let extra = number(reader, 4).map_err(failed)?;
        io::copy(&mut reader.take(extra), &mut io::sink()).map_err(failed)?;
        self.at = MAGIC.len() as u64 + 6 + extra;
        while self.record(reader)? {}
        Ok(())
    }

    /// Reads one record. False: they are over.
    fn record(&mut self, reader: &mut dyn Read) -> Result<bool, String> {
        let cut = || format!("is cut in the record at byte {}", self.at);
        let mut lengths = [0];
        if reader.read(&mut lengths).map_err(|error| error.to_string())? == 0 {
            return Ok(false);
        }
        // Two bits each for the lengths of entry and size, three for the stamp, less one.
        let widths = [lengths[0] & 3, lengths[0] >> 2 & 3, lengths[0] >> 4 & 7].map(|bits| bits as usize + 1);
        let mut next = |k: usize| number(reader, widths[k]).map_err(|_| cut());
        let (entry, size, stamp) = (next(0)?, next(1)?, next(2)?);
        let mut payload = std::mem::take(&mut self.payload);
        payload.clear();
        let read = reader.take(size).read_to_end(&mut payload);
        if read.map_err(|error| error.to_string())? as u64 != size {
            return Err(cut());
        }
        let taken =
            if entry == CONTROL { self.control(&payload) } else { self.value(entry, stamp, &payload) };
        self.payload = payload;
        taken.ok_or_else(|| format!("is broken in the record at byte {}", self.at))?;
        self.at += 1 + widths.iter().sum::<usize>() as u64 + size;
        Ok(true)
    }

    fn control(&mut self, payload: &[u8]) -> Option<()> {
        let mut payload = Taken::of(payload);
        let (code, id) = (payload.integer(1)?, payload.integer(4)?);
        match code {
            0 => {
                let (name, kind) = (payload.text()?, payload.text()?);
                self.start(id, name, &kind);
            }
            1 => {
                self.entries.remove(&id);
            }
            // Other ones carry words about an entry.
            _ => {}
        }
        Some(())
    }

    fn start(&mut self, id: u64, name: String, written: &str) {
        let bare = written.strip_suffix("[]");
        let kind = match bare.unwrap_or(written) {
            "boolean" => Kind::Flag,
            "int64" => Kind::Integer,
            "float" => Kind::Single,
            "double" => Kind::Double,
            "string" if bare.is_none() => Kind::Text,
            _ => {
                self.entries.remove(&id);
                self.left_out.push(name);
                return;
            }
        };
        let stream = *self.known.entry(name).or_insert_with_key(|name| {
            self.streams.list.push(Stream::new(name));
            self.streams.list.len() - 1
        });
        self.entries.insert(id, Entry { stream, kind, list: bare.is_some() });
    }

    fn value(&mut self, entry: u64, stamp: u64, payload: &[u8]) -> Option<()> {
        let Some(entry) = self.entries.get(&entry) else { return Some(()) };
        let stream = &mut self.streams.list[entry.stream];
        let width = entry.kind.bytes();
        let mut taken = Taken::of(payload);
        match (entry.kind, entry.list) {
            (Kind::Text, _) => {
                let value = std::str::from_utf8(payload).ok().and_then(naming::number);
                if let Some(value) = value {
                    stream.begin(stamp);
                    stream.number(value);
                }
            }
            (kind, false) => {
                let value = kind.number(&mut taken)?;
                stream.begin(stamp);
                stream.number(value);
            }
            (kind, true) => {
                stream.begin(stamp);
                let members = payload.len() / width;
                for k in 0..members.min(naming::MOST_MEMBERS) {
                    let back = stream.member(k);
                    stream.number(kind.number(&mut taken)?);
                    stream.leave(back);
                }
                stream.close_list(members);
            }
        }
        Some(())
    }

    fn finish(mut self, end: Result<(), String>) -> Result<Cells, String> {
        let stopped = end.err();
        if !self.streams.list.iter().any(Stream::holds_numbers) {
            let why = stopped.unwrap_or_else(|| "holds no entry of numbers".into());
            return Err(format!("{why}; expected entries of doubles, floats, whole numbers or flags"));
        }
        let told = &mut self.streams.told;
        told.extend(stopped.map(|why| format!("The file {why}: what stands before it is read.")));
        self.left_out.sort();
        self.left_out.dedup();
        if !self.left_out.is_empty() {
            told.push(format!(
                "Left out, because they hold no plain numbers: {}.",
                naming::some_of(&self.left_out)
            ));
        }
        self.streams.cells("WPILOG", TICKS)
    }
}

impl Kind {
    fn bytes(self) -> usize {
        match self {
            Self::Flag | Self::Text => 1,
            Self::Single => 4,
            Self::Integer | Self::Double => 8,
        }
    }

    fn number(self, bytes: &mut Taken) -> Option<f64> {
        let value = bytes.integer(self.bytes())?;
        Some(match self {
            Self::Flag | Self::Text => f64::from(u8::from(value != 0)),
            Self::Integer => value as i64 as f64,
            Self::Single => f32::from_bits(value as u32).into(),
            Self::Double => f64::from_bits(value),
        })
    }
}
