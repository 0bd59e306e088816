//! Numbers and names as text.

use servo::axis::Bridge;
use truing_core::outcome::volts;
use truing_core::outcome::{
    Contradiction, DEVIATIONS, DataFault, Experiment, Grade, HoldOut, NamedEffect, Outcome, PositionGap,
    Segment, Shift, Tie, UnnamedTerm, Value, Verdict,
};
use truing_core::system::effects;
pub use truing_core::text::figures::{figure, gap, listing, percent, significant};

/// A fit in percent.
pub fn fit(percent: f64) -> String {
    format!("{percent:.2} %")
}

/// What the noise of held-out data leaves of a fit, said where that is less than half: data that hardly change fit no model.
pub fn allowed(held: &HoldOut) -> String {
    let best = 100.0 - (100.0 - held.fit_percent_before) * held.noise_floor / held.rmse_before;
    if best < 50.0 { format!(" (the noise allows {})", fit(best)) } else { String::new() }
}

/// The second judge beside a speed.
pub const POSITION: &str = "rms of the position in free run, held out";

/// How far the position is missed before and after.
pub fn position(missed: &PositionGap) -> String {
    format!("{} → {} {}", gap(missed.rmse_before), gap(missed.rmse_after), missed.unit)
}

/// Is there a ± to be explained?
pub fn deviates(outcome: &Outcome) -> bool {
    let known = |v: &Value| v.std.is_some_and(|std| std.is_finite() && std > 0.0);
    let effects = outcome.effects.iter();
    effects.flat_map(readable).any(|(_, v)| known(v))
        || outcome.within_tolerance.iter().any(|shift| shift.std_percent > 0.0)
}

/// A base parameter's shift inside its tolerance: `-5.770 ± 0.020 %`.
pub fn shift(shift: &Shift) -> String {
    let sign = if shift.shift_percent > 0.0 { "+" } else { "" };
    if shift.std_percent > 0.0 {
        return format!("{sign}{} %", with_deviation(shift.shift_percent, shift.std_percent));
    }
    format!("{sign}{:.2} %", shift.shift_percent)
}

/// A label of at most so many letters.
pub fn shortened(label: &str, longest: usize) -> String {
    match label.chars().count() > longest {
        true => label.chars().take(longest - 1).chain(['…']).collect(),
        false => label.to_owned(),
    }
}

/// `6.790 ± 0.012 V`: the deviation with two significant digits, the value to the same decimal place.
pub fn value(v: &Value) -> String {
    let unit = if v.unit.is_empty() || v.unit == "1" { String::new() } else { format!(" {}", v.unit) };
    match v.std.filter(|s| s.is_finite() && *s > 0.0) {
        Some(std) => format!("{}{unit}", with_deviation(v.value, std)),
        None => format!("{}{unit}", significant(v.value, 5)),
    }
}

fn with_deviation(value: f64, std: f64) -> String {
    let decimals = 1 - std.log10().floor() as i32;
    let largest = value.abs().max(std);
    if decimals > 7 || !(1e-3..1e6).contains(&largest) {
        return format!("{value:.4e} ± {std:.1e}");
    }
    let decimals = decimals.max(0) as usize;
    format!("{value:.decimals$} ± {std:.decimals$}")
}

/// A number that lies within three of its standard deviations of 0 is not in the headline as if it were known.
fn is_told_from_nothing(v: &Value) -> bool {
    v.std.is_none_or(|std| v.value.abs() > DEVIATIONS * std)
}

/// Stands between the names of two sides in that of their difference.
const MINUS: &str = "_minus_";

/// `half_width_v = 1.10 ± 0.01 V, neg_ns not told from 0 (13 ± 16 N s/m)`
pub fn parameters(effect: &NamedEffect) -> String {
    let named = |(name, v): (&String, &Value)| match is_told_from_nothing(v) {
        true => format!("{name} = {}{}", value(v), beside(effect, name)),
        false => format!("{name} not told from 0 ({})", value(v)),
    };
    let between = effect.derived.iter().filter(|(name, _)| name.contains(MINUS));
    readable(effect).into_iter().chain(between).map(named).collect::<Vec<_>>().join(", ")
}

/// A torque is told beside its voltage where it is so many times less certain. That of a motor of 1 Ω, for which a first-order model
/// stands, is as certain, and no torque.
const LESS_CERTAIN: f64 = 1.5;

/// The acceleration that a voltage stands for, and the torque: ` (120.0 ± 2.0 rad/s²; 0.030 ± 0.004 N m)`.
fn beside(effect: &NamedEffect, name: &str) -> String {
    let blur = |v: &Value| v.std.unwrap_or(f64::INFINITY) / v.value.abs();
    let torque = volts::torque(effect, name).map(|(_, torque)| torque);
    let torque = torque.filter(|it| {
        let volts = effect.derived.get(name);
        volts.is_some_and(|volts| blur(it) > LESS_CERTAIN * blur(volts))
    });
    let told: Vec<String> = volts::acceleration(effect, name).into_iter().chain(torque).map(value).collect();
    if told.is_empty() { String::new() } else { format!(" ({})", told.join("; ")) }
}

/// The parameters as people read them: what stands for a voltage as that voltage.
pub fn readable(effect: &NamedEffect) -> Vec<(&String, &Value)> {
    let parameters = effect.parameters.iter();
    parameters.map(|(name, v)| volts::of(effect, name).unwrap_or((name, v))).collect()
}

/// The figures that follow from them.
pub fn following(effect: &NamedEffect) -> Vec<(&String, &Value)> {
    let shown = readable(effect);
    let mut figures = effect.derived.iter().collect::<Vec<_>>();
    figures.retain(|figure| !shown.contains(figure));
    figures
}

/// A set of names: `motor_gain + viscous_friction`.
pub fn set(names: &[String]) -> String {
    names.join(" + ")
}

/// `drive_gain | encoder_scale | motor_gain + viscous_friction`
pub fn rivals(tie: &Tie) -> String {
    tie.rivals.iter().map(|r| set(r)).collect::<Vec<_>>().join(" | ")
}

/// One word or two for the verdict.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Data => "data",
        Verdict::InsufficientExcitation => "insufficient excitation",
        Verdict::Unexplained => "unexplained",
        Verdict::Tie => "tie",
        Verdict::Named => "named",
        Verdict::NothingMissing => "nothing missing",
    }
}

/// The same with what else can be said of a name: how sure it is, and whether something is left.
pub fn grade(outcome: &Outcome) -> &'static str {
    match outcome.grade {
        Grade::Likely => "likely",
        Grade::NamedAndSomethingIsLeft => "named, and something is left",
        _ => verdict(outcome.verdict),
    }
}

/// The verdict in sentences: what the log says against the model file, then what the model lacks.
pub fn headline(outcome: &Outcome) -> String {
    let Some(first) = contradiction(outcome) else {
        return found(outcome, outcome.effects.iter());
    };
    let besides = outcome.effects.iter().filter(|effect| !is_base_parameter(effect));
    match (outcome.verdict, besides.clone().count()) {
        (Verdict::Named | Verdict::Tie, 0) if !outcome.unexplained.is_left() => {
            format!("{first} Nothing else is missing.")
        }
        _ => format!("{first} {}", found(outcome, besides)),
    }
}

fn is_base_parameter(effect: &NamedEffect) -> bool {
    effects::find(&effect.name).is_some_and(effects::Effect::is_base_parameter)
}

/// `The log contradicts the data sheet: J_kgm2 is about 0.33 of what the file says; with it the fit is 99.10 %.`
fn contradiction(outcome: &Outcome) -> Option<String> {
    let about = |it: &Contradiction| {
        let or = if it.or.is_empty() { String::new() } else { format!(" (or {})", it.or.join(" or ")) };
        format!("{}{or} is about {} what the file says", it.parameter, share(it.ratio))
    };
    let each: Vec<String> = outcome.data_sheet.iter().map(about).collect();
    let fit = outcome.data_sheet.iter().filter_map(|it| it.fit_percent).next_back();
    let with = if each.len() == 1 { "it" } else { "them" };
    let fit = fit.map_or(String::new(), |percent| format!("; with {with} the fit is {}", self::fit(percent)));
    (!each.is_empty()).then(|| format!("The log contradicts the data sheet: {}{fit}.", listing(&each)))
}

/// `0.33`, `3.1 times`.
fn share(ratio: f64) -> String {
    format!("{} {}", significant(ratio, 2), if ratio > 1.0 { "times" } else { "of" })
}

/// The lines that mend the model file: `J_kgm2: write [motor] J_kgm2 = 3.75e-5, or [tolerance] J_kgm2 = 1.0`.
pub fn mended(contradiction: &Contradiction) -> String {
    let (stated, fitted) = (figure(contradiction.stated), figure(contradiction.fitted));
    let mends = contradiction.mends.join(", or free it with ");
    format!("{} is {stated} in the file and {fitted} in the log: write {mends}", contradiction.parameter)
}

/// The verdict as a sentence about some of its effects.
fn found<'e>(outcome: &Outcome, effects: impl Iterator<Item = &'e NamedEffect>) -> String {
    let effects: Vec<&NamedEffect> = effects.collect();
    let names = listing(&effects.iter().map(|effect| sized(effect)).collect::<Vec<_>>());
    let share = percent(outcome.unexplained.share_of_gap);
    match outcome.verdict {
        Verdict::Data => {
            "The files are examined first, and something in them is wrong. Nothing was simulated.".into()
        }
        Verdict::InsufficientExcitation => {
            "The data cannot test the model: they do not excite what would have to be seen.".into()
        }
        Verdict::Unexplained if effects.is_empty() => {
            format!("Something is missing that no known effect explains: {}.", outcome.unexplained.structure)
        }
        Verdict::Unexplained => {
            format!("Found: {names}; something else is left: {}.", outcome.unexplained.structure)
        }
        Verdict::Tie if outcome.unexplained.is_left() => format!(
            "Found: {names}; {share} of the gap (squared) is left. Other names fit these data equally well; an experiment tells them apart."
        ),
        Verdict::Tie => format!(
            "Found: {names}. Other names fit these data equally well; an experiment tells them apart."
        ),
        Verdict::Named if outcome.grade == Grade::Likely => format!(
            "The model probably lacks {names}: it predicts every record better, but {share} of the gap (squared) is left."
        ),
        Verdict::Named if outcome.unexplained.is_left() => {
            format!("The model lacks {names}; {share} of the gap (squared) is left.")
        }
        Verdict::Named => format!("The model lacks {names}."),
        Verdict::NothingMissing => "Nothing is missing: simulation and data agree to the noise.".into(),
    }
}

/// What is wrong with a file, in two sentences.
pub fn fault(fault: &DataFault) -> String {
    let (so, then) = (percent(fault.explained_as_it_stands), percent(fault.explained_with_it));
    let what = &fault.what;
    format!(
        "It looks as if {what}. As the files stand the model explains {so} of the motion, with that put right {then}."
    )
}

/// The names that are worth little, with what they are worth.
pub fn small(outcome: &Outcome) -> String {
    let each = outcome.small.iter();
    let each: Vec<String> =
        each.map(|it| format!("{} ({:+.2} points of fit)", it.name, it.fit_points)).collect();
    each.join(", ")
}

/// Numbers that do not tell how much there is of an effect.
const BESIDE: [&str; 5] = ["contact_s", "damping", "bus_farad", "cubic_nm_per_rad3", "rest_rad"];

/// A name with its size, where it has one: `dead_zone of 0.65 V`. Two sides have two sizes.
fn sized(effect: &NamedEffect) -> String {
    let measured = |(name, v): &(&String, &Value)| {
        is_told_from_nothing(v) && v.value != 0.0 && v.unit != "1" && !BESIDE.contains(&name.as_str())
    };
    let between = effect.derived.iter().find(|(name, _)| name.contains(MINUS));
    let known = effects::find(&effect.name);
    let two = known.and_then(effects::Effect::sides).is_some();
    let differ = two && between.is_none_or(|(_, difference)| is_told_from_nothing(difference));
    let sizes = readable(effect).into_iter().filter(measured).take(if differ { 2 } else { 1 });
    let sizes: Vec<String> = sizes.map(|(_, v)| format!("{} {}", significant(v.value, 2), v.unit)).collect();
    // Sides that cannot be told apart are one.
    let even = known.and_then(|known| known.relations.uneven_of.as_ref()).map(|uneven| uneven.even.name);
    let name = even.filter(|_| !differ).unwrap_or(&effect.name);
    if sizes.is_empty() { name.to_owned() } else { format!("{name} of {}", sizes.join(" and ")) }
}

/// What a term without a name describes and what it does to the held-out gap, in a sentence.
pub fn unnamed(term: &UnnamedTerm, unit: &str) -> String {
    let over = term.over.join(" and ").replace('_', " ");
    let (before, after) = (gap(term.gap_before), gap(term.gap_after));
    let size = term.values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let of = if term.unit == "1" { String::new() } else { format!(" {}", term.unit) };
    format!(
        "{}, a term without a name: {} of up to {}{of} over {over}; with it the held-out gap falls from {before} to {after} {unit}",
        term.name,
        term.acts,
        significant(size, 2)
    )
}

/// The verdict as a title: `Named: voltage_saturation and dead_zone`, `Tie: J_kgm2 of the data sheet and coulomb_friction`.
pub fn title(outcome: &Outcome) -> String {
    let word = grade(outcome);
    let word: String =
        word.chars().take(1).flat_map(char::to_uppercase).chain(word.chars().skip(1)).collect();
    let sheet = outcome.data_sheet.iter().map(|it| format!("{} of the data sheet", it.parameter));
    let effects =
        outcome.effects.iter().filter(|effect| outcome.data_sheet.is_empty() || !is_base_parameter(effect));
    let names: Vec<String> = sheet.chain(effects.map(|effect| effect.name.clone())).collect();
    if names.is_empty() { word } else { format!("{word}: {}", listing(&names)) }
}

/// What to apply, piece by piece, and how many times all of it: a train of equal pulses is told once.
pub fn profile(experiment: &Experiment) -> (usize, Vec<String>) {
    let pieces = &experiment.profile;
    let repeats = |period: usize| {
        pieces.len().is_multiple_of(period) && pieces.iter().zip(&pieces[period..]).all(|(a, b)| a == b)
    };
    let period = (1..=pieces.len() / 2).find(|period| repeats(*period)).unwrap_or(pieces.len());
    let times = pieces.len().checked_div(period).unwrap_or(1);
    (times, pieces[..period].iter().map(|piece| segment(piece, experiment.unit)).collect())
}

/// What an experiment takes: `It takes up to 4.2 A and 12 turns.`
pub fn needs(experiment: &Experiment) -> Option<String> {
    let current = experiment.peak_current_a.map(|peak| format!("up to {} A", significant(peak, 2)));
    let travel = experiment.travel.map(|travel| match experiment.linear {
        true => format!("{} m of travel", significant(travel, 2)),
        false => format!("{} turns of the motor", significant(travel / std::f64::consts::TAU, 2)),
    });
    let parts: Vec<String> = current.into_iter().chain(travel).collect();
    (!parts.is_empty())
        .then(|| format!("It takes {}, as far as the extended model knows.", parts.join(" and ")))
}

/// `+6 V for 1 s`, `bridge open for 37 ms`.
fn segment(s: &Segment, unit: &str) -> String {
    let time = match s.seconds < 0.1 {
        true => format!("{} ms", significant(1000.0 * s.seconds, 2)),
        false => format!("{} s", significant(s.seconds, 2)),
    };
    match (s.bridge, s.u_v) {
        (Bridge::Open, _) => format!("bridge open for {time}"),
        (Bridge::Shorted, _) => format!("terminals shorted for {time}"),
        (_, u) => {
            let u = u.unwrap_or(0.0);
            let sign = if u > 0.0 { "+" } else { "" };
            format!("{sign}{} {unit} for {time}", significant(u, 3))
        }
    }
}
