//! The text of a log, read line by line as often as it is needed, without holding a file in memory.

use super::source::Bytes;
use crate::text::input_error::InputError;
use encoding_rs::{Encoding, UTF_8, UTF_16LE, WINDOWS_1252};
use std::borrow::Cow;
use std::io::{BufRead, Read};

/// What some programs write before a text.
const MARK: char = '\u{feff}';

/// A text that can be read several times.
pub enum Text<'a> {
    /// One in UTF-8 whose lines end with line feeds; what a logger appends meanwhile is not read.
    Streamed {
        /// Its bytes.
        bytes: Bytes<'a>,
        /// How many there are.
        length: u64,
    },
    /// Any other text.
    Held(String),
}

impl<'a> Text<'a> {
    /// The text in the bytes of a file, and the name of its encoding.
    pub fn of(bytes: Bytes<'a>) -> Result<(Self, &'static str), InputError> {
        let failed = |error| InputError::unreadable(bytes.name, error);
        if let Some(length) = (bytes.open)().and_then(plain_length).map_err(failed)? {
            return Ok((Self::Streamed { bytes, length }, UTF_8.name()));
        }
        let mut all = Vec::new();
        (bytes.open)().and_then(|mut reader| reader.read_to_end(&mut all)).map_err(failed)?;
        let (text, encoding) = decoded(bytes.name, &all)?;
        // Lines that end with a carriage return alone get a line feed.
        let text = if text.contains('\n') { text.into_owned() } else { text.replace('\r', "\n") };
        Ok((Self::Held(text), encoding))
    }

    /// From the first line on.
    pub fn lines(&self) -> std::io::Result<Lines<'_>> {
        let reader: Box<dyn BufRead> = match self {
            Self::Streamed { bytes, length } => Box::new((bytes.open)()?.take(*length)),
            Self::Held(text) => Box::new(text.as_bytes()),
        };
        Ok(Lines { reader, line: Vec::new(), number: 0 })
    }
}

/// The text of a file, and the name of its encoding.
fn decoded<'a>(source: &str, bytes: &'a [u8]) -> Result<(Cow<'a, str>, &'static str), InputError> {
    let no_text = || InputError::file(source, "is not a text file; export the log as CSV");
    let unmarked = bytes.len() > 3 && bytes[0] != 0 && bytes[1] == 0 && bytes[3] == 0;
    if let Some((encoding, length)) = Encoding::for_bom(bytes).or(unmarked.then_some((UTF_16LE, 0))) {
        let text = encoding.decode_without_bom_handling_and_without_replacement(&bytes[length..]);
        return Ok((text.ok_or_else(no_text)?, encoding.name()));
    }
    if bytes.contains(&0) {
        return Err(no_text());
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok((text.into(), UTF_8.name())),
        // Latin-1 is what remains. A binary file is full of control characters.
        Err(_) if bytes.iter().any(|byte| *byte < 0x20 && !b"\t\n\r\x0c".contains(byte)) => Err(no_text()),
        Err(_) => Ok((WINDOWS_1252.decode_without_bom_handling(bytes).0, "Windows-1252")),
    }
}

/// The length of a text that is UTF-8 with line feeds. `None`: it is something else.
fn plain_length(mut reader: Box<dyn BufRead + '_>) -> std::io::Result<Option<u64>> {
    let (mut length, mut line_feed, mut line) = (0, false, Vec::new());
    while reader.read_until(b'\n', &mut line)? > 0 {
        if line.contains(&0) || std::str::from_utf8(&line).is_err() {
            return Ok(None);
        }
        line_feed |= line.ends_with(b"\n");
        length += line.len() as u64;
        line.clear();
    }
    Ok(line_feed.then_some(length))
}

/// The lines of a text, one at a time.
pub struct Lines<'a> {
    reader: Box<dyn BufRead + 'a>,
    line: Vec<u8>,
    /// Number of the line that was read last, from 1.
    pub number: u64,
}

impl Lines<'_> {
    /// The next line without its end, and whether it had one. `None`: the text is over.
    pub fn read(&mut self) -> std::io::Result<Option<(&str, bool)>> {
        self.line.clear();
        if self.reader.read_until(b'\n', &mut self.line)? == 0 {
            return Ok(None);
        }
        self.number += 1;
        let line = std::str::from_utf8(&self.line).map_err(std::io::Error::other)?;
        let line = if self.number == 1 { line.trim_start_matches(MARK) } else { line };
        let ended = line.ends_with(['\n', '\r']);
        let line = line.strip_suffix('\n').unwrap_or(line);
        Ok(Some((line.strip_suffix('\r').unwrap_or(line), ended)))
    }
}

/// Lines over which a cell in quotes may go. Chosen by judgement; not studied.
const LONGEST: usize = 8;

/// The lines of a text; one that ends inside of quotes goes on in the next.
pub struct Joined<'a> {
    lines: Lines<'a>,
    line: String,
    /// Number of the line that was read last: the one on which it begins.
    pub number: u64,
    /// It has its end.
    pub ended: bool,
}

impl<'a> Joined<'a> {
    /// From the first line on.
    pub fn of(text: &'a Text) -> std::io::Result<Self> {
        Ok(Self { lines: text.lines()?, line: String::new(), number: 0, ended: true })
    }

    /// The next line. `None`: the text is over.
    pub fn next(&mut self) -> std::io::Result<Option<&str>> {
        let Some((line, ended)) = self.lines.read()? else { return Ok(None) };
        self.line.clear();
        self.line.push_str(line);
        (self.number, self.ended) = (self.lines.number, ended);
        for _ in 0..LONGEST {
            if !is_open(&self.line) {
                break;
            }
            let Some((more, ended)) = self.lines.read()? else { break };
            self.line.push('\n');
            self.line.push_str(more);
            self.ended = ended;
        }
        Ok(Some(&self.line))
    }
}

/// A quote opens a cell and nothing closes it.
fn is_open(line: &str) -> bool {
    line.contains('"')
        && line.matches('"').count() % 2 == 1
        && (line.trim_start().starts_with('"')
            || [",\"", ";\"", "\t\""].iter().any(|open| line.contains(open)))
}
