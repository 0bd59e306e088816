//! Reading models: every key of the format, and every defect named by section, key, line and remedy.

use truing::files::model::{self, Kind, Side, SpeedSensor};

const MOTOR: &str = r#"
schema = "truing-model/1"
id = "rig 3"
[model]
kind = "dc_motor"
equation = "kept"
[motor]
R_ohm = 1.522
L_h = 0.0021
Kt_nm_per_a = 0.1171
Ke_vs_per_rad = 0.1171
J_kgm2 = 0.001039
b_nms_per_rad = 0.0004626
gear_ratio = 20.0
[tolerance]
default = 0.03
J_kgm2 = 0.10
[supply]
nominal_v = 24.0
limit_v = 22.0
[encoder]
counts_per_rev = 4096
side = "output"
[sensors]
speed = "encoder_difference_centred"
speed_window_s = 0.008
current_logged = true
vbus_logged = false
[log]
sample_hz = 500
[known.coulomb]
level_nm = 0.008
level_nm_std = 0.0003
origin = "coast-downs"
[known.voltage_saturation]
limit_v = 20.0
"#;

fn read(text: &str) -> model::Model {
    model::parse("model.toml", text).unwrap()
}

fn defect(text: &str) -> String {
    model::parse("model.toml", text).unwrap_err().to_string()
}

#[test]
fn a_sensor_without_counts_may_sit_at_the_load() {
    let text = "schema = \"truing-model/1\"\n[motor]\nR_ohm=1\nKt_nm_per_a=0.1\nJ_kgm2=1e-4\n[encoder]\nside = \"output\"\n";
    assert!(read(text).physics().encoder_at_load);
    assert!(!read(&text.replace("output", "motor")).physics().encoder_at_load);
}

#[test]
fn every_key_of_the_format_is_read() {
    let model = read(MOTOR);
    let Kind::DcMotor { r_ohm, l_h, j_kgm2, .. } = model.kind else { panic!("not a motor") };
    assert_eq!((r_ohm, l_h, j_kgm2, model.gear_ratio), (1.522, 0.0021, 0.001039, 20.0));
    assert_eq!((model.tolerance("R_ohm"), model.tolerance("J_kgm2")), (0.03, 0.10));
    assert_eq!((model.supply_nominal_v, model.supply_limit_v), (Some(24.0), Some(22.0)));
    let encoder = model.encoder.unwrap();
    assert_eq!((encoder.counts_per_rev, encoder.side), (4096.0, Side::Load));
    assert_eq!(model.sensors.speed, SpeedSensor::EncoderDifferenceCentred);
    assert_eq!((model.sensors.speed_window_s, model.sensors.current_logged), (0.008, Some(true)));
    let names: Vec<&str> = model.known.iter().map(|known| known.effect.name).collect();
    assert_eq!(names, ["coulomb_friction", "voltage_saturation"]);
    assert_eq!((model.known[0].values[0], model.known[0].stds[0]), (0.008, Some(0.0003)));
    assert_eq!(model.known[1].values, [20.0, 0.0], "an absent softness is a hard knee");
    assert!(model.texts.contains(&("model".into(), "equation".into(), "kept".into())));
    let plant = model.physics();
    assert_eq!((plant.friction_pos, plant.friction_neg, plant.limit), (0.008, 0.008, 20.0));
}

#[test]
fn the_default_tolerance_is_five_percent_and_the_default_kind_a_motor() {
    let model = read("schema = \"truing-model/1\"\n[motor]\nR_ohm=1\nKt_nm_per_a=0.1\nJ_kgm2=1e-4\n");
    assert_eq!((model.tolerance("R_ohm"), model.sensors.speed), (0.05, SpeedSensor::Unknown));
    assert_eq!(model.parameters()[3], ("Ke_vs_per_rad", 0.1), "in SI units Ke is Kt");
}

#[test]
fn other_kinds_have_their_own_parameters() {
    let first = read(
        "schema=\"truing-model/1\"\n[model]\nkind=\"first_order\"\ngain_rad_s_per_v=20\ntime_constant_s=0.1\n",
    );
    let plant = first.physics();
    assert!((plant.dc_gain() - 20.0).abs() < 1e-12 && (plant.time_constant_s() - 0.1).abs() < 1e-12);
    let axis = read(
        "schema=\"truing-model/1\"\n[model]\nkind=\"inertia\"\nfitted_to_log=true\n[motor]\nmass_kg=95\nviscous=203\ndrive_gain=35.15\ndrive_gain_unit=\"N/V\"\n[known.coulomb_friction]\nlevel_n=20\n",
    );
    assert!(axis.linear() && axis.fitted_to_log);
    assert_eq!((axis.physics().force_gain, axis.physics().friction_pos), (35.15, 20.0));
}

#[test]
fn every_defect_is_named_with_its_place_and_remedy() {
    let changed = |from: &str, to: &str| MOTOR.replace(from, to);
    let cases: Vec<(String, &[&str])> = vec![
        (changed("J_kgm2 = 0.001039", "J_kgm2 = -0.001"), &["line 12", "[motor] J_kgm2", "greater than 0"]),
        (changed("R_ohm = 1.522", "R_ohm = \"1.5\""), &["[motor] R_ohm", "number"]),
        (changed("R_ohm = 1.522\n", ""), &["[motor] R_ohm", "missing"]),
        (changed("L_h = 0.0021", "L_h = nan"), &["[motor] L_h", "finite"]),
        (changed("b_nms_per_rad", "b_nms"), &["[motor] b_nms", "no known key", "b_nms_per_rad"]),
        (changed("[supply]", "[suply]"), &["suply", "no known section", "[supply]"]),
        (changed("kind = \"dc_motor\"", "kind = \"dcmotor\""), &["[model] kind", "dcmotor", "dc_motor"]),
        (changed("side = \"output\"", "side = \"left\""), &["[encoder] side", "left"]),
        (changed("[known.coulomb]", "[known.coulom_friction]"), &["coulom_friction", "coulomb_friction"]),
        (changed("level_nm = 0.008", "level = 0.008"), &["[known.coulomb] level", "level_nm"]),
        (changed("level_nm = 0.008", "level_nm = -1"), &["[known.coulomb] level_nm", "magnitude"]),
        (changed("truing-model/1", "truing-model/9"), &["truing-model/9", "truing-model/1"]),
        (changed("schema = \"truing-model/1\"\n", ""), &["schema", "missing"]),
        (changed("[supply]", "[supply"), &["line 18", "TOML"]),
        (changed("default = 0.03", "default = -0.03"), &["[tolerance] default", "negative"]),
    ];
    for (text, wanted) in cases {
        let message = defect(&text);
        assert!(!message.contains('\n'), "one sentence: {message}");
        for part in wanted {
            assert!(message.contains(part), "`{part}` is not in: {message}");
        }
    }
    let unreadable = model::read(std::path::Path::new("no/such.toml")).unwrap_err().to_string();
    assert!(unreadable.contains("no/such.toml"));
}

#[test]
fn an_informative_key_never_stops_a_run() {
    for value in ["\"irregular\"", "-1", "0", "nan", "[1, 2]"] {
        let model = read(&MOTOR.replace("sample_hz = 500", &format!("sample_hz = {value}")));
        assert_eq!(model.sample_hz, None, "{value}");
    }
    assert_eq!(read(MOTOR).sample_hz, Some(500.0));
}

#[test]
fn a_mistyped_text_key_or_value_is_named_with_its_line() {
    let changed = |from: &str, to: &str| defect(&MOTOR.replace(from, to));
    let speed = "speed = \"encoder_difference_centred\"";
    let cases = [
        (changed("kind = ", "knid = "), "line 5: [model] knid", "kind"),
        (changed("speed = ", "sped = "), "line 25: [sensors] sped", "speed"),
        (changed("side = ", "sde = "), "line 23: [encoder] sde", "side"),
        (changed("origin = ", "orgin = "), "line 34: [known.coulomb] orgin", "origin"),
        (changed("R_ohm = 1.522", "R_ohn = \"1.5\""), "line 8: [motor] R_ohn", "R_ohm"),
        (changed(speed, "speed = \"encoder_diference\""), "line 25", "encoder_difference_centred"),
        (changed(speed, "speed = \"difference\""), "line 25", "encoder_difference_causal"),
        (changed("[model]\nkind", "kind"), "kind", "[model]"),
        (
            changed("[sensors]", "[sensor]\nspeed = \"x\"\n[sensors]").replace(speed, ""),
            "line 24",
            "[sensors]",
        ),
    ];
    for (message, place, near) in cases {
        assert!(message.contains(place) && message.contains(near), "{place}: {message}");
    }
}

#[test]
fn a_text_in_words_of_its_own_is_kept() {
    let own = [
        "[sensors]\nspeed = \"central difference over 90 ms\"\n",
        "[log]\nsign = \"+input gives +output\"\nruns = \"one\"\n",
        "[bench]\nplace = \"cellar\"\n",
        "[sensors]\nspeed = \"resolver\"\n",
        "[sensors]\nspeed = \"tacho\"\n",
    ];
    for text in own {
        read(&format!("schema = \"truing-model/1\"\n[motor]\nR_ohm=1\nKt_nm_per_a=0.1\nJ_kgm2=1e-4\n{text}"));
    }
}

#[test]
fn several_wrong_keys_are_told_at_once() {
    let message = defect(&MOTOR.replace("kind = ", "knid = ").replace("L_h", "no_load_rpm"));
    assert!(message.contains("knid") && message.contains("no_load_rpm"), "{message}");
    assert!(message.contains("the known ones are R_ohm, L_h"), "{message}");
}
