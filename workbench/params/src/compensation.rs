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
//! time constant together with the dead zones, and each term that only a model tells up to half of it. And no effect in it may be one name of a tie, or from a verdict that leaves
//! something unexplained (`standing` in the extended model).

use crate::waves::{self, Wave};
use servo::compensate::modelled::{BREAKAWAY, Modelled, NAMES, NUMBERS, PLAY, SKEW};
use servo::config::Config;
use servo::identify::estimate::Mechanism;
use truing_core::system::effects::{ENCODER_SCALE, OnChip};
use truing_core::system::model::{Known, Model, NAMED};
use truing_core::system::plant::laws::Law;
use truing_core::system::plant::physics::Drive;
use truing_core::text::input_error::InputError;
use truing_servo::device::commission_report::{Kept, Params};
use truing_servo::device::motor::builtin;
use truing_servo::device::place_load::PlaceLoad;

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
    /// What a reader of the numbers has to know, a line each: what the firmware has no parameter for (effects, and parameters as
    /// `effect.parameter`), and why numbers are not trusted.
    pub remarks: Vec<String>,
}

impl Export {
    /// The file, with what is missing in it as comments.
    pub fn text(&self) -> Result<String, InputError> {
        let comments: String = self.remarks.iter().map(|remark| format!("# {remark}\n")).collect();
        Ok(comments + &self.params.text()?)
    }
}

const LEFT_OUT: &str = "not compensated by the firmware";

/// Counts that the encoder gives a turn and their half width (95 %), where a model is sure that they are not what the axis file says.
fn counts_per_rev(model: &Model, config: &Config) -> Option<[u32; 2]> {
    let known = model.known.iter().find(|known| known.effect.name == ENCODER_SCALE.name)?;
    let named = unsure(known.effect.name, model.standing(known.effect.name)).is_none();
    let (ratio, u95) = (known.values[0], U95 * known.stds[0].unwrap_or(0.0));
    let counts = [ratio, u95].map(|it| (f64::from(config.counts_per_rev) * it).round() as u32);
    (named && u95 < waves::TRUST_LIMIT * (ratio - 1.0).abs()).then_some(counts)
}

/// As [`from_model`], for an axis whose counts a turn are corrected with it.
pub fn corrected(model: &Model, config: &Config) -> Result<Export, InputError> {
    let export = from_model(model, config)?;
    let Some([counts_per_rev, _]) = counts_per_rev(model, config) else { return Ok(export) };
    let mut model = Model { encoder: None, ..model.clone() };
    model.known.retain(|known| known.effect.name != ENCODER_SCALE.name);
    let params = from_model(&model, &Config { counts_per_rev, ..*config })?.params;
    Ok(Export { params: Params { counts_per_rev: Some(counts_per_rev), ..params }, ..export })
}

/// The numbers for the firmware, as its encoder shows them, and what it cannot take.
pub fn from_model(model: &Model, config: &Config) -> Result<Export, InputError> {
    check(model, config)?;
    let mut value = Terminal::of(model);
    let finite = [value.gain, value.time_constant].into_iter().chain(value.dead_zone).all(f64::is_finite);
    let why = || InputError::file(&model.source, "a number that follows from it is none; look at the model");
    finite.then_some(()).ok_or_else(why)?;
    let supply_v = f64::from(config.supply_nominal_v);
    let mut remarks = left_out(model);
    let counts = |[it, u95]: [u32; 2]| format!("encoder.counts_per_rev should be {it} ± {u95} (95 %)");
    remarks.extend(counts_per_rev(model, config).map(counts));
    if value.told[BREAKAWAY[1]] > NEAR_STANDSTILL * supply_v {
        remarks.push(format!("{LEFT_OUT}: friction that falls over so much of the speed"));
        BREAKAWAY.iter().for_each(|at| value.told[*at] = 0.0);
    }
    let mut all = Weighed { model, value, remarks };
    let dead_zone_pos_v = all.voltage("dead_zone_pos_v", &|t| t.dead_zone[0], true, |v| v > 0.0);
    let dead_zone_neg_v = all.voltage("dead_zone_neg_v", &|t| t.dead_zone[1], true, |v| v > 0.0);
    // As on the chip, other numbers are trusted with the dead zones.
    let sure = [dead_zone_pos_v, dead_zone_neg_v].iter().flatten().all(|kept| kept.trusted);
    let most = Modelled::most(config).map(f64::from);
    let params = Params {
        mechanism: all.value.mechanism,
        dead_zone_pos_v,
        dead_zone_neg_v,
        saturation_pos_v: all.voltage("saturation_pos_v", &|t| t.saturation[0], sure, |v| v < supply_v),
        saturation_neg_v: all.voltage("saturation_neg_v", &|t| t.saturation[1], sure, |v| v < supply_v),
        gain_rad_s_per_v: Some(all.number("gain_rad_s_per_v", &|t| t.gain, f64::INFINITY, sure)),
        time_constant_s: Some(all.number("time_constant_s", &|t| t.time_constant, f64::INFINITY, sure)),
        modelled: (0..NUMBERS).filter_map(|at| all.told(at, most[at])).collect(),
        position_load: all.place_load(config),
        ..Params::nothing()
    };
    Ok(Export { params, remarks: all.remarks })
}

/// The numbers of a model, and what is to be said of them.
struct Weighed<'a> {
    model: &'a Model,
    value: Terminal,
    remarks: Vec<String>,
}

impl Weighed<'_> {
    /// Nothing speaks against it; what does is said.
    fn trusted(&mut self, name: &str, doubt: Option<String>) -> bool {
        self.remarks.extend(doubt.iter().map(|doubt| format!("not trusted: {name}: {doubt}")));
        doubt.is_none()
    }

    /// Trusted up to a half width (95 %) of `most` of it, if what it stands on is sure.
    fn number(&mut self, name: &str, pick: Pick, most: f64, sure: bool) -> Kept {
        let (model, value) = (self.model, pick(&self.value));
        let u95 = U95 * variance(model, pick, most.is_finite()).sqrt();
        let zones = || (!sure).then(|| "a dead zone is not trusted".to_owned());
        let named = behind(model, pick).into_iter().find_map(|(name, standing)| unsure(name, standing));
        let doubt = named.or_else(|| too_wide(value, u95, most)).or_else(zones);
        Kept { value, u95, trusted: self.trusted(name, doubt) }
    }

    /// If it is one.
    fn voltage(&mut self, name: &str, pick: Pick, sure: bool, is: impl Fn(f64) -> bool) -> Option<Kept> {
        is(pick(&self.value)).then(|| self.number(name, pick, TRUST_LIMIT, sure))
    }

    /// What only a model tells, up to `most`.
    fn told(&mut self, at: usize, most: f64) -> Option<(String, Kept)> {
        let value = Some(self.value.told[at]).filter(|value| value.is_normal())?;
        // The breakaway decides about the voltage over which it falls, too.
        let decides = if at == BREAKAWAY[1] { BREAKAWAY[0] } else { at };
        // What both sides have in common is as unsure as the damping, and no part of their difference, which the name stands for.
        let limit = if at == SKEW { f64::INFINITY } else { waves::TRUST_LIMIT };
        let kept = self.number(NAMES[at][1], &|t| t.told[decides], limit, true);
        // A way back that is too long costs time; one that is too short leaves a part of the play.
        let value = if at == PLAY { value + kept.u95 } else { value };
        Some((NAMES[at][0].to_owned(), Kept { value: value.clamp(-most, most), ..kept }))
    }

    /// The table of what is sure, as far as the chip holds it.
    fn place_load(&mut self, config: &Config) -> Option<PlaceLoad> {
        let mut waves = waves::waves(self.model, config.supply_nominal_v.into());
        waves.retain(|Wave { name, amplitude_v, u95, .. }| {
            let wide = || too_wide(*amplitude_v, *u95, waves::TRUST_LIMIT);
            self.trusted(name, unsure(name, self.model.standing(name)).or_else(wide))
        });
        let mut table = waves::table(&waves, config)?;
        let beyond = 100.0 * (1.0 - table.fit(config));
        if beyond > 0.0 {
            self.remarks.push(format!("{LEFT_OUT}: {beyond:.0} % of the load over the place"));
        }
        Some(table)
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

fn too_wide(value: f64, u95: f64, most: f64) -> Option<String> {
    let share = 100.0 * most;
    (u95 > most * value.abs())
        .then(|| format!("{value:.4} has a half width (95 %) of {u95:.4}, more than {share:.0} % of it"))
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
    all.iter().map(|what| format!("{LEFT_OUT}: {what}")).collect()
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
    /// rad/s/V as the encoder shows them.
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
            gain: gain * plant.sensor_scale,
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

/// Variance by first-order propagation of what the effects' parameters are known by, and of the tolerances of the base parameters. Of a
/// voltage that only fitted effects make, the log has shown the voltage itself: an error of R or Kt is in the fitted torque as well and
/// cancels.
fn variance(model: &Model, pick: Pick, voltage: bool) -> f64 {
    let value = pick(&Terminal::of(model));
    let squared = |change: &dyn Fn(&mut Model)| {
        let mut changed = model.clone();
        change(&mut changed);
        let by = pick(&Terminal::of(&changed)) - value;
        if by.is_finite() { by * by } else { 0.0 }
    };
    let mut sum = 0.0;
    for (place, known) in model.known.iter().enumerate() {
        for (index, std) in known.stds.iter().enumerate() {
            sum += squared(&|it| it.known[place].values[index] += std.unwrap_or(0.0));
        }
    }
    let cancels = voltage && behind(model, pick).iter().all(|(_, standing)| standing.is_some());
    for (key, value) in model.parameters().into_iter().filter(|_| !cancels) {
        sum += squared(&|it| it.set_parameter(key, value * (1.0 + model.tolerance(key))));
    }
    sum
}
