//! The curve of a named effect in its own variable: what acts over the input, friction over the speed, torque over the turn. And in that
//! variable the place where the effect shows.

use crate::gap::fit::hypothesis::is_open;
use crate::gap::fit::samples::Sample;
use crate::gap::fit::scored::Scored;
use crate::outcome::{Curve, Plot, Role, Series, Stage, Style};
use crate::system::effects::{Domain, Effect, Meaning};
use crate::system::model::Kind;
use crate::system::plant::laws::{Law, Motion};
use crate::system::plant::physics::Physics;
use crate::text::figures::significant;
use std::f64::consts::TAU;

/// Bins of the data on either side of 0. For display, chosen by judgement.
const BINS: usize = 24;
/// Points of a drawn curve. For display, chosen by judgement.
const DRAWN: usize = 400;
/// Below this part of the largest speed or current its direction is not certain. Chosen by judgement; not studied.
const STANDSTILL: f64 = 0.01;

/// An effect in a plant.
pub struct Placed<'a> {
    /// The effect.
    pub effect: &'static Effect,
    /// Its parameters.
    pub values: &'a [f64],
    /// The plant that has it.
    pub plant: &'a Physics,
}

impl Placed<'_> {
    /// Where the effect shows, in words, with the units of input and speed. `both`: the data hold inputs of both signs.
    pub fn words(&self, [input, speed]: [&str; 2], both: bool) -> Option<String> {
        let told = |value: f64| significant(value, 4);
        let edges = self.edges().map(|[low, high]| (told(low), told(high)));
        let (low, high) = edges.unwrap_or_default();
        Some(match self.effect.domain {
            Domain::Nowhere => return None,
            Domain::SmallInputs if !both => format!("below {high} {input} of input"),
            Domain::LargeInputs if !both => format!("above {high} {input} of input"),
            Domain::SmallInputs => format!("between {low} and {high} {input} of input"),
            Domain::LargeInputs => format!("below {low} and above {high} {input} of input"),
            Domain::Current => "wherever a current flows, against it".into(),
            Domain::Direction => "at every speed, against the motion".into(),
            Domain::SlowMotion => format!("at every speed, most of all below {high} {speed}"),
            Domain::FastMotion => "the more the faster the motion".into(),
            Domain::Turn => match self.periods() {
                Some(periods) => format!("{} times a turn", told(periods)),
                None => "once a turn of the load".into(),
            },
        })
    }

    /// The inputs or speeds between which, or beyond which, it shows.
    fn edges(&self) -> Option<[f64; 2]> {
        let p = self.plant;
        let command = |input: f64| (input - p.drive_offset) / p.drive_gain;
        match self.effect.domain {
            Domain::SmallInputs => Some([-p.dead_neg, p.dead_pos].map(command)),
            Domain::LargeInputs => {
                Some([-p.limit * p.limit_skew - p.dead_neg, p.limit + p.dead_pos].map(command))
            }
            Domain::SlowMotion => Some([-p.stribeck_speed, p.stribeck_speed]),
            _ => None,
        }
    }

    /// Periods per turn of the encoder's shaft, of an effect that has such a number.
    fn periods(&self) -> Option<f64> {
        self.effect.place(Meaning::PeriodsPerTurn).map(|place| self.values[place])
    }

    /// Length of a period, rad of the encoder's shaft, and how much of that is 1 on the axis.
    fn turn(&self) -> (f64, f64) {
        let gear = self.plant.gear_ratio;
        self.periods().map_or((TAU * gear, gear), |periods| (TAU / periods, 1.0))
    }

    /// The variable at a sample.
    fn variable(&self, sample: &Sample) -> f64 {
        match self.effect.domain {
            Domain::SmallInputs | Domain::LargeInputs => sample.input,
            Domain::Current => sample.current,
            Domain::Turn => sample.position.rem_euclid(self.turn().0) / self.turn().1,
            _ => sample.omega,
        }
    }

    /// What a plant does at a value of the variable: input that acts, drop, torque, friction.
    fn law(&self, plant: &Physics, x: f64) -> f64 {
        match self.effect.domain {
            Domain::SmallInputs | Domain::LargeInputs => plant.applied(x),
            Domain::Current => plant.drop_v * x.signum(),
            Domain::Turn => torques(plant, x * self.turn().1, 0.0, |law| law != Law::Drag),
            _ => friction(plant, x),
        }
    }

    /// That law up to the widest value of the variable.
    fn sampled(&self, plant: &Physics, widest: f64, size: f64) -> Curve {
        let low = if self.effect.domain == Domain::Turn { 0.0 } else { -widest };
        let x: Vec<f64> = (0..=DRAWN).map(|k| low + (widest - low) * k as f64 / DRAWN as f64).collect();
        Curve { y: x.iter().map(|x| self.law(plant, *x) / size).collect(), x }
    }

    /// The same in the units of the picture, for a missing torque.
    fn of_torque(&self, torque: f64) -> f64 {
        match self.effect.domain {
            Domain::SmallInputs | Domain::LargeInputs => torque / self.plant.torque_per_input(),
            Domain::Current => -torque / self.plant.torque_per_input(),
            Domain::Turn => torque,
            _ => -torque,
        }
    }
}

/// The curve from the data, from the model without the effect and from the model with it. `with`, `without`: what each of them simulates. What
/// the model without it lacks at a sample stands over what the model with it is doing.
pub fn plot(kept: &Scored, index: usize, with: &[Sample], without: (&Physics, &[Sample])) -> Option<Plot> {
    let (dataset, plant) = (kept.hypothesis.dataset, kept.plant());
    let values = kept.hypothesis.values(index, &kept.fit.x);
    let it = Placed { effect: kept.hypothesis.items[index].effect, values: &values, plant: &plant };
    let (name, domain) = (it.effect.name, it.effect.domain);
    let of_current = matches!(domain, Domain::SmallInputs | Domain::LargeInputs | Domain::Current);
    let (input, torque) = (dataset.input.unit(), torque_unit(kept));
    let (unit, size) = if of_current { (input, 1.0) } else { torque };
    let [what, over] = axes(domain, dataset.linear, input)?;
    let widest = with.iter().map(|s| it.variable(s).abs()).fold(0.0, f64::max);
    // A missing torque is a mean over a tenth of the time constant: within it the place in a period must hardly move.
    let sure = |s: &Sample| match domain {
        Domain::SmallInputs | Domain::LargeInputs => !s.open,
        Domain::Turn => s.omega.abs() * plant.time_constant_s() < it.turn().0,
        _ => it.variable(s).abs() >= STANDSTILL * widest && !(of_current && s.open),
    };
    let pairs = without.1.iter().zip(with).filter(|(_, s)| sure(s));
    let point = |(lacking, s): (&Sample, &Sample)| {
        let x = it.variable(s);
        (x, (it.law(without.0, x) + it.of_torque(lacking.torque)) / size)
    };
    let sides: (Vec<_>, Vec<_>) = pairs.map(point).partition(|(x, _)| *x < 0.0);
    let (back, ahead) = (Curve::binned(sides.0, BINS), Curve::binned(sides.1, BINS));
    let data = Curve { x: [back.x, ahead.x].concat(), y: [back.y, ahead.y].concat() };
    if data.x.len() < BINS {
        return None;
    }
    let curve = |plant: &Physics| it.sampled(plant, widest, size);
    Some(Plot {
        title: format!("The curve of {name}"),
        caption: format!(
            "Points: what the data say where the model lacks {name}, means over bins of the simulated motion."
        ),
        stage: Stage::Characterisation,
        x_label: over,
        y_label: format!("{what}, {unit}"),
        series: vec![
            Series::new("extended model", curve(&plant), Style::Line).of(Role::Extended),
            Series::new(&format!("without {name}"), curve(without.0), Style::Dashed).of(Role::Given),
            Series::new("measured", data, Style::Points).of(Role::Measured),
        ],
        marks: it.edges().into_iter().flatten().map(|at| (at, significant(at, 4))).collect(),
        ..Plot::default()
    })
}

/// What the curve tells, and over what.
fn axes(domain: Domain, linear: bool, input: &str) -> Option<[String; 2]> {
    let (what, over) = match domain {
        Domain::Nowhere => return None,
        Domain::SmallInputs | Domain::LargeInputs => ("input that acts", format!("input, {input}")),
        Domain::Current => ("drop", "current, A".into()),
        Domain::Turn => ("torque", "angle within a period, rad".into()),
        _ => ("friction", if linear { "speed, m/s" } else { "speed, rad/s" }.into()),
    };
    Some([what.into(), over])
}

/// The unit in which a torque is told, and its size: a model that does not know torques counts in its input.
pub fn torque_unit(kept: &Scored) -> (&'static str, f64) {
    let (model, dataset) = (kept.hypothesis.model, kept.hypothesis.dataset);
    match (matches!(model.kind, Kind::FirstOrder { .. }) || is_open(model), dataset.linear) {
        (true, _) => (dataset.input.unit(), kept.plant().torque_per_input()),
        (_, true) => ("N", 1.0),
        _ => ("N m", 1.0),
    }
}

/// What resists the motion at a speed.
fn friction(plant: &Physics, omega: f64) -> f64 {
    let (level, more) = match omega < 0.0 {
        true => (plant.friction_neg, plant.viscous_neg),
        false => (plant.friction_pos, plant.viscous_pos),
    };
    let breakaway = plant.breakaway_extra * (-(omega / plant.stribeck_speed).powi(2)).exp();
    (plant.viscous + more) * omega + omega.signum() * (level + breakaway)
        - torques(plant, 0.0, omega, |law| law == Law::Drag)
}

/// The torques of some laws at an angle and a speed.
fn torques(plant: &Physics, theta: f64, omega: f64, which: impl Fn(Law) -> bool) -> f64 {
    let motion = Motion { time_s: 0.0, theta, theta_next: theta, omega, gear_ratio: plant.gear_ratio };
    plant.torques.iter().filter(|it| which(it.law)).map(|it| it.torque(&motion)).sum()
}
