//! The result of the gap workflow as three chapters of a page: detection, characterisation, parameter extraction.

use super::{chart, format, plot};
use crate::report::section::{Check, Section, Table};
use maud::{Markup, PreEscaped, html};
use truing_core::outcome::{Experiment, NamedEffect, Outcome, Plot, Rival, Stage, Style, Verdict};

pub(super) fn gap(outcome: &Outcome) -> Markup {
    html! {
        (verdict(outcome))
        (faults(outcome))
        (figures(outcome, Stage::Overview))
        @if outcome.verdict != Verdict::Data { (detection(outcome)) }
        @if outcome.tested() { (characterisation(outcome)) (extraction(outcome)) }
        @if let Some(experiment) = &outcome.next_experiment { (next(experiment)) }
        (notes(outcome))
    }
}

fn verdict(outcome: &Outcome) -> Markup {
    let held = &outcome.holdout;
    let tested = outcome.tested();
    let class = format::verdict(outcome.verdict).replace(' ', "-");
    html! {
        div class=(format!("verdict {class}")) {
            p.word { (format::grade(outcome)) }
            p.headline { (format::headline(outcome)) }
            @for contradiction in &outcome.data_sheet { p.mend { (format::mended(contradiction)) } }
            @if tested {
                div.tiles {
                    (tile("gap as given", &format!("{} {}", format::gap(held.rmse_before), outcome.gap_unit)))
                    (tile("gap now", &format!("{} {}", format::gap(held.rmse_after), outcome.gap_unit)))
                    (tile("noise floor", &format!("{} {}", format::gap(held.noise_floor), outcome.gap_unit)))
                    (tile("fit, held out", &format!("{} → {}{}", format::fit(held.fit_percent_before), format::fit(held.fit_percent_after), format::allowed(held))))
                    @if let Some(position) = &outcome.position { (tile(format::POSITION, &format::position(position))) }
                    @if let Some(last) = &outcome.final_records {
                        (tile("fit, records that chose nothing", &format!("{} → {}", format::fit(last.fit_percent_before), format::fit(last.fit_percent_after))))
                    }
                }
            }
        }
    }
}

fn faults(outcome: &Outcome) -> Markup {
    html! {
        @for fault in &outcome.data {
            article {
                h3 { (fault.place) }
                p { (format::fault(fault)) }
                p { "Mend: " code { (fault.remedy) } }
            }
        }
        @if !outcome.data.is_empty() {
            p.muted { "If the files are right all the same, " code { "--accept-data" } " goes on with them." }
        }
    }
}

fn tile(label: &str, figure: &str) -> Markup {
    html! { div.tile { span.label { (label) } span.figure { (figure) } } }
}

fn detection(outcome: &Outcome) -> Markup {
    html! {
        article {
            h3 { "Detection" span.question { "Do simulation and data disagree, and where?" } }
            @for effect in &outcome.effects { @if let Some(place) = &effect.place {
                p { code.name { (effect.name) } " acts " (place) "." }
            } }
            @if !outcome.places.is_empty() {
                table.bars {
                    thead { tr { th { "Where the model as given misses" } th.number { "Share of the squared error" } td {} } }
                    tbody { @for place in &outcome.places { tr {
                        td {
                            (place.region)
                            @if !place.also.is_empty() { p.muted { "nearly the same rows: " (place.also.join("; ")) } }
                        }
                        td.number { (format::percent(place.share_of_squared_error)) }
                        td.bar { (share_bar(place.share_of_squared_error)) }
                    } } }
                }
            }
            (figures(outcome, Stage::Detection))
            (steps(outcome))
        }
    }
}

fn steps(outcome: &Outcome) -> Markup {
    let held = &outcome.holdout;
    let bars = outcome.steps.iter().map(|step| (step.label.as_str(), step.gap));
    let bars: Vec<(&str, f64)> = bars.chain([("noise floor", held.noise_floor)]).collect();
    let largest = bars.iter().map(|bar| bar.1).filter(|gap| gap.is_finite()).fold(0.0, f64::max);
    html! {
        @if !outcome.steps.is_empty() && largest > 0.0 {
            figure {
                div.steps { @for (label, gap) in bars {
                    span { (label) } b { (format::gap(gap)) " " (outcome.gap_unit) } (share_bar(gap / largest))
                } }
                figcaption {
                    strong { "Gap per step. " }
                    "Rms of " code { (held.signal) } " on data that were not fitted, after each added effect."
                }
            }
        }
    }
}

fn share_bar(share: f64) -> Markup {
    let width = format!("width:{:.1}%", 100.0 * share.clamp(0.0, 1.0));
    html! { div.track { div.fill style=(width) {} } }
}

fn characterisation(outcome: &Outcome) -> Markup {
    html! {
        article {
            h3 { "Characterisation" span.question { "What is it?" } }
            @if outcome.effects.is_empty() { p { "No effect is named." } }
            ol.effects { @for effect in &outcome.effects { li { (effect_named(effect)) } } }
            (ties(outcome))
            (figures(outcome, Stage::Characterisation))
            (rivals(&outcome.rivals, &outcome.gap_unit))
        }
    }
}

fn effect_named(effect: &NamedEffect) -> Markup {
    html! {
        code.name { (effect.name) }
        @if let Some(tie) = effect.tie { " " span.tag { "tie " (tie + 1) } }
        " " (effect.evidence)
    }
}

fn ties(outcome: &Outcome) -> Markup {
    html! {
        @if !outcome.ties.is_empty() {
            h4 { "Ties: names that these data cannot tell apart" }
            ol.ties { @for tie in &outcome.ties { li {
                @for (k, rival) in tie.rivals.iter().enumerate() {
                    @if k > 0 { span.or { "or" } }
                    code.name { (format::set(rival)) }
                }
                p.muted { "Told apart: " (tie.separated_by) }
            } } }
        }
    }
}

fn rivals(rivals: &[Rival], unit: &str) -> Markup {
    html! {
        @if !rivals.is_empty() {
            details {
                summary { "Considered and rejected: " (rivals.len()) }
                table {
                    thead { tr { th { "Explanation" } th.number { "Gap with it" } th { "Why it lost" } } }
                    tbody { @for rival in rivals { tr {
                        td { code { (format::set(&rival.names)) } }
                        td.number { (format::gap(rival.gap)) " " (unit) }
                        td { (rival.reason) }
                    } } }
                }
            }
        }
    }
}

fn extraction(outcome: &Outcome) -> Markup {
    html! {
        article {
            h3 { "Parameter extraction" span.question { "How large is it, and what does it explain?" } }
            (parameters(outcome))
            (tolerances(outcome))
            (figures(outcome, Stage::Extraction))
            (left(outcome))
        }
    }
}

fn parameters(outcome: &Outcome) -> Markup {
    html! {
        @if !outcome.effects.is_empty() {
            table {
                thead { tr { th { "Effect" } th { "Parameter" } th.number { "Value ± one standard deviation" } } }
                tbody { @for effect in &outcome.effects {
                    @for (name, v) in format::readable(effect) { tr {
                        td { code { (effect.name) } } td { code { (name) } } td.number { (format::value(v)) }
                    } }
                    @for (name, v) in format::following(effect) { tr.derived {
                        td {} td { code { (name) } " (follows)" } td.number { (format::value(v)) }
                    } }
                } }
            }
        }
    }
}

fn tolerances(outcome: &Outcome) -> Markup {
    html! {
        @if !outcome.within_tolerance.is_empty() {
            @if outcome.within_tolerance.iter().any(|shift| shift.refitted) {
                h4 { "Base parameters, refitted: the model was fitted to the log without the effects" }
            } @else {
                h4 { "Base parameters that moved within their tolerance" }
            }
            table {
                thead { tr { th { "Parameter" } th.number { "Shift ± one standard deviation" } } }
                tbody { @for s in &outcome.within_tolerance { tr {
                    td { code { (s.parameter) } }
                    td.number { (format::shift(s)) }
                } } }
            }
        }
    }
}

fn left(outcome: &Outcome) -> Markup {
    let rest = &outcome.unexplained;
    html! {
        h4 { "What remains" }
        @if !rest.is_left() {
            p { "No structure is left in the residual (" (format::percent(rest.share_of_gap)) " of the squared gap)." }
        } @else {
            p { (format::percent(rest.share_of_gap)) " of the squared gap: " (rest.structure) "." }
        }
        @if !outcome.small.is_empty() {
            p.muted { "Small, not added to the model: " (format::small(outcome)) "." }
        }
        @if let Some(term) = &rest.unnamed {
            p { (format::unnamed(term, &outcome.gap_unit)) "." }
        }
        @if !outcome.closest_known.is_empty() {
            p.muted { "Closest known effects, not names: " (outcome.closest_known.join(", ")) "." }
        }
    }
}

fn next(experiment: &Experiment) -> Markup {
    let (times, pieces) = format::profile(experiment);
    html! {
        article.next {
            h3 { "Next experiment" }
            p { (experiment.why) }
            @if let Some(needs) = format::needs(experiment) { p { (needs) } }
            @if times > 1 { p { (times) " times:" } }
            @if !pieces.is_empty() {
                table {
                    thead { tr { th.number { "Step" } th { "Apply" } } }
                    tbody { @for (k, piece) in pieces.iter().enumerate() { tr {
                        td.number { (k + 1) } td { (piece) }
                    } } }
                }
            }
        }
    }
}

fn notes(outcome: &Outcome) -> Markup {
    html! {
        @if !outcome.notes.is_empty() {
            article { h3 { "Notes" } ul { @for note in &outcome.notes { li { (note) } } } }
        }
    }
}

pub(super) fn section(section: &Section) -> Markup {
    html! {
        (paragraphs(&section.text))
        @for plot in &section.plots { (picture(plot)) }
        @for table in &section.tables { (plain_table(table)) }
        (checks(&section.checks))
    }
}

pub(super) fn paragraphs(text: &[String]) -> Markup {
    html! { @for paragraph in text { p { (paragraph) } } }
}

fn plain_table(table: &Table) -> Markup {
    html! {
        h4 { (table.caption) }
        table.plain {
            thead { tr { @for head in &table.header { th { (head) } } } }
            // A telephone shows a row as a list, each value behind its head.
            tbody { @for row in &table.rows { tr {
                @for (cell, head) in row.iter().zip(&table.header) { td data-head=(head) { (cell) } }
            } } }
        }
    }
}

fn checks(checks: &[Check]) -> Markup {
    html! {
        @if !checks.is_empty() {
            table.checks {
                thead { tr { th { "Claim" } th { "Found" } td {} } }
                tbody { @for check in checks { tr {
                    td { (check.claim) } td { (check.found) }
                    td { @if check.holds { span.yes { "holds" } } @else { span.no { "does not hold" } } }
                } } }
            }
        }
    }
}

fn figures(outcome: &Outcome, stage: Stage) -> Markup {
    html! { @for plot in outcome.plots.iter().filter(|p| p.stage == stage) { (picture(plot)) } }
}

/// A picture, with the data from which a script makes a chart of it.
fn picture(plot: &Plot) -> Markup {
    html! {
        @if let Some((picture, data)) = plot::svg(plot).zip(chart::data(plot)) {
            figure {
                (legend(plot))
                div.picture { (PreEscaped(picture)) }
                script type="application/json" { (PreEscaped(data)) }
                figcaption { strong { (plot.title) ". " } (plot.caption) }
            }
        }
    }
}

fn legend(plot: &Plot) -> Markup {
    html! {
        div.legend {
            @for (k, series) in plot.series.iter().enumerate().filter(|(_, s)| !s.label.is_empty()) {
                span.series { (swatch(series.style, plot::INKS[plot::ink(series, k)])) (series.label) }
            }
            @if plot.noise_band.is_some() { span { i.band {} "noise" } }
            @if !plot.held_out.is_empty() { span { i.held {} "held out" } }
        }
    }
}

fn swatch(style: Style, ink: &str) -> Markup {
    let css = match style {
        Style::Line => format!("border-top:3px solid var(--{ink})"),
        Style::Dashed => format!("border-top:3px dashed var(--{ink})"),
        Style::Points => format!("background:var(--{ink});width:8px;height:8px;border-radius:50%"),
        Style::Hollow => format!("border:1.5px solid var(--{ink});width:7px;height:7px;border-radius:50%"),
    };
    html! { i style=(css) {} }
}
