//! Scores of the gap workflow on hidden cases: one line a case, kept as JSON, and the table made from the lines.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use truing::system::effects::{COULOMB_FRICTION, DRIVE_GAIN, ENCODER_SCALE, STRIBECK_FRICTION};

/// What the analysis of one case came to, against the answer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Line {
    /// Set.
    pub set: String,
    /// Seed within the set.
    pub seed: u32,
    /// Hidden effects with their visibility in σ.
    pub hidden: Vec<(String, f64)>,
    /// Kind outside the library.
    pub outside: Option<String>,
    /// Whether the current was logged.
    pub current: bool,
    /// Coloured noise with spikes, every input twice.
    pub dirty: bool,
    /// Verdict.
    pub verdict: String,
    /// How sure it is.
    #[serde(default)]
    pub grade: String,
    /// Accepted names.
    pub named: Vec<String>,
    /// Rival sets of the ties.
    pub rivals: Vec<Vec<String>>,
    /// Names offered as closest only.
    pub closest: Vec<String>,
    /// Structure of what is left.
    pub structure: String,
    /// Rms of given model minus noise-free truth on the hold-out, in noise rms.
    pub before: Option<f64>,
    /// … of the extended model.
    pub after: Option<f64>,
    /// Per parameter of a rightly named effect whose form is in the library: name, (estimate − truth)/std.
    pub deviations: Vec<(String, f64)>,
    /// Per base parameter, where all names are right: (shift − true shift)/std.
    #[serde(default)]
    pub shifts: Vec<(String, f64)>,
    /// Wall time, s.
    pub runtime_s: f64,
    /// CPU time of the analysis, s: what a loaded machine leaves of the run time.
    pub cpu_s: Option<f64>,
}

/// Names that steady or short data cannot part, counted as one.
pub fn group(name: &str) -> &str {
    let groups = [
        ([&DRIVE_GAIN, &ENCODER_SCALE], "drive_gain|encoder_scale"),
        ([&COULOMB_FRICTION, &STRIBECK_FRICTION], "coulomb|stribeck"),
    ];
    let own = groups.iter().find(|(effects, _)| effects.iter().any(|effect| effect.name == name));
    own.map_or(name, |(_, group)| group)
}

impl Line {
    /// Every hidden effect changes the speed by more than 0.3 σ rms.
    pub fn visible(&self) -> bool {
        self.hidden.iter().all(|hidden| hidden.1 > 0.3)
    }

    fn truth(&self) -> BTreeSet<&str> {
        self.hidden.iter().map(|hidden| group(&hidden.0)).collect()
    }

    fn answer(&self) -> BTreeSet<&str> {
        self.named.iter().map(|name| group(name)).collect()
    }

    /// The named set is the hidden set, groups counted as one.
    pub fn right(&self) -> bool {
        self.truth() == self.answer()
    }

    /// … name by name.
    pub fn exact(&self) -> bool {
        let truth: BTreeSet<&str> = self.hidden.iter().map(|hidden| hidden.0.as_str()).collect();
        truth == self.named.iter().map(String::as_str).collect()
    }

    /// The hidden effects are named, or stand in one of the rival sets.
    pub fn among_rivals(&self) -> bool {
        let tied = |name: &str| self.rivals.iter().flatten().any(|rival| group(rival) == name);
        self.truth().iter().all(|name| self.answer().contains(name) || tied(name))
    }

    /// All hidden effects are among the names (others may be too).
    pub fn complete(&self) -> bool {
        self.truth().is_subset(&self.answer())
    }

    /// Names given, and how many of them are hidden.
    pub fn precision(&self) -> (usize, usize) {
        let truth = self.truth();
        (self.named.len(), self.named.iter().filter(|name| truth.contains(group(name))).count())
    }

    fn unexplained(&self) -> bool {
        self.verdict == "unexplained"
    }

    /// Coloured noise without a repeat may be called noise-like; nothing else may.
    fn falsely_unexplained(&self) -> bool {
        self.unexplained() && !self.structure.contains("noise-like")
    }
}

/// A share with its 95 % interval (Wilson 1927).
pub fn share(hits: usize, of: usize) -> String {
    if of == 0 {
        return "–".to_owned();
    }
    let (n, p, z) = (of as f64, hits as f64 / of as f64, 1.96_f64);
    let centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    let percent = |x: f64| 100.0 * x.clamp(0.0, 1.0);
    format!("{:.1} % [{:.1}, {:.1}] ({hits}/{of})", 100.0 * p, percent(centre - half), percent(centre + half))
}

/// A quantile of what is not empty.
pub fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(((sorted.len().max(1) - 1) as f64 * q).round() as usize).copied().unwrap_or(f64::NAN)
}

/// The whole report in Markdown.
pub fn report(lines: &[Line]) -> String {
    let mut text = String::from("| figure | measured [95 % interval] | to reach |\n|---|---|---|\n");
    for (name, measured, aim) in figures(lines) {
        let _ = writeln!(text, "| {name} | {measured} | {aim} |");
    }
    let _ =
        write!(text, "\n{}\n{}\n{}\n{}", by_grade(lines), by_kind(lines), coverage(lines), outsiders(lines));
    text
}

fn figures(lines: &[Line]) -> Vec<(&'static str, String, &'static str)> {
    let of = |set: &str| lines.iter().filter(|line| line.set == set).collect::<Vec<&Line>>();
    let visible = |set: &str| of(set).into_iter().filter(|line| line.visible()).collect::<Vec<&Line>>();
    let count = |lines: &[&Line], test: fn(&Line) -> bool| {
        share(lines.iter().filter(|l| test(l)).count(), lines.len())
    };
    let (single, pair, triple) = (visible("single"), visible("pair"), visible("triple"));
    let with_current: Vec<&Line> = single.iter().copied().filter(|line| line.current).collect();
    let (nothing, outside) = (of("nothing"), of("outside"));
    let inside: Vec<&Line> = [of("nothing"), of("single"), of("pair"), of("triple")].concat();
    let precision = inside.iter().map(|line| line.precision()).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let misnamed = |line: &Line| !line.unexplained() && !line.named.is_empty();
    vec![
        ("single, visible > 0.3 σ: right name", count(&single, Line::right), "≥ 97 %"),
        ("… truth named or among the rivals", count(&single, Line::among_rivals), "≥ 99.5 %"),
        ("… current logged: exact name", count(&with_current, Line::exact), "≥ 98 %"),
        ("two effects: both named, nothing else", count(&pair, Line::right), "≥ 93 %"),
        ("… both among the names", count(&pair, Line::complete), ""),
        ("three effects: all named, nothing else", count(&triple, Line::right), "≥ 80 %"),
        ("… all among the names", count(&triple, Line::complete), ""),
        ("names given that are right", share(precision.1, precision.0), "≥ 99 %"),
        ("nothing missing: a name", count(&nothing, |line| !line.named.is_empty()), "≤ 1 %"),
        ("nothing missing: a false unexplained", count(&nothing, Line::falsely_unexplained), "≤ 1 %"),
        (
            "effects of the library: a false unexplained",
            count(&[single, pair, triple].concat(), Line::falsely_unexplained),
            "",
        ),
        ("outside the library: flagged", count(&outside, Line::unexplained), "≥ 97 %"),
        ("outside the library: confidently misnamed", count(&outside, misnamed), "≤ 3 %"),
        ("avoidable squared error closed, median / p5", closure(&inside), "≥ 99.99 / 99.8 %"),
        ("remaining avoidable rms, p95", remaining(&inside), "≤ 0.15 σ"),
        ("effects: 68 % intervals that hold the truth", pooled(lines, |it| &it.deviations, 1.0), "60–76 %"),
        ("effects: 95 % intervals that hold the truth", pooled(lines, |it| &it.deviations, 1.96), "92–98 %"),
        (
            "base parameters: 68 % intervals that hold the truth",
            pooled(lines, |it| &it.shifts, 1.0),
            "60–76 %",
        ),
        (
            "base parameters: 95 % intervals that hold the truth",
            pooled(lines, |it| &it.shifts, 1.96),
            "92–98 %",
        ),
        ("CPU time (all threads) single, median / p95 / worst", times(&of("single")), "< 1 s on 2 cores"),
        (
            "CPU time (all threads) of anything, median / p95 / worst",
            times(&lines.iter().collect::<Vec<_>>()),
            "< 5 s on 2 cores",
        ),
    ]
}

/// Share of the avoidable squared error closed, of cases in which there is one (visible beyond 0.3 σ).
fn closure(lines: &[&Line]) -> String {
    let closed = |line: &&Line| {
        let (before, after) = (line.before?, line.after?);
        (before > 0.3 && !line.hidden.is_empty()).then(|| 1.0 - (after / before).powi(2))
    };
    let closures: Vec<f64> = lines.iter().filter_map(closed).collect();
    let (median, low) = (quantile(&closures, 0.5), quantile(&closures, 0.05));
    format!("{:.3} / {:.2} % (n = {})", 100.0 * median, 100.0 * low, closures.len())
}

fn remaining(lines: &[&Line]) -> String {
    let rest: Vec<f64> = lines.iter().filter_map(|line| line.after).collect();
    format!("{:.3} σ (median {:.3}, n = {})", quantile(&rest, 0.95), quantile(&rest, 0.5), rest.len())
}

fn within(deviations: &[f64], times: f64) -> String {
    share(deviations.iter().filter(|z| z.abs() <= times).count(), deviations.len())
}

/// How many of all intervals of so many standard deviations hold the truth.
fn pooled(lines: &[Line], of: fn(&Line) -> &Vec<(String, f64)>, times: f64) -> String {
    within(&lines.iter().flat_map(|line| of(line).iter().map(|d| d.1)).collect::<Vec<f64>>(), times)
}

fn times(lines: &[&Line]) -> String {
    let times: Vec<f64> = lines.iter().filter_map(|line| line.cpu_s).collect();
    let [median, high, worst] = [0.5, 0.95, 1.0].map(|q| quantile(&times, q));
    format!("{median:.2} / {high:.2} / {worst:.2} s")
}

/// Confusion of visible singles: what was named for each hidden effect.
fn by_kind(lines: &[Line]) -> String {
    let mut table: BTreeMap<&str, BTreeMap<String, usize>> = BTreeMap::new();
    for line in lines.iter().filter(|line| line.set == "single" && line.visible()) {
        let mut answer = if line.named.is_empty() { "nothing".to_owned() } else { line.named.join(" + ") };
        if line.unexplained() {
            answer.push_str(" (unexplained)");
        }
        *table.entry(&line.hidden[0].0).or_default().entry(answer).or_default() += 1;
    }
    let mut text = String::from("| hidden (visible > 0.3 σ) | right | n | otherwise |\n|---|---|---|---|\n");
    for (hidden, answers) in table {
        let right: usize = answers.iter().filter(|a| group(a.0) == group(hidden)).map(|a| a.1).sum();
        let all: usize = answers.values().sum();
        let others = answers.iter().filter(|a| group(a.0) != group(hidden));
        let others: Vec<String> = others.map(|(answer, n)| format!("{n} × {answer}")).collect();
        let _ = writeln!(text, "| {hidden} | {right} | {all} | {} |", others.join("; "));
    }
    text
}

/// Coverage of each parameter.
fn coverage(lines: &[Line]) -> String {
    let mut table: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (name, z) in lines.iter().flat_map(|line| line.deviations.iter().chain(&line.shifts)) {
        table.entry(name).or_default().push(*z);
    }
    let mut text = String::from("| parameter | within 2 σ | median deviation / σ |\n|---|---|---|\n");
    for (name, z) in table {
        let _ = writeln!(text, "| {name} | {} | {:+.2} |", within(&z, 2.0), quantile(&z, 0.5));
    }
    text
}

/// What the names of each grade are worth: how many of them are hidden.
fn by_grade(lines: &[Line]) -> String {
    let mut grades: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for line in lines.iter().filter(|line| !line.named.is_empty()) {
        let (given, right) = line.precision();
        let sum = grades.entry(&line.grade).or_default();
        *sum = (sum.0 + given, sum.1 + right);
    }
    let mut text = String::from("| grade | names given that are right |\n|---|---|\n");
    for (grade, (given, right)) in grades {
        let _ = writeln!(text, "| {grade} | {} |", share(right, given));
    }
    text
}

/// What each kind outside the library was taken for.
fn outsiders(lines: &[Line]) -> String {
    let mut table: BTreeMap<&str, (usize, usize, BTreeMap<String, usize>)> = BTreeMap::new();
    for line in lines {
        let Some(kind) = &line.outside else { continue };
        let entry = table.entry(kind).or_default();
        entry.0 += usize::from(line.unexplained());
        entry.1 += 1;
        let answer = format!("{}: {}", line.verdict, line.named.join(" + "));
        *entry.2.entry(answer).or_default() += 1;
    }
    let mut text =
        String::from("| outside the library | flagged | n | verdict: names |\n|---|---|---|---|\n");
    for (kind, (flagged, n, answers)) in table {
        let answers: Vec<String> = answers.iter().map(|(answer, n)| format!("{n} × {answer}")).collect();
        let _ = writeln!(text, "| {kind} | {flagged} | {n} | {} |", answers.join("; "));
    }
    text
}
