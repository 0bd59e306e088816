//! From the bytes of a file to rows of cells: encoding, comments, separator, decimal sign.

use crate::console::input_error::InputError;
use encoding_rs::{Encoding, UTF_8, UTF_16LE, WINDOWS_1252};
use std::borrow::Cow;

/// Lines from which the separator is recognised.
const SAMPLE: usize = 200;
/// What may part the cells, in the order in which they win a draw.
pub const SEPARATORS: [(char, &str); 4] =
    [(',', "commas"), (';', "semicolons"), ('\t', "tabs"), (' ', "blanks")];
/// What stands at the beginning of a line that is a comment.
pub const COMMENTS: [&str; 3] = ["#", "%", "//"];

/// The text of a file, and the name of its encoding.
pub fn decoded(source: &str, bytes: &[u8]) -> Result<(String, &'static str), InputError> {
    let no_text = || InputError::file(source, "is not a text file; export the log as CSV");
    if let Some((encoding, length)) = Encoding::for_bom(bytes) {
        let text = encoding.decode_without_bom_handling_and_without_replacement(&bytes[length..]);
        return Ok((text.ok_or_else(no_text)?.into_owned(), encoding.name()));
    }
    if bytes.len() > 3 && bytes[0] != 0 && bytes[1] == 0 && bytes[3] == 0 {
        let text = UTF_16LE.decode_without_bom_handling_and_without_replacement(bytes);
        return Ok((text.ok_or_else(no_text)?.into_owned(), UTF_16LE.name()));
    }
    if bytes.contains(&0) {
        return Err(no_text());
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok((text.to_owned(), UTF_8.name())),
        // Latin-1 is what remains. A binary file is full of control characters.
        Err(_) if bytes.iter().any(|byte| *byte < 0x20 && !b"\t\n\r\x0c".contains(byte)) => Err(no_text()),
        Err(_) => Ok((WINDOWS_1252.decode_without_bom_handling(bytes).0.into_owned(), "Windows-1252")),
    }
}

pub fn number(cell: &str) -> Option<f64> {
    match cell.strip_prefix(['−', '–']) {
        Some(rest) => rest.parse::<f64>().ok().map(|value| -value),
        None => cell.parse().ok(),
    }
}

/// A cell that holds nothing, in the words of loggers and spreadsheets.
pub fn missing(cell: &str) -> bool {
    const NOTHING: [&str; 11] =
        ["", "nan", "-nan", "nan(ind)", "-nan(ind)", "na", "n/a", "#n/a", "null", "none", "-"];
    NOTHING.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// Separator and decimal sign: the pair under which most cells of the first lines are numbers. `None`: the text is empty.
pub fn separator(text: &str) -> Option<(char, bool)> {
    let lines = text.lines().filter(|line| !line.trim().is_empty() && !is_comment(line));
    let lines: Vec<&str> = lines.take(SAMPLE).collect();
    let header = lines.first().or(text.lines().find(|line| !line.trim().is_empty()).as_ref()).copied()?;
    let numbers = |separator: char| {
        let cells = lines.iter().map(|line| split(line, separator)).filter(|cells| cells.len() > 1).flatten();
        cells.map(bare).filter(|cell| number(cell).is_some() || has_decimal_comma(cell)).count()
    };
    let scored = SEPARATORS.map(|(separator, _)| (numbers(separator), separator));
    let (most, separator) = scored.into_iter().rev().max_by_key(|known| known.0)?;
    if most > 0 {
        let lines = || text.lines().filter(|line| !is_comment(line));
        let cells =
            || lines().filter(|line| line.contains(',')).flat_map(|line| split(line, separator)).map(bare);
        let commas = cells().filter(|cell| has_decimal_comma(cell)).count();
        // Where both signs occur the rarer one is a mistake.
        let points = || {
            lines().flat_map(|line| split(line, separator)).map(bare).filter(|cell| has_point(cell)).count()
        };
        return Some((separator, commas > 0 && commas > points()));
    }
    // No numbers: the separator that parts the header into most names.
    let most = SEPARATORS[..3].iter().rev().max_by_key(|known| header.matches(known.0).count())?;
    Some((most.0, false))
}

fn bare(cell: &str) -> &str {
    cell.trim_matches('"').trim()
}

fn has_point(cell: &str) -> bool {
    cell.contains('.') && number(cell).is_some()
}

fn has_decimal_comma(cell: &str) -> bool {
    cell.contains(',') && !cell.contains('.') && number(&cell.replacen(',', ".", 1)).is_some()
}

fn is_comment(line: &str) -> bool {
    COMMENTS.iter().any(|mark| line.trim_start().starts_with(mark))
}

/// The cells of one line. Blanks part them wherever they stand, other separators outside of quotes.
pub fn split(line: &str, separator: char) -> Vec<&str> {
    let mut quoted = false;
    let mut parts = |c: char| {
        quoted ^= c == '"';
        !quoted && if separator == ' ' { c.is_whitespace() } else { c == separator }
    };
    let cells = line.split(&mut parts).map(str::trim);
    match separator == ' ' {
        true => cells.filter(|cell| !cell.is_empty()).collect(),
        false => cells.collect(),
    }
}

/// The text with comments emptied, so that lines keep their numbers, and the comments. Blanks between cells become tabs.
pub fn without_comments(text: &str, separator: char) -> (Cow<'_, str>, Vec<String>) {
    let comments: Vec<String> = text.lines().filter(|line| is_comment(line)).map(str::to_owned).collect();
    // A quote opens a cell only where it is the first letter.
    let spaced = text.contains(&format!("{separator} \""));
    if comments.is_empty() && separator != ' ' && !spaced {
        return (Cow::Borrowed(text), comments);
    }
    let tabled = || text.lines().filter(|line| !is_comment(line) && !line.trim().is_empty());
    // The last row may be cut, the first is the header.
    let width = tabled().skip(1).take(SAMPLE).map(|line| split(line, ' ').len()).min().unwrap_or(0);
    let mut plain = String::with_capacity(text.len());
    for line in text.lines() {
        match (is_comment(line), separator) {
            (true, _) => {}
            (false, ' ') => plain += &in_tabs(line, width),
            (false, _) if spaced => plain += &split(line, separator).join(&separator.to_string()),
            (false, _) => plain += line,
        }
        plain.push('\n');
    }
    if !text.ends_with('\n') {
        plain.pop();
    }
    (Cow::Owned(plain), comments)
}

/// A line with tabs between its cells. Names may hold single blanks where two blanks part them.
fn in_tabs(line: &str, width: usize) -> String {
    let cells = split(line, ' ');
    if cells.len() > width {
        let parted = line.split("  ").map(str::trim).filter(|name| !name.is_empty());
        let names: Vec<&str> = parted.collect();
        if names.len() == width {
            return names.join("\t");
        }
        let joined = with_units(&cells);
        if joined.len() == width {
            return joined.join("\t");
        }
    }
    cells.join("\t")
}

/// Cells of a header in which `[s]` or `(rpm)` belongs to the name before it.
fn with_units(cells: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for cell in cells {
        match names.last_mut().filter(|_| cell.starts_with(['[', '('])) {
            Some(name) => *name += &format!(" {cell}"),
            None => names.push((*cell).to_owned()),
        }
    }
    names
}

/// Line number and cells.
pub type Row = (u64, csv::StringRecord);

/// Every row that holds something.
pub fn records(source: &str, text: &str, separator: char) -> Result<Vec<Row>, InputError> {
    let delimiter = if separator == ' ' { b'\t' } else { separator as u8 };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut rows = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|error| InputError::file(source, error))?;
        if row.iter().any(|cell| !cell.is_empty()) {
            rows.push((row.position().map_or(0, csv::Position::line), row));
        }
    }
    Ok(rows)
}
