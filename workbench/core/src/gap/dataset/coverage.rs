//! Which parts of a long log show most: every way to drive the axis, in few rows.

use crate::system::log::Run;
use servo::axis::Bridge;
use std::ops::Range;

/// Levels of input and speed, as parts of their largest. Chosen by judgement; not studied.
const EDGES: [f64; 6] = [-0.7, -0.3, -0.03, 0.03, 0.3, 0.7];
const LEVELS: usize = EDGES.len() + 1;
/// An input that changes by this part of its largest value from one row to the next jumps. Chosen by judgement; not
/// studied.
const JUMP: f64 = 0.1;
/// Kinds of what happens: each pair of levels, jumps up and down at each level of the speed, reversals, an open bridge, growing
/// and falling speed.
const KINDS: usize = LEVELS * LEVELS + 2 * LEVELS + 5;
/// A jump or a reversal counts as so many rows: what follows it tells more than a row at rest. Chosen by judgement;
/// not studied.
const EVENT: f32 = 60.0;
/// More rows of one kind than this, in a stretch, tell no more. Chosen by judgement; not studied.
const ENOUGH: f32 = 3.0;
/// Share of the chosen stretches that is spread evenly over the log. Chosen by judgement; not studied.
const SPREAD: f64 = 0.5;

/// A speed is the mean over so many times the rows over which it is taken from positions, on either side. Chosen by
/// judgement; not studied.
const STEADY: usize = 3;

/// How often each kind happens.
#[derive(Clone, Debug)]
pub(super) struct Coverage([f32; KINDS]);

/// By what inputs and speeds are measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measure {
    /// Largest input.
    pub input: f64,
    /// Largest speed.
    pub speed: f64,
    /// Rows over which a speed is taken from positions.
    pub rows: usize,
}

fn level(value: f64) -> usize {
    EDGES.iter().filter(|edge| value > **edge).count()
}

impl Coverage {
    /// Of rows of a run.
    pub(super) fn of(run: &Run, rows: Range<usize>, measure: &Measure) -> Self {
        let mut counts = [0.0; KINDS];
        let speed = |row: usize| measure.speed_at(run, row) / measure.speed;
        let mut direction = 0.0_f64;
        for row in rows.clone() {
            let (input, now) = (run.input[row] / measure.input, speed(row));
            let (at, moves) = (level(now), now.abs() > EDGES[3]);
            counts[level(input) * LEVELS + at] += 1.0;
            let jump = if row > rows.start { input - run.input[row - 1] / measure.input } else { 0.0 };
            let mut event = |kind: usize| counts[LEVELS * LEVELS + kind] += EVENT;
            if jump.abs() > JUMP {
                event(if jump > 0.0 { at } else { LEVELS + at });
            }
            if moves && now * direction < 0.0 {
                event(2 * LEVELS + usize::from(now > 0.0));
            }
            if moves {
                direction = now;
            }
            let others = &mut counts[LEVELS * LEVELS + 2 * LEVELS + 2..];
            others[0] += f32::from(u8::from(run.bridge[row] != Bridge::Driven));
            let change = now - speed(row.saturating_sub(measure.rows).max(rows.start));
            others[1] += f32::from(u8::from(change > EDGES[3]));
            others[2] += f32::from(u8::from(change < -EDGES[3]));
        }
        let events = &mut counts[LEVELS * LEVELS..LEVELS * LEVELS + 2 * LEVELS + 2];
        events.iter_mut().for_each(|count| *count = count.min(ENOUGH * EVENT));
        Self(counts)
    }

    /// What a stretch adds to what others show: the first rows of a kind count most.
    fn gain(&self, shown: &[f32; KINDS]) -> f32 {
        self.0.iter().zip(shown).map(|(own, shown)| (own + shown).sqrt() - shown.sqrt()).sum()
    }

    fn add(&self, shown: &mut [f32; KINDS], sign: f32) {
        shown.iter_mut().zip(&self.0).for_each(|(shown, own)| *shown = (*shown + sign * own).max(0.0));
    }
}

impl Measure {
    /// The speed around a row of a run, over as many rows on both sides as are driven alike.
    pub(super) fn mean_speed(&self, run: &Run, row: usize) -> f64 {
        let most = (STEADY * self.rows).max(2).min(row).min(run.rows() - 1 - row);
        let alike = |other: usize| {
            let change = (run.input[other] - run.input[row]).abs();
            change < JUMP * self.input && run.bridge[other] == run.bridge[row]
        };
        let steady = (1..=most).take_while(|reach| alike(row - reach) && alike(row + reach)).count();
        let reach = steady.max(2.min(most));
        match &run.speed {
            Some(speed) => speed[row - reach..=row + reach].iter().sum::<f64>() / (2 * reach + 1) as f64,
            None => Self { rows: reach.max(1), ..*self }.speed_at(run, row),
        }
    }

    fn speed_at(&self, run: &Run, row: usize) -> f64 {
        if let Some(speed) = &run.speed {
            return speed[row];
        }
        let Some(position) = &run.position else { return 0.0 };
        let (from, to) = (row.saturating_sub(self.rows), (row + self.rows).min(run.rows() - 1));
        (position[to] - position[from]) / (run.t_s[to] - run.t_s[from]).max(1e-12)
    }
}

/// Chooses `count` of the stretches, in their order: half of them one from each part of the log, the others wherever they show most.
pub(super) fn chosen(all: &[Coverage], count: usize) -> Vec<usize> {
    if count >= all.len() {
        return (0..all.len()).collect();
    }
    let mut shown = [0.0; KINDS];
    let mut taken: Vec<usize> = Vec::new();
    let best = |shown: &[f32; KINDS], taken: &[usize], among: Range<usize>| {
        let free = among.filter(|k| !taken.contains(k));
        free.max_by(|a, b| all[*a].gain(shown).total_cmp(&all[*b].gain(shown)))
    };
    let spread = ((SPREAD * count as f64).ceil() as usize).max(1);
    for part in 0..count {
        let among = match part < spread {
            true => part * all.len() / spread..(part + 1) * all.len() / spread,
            false => 0..all.len(),
        };
        if let Some(found) = best(&shown, &taken, among) {
            all[found].add(&mut shown, 1.0);
            taken.push(found);
        }
    }
    taken.sort_unstable();
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A second of rest each, but for one reversal at the end.
    fn run() -> Run {
        let moving = |k: usize| {
            if k < 9900 {
                0.0
            } else if k < 9950 {
                1.0
            } else {
                -1.0
            }
        };
        Run {
            t_s: (0..10_000).map(|k| 0.01 * k as f64).collect(),
            input: (0..10_000).map(moving).collect(),
            bridge: vec![Bridge::Driven; 10_000],
            speed: Some((0..10_000).map(moving).collect()),
            ..Run::default()
        }
    }

    #[test]
    fn what_happens_once_in_a_long_log_is_among_the_chosen_stretches_and_the_others_are_spread() {
        let run = run();
        let measure = Measure { input: 1.0, speed: 1.0, rows: 5 };
        let all: Vec<Coverage> =
            (0..100).map(|k| Coverage::of(&run, 100 * k..100 * (k + 1), &measure)).collect();
        let chosen = chosen(&all, 8);
        assert_eq!(chosen.len(), 8);
        assert!(chosen.contains(&99), "{chosen:?}");
        assert!((0..4).all(|part| chosen.iter().any(|k| k / 25 == part)), "{chosen:?}");
    }

    #[test]
    fn fewer_stretches_than_wanted_are_all_taken() {
        let all: Vec<Coverage> = (0..3).map(|_| Coverage([1.0; KINDS])).collect();
        assert_eq!(chosen(&all, 8), [0, 1, 2]);
    }
}
