//! Logs as JSON: every layout reads to the bits of the same table as text, and what cannot be read says where.

use serde_json::{Value, json};
use truing::system::log::look::look;
use truing::system::log::{self, Bytes, Columns, Log};

/// Time in ms, a duty and a speed in rpm; a few cells are empty.
fn rows() -> Vec<[String; 3]> {
    let mut rpm = 0.0;
    let row = |k: usize| {
        let pwm = if k % 24 < 12 { 200.0 } else { -140.0 };
        rpm += 0.17 * (9.3 * pwm - rpm);
        let rpm = if k == 50 { "null".into() } else { format!("{rpm:?}") };
        [format!("{}", 10 * k), format!("{pwm}"), rpm]
    };
    (0..120).map(row).collect()
}

const NAMES: [&str; 3] = ["time_ms", "pwm", "rpm"];

/// One object: a name and what stands behind it, over and over.
fn object<N: ToString>(pairs: impl Iterator<Item = (N, String)>) -> String {
    let pairs: Vec<String> = pairs.map(|(name, value)| format!("\"{}\":{value}", name.to_string())).collect();
    format!("{{{}}}", pairs.join(","))
}

fn list(values: impl Iterator<Item = String>) -> String {
    format!("[{}]", values.collect::<Vec<_>>().join(","))
}

/// The same log in all layouts, each with the name of its layout.
fn layouts() -> [(&'static str, String); 6] {
    let rows = rows();
    let records: Vec<String> = rows.iter().map(|row| object(NAMES.iter().zip(row.iter().cloned()))).collect();
    let column = |k: usize| rows.iter().map(move |row| row[k].clone());
    let named = |k: usize| (NAMES[k], object(column(k).enumerate()));
    let cells = rows.iter().map(|row| list(row.iter().cloned()));
    let split = [
        ("columns", list(NAMES.iter().map(|name| format!("\"{name}\"")))),
        ("index", list((0..rows.len()).map(|k| k.to_string()))),
        ("data", list(cells)),
    ];
    [
        ("a list of records", list(records.iter().cloned())),
        ("records line by line", records.join("\n")),
        ("a list of records", object(records.iter().cloned().enumerate())),
        ("columns by name", object((0..3).map(named))),
        ("columns by name", object((0..3).map(|k| (NAMES[k], list(column(k)))))),
        ("names and rows apart", object(split.into_iter())),
    ]
}

fn as_csv() -> String {
    let rows: Vec<String> = rows().iter().map(|row| row.join(",")).collect();
    format!("{}\n{}\n", NAMES.join(","), rows.join("\n"))
}

/// What `truing look --json` writes.
fn seen(name: &str, text: &str) -> Value {
    let bytes = Bytes { name, open: &|| Ok(Box::new(text.as_bytes())), sources: &[] };
    serde_json::to_value(look(bytes, &Columns::default()).unwrap()).unwrap()
}

fn refused(text: &str) -> String {
    log::parse("log.json", text, &Columns::default()).unwrap_err().0
}

fn bits(name: &str, text: &str) -> Vec<u64> {
    let columns = "duty=pwm/255,vbus_v=12".parse().unwrap();
    let Log::Dynamic(record) = log::parse(name, text, &columns).unwrap() else { panic!("read as a table") };
    let run = &record.runs[0];
    let columns = [&run.t_s, &run.input, run.speed.as_ref().unwrap()];
    columns.into_iter().flatten().map(|value| value.to_bits()).collect()
}

#[test]
fn every_layout_reads_to_the_bits_of_the_same_table_as_text() {
    let wanted = bits("log.csv", &as_csv());
    assert_eq!(wanted.len(), 360);
    for (layout, text) in layouts() {
        assert_eq!(bits("log.json", &text), wanted, "{layout}");
        assert_eq!(bits("log.JSONL", &format!("\n {text}\n")), wanted, "{layout}, with blanks around it");
    }
}

#[test]
fn every_layout_is_seen_as_the_same_table_as_text_is() {
    let of_text = seen("log", &as_csv());
    assert_eq!(of_text["encoding"], "UTF-8");
    assert_eq!(of_text["separator"], "commas");
    for (layout, text) in layouts() {
        let mut seen = seen("log.json", &text);
        let how = seen["notes"].as_array_mut().unwrap().remove(0);
        assert_eq!(how, format!("The log is read as JSON, {layout}."));
        for key in ["encoding", "separator", "decimal_comma"] {
            assert_eq!(seen.get(key), None, "{layout}");
            seen[key] = of_text[key].clone();
        }
        seen["file"] = of_text["file"].clone();
        assert_eq!(seen, of_text, "{layout}");
    }
}

#[test]
fn a_text_stays_a_text_whatever_its_name_and_lines_of_json_do_in_any_other_file() {
    let [_, (_, lines), ..] = layouts();
    for (name, text) in [("log.json", as_csv()), ("log.txt", lines)] {
        assert_eq!(seen(name, &text)["encoding"], "UTF-8", "{name}");
    }
}

#[test]
fn what_is_broken_is_told_with_its_place() {
    let [(_, list), (_, lines), ..] = layouts();
    let said = refused(&list[..list.len() / 2]);
    assert!(said.starts_with("log.json: is no JSON: ") && said.contains(" at line 1 column "), "{said}");
    let said = refused(&lines.replacen("\"time_ms\":300,", "\"time_ms\":300;", 1));
    assert!(said.contains("at line 31 column 1"), "{said}");
    let said = log::parse(
        "log.json",
        &lines.replacen("\"pwm\":-140", "\"pwm\":\"fast\"", 1),
        &"duty=pwm/255,vbus_v=12".parse().unwrap(),
    );
    let said = said.unwrap_err().0;
    assert!(said.starts_with("log.json, record 13: column pwm: `fast` is not a number"), "{said}");
    let short = json!({"t_s": [0, 1, 2, 3], "u_v": [0, 1, 2], "omega_rad_s": [0, 1, 2, 3]}).to_string();
    assert_eq!(refused(&short), "log.json: record 4 does not hold the cells that others do");
    let split = r#"{"columns": ["t_s", "u_v"], "data": [[0, 1], [1, 1, 1]]}"#;
    assert_eq!(refused(split), "log.json: record 2 does not hold the cells that others do");
    assert_eq!(refused(r#"[{"t_s": 0}, 7]"#), "log.json: record 2 does not hold the cells that others do");
}

#[test]
fn a_last_record_that_is_cut_is_left_out() {
    let [_, (_, lines), ..] = layouts();
    let cut = &lines[..lines.len() - 9];
    let all = bits("log.json", &lines);
    assert_eq!(bits("log.json", cut).len(), all.len() - 3);
    assert!(seen("log.json", cut)["notes"][0].as_str().unwrap().contains("without a last record"));
}

#[test]
fn json_without_a_table_is_refused_with_a_sentence() {
    let motor = r#"{"name": "motor", "Kt": 0.02}"#;
    for text in ["{}", "[]", motor, r#"{"motor": {"Kt": 0.02}}"#, r#"{"t_s": []}"#] {
        let said = refused(text);
        assert!(
            said.contains("holds no table; expected records, or lists of equal length"),
            "{text}: {said}"
        );
    }
    assert_eq!(refused("[[1, 2], [3, 4]]"), "log.json: record 1 does not hold the cells that others do");
}
