//! How the lines of a text are parted into cells: separator, decimal sign, comments.

use super::stream::Text;
use super::text::{SEPARATORS, bare, has_decimal_comma, has_point, in_tabs, is_comment, number, split};
use std::borrow::Cow;

/// Lines from which the separator is recognised.
const SAMPLE: usize = 200;

/// How the lines of a text are parted into cells.
pub struct Layout {
    /// What parts the cells.
    pub separator: char,
    /// True: `0,5` is a half.
    pub decimal_comma: bool,
    /// Lines of comment.
    pub comments: usize,
    /// The last one.
    pub last_comment: Option<String>,
    /// The last line has its end.
    pub ended: bool,
    /// A blank stands between a separator and a quote, somewhere.
    spaced: bool,
    /// Cells of the lines below the first one, where blanks part them.
    width: usize,
}

impl Layout {
    /// Looks through a text. `None`: it is empty.
    pub fn of(text: &Text) -> std::io::Result<Option<Self>> {
        let Some((mut layout, numbers)) = Self::of_beginning(text)? else { return Ok(None) };
        let spaced = format!("{} \"", layout.separator);
        let (mut lines, mut commas) = (text.lines()?, 0);
        while let Some((line, ended)) = lines.read()? {
            layout.ended = ended;
            layout.spaced |= line.contains('"') && line.contains(&spaced);
            if is_comment(line) {
                layout.comments += 1;
                layout.last_comment = Some(line.to_owned());
            } else if numbers && (layout.separator != ',' || line.contains('"')) && line.contains(',') {
                commas += cells(line, layout.separator).filter(|cell| has_decimal_comma(cell)).count();
            }
        }
        // Where both signs occur the rarer one is a mistake.
        layout.decimal_comma = commas > 0 && commas > points(text, layout.separator)?;
        Ok(Some(layout))
    }

    /// The separator under which most cells of the first lines are numbers, and whether any is.
    fn of_beginning(text: &Text) -> std::io::Result<Option<(Self, bool)>> {
        let (mut sample, mut first) = (Vec::new(), None);
        let mut lines = text.lines()?;
        while let Some((line, _)) = lines.read()?
            && sample.len() <= SAMPLE
        {
            if line.trim().is_empty() {
                continue;
            }
            first.get_or_insert_with(|| line.to_owned());
            if !is_comment(line) {
                sample.push(line.to_owned());
            }
        }
        let Some(header) = sample.first().or(first.as_ref()) else { return Ok(None) };
        let numbers = |separator: char| {
            let cells = sample.iter().take(SAMPLE).map(|line| split(line, separator));
            let cells = cells.filter(|cells| cells.len() > 1).flatten();
            cells.map(bare).filter(|cell| number(cell).is_some() || has_decimal_comma(cell)).count()
        };
        let scored = SEPARATORS.map(|(separator, _)| (numbers(separator), separator));
        let most = scored.into_iter().rev().max_by_key(|known| known.0).unwrap_or((0, ','));
        // No numbers: the separator that parts the header into most names.
        let parts = |known: &&(char, &str)| header.matches(known.0).count();
        let separator = match most.0 {
            0 => SEPARATORS[..3].iter().rev().max_by_key(parts).map_or(',', |known| known.0),
            _ => most.1,
        };
        // The last row may be cut, the first is the header.
        let width = sample.iter().skip(1).map(|line| split(line, ' ').len()).min().unwrap_or(0);
        let layout = Self {
            separator,
            decimal_comma: false,
            comments: 0,
            last_comment: None,
            ended: false,
            spaced: false,
            width,
        };
        Ok(Some((layout, most.0 > 0)))
    }

    /// What parts the cells of [`Self::rewritten`].
    pub fn delimiter(&self) -> u8 {
        if self.separator == ' ' { b'\t' } else { self.separator as u8 }
    }

    /// A line as a reader of CSV understands it: blanks between cells become tabs, and a quote opens a cell only where it is the
    /// first letter.
    pub fn rewritten<'a>(&self, line: &'a str) -> Cow<'a, str> {
        match self.separator {
            ' ' => in_tabs(line, self.width).into(),
            separator if self.spaced => split(line, separator).join(&separator.to_string()).into(),
            // Somebody's line ends with a carriage return alone.
            _ if line.contains('\r') => line.replace('\r', "\n").into(),
            _ => line.into(),
        }
    }
}

/// Numbers with decimal points, the comments apart.
fn points(text: &Text, separator: char) -> std::io::Result<usize> {
    let (mut lines, mut points) = (text.lines()?, 0);
    while let Some((line, _)) = lines.read()? {
        if line.contains('.') && !is_comment(line) {
            points += cells(line, separator).filter(|cell| has_point(cell)).count();
        }
    }
    Ok(points)
}

fn cells(line: &str, separator: char) -> impl Iterator<Item = &str> {
    split(line, separator).into_iter().map(bare)
}
