//! One line of a text: its cells, and what a cell holds.

/// What may part the cells, in the order in which they win a draw.
pub const SEPARATORS: [(char, &str); 4] =
    [(',', "commas"), (';', "semicolons"), ('\t', "tabs"), (' ', "blanks")];
/// What stands at the beginning of a line that is a comment.
pub const COMMENTS: [&str; 3] = ["#", "%", "//"];

/// The number in a cell.
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

/// A cell without quotes and blanks.
pub fn bare(cell: &str) -> &str {
    cell.trim_matches('"').trim()
}

/// A number with a decimal point.
pub fn has_point(cell: &str) -> bool {
    cell.contains('.') && number(cell).is_some()
}

/// A number with a decimal comma.
pub fn has_decimal_comma(cell: &str) -> bool {
    cell.contains(',') && !cell.contains('.') && number(&cell.replacen(',', ".", 1)).is_some()
}

/// A line that holds no cells.
pub fn is_comment(line: &str) -> bool {
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

/// A line with tabs between its cells. Names may hold single blanks where two blanks part them.
pub fn in_tabs(line: &str, width: usize) -> String {
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
