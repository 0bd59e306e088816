//! MCAP, the container that robots record into: messages of ROS 2 and as JSON.
//!
//! The container is a list of records, each behind a byte and a length; chunks of them are compressed. They are read as they
//! come, a record at a time, so that neither a file nor a chunk is in memory as a whole.

use crate::naming;
use crate::ros_schema::{self, Schema};
use crate::streams::{Stream, Streams};
use crate::taken::Taken;
use crate::{cdr, json_message};
use crc32fast::Hasher;
use std::collections::{BTreeMap, HashMap};
use std::io::{self, BufReader, Read};
use std::rc::Rc;
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Recordings of robots.
pub struct Mcap;

/// How such a file begins and ends.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Stamps are nanoseconds.
const TICKS: f64 = 1e9;
/// Records, as <https://mcap.dev/spec> numbers them.
mod op {
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const DATA_END: u8 = 0x0F;
}
/// Bytes that are decompressed at once.
const AT_ONCE: usize = 1 << 16;
/// Bytes of a message, and of a chunk, that is no mistake.
const LONGEST: u64 = 1 << 30;
/// Seconds since 1970, and nanoseconds, of stamps that were set: those of 32 bits.
const SANE: f64 = u32::MAX as f64;
/// Topics that tell of the recording and not of a motor.
const ASIDE: [&str; 2] = ["/rosout", "/parameter_events"];

impl Source for Mcap {
    fn takes(&self, _: &str, head: &[u8]) -> bool {
        head.starts_with(MAGIC)
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let mut reader = (bytes.open)().map_err(|error| InputError::unreadable(bytes.name, error))?;
        let mut recording = Recording::default();
        let mut counted = Counted { inner: &mut reader, at: 0 };
        let end = io::copy(&mut (&mut counted).take(MAGIC.len() as u64), &mut io::sink())
            .map_err(Stop::from)
            .and_then(|_| recording.records(&mut counted));
        recording.finish(end, counted.at).map_err(|what| InputError::file(bytes.name, what))
    }
}

/// Why reading ended before the end.
enum Stop {
    /// The bytes are over.
    Cut,
    /// They are not what they should be.
    Broken(String),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Cut,
            _ => Self::Broken(error.to_string()),
        }
    }
}

/// Bytes that are counted.
struct Counted<R> {
    inner: R,
    at: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(into)?;
        self.at += read as u64;
        Ok(read)
    }
}

/// Bytes whose checksum is taken.
struct Summed<R> {
    inner: R,
    sum: Hasher,
}

impl<R: Read> Read for Summed<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(into)?;
        self.sum.update(&into[..read]);
        Ok(read)
    }
}

/// How the messages of a topic are read.
enum Reading {
    Json,
    Cdr(Rc<Schema>),
}

/// A topic whose messages are read.
struct Channel {
    stream: usize,
    reading: Reading,
}

#[derive(Default)]
struct Recording {
    streams: Streams,
    schemas: HashMap<u16, (String, String, Vec<u8>)>,
    channels: HashMap<u16, Option<Channel>>,
    /// Topics that are not read, and why.
    left_out: BTreeMap<String, String>,
    /// Messages that do not hold what they should, and the topic of the first one.
    spoiled: Option<(usize, String)>,
    body: Vec<u8>,
    over: bool,
    in_chunk: bool,
}

impl Recording {
    /// Reads records until they are over.
    fn records(&mut self, reader: &mut dyn Read) -> Result<(), Stop> {
        while !self.over {
            let mut code = [0];
            if reader.read(&mut code)? == 0 {
                return Err(Stop::Cut);
            }
            let length = number::<8>(reader)?;
            let mut record = reader.take(length);
            match code[0] {
                op::CHUNK if !self.in_chunk => {
                    self.in_chunk = true;
                    let end = self.chunk(&mut record);
                    self.in_chunk = false;
                    end?;
                }
                op::FOOTER | op::DATA_END => self.over = true,
                op::SCHEMA | op::CHANNEL | op::MESSAGE if length <= LONGEST => {
                    let mut body = std::mem::take(&mut self.body);
                    body.clear();
                    let read = record.read_to_end(&mut body)?;
                    let taken = (read as u64 == length).then(|| self.record(code[0], &body));
                    self.body = body;
                    let short = || Stop::Broken("a record is shorter than it says".into());
                    taken.ok_or(Stop::Cut)?.ok_or_else(short)?;
                }
                _ => {}
            }
            io::copy(&mut record, &mut io::sink())?;
            if record.limit() > 0 && !self.over {
                return Err(Stop::Cut);
            }
        }
        Ok(())
    }

    /// The records in a chunk, which may be compressed. Its checksum is known at its end: what does not fit is left out again.
    fn chunk(&mut self, reader: &mut dyn Read) -> Result<(), Stop> {
        let (_start, _end) = (number::<8>(reader)?, number::<8>(reader)?);
        let (size, sum) = (number::<8>(reader)?, number::<4>(reader)? as u32);
        let mut name = Vec::new();
        let length = number::<4>(reader)?;
        reader.take(length).read_to_end(&mut name)?;
        let compressed = number::<8>(reader)?;
        let mut compressed = reader.take(compressed);
        let mark = self.streams.mark();
        let inner = decompressed(&name, &mut compressed)?.take(size.min(LONGEST));
        let mut records = BufReader::with_capacity(AT_ONCE, Summed { inner, sum: Hasher::new() });
        let end = self.records(&mut records);
        let rest = io::copy(&mut records, &mut io::sink());
        let summed = records.into_inner();
        let whole = summed.inner.limit() == 0;
        self.over = false;
        let end = match end {
            _ if whole && sum != 0 && summed.sum.finalize() != sum => {
                Err(Stop::Broken("the checksum of a chunk is not that of its bytes".into()))
            }
            // The records of a chunk are over where the chunk is.
            Err(Stop::Cut) if whole => Ok(()),
            other => other.and(rest.map(|_| ()).map_err(Stop::from)),
        };
        if matches!(end, Err(Stop::Broken(_))) {
            self.streams.back_to(&mark);
        }
        end
    }

    /// One record; `None`: it is shorter than it says.
    fn record(&mut self, code: u8, body: &[u8]) -> Option<()> {
        let mut body = Taken::of(body);
        match code {
            op::SCHEMA => {
                let id = body.integer(2)? as u16;
                let (name, encoding) = (body.text()?, body.text()?);
                let length = body.integer(4)? as usize;
                self.schemas.insert(id, (name, encoding, body.take(length)?.to_vec()));
            }
            op::CHANNEL => {
                let (id, schema) = (body.integer(2)? as u16, body.integer(2)? as u16);
                let (topic, encoding) = (body.text()?, body.text()?);
                if !self.channels.contains_key(&id) {
                    let channel = self.channel(schema, &topic, &encoding);
                    self.channels.insert(id, channel);
                }
            }
            _ => {
                let channel = self.channels.get(&(body.integer(2)? as u16));
                let (_sequence, stamp, _published) = (body.integer(4)?, body.integer(8)?, body.integer(8)?);
                if let Some(Some(channel)) = channel {
                    let stream = &mut self.streams.list[channel.stream];
                    stream.begin(stamp);
                    let message = body.take(body.left())?;
                    let read = match &channel.reading {
                        Reading::Json => json_message::read(message, stream).is_ok(),
                        Reading::Cdr(schema) => cdr::read(schema, message, stream).is_some(),
                    };
                    if !read {
                        stream.undo();
                        let spoiled = self.spoiled.get_or_insert_with(|| (0, stream.name.clone()));
                        spoiled.0 += 1;
                    }
                }
            }
        }
        Some(())
    }

    fn channel(&mut self, schema: u16, topic: &str, encoding: &str) -> Option<Channel> {
        let reading = match (encoding, self.schemas.get(&schema)) {
            _ if ASIDE.contains(&topic) => return None,
            ("json", _) => Ok(Reading::Json),
            ("cdr", Some((name, form, text))) if form == "ros2msg" => {
                ros_schema::read(name, &String::from_utf8_lossy(text))
                    .map(|schema| Reading::Cdr(Rc::new(schema)))
            }
            ("cdr", Some((_, form, _))) => Err(format!("its definition is written as {form}")),
            ("cdr", None) => Err("its definition is missing".into()),
            (other, _) => Err(format!("its messages are written as {other}")),
        };
        match reading {
            Ok(reading) => {
                self.streams.list.push(Stream::new(topic));
                Some(Channel { stream: self.streams.list.len() - 1, reading })
            }
            Err(why) => {
                self.left_out.insert(topic.to_owned(), why);
                None
            }
        }
    }

    fn finish(mut self, end: Result<(), Stop>, at: u64) -> Result<Cells, String> {
        let stopped = match end {
            Ok(()) => None,
            Err(Stop::Cut) => Some(format!("is cut at byte {at}")),
            Err(Stop::Broken(why)) => Some(format!("is broken before byte {at} ({why})")),
        };
        let taken = self.streams.messages();
        let left_out = self.left_out.iter().next().map(|(topic, why)| format!("`{topic}`, {why}"));
        if taken == 0 {
            let why = stopped.or(left_out.map(|left_out| format!("of its topics none is read: {left_out}")));
            return Err(format!(
                "{}; expected messages as JSON or of ROS 2 with their definitions (ros2msg)",
                why.unwrap_or_else(|| "holds no messages".into())
            ));
        }
        let mut told: Vec<String> = stopped
            .map(|why| format!("The file {why}: what stands before it is read."))
            .into_iter()
            .collect();
        if let Some((messages, topic)) = self.spoiled.take() {
            if taken == 0 || messages > taken {
                return Err(format!(
                    "{messages} messages do not hold what their definition says, the first one of `{topic}`"
                ));
            }
            told.push(format!("Left out: {messages} messages that do not hold what their definition says, the first one of `{topic}`."));
        }
        if let Some(left_out) = left_out {
            let more = self.left_out.len() - 1;
            let more = if more > 0 { format!("; and {more} more topics") } else { String::new() };
            told.push(format!("Left out: {left_out}{more}."));
        }
        told.push(self.own_stamps());
        self.streams.told = told;
        self.streams.cells("MCAP", TICKS)
    }

    /// Takes the stamps in the headers of the messages, where each topic has them: those of the measurement. One clock holds for
    /// all topics, because two of them may differ by more than a motor takes.
    fn own_stamps(&mut self) -> String {
        let own = |stream: &Stream| {
            let (seconds, rest) =
                (stream.complete_field("header.stamp.sec")?, stream.complete_field("header.stamp.nanosec")?);
            let stamp = |(s, ns): (&f64, &f64)| {
                let sane = (1.0..=SANE).contains(s) && (0.0..=SANE).contains(ns);
                sane.then_some(*s as u64 * 1_000_000_000 + *ns as u64)
            };
            seconds.iter().zip(rest).map(stamp).collect::<Option<Vec<u64>>>()
        };
        let taken = || self.streams.list.iter().filter(|stream| stream.holds_numbers());
        let without: Vec<String> =
            taken().filter(|stream| own(stream).is_none()).map(|stream| stream.name.clone()).collect();
        if without.is_empty() {
            for stream in &mut self.streams.list {
                stream.stamps = own(stream).unwrap_or_default();
            }
            return "The time is that of the messages' own headers, in seconds since the first.".into();
        }
        let without = naming::some_of(&without);
        format!(
            "The time is when a message was recorded, in seconds since the first: no stamp of their own have {without}."
        )
    }
}

/// A whole number of so many bytes.
fn number<const N: usize>(reader: &mut dyn Read) -> io::Result<u64> {
    let mut all = [0; 8];
    reader.read_exact(&mut all[..N])?;
    Ok(u64::from_le_bytes(all))
}

fn decompressed<'a>(name: &[u8], reader: &'a mut dyn Read) -> Result<Box<dyn Read + 'a>, Stop> {
    match name {
        b"" => Ok(Box::new(reader)),
        b"lz4" => Ok(Box::new(lz4_flex::frame::FrameDecoder::new(reader))),
        #[cfg(feature = "zstd")]
        b"zstd" => Ok(Box::new(zstd::Decoder::new(reader)?)),
        other => {
            let other = String::from_utf8_lossy(other);
            Err(Stop::Broken(format!(
                "a chunk is compressed by `{other}`, which is not read: write it with lz4"
            )))
        }
    }
}
