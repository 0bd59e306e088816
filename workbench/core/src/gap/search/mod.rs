//! Which effects are missing: every candidate is fitted by simulation error, sets grow by a beam, and a set must pay
//! for itself on the log (fit and cross-validation), be visible, and survive backward elimination.
//!
//! ```text
//! base → predicted cost of every candidate → race (→ evolution) → acceptance → forms → next round … → exchange → elimination → rivals
//! ```
//!
//! Where the log contradicts the data sheet, the same is done from the parameter put right, and the likelier end is kept.

mod adaptation;
mod by_shares;
mod conventions;
mod evolve;
mod exchange;
mod forms;
mod from_data_sheet;
mod grid;
mod race;
mod rivals;
mod rounds;
mod screening;

pub use crate::gap::fit::scored::{HELD_OUT, Scored, chi2, dispersion};
pub use evolve::scatter;
pub use rivals::tied;

use crate::gap::dataset::Dataset;
use crate::gap::fit::hypothesis::{Hypothesis, Item};
use crate::gap::fit::scored::score_with;
use crate::gap::fit::{FINAL, Fit, SEARCH, Setting};
use crate::gap::options::{Options, ShareLimits};
use crate::outcome::Small;
use crate::system::effects::{Effect, Form};
use crate::system::model::Model;
use crate::system::threads::join;
use rounds::Path;
use std::collections::BTreeSet;

/// What the search found.
#[derive(Clone)]
pub struct Found<'a> {
    /// The base inside its tolerances.
    pub base: Scored<'a>,
    /// The accepted set, finely fitted.
    pub best: Scored<'a>,
    /// Other sets of the last round, finely fitted, best first.
    pub others: Vec<Scored<'a>>,
    /// Names that were tried together and did not all stay.
    pub dropped: Vec<String>,
    /// Names that are real by every other measure and worth less than half a point of held-out fit, with those points.
    pub small: Vec<Small>,
}

/// Called with the effects found so far and the number of candidates tried.
pub type Progress<'p> = &'p (dyn Fn(&str) + Sync);

/// Searches the library for what the options offer.
pub fn search<'a>(dataset: &'a Dataset, model: &'a Model, given: &Options, progress: Progress) -> Found<'a> {
    let base = base_fit(dataset, model);
    let mut search = Search {
        dataset,
        model,
        excluded: given.without.clone(),
        limits: given.limits,
        offer: Offer::All,
        progress,
        first_gap: base.fit.chi2,
        dispersion: dispersion(&base),
        expanded: Vec::new(),
    };
    if model.by_shares {
        return search.by_shares(base);
    }
    let usual = search.clone().full_search(base.clone());
    let (best, path) = match search.contradicted(&base) {
        Some(from) => from_data_sheet::likelier(search.full_search(from), usual),
        None => usual,
    };
    search.dispersion = dispersion(&best);
    search.found(&base, best, path)
}

/// The base inside its tolerances.
pub fn base_fit<'a>(dataset: &'a Dataset, model: &'a Model) -> Scored<'a> {
    Scored::given(dataset, model).refitted(&SEARCH)
}

/// Which effects a search offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Offer {
    /// The whole library: the gap is measured by the noise.
    All,
    /// Plain forms: the gap is measured by shares.
    Plain,
    /// Richer forms alone, by shares.
    Rich,
    /// Plain and richer forms, by shares.
    Forms,
}

#[derive(Clone)]
struct Search<'a, 'p> {
    dataset: &'a Dataset,
    model: &'a Model,
    excluded: Vec<String>,
    limits: ShareLimits,
    offer: Offer,
    progress: Progress<'p>,
    /// χ² of the base inside its tolerances.
    first_gap: f64,
    /// Over-dispersion times inflation by correlation, of the best set so far.
    dispersion: f64,
    /// Sets that the rounds gave every further effect.
    expanded: Vec<Vec<Item>>,
}

impl<'a> Search<'a, '_> {
    /// Grows a set as long as effects pay for themselves, exchanges and eliminates; finely fitted, with its path.
    fn full_search(&mut self, from: Scored<'a>) -> (Scored<'a>, Path<'a>) {
        (self.first_gap, self.dispersion) = (from.fit.chi2, dispersion(&from));
        let mut path = Path::default();
        let current = self.grown(from, &mut path);
        let (current, exchanged) = self.exchanged(current);
        path.others.extend(exchanged);
        (self.evened(self.eliminated(self.fine(&current))), path)
    }

    /// What a search leaves: the set that it kept, and its rivals among the sets on its path.
    fn found(&self, base: &Scored<'a>, best: Scored<'a>, path: Path<'a>) -> Found<'a> {
        let (others, singles) = (path.others, &path.singles);
        let (base, others) = join(|| self.fine(base), || self.rivals(&best, others, singles));
        Found { base, others, dropped: path.dropped, small: self.still_small(path.small, &best), best }
    }

    /// Each name that stayed small and was not named in the end, once.
    fn still_small(&self, small: Vec<Small>, best: &Scored) -> Vec<Small> {
        let mut told: BTreeSet<String> = best.hypothesis.names().into_iter().collect();
        small.into_iter().filter(|it| told.insert(it.name.clone())).collect()
    }

    fn excludes(&self, effect: &Effect) -> bool {
        self.excluded.iter().any(|name| name == effect.name)
    }

    fn offers(&self, parent: &Scored, effect: &'static Effect) -> bool {
        // The numbers of a fit hold what their own names would.
        effect.on_records()
            && !(self.model.fitted_to_log && effect.is_scale())
            && !self.excludes(effect)
            && self.offers_form(effect.form)
            && parent.hypothesis.admits(effect)
    }

    fn offers_form(&self, form: Form) -> bool {
        match self.offer {
            Offer::All => true,
            Offer::Forms => form != Form::Absorbed,
            Offer::Rich => self.is_rich(form),
            Offer::Plain => form != Form::Absorbed && !self.is_rich(form),
        }
    }

    fn is_rich(&self, form: Form) -> bool {
        match form {
            Form::Rich => true,
            Form::RichWithoutPosition => !self.dataset.position_logged,
            Form::Plain | Form::Absorbed => false,
        }
    }

    fn scored(&self, hypothesis: Hypothesis<'a>, fit: Fit) -> Scored<'a> {
        self.priced(Scored { hypothesis, fit, score: f64::NAN })
    }

    /// A set with its score.
    fn priced(&self, set: Scored<'a>) -> Scored<'a> {
        Scored { score: score_with(&set, self.dispersion), ..set }
    }

    fn refit(&self, scored: &Scored<'a>, setting: &Setting) -> Scored<'a> {
        self.priced(scored.refitted(setting))
    }

    fn fine(&self, scored: &Scored<'a>) -> Scored<'a> {
        self.refit(scored, &FINAL)
    }

    /// The set without one effect, refitted from its own values and from the base's nominal ones.
    fn without(&self, scored: &Scored<'a>, index: usize, setting: &Setting) -> Scored<'a> {
        self.priced(scored.only(|k| k != index, setting))
    }
}
