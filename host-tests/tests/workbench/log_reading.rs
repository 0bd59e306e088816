//! Reading logs: units, aliases, foreign headers, and every defect named by line, column and remedy.

use servo::axis::Bridge;
use truing::files::log::{self, Columns, Dynamic, Input, Log};

fn dynamic(text: &str, columns: &str) -> Dynamic {
    match log::parse("log.csv", text, &columns.parse().unwrap()).unwrap() {
        Log::Dynamic(log) => log,
        Log::Table(_) => panic!("read as a table"),
    }
}

fn defect(text: &str, columns: &str) -> String {
    let columns: Columns = match columns.parse() {
        Ok(columns) => columns,
        Err(error) => return error.to_string(),
    };
    log::parse("log.csv", text, &columns).unwrap_err().to_string()
}

/// A header and 40 rows of 1 ms from a pattern of the row number.
fn rows(header: &str, row: impl Fn(usize) -> String) -> String {
    let body: Vec<String> = (0..40).map(row).collect();
    format!("# a comment\n{header}\n{}\n", body.join("\n"))
}

#[test]
fn columns_come_in_any_order_and_in_si_units() {
    let text = rows("omega_rpm,t_ms,note,u_v", |k| format!("60,{k},x,1.5"));
    let text = text.replace(",x,", ",0,");
    let log = dynamic(&text, "");
    assert_eq!((log.input, log.linear, log.rows()), (Input::Voltage, false, 40));
    assert!((log.runs[0].t_s[3] - 0.003).abs() < 1e-12);
    assert!((log.runs[0].speed.as_ref().unwrap()[0] - std::f64::consts::TAU).abs() < 1e-12);
    assert_eq!(
        log.runs[0].bridge,
        vec![Bridge::Driven; 40],
        "an absent bridge column means driven throughout"
    );
}

#[test]
fn a_duty_is_multiplied_by_the_supply_of_its_row() {
    let log =
        dynamic(&rows("t_s,duty,vbus_v,theta_rad", |k| format!("{},-0.5,{},0", k as f64 * 1e-3, 10 + k)), "");
    assert_eq!(log.runs[0].input[4], -7.0);
}

#[test]
fn foreign_headers_are_mapped_with_factors() {
    let text = rows("zeit,pwm,batt,left_rpm", |k| format!("{},-128,8.0,{k}", k as f64 * 1e-3));
    let log = dynamic(&text, "t_s=zeit,duty=pwm*0.00390625,vbus_v=batt,omega_rad_s=left_rpm*0.104720");
    assert!((log.runs[0].input[0] + 4.0).abs() < 1e-12);
    assert!((log.runs[0].speed.as_ref().unwrap()[10] - 0.104720 * 10.0).abs() < 1e-12);
}

#[test]
fn an_absent_or_ignored_time_makes_a_steady_state_table() {
    let without = "voltage_v,speed_rpm\n1,60\n2,120\n3,180\n4,240\n";
    let Log::Table(table) = log::parse("table.csv", without, &Columns::default()).unwrap() else {
        panic!("a log")
    };
    assert!((table.omega_rad_s[0] - std::f64::consts::TAU).abs() < 1e-12);
    let with = rows("t_s,u_v,omega_rad_s", |k| format!("{k},{k},{k}"));
    let ignored = log::parse("table.csv", &with, &"t_s=none".parse().unwrap()).unwrap();
    assert!(matches!(ignored, Log::Table(table) if table.u_v.len() == 40));
}

#[test]
fn runs_start_anew_with_their_own_time() {
    let text = rows("run,t_s,force_n,q_m", |k| format!("{},{},1,0", k / 20, (k % 20) as f64));
    let log = dynamic(&text, "");
    assert_eq!((log.runs.len(), log.runs[1].id, log.input, log.linear), (2, 1, Input::Force, true));
}

#[test]
fn every_defect_is_named_with_its_place_and_remedy() {
    let good = |k: usize| format!("{},1,0", k as f64 * 1e-3);
    let header = "t_s,u_v,theta_rad";
    let broken =
        |k: usize, text: &str| rows(header, |row| if row == k { text.to_owned() } else { good(row) });
    // The comment is line 1, the header line 2, row k line k + 3.
    let cases: Vec<(String, &str, &[&str])> = vec![
        (String::new(), "", &["log.csv", "empty", "header"]),
        ("t_s,u_v,theta_rad\n".into(), "", &["no rows"]),
        ("1,2,3\n4,5,6\n".into(), "", &["line 1", "header line"]),
        (broken(38, "0.038,1"), "", &["line 41", "truncated"]),
        (broken(5, "0.005,abc,0"), "", &["line 8", "u_v", "abc", "not a number"]),
        (broken(5, "0.005,NaN,0"), "", &["line 8", "u_v", "finite"]),
        (broken(5, "0.005,,0"), "", &["line 8", "u_v"]),
        (rows("t_s,theta_rad", |k| format!("{k},0")), "", &["line 2", "input", "u_v"]),
        (rows("t_s,u_kv,theta_rad", good), "", &["`u_kv`", "unknown unit", "--columns"]),
        (rows("t_s,u_v", |k| format!("{k},0")), "", &["speed or the position", "theta_rad"]),
        (rows("t_s,duty,theta_rad", good), "", &["vbus_v"]),
        (rows("t_s,duty,vbus_v,theta_rad", |k| format!("{k},1.5,12,0")), "", &["line 3", "duty", "outside"]),
        (rows("t_s,u_v,theta_rad,bridge", |k| format!("{k},1,0,7")), "", &["line 3", "bridge", "7"]),
        (rows("t_s,u_v,q_m,omega_rad_s", |k| format!("{k},1,0,0")), "", &["rad and m"]),
        (rows("t_s,u_v,theta_rad,theta_deg", |k| format!("{k},1,0,0")), "", &["same quantity", "theta_deg"]),
        ("t_s,u_v,theta_rad\n0,1,0\n1,1,0\n".into(), "", &["2 rows", "at least 20"]),
        ("u_v,omega_rad_s\n0,1\n".into(), "", &["1 points"]),
        (rows(header, good), "u_v=missing", &["--columns", "`missing`", "t_s, u_v"]),
        (rows(header, good), "u_volt=u_v", &["`u_volt`", "no known column"]),
        (rows(header, good), "u_v", &["--columns", "OUR_NAME=FILE_NAME"]),
        (rows(header, good), "u_v=u_v*0", &["factor"]),
    ];
    for (text, columns, wanted) in cases {
        let message = defect(&text, columns);
        assert!(!message.contains('\n'), "one sentence: {message}");
        for part in wanted {
            assert!(message.contains(part), "`{part}` is not in: {message}");
        }
    }
    let unreadable =
        log::read(std::path::Path::new("no/such.csv"), &Columns::default()).unwrap_err().to_string();
    assert!(unreadable.contains("no/such.csv") && unreadable.contains("check the path"));
}
