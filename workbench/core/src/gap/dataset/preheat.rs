//! What happened in a run before a stretch of it: the heat that is in the winding when the stretch begins.

use crate::system::log::{Input, Run};
use crate::system::plant::physics::{Drive, Physics};
use servo::axis::Bridge;
use std::sync::Arc;

/// Pieces into which a run is parted. A budget of computing time, chosen by judgement.
const PIECES: usize = 2048;
/// What lies further back than so many thermal time constants is forgotten. Chosen by judgement: e⁻⁸ is 3e-4.
const FORGOTTEN: f64 = 8.0;

/// Means over pieces of a run, for the power that is lost in the winding: of the squared input, of input times speed, of the
/// squared speed.
#[derive(Clone, Debug, Default)]
pub(super) struct Losses {
    piece_s: f64,
    means: Vec<[f64; 3]>,
}

/// The pieces of a run before a stretch.
#[derive(Clone, Debug)]
pub struct Preheat {
    losses: Arc<Losses>,
    /// Time from the start of the run, s.
    since_s: f64,
}

impl Losses {
    /// Of a run; nothing where no winding is driven.
    pub(super) fn of(run: &Run, input: Input) -> Self {
        if input != Input::Voltage {
            return Self::default();
        }
        let (start, last) = (run.t_s[0], run.rows() - 1);
        let piece_s = (run.t_s[last] - start) / PIECES as f64;
        let mut means = vec![[0.0; 3]; PIECES];
        for row in (0..last).filter(|row| run.bridge[*row] != Bridge::Open) {
            let held = run.t_s[row + 1] - run.t_s[row];
            let input = if run.bridge[row] == Bridge::Driven { run.input[row] } else { 0.0 };
            let speed = match (&run.speed, &run.position) {
                (Some(speed), _) => speed[row],
                (None, Some(position)) => (position[row + 1] - position[row]) / held,
                (None, None) => 0.0,
            };
            let piece = (((run.t_s[row] - start) / piece_s) as usize).min(PIECES - 1);
            let products = [input * input, input * speed, speed * speed];
            means[piece].iter_mut().zip(products).for_each(|(mean, it)| *mean += it * held / piece_s);
        }
        Self { piece_s, means }
    }
}

impl Preheat {
    pub(super) fn new(losses: &Arc<Losses>, since_s: f64) -> Self {
        Self { losses: Arc::clone(losses), since_s }
    }

    /// Heat in the winding at the end, as the power that would hold it, from `before` at the start of the run.
    pub(super) fn heat_w(&self, plant: &Physics, before: f64) -> f64 {
        let Losses { piece_s, means } = &*self.losses;
        if plant.heat_rise_per_w <= 0.0 || plant.drive != Drive::Voltage || means.is_empty() {
            return before;
        }
        let pieces = ((self.since_s / piece_s) as usize).min(means.len());
        let first = ((self.since_s - FORGOTTEN * plant.heat_time_s) / piece_s).max(0.0) as usize;
        let keep = (-piece_s / plant.heat_time_s).exp();
        means[first.min(pieces)..pieces].iter().fold(before, |heat, [uu, uw, ww]| {
            let volts = (uu - 2.0 * plant.ke * uw + plant.ke * plant.ke * ww).max(0.0);
            let loss = volts / (plant.resistance * (1.0 + plant.heat_rise_per_w * heat));
            loss + (heat - loss) * keep
        })
    }
}
