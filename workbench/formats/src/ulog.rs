//! ULog, the log of PX4 autopilots.

use crate::naming::MOST_MEMBERS;
use crate::streams::{Stream, Streams};
use px4_ulog::stream_parser::model::{
    FlattenedField, FlattenedFieldType as Kind, FlattenedFormat, ParseErrorType, UlogParseError,
};
use px4_ulog::stream_parser::{DataMessage, LogParser};
use std::collections::HashMap;
use std::io::{self, BufRead, Read};
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Logs of PX4.
pub struct Ulog;

/// How such a file begins.
const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// Bytes before the first message, and before the body of each: its length in two, its type.
const HEADER: usize = 16;
const LEAD: usize = 3;
/// Stamps are microseconds.
const TICKS: f64 = 1e6;
/// The field that is the stamp.
const STAMP: &str = "timestamp";

impl Source for Ulog {
    fn takes(&self, _: &str, head: &[u8]) -> bool {
        head.starts_with(MAGIC)
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let reader = (bytes.open)().map_err(|error| InputError::unreadable(bytes.name, error))?;
        read(reader).map_err(|what| InputError::file(bytes.name, what))
    }
}

fn read(mut reader: Box<dyn BufRead + '_>) -> Result<Cells, String> {
    let mut log = Log::default();
    let mut take = |message: &DataMessage| log.take(message);
    let mut parser = LogParser::default();
    parser.set_data_message_callback(&mut take);
    let end = messages(&mut reader, &mut parser).err();
    drop(parser);
    if log.streams.messages() == 0 {
        return Err(format!(
            "{}; expected the log of a flight",
            end.unwrap_or_else(|| "holds no data".into())
        ));
    }
    let told = end.map(|end| format!("The file {end}: what stands before it is read."));
    log.streams.told = told.into_iter().collect();
    log.streams.cells("ULog", TICKS)
}

/// Hands on one message after the other, or says why not.
fn messages(reader: &mut dyn Read, parser: &mut LogParser) -> Result<(), String> {
    let mut at = HEADER as u64;
    let mut message = vec![0; HEADER];
    reader.read_exact(&mut message).map_err(|_| "is cut in its header".to_owned())?;
    parser.consume_bytes(&message).map_err(|why| format!("is broken in its header ({why})"))?;
    loop {
        message.clear();
        let cut = |_| format!("is cut in the message at byte {at}");
        reader.take(LEAD as u64).read_to_end(&mut message).map_err(cut)?;
        if message.is_empty() {
            return Ok(());
        }
        let length = message.get(..2).map_or(0, |size| u16::from_le_bytes([size[0], size[1]]));
        // What was appended after a crash begins with a message of its own.
        let appended = parser.appended_offsets().iter().copied().find(|offset| *offset > at);
        let before = appended.map_or(u64::MAX, |offset| offset - at);
        let whole = (LEAD as u64 + u64::from(length)).min(before.max(LEAD as u64));
        reader.take(whole - LEAD as u64).read_to_end(&mut message).map_err(cut)?;
        if message.len() as u64 != whole {
            return Err(cut(io::ErrorKind::UnexpectedEof.into()));
        }
        if message.len() == LEAD + usize::from(length) {
            let taken = if is_long_enough(&message) {
                parser.consume_bytes(&message).err()
            } else {
                Some(too_short())
            };
            taken.map_or(Ok(()), |why| Err(format!("is broken in the message at byte {at} ({why})")))?;
        }
        at += whole;
    }
}

/// The parser takes it for granted that subscriptions and parameters hold their first fields.
fn is_long_enough(message: &[u8]) -> bool {
    let body = &message[LEAD..];
    match message[LEAD - 1] {
        b'A' => body.len() >= 3,
        b'P' => body.first().is_some_and(|key| body.len() > usize::from(*key)),
        _ => true,
    }
}

fn too_short() -> UlogParseError {
    UlogParseError::new(ParseErrorType::Other, "it is too short")
}

/// Where a number stands in a message.
struct Place {
    offset: usize,
    kind: Kind,
}

/// What is read of a topic.
struct Topic {
    stream: usize,
    stamp: usize,
    places: Vec<Place>,
}

#[derive(Default)]
struct Log {
    streams: Streams,
    topics: HashMap<u16, Option<Topic>>,
}

impl Log {
    fn take(&mut self, message: &DataMessage) {
        if !self.topics.contains_key(&message.msg_id) {
            let topic = self.topic(message.flattened_format, message.multi_id.value());
            self.topics.insert(message.msg_id, topic);
        }
        let Some(Some(topic)) = self.topics.get(&message.msg_id) else { return };
        let Some(stamp) = bytes(message.data, topic.stamp).map(u64::from_le_bytes) else { return };
        let stream = &mut self.streams.list[topic.stream];
        stream.begin(stamp);
        for (index, place) in topic.places.iter().enumerate() {
            if let Some(value) = place.number(message.data) {
                stream.put(index, value);
            }
        }
    }

    /// A topic without a stamp is none.
    fn topic(&mut self, format: &FlattenedFormat, instance: u8) -> Option<Topic> {
        let stamp = format.timestamp_field.as_ref()?.offset.into();
        let instance = if instance == 0 { String::new() } else { format!("_{instance}") };
        let mut stream = Stream::new(&format!("{}{instance}", format.message_name));
        let longest = |field: &FlattenedField| {
            let rest = field.flattened_field_name.rsplit_once('[')?.1;
            rest.trim_end_matches(']').parse::<usize>().ok().filter(|member| *member >= MOST_MEMBERS)
        };
        let base = |field: &FlattenedField| {
            field.flattened_field_name.rsplit_once('[').map(|parts| parts.0.to_owned())
        };
        let too_long: Vec<Option<String>> =
            format.fields.iter().filter(|field| longest(field).is_some()).map(base).collect();
        let mut places = Vec::new();
        for field in &format.fields {
            let name = field.flattened_field_name.as_str();
            let padding = name.rsplit('.').next().is_some_and(|last| last.starts_with("_padding"));
            let list = base(field);
            if name == STAMP
                || padding
                || field.field_type == Kind::Char
                || list.is_some() && too_long.contains(&list)
            {
                continue;
            }
            if stream.add(&name.replace('[', "_").replace(']', "")).is_some() {
                places.push(Place { offset: field.offset.into(), kind: field.field_type.clone() });
            }
        }
        self.streams.list.push(stream);
        Some(Topic { stream: self.streams.list.len() - 1, stamp, places })
    }
}

impl Place {
    fn number(&self, message: &[u8]) -> Option<f64> {
        let at = self.offset;
        Some(match self.kind {
            Kind::Int8 => i8::from_le_bytes(bytes(message, at)?).into(),
            Kind::UInt8 | Kind::Bool | Kind::Char => u8::from_le_bytes(bytes(message, at)?).into(),
            Kind::Int16 => i16::from_le_bytes(bytes(message, at)?).into(),
            Kind::UInt16 => u16::from_le_bytes(bytes(message, at)?).into(),
            Kind::Int32 => i32::from_le_bytes(bytes(message, at)?).into(),
            Kind::UInt32 => u32::from_le_bytes(bytes(message, at)?).into(),
            Kind::Int64 => i64::from_le_bytes(bytes(message, at)?) as f64,
            Kind::UInt64 => u64::from_le_bytes(bytes(message, at)?) as f64,
            Kind::Float => f32::from_le_bytes(bytes(message, at)?).into(),
            Kind::Double => f64::from_le_bytes(bytes(message, at)?),
        })
    }
}

fn bytes<const N: usize>(message: &[u8], at: usize) -> Option<[u8; N]> {
    message.get(at..at + N)?.try_into().ok()
}
