//! One step of winding, friction and inertia, for one plant or for several in lock-step.
//!
//! The winding is solved exactly for a constant mean back-EMF and the shaft for a constant torque, so that neither a small L/R nor
//! viscous friction costs small steps; speed and back-EMF are coupled implicitly, so that no motor is too fast; friction acts as a
//! proximal step (Acary, Brogliato: Numerical Methods for Nonsmooth Dynamical Systems, 2008): true sticking without switching logic.
//!
//! Sets in lock-step have the same [`Features`]: what it says is asked once for all of them. What differs from set to set is computed both
//! ways and selected.

use super::external::{Torques, drag};
use super::features::Features;
use super::formulas::{Moved, contact_pieces, halfway, resonance_pieces, select, softened};
use super::laws::Law;
use super::physics::{Drive, Physics};
use super::simd::{Lanes, Mask, decayed};
use super::state::State;
use super::step::{Before, Driven, Loads, Places, slowed_from};
use super::step_size::Coupling;
use super::two_bodies::{self, TwoBodies};
use super::unnamed_step;
pub use super::winding::Coefficients;
use super::winding::Shaft;
use servo::axis::Bridge;

/// Advances a [`State`]. Keeps the coefficients of the last step length.
#[derive(Clone, Debug)]
pub struct Dynamics<'a, F = f64> {
    plant: &'a Physics<F>,
    features: Features,
    /// Those of the last step.
    pub coefficients: Coefficients<F>,
    /// External torques over the block that the steps are parts of, where they do not depend on the state.
    held: Option<Loads<F>>,
}

impl<'a, F: Lanes> Dynamics<'a, F> {
    /// For a plant with these features.
    #[inline(always)]
    pub fn new(plant: &'a Physics<F>, features: Features) -> Self {
        Self { plant, features, coefficients: Coefficients::new(plant), held: None }
    }

    /// Goes on where another one has stopped: a winding that varies has coefficients that follow from those before.
    pub fn resumed(plant: &'a Physics<F>, features: Features, coefficients: Coefficients<F>) -> Self {
        Self { plant, features, coefficients, held: None }
    }

    /// Begins a block of `length` seconds on a known way: what depends on the place alone is the same for all steps within it. (Their
    /// places would lie on the straight line between its ends.)
    #[inline(always)]
    pub fn hold(&mut self, state: &State<F>, length: f64, way: (F, F)) {
        let on_time = self.plant.torques.iter().any(|law| law.law == Law::Periodic);
        self.held = (!on_time).then(|| self.steady_loads(state, length, Some(way)));
    }

    /// Advances by `h` seconds with a constant voltage (or torque input) behind the input chain. `position`: where
    /// the shaft is known to be at start and end of the step (measured), for torques that depend on it. Returns the number of
    /// inner steps.
    #[inline(always)]
    pub fn advance(&mut self, state: &mut State<F>, input: F, bridge: Bridge, h: f64, at: Places<F>) -> u64 {
        if !self.features.two_bodies() {
            self.step::<false>(state, input, bridge, h, at);
            return 1;
        }
        let turned = h * self.features.rate_rad_s();
        let pieces = match self.features.step_size.coupling {
            Coupling::Contact => contact_pieces(turned),
            Coupling::Spring => resonance_pieces(turned),
            _ => 1.0,
        };
        let mut from = at;
        for piece in 0..pieces as usize {
            let part = (piece + 1) as f64 / pieces;
            let places = match (at, from) {
                (Some((start, end)), Some((from, _))) => Some((from, start + (end - start) * part)),
                _ => None,
            };
            self.step::<true>(state, input, bridge, h / pieces, places);
            from = places.map(|(_, to)| (to, to));
        }
        pieces as u64
    }

    /// One inner step; `TWO`: of two bodies.
    #[inline(always)]
    fn step<const TWO: bool>(&mut self, now: &mut State<F>, input: F, bridge: Bridge, h: f64, at: Places<F>) {
        let before = Before::of(now);
        self.renew(now, input, bridge, h);
        let driven = self.driven(now, input, bridge, h);
        let (omega, omega_load, mean) = self.moved_under_loads::<TWO>(now, &driven, at);
        self.settle_current(now, &driven, omega, mean);
        if self.features.source {
            self.settle_supply(now, input);
        }
        now.time_s += h;
        now.theta = now.theta + (before.omega + mean * (omega - before.omega)) * h;
        now.omega = omega;
        self.settle_load::<TWO>(now, &before, omega_load, h);
        self.plant.sense(&self.features, now, &before, h, self.coefficients.lag);
        if self.features.unnamed {
            self.terms(&driven, at).remember(now, &before);
        }
    }

    #[inline(always)]
    fn terms<'s>(&'s self, driven: &'s Driven<F>, places: Places<F>) -> unnamed_step::Step<'s, F> {
        unnamed_step::Step { plant: self.plant, coefficients: &self.coefficients, driven, places }
    }

    /// Makes sure that the coefficients are those of this step.
    #[inline(always)]
    fn renew(&mut self, state: &State<F>, applied: F, bridge: Bridge, h: f64) {
        let p = self.plant;
        let (resistance, kt) = if self.features.heat || self.features.source || self.features.knee {
            (self.resistance(state, applied, h), self.weakened(state, applied, bridge))
        } else {
            (p.resistance, p.kt)
        };
        if self.coefficients.serve(resistance, kt, h) {
            return;
        }
        if !self.coefficients.step_is(h) {
            self.coefficients.step_by(p, &self.features, h);
        }
        self.coefficients.vary(p, &self.features, resistance, kt);
    }

    /// The torque constant at the mean current of the step, as the last step's winding predicts it: with the current at the start,
    /// the torque would lag half a step behind.
    #[inline(always)]
    fn weakened(&self, state: &State<F>, applied: F, bridge: Bridge) -> F {
        let (p, c) = (self.plant, &self.coefficients);
        if !self.features.knee {
            return p.kt;
        }
        let mean = if bridge != Bridge::Open && p.drive == Drive::Voltage {
            let volts = if bridge == Bridge::Driven { applied } else { applied.like(0.0) };
            let settled = (volts - p.ke * state.omega) * c.conductance;
            (settled + (state.current - settled) * c.mean).within(p.current_limit)
        } else {
            state.current
        };
        p.kt * softened(mean, p.kt_knee_a)
    }

    /// Winding resistance with heat and the supply's source (referred through the duty) in the middle of the step.
    #[inline(always)]
    fn resistance(&self, state: &State<F>, applied: F, h: f64) -> F {
        let p = self.plant;
        let mut resistance = p.resistance;
        if self.features.heat {
            let loss = state.current * state.current * self.coefficients.resistance;
            let heat_w = halfway(state.heat_w, loss, h, p.heat_time_s);
            resistance = p.resistance * (p.heat_rise_per_w * heat_w + 1.0);
        }
        if self.features.source && !self.features.slow_rail {
            let duty = applied / p.supply_v;
            resistance = resistance + p.source_ohm * duty * duty;
        }
        resistance
    }

    /// The voltage across the winding before back-EMF, or the torque input.
    #[inline(always)]
    fn driven(&self, state: &State<F>, applied: F, bridge: Bridge, h: f64) -> Driven<F> {
        let p = self.plant;
        let none = applied.like(0.0);
        let free = Driven { net: none, blocked: none.gt(none), bridge, h };
        if bridge != Bridge::Driven && (bridge == Bridge::Open || p.drive == Drive::Torque) {
            return free;
        }
        if p.drive == Drive::Torque {
            return Driven { net: applied.within(p.current_limit), ..free };
        }
        let terminal = if bridge == Bridge::Shorted {
            none
        } else if self.features.slow_rail {
            let drawn = applied / p.supply_v * state.current;
            let settled = p.supply_v - p.source_ohm * drawn;
            applied * halfway(state.supply_v, settled, h, p.source_ohm * p.bus_farad) / p.supply_v
        } else {
            applied
        };
        if self.features.brushes {
            self.behind_brushes(state, terminal, free)
        } else {
            Driven { net: terminal, ..free }
        }
    }

    /// Brushes take their drop from the side to which the current goes; it cannot turn the current round.
    #[inline(always)]
    fn behind_brushes(&self, state: &State<F>, terminal: F, free: Driven<F>) -> Driven<F> {
        let (p, c) = (self.plant, &self.coefficients);
        let settled = (terminal - p.ke * state.omega) * c.conductance;
        let next = settled + (state.current - settled) * c.end;
        let threshold = p.drop_v * c.conductance * (-c.end + 1.0);
        Driven { net: terminal - p.drop_v.copysign(next), blocked: !next.abs().gt(threshold), ..free }
    }

    /// The shaft of one direction or the other.
    #[inline(always)]
    fn side(&self, state: &State<F>, shafts: &[Shaft<F>; 2]) -> Shaft<F> {
        if !self.features.uneven {
            return shafts[0];
        }
        Shaft::select(state.omega.lt(state.omega.like(0.0)), &shafts[1], &shafts[0])
    }

    /// Torque at zero mean speed, and the shaft that it moves.
    #[inline(always)]
    fn torque(&self, state: &State<F>, driven: &Driven<F>) -> (F, Shaft<F>) {
        let (p, c) = (self.plant, &self.coefficients);
        if driven.bridge == Bridge::Open {
            return (driven.net.like(0.0), self.side(state, &c.open));
        }
        if p.drive == Drive::Torque {
            let held = p.force_gain * driven.net;
            let softened = if self.features.knee { held * softened(driven.net, p.kt_knee_a) } else { held };
            return (softened, self.side(state, &c.open));
        }
        let held = c.per_ampere * state.current;
        let (torque, closed) = (c.per_volt * driven.net + held, self.side(state, &c.closed));
        if !self.features.brushes {
            return (torque, closed);
        }
        let shaft = Shaft::select(driven.blocked, &self.side(state, &c.open), &closed);
        (F::select(driven.blocked, held, torque), shaft)
    }

    /// The speeds under known loads; a current beyond its limit is held there.
    #[inline(always)]
    fn moved<const TWO: bool>(&self, state: &State<F>, driven: &Driven<F>, loads: &Loads<F>) -> Moved<F> {
        let (torque, shaft) = self.torque(state, driven);
        let open = driven.bridge == Bridge::Open || self.plant.drive == Drive::Torque;
        let limited = self.features.current_limit && !open;
        let limit = self.plant.current_limit;
        let free = self.pushed::<TWO>(state, torque, &shaft, loads, driven.h);
        if !limited {
            return free;
        }
        let (_, mean) = self.currents(state, driven, free.0, free.2);
        let beyond = mean.abs().gt(limit);
        if !beyond.any() {
            return free;
        }
        let knee = if self.features.knee { softened(limit, self.plant.kt_knee_a) } else { limit.like(1.0) };
        let torque = self.plant.kt * knee * limit.copysign(mean);
        let shaft = self.side(state, &self.coefficients.open);
        select(beyond, self.pushed::<TWO>(state, torque, &shaft, loads, driven.h), free)
    }

    #[inline(always)]
    fn pushed<const TWO: bool>(
        &self,
        state: &State<F>,
        torque: F,
        shaft: &Shaft<F>,
        loads: &Loads<F>,
        h: f64,
    ) -> Moved<F> {
        if TWO {
            let (plant, features, damping) = (self.plant, &self.features, shaft.damping);
            let (omega, omega_load) =
                torque.apart(TwoBodies { plant, features, state, torque, damping, loads, h });
            return (omega, omega_load, omega.like(0.5));
        }
        let pushed = shaft.mobility * (torque + loads.motor + loads.load);
        let free = shaft.keep * state.omega + pushed;
        let none = free.like(0.0);
        if !self.features.dry {
            return (free, none, shaft.mean);
        }
        (slowed_from(state.omega, free, pushed, shaft.mobility, loads), none, shaft.mean)
    }

    /// Current at the end of the step and its mean, from the speed at the end and its weight in the mean speed.
    #[inline(always)]
    fn currents(&self, state: &State<F>, driven: &Driven<F>, omega: F, weight: F) -> (F, F) {
        let c = &self.coefficients;
        let mean = state.omega + weight * (omega - state.omega);
        let settled = (driven.net - self.plant.ke * mean) * c.conductance;
        let rest = state.current - settled;
        let (end, mean) = (settled + rest * c.end, settled + rest * c.mean);
        if !self.features.brushes {
            return (end, mean);
        }
        let blocked = driven.blocked;
        (F::select(blocked, end.like(0.0), end), F::select(blocked, state.current * c.mean, mean))
    }

    #[inline(always)]
    fn settle_current(&self, state: &mut State<F>, driven: &Driven<F>, omega: F, weight: F) {
        let none = omega.like(0.0);
        let (end, mean) = if driven.bridge == Bridge::Open {
            (none, none)
        } else if self.plant.drive == Drive::Torque {
            (driven.net, driven.net)
        } else {
            self.currents(state, driven, omega, weight)
        };
        if self.features.current_limit {
            let limit = self.plant.current_limit;
            (state.current, state.mean_current) = (end.within(limit), mean.within(limit));
        } else {
            (state.current, state.mean_current) = (end, mean);
        }
        if self.features.heat {
            let loss = state.mean_current * state.mean_current * self.coefficients.resistance;
            state.heat_w = loss + (state.heat_w - loss) * self.coefficients.cooling;
        }
    }

    #[inline(always)]
    fn settle_supply(&self, state: &mut State<F>, applied: F) {
        let p = self.plant;
        let drawn = applied / p.supply_v * state.mean_current;
        let settled = p.supply_v - p.source_ohm * drawn;
        state.supply_v = settled + (state.supply_v - settled) * self.coefficients.rail;
    }

    /// Speeds at the end of the step under torques and friction that depend on the speed: at first with those of its start, then with
    /// those of its middle.
    #[inline(always)]
    fn moved_under_loads<const TWO: bool>(&self, now: &State<F>, by: &Driven<F>, at: Places<F>) -> Moved<F> {
        let steady = self.held.unwrap_or_else(|| self.steady_loads(now, by.h, at));
        let again = self.features.varying_friction() || self.features.drag || self.features.unnamed;
        let mut moved = (now.omega, now.omega_load, now.omega);
        // A loop, not two calls: each would be compiled into every step.
        for _ in 0..1 + usize::from(again) {
            let middle = (now.omega + moved.0) * 0.5;
            moved = self.moved::<TWO>(now, by, &self.loads(now, middle, by, at, steady));
        }
        moved
    }

    /// What acts on the two sides of the gear, whatever the speed in the step.
    #[inline(always)]
    fn steady_loads(&self, state: &State<F>, h: f64, places: Places<F>) -> Loads<F> {
        let p = self.plant;
        let none = state.omega.like(0.0);
        let loads =
            Loads { motor: none, load: none, friction_pos: p.friction_pos, friction_neg: p.friction_neg };
        if p.torques.is_empty() { loads } else { none.apart(Torques { plant: p, state, h, places, loads }) }
    }

    /// What acts on the two sides of the gear at a speed.
    #[inline(always)]
    fn loads(&self, state: &State<F>, omega: F, by: &Driven<F>, at: Places<F>, steady: Loads<F>) -> Loads<F> {
        let mut loads = steady;
        if self.features.drag {
            loads.motor = loads.motor + drag(&self.plant.torques, omega);
        }
        if self.features.unnamed {
            loads.motor = loads.motor + self.terms(by, at).torque(state, omega);
        }
        if self.features.varying_friction() {
            let extra = self.extra_friction(state, omega, by, &loads);
            loads.friction_pos = loads.friction_pos + extra;
            loads.friction_neg = loads.friction_neg + extra;
        }
        loads
    }

    /// Breakaway near standstill, and what grows with the torque through the gear.
    #[inline(always)]
    fn extra_friction(&self, state: &State<F>, omega: F, driven: &Driven<F>, loads: &Loads<F>) -> F {
        let p = self.plant;
        let mut extra = omega.like(0.0);
        if self.features.breakaway {
            let ratio = omega / p.stribeck_speed;
            extra = p.breakaway_extra * (ratio * ratio).map(decayed);
        }
        if self.features.gear_friction {
            let (torque, shaft) = self.torque(state, driven);
            let motor = torque - (shaft.damping - p.viscous) * omega;
            extra = extra + p.friction_per_motor * motor.abs() + p.friction_per_load * loads.load.abs();
        }
        extra
    }

    #[inline(always)]
    fn settle_load<const TWO: bool>(&self, state: &mut State<F>, before: &Before<F>, omega_load: F, h: f64) {
        if TWO {
            return two_bodies::settle(self.plant, &self.features, state, before, omega_load, h);
        }
        match self.features.step_size.coupling {
            Coupling::Rigid => (state.theta_load, state.omega_load) = (state.theta, state.omega),
            _ => {
                let half = self.plant.gap_rad * 0.5;
                state.theta_load = before.theta_load.max(state.theta - half).min(state.theta + half);
                state.omega_load = (state.theta_load - before.theta_load) * (1.0 / h);
            }
        }
    }
}
