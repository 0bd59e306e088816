//! Wrong units, signs, columns, keys and held-out records are told before any effect is searched for, and right files are not accused.

use std::path::Path;
use truing::files::log::{self, Columns, Log};
use truing::files::model::{self, Model};
use truing::gap::{self, Options, examine};
use truing::outcome::{DataFault, Verdict};
use truing::synthetic::cases::{Set, Spec, draw};

const MODEL: &str = "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = 2.0\nKt_nm_per_a = 0.05\n\
                     Ke_vs_per_rad = 0.05\nJ_kgm2 = 1e-4\nb_nms_per_rad = 1e-5\n[supply]\nnominal_v = 12.0\n";

/// What a logger may do to a row: time, voltage, speed, position, current.
type Row = [f64; 5];

/// A motor with a dead zone of 1 V: more is missing than the examination knows.
fn rows(seed: u32, resistance: f64, constant: f64) -> Vec<Row> {
    many_rows(1500, seed, resistance, constant)
}

fn many_rows(count: usize, seed: u32, resistance: f64, constant: f64) -> Vec<Row> {
    driven(count, seed, resistance, constant, 11.0, 0.5)
}

/// Steps up to so many volts, a speed that is read with so much noise.
fn driven(count: usize, seed: u32, resistance: f64, constant: f64, volts: f64, noise: f64) -> Vec<Row> {
    let (mut omega, mut theta, mut random) = (0.0, 0.0, seed);
    let mut drawn = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(random >> 8) / f64::from(1 << 24) - 0.5
    };
    let mut u = 0.0;
    (0..count)
        .map(|k| {
            if k % 40 == 0 {
                u = 2.0 * volts * drawn();
            }
            let beyond = f64::signum(u) * (u.abs() - 1.0).max(0.0);
            let row = [
                k as f64 * 0.005,
                u,
                omega + 2.0 * noise * drawn(),
                theta,
                (beyond - constant * omega) / resistance,
            ];
            for _ in 0..50 {
                let current = (beyond - constant * omega) / resistance;
                omega += 1e-4 * (constant * current - 1e-5 * omega) / 1e-4;
                theta += 1e-4 * omega;
            }
            row
        })
        .collect()
}

/// A log with some of the columns, after the logger has done this to each row.
fn logged(columns: &[usize], rows: &[Row], change: impl Fn(&mut Row)) -> Log {
    const NAMES: [&str; 5] = ["t_s", "u_v", "omega_rad_s", "theta_rad", "i_a"];
    let header: Vec<&str> = columns.iter().map(|k| NAMES[*k]).collect();
    let mut text = header.join(",");
    for row in rows {
        let mut row = *row;
        change(&mut row);
        let cells: Vec<String> = columns.iter().map(|k| format!("{:.9}", row[*k])).collect();
        text += &format!("\n{}", cells.join(","));
    }
    log::parse("log.csv", &text, &Columns::default()).unwrap()
}

fn parsed(text: &str) -> Model {
    model::parse("model.toml", text).unwrap()
}

const SPEED: &[usize] = &[0, 1, 2];

/// A log under the names of somebody else, in somebody else's units.
fn foreign(rows: &[Row], change: impl Fn(&mut Row)) -> String {
    let mut text = "time_ms,voltage_v,Drehzahl [1/min],i_ma".to_owned();
    for row in rows {
        let mut row = *row;
        change(&mut row);
        let rpm = row[2] * 60.0 / std::f64::consts::TAU;
        text += &format!("\n{:.6},{:.9},{rpm:.9},{:.9}", 1e3 * row[0], row[1], 1e3 * row[4]);
    }
    text
}

/// What stands between the quotes behind `--columns`.
fn option(remedy: &str) -> &str {
    remedy.split("--columns \"").nth(1).and_then(|rest| rest.split('"').next()).expect("an option to type")
}

#[test]
fn the_line_under_mend_is_typed_for_a_file_with_its_own_names_and_the_accusation_goes() {
    let (model, right) = (parsed(MODEL), rows(1, 2.0, 0.05));
    type Mistake = (fn(&mut Row), &'static str);
    let mistakes: [Mistake; 10] = [
        (|row| row[2] *= -1.0, "wrong sign"),
        (|row| row[2] *= 60.0 / std::f64::consts::TAU, "is in rpm"),
        (|row| row[2] *= 7.0, "pole pairs"),
        (|row| row[2] /= 7.0, "a gear of"),
        (|row| row[1] *= 1000.0, "is in mV"),
        (|row| row[0] *= 1000.0, "t_s is in ms"),
        (|row| (row[1], row[2]) = (row[2], row[1]), "each other's place"),
        (|row| row[4] *= 2.0, "times the current"),
        (|row| row[4] += 0.8, "zero of i_a"),
        (|row| row[4] = row[4].abs(), "lost its sign"),
    ];
    for (change, words) in mistakes {
        for typed in ["", "omega_rpm=Drehzahl [1/min]", "t_ms=time_ms,u_v=voltage_v*1,i_ma=i_ma"] {
            let text = foreign(&right, change);
            let columns = |items: &str| Columns::of(items, &model).unwrap();
            let log = log::parse("log.csv", &text, &columns(typed)).unwrap();
            let faults = examine::faults(&model, &log, &[]);
            let [fault] = &faults[..] else { panic!("{words}, {typed}: {faults:?}") };
            assert!(fault.what.contains(words), "{words}: {fault:?}");
            let mended = log::parse("log.csv", &text, &columns(option(&fault.remedy)));
            let mended = mended.unwrap_or_else(|error| panic!("{words}, {typed}, {fault:?}: {error}"));
            assert_eq!(examine::faults(&model, &mended, &[]), [], "{words}, {typed}: {}", fault.remedy);
        }
    }
}

#[test]
fn a_drive_that_acts_one_way_is_told_as_that() {
    let model = parsed(MODEL);
    for (drive, words) in
        [(f64::max as fn(f64, f64) -> f64, "one direction only"), (|u: f64, _| u.abs(), "rectifies")]
    {
        let (mut omega, right) = (0.0, rows(11, 2.0, 0.05));
        let answered: Vec<Row> = right
            .iter()
            .map(|row| {
                let seen = [row[0], row[1], omega, 0.0, 0.0];
                for _ in 0..50 {
                    omega += 1e-4 * (0.05 * (drive(row[1], 0.0) - 0.05 * omega) / 2.0 - 1e-5 * omega) / 1e-4;
                }
                seen
            })
            .collect();
        let text = foreign(&answered, |_| ());
        let log = log::parse("log.csv", &text, &Columns::default()).unwrap();
        let faults = examine::faults(&model, &log, &[]);
        assert!(faults.len() == 1 && faults[0].what.contains(words), "{words}: {faults:?}");
        let columns = Columns::of(option(&faults[0].remedy), &model).unwrap();
        assert_eq!(examine::faults(&model, &log::parse("log.csv", &text, &columns).unwrap(), &[]), []);
    }
}

#[test]
fn right_files_that_used_to_be_accused_are_not() {
    // An angle alone, half of the rows under one torque and half under the other.
    let theta = [
        0.0, 0.0473, 0.1768, 0.3735, 0.6252, 0.9219, 1.2556, 1.6194, 2.0079, 2.4167, 2.8420, 3.1862, 3.3772,
        3.4429, 3.4059, 3.2850, 3.0952, 2.8492, 2.5571, 2.2272,
    ];
    let row = |(k, theta): (usize, &f64)| {
        format!("\n{:.1},{},{theta}", 0.1 * k as f64, if k < 10 { 1 } else { -1 })
    };
    let text = "t_s,torque_nm,theta_rad".to_owned() + &theta.iter().enumerate().map(row).collect::<String>();
    let joint =
        MODEL.replace("J_kgm2 = 1e-4", "J_kgm2 = 0.1").replace("b_nms_per_rad = 1e-5", "b_nms_per_rad = 0.2");
    // The same speed twice by chance, of a sensor of coarse steps; three seconds cut out.
    let coarse = rows(21, 2.0, 0.05);
    let torn: Vec<Row> =
        coarse.iter().enumerate().filter(|(k, _)| !(500..1100).contains(k)).map(|(_, row)| *row).collect();
    let two = |row: &mut Row| row[2] = (row[2] / 0.5).round() * 0.5;
    let sheet = MODEL.to_owned();
    let logs = [
        (&joint, log::parse("log.csv", &text, &Columns::default())),
        (&sheet, Ok(logged(SPEED, &coarse, two))),
        (&sheet, Ok(logged(SPEED, &torn, |_| ()))),
    ];
    // A dead zone that most steps hardly pass looks like a gear, one between two that are tried like a row late.
    let wide = [1.2, 1.4, 1.7].map(|volts| driven(3000, 5, 2.0, 0.05, volts, 0.01));
    let between = [3.0, 4.0, 6.0].map(|volts| driven(3000, 9, 2.0, 0.05, volts, 0.002));
    let zones = wide.iter().chain(&between).map(|rows| (&sheet, Ok(logged(SPEED, rows, |_| ()))));
    for (model, log) in logs.into_iter().chain(zones) {
        let (model, log) = (parsed(model), log.unwrap());
        assert_eq!(examine::faults(&model, &log, &[]), []);
        assert_eq!(examine::put_right(&model, &log, &[]).notes, Vec::<String>::new());
    }
}

#[test]
fn an_input_that_is_logged_late_is_told_with_its_time_and_read_earlier() {
    let (model, right) = (parsed(MODEL), rows(31, 2.0, 0.05));
    for late in [1, 5, 20] {
        let moved: Vec<Row> = (0..right.len())
            .map(|k| {
                [right[k].to_vec(), vec![]].concat()[..]
                    .try_into()
                    .map(|mut row: Row| {
                        row[1] = right[k.saturating_sub(late)][1];
                        row
                    })
                    .unwrap()
            })
            .collect();
        let found = examine::put_right(&model, &logged(SPEED, &moved, |_| ()), &[]);
        assert_eq!(found.late, late);
        assert!(found.notes[0].contains(&format!("({} ms) late", 5 * late)), "{:?}", found.notes);
    }
}

#[test]
fn a_sensor_that_stands_while_the_motor_is_driven_both_ways_is_cut_out() {
    let (model, right) = (parsed(MODEL), rows(41, 2.0, 0.05));
    for (from, to) in [(400, 700), (1000, 1500)] {
        let mut frozen = right.clone();
        frozen[from..to].iter_mut().for_each(|row| (row[2], row[3]) = (right[from][2], right[from][3]));
        for columns in [SPEED, &[0, 1, 3]] {
            let found = examine::put_right(&model, &logged(columns, &frozen, |_| ()), &[]);
            let said = format!("from {:.3} s to {:.3} s", right[from][0], right[to - 1][0]);
            assert!(found.notes.len() == 1 && found.notes[0].contains(&said), "{said}: {:?}", found.notes);
            let Some(Log::Dynamic(kept)) = found.log else { panic!("a record is left") };
            assert!(kept.rows() <= right.len() - (to - from) && kept.rows() > 900);
        }
    }
}

/// Driven to and fro for 70 ms it goes less than a count.
#[test]
fn a_shaft_that_is_reversed_faster_than_it_turns_has_not_stopped() {
    let (model, right) = (parsed(MODEL), rows(41, 2.0, 0.05));
    let step = right[1][0] - right[0][0];
    let hard = right.iter().map(|row| row[1].abs()).fold(0.0, f64::max);
    let standing = (0..28).map(|k| {
        let mut row = right[0];
        (row[0], row[1], row[2]) = (step * f64::from(k), if k / 7 % 2 == 0 { hard } else { -hard }, 0.0);
        row
    });
    let mut driven: Vec<Row> = standing.collect();
    driven.extend(right.iter().map(|row| {
        let mut row = *row;
        row[0] += 28.0 * step;
        row
    }));
    let found = examine::put_right(&model, &logged(SPEED, &driven, |_| ()), &[]);
    assert!(found.notes.iter().all(|note| !note.contains("left out")), "{:?}", found.notes);
}

#[test]
fn bad_cells_are_taken_out_and_told_by_their_line() {
    let right = rows(51, 2.0, 0.05);
    let all = &[0, 1, 2, 3, 4];
    let read = |rows: &[Row]| {
        let Log::Dynamic(record) = logged(all, rows, |_| ()) else { panic!("a record") };
        record
    };
    let whole = read(&right);
    assert_eq!(whole.rows(), right.len());
    for (column, row, value) in [
        (1, 700, 24.0),
        (1, 711, 0.0),
        (1, 0, 255.0),
        (2, 0, -9999.0),
        (2, 1499, 900.0),
        (2, 633, 0.0),
        (3, 900, 1e6),
        (4, 411, -9999.0),
    ] {
        let mut bad = right.clone();
        bad[row][column] = value;
        let header = "t_s,u_v,omega_rad_s,theta_rad,i_a".to_owned();
        let text = bad.iter().fold(header, |text, row| {
            text + &format!("\n{:.9},{:.9},{:.9},{:.9},{:.9}", row[0], row[1], row[2], row[3], row[4])
        });
        let columns = Columns::of("", &parsed(MODEL)).unwrap();
        let reading = log::parse_bytes("log.csv", text.as_bytes(), &columns).unwrap();
        let line = format!("line {}:", row + 2);
        assert!(reading.notes.iter().any(|note| note.contains(&line)), "{column} {line} {:?}", reading.notes);
        let Log::Dynamic(kept) = reading.log else { panic!("a record") };
        let values =
            |run: &log::Run| [run.input.clone(), run.speed.clone().unwrap(), run.current_a.clone().unwrap()];
        let worst =
            kept.runs.iter().flat_map(values).flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
        assert!(worst < 300.0, "{column} {row}: {worst}");
    }
}

#[test]
fn a_supply_that_gives_way_to_a_step_is_read_and_one_that_is_gone_is_not() {
    let lines = |dip: f64| {
        let text = rows(61, 2.0, 0.05).iter().enumerate().fold(
            "t_s,u_v,omega_rad_s,vbus_v".to_owned(),
            |text, (k, row)| {
                let supply = if k % 240 == 1 { dip } else { 12.0 + 0.002 * row[1] };
                text + &format!("\n{:.4},{:.6},{:.6},{supply:.4}", row[0], row[1], row[2])
            },
        );
        log::parse_bytes("log.csv", text.as_bytes(), &Columns::default()).unwrap().notes
    };
    let told = |notes: &[String]| notes.iter().any(|note| note.contains("vbus_v"));
    assert!(!told(&lines(11.0)) && told(&lines(3.0)));
}

#[test]
fn single_bad_cells_beside_a_motor_as_fast_as_its_rows_are_told_by_their_line() {
    let right: Vec<Row> = many_rows(12_000, 52, 2.0, 0.05).into_iter().step_by(10).collect();
    let notes = |rows: &[Row]| {
        let lines = rows.iter().map(|row| format!("\n{:.3},{:.6},{:.6}", row[0], row[1], row[2]));
        let text = std::iter::once("t_s,u_v,omega_rad_s".to_owned()).chain(lines).collect::<String>();
        let columns = Columns::of("", &parsed(MODEL)).unwrap();
        log::parse_bytes("log.csv", text.as_bytes(), &columns).unwrap().notes.join("; ")
    };
    assert!(!notes(&right).contains("cannot be"), "{}", notes(&right));
    let largest = |column: usize| right.iter().fold(0.0_f64, |most, row| most.max(row[column].abs()));
    for column in [1, 2] {
        // Within a level: at its end a cell may lie between its neighbours, as what passes does.
        for row in [201, 602, 1001] {
            let mut bad = right.clone();
            bad[row][column] -= 1.2 * largest(column) * right[row][column].signum();
            let told = notes(&bad);
            assert!(told.contains(&format!("line {}:", row + 2)), "{column} {row}: {told}");
        }
    }
}

#[test]
fn a_speed_that_settles_at_once_is_no_frozen_encoder() {
    let right = rows(53, 2.0, 0.05);
    let settled = |k: usize| if k == 0 { 0.0 } else { (2.0 * right[k - 1][1]).round() };
    let fast: Vec<Row> = (0..right.len()).map(|k| [right[k][0], right[k][1], settled(k), 0.0, 0.0]).collect();
    let found = examine::put_right(&parsed(MODEL), &logged(SPEED, &fast, |_| ()), &[]);
    assert!(found.notes.iter().all(|note| !note.contains("repeats")), "{:?}", found.notes);
}

#[test]
fn each_mistake_is_told_with_its_place_and_goes_with_its_remedy() {
    let right = rows(1, 2.0, 0.05);
    let rpm = 60.0 / std::f64::consts::TAU;
    let all = &[0, 1, 2, 3];
    let current = &[0, 1, 2, 4];
    type Mistake = (&'static [usize], fn(&mut Row, f64), &'static str);
    let mistakes: [Mistake; 10] = [
        (SPEED, |row, rpm| row[2] *= rpm, "omega_rad_s is in rpm"),
        (SPEED, |row, _| row[2] *= 180.0 / std::f64::consts::PI, "omega_rad_s is in °/s"),
        (SPEED, |row, _| row[2] *= -1.0, "wrong sign"),
        (SPEED, |row, _| row[1] *= 1000.0, "u_v is in mV"),
        (SPEED, |row, _| row[1] = (row[1] / 12.0 * 255.0).round(), "u_v is a PWM of 8 bits"),
        (SPEED, |row, _| row[1] /= 12.0, "u_v is a duty from -1 to 1"),
        (SPEED, |row, _| row[2] *= 0.05, "a gear of 20"),
        (all, |row, _| row[3] *= 180.0 / std::f64::consts::PI, "theta_rad is in degrees"),
        (current, |row, _| row[4] *= 1000.0, "i_a is in mA"),
        (current, |row, _| row[4] *= -1.0, "i_a has the wrong sign"),
    ];
    for (columns, make, words) in mistakes {
        let model = parsed(MODEL);
        assert_eq!(
            examine::faults(&model, &logged(columns, &right, |_| ()), &[]),
            [],
            "{words}: the right file"
        );
        let faults = examine::faults(&model, &logged(columns, &right, |row| make(row, rpm)), &[]);
        let [fault] = &faults[..] else { panic!("{words}: {faults:?}") };
        assert!(fault.what.contains(words), "{words}: {fault:?}");
        assert!(fault.explained_with_it > 0.9 && fault.explained_with_it > fault.explained_as_it_stands);
        assert!(fault.remedy.contains("--columns"), "{fault:?}");
    }
}

/// What explains all of it leaves nothing that others could be compared with.
#[test]
fn a_speed_without_noise_in_rpm_is_told() {
    let model = parsed(
        "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\ngain_rad_s_per_v = 10.0\ntime_constant_s = 0.1\n\
         [supply]\nnominal_v = 12.0\n",
    );
    let row = |k: u32| {
        let (time, wave) = (0.01 * f64::from(k), (0.01 * f64::from(k)).sin());
        format!("{time},{},{}\n", 6.0 * wave, 60.0 * 9.5493 * wave)
    };
    let text: String = std::iter::once("t_s,u_v,omega_rad_s\n".to_owned()).chain((0..800).map(row)).collect();
    let log = log::parse("log.csv", &text, &Columns::default()).unwrap();
    let faults = examine::faults(&model, &log, &[]);
    assert!(faults.len() == 1 && faults[0].what.contains("rpm"), "{faults:?}");
}

#[test]
fn a_key_in_another_unit_is_told_with_the_number_that_was_meant() {
    let log = logged(SPEED, &rows(2, 2.0, 0.05), |_| ());
    for (from, to, remedy) in [
        ("J_kgm2 = 1e-4", "J_kgm2 = 1e3", "J_kgm2 = 0.0001"),
        ("Kt_nm_per_a = 0.05", "Kt_nm_per_a = 50.0", "Kt_nm_per_a = 0.05"),
        ("Ke_vs_per_rad = 0.05", "Ke_vs_per_rad = 5.236", "Ke_vs_per_rad = 0.05"),
        ("R_ohm = 2.0", "R_ohm = 2000.0", "R_ohm = 2"),
    ] {
        let faults = examine::faults(&parsed(&MODEL.replace(from, to)), &log, &[]);
        let [fault] = &faults[..] else { panic!("{to}: {faults:?}") };
        assert!(fault.remedy.contains(remedy), "{to}: {fault:?}");
    }
}

#[test]
fn a_held_out_record_of_another_motor_is_told() {
    let model = parsed(MODEL);
    let log = logged(SPEED, &rows(3, 2.0, 0.05), |_| ());
    let same = logged(SPEED, &rows(4, 2.0, 0.05), |_| ());
    let other = logged(SPEED, &rows(4, 2.6, 0.11), |_| ());
    assert_eq!(examine::faults(&model, &log, std::slice::from_ref(&same)), []);
    let faults = examine::faults(&model, &log, &[same, other]);
    let [fault] = &faults[..] else { panic!("{faults:?}") };
    assert!(fault.what.contains("another motor"), "{fault:?}");
}

#[test]
fn the_verdict_is_data_and_whoever_accepts_it_gets_a_note() {
    let model = parsed(MODEL);
    let log = logged(SPEED, &rows(5, 2.0, 0.05), |row| row[2] *= -1.0);
    let asked = |accept_data: bool| {
        let options = Options { accept_data, ..Options::default() };
        gap::run(&model, &log, &[], &options, &|_| ()).unwrap()
    };
    let refused = asked(false);
    assert_eq!(refused.verdict, Verdict::Data);
    assert!(refused.effects.is_empty() && !refused.tested());
    let accepted = asked(true);
    assert_ne!(accepted.verdict, Verdict::Data);
    assert!(accepted.notes.iter().any(|note| note.contains("accepted although")), "{:?}", accepted.notes);
}

#[test]
fn a_smoothed_and_a_coarse_speed_are_notes() {
    let model = parsed(MODEL);
    let right = rows(6, 2.0, 0.05);
    let mut smooth = right.clone();
    for (k, row) in smooth.iter_mut().enumerate() {
        let near = &right[k.saturating_sub(10)..(k + 11).min(right.len())];
        row[2] = near.iter().map(|row| row[2]).sum::<f64>() / near.len() as f64;
    }
    let said = |log: &Log| examine::notes(&model, log).join("; ");
    assert_eq!(said(&logged(SPEED, &right, |_| ())), "");
    assert!(said(&logged(SPEED, &smooth, |_| ())).contains("smoothed over about"));
    let coarse = logged(SPEED, &right, |row| row[2] = (row[2] / 12.0).round() * 12.0);
    assert!(said(&coarse).contains("comes in steps of 12"), "{}", said(&coarse));
}

#[test]
fn a_long_position_that_turns_at_times_slowly_and_at_times_fast_is_not_accused() {
    let count = 2000.0 / std::f64::consts::TAU;
    let mut rows = many_rows(240_000, 5, 2.0, 0.05);
    // The joint of a long log: the first half is slow.
    let (mut theta, mut before) = (0.0, 0.0);
    for (k, row) in rows.iter_mut().enumerate() {
        let slow = if k < 120_000 { 0.05 } else { 1.0 };
        theta += slow * (row[3] - before);
        before = row[3];
        row[1] *= slow;
        row[3] = (theta * count).round() / count;
    }
    let log = logged(&[0, 1, 3], &rows, |_| {});
    assert_eq!(examine::faults(&parsed(MODEL), &log, &[]), []);
}

#[test]
fn no_drawn_case_is_accused() {
    let record = |text: &str| log::parse("log.csv", text, &Columns::default()).unwrap();
    for set in [Set::Single, Set::Pair, Set::Nothing, Set::Outside] {
        for seed in 62_001..62_016 {
            let case = draw(&Spec { evaluation: true, ..Spec::new(set) }, seed);
            let (log, holdout) = (record(&case.log.to_csv()), record(&case.holdout.to_csv()));
            let faults = examine::faults(&parsed(&case.model), &log, &[holdout]);
            assert_eq!(faults, Vec::<DataFault>::new(), "{set:?} {seed}");
        }
    }
}

#[test]
fn no_rig_is_accused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/rigs");
    let mut looked = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let folder = entry.unwrap().path();
        if !folder.join("log.csv").exists() {
            continue;
        }
        let read = |name: &str| log::read(&folder.join(name), &Columns::default()).unwrap();
        let model = model::read(&folder.join("model.toml")).unwrap();
        let faults = examine::faults(&model, &read("log.csv"), &[read("holdout.csv")]);
        assert_eq!(faults, Vec::<DataFault>::new(), "{}", folder.display());
        looked += 1;
    }
    assert!(looked >= 13, "{looked} rigs");
}

/// The rows with an even time column, as a logger writes that counts rows.
fn counted(rows: impl Iterator<Item = Row>, step_s: f64) -> Vec<Row> {
    rows.enumerate().map(|(k, row)| [k as f64 * step_s, row[1], row[2], row[3], row[4]]).collect()
}

const WITH_POSITION: &[usize] = &[0, 1, 2, 3];

#[test]
fn rows_that_are_lost_or_doubled_behind_an_even_clock_are_told() {
    let (model, whole) = (parsed(MODEL), rows(62_007, 2.0, 0.05));
    let lost = || whole.iter().enumerate().filter(|(k, _)| k % 37 != 11).map(|(_, row)| *row);
    let doubled = whole.iter().enumerate().flat_map(|(k, row)| vec![*row; if k % 53 == 7 { 2 } else { 1 }]);
    for (rows, said) in
        [(counted(lost(), 0.005), "rows are missing"), (counted(doubled, 0.005), "rows are doubled")]
    {
        let found = examine::faults(&model, &logged(WITH_POSITION, &rows, |_| ()), &[]);
        assert!(found.len() == 1 && found[0].what.contains(said), "{said}: {found:?}");
        assert!(found[0].explained_with_it > found[0].explained_as_it_stands, "{found:?}");
    }
    // With the time of each row nothing is wrong.
    for right in [whole.clone(), lost().collect()] {
        let found = examine::faults(&model, &logged(WITH_POSITION, &right, |_| ()), &[]);
        assert_eq!(found, Vec::<DataFault>::new());
    }
}

#[test]
fn a_clock_that_was_counted_and_a_sensor_that_is_read_too_seldom_are_notes() {
    let (model, fine) = (parsed(MODEL), rows(62_008, 2.0, 0.05));
    let log = |rows: &[Row]| logged(WITH_POSITION, rows, |_| ());
    let said = |log: &Log| examine::notes(&model, log).join("; ");
    // Every fourth row, some of them a row late: a loop that is not real-time.
    let late = counted((0..374).map(|k| fine[4 * k + (k * 7919 / 16) % 2]), 0.02);
    assert!(said(&log(&late)).contains("less evenly apart than t_s says"), "{}", said(&log(&late)));
    let punctual = counted((0..374).map(|k| fine[4 * k]), 0.02);
    assert!(!said(&log(&punctual)).contains("evenly"), "{}", said(&log(&punctual)));
    let held: Vec<Row> = (0..1500)
        .map(|k| {
            let (row, read) = (fine[k], fine[k - k % 3]);
            [row[0], row[1], read[2], read[3], read[4]]
        })
        .collect();
    assert!(said(&log(&held)).contains("read less often than rows are written"), "{}", said(&log(&held)));
}
