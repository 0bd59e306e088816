//! Parameters key by key, and from a model to the numbers of the firmware.

use servo::compensate::modelled::{LoadFriction, Modelled};
use servo::compensate::position_load::PositionLoad;
use servo::control::Tuning;
use servo::identify::estimate::{Estimates, Mechanism};
use servo::protect::{Action, Fault, Settings};
use servo::store::AxisParameters;
use servo::units::Voltage;
use std::f64::consts::TAU;
use trials::simulated_servo::config;
use truing::device::commission_report::Params;
use truing::device::parameters;
use truing::params::{compensation, waves};
use truing::system::model;

fn blank() -> AxisParameters {
    AxisParameters {
        config: config(),
        estimates: Estimates::default(),
        tuning: Tuning::default(),
        compensation: true,
        protection: Settings::default(),
        position_load: PositionLoad::default(),
        modelled: Modelled::default(),
    }
}

fn set(parameters: &mut AxisParameters, assignment: &str) {
    parameters::set(parameters, assignment).unwrap_or_else(|error| panic!("{assignment}: {error}"));
}

#[test]
fn what_is_set_is_printed_and_read_back_whole() {
    let mut first = blank();
    for assignment in [
        "supply.nominal_v=24",
        "axis.travel_limit_rad=[-1.5, 2]",
        "limits.current_a=none",
        "limits.supply_low_v=18.5",
        "limits.supply_high_v=30",
        "limits.acceleration_rad_s2=250",
        "limits.jerk_rad_s3=5000",
        "limits.voltage_v=20",
        "limits.command_timeout_ms=250",
        "limits.continuous_current_a=0.8",
        "limits.thermal_time_constant_s=45",
        "protection.no_motion=brake",
        "protection.command_timeout=hold",
        "loops.bandwidth=1.25",
        "loops.compensation=false",
        "identified.dead_zone_pos_v=1.5",
        "identified.gain_rad_s_per_v=10",
        "identified.time_constant_s=0.04",
        "identified.lag_s=0.003",
        "identified.load_friction=0.125",
        "identified.viscous_skew=-0.125",
        "identified.drag_per_v=0.0625",
        "identified.friction_share=0.5",
        "identified.breakaway=0.25",
        "identified.stribeck_v=0.75",
        "position_load.period_counts=8192",
        "position_load.constant_v=-0.3",
        "position_load.sines=[{cycles=1,amplitude_v=1.5,phase_rad=0.7},{cycles=24,amplitude_v=0.2,phase_rad=5}]",
        "position_load.absolute=true",
        "position_load.trusted=false",
    ] {
        set(&mut first, assignment);
    }
    let text = parameters::print(&first);
    assert!(text.contains("protection.command_timeout = \"hold\""), "{text}");
    // Every line is an assignment that `set` takes, and TOML.
    let _: toml::Table = text.parse().expect("TOML");
    let mut second = blank();
    text.lines().for_each(|line| set(&mut second, line));
    assert_eq!(second.config, first.config);
    assert_eq!(second.position_load, first.position_load);
    assert_eq!((first.position_load.terms().count(), first.position_load.is_trusted()), (2, false));
    set(&mut second, "position_load.period_counts=none");
    assert_eq!(second.position_load, PositionLoad::default());
    assert_eq!(second.protection, first.protection);
    assert_eq!(second.protection.actions.of(Fault::NoMotion), Action::Brake);
    assert_eq!((second.tuning, second.compensation), (first.tuning, first.compensation));
    assert!(first.modelled.lag > 0 && second.modelled == first.modelled);
    let off = second.estimates.dead_zone[0].value - first.estimates.dead_zone[0].value;
    assert!(off.abs() <= 1, "{off}");
}

#[test]
fn a_volt_stays_a_volt_when_the_supply_is_corrected() {
    let mut parameters = blank();
    set(&mut parameters, "identified.dead_zone_pos_v=1.2");
    set(&mut parameters, "supply.nominal_v=24");
    let text = parameters::print(&parameters);
    let line = text.lines().find(|line| line.starts_with("identified.dead_zone_pos_v")).expect("a line");
    let volts: f64 = line.rsplit(' ').next().expect("a value").parse().expect("a number");
    assert!((volts - 1.2).abs() < 1e-4, "{line}");
}

#[test]
fn wrong_keys_and_values_are_named_with_the_nearest_right_one() {
    for (assignment, expected) in [
        ("loops.bandwith=2", "loops.bandwidth"),
        ("loops.bandwidth=fast", "`fast` is no value"),
        ("loops.bandwidth", "key=value"),
        ("identified.lag_s=-0.01", "`-0.01` is no value"),
        ("identified.load_friction=0.3", "`0.3` is no value"),
        ("protection.over_current=brake", "choose open"),
        ("protection.overcurrent=open", "over_current"),
        ("protection.no_motion=hold", "open or brake"),
        ("position_load.sine=3", "sine"),
        ("position_load.constant_v=40", "position_load.amplitude_v must lie between"),
    ] {
        let error = parameters::set(&mut blank(), assignment).expect_err(assignment).to_string();
        assert!(error.contains(expected), "{assignment}: {error}");
    }
}

const MODEL: &str = r#"
schema = "truing-model/1"
[model]
kind = "dc_motor"
[motor]
R_ohm = 2.0
L_h = 0.0
Kt_nm_per_a = 0.05
Ke_vs_per_rad = 0.05
J_kgm2 = 0.0001
b_nms_per_rad = 0.0
[encoder]
counts_per_rev = 4000
"#;

/// By hand: 0.02 N m · 2 Ω / 0.05 N m/A = 0.8 V of friction; zone 0.5 and 0.3 V; load 0.005 N m = 0.2 V, which the table's constant holds; drive
/// gain 0.9.
#[test]
fn effects_become_terminal_voltages() {
    let text = format!(
        "{MODEL}[tolerance]\ndefault = 0.03\n[known.coulomb_friction]\nlevel_nm = 0.02\nlevel_nm_std = 0.001\n\
         [known.dead_zone_asymmetric]\npos_v = 0.5\nneg_v = 0.3\n[known.voltage_saturation]\nlimit_v = 9.0\n\
         [known.constant_load]\ntorque_nm = 0.005\n[known.drive_gain]\nratio = 0.9\n[known.backlash]\ngap_rad = 0.01\nload_share = 0.3\n"
    );
    let model = model::parse("model.toml", &text).expect("a model");
    let export = compensation::from_model(&model, &config()).expect("parameters");
    assert_eq!(export.remarks, ["not compensated by the firmware: backlash.load_share"]);
    let params = export.params;
    assert_eq!(params.modelled["backlash_rad"].value, 0.01);
    assert_eq!(params.mechanism, Mechanism::InputDeadZone);
    assert!((params.modelled["friction_share"].value - 1.6 / 2.4).abs() < 1e-9, "{:?}", params.modelled);
    let scale = config().build().expect("a configuration");
    let report = params.estimates(&config()).report(&scale);
    for (name, found, by_hand) in [
        ("dead zone +", report.dead_zone_pos_v, (0.5 + 0.8) / 0.9),
        ("dead zone −", report.dead_zone_neg_v, (0.3 + 0.8) / 0.9),
        ("saturation +", report.saturation_pos_v, (9.0 + 0.5) / 0.9),
        ("saturation −", report.saturation_neg_v, (9.0 + 0.3) / 0.9),
        ("gain", report.gain_rad_s_per_v, 0.9 / 0.05),
        ("time constant", report.time_constant_s, 2.0 * 0.0001 / 0.0025),
    ] {
        let value = f64::from(found.value.expect("there"));
        assert!((value / by_hand - 1.0).abs() < 1e-3, "{name}: {value}, by hand {by_hand}");
        assert!(found.trusted, "{name}");
    }
    let load = params.position_load.expect("a table");
    assert!((load.constant_v + 0.2 / 0.9).abs() < 1e-9 && load.sines.is_empty(), "{load:?}");
    // 0.001 N m is 0.044 V; the base parameters' 3 % add to it.
    let u95 = f64::from(report.dead_zone_pos_v.u95.expect("there"));
    assert!((1.96 * 0.044..0.4).contains(&u95), "{u95} V");
}

/// By hand: (1 + 0.08 s)(1 + 0.008 s) of motor and winding, a lag of 3 ms and a delay of 2 ms: s² has 0.08·0.008 + 0.08·0.005 +
/// 0.002·(0.003 + 0.001), s has 0.085.
#[test]
fn the_lag_is_the_coefficient_of_the_second_derivative_over_that_of_the_first() {
    let text = MODEL.replace("L_h = 0.0", "L_h = 0.016");
    let known = |standing: &str| {
        format!(
            "{text}[known.actuator_lag]\ntime_constant_s = 0.003\ntime_constant_s_std = 0.0001\nstanding = \"{standing}\"\n[known.transport_delay]\nseconds = 0.002\n"
        )
    };
    let exported = |standing: &str| {
        let model = model::parse("model.toml", &known(standing)).expect("a model");
        compensation::from_model(&model, &config()).expect("parameters").params.modelled["lag_s"]
    };
    let lag = exported("named");
    assert!((lag.value - 0.001_048 / 0.085).abs() < 1e-6 && lag.trusted, "{lag:?}");
    assert!(!exported("tie").trusted, "a name of a tie is not relied on");
}

/// The numbers for the firmware of a model with these effects, and what an axis keeps of them.
fn told(known: &str) -> (Params, Modelled) {
    let model = model::parse("model.toml", &format!("{MODEL}{known}")).expect("a model");
    let params = compensation::from_model(&model, &config()).expect("parameters").params;
    let mut axis = blank();
    parameters::adopt(&mut axis, &params).expect("numbers that can be");
    (params, axis.modelled)
}

/// More than a quarter is compensated by a quarter.
#[test]
fn friction_that_grows_with_the_torque_becomes_a_share() {
    let share = |share: f64| {
        let (params, modelled) = told(&format!(
            "[known.load_dependent_friction]\nlevel_nm = 0.0\nper_motor_torque = {share}\nper_load_torque = 0.0\n"
        ));
        (params.modelled["load_friction"].value, modelled.load_friction)
    };
    assert_eq!(share(0.1), (0.1, 6_554));
    assert_eq!(share(0.4), (0.25, LoadFriction::MOST));
}

/// By hand: back-EMF damps with 0.05²/2 N m s/rad, of which 40 V a N m make volts at 10 rad/s.
#[test]
fn damping_of_two_sides_and_drag_become_what_speed_takes_beyond_the_linear_motor() {
    let (params, modelled) = told("[known.viscous_asymmetric]\npos_nms = 0.0005\nneg_nms = 0.0001\n");
    let gain = params.gain_rad_s_per_v.expect("a gain").value;
    for (omega, damping) in [(10.0, 0.00175), (-10.0, 0.00135)] {
        let steady = Voltage((omega / gain / 12.0 * f64::from(Voltage::NOMINAL.0)) as i32);
        let volts =
            f64::from(steady.plus(modelled.over_speed.beyond(steady)).0) / f64::from(Voltage::NOMINAL.0);
        assert!((12.0 * volts - 40.0 * damping * omega).abs() < 1e-4, "{} V at {omega} rad/s", 12.0 * volts);
    }
    let (params, modelled) = told("[known.quadratic_drag]\ndrag_nms2 = 1e-6\n");
    assert!((params.modelled["drag_per_v"].value - 0.016).abs() < 1e-9, "{:?}", params.modelled);
    assert!((modelled.values(&config())[3] - 0.016).abs() < 1e-5, "{modelled:?}");
    // Negative numbers come back, and a wrong one is refused.
    let mut axis = blank();
    set(&mut axis, "identified.viscous_skew=-0.4");
    assert!((axis.modelled.values(&config())[2] + 0.4).abs() < 1e-4);
    let error = parameters::set(&mut axis, "identified.drag_per_v=-0.01").expect_err("a drag drives nothing");
    assert!(error.to_string().contains("`-0.01` is no value"), "{error}");
}

#[test]
fn a_spring_without_a_straight_part_is_no_table() {
    let cubic = "stiffness_nm_per_rad = 0.0\nrest_rad = 1.0\ncubic_nm_per_rad3 = 0.001\n";
    let (export, _) = exported(&format!("[known.torsional_spring]\n{cubic}"));
    assert_eq!(export.params.position_load, None);
    assert_eq!(export.remarks, ["not compensated by the firmware: torsional_spring.cubic_nm_per_rad3"]);
}

/// By hand, 40 V a N m: a zone of 0.6 V beside 0.4 V of friction, which is 0.8 V at breakaway; 0.5 rad/s take 25 mV.
#[test]
fn friction_beside_a_dead_zone_keeps_its_share_and_its_growth_near_standstill() {
    let friction = "level_nm = 0.01\nbreakaway_nm = 0.02\nstribeck_rad_s = 0.5\n";
    let (params, modelled) =
        told(&format!("[known.dead_zone]\nhalf_width_v = 0.6\n[known.stribeck_friction]\n{friction}"));
    assert_eq!(params.mechanism, Mechanism::InputDeadZone);
    assert!((params.dead_zone_pos_v.expect("a dead zone").value - 1.0).abs() < 1e-9);
    for (key, value) in [("friction_share", 0.4), ("breakaway", 0.4), ("stribeck_v", 0.025)] {
        assert!((params.modelled[key].value - value).abs() < 1e-9, "{key}: {:?}", params.modelled);
    }
    assert!((modelled.values(&config())[6] - 0.025).abs() < 2e-4, "{modelled:?}");
    // What falls over a third of the speed is no breakaway, and is said.
    let drag = "[known.stribeck_friction]\nlevel_nm = 0.01\nbreakaway_nm = 0.02\nstribeck_rad_s = 80.0\n";
    let (export, _) = exported(drag);
    assert!(!export.params.modelled.contains_key("breakaway"), "{:?}", export.params.modelled);
    assert!(export.remarks.iter().any(|it| it.contains("friction that falls")), "{:?}", export.remarks);
    // All of it is friction, or next to nothing.
    let (params, _) = told(&format!("[known.stribeck_friction]\n{friction}"));
    assert_eq!((params.mechanism, params.modelled.get("friction_share")), (Mechanism::Friction, None));
    assert!((params.modelled["breakaway"].value - 1.0).abs() < 1e-9);
    let (params, _) =
        told("[known.dead_zone]\nhalf_width_v = 1.0\n[known.coulomb_friction]\nlevel_nm = 0.001\n");
    assert_eq!((params.mechanism, params.modelled.get("friction_share")), (Mechanism::InputDeadZone, None));
}

/// A number that is doubted is kept beside one that acts, through the link, the flash and the text.
#[test]
fn what_is_doubted_is_kept_and_does_not_act() {
    let mut axis = blank();
    for assignment in [
        "identified.lag_s=0.003",
        "doubted.load_friction=0.25",
        "doubted.viscous_skew=-0.2",
        "doubted.backlash_rad=0.1",
    ] {
        set(&mut axis, assignment);
    }
    let told = axis.modelled;
    let acting = told.acting();
    assert_eq!(acting, Modelled { lag: told.lag, ..Modelled::default() });
    assert!(told.load_friction > 0 && told.over_speed.skew < 0 && told.play > 0, "{told:?}");
    let bytes = postcard::to_stdvec(&told).expect("bytes");
    let back: Modelled = postcard::from_bytes(&bytes).expect("numbers");
    // The largest share is two parts in 65,536 smaller beside a doubt.
    assert_eq!(back, Modelled { load_friction: LoadFriction::MOST - 2, ..told });
    let text = parameters::print(&axis);
    assert!(
        text.contains("\nidentified.lag_s = 0.003") && text.contains("\ndoubted.viscous_skew = -0."),
        "{text}"
    );
    // Whoever is sure says so.
    set(&mut axis, "identified.viscous_skew=-0.2");
    assert_eq!(axis.modelled.acting().over_speed, told.over_speed);
    set(&mut axis, "supply.nominal_v=24");
    assert!(axis.modelled.trusts(2) && !axis.modelled.trusts(7), "{:?}", axis.modelled);
}

/// Half of itself is the most that a term of a model may be unsure by.
#[test]
fn a_term_is_trusted_as_far_as_its_own_interval() {
    let drag = |std: f64| {
        let (params, modelled) = told(&format!(
            "[known.actuator_lag]\ntime_constant_s = 0.003\n[known.quadratic_drag]\ndrag_nms2 = 1e-6\ndrag_nms2_std = {std:e}\nstanding = \"named\"\n"
        ));
        assert!(params.modelled["lag_s"].trusted && modelled.acting().lag > 0, "{params:?}");
        assert!(modelled.over_speed.drag > 0);
        let kept = params.modelled["drag_per_v"];
        assert!((kept.u95 - 1.96 * 0.016 * std / 1e-6).abs() < 1e-6, "{kept:?}");
        assert_eq!(kept.trusted, modelled.acting().over_speed.drag > 0);
        kept.trusted
    };
    assert!(drag(2e-7) && !drag(3e-7));
    // The file of the command says why, and tells the number all the same.
    let (_, text) =
        exported("[known.quadratic_drag]\ndrag_nms2 = 1e-6\ndrag_nms2_std = 3e-7\nstanding = \"named\"\n");
    assert!(text.contains("# not trusted: drag: 0.0160 has a half width (95 %) of 0.0094"), "{text}");
}

/// An encoder that gives half of what the axis file says: with the right counts, gain and play are those of the shaft.
#[test]
fn the_scale_of_the_encoder_becomes_counts_per_turn() {
    let scale = |std: f64, standing: &str| {
        let known = format!(
            "[known.encoder_scale]\nratio = 0.5\nratio_std = {std}\nstanding = \"{standing}\"\n[known.backlash]\ngap_rad = 0.01\nload_share = 0.0\n"
        );
        let model = model::parse("model.toml", &format!("{MODEL}{known}")).expect("a model");
        let shown = compensation::from_model(&model, &config()).expect("parameters").params;
        assert!((shown.gain_rad_s_per_v.expect("a gain").value - 10.0).abs() < 1e-9, "half of 20 rad/s/V");
        (shown, compensation::corrected(&model, &config()).expect("parameters"))
    };
    let (shown, export) = scale(0.001, "named");
    let params = export.params;
    assert_eq!(params.counts_per_rev, Some(2000));
    assert!((params.gain_rad_s_per_v.expect("a gain").value - 20.0).abs() < 1e-9);
    assert!(
        export.remarks.iter().any(|it| it.contains("encoder.counts_per_rev should be 2000 ± 8 (95 %)")),
        "{:?}",
        export.remarks
    );
    // Play is so many counts, whatever a turn has.
    let adopted = |params: &Params| {
        let mut axis = blank();
        parameters::adopt(&mut axis, params).expect("numbers that can be");
        (axis.config.counts_per_rev, axis.modelled.play)
    };
    assert_eq!((adopted(&shown), adopted(&params)), ((4000, 3), (2000, 3)));
    for (std, standing) in [(0.2, "named"), (0.001, "tie")] {
        let (shown, export) = scale(std, standing);
        assert_eq!(export.params, shown, "{standing} ± {std}");
    }
}

/// What the supply was thought to be does not change volts, nor the rate of ticks seconds.
#[test]
fn what_a_model_tells_stays_when_supply_and_rate_are_corrected() {
    let mut axis = blank();
    for assignment in ["identified.lag_s=0.003", "identified.drag_per_v=0.02", "identified.stribeck_v=0.5"] {
        set(&mut axis, assignment);
    }
    let before = axis.modelled.values(&axis.config);
    set(&mut axis, "supply.nominal_v=24");
    set(&mut axis, "axis.tick_hz=5000");
    let apart = |(before, after): (f32, f32)| (before - after).abs() > 1e-3 * before.abs();
    let after = axis.modelled.values(&axis.config);
    assert!(!before.into_iter().zip(after).any(apart), "{before:?} {after:?}");
}

#[test]
fn a_limit_above_the_supply_is_no_saturation_and_another_encoder_is_refused() {
    let model = model::parse("model.toml", &format!("{MODEL}[supply]\nlimit_v = 24.0\n")).expect("a model");
    let params = compensation::from_model(&model, &config()).expect("parameters").params;
    assert_eq!((params.saturation_pos_v, params.dead_zone_pos_v), (None, None));
    let other = servo::config::Config { counts_per_rev: 2048, ..config() };
    let error =
        compensation::from_model(&model, &other).map(|_| ()).expect_err("another encoder").to_string();
    assert!(error.contains("4000") && error.contains("2048"), "{error}");
}

/// What the export of a model with these effects says; its text is read back as the commands do.
fn exported(known: &str) -> (compensation::Export, String) {
    let model = model::parse("model.toml", &format!("{MODEL}{known}")).expect("a model");
    let export = compensation::from_model(&model, &config()).expect("parameters");
    let text = export.text().expect("a text");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("params.toml");
    std::fs::write(&path, &text).expect("written");
    assert_eq!(Params::read(&path).expect("read"), export.params);
    (export, text)
}

fn trusted(export: &compensation::Export) -> [bool; 4] {
    let params = &export.params;
    let numbers =
        [params.dead_zone_pos_v, params.dead_zone_neg_v, params.gain_rad_s_per_v, params.time_constant_s];
    numbers.map(|kept| kept.is_some_and(|kept| kept.trusted))
}

#[test]
fn an_export_trusts_what_is_named_and_narrow() {
    let zone = |std: f64, standing: &str| {
        exported(&format!(
            "[known.dead_zone]\nhalf_width_v = 1.0\nhalf_width_v_std = {std}\nstanding = \"{standing}\"\n"
        ))
    };
    assert_eq!(trusted(&zone(0.06, "named").0), [true; 4]);
    for (std, standing, said) in [
        (0.062, "named", "more than 12 % of it"),
        (0.01, "tie", "dead_zone is one name of a tie"),
        (0.01, "unexplained", "leaves something unexplained"),
    ] {
        let (export, text) = zone(std, standing);
        assert_eq!(trusted(&export), [false; 4], "{standing} ± {std}");
        let line = text.lines().find(|line| line.contains("not trusted: dead_zone_pos_v"));
        assert!(line.is_some_and(|line| line.starts_with('#') && line.contains(said)), "{text}");
    }
}

/// A fitted torque times R/Kt is what the log has shown: the tolerances of R and Kt do not widen it again.
#[test]
fn a_fitted_friction_is_as_narrow_as_the_log_has_shown_it() {
    let friction = "[known.coulomb_friction]\nlevel_nm = 0.02\nlevel_nm_std = 0.0004\n";
    assert_eq!(trusted(&exported(friction).0), [false; 4], "written by a person");
    let named = format!("{friction}standing = \"named\"\n");
    assert_eq!(trusted(&exported(&named).0), [true; 4]);
}

/// What pushes the same way everywhere widens no dead zone: it would come and go with the sign of the motion. v = u + 0.3 V is undone by −0.3 V,
/// and what is not sure of it is left out, with the reason.
#[test]
fn an_offset_of_the_drive_becomes_the_constant_of_the_table() {
    let offset = |std: f64, standing: &str| {
        let known = format!(
            "[tolerance]\ndefault = 0.01\n[known.voltage_offset]\noffset_v = 0.3\noffset_v_std = {std}\nstanding = \"{standing}\"\n"
        );
        exported(&known).0
    };
    let export = offset(0.01, "named");
    assert_eq!((export.params.dead_zone_pos_v, export.params.dead_zone_neg_v), (None, None));
    let table = export.params.position_load.expect("a table");
    assert!((table.constant_v + 0.3).abs() < 1e-9 && table.sines.is_empty(), "{table:?}");
    let built = table.build(&config()).expect("within its range");
    assert!(built.is_constant() && built.is_on() && built.is_trusted());
    for (std, standing) in [(0.1, "named"), (0.01, "tie")] {
        let export = offset(std, standing);
        assert_eq!(export.params.position_load, None, "{standing} ± {std}");
        assert!(
            export.remarks.iter().any(|doubt| doubt.starts_with("not trusted: voltage_offset: ")),
            "{:?}",
            export.remarks
        );
    }
}

/// The loops know one time constant: 0.08 s of inertia, 0.03 s of the drive's lag and 0.01 s of delay.
#[test]
fn a_lag_and_a_delay_are_part_of_the_time_constant() {
    let (export, _) = exported(
        "[tolerance]\ndefault = 0.01\n[known.actuator_lag]\ntime_constant_s = 0.03\nstanding = \"named\"\n\
         [known.transport_delay]\nseconds = 0.01\nstanding = \"named\"\n",
    );
    assert!(export.remarks.iter().all(|it| !it.contains("firmware")), "{:?}", export.remarks);
    let found = export.params.time_constant_s.expect("there");
    assert!((found.value - 0.12).abs() < 1e-9, "{} s", found.value);
    assert!(found.trusted);
}

#[test]
fn an_export_names_what_the_firmware_cannot_take() {
    let (export, text) = exported(
        "[tolerance]\ndefault = 0.01\n[known.stribeck_friction]\nlevel_nm = 0.01\nbreakaway_nm = 0.02\nstribeck_rad_s = 1.0\n\
         [known.gravity]\nmgl_nm = 0.01\nphase_rad = 0.0\n\
         [known.cogging]\namplitude_nm = 0.002\nperiods_per_rev = 12\nphase_rad = 0.0\n\
         [known.voltage_saturation]\nlimit_v = 9.0\nsoftness = 0.1\n",
    );
    assert!(
        export.remarks.iter().any(|it| it.ends_with("firmware: voltage_saturation.softness")),
        "{:?}",
        export.remarks
    );
    assert!(text.contains("# not compensated by the firmware: voltage_saturation.softness\n"), "{text}");
}

/// A soft spring becomes the middle of a sine of whole turns, beside gravity that repeats itself every turn; a stiff one that of a part
/// of a turn. Volts by hand: 2 Ω / 0.05 N m/A.
#[test]
fn a_spring_becomes_a_table_that_holds_it_around_its_rest() {
    for (stiffness, weight) in [(0.0012, 0.002), (0.13, 0.0)] {
        let gravity = if weight > 0.0 { "[known.gravity]\nmgl_nm = 0.002\nphase_rad = 0.0\n" } else { "" };
        let spring =
            format!("[known.torsional_spring]\nstiffness_nm_per_rad = {stiffness}\nrest_rad = 2.0\n");
        let model = model::parse("model.toml", &format!("{MODEL}{gravity}{spring}")).expect("a model");
        let table = waves::table(&waves::waves(&model, 12.0), &config()).expect("a table");
        let table = table.build(&config()).expect("a table that can be");
        // Up to a tenth of the supply.
        for twist in [-1.0, -0.4, 0.0, 0.2, 0.7, 1.0].map(|part| part * 1.2 / (40.0 * stiffness)) {
            let count = ((2.0 + twist) / TAU * f64::from(config().counts_per_rev)).round();
            let volts = 12.0 * f64::from(table.voltage(count as i32).0) / f64::from(Voltage::NOMINAL.0);
            let wanted = 40.0 * (stiffness * twist + weight * (2.0 + twist).sin());
            assert!(
                (volts - wanted).abs() < 0.01 + 0.05 * wanted.abs(),
                "{stiffness}: {volts} V, {wanted} V"
            );
        }
    }
}
