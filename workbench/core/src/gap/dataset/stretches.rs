//! A long log in stretches: the search runs on some of them, the figures at the end on all.
//!
//! Each stretch starts from its own measured speed and place, some time constants before its first compared row: until
//! then a wrong start, an unknown place of a play and a delay are forgotten.

use super::agree::same_input;
use super::coverage::{Coverage, Measure, chosen};
use super::observation::{MOST_BLOCKS, Observation, bench_run};
use super::preheat::{Losses, Preheat};
use super::rows::{even_rows, unbroken_rows};
use super::{GridRun, Part, Scales, folds};
use crate::system::log::{Dynamic, Run};
use std::ops::Range;
use std::sync::Arc;

/// Compared blocks of a stretch, at least. Chosen by judgement; not studied.
const BLOCKS: usize = 500;
/// Compared time constants of a stretch, at least. Chosen by judgement; not studied.
const TIMES: f64 = 6.0;
/// Windows of a compared position in a stretch. Chosen by judgement; not studied.
const WINDOWS: f64 = 2.0;
/// Time constants that are simulated and not compared before it. Chosen by judgement: e⁻⁴ is 2 %.
const LEAD: f64 = 4.0;
/// A run up to so many stretches long is taken as a whole. Chosen by judgement; not studied.
const WHOLE: f64 = 1.5;
/// Stretches from which the noise is estimated. Chosen by judgement; not studied.
const EVENLY: usize = 49;
/// Compared blocks that are held out, in all.
const HELD_OUT_BLOCKS: usize = MOST_BLOCKS;

/// A run without long gaps.
struct Piece<'a> {
    log: usize,
    run: &'a Run,
    rows: Range<usize>,
    losses: Arc<Losses>,
}

/// Some rows of a run.
#[derive(Clone, Debug)]
struct Stretch {
    piece: usize,
    /// First row that is simulated.
    lead: usize,
    /// First and last row that are compared.
    rows: Range<usize>,
    /// The piece as a whole, with parts of its own.
    whole: bool,
}

/// All rows of log and hold-outs, as stretches.
pub(super) struct Stretches<'a> {
    pieces: Vec<Piece<'a>>,
    all: Vec<Stretch>,
    measure: Measure,
    thinning: usize,
    holdout_given: bool,
    /// Two pieces of the log with the same input.
    alike: Option<(usize, usize)>,
}

impl<'a> Stretches<'a> {
    pub(super) fn of(
        log: &'a Dynamic,
        holdouts: &[&'a Dynamic],
        scales: &Scales,
        observation: &Observation,
        notes: &mut Vec<String>,
    ) -> Self {
        let mut pieces = Vec::new();
        for (index, source) in std::iter::once(&log).chain(holdouts).enumerate() {
            for run in &source.runs {
                let losses = Arc::new(Losses::of(run, source.input));
                let cuts = unbroken_rows(run, scales.time, notes);
                pieces.extend(cuts.into_iter().map(|rows| Piece {
                    log: index,
                    run,
                    rows,
                    losses: Arc::clone(&losses),
                }));
            }
        }
        let sample = log.runs[0].sample_s();
        let rows = |seconds: f64| (seconds / sample).ceil() as usize;
        let length = (BLOCKS * observation.thinning).max(rows(TIMES * scales.time));
        let length = length.max(rows(WINDOWS * observation.way_s.unwrap_or(0.0)));
        let lead = rows(LEAD * scales.time + observation.window_s).clamp(20, length);
        // Within a tenth of a time constant the speed hardly changes. Chosen by judgement; not studied.
        let measure =
            Measure { input: scales.input, speed: scales.speed, rows: rows(0.1 * scales.time).max(1) };
        let all = pieces.iter().enumerate().flat_map(|(k, piece)| tiled(k, piece, length, lead)).collect();
        let alike = alike(&pieces, scales.input);
        Self {
            pieces,
            all,
            measure,
            thinning: observation.thinning,
            holdout_given: !holdouts.is_empty(),
            alike,
        }
    }

    /// The stretches that the search runs on: of each of fitted and held-out rows as many as it may have. `None`: the records are short.
    pub(super) fn searched(&self) -> Option<Vec<usize>> {
        let (held_out, fitted): (Vec<usize>, Vec<usize>) =
            (0..self.all.len()).partition(|k| self.part(&self.all[*k]) == Some(Part::HoldOut));
        let blocks =
            |some: &[usize]| some.iter().map(|k| self.all[*k].rows.len() / self.thinning).sum::<usize>();
        let log: usize = (0..self.all.len())
            .filter(|k| self.pieces[self.all[*k].piece].log == 0)
            .map(|k| blocks(&[k]))
            .sum();
        if log <= MOST_BLOCKS && blocks(&held_out) <= HELD_OUT_BLOCKS {
            return None;
        }
        let mut searched = Vec::new();
        let again = |k: &usize| self.alike.is_some_and(|(_, second)| self.all[*k].piece == second);
        let (repeated, fitted): (Vec<usize>, Vec<usize>) = fitted.into_iter().partition(again);
        let most = if 3 * repeated.len() < fitted.len() { MOST_BLOCKS } else { MOST_BLOCKS * 2 / 3 };
        for (some, most) in [(fitted, most), (held_out, HELD_OUT_BLOCKS)] {
            let count = (some.len() * most / blocks(&some).max(1)).max(2);
            let cover = |k: &usize| {
                let it = &self.all[*k];
                Coverage::of(self.pieces[it.piece].run, it.rows.clone(), &self.measure)
            };
            if count < some.len() {
                let cover: Vec<Coverage> = some.iter().map(cover).collect();
                searched.extend(chosen(&cover, count).into_iter().map(|k| some[k]));
            } else {
                searched.extend(some);
            }
        }
        // Every second stretch of a run that is repeated is there twice: what differs is noise.
        let twice: Vec<usize> = searched.iter().filter_map(|k| self.repeated(*k)).step_by(2).collect();
        searched.extend(twice.into_iter().filter(|k| repeated.contains(k)));
        searched.sort_unstable();
        Some(searched)
    }

    /// The same stretch of the run that repeats its run.
    fn repeated(&self, stretch: usize) -> Option<usize> {
        let (first, second) = self.alike?;
        let start = |piece: usize| self.all.iter().position(|it| it.piece == piece);
        (self.all[stretch].piece == first).then_some(stretch + start(second)? - start(first)?)
    }

    /// Which of some stretches have the same input, as places among them.
    pub(super) fn twins(&self, some: &[usize]) -> Vec<(usize, usize)> {
        let pair = |k: usize| Some((k, some.iter().position(|it| Some(*it) == self.repeated(some[k]))?));
        (0..some.len()).filter_map(pair).collect()
    }

    /// Number of all stretches.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Rows of log and hold-outs, and of some stretches of them.
    pub(super) fn rows(&self, some: &[usize]) -> usize {
        some.iter().map(|k| self.all[*k].rows.len()).sum()
    }

    /// True if a stretch is of the log, held out or not.
    pub(super) fn of_log(&self, stretch: usize) -> bool {
        self.pieces[self.all[stretch].piece].log == 0
    }

    /// True if something of a stretch is fitted.
    pub(super) fn fitted(&self, stretch: usize) -> bool {
        self.part(&self.all[stretch]) != Some(Part::HoldOut)
    }

    /// The run of a stretch.
    pub(super) fn piece(&self, stretch: usize) -> usize {
        self.all[stretch].piece
    }

    /// True if something of a stretch is held out.
    pub(super) fn holds_out(&self, stretch: usize) -> bool {
        matches!(self.part(&self.all[stretch]), None | Some(Part::HoldOut))
    }

    /// What the rows of a stretch serve for; `None`: a whole run with several parts.
    fn part(&self, stretch: &Stretch) -> Option<Part> {
        let piece = &self.pieces[stretch.piece];
        if piece.log > 0 {
            return Some(Part::HoldOut);
        }
        if stretch.whole {
            return None;
        }
        let t_s = &piece.run.t_s;
        let (start, end) = (t_s[piece.rows.start], t_s[piece.rows.end - 1]);
        let middle = t_s[(stretch.rows.start + stretch.rows.end) / 2];
        Some(folds::at((middle - start) / (end - start), 0, self.holdout_given))
    }

    /// A stretch made ready, but for noise and start. `position`: place of its first row, where it is an integral.
    pub(super) fn made(&self, stretch: usize, observation: &Observation, position: f64) -> GridRun {
        let it = &self.all[stretch];
        let piece = &self.pieces[it.piece];
        let last = (it.rows.end + 1).min(piece.rows.end);
        let run = even_rows(piece.run.rows_between(it.lead, last, piece.run.id));
        let mut made = bench_run(&run, piece.log, observation);
        made.since_s = piece.run.t_s[it.lead] - piece.run.t_s[0];
        made.preheat = Some(Preheat::new(&piece.losses, made.since_s));
        if it.lead > piece.rows.start {
            made.start_speed = self.measure.mean_speed(piece.run, it.lead);
        }
        made.position.iter_mut().for_each(|at| *at += position);
        match self.part(it) {
            None => return folds::assigned(made, self.holdout_given),
            Some(part) => {
                let first = run.t_s[it.rows.start - it.lead] - 1e-9;
                let point = made.time.partition_point(|time| *time < first) as u32;
                for probes in [&mut made.speed, &mut made.current] {
                    for k in 0..probes.part.len() {
                        let early =
                            probes.time[k] < first || probes.from.get(k).is_some_and(|from| *from < point);
                        probes.part[k] = if early { Part::Masked } else { part };
                    }
                }
            }
        }
        made
    }

    /// Stretches that lie evenly over log and hold-outs.
    pub(super) fn evenly(&self, observation: &Observation) -> Vec<GridRun> {
        let count = EVENLY.min(self.all.len());
        (0..count).map(|k| self.made((2 * k + 1) * self.all.len() / (2 * count), observation, 0.0)).collect()
    }

    /// True if a stretch begins where its run does.
    pub(super) fn begins(&self, stretch: usize) -> bool {
        let it = &self.all[stretch];
        it.lead == self.pieces[it.piece].rows.start
    }

    /// Integrals of the measured speed up to the first row of each stretch; 0 where the position is logged.
    pub(super) fn positions(&self) -> Vec<f64> {
        let mut positions = vec![0.0; self.all.len()];
        let mut next = 0;
        for (index, piece) in self.pieces.iter().enumerate() {
            let own = next..next + self.all[next..].iter().take_while(|it| it.piece == index).count();
            next = own.end;
            let (Some(speed), None) = (&piece.run.speed, &piece.run.position) else { continue };
            let (t_s, mut sum, mut row) = (&piece.run.t_s, 0.0, piece.rows.start);
            for stretch in own {
                while row < self.all[stretch].lead {
                    sum += 0.5 * (speed[row + 1] + speed[row]) * (t_s[row + 1] - t_s[row]);
                    row += 1;
                }
                positions[stretch] = sum;
            }
        }
        positions
    }
}

/// Stretches of about a length, one after another; a short piece is one as a whole.
fn tiled(index: usize, piece: &Piece, length: usize, lead: usize) -> Vec<Stretch> {
    let rows = piece.rows.len() - 1;
    if (rows as f64) < WHOLE * length as f64 {
        let rows = piece.rows.start..piece.rows.end - 1;
        return vec![Stretch { piece: index, lead: rows.start, rows, whole: true }];
    }
    let count = rows / length;
    let edge = |k: usize| piece.rows.start + k * rows / count;
    let stretch = |k: usize| Stretch {
        piece: index,
        lead: edge(k).saturating_sub(lead).max(piece.rows.start),
        rows: edge(k)..edge(k + 1),
        whole: false,
    };
    (0..count).map(stretch).collect()
}

/// The first two pieces of the log that were driven alike.
fn alike(pieces: &[Piece], largest: f64) -> Option<(usize, usize)> {
    let input = |piece: usize| {
        let Piece { run, rows, .. } = &pieces[piece];
        &run.input[rows.start..rows.end - 1]
    };
    let own = pieces.iter().filter(|piece| piece.log == 0).count();
    let mut pairs = (0..own).flat_map(|a| (a + 1..own).map(move |b| (a, b)));
    pairs.find(|(a, b)| same_input(input(*a), input(*b), largest))
}
