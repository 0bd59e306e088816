//! Does the measured current agree with voltage and speed: u = R i + Ke ω + L di/dt?
//!
//! Where it does not, the record is asked without it: if voltage and speed alone move as the data sheet says, the current's column is wrong
//! and not the winding.

use super::motion::{Base, Motion};
use super::{ENOUGH, clearly, shrinks};
use crate::outcome::DataFault;
use crate::system::log::{Dynamic, Input, Names, Theirs};
use crate::system::model::{Kind, Model};
use crate::text::figures::figure;
use servo::axis::Bridge;

/// Fewer rows tell nothing of a circuit. Chosen by judgement, tried with the others of `examine`.
const FEWEST: usize = 50;
/// A factor below this one is a resistance, warm or of another sheet. Chosen by judgement, tried with the others of
/// `examine`.
const FACTOR: f64 = 1.3;
/// A unit is named where the factor lies within this part of it. Chosen by judgement, tried with the others of
/// `examine`.
const UNIT: f64 = 0.1;
/// A zero that is off by less than this part of the largest voltage across the resistance is a zero. Chosen by
/// judgement, tried with the others of `examine`.
const ZERO: f64 = 0.05;
/// A current that is never below this part of its largest value has lost its sign. Chosen by judgement, tried with
/// the others of `examine`.
const BELOW: f64 = 0.1;

/// What makes the column wrong and not the winding.
const ALONE: &str = "voltage and speed alone move as the model says";

/// One row: the voltage across the resistance, what the logged current makes of it, the commanded voltage.
struct Row {
    across: f64,
    drop: f64,
    input: f64,
}

/// What a column may hold in place of the current, what mends it, and what a row's drop then is.
type Mistake = (String, String, Box<dyn Fn(&Row) -> f64>);

/// A current that is not the winding's, in the log and in every held-out record that has one.
pub fn fault(model: &Model, record: &Dynamic, holdouts: &[&Dynamic]) -> Option<DataFault> {
    let Kind::DcMotor { r_ohm, .. } = model.kind else { return None };
    if record.input != Input::Voltage || model.fitted_to_log {
        return None;
    }
    let rows = rows(model, record);
    let as_it_stands = explained(&rows, &|row| row.drop)?;
    let others: Vec<Vec<Row>> = holdouts.iter().map(|other| self::rows(model, other)).collect();
    let told = |(what, remedy, drop): Mistake| {
        let better = |other: &Vec<Row>| {
            let with_and_without = explained(other, &|row| row.drop).zip(explained(other, &drop));
            with_and_without.is_none_or(|(before, after)| before > ENOUGH || shrinks(before, after))
        };
        let with_it = explained(&rows, &drop)?;
        (clearly(as_it_stands, with_it) && others.iter().all(better))
            .then(|| super::fault("i_a", what, remedy, [as_it_stands, with_it]))
    };
    let fits = Fits::of(&rows);
    let sheet = Sheet::of(model, record);
    let sheet = sheet.as_ref();
    let mistakes = [
        fits.factor(sheet, &record.names),
        fits.zero(sheet, &record.names, r_ohm),
        unsigned(&rows, &record.names),
        supply(&rows, sheet, model, &record.names),
    ];
    mistakes.into_iter().flatten().find_map(told)
}

/// The share of the voltage across the resistance that this drop explains. Brushes and a dead zone of the drive take a constant part of it.
fn explained(rows: &[Row], drop: &dyn Fn(&Row) -> f64) -> Option<f64> {
    let total: f64 = rows.iter().map(|row| row.across * row.across).sum();
    let left = |row: &Row| (row.across - drop(row)) * row.input.signum();
    let taken = rows.iter().map(left).sum::<f64>() / rows.len() as f64;
    let missed = rows.iter().map(|row| (left(row) - taken).powi(2));
    (rows.len() >= FEWEST && total > 0.0).then(|| 1.0 - missed.sum::<f64>() / total)
}

fn rows(model: &Model, record: &Dynamic) -> Vec<Row> {
    let Kind::DcMotor { r_ohm, l_h, ke_vs_per_rad, .. } = model.kind else { return Vec::new() };
    let mut rows = Vec::new();
    for run in &record.runs {
        let (Some(speed), Some(current)) = (&run.speed, &run.current_a) else { continue };
        for row in 1..run.rows().saturating_sub(1) {
            let driven = run.bridge[row] == Bridge::Driven && run.bridge[row - 1] == Bridge::Driven;
            // A row in which the voltage jumps belongs to both. A fiftieth is the ripple of a supply. Judgement; not studied.
            let step = (run.input[row] - run.input[row - 1]).abs();
            if driven && step < 0.02 * run.input[row].abs().max(0.1) {
                let slope = (current[row + 1] - current[row - 1]) / (run.t_s[row + 1] - run.t_s[row - 1]);
                let across = run.input[row] - ke_vs_per_rad * speed[row];
                rows.push(Row { across, drop: r_ohm * current[row] + l_h * slope, input: run.input[row] });
            }
        }
    }
    rows
}

/// How voltage and speed move beside the data sheet, without the current.
struct Sheet {
    /// Acceleration per volt, and the rate, over those of the sheet.
    slope: f64,
    rate: f64,
    /// The constant force as a voltage, V.
    constant_v: f64,
}

impl Sheet {
    fn of(model: &Model, record: &Dynamic) -> Option<Self> {
        let base = Base::of(&model.kind, record.input)?;
        let fit = Motion::of(record)?.near(&base, 1.0).filter(|fit| fit.explained > super::MOST)?;
        let rate = if base.rate > 0.0 { fit.rate / base.rate } else { 1.0 };
        Some(Self { slope: fit.slope / base.slope, rate, constant_v: fit.constant() / fit.slope })
    }

    /// Would the sheet be nearer to this motion with another resistance than it is?
    fn is_off_by(&self, resistance: f64) -> bool {
        let off = |times: f64| (self.slope * times).abs().ln().abs() + (self.rate * times).ln().abs();
        self.slope <= 0.0 || off(resistance) < off(1.0)
    }
}

/// The best line from what the current makes to the voltage across the resistance: factor, zero, and what dead zone and brushes take.
struct Fits {
    factor: f64,
    /// With a zero beside it.
    zero_v: f64,
    largest_v: f64,
}

impl Fits {
    fn of(rows: &[Row]) -> Self {
        let mean = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>() / rows.len() as f64;
        let sign = |row: &Row| row.input.signum();
        let (across, drop) = (mean(&|row| row.across), mean(&|row| row.drop));
        let product = mean(&|row| (row.across - across) * (row.drop - drop));
        let square = mean(&|row| (row.drop - drop).powi(2));
        // What a dead zone takes has the sign of the input, a zero has none; where nearly all rows go one way they cannot be told apart,
        // and a twentieth keeps the quotient small. Chosen by judgement; not studied.
        let (way, more) = (mean(&sign), drop - across);
        let taken =
            mean(&|row| (row.drop - row.across - more) * (sign(row) - way)) / (1.0 - way * way).max(0.05);
        let zero_v = more - taken * way;
        let largest_v = rows.iter().fold(0.0_f64, |most, row| most.max(row.across.abs()));
        Self { factor: product / square.max(1e-300), zero_v, largest_v }
    }

    fn factor(&self, sheet: Option<&Sheet>, names: &Names) -> Option<Mistake> {
        let units = [
            (1e-3, "i_a is in mA"),
            (1e3, "i_a is in kA"),
            (-1.0, "i_a has the wrong sign"),
            (-1e-3, "i_a is in mA and has the wrong sign"),
        ];
        let near = |unit: &&(f64, &str)| (self.factor / unit.0 - 1.0).abs() < 2.0 * UNIT;
        let unit = units.iter().find(near);
        let factor = unit.map_or(self.factor, |unit| unit.0);
        let odd = factor.abs().ln().abs() > FACTOR.ln() || factor < 0.0;
        // Where R is another one, the motion knows it.
        let winding = unit.is_none() && (factor <= 0.0 || sheet.is_none_or(|sheet| sheet.is_off_by(factor)));
        let what = || match unit {
            Some(unit) => unit.1.into(),
            None => format!("i_a is {} times the current: {ALONE}", figure(1.0 / factor)),
        };
        (odd && !winding)
            .then(|| (what(), names.times("i_a", factor), Box::new(move |row: &Row| factor * row.drop) as _))
    }

    fn zero(&self, sheet: Option<&Sheet>, names: &Names, r_ohm: f64) -> Option<Mistake> {
        let (zero_v, zero_a) = (self.zero_v, self.zero_v / r_ohm);
        // An offset of the drive moves the motor, too.
        let driven = (zero_v - sheet?.constant_v).abs() < 0.5 * zero_v.abs();
        let what = format!("the zero of i_a is off by {} A: {ALONE}", figure(zero_a));
        let change = |theirs: &Theirs| format!("{}-({:.6})", theirs.text, zero_a / theirs.unit);
        let remedy = names.mended(&[("i_a", &change)]);
        (zero_v.abs() > ZERO * self.largest_v && !driven)
            .then(|| (what, remedy, Box::new(move |row: &Row| row.drop - zero_v) as _))
    }
}

/// Leaves the column out.
fn without(names: &Names) -> String {
    names.mended(&[("i_a", &|_| "none".into())])
}

fn unsigned(rows: &[Row], names: &Names) -> Option<Mistake> {
    let largest = rows.iter().fold(0.0_f64, |most, row| most.max(row.drop));
    let below = rows.iter().filter(|row| row.drop < -BELOW * largest).count();
    let reverse = rows.iter().filter(|row| row.across < -BELOW * largest).count();
    let what = "i_a has lost its sign: it is never below 0, although the motor is driven both ways";
    let drop = |row: &Row| row.drop.abs() * row.across.signum();
    (100 * below < rows.len() && 20 * reverse > rows.len())
        .then(|| (what.into(), without(names), Box::new(drop) as _))
}

/// The current of the supply is that of the winding times the duty.
fn supply(rows: &[Row], sheet: Option<&Sheet>, model: &Model, names: &Names) -> Option<Mistake> {
    let fits = sheet.is_some_and(|sheet| !sheet.is_off_by(2.0) && !sheet.is_off_by(0.5));
    let volts = model.supply_nominal_v.filter(|_| fits)?;
    let least = 0.1 * rows.iter().fold(0.0_f64, |most, row| most.max(row.input.abs()));
    let what = "i_a is the current of the supply, not that of the winding: it is smaller by the duty";
    let drop = move |it: &Row| if it.input.abs() > least { it.drop * volts / it.input } else { it.across };
    Some((what.into(), without(names), Box::new(drop)))
}
