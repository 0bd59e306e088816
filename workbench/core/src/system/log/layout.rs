//! How a text is laid out: what parts its cells, which line holds the names of the columns, where the rows begin. All of it is
//! recognised from the first lines.

use super::clock::Form;
use super::dialect::Dialect;
use super::lists::Lists;
use super::stream::{Joined, Text};
use super::text::{
    SEPARATORS, comment, has_decimal_comma, has_point, is_value, labelled, names_between_blanks, split,
};
use super::topics::{Topics, is_head};
use super::words::unit;
use crate::text::input_error::InputError;
use std::borrow::Cow;

/// Lines from which the layout is recognised. Origin: the longest preambles of oscilloscopes have 60; the rest is
/// reserve.
const SAMPLE: usize = 400;
/// Share of the lines that must be alike for a form that not every line has. Chosen by judgement; not studied.
const MOST: f64 = 0.6;
/// Share of the lines from which on a name before a value is that of a column. Chosen by judgement; not studied.
const SOME: f64 = 0.1;
/// What the clock of a serial monitor is called.
const CLOCK: &str = "clock";

/// How the lines of a text are parted into cells.
#[derive(Default)]
pub struct Layout {
    /// What parts the cells.
    pub separator: char,
    /// A serial monitor has put its clock before each line: `14:07:58.120 -> `.
    stamped: bool,
    /// The names that stand before the values, line by line.
    labels: Vec<String>,
    /// Each line holds one value of one signal.
    topics: Option<Topics>,
    /// Cells hold several numbers.
    lists: Option<Lists>,
    /// Line of the first row.
    pub first: u64,
}

/// What stands above the numbers of a file.
#[derive(Default)]
pub struct Head {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Units below the names, where the file has such a row.
    pub units: Vec<Option<String>>,
    /// Line of the names.
    pub line: u64,
}

/// A line of the sample.
struct Line {
    number: u64,
    text: String,
    comment: bool,
}

/// The same, parted.
struct Row {
    line: u64,
    cells: Vec<String>,
    comment: bool,
}

/// Why a text is no table, by its first line.
fn no_table(first: Option<&Line>) -> Option<&'static str> {
    match first {
        None => Some("is empty; expected a header line such as t_s,u_v,theta_rad"),
        Some(line) if line.text.starts_with('<') => Some(
            "is a page for a browser (HTML or XML), not a table; download the file itself, or export it as CSV",
        ),
        Some(_) => None,
    }
}

impl Layout {
    /// Looks through the beginning of a text.
    pub fn of(file: &str, text: &Text, encoding: &'static str) -> Result<(Self, Head, Dialect), InputError> {
        let sample = sample(text).map_err(|error| InputError::file(file, error))?;
        if let Some(what) = no_table(sample.first()) {
            return Err(InputError::file(file, what));
        }
        let lines: Vec<&Line> = sample.iter().filter(|line| !line.comment).collect();
        let stamped = is_most(lines.iter().filter(|line| stamp(&line.text).is_some()).count(), lines.len());
        let mut layout = Self { stamped, separator: ',', ..Self::default() };
        let mut dialect = Dialect { encoding, separator: '\t', ..Dialect::default() };
        if let Some(head) = layout.by_labels(&lines) {
            dialect.labelled = true;
            layout.separator = '\t';
            return Ok((layout, head, dialect));
        }
        layout.separator = layout.separator_of(&lines);
        dialect.separator = layout.separator;
        let mut rows: Vec<Row> = sample.iter().map(|line| layout.row(line)).collect();
        layout.lists = Lists::of(rows.iter().map(|row| row.cells.as_slice()), layout.separator);
        if let Some(lists) = &layout.lists {
            for row in &mut rows {
                row.cells = lists.spread(row.cells.iter().map(String::as_str));
            }
            (layout.separator, dialect.lists) = ('\t', true);
        }
        if layout.separator == ' '
            && let Some(width) = rows.iter().find(|row| row.is_numeric()).map(Row::width)
        {
            for (row, line) in rows.iter_mut().zip(&sample).filter(|pair| pair.0.width() > width) {
                row.cells = names_between_blanks(&line.text, width);
            }
        }
        let mut head = layout.head(file, &rows, &mut dialect)?;
        dialect.decimal_comma =
            layout.decimal_comma(&rows, text).map_err(|error| InputError::file(file, error))?;
        let body = rows.iter().filter(|row| !row.comment && row.line >= layout.first);
        let body = body.map(|row| row.cells.as_slice());
        if let Some(topics) = Topics::of(&head.names, body, text, (layout.separator, layout.first)) {
            let names = topics.columns(&head.names);
            head = Head { units: vec![None; names.len()], names, line: head.line };
            (layout.topics, layout.separator, dialect.topics) = (Some(topics), '\t', true);
        }
        Ok((layout, head, dialect))
    }

    /// The names that stand before the values of most lines, if they do. Lines may hold some of them each.
    fn by_labels(&mut self, lines: &[&Line]) -> Option<Head> {
        let pairs =
            lines.iter().filter_map(|line| Some((line.number, labelled(self.behind_stamp(&line.text).1)?)));
        let all: Vec<_> = pairs.filter(|pairs| pairs.1.len() > 1 || self.stamped).collect();
        let mut counts: Vec<(&str, usize, u64)> = Vec::new();
        for (line, name) in all.iter().flat_map(|(line, pairs)| pairs.iter().map(move |pair| (*line, pair.0)))
        {
            match counts.iter_mut().find(|known| known.0 == name) {
                Some(known) => known.1 += 1,
                None => counts.push((name, 1, line)),
            }
        }
        counts.retain(|known| known.1 as f64 >= SOME * all.len() as f64);
        self.first = counts.iter().map(|known| known.2).min().filter(|_| is_most(all.len(), lines.len()))?;
        self.labels = counts.iter().map(|known| known.0.to_owned()).collect();
        let clock = self.stamped.then(|| CLOCK.to_owned());
        let names: Vec<String> = clock.into_iter().chain(self.labels.iter().cloned()).collect();
        Some(Head { units: vec![None; names.len()], names, line: self.first })
    }

    /// The separator under which most lines are nothing but numbers, then the one under which most cells are.
    fn separator_of(&self, lines: &[&Line]) -> char {
        let score = |(separator, _): &(char, &str)| {
            let parted = lines.iter().map(|line| split(self.behind_stamp(&line.text).1, *separator));
            parted.filter(|cells| cells.len() > 1).fold((0, 0), |(rows, numbers), cells| {
                let values = cells.iter().filter(|cell| is_value(cell)).count();
                let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
                (rows + usize::from(values == filled), numbers + values)
            })
        };
        let scored = SEPARATORS.map(|known| (score(&known), known.0));
        let best = scored.into_iter().rev().max_by_key(|known| known.0).unwrap_or(((0, 0), ','));
        // No numbers: the separator that parts the header into most names.
        let parts = |it: &&(char, &str)| lines.first().map_or(0, |line| line.text.matches(it.0).count());
        match best.0 {
            (0, 0) => SEPARATORS[..3].iter().rev().max_by_key(parts).map_or(',', |known| known.0),
            _ => best.1,
        }
    }

    fn row(&self, line: &Line) -> Row {
        let text = if line.comment { line.text.as_str().into() } else { self.rewritten(&line.text) };
        let cells = split(&text, self.separator).into_iter().map(str::to_owned).collect();
        Row { line: line.number, cells, comment: line.comment }
    }

    /// Finds names, units and the first row: the line above the longest table of as many cells.
    fn head(&mut self, source: &str, rows: &[Row], dialect: &mut Dialect) -> Result<Head, InputError> {
        let Some(first) = rows.iter().position(Row::is_numeric) else {
            let shown: String = rows[0].cells.join(" ").chars().take(60).collect();
            let what = match rows.len() {
                1 => "has a header but no rows of numbers; the log was not written".into(),
                _ => format!("holds no rows of numbers (it begins `{shown}`); export the log as CSV"),
            };
            return Err(InputError::file(source, what));
        };
        let candidates: Vec<(usize, usize)> =
            (0..rows.len()).filter_map(|at| first_below(rows, at).map(|first| (at, first))).collect();
        let score = |(at, first): &(usize, usize)| {
            let until = candidates
                .iter()
                .map(|other| other.0)
                .find(|other| other > first && rows[*other].cells != rows[*at].cells);
            let below = rows[*first..until.unwrap_or(rows.len())].iter().filter(|row| row.is_numeric());
            let fits = below.clone().filter(|row| row.fits(&rows[*at])).count();
            (fits, !rows[*at].comment, below.count())
        };
        let best = candidates.iter().rev().max_by_key(|known| score(known)).copied();
        let best = best.filter(|known| score(known).0 > 0 || !rows[known.0].comment);
        let best = candidates.iter().find(|known| is_head(&rows[known.0].cells)).copied().or(best);
        let Some((at, first)) = best else {
            self.first = rows[first].line;
            dialect.headless = true;
            let width = rows[first].width();
            let names: Vec<String> = (1..=width).map(|k| format!("c{k}")).collect();
            return Ok(Head { units: vec![None; width], names, line: self.first });
        };
        self.first = rows[first].line;
        let between = rows[at + 1..first].iter().find(|row| !row.comment);
        let mut names = rows[at].cells.clone();
        if names.len() > 1 && names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        (dialect.units, dialect.header_in_comment) = (between.is_some(), rows[at].comment);
        dialect.preamble = rows[..first].iter().filter(|row| !row.comment).count()
            - usize::from(!rows[at].comment)
            - usize::from(between.is_some());
        check_names(source, rows[at].line, &names)?;
        let unit = |k: usize| between?.cells.get(k).cloned().filter(|unit: &String| !unit.is_empty());
        Ok(Head { units: (0..names.len()).map(unit).collect(), names, line: rows[at].line })
    }

    /// Where both signs occur the rarer one is a mistake. Without either in the sample the rest of the text is asked.
    fn decimal_comma(&self, rows: &[Row], text: &Text) -> std::io::Result<bool> {
        let count = |cells: &mut dyn Iterator<Item = &str>| {
            cells.fold((0_usize, 0_usize), |(commas, points), cell| {
                (commas + usize::from(has_decimal_comma(cell)), points + usize::from(has_point(cell)))
            })
        };
        let numbers = rows.iter().filter(|row| row.is_numeric()).flat_map(|row| &row.cells);
        let (mut commas, mut points) = count(&mut numbers.map(String::as_str));
        let (mut lines, mut number) = (text.lines()?, 0);
        while commas + points == 0
            && let Some((line, _)) = lines.read()?
        {
            number += 1;
            let behind = number >= self.first && comment(line).is_none();
            (commas, points) = count(&mut split(line, self.separator).into_iter().filter(|_| behind));
        }
        Ok(commas > points)
    }

    /// A line as it is parted: the clock of a monitor as a cell of its own, values without their names. Empty: a line without
    /// them.
    pub fn rewritten<'a>(&self, line: &'a str) -> Cow<'a, str> {
        if let Some(topics) = &self.topics {
            return topics.row(line).into();
        }
        if let Some(lists) = &self.lists {
            return lists.row(line).into();
        }
        let (clock, rest) = self.behind_stamp(line);
        let rest: Cow<str> = match self.labels.is_empty() {
            true => rest.into(),
            false => {
                let pairs = labelled(rest).unwrap_or_default();
                let value = |name: &String| pairs.iter().find(|it| it.0 == name).map_or("", |it| it.1);
                let values: Vec<&str> = self.labels.iter().map(value).collect();
                if values.iter().all(|value| value.is_empty()) {
                    return "".into();
                }
                values.join("\t").into()
            }
        };
        match clock {
            Some(clock) => format!("{}{}{rest}", clock.replace(',', "."), self.separator).into(),
            None => rest,
        }
    }

    fn behind_stamp<'a>(&self, line: &'a str) -> (Option<&'a str>, &'a str) {
        let stamp = if self.stamped { stamp(line) } else { None };
        stamp.map_or((None, line), |(clock, rest)| (Some(clock), rest))
    }
}

fn is_most(some: usize, all: usize) -> bool {
    some > 1 && some as f64 >= MOST * all as f64
}

/// The clock of a serial monitor, and what stands behind it.
fn stamp(line: &str) -> Option<(&str, &str)> {
    let (clock, rest) =
        line.split_once("->").or_else(|| line.trim_start().strip_prefix('[')?.split_once(']'))?;
    matches!(Form::of(clock.trim()), Some(Form::Clock { .. })).then_some((clock.trim(), rest.trim_start()))
}

fn sample(text: &Text) -> std::io::Result<Vec<Line>> {
    let (mut sample, mut lines) = (Vec::new(), Joined::of(text)?);
    while sample.len() < SAMPLE
        && let Some(line) = lines.next()?
    {
        let note = comment(line);
        let text = note.unwrap_or(line).trim_matches([' ', '\r']).to_owned();
        if !line.trim().is_empty() {
            sample.push(Line { text, comment: note.is_some(), number: lines.number });
        }
    }
    Ok(sample)
}

impl Row {
    /// Cells, without empty ones at the end.
    fn width(&self) -> usize {
        self.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1)
    }

    fn fits(&self, header: &Self) -> bool {
        let (all, own) = (header.cells.len(), self.cells.len());
        own == all || own == header.width() || self.width() == header.width()
    }

    fn is_numeric(&self) -> bool {
        let filled = self.cells.iter().filter(|cell| !cell.is_empty()).count();
        let numbers = self.cells.iter().filter(|cell| is_value(cell)).count();
        !self.comment && numbers > 0 && 2 * numbers >= filled
    }

    /// Cells that are units, at least half of them known.
    fn is_units(&self) -> bool {
        let filled = self.cells.iter().filter(|cell| !cell.is_empty()).count();
        let known = self.cells.iter().filter(|cell| unit(cell).is_some()).count();
        known > 0 && 2 * known >= filled
    }
}

/// The first row of numbers below a line that may hold the names of its columns; a row of units may stand between.
fn first_below(rows: &[Row], at: usize) -> Option<usize> {
    let next = |from: usize| (from + 1..rows.len()).find(|k| !rows[*k].comment);
    let header = &rows[at];
    let first = next(at)?;
    if header.comment {
        let is_last = !rows[at + 1..first].iter().any(|row| row.fits(header));
        let names = header.cells.len() > 1 && !header.cells.iter().any(|cell| is_value(cell));
        return (is_last && names && rows[first].is_numeric() && rows[first].fits(header)).then_some(first);
    }
    let units = !rows[first].is_numeric() && rows[first].is_units() && header.cells.len() > 1;
    // Channels may be numbered, above their units.
    if header.is_numeric() && !units {
        return None;
    }
    let first = if units { next(first)? } else { first };
    rows[first].is_numeric().then_some(first)
}

fn check_names(source: &str, line: u64, names: &[String]) -> Result<(), InputError> {
    let twice = |k: &usize| !names[*k].is_empty() && names[..*k].contains(&names[*k]);
    let what = match (0..names.len()).find(twice) {
        Some(k) => format!("two columns are named `{}`; rename one", names[k]),
        None if names.iter().all(String::is_empty) => {
            "the header has no names; expected a header line such as t_s,u_v,theta_rad".into()
        }
        None => return Ok(()),
    };
    Err(InputError::line(source, line, what))
}
