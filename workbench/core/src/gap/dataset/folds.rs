//! What the samples of a run serve for.

use super::probe::Probes;
use super::{GridRun, Part};
use crate::system::log::{Dynamic, median};

/// Pieces into which a run is cut for fitting, choosing and holding out. Chosen by judgement; not studied.
const PIECES: usize = 16;

/// Alternating pieces of a run: fit, choose, and, without hold-out logs, every fourth one held out.
pub(super) fn assigned(mut run: GridRun, holdout_given: bool) -> GridRun {
    let (start, end) = (run.time[0], run.time[run.time.len() - 1]);
    for probes in [&mut run.speed, &mut run.current] {
        for (time, served) in probes.time.iter().zip(&mut probes.part) {
            *served = at((time - start) / (end - start), run.log, holdout_given);
        }
    }
    run
}

/// What a place in a run serves for, 0 … 1.
pub(super) fn at(share: f64, log: usize, holdout_given: bool) -> Part {
    part((share * PIECES as f64).floor().min(PIECES as f64 - 1.0) as usize, log, holdout_given)
}

fn part(piece: usize, log: usize, holdout_given: bool) -> Part {
    match (log, holdout_given, piece % 4) {
        (0, false, 3) => Part::HoldOut,
        (0, _, fold) => {
            if fold % 2 == 0 {
                Part::A
            } else {
                Part::B
            }
        }
        _ => Part::HoldOut,
    }
}

/// Isolated samples far from their neighbours are no motion: seven σ come by chance once in 10¹¹ samples, and twice what the neighbours
/// differ by is left to a real edge. Chosen by judgement; not studied.
pub(super) fn mask_spikes(probes: &mut Probes, sigma: f64) {
    let measured = &probes.measured;
    for k in 2..measured.len().saturating_sub(2) {
        let mut near = [measured[k - 2], measured[k - 1], measured[k], measured[k + 1], measured[k + 2]];
        let middle = median(&mut near);
        let spread = (measured[k + 1] - measured[k - 1]).abs();
        if (measured[k] - middle).abs() > 7.0 * sigma + 2.0 * spread {
            probes.part[k] = Part::Masked;
        }
    }
}

/// What is held out, in words.
pub(super) fn said(holdouts: &[&Dynamic]) -> String {
    if holdouts.is_empty() {
        return format!("held out: every fourth of {PIECES} equal pieces of each run");
    }
    format!("held out: {}", holdouts.iter().map(|log| log.source.as_str()).collect::<Vec<_>>().join(", "))
}
