//! What a step needs of winding, inertia and viscous friction, computed once for a step length and a resistance.

use super::physics::{Drive, Physics};

/// Steps whose lengths differ by less than this (relative) are the same step: time stamps are rounded in every file.
const SAME_STEP: f64 = 1e-5;
/// Over such a change of its exponent the series of exp to the third power is right to 1e-8.
const LITTLE: f64 = 0.02;

/// Coefficients of one step. With the mean speed ω̄ of the step:
/// current → settled + (current − settled)·`end`, settled = (net voltage − Ke·ω̄)·`conductance`,
/// torque = `per_volt`·net + `per_ampere`·current − damping·ω̄.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coefficients {
    pub resistance: f64,
    step: f64,
    kt: f64,
    /// R·h/L and its exp(−x), computed anew when the resistance has changed much.
    exact: (f64, f64),
    /// 1/R.
    pub conductance: f64,
    /// Rest of the current's deviation at the end of the step.
    pub end: f64,
    /// Rest of the current's deviation on the mean over the step.
    pub mean: f64,
    /// Torque per volt of net voltage.
    pub per_volt: f64,
    /// Torque per ampere at the start.
    pub per_ampere: f64,
    /// Damping by the back-EMF.
    pub back_emf: f64,
    /// The rigid shaft with the bridge closed: for positive and negative speed.
    pub closed: [Shaft; 2],
    /// The rigid shaft with the bridge open: for positive and negative speed.
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
        let whole = 1.0 / (1.0 + half);
        Self { damping, keep: (1.0 - half) * whole, mobility: h / inertia * whole }
    }
}

impl Coefficients {
    /// For a resistance, a torque constant and a step length.
    pub fn new(p: &Physics, resistance: f64, kt: f64, h: f64) -> Self {
        let x = resistance * h / p.inductance.max(1e-12);
        let open = [p.viscous_pos, p.viscous_neg].map(|uneven| Shaft::new(p.inertia, p.viscous + uneven, h));
        let mut made = Self {
            resistance,
            step: h,
            kt,
            exact: (x, (-x).exp()),
            conductance: 0.0,
            end: 0.0,
            mean: 0.0,
            per_volt: 0.0,
            per_ampere: 0.0,
            back_emf: 0.0,
            closed: open,
            open,
        };
        made.vary(p, resistance, kt);
        made
    }

    /// Takes on another resistance and torque constant; the step stays.
    #[inline]
    pub fn vary(&mut self, p: &Physics, resistance: f64, kt: f64) {
        let h = self.step;
        let x = resistance * h / p.inductance.max(1e-12);
        if (x - self.exact.0).abs() > LITTLE {
            self.exact = (x, (-x).exp());
        }
        let d = x - self.exact.0;
        self.end = self.exact.1 * (1.0 - d * (1.0 - 0.5 * d * (1.0 - d / 3.0)));
        self.mean = if x < 1e-6 { 1.0 - 0.5 * x } else { (1.0 - self.end) / x };
        (self.resistance, self.kt) = (resistance, kt);
        self.conductance = 1.0 / resistance;
        let share = (1.0 - self.mean) * self.conductance;
        self.per_volt = kt * share;
        self.per_ampere = kt * self.mean;
        self.back_emf = if p.drive == Drive::Torque { 0.0 } else { kt * p.ke * share };
        self.closed[0] = Shaft::new(p.inertia, self.open[0].damping + self.back_emf, h);
        self.closed[1] = if p.viscous_pos == p.viscous_neg {
            self.closed[0]
        } else {
            Shaft::new(p.inertia, self.open[1].damping + self.back_emf, h)
        };
    }

    /// True if they hold for steps of this length.
    #[inline]
    pub fn step_is(&self, h: f64) -> bool {
        (self.step - h).abs() <= SAME_STEP * h
    }

    /// True if they serve for another step too.
    #[inline]
    pub fn serve(&self, resistance: f64, kt: f64, h: f64) -> bool {
        self.resistance == resistance && self.kt == kt && self.step_is(h)
    }
}
