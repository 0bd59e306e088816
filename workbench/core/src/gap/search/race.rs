//! The candidates of a round: screened by their predicted cost, then raced in three fits, each longer and for fewer of them.

use super::evolve::{evolved, spread};
use super::grid::screened;
use super::screening::{Projector, Start, started};
use super::{Offer, Search};
use crate::gap::acceptance::noise::{VISIBLE, at_floor};
use crate::gap::acceptance::price;
use crate::gap::fit::hypothesis::{Hypothesis, Item};
use crate::gap::fit::initial_guesses::Basis;
use crate::gap::fit::problem::dot;
use crate::gap::fit::scored::{Scored, rank};
use crate::gap::fit::{Evaluator, SEARCH, Setting, fit_near};
use crate::gap::order::by_least;
use crate::system::effects::{Effect, LIBRARY};
use crate::system::threads::*;
use std::borrow::{Borrow, BorrowMut};

/// Candidates that are fitted for two iterations, of those with the lowest predicted cost. Origin: a budget of
/// computing time, not a threshold: half of it changes no case of 26, 15 lose a pair of 16, 30 an inertia beside `kt_saturation`.
const FIRST_ROUND: usize = 40;
/// Candidates that are fitted up to eight iterations. Origin: 1,000 drawn cases were also searched with every candidate fitted to the end.
/// Of 1,098 names that won a round ten stood further behind after two iterations, and none of their cases lost its name.
const SECOND_ROUND: usize = 7;
/// Candidates that are fitted to the end. A budget of computing time, chosen by judgement; its sensitivity was not
/// measured.
pub(super) const THIRD_ROUND: usize = 4;
/// Candidates with a non-smooth cost are fitted by CMA-ES if at most so many others promise more. A budget of
/// computing time, chosen by judgement.
const EVOLVED: usize = 3;
/// A round is fitted only if a start promises this part of what a name must gain: the linear prediction of a gain is
/// often several times too low. Chosen by judgement; its sensitivity was not measured.
const LEAST_PREDICTED_GAIN: f64 = 0.3;
/// Where the gap is measured by the noise, they must have gained this part of what the best has gained. Origin: of those 1,098 names none
/// among the best seven had less. Where by shares, a rig would lose its name.
const WITHIN_REACH: f64 = 0.1;
/// Candidates beyond [`SECOND_ROUND`] that are fitted on all the same where the gap is measured by shares: those that
/// still promise more than the best has reached. Two iterations are too few for a phase. Chosen by judgement; not
/// studied.
const PROMISING: usize = 7;

/// Starts that are simulated in lock-step: a multiple of what any processor advances at once. More would only cost
/// memory. Chosen by judgement; not studied.
const TOGETHER: usize = 16;

/// A candidate before its fits.
struct Screened<'a> {
    hypothesis: Hypothesis<'a>,
    /// The starts with the lowest predicted cost, best first; each as a part and as a whole until it is [placed](Self::placed).
    starts: Vec<Vec<f64>>,
    /// The predicted cost of the best of them.
    predicted_cost: f64,
    /// Which set of the beam it grew from.
    parent: usize,
}

impl Screened<'_> {
    /// Only for those that are fitted: of each start the part or the whole. Where the parent bends, what its numbers do at a whole
    /// start may lead them far away.
    fn placed(mut self) -> Self {
        let both = Evaluator::new(&self.hypothesis, &SEARCH).of_kin(&self.starts);
        let costs: Vec<f64> = both.iter().map(|it| dot(it, it)).collect();
        let nearer = |(both, costs): (&[Vec<f64>], &[f64])| both[usize::from(costs[0] >= costs[1])].clone();
        self.starts = self.starts.chunks(2).zip(costs.chunks(2)).map(nearer).collect();
        self
    }
}

/// A candidate after its first fit.
struct Entered<'a> {
    it: Screened<'a>,
    scored: Scored<'a>,
}

impl<'a> Borrow<Scored<'a>> for Entered<'a> {
    fn borrow(&self) -> &Scored<'a> {
        &self.scored
    }
}

impl<'a> BorrowMut<Scored<'a>> for Entered<'a> {
    fn borrow_mut(&mut self) -> &mut Scored<'a> {
        &mut self.scored
    }
}

/// What starts of further effects are drawn from, and what follows them.
pub(super) fn looked_at(parent: &Scored) -> (Basis, Projector) {
    join(|| Basis::new(&parent.hypothesis, &parent.fit.x), || Projector::new(parent))
}

impl<'a> Search<'a, '_> {
    /// All sets that have one effect more than a set of the beam, best first.
    pub(super) fn expand(&self, beam: &[Scored<'a>]) -> Vec<Scored<'a>> {
        let (bases, projectors): (Vec<Basis>, Vec<Projector>) = each(beam).map(looked_at).unzip();
        let mut tasks: Vec<(usize, &'static Effect)> = Vec::new();
        let mut seen: Vec<Vec<String>> = Vec::new();
        for (index, parent) in beam.iter().enumerate() {
            for effect in LIBRARY.iter().copied().filter(|effect| self.offers(parent, effect)) {
                let mut names = parent.hypothesis.names();
                names.push(effect.name.to_owned());
                names.sort();
                if !seen.contains(&names) {
                    seen.push(names);
                    tasks.push((index, effect));
                }
            }
        }
        self.fitted(beam, &bases, &projectors, tasks, FIRST_ROUND)
    }

    /// Screens the tasks (set of the beam, new effect) and fits those that promise most.
    pub(super) fn fitted(
        &self,
        beam: &[Scored<'a>],
        bases: &[Basis],
        projectors: &[Projector],
        tasks: Vec<(usize, &'static Effect)>,
        most: usize,
    ) -> Vec<Scored<'a>> {
        let screen = |(index, effect): &(usize, &'static Effect)| {
            (self.progress)("");
            Screened {
                parent: *index,
                ..self.screened(&beam[*index], &bases[*index], &projectors[*index], effect)
            }
        };
        let mut screened = of_each(&tasks, screen);
        by_least(&mut screened, |it| it.predicted_cost);
        let hoped = |it: &Screened| {
            let parent = &beam[it.parent].fit;
            // A promise holds near the parent alone. Far above the noise nothing is refused by it, nor is the first name.
            let first = beam[it.parent].hypothesis.items.is_empty();
            if (self.offer != Offer::All || first) && !at_floor(&beam[it.parent]) {
                return true;
            }
            let visible = VISIBLE * VISIBLE * parent.samples as f64;
            parent.cost - it.predicted_cost > LEAST_PREDICTED_GAIN * visible.max(price(self.dispersion))
        };
        if !screened.iter().any(hoped) {
            return Vec::new();
        }
        screened.truncate(most);
        self.raced(screened, beam, projectors)
    }

    /// Fits in three rounds, each longer and for fewer candidates; all of them are returned, best first.
    fn raced(&self, screened: Vec<Screened<'a>>, beam: &[Scored<'a>], onto: &[Projector]) -> Vec<Scored<'a>> {
        let lasting = |iterations| Setting { iterations, ..SEARCH };
        let near = |it: &Screened<'a>, x: &[f64], setting: &Setting| {
            let projector = &onto[it.parent];
            let made = fit_near(&it.hypothesis, x, setting, &|slot| projector.column(slot));
            self.scored(it.hypothesis.clone(), made)
        };
        let first = each(screened).map(Screened::placed).filter_map(|it| {
            let scored = near(&it, it.starts.first()?, &lasting(2));
            Some(Entered { it, scored })
        });
        let mut field: Vec<Entered<'a>> = first.collect();
        rank(&mut field);
        let second = self.second_round(&mut field, beam[0].fit.cost);
        let again = |Entered { it, scored }: &Entered<'a>| {
            let other = it.starts.get(1).map(|x| near(it, x, &lasting(3)));
            let on = match other {
                Some(other) if other.fit.cost < scored.fit.cost => other,
                _ => scored.clone(),
            };
            self.refit(&on, &lasting(5))
        };
        let mut near_best: Vec<Scored<'a>> = of_each(&field[..second], again);
        rank(&mut near_best);
        for evolved in self.evolved(&near_best, &field, beam, onto) {
            near_best.retain(|other| {
                other.hypothesis.names() != evolved.hypothesis.names() || other.fit.cost < evolved.fit.cost
            });
            near_best.push(evolved);
        }
        rank(&mut near_best);
        let third = &near_best[..near_best.len().min(THIRD_ROUND)];
        let full = of_each(third, |it| self.refit(it, &SEARCH));
        near_best.splice(0..full.len(), full);
        near_best.extend(field.into_iter().skip(second).map(|entered| entered.scored));
        rank(&mut near_best);
        near_best
    }

    /// How many candidates are fitted on, moved to the front: those with the best rank. Where the gap is measured by the noise, those of
    /// them that are within reach of the best; where by shares, also those that still promise more than the best has reached.
    /// `standing`: the cost without a candidate.
    fn second_round(&self, field: &mut [Entered<'a>], standing: f64) -> usize {
        let ranked = field.len().min(SECOND_ROUND);
        if self.offer == Offer::All {
            let gained = |it: &Entered| standing - it.scored.fit.cost;
            let most = field.iter().map(gained).fold(f64::NEG_INFINITY, f64::max);
            let least = most - (1.0 - WITHIN_REACH) * most.abs();
            field[..ranked].sort_by_key(|it| gained(it) < least);
            return field[..ranked].partition_point(|it| gained(it) >= least);
        }
        let reached = field.first().map_or(standing, |it| it.scored.fit.cost);
        let promising = |entered: &Entered| entered.it.predicted_cost < reached;
        field[ranked..].sort_by_key(|entered| !promising(entered));
        let more = field[ranked..].iter().take(PROMISING);
        ranked + more.filter(|entered| promising(entered)).count()
    }

    /// The candidates with a rugged cost that promise most, evolved, if nothing that was fitted explains all.
    fn evolved(
        &self,
        fitted: &[Scored<'a>],
        field: &[Entered<'a>],
        beam: &[Scored<'a>],
        projectors: &[Projector],
    ) -> Vec<Scored<'a>> {
        if fitted.iter().any(|scored| at_floor(scored)) {
            return Vec::new();
        }
        let mut promising: Vec<&Screened<'a>> = field.iter().map(|entered| &entered.it).collect();
        by_least(&mut promising, |it| it.predicted_cost);
        let rugged = |it: &&&Screened<'a>| {
            let newest = it.hypothesis.items.last();
            newest.is_some_and(|item| item.is_full() && spread(item.effect).is_some())
        };
        let rugged: Vec<&&Screened<'a>> = promising.iter().take(EVOLVED).filter(rugged).collect();
        of_each(&rugged, |it| {
            let (parent, projector) = (&beam[it.parent], &projectors[it.parent]);
            let x = evolved(&it.hypothesis, parent, projector, &it.starts[0]);
            self.priced(Scored::fitted(it.hypothesis.clone(), &x, &SEARCH))
        })
    }

    /// One more effect: its starts, best first, the parent's numbers projected out. Starts that move an optional
    /// parameter belong to the full form; the form that promises more stays.
    fn screened(
        &self,
        parent: &Scored<'a>,
        basis: &Basis,
        projector: &Projector,
        effect: &'static Effect,
    ) -> Screened<'a> {
        let moves = |start: &&Vec<f64>| effect.moves_option(start);
        let starts = basis.starts(self.dataset, effect);
        let (full, plain): (Vec<&Vec<f64>>, Vec<&Vec<f64>>) = starts.iter().partition(moves);
        let plain = self.formed(parent, projector, Item::plain(effect), &plain);
        if full.is_empty() || self.offer == Offer::Plain {
            return plain;
        }
        let full = self.formed(parent, projector, Item::full(effect), &full);
        if full.predicted_cost < plain.predicted_cost { full } else { plain }
    }

    /// One more effect in one form.
    fn formed(&self, parent: &Scored<'a>, onto: &Projector, item: Item, grid: &[&Vec<f64>]) -> Screened<'a> {
        let hypothesis = parent.hypothesis.with_more(item);
        let evaluator = Evaluator::new(&hypothesis, &SEARCH);
        // The longest grid is a large part of a screen: its starts are shared among the threads, a pack at a time.
        let look = |grid: &[&Vec<f64>]| -> Vec<Start> {
            let packs = each(grid.chunks(TOGETHER).collect::<Vec<_>>()).flat_map_iter(|some| {
                let places: Vec<Vec<f64>> = some.iter().map(|it| started(&hypothesis, parent, it)).collect();
                let residuals = evaluator.of_all(&places);
                let projected = places.iter().zip(&residuals);
                let starts = projected.map(|(x, residuals)| onto.projected(&hypothesis, x, residuals));
                starts.collect::<Vec<_>>()
            });
            packs.collect()
        };
        let mut starts = if spread(item.effect).is_some() { screened(grid, look) } else { look(grid) };
        by_least(&mut starts, |it| it.predicted_cost);
        let predicted_cost = starts.iter().map(|start| start.optimistic_cost).fold(f64::INFINITY, f64::min);
        starts.truncate(2);
        let starts = starts.into_iter().flat_map(|start| [start.part, start.x]).collect();
        Screened { predicted_cost, parent: 0, hypothesis, starts }
    }

    /// One more effect, fitted from its best two starts.
    pub(super) fn child(
        &self,
        parent: &Scored<'a>,
        basis: &Basis,
        projector: &Projector,
        effect: &'static Effect,
    ) -> Option<Scored<'a>> {
        let screened = self.screened(parent, basis, projector, effect).placed();
        let fits = of_each(&screened.starts, |x| {
            fit_near(&screened.hypothesis, x, &SEARCH, &|slot| projector.column(slot))
        });
        let best = fits.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some(self.scored(screened.hypothesis, best))
    }
}
