//! What a step needs of winding, inertia and viscous friction, computed once for a step length and a resistance.

use super::features::Features;
use super::physics::{Drive, Physics};
use super::simd::{Lanes, Mask, alternating, decayed};

/// Steps whose lengths differ by less than this (relative) are the same step: time stamps are rounded in every file.
/// Chosen by judgement; not studied.
const SAME_STEP: f64 = 1e-5;
/// Over such a change of its exponent the series of exp to the third power is right to 1e-8. Origin: the next term,
/// x⁴/24.
const LITTLE: f64 = 0.02;
/// Up to here the series of (1 − exp(−x))/x to the sixth power is right to 1e-9. Origin: the next term, x⁷/40320.
const SERIES: f64 = 0.2;

/// (1 − exp(−x))/x as a series of x, to x⁷. Origin: Taylor.
const LOST: [f64; 8] = alternating(1, 1.0);

/// Coefficients of one step. With the mean speed ω̄ of the step:
/// current → settled + (current − settled)·`end`, settled = (net voltage − Ke·ω̄)·`conductance`,
/// torque = `per_volt`·net + `per_ampere`·current − damping·ω̄.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients<F = f64> {
    /// Ω.
    pub resistance: F,
    step: f64,
    kt: F,
    /// R·h/L and its exp(−x), computed anew when the resistance has changed much.
    exact: (F, F),
    /// h/L.
    per_ohm: F,
    /// 1/J.
    per_inertia: F,
    /// 1/R.
    pub conductance: F,
    /// Rest of the current's deviation at the end of the step.
    pub end: F,
    /// Rest of the current's deviation on the mean over the step.
    pub mean: F,
    /// Torque per volt of net voltage.
    pub per_volt: F,
    /// Torque per ampere at the start.
    pub per_ampere: F,
    /// Damping by the back-EMF.
    pub back_emf: F,
    /// The rigid shaft with the bridge closed: for positive and negative speed.
    pub closed: [Shaft<F>; 2],
    /// The rigid shaft with the bridge open: for positive and negative speed.
    pub open: [Shaft<F>; 2],
    /// Rest of the winding's heat after the step.
    pub cooling: F,
    /// Rest of the rail's deviation after the step.
    pub rail: F,
    /// Rest of the sensor's lag after the step.
    pub lag: F,
}

/// A shaft with viscous friction under a constant torque T, solved exactly: ω1 = `keep`·ω0 + `mobility`·T.
#[derive(Clone, Copy, Debug)]
pub struct Shaft<F = f64> {
    /// N m s/rad.
    pub damping: F,
    /// What is left of the speed.
    pub keep: F,
    /// Speed per torque.
    pub mobility: F,
    /// The mean speed of the step is ω0 + `mean`·(ω1 − ω0); a half where nothing damps.
    pub mean: F,
}

impl<F: Lanes> Shaft<F> {
    #[inline(always)]
    fn new(per_inertia: F, damping: F, h: f64) -> Self {
        let reach = per_inertia * h;
        let x = damping * reach;
        let lost = lost_share(x);
        // 1/(1 − exp(−x)) − 1/x, from its series where that is right to 1e-10.
        let series = x * (x * x * (-1.0 / 720.0) + 1.0 / 12.0) + 0.5;
        let little = x.abs().le(x.like(0.1));
        let mean = if little.all() { series } else { F::select(little, series, (-lost + 1.0) / (x * lost)) };
        Self { damping, keep: -(x * lost) + 1.0, mobility: lost * reach, mean }
    }

    /// One shaft or the other, set by set.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            damping: F::select(mask, yes.damping, no.damping),
            keep: F::select(mask, yes.keep, no.keep),
            mobility: F::select(mask, yes.mobility, no.mobility),
            mean: F::select(mask, yes.mean, no.mean),
        }
    }
}

/// What is left of a deviation after a step.
#[inline(always)]
fn left<F: Lanes>(h: f64, time: F) -> F {
    (time.like(h) / time).map(decayed)
}

/// (1 − exp(−x))/x.
#[inline(always)]
fn lost_share<F: Lanes>(x: F) -> F {
    let series = x.polynomial(x, &LOST);
    let little = x.abs().le(x.like(SERIES));
    if little.all() { series } else { F::select(little, series, x.map(|x| -(-x).exp_m1() / x)) }
}

impl<F: Lanes> Coefficients<F> {
    /// Of a plant. They hold for no step yet; conductance and mean, from which a varying winding is predicted, are those of a long one.
    #[inline(always)]
    pub fn new(p: &Physics<F>) -> Self {
        let (kt, resistance) = (p.kt, p.resistance);
        let (none, far) = (kt.like(0.0), kt.like(f64::INFINITY));
        let still = Shaft { damping: none, keep: none, mobility: none, mean: none };
        Self {
            resistance,
            step: f64::NAN,
            kt,
            exact: (far, none),
            per_ohm: none,
            per_inertia: kt.like(1.0) / p.inertia,
            conductance: kt.like(1.0) / resistance,
            end: none,
            mean: p.inductance / resistance,
            per_volt: none,
            per_ampere: none,
            back_emf: none,
            closed: [still; 2],
            open: [still; 2],
            cooling: none,
            rail: none,
            lag: none,
        }
    }

    /// Takes on another step length; the winding must be taken on again ([`Self::vary`]). In its place: a copy of them all would cost as
    /// much as they do.
    #[inline(always)]
    pub fn step_by(&mut self, p: &Physics<F>, features: &Features, h: f64) {
        self.step = h;
        self.per_ohm = self.kt.like(h) / p.inductance.max(self.kt.like(1e-12));
        self.open[0] = Shaft::new(self.per_inertia, p.viscous + p.viscous_pos, h);
        self.open[1] = if features.uneven {
            Shaft::new(self.per_inertia, p.viscous + p.viscous_neg, h)
        } else {
            self.open[0]
        };
        if features.heat {
            self.cooling = left(h, p.heat_time_s);
        }
        if features.slow_rail {
            self.rail = left(h, p.source_ohm * p.bus_farad);
        }
        if features.sensor_lag {
            self.lag = left(h, p.sensor_lag_s);
        }
    }

    /// Takes on another resistance and torque constant; the step stays.
    #[inline(always)]
    pub fn vary(&mut self, p: &Physics<F>, features: &Features, resistance: F, kt: F) {
        let h = self.step;
        let x = resistance * self.per_ohm;
        let far = (x - self.exact.0).abs().gt(x.like(LITTLE));
        if far.any() {
            let anew = x.map(decayed);
            self.exact = (F::select(far, x, self.exact.0), F::select(far, anew, self.exact.1));
        }
        let d = x - self.exact.0;
        let third = -(d * (1.0 / 3.0)) + 1.0;
        let second = -(d * third * 0.5) + 1.0;
        self.end = self.exact.1 * (-(d * second) + 1.0);
        let exact = (-self.end + 1.0) / x;
        self.mean = F::select(x.lt(x.like(1e-6)), -(x * 0.5) + 1.0, exact);
        (self.resistance, self.kt) = (resistance, kt);
        self.conductance = x.like(1.0) / resistance;
        let share = (-self.mean + 1.0) * self.conductance;
        self.per_volt = kt * share;
        self.per_ampere = kt * self.mean;
        self.back_emf = if features.drive == Drive::Torque { kt.like(0.0) } else { kt * p.ke * share };
        self.closed[0] = Shaft::new(self.per_inertia, self.open[0].damping + self.back_emf, h);
        self.closed[1] = if features.uneven {
            Shaft::new(self.per_inertia, self.open[1].damping + self.back_emf, h)
        } else {
            self.closed[0]
        };
    }

    /// True if they hold for steps of this length.
    #[inline(always)]
    pub fn step_is(&self, h: f64) -> bool {
        (self.step - h).abs() <= SAME_STEP * h
    }

    /// True if they serve for another step too.
    #[inline(always)]
    pub fn serve(&self, resistance: F, kt: F, h: f64) -> bool {
        let same = self.resistance.ge(resistance) & self.resistance.le(resistance);
        self.step_is(h) && (same & self.kt.ge(kt) & self.kt.le(kt)).all()
    }
}
