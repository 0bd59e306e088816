//! Logs of other people's kinds: each reads to the truth as it is, or with the columns that `look` proposes for it.

use std::f64::consts::TAU;
use truing::files::log::look::Look;
use truing::files::log::{self, Columns, Dynamic, Log};

/// One row of the truth: a motor of 16 rad/s per V and 90 ms, which has 12 V.
#[derive(Clone, Copy)]
struct Row {
    t_s: f64,
    u_v: f64,
    omega: f64,
    theta: f64,
}

const STEP_S: f64 = 0.01;

fn truth() -> Vec<Row> {
    let levels = [0.0, 6.0, -3.0, 12.0, -12.0, 1.5, -6.0, 9.0];
    let (mut omega, mut theta) = (0.0, 0.0);
    let row = |k: usize| {
        let (t_s, u_v) = (k as f64 * STEP_S, levels[k / 40 % levels.len()]);
        let row = Row { t_s, u_v, omega, theta };
        for _ in 0..100 {
            omega += (16.0 * u_v - omega) * STEP_S / 100.0 / 0.09;
            theta += omega * STEP_S / 100.0;
        }
        row
    };
    (0..600).map(row).collect()
}

fn rpm(row: &Row) -> f64 {
    row.omega * 60.0 / TAU
}

/// 09:12:01 plus so many seconds.
fn clock(t_s: f64) -> String {
    let all = 1.0 + t_s;
    format!("09:12:{all:06.3}")
}

fn table(header: &str, row: impl Fn(usize, &Row) -> String) -> String {
    let rows: Vec<String> = truth().iter().enumerate().map(|(k, known)| row(k, known) + "\n").collect();
    header.to_owned() + &rows.concat()
}

/// One million with commas between the thousands.
fn grouped(value: f64, group: char, point: char) -> String {
    let text = format!("{:.1}", value.abs());
    let (whole, rest) = text.split_once('.').unwrap();
    let mut digits = String::new();
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k).is_multiple_of(3) {
            digits.push(group);
        }
        digits.push(digit);
    }
    format!("{}{digits}{point}{rest}", if value < 0.0 { "-" } else { "" })
}

/// All of the voltage, then all of the speed.
fn influx() -> String {
    let series = |field: &str, value: fn(&Row) -> f64| {
        table("", |_, r| format!(",,0,2023-05-04T{}Z,{:.3},{field},motor", clock(r.t_s), value(r)))
    };
    let head = "#datatype,string,long,dateTime:RFC3339,double,string,string\n,result,table,_time,_value,_field,_measurement\n";
    head.to_owned() + &series("voltage", |r| r.u_v) + &series("rpm", rpm)
}

/// The name of a kind, the file, and what the user adds to what `look` proposes; empty: nothing.
fn kinds() -> Vec<(&'static str, String, &'static str)> {
    let lvm = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDate\t2023/05/04\nTime\t14:02:11.123\n***End_of_Header***\t\n\t\n\
               Channels\t2\t\t\nSamples\t600\t600\t\nY_Unit_Label\tVolts\trad/s\t\nX_Dimension\tTime\tTime\t\nX0\t0.0E+0\t0.0E+0\t\n\
               Delta_X\t0.01\t0.01\t\n***End_of_Header***\t\t\t\nX_Value\tVoltage\tSpeed\tComment\n";
    let scope = "Model,DS1054\nFirmware,1.2.3\nRecord Length,600\nSample Interval,0.01\nTrigger Point,300\nSource,CH1,CH2\n\n";
    vec![
        (
            "serial monitor, labels and a clock",
            table("boot\n", |_, r| {
                format!("{} -> pwm: {:.0}, rpm: {:.1}", clock(r.t_s), r.u_v * 21.25, rpm(r))
            }),
            "",
        ),
        (
            "serial monitor, labels alone",
            table("", |_, r| format!("t_ms: {:.0}, u_v: {:.2}, rpm: {:.1}", 1e3 * r.t_s, r.u_v, rpm(r))),
            "",
        ),
        (
            "labels with equal signs and blanks",
            table("", |_, r| format!("t_s={:.2} u_v={:.2} omega_rpm={:.1}", r.t_s, r.u_v, rpm(r))),
            "",
        ),
        (
            "lines of JSON",
            table("", |_, r| {
                format!("{{\"t_s\": {:.2}, \"u_v\": {:.2}, \"omega_rad_s\": {:.3}}}", r.t_s, r.u_v, r.omega)
            }),
            "",
        ),
        (
            "serial monitor, a table behind a clock",
            table("09:12:00.900 -> volts,rpm\n", |_, r| {
                format!("{} -> {:.2},{:.1}", clock(r.t_s), r.u_v, rpm(r))
            }),
            "",
        ),
        (
            "German Excel with thousands",
            table("Zeit [s];Spannung [V];Drehzahl [1/min]\r\n", |_, r| {
                format!(
                    "{};{};{}\r",
                    format!("{:.2}", r.t_s).replace('.', ","),
                    format!("{:.1}", r.u_v).replace('.', ","),
                    grouped(rpm(r), '.', ',')
                )
            }),
            "",
        ),
        (
            "English thousands without quotes",
            table("t_ms,u_v,omega_rpm\n", |_, r| {
                format!("{:.0},{:.1},{}", 1e3 * r.t_s, r.u_v, grouped(rpm(r), ',', '.'))
            }),
            "",
        ),
        (
            "LabVIEW .lvm",
            table(lvm, |_, r| format!("{:.2}\t{:.2}\t{:.3}\t", r.t_s, r.u_v, r.omega)),
            "t_s=X_Value",
        ),
        (
            "oscilloscope with a preamble",
            table(&format!("{scope}Time (s),Voltage (V),Speed (RPM)\n"), |_, r| {
                format!("{:.2},{:.2},{:.1}", r.t_s, r.u_v, rpm(r))
            }),
            "",
        ),
        (
            "a clock of the day",
            table("Timestamp,u_v,omega_rad_s\n", |_, r| {
                format!("{},{:.2},{:.3}", clock(r.t_s), r.u_v, r.omega)
            }),
            "",
        ),
        (
            "ISO 8601",
            table("time,u_v,omega_rad_s\n", |_, r| {
                format!("2023-06-19T{}Z,{:.2},{:.3}", clock(r.t_s), r.u_v, r.omega)
            }),
            "",
        ),
        (
            "German date",
            table("Uhrzeit;u_v;omega_rad_s\n", |_, r| {
                format!("19.06.2023 {};{:.2};{:.3}", clock(r.t_s), r.u_v, r.omega)
            }),
            "",
        ),
        (
            "MATLAB timetable",
            table("Time,u_v,omega_rad_s\n", |_, r| format!("{:.2} sec,{:.2},{:.3}", r.t_s, r.u_v, r.omega)),
            "",
        ),
        (
            "ROS 1, time in nanoseconds behind a per cent sign",
            table("%time,field.u_v,field.velocity0\n", |_, r| {
                format!(
                    "{},{:.2},{:.3}",
                    1_687_000_000_000_000_000_i64 + (r.t_s * 1e9) as i64,
                    r.u_v,
                    r.omega
                )
            }),
            "omega_rad_s=field.velocity0",
        ),
        (
            "ROS 2, seconds and nanoseconds",
            table("header.stamp.sec,header.stamp.nanosec,cmd.voltage_v,velocity[0]\n", |k, r| {
                format!("{},{},{:.2},{:.3}", 1_687_000_000 + k / 100, k % 100 * 10_000_000, r.u_v, r.omega)
            }),
            "omega_rad_s=velocity[0]",
        ),
        (
            "epoch in milliseconds",
            table("timestamp,u_v,omega_rad_s\n", |k, r| {
                format!("{},{:.2},{:.3}", 1_687_000_000_000_i64 + 10 * k as i64, r.u_v, r.omega)
            }),
            "",
        ),
        (
            "two topics at their own rates",
            table("__time,/cmd/u_v,/joint/omega_rad_s\n", |k, r| {
                let input =
                    if k % 40 == 0 { format!("{:.3},{:.2},\n", 1e9 + r.t_s, r.u_v) } else { String::new() };
                format!("{input}{:.3},,{:.3}", 1e9 + r.t_s + 0.0, r.omega)
            }),
            "u_v=/cmd/u_v,omega_rad_s=/joint/omega_rad_s",
        ),
        (
            "a counter that wraps",
            table("t_us,u_v,omega_rad_s\n", |_, r| {
                format!(
                    "{},{:.2},{:.3}",
                    (4_294_967_296_i64 - 2_000_000 + (r.t_s * 1e6).round() as i64) % 4_294_967_296,
                    r.u_v,
                    r.omega
                )
            }),
            "",
        ),
        (
            "a 16-bit counter of milliseconds",
            table("t_ms,u_v,omega_rad_s\n", |k, r| {
                format!("{},{:.2},{:.3}", (63_000 + 10 * k) % 65_536, r.u_v, r.omega)
            }),
            "",
        ),
        (
            "an angle folded at 360",
            table("t_s,u_v,alpha_deg\n", |_, r| {
                format!(
                    "{:.2},{:.2},{:.3}",
                    r.t_s,
                    0.2 * r.u_v,
                    (0.2 * r.theta).to_degrees().rem_euclid(360.0)
                )
            }),
            "",
        ),
        (
            "counts of an absolute encoder",
            table("t_s,u_v,position\n", |_, r| {
                format!(
                    "{:.2},{:.2},{}",
                    r.t_s,
                    0.2 * r.u_v,
                    (0.2 * r.theta / TAU * 4096.0).floor().rem_euclid(4096.0)
                )
            }),
            "",
        ),
        (
            "a sign in bit 15",
            table("t_s,u_v,counts\n", |_, r| {
                let counts = (0.2 * r.theta / TAU * 4096.0).round();
                format!(
                    "{:.2},{:.2},{}",
                    r.t_s,
                    0.2 * r.u_v,
                    if counts < 0.0 { 32768.0 - counts } else { counts }
                )
            }),
            "",
        ),
        (
            "times that repeat",
            table("t_s,u_v,omega_rad_s\n", |k, r| {
                let before = if k % 40 == 0 && k > 0 {
                    format!("{:.2},{:.2},{:.3}\n", r.t_s, 99.0, r.omega)
                } else {
                    String::new()
                };
                format!("{before}{:.2},{:.2},{:.3}", r.t_s, r.u_v, r.omega)
            }),
            "",
        ),
        (
            "two motors in one file",
            table("t_ms,left_pwm,right_pwm,right_rpm,left_rpm\n", |_, r| {
                format!(
                    "{:.0},{:.0},{:.0},{:.1},{:.1}",
                    1e3 * r.t_s,
                    r.u_v * 21.25,
                    -r.u_v * 8.0,
                    -rpm(r) * 0.4,
                    rpm(r)
                )
            }),
            "",
        ),
        (
            "electrical speed",
            table("t_ms,duty,v_in,erpm\n", |_, r| {
                format!("{:.0},{:.4},12.0,{:.0}", 1e3 * r.t_s, r.u_v / 12.0, 7.0 * rpm(r))
            }),
            "",
        ),
        (
            "numbered channels above their units",
            table("x-axis,1,2\nsecond,Volt,Volt\n", |_, r| {
                format!("{:.2},{:.2},{:.3}", r.t_s, r.u_v, r.omega / 20.0)
            }),
            "t_s=x-axis,u_v=1,omega_rad_s=2*20",
        ),
        (
            "a table between strokes",
            table("| t_s | u_v | omega_rad_s |\n|-----|-----|----|\n", |_, r| {
                format!("| {:.2} | {:.2} | {:.3} |", r.t_s, r.u_v, r.omega)
            }),
            "",
        ),
        (
            "a log of an ESP32, tags before the labels",
            table("", |_, r| format!("I ({:.0}) motor: voltage={:.2} rpm={:.1}", 1e3 * r.t_s, r.u_v, rpm(r))),
            "t_s=row*0.01",
        ),
        (
            "labels on lines of their own",
            table("", |_, r| {
                format!("{} -> voltage: {:.2}\n{} -> rpm: {:.1}", clock(r.t_s), r.u_v, clock(r.t_s), rpm(r))
            }),
            "t_s=clock",
        ),
        (
            "a summary below the rows",
            table("t_s,u_v,omega_rad_s\n", |k, r| {
                let below = if k == 599 { "\n\nEnd,,\nDuration: long" } else { "" };
                format!("{:.2},{:.2},{:.3}{below}", r.t_s, r.u_v, r.omega)
            }),
            "",
        ),
        (
            "a motor controller's log, time of the day in ms",
            table("ms_today;input_voltage;duty_cycle;erpm;temp;encoder\n", |k, r| {
                format!("{};12.0;{:.4};{:.0};31.2;-1", 36_000_000 + 10 * k, r.u_v / 12.0, 7.0 * rpm(r))
            }),
            "",
        ),
        (
            "one value a line, behind its topic",
            table("timestamp,topic,value\n", |_, r| {
                let t = 1.7e9 + r.t_s;
                format!("{t:.4},/motor/voltage,{:.2}\n{t:.4},/motor/velocity,{:.3}", r.u_v, r.omega)
            }),
            "u_v=/motor/voltage,omega_rad_s=/motor/velocity",
        ),
        (
            "all joints of a message in one cell",
            table("stamp,name,velocity,effort\n", |_, r| {
                format!(
                    "{:.3},\"['left', 'right']\",\"[0.0, {:.3}]\",\"array('d', [{:.2}, 0.0])\"",
                    r.t_s, r.omega, r.u_v
                )
            }),
            "omega_rad_s=velocity_1,u_v=effort_0",
        ),
        (
            "a robot's log, one value a line, with words among them",
            table("\"Timestamp\",\"Name\",\"Value\"\n", |_, r| {
                let line =
                    |name: &str, value: String| format!("\"{:.4}\",\"NT:/drive/{name}\",\"{value}\"", r.t_s);
                [
                    line("voltage (V)", format!("{:.2}", r.u_v)),
                    line("mode", "auto".into()),
                    line("velocity (rad/s)", format!("{:.3}", r.omega)),
                ]
                .join("\n")
            }),
            "",
        ),
        ("a database of time series, one signal behind the other", influx(), ""),
        (
            "no header",
            table("", |_, r| format!("{:.2},{:.2},{:.3}", r.t_s, r.u_v, r.omega)),
            "t_s=c1,u_v=c2,omega_rad_s=c3",
        ),
    ]
}

/// How a file is read: as it is, or with what `look` proposes and the user adds.
fn seen(text: &str, added: &str) -> Result<Look, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    let look = |columns: &str| {
        let columns = columns.parse::<Columns>().map_err(|error| error.0)?;
        log::look(&path, &columns).map_err(|error| error.0)
    };
    let first = look(added)?;
    match first.columns_argument.clone() {
        proposed if proposed.is_empty() => Ok(first),
        proposed => look(&proposed),
    }
}

/// How far a record is from the truth, relative to the largest input and speed.
fn error(record: &Dynamic) -> f64 {
    let (rows, run) = (truth(), &record.runs[0]);
    let scale = run.input.iter().fold(0.0_f64, |most, u| most.max(u.abs())) / 12.0;
    let speed = |row: usize| match (&run.speed, &run.position) {
        (Some(speed), _) => speed[row],
        (None, Some(theta)) => (theta[row + 1] - theta[row]) / STEP_S,
        (None, None) => f64::NAN,
    };
    let wanted = |row: usize| match run.speed {
        Some(_) => rows[row].omega,
        None => (rows[row + 1].theta - rows[row].theta) / STEP_S,
    };
    let at = |row: usize| {
        let known = &rows[row];
        let time = (run.t_s[row] - run.t_s[0] - known.t_s).abs() / STEP_S;
        let input = (run.input[row] - scale * known.u_v).abs() / (12.0 * scale);
        time.max(input).max((speed(row) - scale * wanted(row)).abs() / (192.0 * scale))
    };
    (0..run.rows().min(rows.len()) - 1).map(at).fold(0.0, f64::max)
}

#[test]
fn other_people_s_logs_read_to_the_truth() {
    let kinds = kinds();
    let mut wrong = Vec::new();
    for (kind, text, added) in &kinds {
        let told = match seen(text, added) {
            Err(why) => why,
            Ok(look) => match (look.log, look.refused) {
                (Some(Log::Dynamic(record)), None) if record.runs.len() == 1 && record.rows() >= 598 => {
                    let error = error(&record);
                    if error < 0.05 { continue } else { format!("is {error} off; {:?}", look.notes) }
                }
                (log, refused) => format!("{refused:?}, {} rows, {:?}", look.rows, log.is_some()),
            },
        };
        wrong.push(format!("{kind}: {told}"));
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), kinds.len(), wrong.join("\n"));
}
