//! From a model with its effects to what the firmware's compensator and loops take: everything becomes a voltage at the
//! terminals, as the chip sees it.
//!
//! In the order of the plant's input chain, v = gain·u + offset passes the dead zone, then the limit; the current then
//! has to overcome the drop of the bridge, and its torque friction and load. What pushes one way, and a torque over the place, become
//! a table ([`crate::waves`]). Beside it the terminal voltage at which the shaft is about to move, positive direction, is
//!
//! ```text
//! u₊ = (zone₊ + drop + friction₊·R/Kt) / gain
//! ```
//!
//! and the one beyond which more command brings no more speed is (limit + zone − offset)/gain. Loops and feed-forward know
//! one time constant, so it holds the sum of all: of inertia, winding, a lag of the drive and a delay, as a motion that
//! changes slowly sees them. What a faster one sees is the lag: the coefficient of s² over that sum.
//!
//! A number is trusted as on the chip: a dead zone or a saturation whose half width of 95 % is below 12 % of it, gain and
//! time constant together with the dead zones. And no effect in it may be one name of a tie, or from a verdict that leaves
//! something unexplained (`standing` in the extended model).

use crate::waves::{self, Wave};
use servo::compensate::modelled::{BREAKAWAY, Modelled, NAMES, NUMBERS, PLAY};
use servo::config::Config;
use servo::identify::estimate::Mechanism;
use truing_core::system::effects::OnChip;
use truing_core::system::model::{Known, Model, NAMED};
use truing_core::system::plant::laws::Law;
use truing_core::system::plant::physics::Drive;
use truing_core::text::input_error::InputError;
use truing_servo::device::commission_report::{Kept, Params};
use truing_servo::device::motor::builtin;

/// Half width of the 95 % interval, standard deviations.
const U95: f64 = 1.96;

/// Half width of 95 %, as a share of the value, from which on a number is not trusted: that of the chip for dead zones.
const TRUST_LIMIT: f64 = 0.12;

/// Of the nominal supply, the largest steady voltage of the speed over which friction falls from breakaway. Published ones are thousandths
/// to hundredths; a third of the speed was fitted where it was drag. Chosen by judgement; not studied.
const NEAR_STANDSTILL: f64 = 0.1;
/// Share of a dead zone below which a part of it is compensated with the sign of the other one.
const LITTLE: f64 = 0.05;

/// What the firmware can take of a model.
pub struct Export {
    /// For `--params`.
    pub params: Params,
    /// What it has no parameter for: effects, and parameters as `effect.parameter`.
    pub left_out: Vec<String>,
    /// Numbers that are not trusted, each with the reason.
    pub doubts: Vec<String>,
}

impl Export {
    /// The file, with what is missing in it as comments.
    pub fn text(&self) -> Result<String, InputError> {
        let comments: String = self.remarks().iter().map(|remark| format!("# {remark}\n")).collect();
        Ok(comments + &self.params.text()?)
    }

    /// What a reader of the numbers has to know, a line each.
    pub fn remarks(&self) -> Vec<String> {
        let left_out = self.left_out.iter().map(|what| format!("not compensated by the firmware: {what}"));
        let doubts = self.doubts.iter().map(|doubt| format!("not trusted: {doubt}"));
        left_out.chain(doubts).collect()
    }
}

/// The numbers for the firmware, and what it cannot take.
pub fn from_model(model: &Model, config: &Config) -> Result<Export, InputError> {
    check(model, config)?;
    let mut value = Terminal::of(model);
    let finite = [value.gain, value.time_constant].into_iter().chain(value.dead_zone).all(f64::is_finite);
    let why = || InputError::file(&model.source, "a number that follows from it is none; look at the model");
    finite.then_some(()).ok_or_else(why)?;
    let supply_v = f64::from(config.supply_nominal_v);
    let mut doubts = Vec::new();
    if value.told[BREAKAWAY[1]] > NEAR_STANDSTILL * supply_v {
        doubts.push("breakaway: friction that falls over so much of the speed is another effect".into());
        BREAKAWAY.iter().for_each(|at| value.told[*at] = 0.0);
    }
    // A way back that is too long costs time; one that is too short leaves a part of the play.
    value.told[PLAY] += U95 * from_effects(model, &|t| t.told[PLAY]).sqrt();
    // As on the chip, other numbers are trusted with the dead zones.
    let mut number = |name: &str, pick: Pick, voltage: bool, sure: bool| {
        let u95 = U95 * (from_effects(model, pick) + from_base(model, pick, voltage)).sqrt();
        let wide = || too_wide(pick(&value), u95).filter(|_| voltage);
        let unsure = || (!sure).then(|| "a dead zone is not trusted".to_owned());
        let none =
            (!(pick(&value) + u95).is_finite()).then(|| "it is no number; look at the model".to_owned());
        let doubt = none.or_else(|| doubtful(model, pick)).or_else(wide).or_else(unsure);
        doubts.extend(doubt.iter().map(|doubt| format!("{name}: {doubt}")));
        Kept { value: pick(&value), u95, trusted: doubt.is_none() }
    };
    let mut zone = |name: &str, pick: Pick| (pick(&value) > 0.0).then(|| number(name, pick, true, true));
    let dead_zone_pos_v = zone("dead_zone_pos_v", &|t| t.dead_zone[0]);
    let dead_zone_neg_v = zone("dead_zone_neg_v", &|t| t.dead_zone[1]);
    let sure = [dead_zone_pos_v, dead_zone_neg_v].iter().flatten().all(|kept| kept.trusted);
    let mut limit =
        |name: &str, pick: Pick| (pick(&value) < supply_v).then(|| number(name, pick, true, sure));
    let saturation_pos_v = limit("saturation_pos_v", &|t| t.saturation[0]);
    let saturation_neg_v = limit("saturation_neg_v", &|t| t.saturation[1]);
    let most = Modelled::most(config).map(f64::from);
    let told = |at: usize| {
        let told =
            Some(value.told[at]).filter(|of| of.is_normal() && doubtful(model, &|t| t.told[at]).is_none());
        Some((NAMES[at][0].to_owned(), told?.clamp(-most[at], most[at])))
    };
    let params = Params {
        mechanism: value.mechanism,
        dead_zone_pos_v,
        dead_zone_neg_v,
        saturation_pos_v,
        saturation_neg_v,
        gain_rad_s_per_v: Some(number("gain_rad_s_per_v", &|t| t.gain, false, sure)),
        time_constant_s: Some(number("time_constant_s", &|t| t.time_constant, false, sure)),
        modelled: (0..NUMBERS).filter_map(told).collect(),
        ..Params::nothing()
    };
    let mut export = Export { params, left_out: left_out(model), doubts };
    place_load(model, config, &mut export);
    Ok(export)
}

/// The table of what is sure; what of it is beyond the bound of the chip is left out.
fn place_load(model: &Model, config: &Config, export: &mut Export) {
    let sure = |wave: &Wave| {
        let doubt = unsure(wave.name, model.standing(wave.name)).or_else(|| wave.doubt());
        export.doubts.extend(doubt.iter().map(|doubt| format!("{}: {doubt}", wave.name)));
        doubt.is_none()
    };
    let waves: Vec<_> =
        waves::waves(model, config.supply_nominal_v.into()).into_iter().filter(sure).collect();
    export.params.position_load = waves::table(&waves, config);
    let share = export.params.position_load.as_mut().map_or(1.0, |it| it.fit(config));
    if share < 1.0 {
        let beyond = 100.0 * (1.0 - share);
        export.left_out.push(format!("{beyond:.0} % of the load over the place, more than the servo holds"));
    }
}

/// Why a name is not to be trusted, if so.
fn unsure(name: &str, standing: Option<&str>) -> Option<String> {
    match standing? {
        NAMED => None,
        "tie" => Some(format!("{name} is one name of a tie; make the experiment that tells the names apart")),
        _ => Some(format!("{name} comes from a verdict that leaves something unexplained")),
    }
}

/// Takes one number.
type Pick<'a> = &'a dyn Fn(&Terminal) -> f64;

/// The known effects that a number depends on, and how sure their names are.
fn behind<'a>(model: &'a Model, pick: Pick) -> Vec<(&'static str, Option<&'a str>)> {
    let whole = pick(&Terminal::of(model));
    let moves = |place: usize| {
        let mut without = model.clone();
        without.known.remove(place);
        (pick(&Terminal::of(&without)) - whole).abs() > 1e-9 * whole.abs()
    };
    let known = model.known.iter().enumerate().filter(|(place, _)| moves(*place));
    known.map(|(_, known)| (known.effect.name, model.standing(known.effect.name))).collect()
}

/// Why the effects in a number are not to be trusted, if so.
fn doubtful(model: &Model, pick: Pick) -> Option<String> {
    behind(model, pick).into_iter().find_map(|(name, standing)| unsure(name, standing))
}

fn too_wide(value: f64, u95: f64) -> Option<String> {
    let share = 100.0 * TRUST_LIMIT;
    (u95 > TRUST_LIMIT * value)
        .then(|| format!("{value:.4} V has a half width (95 %) of {u95:.4} V, more than {share:.0} % of it"))
}

/// Effects without a number on the chip, and parameters of the others of which it takes a part only.
fn left_out(model: &Model) -> Vec<String> {
    let mut all: Vec<String> = model.unnamed.iter().map(|unnamed| unnamed.name.clone()).collect();
    for Known { effect, values, .. } in &model.known {
        if effect.on_chip == OnChip::Unknown {
            all.push(effect.name.to_owned());
            continue;
        }
        let parts = effect.parameters.iter().zip(values);
        let left = parts.filter(|(part, value)| part.on_chip == OnChip::Unknown && **value != 0.0);
        all.extend(left.map(|(part, _)| format!("{}.{}", effect.name, part.name)));
    }
    all
}

/// The model must be of the axis that the firmware drives.
fn check(model: &Model, config: &Config) -> Result<(), InputError> {
    if model.physics().drive != Drive::Voltage || model.linear() {
        let what = "has no voltage at its input; the firmware drives a motor by its terminal voltage";
        return Err(InputError::file(&model.source, what));
    }
    builtin::check(&model.source, model, config)
}

/// What the chip would see of the model.
struct Terminal {
    /// Positive, negative; V, positive magnitudes.
    dead_zone: [f64; 2],
    saturation: [f64; 2],
    /// rad/s/V at the encoder's shaft.
    gain: f64,
    /// s.
    time_constant: f64,
    /// As [`Modelled`](servo::compensate::modelled::Modelled) has them.
    told: [f64; NUMBERS],
    mechanism: Mechanism,
}

impl Terminal {
    fn of(model: &Model) -> Self {
        let mut plant = model.physics();
        plant.viscous += 0.5 * (plant.viscous_pos + plant.viscous_neg);
        let volts = |torque: f64| torque * plant.resistance / plant.kt;
        let gain = plant.drive_gain * plant.dc_gain();
        let drags = plant.torques.iter().filter(|it| it.law == Law::Drag);
        let drag = drags.map(|it| volts(it.parameters[0]) / plant.drive_gain * gain * gain).sum::<f64>();
        let friction = [volts(plant.friction_pos), volts(plant.friction_neg)];
        let zone = [plant.dead_pos, plant.dead_neg];
        let limit = [plant.limit - plant.drive_offset, plant.limit * plant.limit_skew + plant.drive_offset];
        let (motor, winding) = (plant.time_constant_s(), plant.inductance / plant.resistance);
        // The sum of the two time constants of winding and inertia exceeds the mechanical one.
        let first = motor + plant.inductance * plant.viscous / (plant.resistance * plant.total_damping());
        let later = plant.lag_s + plant.delay_s;
        let second = motor * winding + first * later + plant.delay_s * (plant.lag_s + 0.5 * plant.delay_s);
        let skew = 0.5 * (plant.viscous_pos - plant.viscous_neg) / plant.total_damping();
        let (mechanism, share) = mechanism(zone, friction, plant.drop_v);
        let widths = [0, 1].map(|at| (zone[at] + plant.drop_v + friction[at]) / plant.drive_gain);
        let excess = 2.0 * volts(plant.breakaway_extra) / plant.drive_gain / (widths[0] + widths[1]);
        let stribeck = if plant.breakaway_extra > 0.0 { plant.stribeck_speed / gain } else { 0.0 };
        let (lag, play) = (second / (first + later), plant.gap_rad * plant.sensor_scale);
        Terminal {
            dead_zone: widths,
            saturation: [0, 1].map(|at| (limit[at] + zone[at]) / plant.drive_gain),
            gain,
            time_constant: first + later,
            told: [lag, plant.friction_per_motor, skew, drag, share, excess, stribeck, play],
            mechanism,
        }
    }
}

/// The one that makes nearly all of it, or the larger one beside friction, with the share of that.
fn mechanism(zone: [f64; 2], friction: [f64; 2], drop: f64) -> (Mechanism, f64) {
    let [zone, friction, drop]: [f64; 3] = [zone, friction, [drop; 2]].map(|sides| sides.iter().sum());
    let share = friction / (zone + friction + drop);
    let beside = if share > LITTLE { share } else { 0.0 };
    match () {
        () if share > 1.0 - LITTLE => (Mechanism::Friction, 0.0),
        () if zone + drop == 0.0 => (Mechanism::Unclear, 0.0),
        () if zone > drop => (Mechanism::InputDeadZone, beside),
        () => (Mechanism::VoltageDrop, beside),
    }
}

/// Variance by first-order propagation of what the effects' parameters are known by.
fn from_effects(model: &Model, pick: Pick) -> f64 {
    let mut sum = 0.0;
    for (place, known) in model.known.iter().enumerate() {
        for (index, std) in known.stds.iter().enumerate() {
            let mut changed = model.clone();
            changed.known[place].values[index] += std.unwrap_or(0.0);
            sum += squared_change(model, &changed, pick);
        }
    }
    sum
}

/// The uncertainty that the tolerances of the base parameters bring. Of a voltage that only fitted effects make, the log has shown the voltage
/// itself: an error of R or Kt is in the fitted torque as well and cancels.
fn from_base(model: &Model, pick: Pick, voltage: bool) -> f64 {
    if voltage && behind(model, pick).iter().all(|(_, standing)| standing.is_some()) {
        return 0.0;
    }
    let one = |(key, value): (&str, f64)| {
        let mut changed = model.clone();
        changed.set_parameter(key, value * (1.0 + model.tolerance(key)));
        squared_change(model, &changed, pick)
    };
    model.parameters().into_iter().map(one).sum()
}

fn squared_change(model: &Model, changed: &Model, pick: Pick) -> f64 {
    let change = pick(&Terminal::of(changed)) - pick(&Terminal::of(model));
    if change.is_finite() { change * change } else { 0.0 }
}
