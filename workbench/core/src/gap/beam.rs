//! The one beam that grows sets of effects, over records and over tables.
//!
//! The best set found so far is grown on beside others that do not help yet, because some effects help only together: one
//! round without a gain may be a pair in the making, two in a row are the end.

/// Effects of a set at most. Origin: drawn cases hide three at most; two more leave room for what stands in for
/// another.
pub const DEEPEST: usize = 5;

/// How sets grow on one kind of data.
pub trait Growth {
    /// A fitted set of effects.
    type Set: Clone;

    /// Sets that are grown further side by side.
    fn width(&self) -> usize;

    /// All sets that have one effect more than a set of the beam, best first; none if nothing promises to pay.
    fn children(&mut self, round: usize, current: &Self::Set, beam: &[Self::Set]) -> Vec<Self::Set>;

    /// The child that takes the place of the current set. What may not be grown further is taken out of the children.
    fn winner(&mut self, current: &Self::Set, children: &mut Vec<Self::Set>) -> Option<Self::Set>;

    /// A winner as it is grown further, and whether it gained enough for the search to go on in any case.
    fn accepted(&mut self, now: &Self::Set, winner: Self::Set, grown: Vec<Self::Set>) -> (Self::Set, bool);

    /// True if children of which none won may be halves of a pair.
    fn may_pair(&mut self, current: &Self::Set, children: Vec<Self::Set>) -> bool;
}

/// Grows a set that already holds some effects.
pub fn grown<G: Growth>(growth: &mut G, from: G::Set, effects: usize) -> G::Set {
    let mut current = from;
    let mut beam = vec![current.clone()];
    let mut patient = true;
    for round in effects + 1..=DEEPEST {
        let mut children = growth.children(round, &current, &beam);
        if children.is_empty() {
            break;
        }
        let winner = growth.winner(&current, &mut children);
        beam = children.iter().take(growth.width()).cloned().collect();
        let goes_on = match winner {
            Some(winner) => {
                let (accepted, clear) = growth.accepted(&current, winner, children);
                current = accepted;
                beam.insert(0, current.clone());
                beam.truncate(growth.width());
                if clear {
                    patient = true;
                    continue;
                }
                true
            }
            None => growth.may_pair(&current, children),
        };
        if !patient || !goes_on {
            break;
        }
        patient = false;
    }
    current
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that grow by one a round; only those of a list are a gain.
    struct Counting(&'static [usize]);

    impl Growth for Counting {
        type Set = usize;

        fn width(&self) -> usize {
            2
        }

        fn children(&mut self, _: usize, _: &usize, beam: &[usize]) -> Vec<usize> {
            beam.iter().max().map(|most| most + 1).into_iter().collect()
        }

        fn winner(&mut self, _: &usize, children: &mut Vec<usize>) -> Option<usize> {
            children.iter().copied().find(|child| self.0.contains(child))
        }

        fn accepted(&mut self, _: &usize, winner: usize, _: Vec<usize>) -> (usize, bool) {
            (winner, true)
        }

        fn may_pair(&mut self, _: &usize, _: Vec<usize>) -> bool {
            true
        }
    }

    #[test]
    fn one_idle_round_is_borne_and_two_are_the_end() {
        assert_eq!(grown(&mut Counting(&[1, 3]), 0, 0), 3);
        assert_eq!(grown(&mut Counting(&[1, 4]), 0, 0), 1);
    }

    #[test]
    fn a_set_holds_no_more_than_so_many_effects() {
        assert_eq!(grown(&mut Counting(&[1, 2, 3, 4, 5, 6]), 0, 0), DEEPEST);
        assert_eq!(grown(&mut Counting(&[1, 2, 3, 4, 5, 6]), 0, 4), 1);
    }
}
