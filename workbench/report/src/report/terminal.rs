//! The summary for a terminal of 80 columns.

use super::{Exporter, format};
use crate::console::screen;
use anyhow::Result;
use dialoguer::console::style;
use truing_core::outcome::{Outcome, Verdict, Where};

/// Width of every line, characters.
pub const WIDTH: usize = 80;
/// A line is no shorter, however narrow the terminal is.
const NARROWEST: usize = 40;
/// Column at which the text beside a heading starts.
pub const INDENT: usize = 12;
/// Length of the longest bar, characters.
const BAR: usize = 26;

/// Text without a line beyond 80 columns; where the terminal has colours, headings and the verdict stand out.
pub struct Terminal;

impl Exporter for Terminal {
    fn export(&self, outcome: &Outcome) -> Result<String> {
        let mut text = String::new();
        verdict(&mut text, outcome);
        faults(&mut text, outcome);
        gap(&mut text, outcome);
        effects(&mut text, outcome);
        ties(&mut text, outcome);
        remaining_sections(&mut text, outcome);
        next(&mut text, outcome);
        blocks(&mut text, "\nNotes", &outcome.notes);
        Ok(text)
    }
}

fn verdict(text: &mut String, outcome: &Outcome) {
    let grade = style(format::grade(outcome)).bold();
    let grade = match outcome.verdict {
        Verdict::NothingMissing => grade.green(),
        Verdict::Named => grade.cyan(),
        _ => grade.yellow(),
    };
    block(text, "Verdict", &format!("{grade}. {}", format::headline(outcome)));
    blocks(text, "Data sheet", outcome.data_sheet.iter().take(3).map(format::mended));
    let told = outcome.effects.iter().filter_map(|effect| Some((&effect.name, effect.place.as_ref()?)));
    let told: Vec<String> = told.map(|(name, place)| format!("{name}: {place}")).collect();
    // A named effect says where it acts better than any region of the gap.
    let places = outcome.places.iter().take(3).map(missed).collect();
    blocks(text, "Where", if told.is_empty() { places } else { told });
}

/// A region of the gap and what of it lies there.
fn missed(place: &Where) -> String {
    let share = format::percent(place.share_of_squared_error);
    let also = match place.also.is_empty() {
        true => String::new(),
        false => format!("; nearly the same rows: {}", place.also.join("; ")),
    };
    format!("{share} of the squared error: {}{also}", place.region)
}

fn faults(text: &mut String, outcome: &Outcome) {
    for fault in &outcome.data {
        block(text, "\nData", &format::fault(fault));
        text.push_str(&to_type("Mend", &fault.remedy));
    }
    if !outcome.data.is_empty() {
        block(text, "", "If the files are right all the same: --accept-data.");
    }
}

fn gap(text: &mut String, outcome: &Outcome) {
    if !outcome.tested() {
        return;
    }
    let held = &outcome.holdout;
    let unit = &outcome.gap_unit;
    *text += &format!("\n{:INDENT$}rms of {} in {unit}, on data held out\n", "Gap", held.signal);
    let floor = held.noise_floor;
    let bars: Vec<(&str, f64)> = outcome.steps.iter().map(|s| (s.label.as_str(), s.gap)).collect();
    let finite = bars.iter().map(|b| b.1).chain([floor]).filter(|gap| gap.is_finite());
    let largest = finite.fold(0.0, f64::max);
    for (label, gap) in bars.into_iter().chain([("noise floor", floor)]) {
        let label = format::shortened(label, 28);
        *text += &format!("{:INDENT$}{label:28} {:>9}  {}\n", "", format::gap(gap), bar(gap, largest));
    }
    let (before, after) = (held.fit_percent_before, held.fit_percent_after);
    let named = outcome.unexplained.unnamed.as_ref().map(|term| {
        let with_names = 100.0 - (100.0 - before) * term.gap_before / held.rmse_before;
        let names = if outcome.effects.is_empty() { "the numbers moved" } else { "the names" };
        format!("{} with {names} → ", format::fit(with_names))
    });
    let term = if named.is_some() { " with the term that has no name" } else { "" };
    let named = named.unwrap_or_default();
    let allowed = format::allowed(held);
    let fits = format!("fit {} → {named}{}{term}{allowed}", format::fit(before), format::fit(after));
    block(text, "", &fits);
    if let Some(position) = &outcome.position {
        block(text, "", &format!("{}: {}", format::POSITION, format::position(position)));
    }
    if let Some(last) = &outcome.final_records {
        let (before, after) = (format::fit(last.fit_percent_before), format::fit(last.fit_percent_after));
        *text += &format!("{:INDENT$}records that chose nothing: fit {before} → {after}\n", "");
    }
}

/// A bar whose length is in proportion to the gap, to an eighth of a character.
fn bar(gap: f64, largest: f64) -> String {
    const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    if !gap.is_finite() || largest <= 0.0 {
        return String::new();
    }
    let longest = BAR.saturating_sub(WIDTH - width());
    let eighths = ((gap / largest * longest as f64 * 8.0).round() as usize).max(1);
    "█".repeat(eighths / 8) + EIGHTHS[eighths % 8]
}

fn effects(text: &mut String, outcome: &Outcome) {
    for (k, effect) in outcome.effects.iter().enumerate() {
        let tie = effect.tie.map_or(String::new(), |t| format!(" (tie {})", t + 1));
        let named = format!("{}. {}{tie}: {}", k + 1, effect.name, format::parameters(effect));
        entry(text, "\nEffects", k, &named);
        block(text, "", &effect.evidence);
    }
}

fn ties(text: &mut String, outcome: &Outcome) {
    for (k, tie) in outcome.ties.iter().enumerate() {
        entry(text, "\nTies", k, &format!("{}. {}", k + 1, format::rivals(tie)));
        block(text, "", &format!("told apart: {}", tie.separated_by));
    }
}

fn remaining_sections(text: &mut String, outcome: &Outcome) {
    let left = &outcome.unexplained;
    if format::deviates(outcome)
        || !outcome.within_tolerance.is_empty()
        || left.is_left()
        || !outcome.small.is_empty()
        || !outcome.closest_known.is_empty()
    {
        text.push('\n');
    }
    for (k, shift) in outcome.within_tolerance.iter().enumerate() {
        let head = if k == 0 { "Tolerances" } else { "" };
        let (name, by) = (&shift.parameter, format::shift(shift));
        match shift.refitted {
            true => block(text, head, &format!("refitted: {name} {by}")),
            false => block(text, head, &format!("{name} {by}: within what the model allows")),
        }
    }
    if format::deviates(outcome) {
        block(text, "", "(± is one standard deviation)");
    }
    if left.is_left() {
        let share = format::percent(left.share_of_gap);
        block(text, "Left", &format!("{share} of the gap (squared): {}", left.structure));
    }
    if !outcome.small.is_empty() {
        block(text, "Small", &format!("{}: not added to the model", format::small(outcome)));
    }
    if let Some(term) = &left.unnamed {
        block(text, "Unnamed", &format::unnamed(term, &outcome.gap_unit));
    }
    if !outcome.closest_known.is_empty() {
        block(text, "Closest", &format!("{} (not a name)", outcome.closest_known.join(", ")));
    }
}

fn next(text: &mut String, outcome: &Outcome) {
    let Some(experiment) = &outcome.next_experiment else {
        return;
    };
    block(text, "\nNext", &experiment.why);
    let (times, pieces) = format::profile(experiment);
    match (pieces.is_empty(), times) {
        (true, _) => {}
        (_, 1) => block(text, "", &pieces.join(", ")),
        (_, times) => block(text, "", &format!("{times} times: {}", pieces.join(", then "))),
    }
    if let Some(needs) = format::needs(experiment) {
        block(text, "", &needs);
    }
}

/// Several bodies under one heading, which stands beside the first.
pub fn blocks(text: &mut String, head: &str, bodies: impl IntoIterator<Item: AsRef<str>>) {
    bodies.into_iter().enumerate().for_each(|(k, body)| entry(text, head, k, body.as_ref()));
}

/// One of several bodies under a heading.
fn entry(text: &mut String, head: &str, place: usize, body: &str) {
    block(text, if place == 0 { head } else { "" }, body);
}

/// A heading in the margin and its text beside it, wrapped. A line feed before the heading is an empty line above it.
pub fn block(text: &mut String, head: &str, body: &str) {
    let (above, head) = head.split_at(head.len() - head.trim_start().len());
    *text += above;
    *text += &beside(&format!("{head:INDENT$}"), body);
}

/// The columns of the terminal, at most [`WIDTH`].
#[must_use]
pub fn width() -> usize {
    screen::size().map_or(WIDTH, |size| size.1.clamp(NARROWEST, WIDTH))
}

/// A text beside a heading in which what stands in quotes is never broken: it is to be typed.
fn to_type(head: &str, body: &str) -> String {
    let part =
        |(k, part): (usize, &str)| if k % 2 == 1 { part.replace(' ', "\u{a0}") } else { part.to_owned() };
    let kept = body.split('"').enumerate().map(part).collect::<Vec<String>>().join("\"");
    let kept = kept.replace("--columns ", "--columns\u{a0}");
    let (first, later) = (format!("{head:INDENT$}"), " ".repeat(INDENT));
    let options = textwrap::Options::new(width()).initial_indent(&first).subsequent_indent(&later);
    let options = options.break_words(false).word_separator(textwrap::WordSeparator::AsciiSpace);
    let options = options.word_splitter(textwrap::WordSplitter::NoHyphenation);
    textwrap::fill(&kept, options).replace('\u{a0}', " ") + "\n"
}

/// A text that starts behind `head` and goes on below its own start, wrapped at [`width`].
#[must_use]
pub fn beside(head: &str, body: &str) -> String {
    let later = " ".repeat(head.chars().count());
    let bold = style(head).bold().to_string();
    let options = textwrap::Options::new(width()).initial_indent(&bold).subsequent_indent(&later);
    textwrap::fill(body, options) + "\n"
}
