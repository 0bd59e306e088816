//! The mistakes.

use super::rig::Files;

/// rad/s in an rpm, turned round.
const RPM: f64 = 60.0 / std::f64::consts::TAU;
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// One kind of mistake.
pub struct Kind {
    pub name: &'static str,
    /// It was looked at while the examination was built.
    pub design: bool,
    pub make: fn(&mut Files),
    /// One of these words in what is said of the files names the cause.
    pub words: &'static [&'static str],
    /// One of these words in a note does, too.
    pub notes: &'static [&'static str],
}

const fn kind(
    name: &'static str,
    design: bool,
    words: &'static [&'static str],
    make: fn(&mut Files),
) -> Kind {
    Kind { name, design, make, words, notes: &[] }
}

/// A mistake that harms little: a note is enough.
const fn noted(
    name: &'static str,
    design: bool,
    notes: &'static [&'static str],
    make: fn(&mut Files),
) -> Kind {
    Kind { name, design, make, words: notes, notes }
}

const SPEED: &[&str] = &["omega_rad_s"];
const VOLTAGE: &[&str] = &["u_v"];
const TIME: &[&str] = &["t_s", "time"];
const SIGN: &[&str] = &["sign"];

/// All of them. Without a speed or a position where it says so.
pub static KINDS: &[Kind] = &[
    kind("speed in rpm", true, SPEED, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", RPM)
    }),
    kind("speed in °/s", false, SPEED, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", DEGREES)
    }),
    kind("speed in turns/s", false, SPEED, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", RPM / 60.0)
    }),
    kind("speed in rpm, with the position", true, SPEED, |f| {
        f.without(&["i_a"]);
        f.scale("omega_rad_s", RPM)
    }),
    kind("speed in rpm, with the current", false, SPEED, |f| {
        f.without(&["theta_rad"]);
        f.scale("omega_rad_s", RPM)
    }),
    kind("speed in °/s, with the position", false, SPEED, |f| {
        f.without(&["i_a"]);
        f.scale("omega_rad_s", DEGREES)
    }),
    kind("speed in mrad/s", false, SPEED, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", 1000.0)
    }),
    kind("position in degrees", true, &["theta_rad"], |f| {
        f.without(&["omega_rad_s", "i_a"]);
        f.scale("theta_rad", DEGREES)
    }),
    kind("position in turns", false, &["theta_rad"], |f| {
        f.without(&["omega_rad_s", "i_a"]);
        f.scale("theta_rad", RPM / 60.0)
    }),
    kind("position in counts", true, &["theta_rad", "count"], |f| {
        f.without(&["omega_rad_s", "i_a"]);
        f.scale("theta_rad", 2048.0 * RPM / 60.0)
    }),
    kind("position in degrees beside the speed", true, &["theta_rad"], |f| {
        f.without(&["i_a"]);
        f.scale("theta_rad", DEGREES)
    }),
    kind("position in turns beside the speed", false, &["theta_rad"], |f| {
        f.without(&["i_a"]);
        f.scale("theta_rad", RPM / 60.0)
    }),
    kind("position counts down beside the speed", false, SIGN, |f| {
        f.without(&["i_a"]);
        f.scale("theta_rad", -1.0)
    }),
    kind("encoder reversed", true, SIGN, |f| {
        f.without(&["i_a"]);
        f.scale("omega_rad_s", -1.0);
        f.scale("theta_rad", -1.0)
    }),
    kind("speed reversed", false, SIGN, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", -1.0)
    }),
    kind("position reversed", false, SIGN, |f| {
        f.without(&["omega_rad_s", "i_a"]);
        f.scale("theta_rad", -1.0)
    }),
    kind("voltage reversed", true, SIGN, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("u_v", -1.0)
    }),
    kind("voltage reversed, with the current", false, SIGN, |f| {
        f.without(&["theta_rad"]);
        f.scale("u_v", -1.0)
    }),
    kind("current reversed", true, &["i_a"], |f| {
        f.without(&["theta_rad"]);
        f.scale("i_a", -1.0)
    }),
    kind("current in mA", true, &["i_a"], |f| {
        f.without(&["theta_rad"]);
        f.scale("i_a", 1000.0)
    }),
    kind("current in mA, reversed", false, &["i_a"], |f| {
        f.without(&["theta_rad"]);
        f.scale("i_a", -1000.0)
    }),
    kind("voltage in mV", true, VOLTAGE, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("u_v", 1000.0)
    }),
    kind("PWM of 8 bits for volts", true, VOLTAGE, |f| {
        f.without(&["theta_rad", "i_a"]);
        let v = f.volts;
        f.change("u_v", |u| (u / v * 255.0).round())
    }),
    kind("PWM of 10 bits for volts", false, VOLTAGE, |f| {
        f.without(&["theta_rad", "i_a"]);
        let v = f.volts;
        f.change("u_v", |u| (u / v * 1023.0).round())
    }),
    kind("PWM of 12 bits for volts", false, VOLTAGE, |f| {
        f.without(&["theta_rad", "i_a"]);
        let v = f.volts;
        f.change("u_v", |u| (u / v * 4095.0).round())
    }),
    kind("duty for volts", true, VOLTAGE, |f| {
        f.without(&["theta_rad", "i_a"]);
        let v = f.volts;
        f.scale("u_v", 1.0 / v)
    }),
    kind("per cent for volts", false, VOLTAGE, |f| {
        f.without(&["theta_rad", "i_a"]);
        let v = f.volts;
        f.scale("u_v", 100.0 / v)
    }),
    kind("duty for volts, with the position", false, VOLTAGE, |f| {
        f.without(&["omega_rad_s", "i_a"]);
        let v = f.volts;
        f.scale("u_v", 1.0 / v)
    }),
    kind("time in ms", true, TIME, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("t_s", 1000.0)
    }),
    kind("time in µs", false, TIME, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("t_s", 1e6)
    }),
    kind("time in ms, with the position", false, TIME, |f| {
        f.without(&["omega_rad_s", "i_a"]);
        f.scale("t_s", 1000.0)
    }),
    kind("rows counted for time", true, TIME, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| r[0].1 = (0..r[0].1.len()).map(|k| k as f64).collect())
    }),
    kind("rows counted for time, with the current", false, TIME, |f| {
        f.without(&["theta_rad"]);
        f.records(|r| r[0].1 = (0..r[0].1.len()).map(|k| k as f64).collect())
    }),
    kind("time goes back", false, TIME, |f| f.records(|r| r[0].1.swap(700, 701))),
    kind("every row twice", true, TIME, |f| {
        f.records(|r| r.iter_mut().for_each(|c| c.1 = c.1.iter().flat_map(|v| [*v, *v]).collect()))
    }),
    kind("voltage and speed exchanged", true, &["each other's place", "u_v"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| {
            let u = r[1].1.clone();
            r[1].1 = r[2].1.clone();
            r[2].1 = u
        })
    }),
    kind("J in g cm²", true, &["J_kgm2"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("J_kgm2", 1e7)
    }),
    kind("J in kg cm²", false, &["J_kgm2"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("J_kgm2", 1e4)
    }),
    kind("J in g m²", false, &["J_kgm2"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("J_kgm2", 1e3)
    }),
    kind("J in g cm², with the position", false, &["J_kgm2"], |f| {
        f.without(&["omega_rad_s", "i_a"]);
        f.key("J_kgm2", 1e7)
    }),
    kind("Kt in mN m/A", true, &["Kt_nm_per_a"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("Kt_nm_per_a", 1e3)
    }),
    kind("Kt in mN m/A, without Ke", false, &["Kt_nm_per_a"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("Kt_nm_per_a", 1e3);
        f.without_key("Ke_vs_per_rad")
    }),
    kind("Kt in N cm/A", false, &["Kt_nm_per_a"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("Kt_nm_per_a", 1e2)
    }),
    kind("Ke in V/krpm", true, &["Ke_vs_per_rad"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("Ke_vs_per_rad", 1000.0 / RPM)
    }),
    kind("Ke in V/krpm, without Kt", false, &["Ke_vs_per_rad"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("Ke_vs_per_rad", 1000.0 / RPM);
        f.without_key("Kt_nm_per_a")
    }),
    kind("R in mΩ", true, &["R_ohm"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("R_ohm", 1e3)
    }),
    kind("R in mΩ, with the current", false, &["R_ohm", "i_a"], |f| {
        f.without(&["theta_rad"]);
        f.key("R_ohm", 1e3)
    }),
    kind("encoder behind a gear of 20:1", true, SPEED, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", 0.05)
    }),
    kind("encoder before a gear of 20:1", false, SPEED, |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", 20.0)
    }),
    kind("encoder behind a gear of 50:1, position", false, &["theta_rad"], |f| {
        f.without(&["omega_rad_s", "i_a"]);
        f.scale("theta_rad", 0.02)
    }),
    kind("counts not multiplied by 4", true, &["omega_rad_s", "theta_rad"], |f| {
        f.without(&["i_a"]);
        f.scale("theta_rad", 0.25);
        f.scale("omega_rad_s", 0.25)
    }),
    kind("a hold-out of another motor", true, &["another motor"], |f| f.holdout = f.stranger.clone()),
    kind("a hold-out of another motor, speed alone", false, &["another motor"], |f| {
        f.holdout = f.stranger.clone();
        f.without(&["theta_rad", "i_a"])
    }),
    kind("a hold-out of another motor, position alone", false, &["another motor"], |f| {
        f.holdout = f.stranger.clone();
        f.without(&["omega_rad_s", "i_a"])
    }),
    kind("a hold-out in rpm", true, &["another motor", "holdout"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.holdout[2].1.iter_mut().for_each(|w| *w *= RPM)
    }),
    kind("a hold-out reversed", false, &["another motor", "holdout"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.holdout[2].1.iter_mut().for_each(|w| *w *= -1.0)
    }),
    kind("a hold-out with PWM for volts", false, &["another motor", "holdout"], |f| {
        f.without(&["theta_rad", "i_a"]);
        let v = f.volts;
        f.holdout[1].1.iter_mut().for_each(|u| *u = (*u / v * 255.0).round())
    }),
    kind("the log as its own hold-out", true, &["same"], |f| f.holdout = f.log.clone()),
    noted("rows shifted by one: speed early", true, &["row"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| shift(r, 1))
    }),
    noted("rows shifted by two: speed early", false, &["row"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| shift(r, 2))
    }),
    noted("speed smoothed over 41 rows", true, &["smooth"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| smooth(&mut r[2].1, 20))
    }),
    noted("speed smoothed over 21 rows", false, &["smooth"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| smooth(&mut r[2].1, 10))
    }),
    noted("coarse speed, not stated", true, &["steps"], |f| {
        f.without(&["theta_rad", "i_a"]);
        let step = 0.04 * f.volts / 0.05;
        f.change("omega_rad_s", |w| (w / step).round() * step)
    }),
    kind("one row in 60 lost, position logged", true, &["rows are missing"], |f| {
        f.without(&["i_a"]);
        f.records(|r| drop_rows(r, 60))
    }),
    kind("one row in 40 lost, speed alone", false, &["rows are missing"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| drop_rows(r, 40))
    }),
    kind("one row in 100 doubled", true, &["rows are doubled"], |f| f.records(|r| double_rows(r, 100))),
    kind("one row in 25 doubled, speed alone", false, &["rows are doubled"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| double_rows(r, 25))
    }),
    noted("sensor read at every second row", false, &["read less often"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.records(|r| (1..r[2].1.len()).step_by(2).for_each(|k| r[2].1[k] = r[2].1[k - 1]))
    }),
    kind("supply of 12 V in a log of 24 V", false, &["nominal_v", "u_v"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.key("nominal_v", 0.25)
    }),
    kind("a NaN in the speed", false, &["line"], |f| f.records(|r| r[2].1[500] = f64::NAN)),
    noted("all speeds 0", true, &["encoder connected"], |f| {
        f.without(&["theta_rad", "i_a"]);
        f.scale("omega_rad_s", 0.0)
    }),
];

/// One row in so many is lost, and the time column goes on as if it were not.
fn drop_rows(record: &mut super::rig::Columns, of: usize) {
    for column in record.iter_mut() {
        let mut row = 0;
        let rows = column.1.len();
        if column.0 == "t_s" {
            column.1.truncate(rows - (0..rows).filter(|row| gone(*row, of)).count());
            continue;
        }
        column.1.retain(|_| {
            row += 1;
            !gone(row - 1, of)
        });
    }
}

/// Lost rows are not evenly apart.
fn gone(row: usize, of: usize) -> bool {
    // Multiplicative hashing (Knuth, The Art of Computer Programming 3, 6.4).
    row > 0 && (((row as u32).wrapping_mul(2_654_435_769) >> 12) as usize).is_multiple_of(of)
}

/// One row in so many stands twice.
fn double_rows(record: &mut super::rig::Columns, of: usize) {
    let rows = record[0].1.len();
    for column in record.iter_mut().filter(|column| column.0 != "t_s") {
        let twice =
            (0..rows).flat_map(|row| std::iter::repeat_n(column.1[row], 1 + usize::from(gone(row, of))));
        column.1 = twice.take(rows).collect();
    }
}

/// The outputs come so many rows before their input.
fn shift(record: &mut super::rig::Columns, rows: usize) {
    for column in record.iter_mut() {
        match column.0 {
            "t_s" => column.1.truncate(column.1.len() - rows),
            "u_v" => column.1.truncate(column.1.len() - rows),
            _ => drop(column.1.drain(..rows)),
        }
    }
}

/// A mean over rows before and after.
fn smooth(values: &mut Vec<f64>, reach: usize) {
    let means = (0..values.len()).map(|k| {
        let rows = &values[k.saturating_sub(reach)..(k + reach + 1).min(values.len())];
        rows.iter().sum::<f64>() / rows.len() as f64
    });
    *values = means.collect();
}
