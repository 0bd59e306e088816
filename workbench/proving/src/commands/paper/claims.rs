//! What the paper says, beside what its own numbers say. Every figure is computed from its tables and parameters.

use std::f64::consts::PI;
use truing_core::gap::tables::map;
use truing_core::system::plant::physics::Physics;
use truing_report::report::figure;
use truing_report::report::section::{Check, Section, Table};

/// rad/s in one rpm.
const RPM: f64 = PI / 30.0;

/// A straight line through points: intercept, slope, rms residual, and the row that lies farthest off.
struct Line {
    intercept: f64,
    slope: f64,
    rms: f64,
    worst: (f64, f64),
}

impl Line {
    /// Least squares; `through_origin` leaves the intercept 0.
    fn through(points: &[(f64, f64)], through_origin: bool) -> Self {
        let n = points.len() as f64;
        let mean = |f: fn(&(f64, f64)) -> f64| {
            if through_origin { 0.0 } else { points.iter().map(f).sum::<f64>() / n }
        };
        let (x0, y0) = (mean(|p| p.0), mean(|p| p.1));
        let products: f64 = points.iter().map(|p| (p.0 - x0) * (p.1 - y0)).sum();
        let squares: f64 = points.iter().map(|p| (p.0 - x0).powi(2)).sum();
        let slope = products / squares;
        let intercept = y0 - slope * x0;
        let residual: Vec<(f64, f64)> = points.iter().map(|p| (p.0, p.1 - intercept - slope * p.0)).collect();
        let rms = (residual.iter().map(|r| r.1 * r.1).sum::<f64>() / n).sqrt();
        let worst = residual.into_iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or((0.0, 0.0));
        Line { intercept, slope, rms, worst }
    }
}

/// A sine through points: amplitude, angular frequency, phase, rms residual.
struct Sine {
    amplitude: f64,
    omega: f64,
    phase: f64,
    rms: f64,
}

impl Sine {
    /// Least squares: for each frequency two coefficients, the frequency by nested grids.
    fn through(points: &[(f64, f64)]) -> Self {
        let (mut low, mut high) = (0.1, 15.0);
        let mut best = Sine::at(points, low);
        for _ in 0..8 {
            let grid = (0..=400).map(|k| Sine::at(points, low + (high - low) * f64::from(k) / 400.0));
            best = grid.min_by(|a, b| a.rms.total_cmp(&b.rms)).unwrap_or(best);
            let width = (high - low) / 100.0;
            (low, high) = ((best.omega - width).max(1e-3), best.omega + width);
        }
        best
    }

    fn at(points: &[(f64, f64)], omega: f64) -> Self {
        let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0, p.1)).sum::<f64>();
        let (s, c) = (|t: f64| (omega * t).sin(), |t: f64| (omega * t).cos());
        let (ss, sc, cc) = (sum(&|t, _| s(t) * s(t)), sum(&|t, _| s(t) * c(t)), sum(&|t, _| c(t) * c(t)));
        let (sy, cy) = (sum(&|t, y| s(t) * y), sum(&|t, y| c(t) * y));
        let det = ss * cc - sc * sc;
        let (a, b) = ((sy * cc - cy * sc) / det, (cy * ss - sy * sc) / det);
        let square = sum(&|t, y| (y - a * s(t) - b * c(t)).powi(2)) / points.len() as f64;
        Sine { amplitude: a.hypot(b), omega, phase: b.atan2(a), rms: square.sqrt() }
    }
}

/// The paper's claims and what its numbers say.
pub fn claims() -> Section {
    Section {
        title: "What the paper says and what its own numbers say".into(),
        text: vec![
            "Recomputed from the published tables and parameters. What does not hold is shown, because it is the first \
             real case for this tool: a model and a measurement that disagree."
                .into(),
        ],
        plots: vec![],
        tables: vec![recomputed()],
        checks: vec![gain(), saturation(), no_dead_zone(), flat_part(), sine(), step(), friction()],
    }
}

/// Table 3.1 up to the first row of its flat part, V and rpm.
fn rising_part() -> Vec<(f64, f64)> {
    let rows = points();
    let knee = rows.iter().position(|r| r.1 == top_speed()).unwrap_or(rows.len() - 1);
    rows[..=knee].to_vec()
}

fn points() -> Vec<(f64, f64)> {
    let table = super::table();
    table.u_v.iter().copied().zip(table.omega_rad_s.iter().map(|w| w / RPM)).collect()
}

fn recomputed() -> Table {
    let plant = super::motor().physics();
    let (line, origin) = (Line::through(&rising_part(), false), Line::through(&rising_part(), true));
    let (slow, fast) = poles(&plant);
    let gain = plant.dc_gain();
    let rpm = |value: f64| format!("{} rpm", figure(value));
    let [seconds_slow, seconds_fast] = [slow, fast].map(|pole| -1.0 / pole);
    let [mechanical, electrical] = [plant.time_constant_s(), plant.inductance / plant.resistance];
    let below = [rpm(line.slope), rpm(line.intercept), rpm(line.rms), rpm(line.worst.1.abs())];
    let [slope, intercept, rms, worst] = &below;
    let volts = line.worst.0;
    let rows = [
        ("gain of the motor, Kt/(R b + Kt Ke)", format!("{} rad/s/V = {}/V", figure(gain), rpm(gain / RPM))),
        (
            "Table 3.1 below its flat part",
            format!("{slope}/V with {intercept} at 0 V; rms residual {rms}, worst {worst} at {volts} V"),
        ),
        ("… through the origin", format!("{}/V, rms residual {}", rpm(origin.slope), rpm(origin.rms))),
        ("where that line meets zero speed", format!("{:.2} V", -line.intercept / line.slope)),
        ("where it reaches the flat part", format!("{:.2} V", knee(&line))),
        (
            "poles of the motor",
            format!(
                "{slow:.3} and {fast:.3} 1/s: time constants {seconds_slow:.2} s and {seconds_fast:.2} s; \
                 J R/(R b + Kt Ke) is {mechanical:.2} s, L/R {electrical:.3} s"
            ),
        ),
    ];
    Table {
        caption: "Recomputed".into(),
        header: vec!["quantity".into(), "figure".into()],
        rows: rows.into_iter().map(|(what, text)| vec![what.to_owned(), text]).collect(),
    }
}

/// Coefficients of J·L s² + (J·R + b·L) s + (b·R + Kt·Ke), the denominator of Kt/… from voltage to speed.
pub fn denominator(p: &Physics) -> [f64; 3] {
    [
        p.inertia * p.inductance,
        p.inertia * p.resistance + p.viscous * p.inductance,
        p.viscous * p.resistance + p.kt * p.ke,
    ]
}

/// The two real poles, 1/s, the slow one first.
pub fn poles(p: &Physics) -> (f64, f64) {
    let [a, b, c] = denominator(p);
    let root = (b * b - 4.0 * a * c).sqrt();
    ((-b + root) / (2.0 * a), (-b - root) / (2.0 * a))
}

fn top_speed() -> f64 {
    points().iter().fold(0.0_f64, |m, r| m.max(r.1))
}

fn knee(line: &Line) -> f64 {
    (top_speed() - line.intercept) / line.slope
}

fn check(claim: &str, found: String, holds: bool) -> Check {
    Check { claim: claim.into(), found, holds }
}

fn gain() -> Check {
    let gain = super::motor().physics().dc_gain() / RPM;
    let line = Line::through(&rising_part(), false);
    let found = format!(
        "{} rpm/V from the parameters, {} rpm/V in Table 3.1: a factor of {:.2}, below saturation",
        figure(gain),
        figure(line.slope),
        line.slope / gain
    );
    check("the motor's parameters describe the measured motor", found, (line.slope / gain - 1.0).abs() < 0.1)
}

fn saturation() -> Check {
    let flat: Vec<(f64, f64)> = points().into_iter().filter(|r| r.1 == top_speed()).collect();
    let found = format!(
        "{} rpm in {} rows from {} V to {} V; the rising line reaches it at {:.2} V",
        figure(top_speed()),
        flat.len(),
        flat[0].0,
        flat[flat.len() - 1].0,
        knee(&Line::through(&rising_part(), false))
    );
    check("the speed saturates at 1547 rpm from 6.8 V on", found, top_speed() == 1547.0 && flat[0].0 == 6.8)
}

fn no_dead_zone() -> Check {
    let line = Line::through(&rising_part(), false);
    let zero = -line.intercept / line.slope;
    let lowest = points().iter().fold(f64::INFINITY, |m, r| m.min(r.0));
    let found = format!("the line meets zero speed at {zero:.2} V; the lowest voltage tested is {lowest} V");
    check("the measured table shows a dead zone", found, zero > 0.0)
}

fn flat_part() -> Check {
    let found = format!("the motor turns at {} rpm there: it is saturation", figure(top_speed()));
    check("above 6.8 V the system is in a dead zone", found, top_speed() == 0.0)
}

fn sine() -> Check {
    let fit = Sine::through(&super::input(super::TABLE_3_2));
    let sign = if fit.phase < 0.0 { '−' } else { '+' };
    let (amplitude, omega, phase, rms) = (fit.amplitude, fit.omega, fit.phase.abs(), fit.rms);
    let found = format!(
        "Table 3.2 is {amplitude:.1} V · sin({omega:.3} t {sign} {phase:.3}), rms deviation {rms:.2} V"
    );
    let holds = (fit.amplitude - 9.0).abs() < 0.2 && (fit.omega - 6.0).abs() < 0.1;
    check("the sine input has 9 V and 6 rad/s", found, holds)
}

fn step() -> Check {
    let rows: Vec<(f64, f64)> = super::input(super::TABLE_3_3).into_iter().filter(|r| r.1 > 0.0).collect();
    let found = format!(
        "Table 3.3 is blank before {} s, {:.1} V there, and {:.1} V from {:.1} s on: the step is on its way",
        rows[0].0, rows[0].1, rows[1].1, rows[1].0
    );
    check("the step input goes to 9 V at once", found, rows[0].1 == 9.0)
}

/// A dead zone of w volts and Coulomb friction of Kt·w/R settle at the same speeds.
fn friction() -> Check {
    let plain = super::motor().physics();
    let (mut zone, mut rubbing) = (plain.clone(), plain.clone());
    (zone.dead_pos, zone.dead_neg) = (super::DEAD_ZONE_V, super::DEAD_ZONE_V);
    let level = plain.kt * super::DEAD_ZONE_V / plain.resistance;
    (rubbing.friction_pos, rubbing.friction_neg) = (level, level);
    let volts: Vec<f64> = (-90..=90).map(|k| f64::from(k) * 0.1).collect();
    let pairs = map::sweep(&zone, &volts).into_iter().zip(map::sweep(&rubbing, &volts));
    let apart = pairs.map(|(a, b)| (a - b).abs() / RPM).fold(0.0, f64::max);
    let found = format!(
        "a dead zone of 1.2 V and friction of {} N m settle within {} rpm of each other from −9 V to 9 V",
        figure(level),
        figure((apart * 1e6).round() / 1e6)
    );
    check("steady speeds tell a dead zone of the drive from dry friction", found, apart > 1.0)
}
