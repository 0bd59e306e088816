//! What of a plant is there at all, and how finely it is simulated: what sets must have in common to be advanced in lock-step.

use super::input::Chain;
use super::laws::{Acts, Law};
use super::physics::{Drive, Physics};
use super::step_size::{Coupling, StepSize};

/// Step lengths to an octave. Sets whose time constants differ by a few per cent mostly take the same steps; rounding
/// down to one costs at most 9 % of the steps. Chosen by judgement.
const STEPS_PER_OCTAVE: f64 = 8.0;
/// Rates of springs and teeth to an octave. An evolution draws rates that differ by a quarter, and only what is
/// rounded to one rate advances together; that costs at most 41 % of the pieces of a step, a fifth on average.
/// Origin: on the rig `durham_elevator` 8 % fewer steps and a third fewer passes than with eight.
const RATES_PER_OCTAVE: f64 = 2.0;
/// Two bodies are joined by a trapezoid that is not exact: their step is at most this part of the time constant.
/// Chosen by judgement; not studied.
const LONGEST_OF_TWO: f64 = 1.0 / 45.0;

/// Which kinds of effects are there: the others cost nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Features {
    pub(super) drive: Drive,
    pub(super) at_load: bool,
    pub(super) heat: bool,
    pub(super) source: bool,
    pub(super) slow_rail: bool,
    pub(super) knee: bool,
    pub(super) brushes: bool,
    pub(super) current_limit: bool,
    pub(super) dry: bool,
    pub(super) breakaway: bool,
    pub(super) gear_friction: bool,
    pub(super) uneven: bool,
    pub(super) drag: bool,
    pub(super) chain: Chain,
    pub(super) rectified: bool,
    pub(super) sensor_lag: bool,
    pub(super) sensor_limit: bool,
    pub(super) unnamed: bool,
    pub(super) step_size: StepSize,
}

impl StepSize {
    /// Those of a plant.
    pub fn of(p: &Physics) -> Self {
        let coupling = coupling(p);
        // Another coupling has other rates.
        let given = p.step_size.filter(|step_size| step_size.coupling == coupling);
        given.unwrap_or_else(|| Self { coupling, time: below(p.time_constant_s()), rate: rate(p) })
    }
}

impl Physics {
    /// The same plant, to be advanced by the steps of another one. What is compared with that other one, for a derivative, must not
    /// differ by its steps too.
    pub fn in_steps_of(self, other: &Self) -> Self {
        Self { step_size: Some(StepSize::of(other)), ..self }
    }

    /// Plants that differ little, all to be advanced by the steps of those that need the shortest.
    pub fn in_step(mut plants: Vec<Self>) -> Vec<Self> {
        let finest = plants.iter().map(StepSize::of).reduce(StepSize::finer);
        plants.iter_mut().for_each(|plant| plant.step_size = finest);
        plants
    }
}

impl Features {
    /// That of a plant.
    pub fn of(p: &Physics) -> Self {
        let gear_friction = p.friction_per_motor > 0.0 || p.friction_per_load > 0.0;
        let breakaway = p.breakaway_extra > 0.0;
        let against = p.torques.iter().any(|law| law.acts == Acts::Friction);
        Self {
            drive: p.drive,
            at_load: p.encoder_at_load,
            heat: p.heat_rise_per_w > 0.0,
            source: p.source_ohm > 0.0,
            slow_rail: p.source_ohm > 0.0 && p.bus_farad > 0.0,
            knee: p.kt_knee_a.is_finite(),
            brushes: p.drop_v > 0.0 && p.drive == Drive::Voltage,
            current_limit: p.current_limit.is_finite(),
            dry: gear_friction || breakaway || against || p.friction_pos != 0.0 || p.friction_neg != 0.0,
            breakaway,
            gear_friction,
            drag: p.torques.iter().any(|law| law.law == Law::Drag),
            uneven: p.viscous_pos != p.viscous_neg,
            chain: Chain::of(p),
            rectified: p.sensor_rectified,
            sensor_lag: p.sensor_lag_s > 0.0,
            sensor_limit: p.sensor_limit.is_finite(),
            unnamed: !p.unnamed.is_empty(),
            step_size: StepSize::of(p),
        }
    }

    /// The kinds of its input chain.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Longest inner step, s, where it may be `finest` of the time constant.
    pub fn longest_step(&self, finest: f64) -> f64 {
        let finest = if self.two_bodies() { finest.min(LONGEST_OF_TWO) } else { finest };
        ((f64::from(self.step_size.time) / STEPS_PER_OCTAVE).exp2() * finest).max(1e-7)
    }

    /// Rate of spring or teeth, rad/s, rounded up.
    pub(super) fn rate_rad_s(&self) -> f64 {
        (f64::from(self.step_size.rate) / RATES_PER_OCTAVE).exp2()
    }

    pub(super) fn two_bodies(&self) -> bool {
        !matches!(self.step_size.coupling, Coupling::Rigid | Coupling::Play)
    }

    /// True if friction depends on the speed or on other torques.
    pub(super) fn varying_friction(&self) -> bool {
        self.breakaway || self.gear_friction
    }
}

/// True if two plants can be advanced in lock-step.
pub fn alike(a: &Physics, b: &Physics) -> bool {
    let laws = a.torques.iter().zip(&b.torques);
    Features::of(a) == Features::of(b)
        && a.torques.len() == b.torques.len()
        && laws.into_iter().all(|(a, b)| a.acts == b.acts && a.law == b.law)
        && a.unnamed.is_empty()
}

fn coupling(p: &Physics) -> Coupling {
    match (p.load_share > 0.0, p.stiffness.is_finite(), p.gap_rad > 0.0) {
        (true, true, _) => Coupling::Spring,
        (true, false, true) if p.contact_rad_s.is_finite() => Coupling::Contact,
        (true, false, true) => Coupling::Gap,
        (false, _, true) => Coupling::Play,
        _ => Coupling::Rigid,
    }
}

fn rate(p: &Physics) -> i32 {
    match coupling(p) {
        Coupling::Contact => above(p.contact_rad_s),
        Coupling::Spring if p.contact_rad_s.is_finite() => above(p.contact_rad_s),
        Coupling::Spring => above(p.resonance_rad_s()),
        _ => i32::MIN,
    }
}

fn below(value: f64) -> i32 {
    (STEPS_PER_OCTAVE * value.log2()).floor() as i32
}

fn above(value: f64) -> i32 {
    (RATES_PER_OCTAVE * value.log2()).ceil() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_at_most_nine_per_cent_shorter_than_it_may_be() {
        for k in 0..100 {
            let plant = Physics::inertia(0.3 * 1.1f64.powi(k), 0.7, 1.0);
            let ratio = Features::of(&plant).longest_step(0.1) / (0.1 * plant.time_constant_s());
            assert!((0.916..=1.000_001).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn plants_with_other_effects_are_not_alike() {
        let plain = Physics::linear_motor(1.0, 1e-3, 0.1, 0.1, 1e-3, 1e-4);
        let dry = Physics { friction_pos: 1e-3, ..plain.clone() };
        let dryer = Physics { friction_pos: 2e-3, ..plain.clone() };
        let slower = Physics { inertia: 2e-3, ..plain.clone() };
        assert!(alike(&dry, &dryer) && !alike(&plain, &dry) && !alike(&plain, &slower));
    }

    #[test]
    fn a_plant_may_advance_in_the_steps_of_another_one() {
        let plain = Physics::linear_motor(1.0, 1e-3, 0.1, 0.1, 1e-3, 1e-4);
        let slower = Physics { inertia: 2e-3, ..plain.clone() };
        assert!(alike(&plain, &slower.clone().in_steps_of(&plain)));
        let sprung = Physics { load_share: 0.5, stiffness: 1.0, ..slower.clone() };
        assert_eq!(
            StepSize::of(&sprung.clone().in_steps_of(&plain)),
            StepSize::of(&sprung),
            "its spring is its own"
        );
        assert_eq!(StepSize::of(&slower).finer(StepSize::of(&plain)), StepSize::of(&plain));
    }
}
