//! What may be said: named, tie, nothing missing, unexplained.

use crate::gap::acceptance::residual_share::{left_open, no_more, sum};
use crate::gap::dataset::Part;
use crate::gap::experiment;
use crate::gap::fit::SEARCH;
use crate::gap::fit::hypothesis::Item;
use crate::gap::fit::samples::samples;
use crate::gap::options::ShareLimits;
use crate::gap::record::estimate::{self, Uncertainty};
use crate::gap::remainder::look::{self, Remainder};
use crate::gap::remainder::structure::Structure;
use crate::gap::remainder::{self, Described, Scope};
use crate::gap::search::{Found, HELD_OUT, Scored, chi2, tied};
use crate::outcome::{Experiment, Grade, Small, Tie, Verdict};
use crate::system::effects::{self, Effect};
use crate::system::plant::physics::Drive;
use crate::system::threads::{join, of_each};

/// The judgement on a search.
pub struct Judged<'a> {
    /// What holds.
    pub verdict: Verdict,
    /// How sure it is.
    pub grade: Grade,
    /// The set that is reported as named.
    pub kept: Scored<'a>,
    /// What its numbers are uncertain by, where that is known already.
    pub uncertainty: Option<Uncertainty>,
    /// Names that only resemble what is missing.
    pub closest: Vec<String>,
    /// Explanations that cannot be told apart.
    pub ties: Vec<Tie>,
    /// The share of the first gap (squared, above the noise) that is left, 0 … 1.
    pub share: f64,
    /// What that looks like.
    pub structure: Structure,
    /// True if repeats of the same input differ, or if nothing predicts it on held-out data; `None`: nobody looked.
    pub noisy: Option<bool>,
    /// What to measure next.
    pub next: Option<Experiment>,
    /// Names that were taken out because nothing of them shows in a fit.
    pub tiny: Vec<Small>,
}

/// What is left is worth a word when it is visible: this much rms beyond the noise, in units of the noise. Chosen by
/// judgement; not studied.
const VISIBLE: f64 = 0.25;
/// What is left is worth a word when it is more than this share of the first squared gap, too. Origin: drawn cases;
/// right names in a form that is not exactly the library's leave up to half a per cent, wrong ones several times
/// that.
const SHARE: f64 = 0.006;
/// The same where what is left goes with the turn of a shaft: no form of another effect does. Chosen by judgement;
/// not studied.
const SHARE_TURNING: f64 = 1e-3;
/// A model that leaves this share of the hold-out's gap has described the log, not the axis. Origin: drawn cases;
/// sets outside of the library that left less than a tenth of the log's gap left a fifth and more of the hold-out's.
const HELD_OUT_SHARE: f64 = 0.15;
/// A name stands, although something is left, if it shrinks the structured part by this factor. Chosen by judgement;
/// not studied.
const CONFIRMED: f64 = 10.0;

/// Judges what was found.
pub fn judge<'a>(found: &Found<'a>, given: &Scored, limits: &ShareLimits) -> Judged<'a> {
    let (whole, Supported { found: supported, uncertainty, tiny }) = (found, supported(found));
    let found = supported.as_ref().unwrap_or(found);
    if given.hypothesis.model.by_shares && !found.best.hypothesis.items.is_empty() {
        return Judged { tiny, ..by_shares(found, uncertainty, given, limits) };
    }
    // What small names explain alone is no gap.
    let trifle = found.best.hypothesis.items.is_empty() && !tiny.is_empty();
    let of = if trifle { whole } else { found };
    let on_log = || join(|| look::look(&of.best), || excess(given).max(1e-9));
    let ((remainder, first), held_out) = join(on_log, || held_out_share(&found.best, given));
    let share = (remainder.excess / first).min(1.0);
    let nothing_named = found.best.hypothesis.items.is_empty();
    let unpredicted = match nothing_named {
        false => held_out > HELD_OUT_SHARE,
        true => strange(&found.best),
    };
    let left = is_left(of, given, &remainder, share) || (unpredicted && !trifle);
    // The names may stand all the same.
    let missed = !nothing_named && held_out > SHARE && held_out_square(&found.best) > DISAGREE;
    let share = match (unpredicted, nothing_named) {
        (true, true) => 1.0,
        _ if unpredicted || missed => share.max(held_out.min(1.0)),
        _ => share,
    };
    let (kept, closest) = match left {
        true if nothing_named => (found.best.clone(), found.dropped.clone()),
        true => confirmed(found, share * first),
        false => (found.best.clone(), Vec::new()),
    };
    let (ties, next) = if left { (Vec::new(), None) } else { ties(found) };
    let uncertainty = uncertainty.filter(|_| kept.hypothesis.items == found.best.hypothesis.items);
    let verdict = Verdict::of(left, !ties.is_empty(), !kept.hypothesis.items.is_empty());
    let grade = Grade::of(verdict, left || missed, true);
    let structure =
        structure(left || missed, unpredicted || missed, nothing_named, share, remainder.structure);
    Judged { verdict, grade, kept, uncertainty, closest, ties, share, structure, noisy: None, next, tiny }
}

/// Beside a dependence that predicts more than this, a line in time or a trace of the turn is a part of it. Chosen by
/// judgement; not studied.
const PART_OF_IT: f64 = 0.5;

impl Judged<'_> {
    /// Takes in what the remainder was found to depend on.
    pub fn depends(&mut self, described: Option<&Described>) {
        let seen = std::mem::take(&mut self.structure);
        let differs = matches!(seen, Structure::Unrepeatable { .. });
        self.noisy = Some(differs || (described.is_none() && !seen.stays()));
        let Some(found) = described else {
            self.structure = seen;
            if matches!(self.structure, Structure::FunctionOf { .. } | Structure::Correlated) {
                self.structure = Structure::Unpredicted;
                self.next.get_or_insert_with(|| remainder::repeat(self.kept.hypothesis.dataset));
            }
            return;
        };
        if self.verdict == Verdict::NothingMissing {
            (self.verdict, self.share) = (Verdict::Unexplained, found.share);
        }
        let turns = found.over.iter().any(|variable| variable.is_periodic());
        let also = differs || (seen.stays() && (turns || found.share < PART_OF_IT));
        let beside = also.then(|| Box::new(seen));
        self.structure = Structure::Predicted { by: remainder::sentence(&found.over, found.share), beside };
        self.next.get_or_insert_with(|| found.next.clone());
    }
}

/// What a report tells of what is left: below a share nobody asks.
fn structure(left: bool, unpredicted: bool, nothing_named: bool, share: f64, seen: Structure) -> Structure {
    match (left, unpredicted) {
        _ if unpredicted && nothing_named => Structure::AnotherMotor,
        (true, true) if seen == Structure::None => Structure::OfEveryRecord,
        (true, false) if seen == Structure::None => Structure::TooFew,
        (true, _) => seen,
        (false, _) if share > SHARE && !nothing_named => seen,
        (false, _) => Structure::None,
    }
}

/// What stays of a search.
struct Supported<'a> {
    /// The same without the names that did not stay; `None` if all stay.
    found: Option<Found<'a>>,
    /// What the numbers that stay are uncertain by, unless they will be fitted with other weights.
    uncertainty: Option<Uncertainty>,
    /// Names that are worth nothing that a fit shows.
    tiny: Vec<Small>,
}

/// Takes out the names that do not lower the held-out gap, those whose numbers lie within three standard deviations of nothing, and the
/// small ones.
fn supported<'a>(found: &Found<'a>) -> Supported<'a> {
    let (mut best, mut tiny) = (found.best.clone(), Vec::new());
    let uncertainty = loop {
        let ((indistinct, uncertainty), useless) = join(|| indistinct(&best), || useless(&best));
        let Some((index, points)) = indistinct.map(|index| (index, 0.0)).or(useless) else {
            break uncertainty;
        };
        if points > 0.0 {
            let name = best.hypothesis.names()[index].clone();
            tiny.push(Small { name, fit_points: points });
        }
        best = best.only(|k| k != index, &SEARCH);
    };
    let all = found.best.hypothesis.names();
    let dropped = all.len() - best.hypothesis.items.len();
    let others = if dropped == tiny.len() { others(found, &best, &tiny) } else { Vec::new() };
    let left = (dropped > 0).then(|| Found { best, others, dropped: all, ..found.clone() });
    Supported { found: left, uncertainty, tiny }
}

/// The rivals of a set without the small names: what is tied stays tied.
fn others<'a>(found: &Found<'a>, best: &Scored<'a>, small: &[Small]) -> Vec<Scored<'a>> {
    let lag = small.iter().any(|it| effects::find(&it.name).is_some_and(Effect::is_lag));
    let gone =
        |item: &Item| small.iter().any(|it| it.name == item.effect.name) || (lag && item.effect.is_lag());
    let mut others: Vec<Scored<'a>> = Vec::new();
    for other in &found.others {
        let fewer = other.only(|k| !gone(&other.hypothesis.items[k]), &SEARCH);
        let known = |set: &Scored| set.hypothesis.items == fewer.hypothesis.items;
        if fewer.hypothesis.items.len() == best.hypothesis.items.len()
            && !others.iter().chain([best]).any(known)
        {
            others.push(fewer);
        }
    }
    others
}

/// The first effect of a set whose numbers, as they would be reported, lie within three standard deviations of nothing. And what they are
/// uncertain by, if they are those of the set.
fn indistinct(best: &Scored) -> (Option<usize>, Option<Uncertainty>) {
    let Some(dataset) = estimate::eased(best) else {
        let uncertainty = Uncertainty::of(best);
        return (estimate::indistinct(best, &uncertainty), Some(uncertainty));
    };
    let anew = estimate::refitted(&dataset, best);
    (estimate::indistinct(&anew, &Uncertainty::of(&anew)), None)
}

/// A name that lifts the held-out fit by fewer points is small: nobody sees it in a fit. Origin: in 200 drawn cases
/// right names bring 0.06 at least.
const SEEN_POINTS: f64 = 0.02;
/// A model without an inductance leaves out a lag of the winding of this part of the mechanical time constant, and of
/// so many seconds at most: small motors have 0.3 to 3 ms beside 5 to 50 ms. Chosen by judgement; not studied.
const WINDING: (f64, f64) = (0.03, 0.002);

/// The first effect of a set without which the held-out data are predicted as well, everything fitted anew, or that is small, with the
/// points of held-out fit that it brings. A base parameter stays: without it the others are bent to the ends of their tolerances and may
/// predict as much.
fn useless(best: &Scored) -> Option<(usize, f64)> {
    let items = best.hypothesis.items.iter().enumerate();
    let others = items.filter(|(_, item)| !item.effect.is_base_parameter());
    let others: Vec<usize> = others.map(|(index, _)| index).collect();
    let without = || of_each(&others, |index| lost(&best.only(|k| k != *index, &SEARCH)));
    let (with, without) = join(|| lost(best), without);
    let mut brought = others.into_iter().zip(without).map(|(index, without)| (index, without - with));
    brought.find(|(index, points)| *points < SEEN_POINTS || is_winding(best, *index))
}

/// Points of fit, %, that a set leaves open on the held-out data.
fn lost(set: &Scored) -> f64 {
    100.0 * left_open(set, &set.held_out())
}

/// True if an effect of a set is what the winding does that the model leaves out.
fn is_winding(best: &Scored, index: usize) -> bool {
    let (plant, hypothesis) = (best.plant(), &best.hypothesis);
    let longest = WINDING.1.min(WINDING.0 * plant.time_constant_s());
    plant.drive == Drive::Voltage
        && plant.inductance == 0.0
        && hypothesis.items[index].effect.is_lag()
        && hypothesis.value(index, 0, &best.fit.x) < longest
}

/// The judgement on names that a search by shares kept: they stand, and what is left stands beside them.
fn by_shares<'a>(
    found: &Found<'a>,
    uncertainty: Option<Uncertainty>,
    given: &Scored,
    limits: &ShareLimits,
) -> Judged<'a> {
    let remainder = look::look(&found.best);
    let share = (remainder.excess / excess(given).max(1e-9)).min(1.0);
    // What the log hides may show in a prediction.
    let held_out = sum(&found.best.held_out()) / sum(&given.held_out()).max(f64::MIN_POSITIVE);
    let left = share.max(held_out) > SHARE;
    let most = most_is_removed(&found.best, given, limits);
    // A lag that removes less than half and stands alone is what almost anything else looks like that acts on the current or
    // the sensor: it is no name.
    let lags_alone = found.best.hypothesis.items.iter().all(|item| item.effect.is_lag());
    let mimics = left && !most && lags_alone;
    let (ties, next) = if mimics { (Vec::new(), None) } else { ties(found) };
    let verdict = Verdict::of(mimics, !ties.is_empty(), true);
    Judged {
        verdict,
        grade: Grade::of(verdict, left, most),
        kept: if mimics { found.base.clone() } else { found.best.clone() },
        uncertainty: uncertainty.filter(|_| !mimics),
        closest: if mimics { found.best.hypothesis.names() } else { Vec::new() },
        ties,
        share,
        structure: if left { remainder.structure } else { Structure::None },
        noisy: None,
        next,
        tiny: Vec::new(),
    }
}

/// True if a set leaves little enough of the squared error of the model as given, on the log and on every held-out record.
fn most_is_removed(best: &Scored, given: &Scored, limits: &ShareLimits) -> bool {
    let log = best.fit.chi2 / chi2(&given.hypothesis, &given.fit.x, &SEARCH).0.max(f64::MIN_POSITIVE);
    log <= limits.likely && no_more(&best.held_out(), &given.held_out(), limits.likely)
}

/// A held-out record that is missed by this many times the noise, where the log is not, is of another motor. Chosen
/// by judgement; not studied.
const STRANGE: f64 = 3.0;

/// Fewer samples show no structure, whatever they leave. Chosen by judgement; not studied.
pub const FEW: usize = 200;
/// What they leave is no agreement from so many times the noise's variance on. Origin: the square of [`STRANGE`].
const DISAGREE: f64 = STRANGE * STRANGE;

/// True if the model misses a held-out record although it fits the log.
fn strange(best: &Scored) -> bool {
    let log = best.fit.chi2 / best.fit.samples.max(1) as f64;
    held_out_square(best) > STRANGE * STRANGE * log.max(1.0)
}

/// χ² a sample of the held-out data.
fn held_out_square(set: &Scored) -> f64 {
    let (held_out, samples) = chi2(&set.hypothesis, &set.fit.x, &HELD_OUT);
    held_out / samples.max(1) as f64
}

/// What looks like noise and opens fewer points of the fit is noise: that of a coarse reading, which a slow motion
/// hides from the estimate. Chosen by judgement; not studied.
const LIKE_NOISE_POINTS: f64 = 0.1;

/// True if what is left is worth a verdict of its own.
fn is_left(found: &Found, given: &Scored, remainder: &Remainder, share: f64) -> bool {
    let visible = remainder.excess.sqrt() > VISIBLE;
    let nothing_named = found.best.hypothesis.items.is_empty();
    let white = remainder.structure == Structure::None;
    if nothing_named && found.best.fit.samples < FEW && remainder.excess > DISAGREE {
        return true;
    }
    match (visible && !white, nothing_named) {
        (false, _) => false,
        (true, true) => {
            remainder.structure.explains()
                || remainder.repeated
                || (remainder.excess > 1.0 && lost(&found.best) > LIKE_NOISE_POINTS)
        }
        (true, false) if remainder.structure.turns() => share > SHARE_TURNING,
        (true, false) => share > SHARE || (share > SHARE_TURNING && goes_with_a_turn(&found.best, given)),
    }
}

/// What the place within a turn predicts of what is left, alone or with another variable, from which on it is no other form of a name
/// that knows no place. Origin: design cases; of 260 single effects no right name leaves more than a fifth there, a gripping sector 0.9.
const OF_A_TURN: f64 = 0.5;

/// True if most of what is left goes with the place within a turn, on held-out data. What grips in a sector of the turn leaves half a per
/// cent of the gap beside Stribeck friction.
fn goes_with_a_turn(best: &Scored, given: &Scored) -> bool {
    let look = || remainder::described(best, &given.held_out(), Scope::Everything);
    let of_a_turn =
        |it: Described| it.share > OF_A_TURN && it.over.iter().any(|variable| variable.is_periodic());
    best.fit.samples >= FEW && look().is_some_and(of_a_turn)
}

/// Mean square of the speed's residuals beyond the noise, in units of the noise's variance. Of the speed alone: a gap in
/// a logged current, which may be far quieter, would dwarf it.
fn excess(set: &Scored) -> f64 {
    let seen = samples(set, &[Part::A, Part::B]);
    let sum: f64 = seen.iter().map(|s| (s.residual() * s.weight).powi(2)).sum();
    sum / seen.len().max(1) as f64 - 1.0
}

/// What a set leaves of the hold-out's gap (squared, above the noise).
fn held_out_share(best: &Scored, given: &Scored) -> f64 {
    let (before, after) = (held_out_square(given) - 1.0, held_out_square(best) - 1.0);
    // A gap that hardly shows in the hold-out says nothing.
    if before > 1.0 { after / before } else { 0.0 }
}

/// The effects that shrink what is left tenfold, refitted; the others only resemble it.
fn confirmed<'a>(found: &Found<'a>, left: f64) -> (Scored<'a>, Vec<String>) {
    let best = &found.best;
    let names = best.hypothesis.names();
    let without = of_each(0..names.len(), |index| excess(&best.only(|k| k != index, &SEARCH)));
    let (keep, gone): (Vec<usize>, Vec<usize>) =
        (0..names.len()).partition(|index| without[*index] > CONFIRMED * left);
    if gone.is_empty() {
        return (best.clone(), Vec::new());
    }
    let closest = gone.into_iter().map(|index| names[index].clone()).collect();
    (best.only(|k| keep.contains(&k), &SEARCH), closest)
}

/// Rivals that the data cannot tell from the accepted set, and what would.
fn ties(found: &Found) -> (Vec<Tie>, Option<Experiment>) {
    let rivals = tied(&found.best, &found.others);
    let Some(nearest) = rivals.first() else {
        return (Vec::new(), None);
    };
    let separation = experiment::separation(&found.best, nearest);
    let mut sets = vec![found.best.hypothesis.names()];
    sets.extend(rivals.iter().map(|rival| rival.hypothesis.names()));
    (vec![Tie { rivals: sets, separated_by: separation.text }], Some(separation.experiment))
}
