//! A self-contained HTML page: what it needs is in it, and its policy forbids the browser to load anything. A [`Document`] is a list of
//! parts. Without its scripts a page says the same: they turn pictures into charts that can be zoomed and read.

use super::{Exporter, chapters, format};
use crate::report::section::Section;
use anyhow::Result;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use truing_core::outcome::Outcome;

const STYLE_SHEETS: [&str; 2] = [include_str!("uplot/uPlot.min.css"), include_str!("style.css")];
/// The charts: the library with its licence, and what makes a chart of a plot's data.
const SCRIPTS: [&str; 5] = [
    "/*\n",
    include_str!("uplot/LICENSE"),
    "*/\n",
    include_str!("uplot/uPlot.iife.min.js"),
    include_str!("charts.js"),
];
/// Nothing is loaded, nothing is sent.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// One part of a document.
#[derive(Clone, Debug)]
enum Part {
    Gap { title: String, text: Vec<String>, outcome: Box<Outcome> },
    Section(Section),
}

/// A report of several parts.
#[derive(Clone, Debug, Default)]
pub struct Document {
    title: String,
    subtitle: String,
    command: Option<String>,
    parts: Vec<Part>,
}

impl Document {
    /// An empty document.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>) -> Self {
        Document { title: title.into(), subtitle: subtitle.into(), ..Document::default() }
    }

    /// Names the command line that wrote the page.
    pub fn by(self, command: impl Into<String>) -> Self {
        Document { command: Some(command.into()), ..self }
    }

    /// Adds the result of the gap workflow with paragraphs in front.
    pub fn gap(mut self, title: impl Into<String>, text: &[&str], outcome: &Outcome) -> Self {
        let text = text.iter().map(|t| t.to_string()).collect();
        self.parts.push(Part::Gap { title: title.into(), text, outcome: Box::new(outcome.clone()) });
        self
    }

    /// Adds plots, tables and checks.
    pub fn section(mut self, section: Section) -> Self {
        self.parts.push(Part::Section(section));
        self
    }

    /// The page.
    pub fn render(&self) -> String {
        let several = self.parts.len() > 1;
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.title) }
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    style { (PreEscaped(STYLE_SHEETS.concat())) }
                }
                body {
                    header {
                        h1 { (self.title) }
                        p.subtitle { (self.subtitle) }
                        @if let Some(command) = &self.command { p.command { code { (command) } } }
                    }
                    @if several { (self.contents()) }
                    main { @for (k, part) in self.parts.iter().enumerate() { (self.part(k, part, several)) } }
                    footer { "Written by truing " (env!("CARGO_PKG_VERSION")) "." }
                    script { (PreEscaped(SCRIPTS.concat())) }
                }
            }
        };
        page.into_string()
    }

    /// Writes the page; an earlier file stays until it is complete.
    #[cfg(feature = "console")]
    pub fn write(&self, path: &std::path::Path) -> Result<()> {
        super::write_atomically(path, &self.render())
    }

    fn contents(&self) -> Markup {
        html! {
            nav { ol { @for (k, part) in self.parts.iter().enumerate() {
                li { a href=(format!("#part-{}", k + 1)) { (part.title()) } }
            } } }
        }
    }

    fn part(&self, k: usize, part: &Part, numbered: bool) -> Markup {
        html! {
            section id=(format!("part-{}", k + 1)) {
                @if numbered { h2 { span.number { (k + 1) } (part.title()) } } @else { h2.unseen { "Result" } }
                @match part {
                    Part::Gap { text, outcome, .. } => { (chapters::paragraphs(text)) (chapters::gap(outcome)) }
                    Part::Section(section) => (chapters::section(section)),
                }
            }
        }
    }
}

impl Part {
    fn title(&self) -> &str {
        match self {
            Part::Gap { title, .. } => title,
            Part::Section(section) => &section.title,
        }
    }
}

/// Exports one outcome as a document of one part, with the verdict as its title.
pub struct Html<'a> {
    /// What was asked: model and log.
    pub subtitle: &'a str,
    /// The command line that wrote the page.
    pub command: &'a str,
}

impl Exporter for Html<'_> {
    fn export(&self, outcome: &Outcome) -> Result<String> {
        let title = format::title(outcome);
        Ok(Document::new(&title, self.subtitle).by(self.command).gap(&title, &[], outcome).render())
    }
}
