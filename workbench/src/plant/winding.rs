//! What a step needs of winding, inertia and viscous friction, computed once for a step length and a resistance.

use super::physics::{Drive, Physics};

/// Steps whose lengths differ by less than this (relative) are the same step: time stamps are rounded in every file.
const SAME_STEP: f64 = 1e-5;

/// Coefficients of one step. With the mean speed ω̄ of the step:
/// current → settled + (current − settled)·`end`, settled = (net voltage − Ke·ω̄)·`conductance`,
/// torque = `per_volt`·net + `per_ampere`·current − damping·ω̄.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coefficients {
    resistance: f64,
    step: f64,
    kt: f64,
    /// 1/R.
    pub conductance: f64,
    /// Rest of the current's deviation at the end of the step.
    pub end: f64,
    /// … and on the mean over it.
    pub mean: f64,
    /// Torque per volt of net voltage.
    pub per_volt: f64,
    /// Torque per ampere at the start.
    pub per_ampere: f64,
    /// Damping by the back-EMF.
    pub back_emf: f64,
    /// The rigid shaft with the bridge closed: for positive and negative speed.
    pub closed: [Shaft; 2],
    /// … and open.
    pub open: [Shaft; 2],
}

/// ω1 = `keep`·ω0 + `mobility`·torque.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shaft {
    pub damping: f64,
    pub keep: f64,
    pub mobility: f64,
}

impl Shaft {
    fn new(inertia: f64, damping: f64, h: f64) -> Self {
        let half = 0.5 * h * damping / inertia;
        Self {
            damping,
            keep: (1.0 - half) / (1.0 + half),
            mobility: h / inertia / (1.0 + half),
        }
    }
}

impl Coefficients {
    /// For a resistance, a torque constant and a step length.
    pub fn new(p: &Physics, resistance: f64, kt: f64, h: f64) -> Self {
        let (end, mean) = decay(resistance * h / p.inductance.max(1e-12));
        let share = (1.0 - mean) / resistance;
        let mut made = Self {
            resistance,
            step: h,
            kt,
            conductance: 1.0 / resistance,
            end,
            mean,
            per_volt: kt * share,
            per_ampere: kt * mean,
            back_emf: kt * p.ke * share,
            closed: [Shaft::new(p.inertia, p.viscous, h); 2],
            open: [Shaft::new(p.inertia, p.viscous, h); 2],
        };
        if p.drive == Drive::Torque {
            made.back_emf = 0.0;
        }
        for (side, uneven) in [p.viscous_pos, p.viscous_neg].into_iter().enumerate() {
            made.open[side] = Shaft::new(p.inertia, p.viscous + uneven, h);
            made.closed[side] = Shaft::new(p.inertia, p.viscous + uneven + made.back_emf, h);
        }
        made
    }

    /// True if they serve for another step too.
    #[inline]
    pub fn serve(&self, resistance: f64, kt: f64, h: f64) -> bool {
        self.resistance == resistance && self.kt == kt && (self.step - h).abs() <= SAME_STEP * h
    }
}

/// What is left of a deviation after `x` time constants: at the end, and as the mean.
fn decay(x: f64) -> (f64, f64) {
    let end = (-x).exp();
    (end, if x < 1e-6 { 1.0 - 0.5 * x } else { (1.0 - end) / x })
}
