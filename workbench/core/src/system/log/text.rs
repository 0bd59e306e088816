//! One line of a text: its cells, and what a cell holds.

use super::clock::Form;

/// What may part the cells, in the order in which they win a draw.
pub const SEPARATORS: [(char, &str); 5] =
    [(',', "commas"), (';', "semicolons"), ('\t', "tabs"), ('|', "strokes"), (' ', "blanks")];
/// What stands at the beginning of a line that is a comment, or the rule of a table between strokes.
const COMMENTS: [&str; 7] = ["#", "%", "//", "|-", "| -", "|:", "+-"];
/// What may stand between thousands.
const GROUPS: [char; 7] = ['.', ',', '\'', '’', ' ', '\u{a0}', '\u{202f}'];

/// The number in a cell.
pub fn number(cell: &str) -> Option<f64> {
    match cell.strip_prefix(['−', '–']) {
        Some(rest) => rest.parse::<f64>().ok().map(|value| -value),
        None => cell.parse().ok(),
    }
}

/// A number with signs between its thousands, without them and with a decimal point: `1.011,2`.
pub fn ungrouped(cell: &str, decimal: char) -> Option<String> {
    let (whole, rest) = cell.split_once(decimal).unwrap_or((cell, "0"));
    let group = whole.chars().find(|c| GROUPS.contains(c) && *c != decimal)?;
    let mut parts = whole.split(group);
    let first = parts.next()?.trim_start_matches(['-', '+', '−']);
    let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    let grouped = (1..=3).contains(&first.len())
        && digits(first)
        && digits(rest)
        && parts.all(|part| part.len() == 3 && digits(part));
    grouped.then(|| format!("{}.{rest}", whole.replace(group, "")))
}

/// A cell that holds nothing, in the words of loggers and spreadsheets.
pub fn missing(cell: &str) -> bool {
    const NOTHING: [&str; 11] =
        ["", "nan", "-nan", "nan(ind)", "-nan(ind)", "na", "n/a", "#n/a", "null", "none", "-"];
    NOTHING.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// A number with a decimal point.
pub fn has_point(cell: &str) -> bool {
    cell.contains('.') && number(cell).is_some()
}

/// A number with a decimal comma.
pub fn has_decimal_comma(cell: &str) -> bool {
    let Some(comma) = cell.rfind(',') else { return false };
    match cell.contains('.') {
        true => comma > cell.rfind('.').unwrap_or(0) && ungrouped(cell, ',').is_some(),
        false => number(&cell.replacen(',', ".", 1)).is_some(),
    }
}

/// Anything that is read as a number: a time of day, too.
pub fn is_value(cell: &str) -> bool {
    number(cell).is_some()
        || has_decimal_comma(cell)
        || ungrouped(cell, '.').is_some()
        || cell.starts_with(|c: char| c.is_ascii_digit() || "+-−".contains(c)) && Form::of(cell).is_some()
}

/// The text of a line that holds no cells.
pub fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    COMMENTS.iter().find_map(|mark| line.strip_prefix(mark)).map(str::trim)
}

/// The cells of one line. Blanks part them wherever they stand, other separators outside of quotes.
pub fn split(line: &str, separator: char) -> Vec<&str> {
    let mut quoted = false;
    let mut parts = |c: char| {
        quoted ^= c == '"';
        !quoted && if separator == ' ' { c.is_whitespace() } else { c == separator }
    };
    // Tables between strokes have them at both ends, too.
    let line = if separator == '|' { line.trim().trim_matches('|') } else { line };
    let cells = line.split(&mut parts).map(bare_outside);
    match separator == ' ' {
        true => cells.filter(|cell| !cell.is_empty()).collect(),
        false => cells.collect(),
    }
}

/// A cell without the blanks and the quotes around it.
fn bare_outside(cell: &str) -> &str {
    let cell = cell.trim();
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).map_or(cell, str::trim)
}

/// The cells of a header that blanks part: names may hold single blanks where two blanks part them, and `[s]` or `(rpm)` belongs
/// to the name before it.
pub fn names_between_blanks(line: &str, width: usize) -> Vec<String> {
    let names: Vec<String> =
        line.split("  ").map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect();
    if names.len() == width {
        return names;
    }
    let mut names: Vec<String> = Vec::new();
    for cell in split(line, ' ') {
        match names.last_mut().filter(|_| cell.starts_with(['[', '('])) {
            Some(name) => *name += &format!(" {cell}"),
            None => names.push(cell.to_owned()),
        }
    }
    names
}

/// Values behind their names, as a serial monitor shows them: `pwm: 120, rpm: 33.2`, `u=3 w=5`, or a line of JSON. `None`: it
/// is no such line.
pub fn labelled(line: &str) -> Option<Vec<(&str, &str)>> {
    let parted = line.contains([',', ';', '\t', '|']);
    let (mut rest, mut pairs) = (line.trim().trim_matches(['{', '}', '[', ']']), Vec::new());
    while let Some((key, behind)) = rest.split_once([':', '=']) {
        let key = key.rsplit([',', ';', '\t', '|']).next()?.trim();
        let key = if parted { key } else { key.rsplit(' ').next()? };
        let key = key.trim_matches(['"', '\'', '{', '>', ' ']);
        let value = behind.trim_start();
        let (value, after) =
            value.split_at(value.find([',', ';', '\t', '|', ' ', '}']).unwrap_or(value.len()));
        let value =
            value.trim_matches('"').trim_end_matches(|c: char| c.is_alphabetic() || "%°/".contains(c));
        if number(value).is_none() && !missing(value)
            || !key.starts_with(|c: char| c.is_alphabetic() || c == '_')
        {
            // A tag may stand before the first name: `motor: u=3`.
            rest = Some(behind).filter(|_| pairs.is_empty() && behind.contains([':', '=']))?;
            continue;
        }
        pairs.push((key, value));
        rest = after;
    }
    (!pairs.is_empty()).then_some(pairs)
}
