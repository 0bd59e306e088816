//! Model files with something wrong in them: what is said, with line, key and remedy, and what never stops a run.

use truing::system::model::{parse, parse_draft};

const MOTOR: &str = r#"schema = "truing-model/1"
[model]
kind = "dc_motor"
[motor]
R_ohm = 1.522
Kt_nm_per_a = 0.1171
J_kgm2 = 0.001039
[tolerance]
default = 0.03
J_kgm2 = 0.10
[supply]
nominal_v = 24.0
limit_v = 22.0
[encoder]
counts_per_rev = 4096
side = "load"
[sensors]
speed = "analog_tacho"
speed_window_s = 0.008
current_logged = true
[log]
sample_hz = 500
[known.coulomb_friction]
level_nm = 0.008
origin = "coast-downs"
"#;

fn changed(from: &str, to: &str) -> String {
    assert!(MOTOR.contains(from), "{from}");
    MOTOR.replacen(from, to, 1)
}

/// A change of the file, and what its only complaint must hold: the line and some words.
const WRONG: &[(&str, &str, &[&str])] = &[
    // Outside of sections.
    ("schema = \"truing-model/1\"\n", "", &["schema is missing", "begin the file with"]),
    ("truing-model/1", "truing-model/2", &["line 1: schema is \"truing-model/2\"", "\"truing-model/1\""]),
    ("schema = \"truing-model/1\"", "schema = 1", &["line 1: schema must be a text"]),
    (
        "schema = \"truing-model/1\"",
        "schema = \"truing-model/1\"\nR_ohm = 2.0",
        &["line 2: R_ohm", "move it under [motor]"],
    ),
    (
        "schema = \"truing-model/1\"",
        "schema = \"truing-model/1\"\nkind = \"dc_motor\"",
        &["line 2: kind", "move it under [model]"],
    ),
    (
        "schema = \"truing-model/1\"",
        "schema = \"truing-model/1\"\nsomething = 3",
        &["line 2: something", "outside a section"],
    ),
    (
        "schema = \"truing-model/1\"",
        "schema = \"truing-model/1\"\nmotor2 = \"x\"\nshcema = \"y\"",
        &["line 3: shcema", "the nearest is schema"],
    ),
    // Sections.
    ("[supply]", "[suply]", &["line 11: [suply] is no known section", "[supply]"]),
    ("[tolerance]", "[tolerances]", &["line 8: [tolerances]", "the nearest is [tolerance]"]),
    (
        "[motor]\n",
        "[gearbox]\nratio = 3\n[motor]\n",
        &["line 4: [gearbox] is no known section", "the known ones are [model], [motor]"],
    ),
    // Kind.
    (
        "\"dc_motor\"",
        "\"dcmotor\"",
        &["line 3: [model] kind \"dcmotor\" is unknown; the nearest is \"dc_motor\""],
    ),
    (
        "\"dc_motor\"",
        "\"stepper\"",
        &[
            "line 3: [model] kind \"stepper\" is unknown; write one of \"dc_motor\", \"first_order\", \"inertia\"",
        ],
    ),
    ("\"dc_motor\"", "\"first\"", &["line 3", "\"first_order\""]),
    ("\"dc_motor\"", "1", &["line 3: [model] kind must be a text"]),
    ("kind = \"dc_motor\"", "knid = \"dc_motor\"", &["line 3: [model] knid", "kind"]),
    ("[motor]\n", "[motor]\nkind = \"dc_motor\"\n", &["line 5: [motor] kind", "[model]"]),
    (
        "kind = \"dc_motor\"",
        "fitted_to_log = \"yes\"",
        &["line 3: [model] fitted_to_log must be true or false"],
    ),
    // Numbers of the motor.
    ("R_ohm = 1.522", "R_ohm = -1.5", &["line 5: [motor] R_ohm is -1.5; it must be greater than 0"]),
    ("R_ohm = 1.522", "R_ohm = 0", &["line 5: [motor] R_ohm is 0"]),
    ("R_ohm = 1.522", "R_ohm = nan", &["line 5: [motor] R_ohm must be a finite number"]),
    ("R_ohm = 1.522", "R_ohm = inf", &["line 5", "finite"]),
    ("R_ohm = 1.522", "R_ohm = [1, 2]", &["line 5: [motor] R_ohm must be a number"]),
    ("R_ohm = 1.522", "R_ohm = true", &["line 5: [motor] R_ohm must be a number"]),
    ("R_ohm = 1.522", "R_ohm = \"1.5\"", &["line 5", "write R_ohm = 1.5 without quotes"]),
    ("R_ohm = 1.522", "R_ohm = \"1,5\"", &["line 5", "write R_ohm = 1.5 without quotes"]),
    ("R_ohm = 1.522", "R_ohm = \"about 2\"", &["line 5", "\"about 2\"", "\"unknown\" if you do not know it"]),
    ("R_ohm = 1.522", "R = 1.522", &["line 5: [motor] R is no known key; the nearest is R_ohm"]),
    ("R_ohm = 1.522", "r_ohms = 1.522", &["line 5: [motor] r_ohms", "R_ohm"]),
    ("Kt_nm_per_a = 0.1171", "Kt = 0.1171", &["line 6: [motor] Kt", "Kt_nm_per_a"]),
    ("Kt_nm_per_a = 0.1171", "Kt_nm_a = 0.1171", &["line 6", "Kt_nm_per_a"]),
    ("Kt_nm_per_a = 0.1171", "Ke_v_per_rad = 0.1171", &["line 6", "Ke_vs_per_rad"]),
    ("J_kgm2 = 0.001039", "J = 0.001039", &["line 7: [motor] J", "J_kgm2"]),
    ("J_kgm2 = 0.001039", "J_kgm2 = 0.001039\nL_mh = 2.1", &["line 8: [motor] L_mh", "L_h"]),
    (
        "J_kgm2 = 0.001039",
        "J_kgm2 = 0.001039\nno_load_rpm = 3000",
        &["line 8: [motor] no_load_rpm is no known key; the known ones are R_ohm", "truing start"],
    ),
    (
        "J_kgm2 = 0.001039",
        "J_kgm2 = 0.001039\nL_h = -1e-3",
        &["line 8: [motor] L_h is -0.001; it must not be negative"],
    ),
    (
        "J_kgm2 = 0.001039",
        "J_kgm2 = 0.001039\nb_nms_per_rad = -1e-5",
        &["line 8: [motor] b_nms_per_rad", "negative"],
    ),
    ("J_kgm2 = 0.001039", "J_kgm2 = 0.001039\ngear_ratio = 0", &["line 8: [motor] gear_ratio is 0"]),
    (
        "J_kgm2 = 0.001039",
        "J_kgm2 = 0.001039\ngear_ratio = \"20:1\"",
        &["line 8: [motor] gear_ratio must be a number", "write a number"],
    ),
    ("J_kgm2 = 0.001039", "J_kgm2 = 0.001039\nsupply_v = 12", &["line 8: [motor] supply_v"]),
    ("J_kgm2 = 0.001039", "J_kgm2 = 0.001039\nnominal_v = 12", &["line 8: [motor] nominal_v", "[supply]"]),
    (
        "R_ohm = 1.522",
        "R_ohm = 1.522\ndrive_gain_unit = 3",
        &["line 6: [motor] drive_gain_unit must be a text"],
    ),
    // Tolerances.
    ("default = 0.03", "default = -0.03", &["line 9: [tolerance] default is -0.03; it must not be negative"]),
    ("default = 0.03", "default = \"small\"", &["line 9: [tolerance] default must be a number"]),
    ("default = 0.03", "R = 0.03", &["line 9: [tolerance] R", "R_ohm"]),
    ("default = 0.03", "gear_ratio = 0.03", &["line 9: [tolerance] gear_ratio"]),
    // Surroundings.
    ("nominal_v = 24.0", "nominal_v = -24.0", &["line 12: [supply] nominal_v is -24"]),
    ("nominal_v = 24.0", "nominal = 24.0", &["line 12: [supply] nominal", "nominal_v"]),
    (
        "nominal_v = 24.0",
        "voltage = 24.0",
        &["line 12: [supply] voltage is no known key; the known ones are nominal_v, limit_v"],
    ),
    ("limit_v = 22.0", "limit_v = 0", &["line 13: [supply] limit_v is 0"]),
    ("counts_per_rev = 4096", "counts_per_rev = 0", &["line 15: [encoder] counts_per_rev is 0"]),
    ("counts_per_rev = 4096", "counts = 4096", &["line 15: [encoder] counts", "counts_per_rev"]),
    (
        "counts_per_rev = 4096",
        "cpr = 4096",
        &["line 15: [encoder] cpr is no known key; the known ones are counts_per_rev, side"],
    ),
    (
        "side = \"load\"",
        "side = \"left\"",
        &["line 16: [encoder] side \"left\" is unknown; write one of \"motor\", \"load\", \"output\""],
    ),
    ("side = \"load\"", "side = \"lode\"", &["line 16"]),
    ("side = \"load\"", "sde = \"load\"", &["line 16: [encoder] sde", "side"]),
    ("side = \"load\"", "side = 1", &["line 16: [encoder] side must be a text"]),
    (
        "\"analog_tacho\"",
        "\"analog_tach\"",
        &["line 18: [sensors] speed \"analog_tach\" is unknown; the nearest is \"analog_tacho\""],
    ),
    ("\"analog_tacho\"", "\"difference\"", &["line 18", "encoder_difference_causal"]),
    ("\"analog_tacho\"", "3", &["line 18: [sensors] speed must be a text"]),
    ("speed = ", "sped = ", &["line 18: [sensors] sped", "speed"]),
    ("speed_window_s = 0.008", "speed_window_s = -1", &["line 19: [sensors] speed_window_s is -1"]),
    ("speed_window_s = 0.008", "window_s = 0.008", &["line 19: [sensors] window_s", "speed_window_s"]),
    ("speed_window_s = 0.008", "speed_window_ms = 8", &["line 19", "speed_window_s"]),
    // Effects.
    (
        "[known.coulomb_friction]",
        "[known.coulom_friction]",
        &["line 23: [known.coulom_friction] is no known effect; the nearest is [known.coulomb_friction]"],
    ),
    (
        "[known.coulomb_friction]",
        "[known.aerodynamics]",
        &["line 23: [known.aerodynamics] is no known effect; `truing effects` lists them"],
    ),
    (
        "level_nm = 0.008",
        "level = 0.008",
        &["line 24: [known.coulomb_friction] level is no known key; the nearest is level_nm"],
    ),
    (
        "level_nm = 0.008",
        "level_nm = -0.008",
        &["line 24: [known.coulomb_friction] level_nm is -0.008; it is a magnitude"],
    ),
    (
        "level_nm = 0.008",
        "level_nm = \"small\"",
        &["line 24: [known.coulomb_friction] level_nm must be a number"],
    ),
    (
        "level_nm = 0.008\n",
        "",
        &["line 23: [known.coulomb_friction] level_nm is missing; coulomb_friction needs it"],
    ),
    (
        "level_nm = 0.008",
        "level_nm = 0.008\nlevel_nm_std = -1",
        &["line 25", "level_nm_std is -1; it must not be negative"],
    ),
    (
        "origin = \"coast-downs\"",
        "orgin = \"coast-downs\"",
        &["line 25: [known.coulomb_friction] orgin", "origin"],
    ),
    (
        "[known.coulomb_friction]",
        "[known]\ncoulomb_friction = 0.1\n[known.dead_zone]\nhalf_width_v = 1\n[log2]",
        &["[known.coulomb_friction]"],
    ),
];

#[test]
fn every_defect_is_told_with_its_line_and_its_remedy() {
    assert!(WRONG.len() >= 60);
    for (from, to, words) in WRONG {
        let text = changed(from, to);
        let Err(error) = parse_draft("model.toml", &text) else { panic!("{to:?} is accepted") };
        let said = error.to_string();
        for word in *words {
            assert!(said.contains(word), "`{word}` is not in the answer to {to:?}: {said}");
        }
        // Nothing is told twice, and nothing else.
        let most = if said.contains("[known]") || to.contains("[log2]") { 3 } else { 1 };
        assert!(said.lines().count() <= most, "{to:?}: {said}");
        assert!(said.lines().all(|line| line.starts_with("model.toml")), "{said}");
    }
}

/// What nothing needs: a change of the file, and what the note must hold.
const NOTED: &[(&str, &str, &[&str])] = &[
    (
        "sample_hz = 500",
        "sample_hz = \"irregular, 2 to 11 ms\"",
        &["line 22: [log] sample_hz", "irregular", "not used"],
    ),
    ("sample_hz = 500", "sample_hz = -1", &["line 22: [log] sample_hz is -1", "not used"]),
    ("sample_hz = 500", "sample_hz = [1, 2]", &["[log] sample_hz", "not used"]),
    ("sample_hz = 500", "rows = 300", &["line 22: [log] rows is no known key and is not used"]),
    (
        "limit_v = 22.0",
        "limit_v = \"as the battery\"",
        &["line 13: [supply] limit_v is the text \"as the battery\"", "no limit"],
    ),
    ("nominal_v = 24.0", "nominal_v = \"24\"", &["line 12: [supply] nominal_v is the text \"24\""]),
    (
        "counts_per_rev = 4096",
        "counts_per_rev = \"not stated\"",
        &["line 15: [encoder] counts_per_rev", "not known"],
    ),
    (
        "speed_window_s = 0.008",
        "speed_window_s = \"short\"",
        &["line 19: [sensors] speed_window_s", "not used"],
    ),
    (
        "\"analog_tacho\"",
        "\"resolver\"",
        &["line 19: [sensors] speed_window_s is not used", "encoder_difference_causal"],
    ),
    (
        "current_logged = true",
        "current_logged = \"sometimes\"",
        &["line 20: [sensors] current_logged", "not used"],
    ),
    ("default = 0.03", "R_ohm = 5", &["line 9: [tolerance] R_ohm = 5 is 500 %", "write 0.050 for 5 %"]),
    (
        "default = 0.03",
        "time_constant_s = 0.1",
        &["line 9: [tolerance] time_constant_s is not used by kind = \"dc_motor\""],
    ),
    (
        "J_kgm2 = 0.001039",
        "J_kgm2 = 0.001039\ngain_rad_s_per_v = 8.5",
        &["line 8: [motor] gain_rad_s_per_v is not used by kind = \"dc_motor\""],
    ),
];

#[test]
fn what_nothing_needs_is_a_note_and_stops_nothing() {
    assert_eq!(parse("model.toml", MOTOR).unwrap().notes, [] as [&str; 0]);
    for (from, to, words) in NOTED {
        let model = parse("model.toml", &changed(from, to)).unwrap_or_else(|error| panic!("{to}: {error}"));
        let notes = model.notes.join("\n");
        assert_eq!(model.notes.len(), 1, "{to}: {notes}");
        for word in *words {
            assert!(notes.contains(word), "`{word}` is not in the note on {to:?}: {notes}");
        }
    }
    let text = parse("model.toml", &changed("limit_v = 22.0", "limit_v = \"none\"")).unwrap();
    assert_eq!((text.supply_limit_v, text.supply_nominal_v), (None, Some(24.0)));
}

#[test]
fn all_complaints_come_at_once_and_the_kind_first() {
    let text = changed("R_ohm = 1.522", "R_ohm = -1")
        .replace("\"dc_motor\"", "\"dc\"")
        .replace("[supply]", "[suply]")
        .replace("level_nm = 0.008", "level_nm = -1")
        .replace("side = \"load\"", "side = \"up\"")
        .replace("schema = \"truing-model/1\"\n", "");
    let said = parse_draft("model.toml", &text).unwrap_err().to_string();
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), 6, "{said}");
    assert!(lines[0].contains("[model] kind \"dc\""), "{said}");
    let of_line =
        |said: &&str| said.split("line ").nth(1).and_then(|rest| rest.split(':').next()?.parse::<u64>().ok());
    let numbers: Vec<u64> = lines[1..].iter().filter_map(of_line).collect();
    assert!(numbers.len() == 4 && numbers.is_sorted(), "{numbers:?}: {said}");
}

#[test]
fn every_error_of_the_grammar_is_told_with_its_line() {
    let text = changed("R_ohm = 1.522", "R_ohm = 1,522").replace("nominal_v = 24.0", "nominal_v = 24 V");
    let said = parse_draft("model.toml", &text).unwrap_err().to_string();
    assert!(
        said.contains("line 5: is not valid TOML") && said.contains("line 12: is not valid TOML"),
        "{said}"
    );
}

#[test]
fn numbers_of_another_kind_ask_for_the_kind() {
    let text = "schema = \"truing-model/1\"\n[motor]\ngain_rad_s_per_v = 16\ntime_constant_s = 0.1\n";
    let said = parse_draft("model.toml", text).unwrap_err().to_string();
    assert!(
        said.contains("[model] kind is missing; gain_rad_s_per_v belongs to kind = \"first_order\""),
        "{said}"
    );
}
