//! Models as files of other programs: every effect has its place, and what a file holds comes back. The engines themselves are run by
//! `cargo xtask engines`.

use clap::ValueEnum;
use trials::firmware::truing;
use truing::export::held::{self, Format, Held};
use truing::export::{constants, helper, import, mjcf, plan::Actuator, plan::Plan, ranges, urdf};
use truing::system::effects::LIBRARY;
use truing::system::model::{self, Model};

const MOTOR: &str = "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = 2.0\nKt_nm_per_a = 0.05\n\
                     J_kgm2 = 5e-5\nb_nms_per_rad = 1e-5\n[tolerance]\ndefault = 0.1\n[supply]\nnominal_v = 12.0\n";

fn of(text: &str) -> Model {
    model::parse("motor.toml", text).unwrap()
}

/// The motor with one effect, each of its parameters at a value that is none of its defaults.
fn with(effect: &truing::system::effects::Effect) -> Model {
    let numbered = effect.parameters.iter().enumerate();
    let keys: String = numbered.map(|(k, it)| format!("{} = 0.{}\n", it.name, k + 4)).collect();
    of(&format!("{MOTOR}[known.{}]\n{keys}", effect.name))
}

#[test]
fn every_effect_has_its_place_in_every_format() {
    for effect in LIBRARY {
        for format in Format::value_variants() {
            assert!(
                held::held(effect, *format).is_some(),
                "{} has no row for {}",
                effect.name,
                format.name()
            );
        }
    }
}

/// A table that says `helper` is true of the file that is written, and one that says `native` too.
#[test]
fn the_table_says_what_the_files_do() {
    for effect in LIBRARY {
        let needs = Plan::of(&with(effect).physics()).helper();
        match held::held(effect, Format::Mjcf).unwrap() {
            Held::Helper => assert!(needs, "{} needs no helper", effect.name),
            Held::Native(_) if effect.parameters.iter().all(|it| it.default.is_none()) => {
                assert!(!needs, "{} needs a helper", effect.name);
            }
            _ => (),
        }
    }
}

/// MuJoCo's `dcmotor` holds either alone; of both it would keep the electrical time constant of the cold winding.
#[test]
fn a_winding_with_inductance_that_warms_up_is_the_helpers() {
    let plan = |text: &str| Plan::of(&of(text).physics()).actuator;
    let warm = format!("{MOTOR}[known.thermal_resistance]\nrise_per_w = 0.1\ntime_constant_s = 2.0\n");
    let wound = |text: &str| text.replace("[motor]\n", "[motor]\nL_h = 1e-3\n");
    assert_eq!([plan(&warm), plan(&wound(MOTOR))], [Actuator::DcMotor; 2]);
    assert_eq!(plan(&wound(&warm)), Actuator::Helper);
    let program = helper::written(&of(&wound(&warm)).physics(), &[]);
    assert!(program.contains("self.current = ") && program.contains("self.heat = "));
}

#[test]
fn the_table_of_the_document_is_the_table_of_the_code() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/export.md");
    let page = std::fs::read_to_string(path).unwrap();
    let [open, close] = ["<!-- held -->\n", "<!-- /held -->"];
    let (before, rest) = page.split_once(open).unwrap();
    let (_, after) = rest.split_once(close).unwrap();
    let wanted = format!("{before}{open}{}{close}{after}", held::table());
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, &wanted).unwrap();
    }
    assert!(page == wanted || std::env::var_os("UPDATE_DOCS").is_some(), "run again with UPDATE_DOCS=1");
}

#[test]
fn what_mjcf_holds_comes_back() {
    let text = format!(
        "{MOTOR}[known.coulomb_friction]\nlevel_nm = 0.02\n[known.quadratic_drag]\ndrag_nms2 = 1e-6\n"
    );
    let written = of(&text);
    let read = of(&import::model("servo.xml", &mjcf::written(&written, &["head".into()])).unwrap());
    for ((key, was), (same, is)) in written.parameters().into_iter().zip(read.parameters()) {
        assert_eq!(key, same);
        assert!((is - was).abs() <= 1e-6 * was, "{key}: {was} became {is}");
    }
    let effects =
        |model: &Model| model.known.iter().map(|it| (it.effect.name, it.values.clone())).collect::<Vec<_>>();
    assert_eq!(effects(&written), effects(&read));
}

#[test]
fn what_urdf_holds_comes_back() {
    let written = of(&format!("{MOTOR}[known.coulomb_friction]\nlevel_nm = 0.02\n"));
    let read =
        of(&import::model("servo.urdf", &urdf::written(&written, &["head".into()])).unwrap()).physics();
    let was = written.physics();
    assert_eq!((read.inertia, read.viscous, read.friction_pos), (was.inertia, was.viscous, was.friction_pos));
}

/// Every file of every effect can be parsed, and its helper has no number that Python cannot read. A file whose joint the helper
/// drives holds no motor to import, and says so.
#[test]
fn every_effect_alone_makes_well_formed_files() {
    for effect in LIBRARY {
        let model = with(effect);
        let read = import::model("servo.xml", &mjcf::written(&model, &["a -- b".into()]));
        match Plan::of(&model.physics()).actuator {
            Actuator::Helper => {
                assert!(read.unwrap_err().to_string().contains("a callback drives the joint"));
            }
            _ => assert!(read.is_ok(), "{}: {read:?}", effect.name),
        }
        import::model("servo.urdf", &urdf::written(&model, &[])).unwrap();
        let program = helper::written(&model.physics(), &[]);
        for word in ["NaN", "inf "] {
            assert!(!program.contains(word), "{}: {word} in\n{program}", effect.name);
        }
    }
}

/// R/Kt, the back-EMF and the friction as volts, from their definition; R and Kt move each of them by 10 %.
#[test]
fn the_constants_are_volts_at_the_terminals() {
    let text = constants::written(&of(&format!("{MOTOR}[known.coulomb_friction]\nlevel_nm = 0.02\n")), &[]);
    let value = |name: &str| -> f64 {
        let line = text.lines().find(|line| line.starts_with(&format!("double {name} "))).unwrap();
        line.split(['=', ';']).nth(1).unwrap().trim().parse().unwrap()
    };
    for (name, wanted) in [("kS", 0.02 * 40.0), ("kV", 0.05 + 1e-5 * 40.0), ("kA", 5e-5 * 40.0)] {
        assert!((value(name) - wanted).abs() < 1e-4 * wanted, "{name}: {} instead of {wanted}", value(name));
    }
    assert!(text.contains("0.8 ± 0.11, V"), "{text}");
    assert!(text.ends_with("SimpleMotorFeedforward feedforward = new SimpleMotorFeedforward(kS, kV, kA);\n"));
}

#[test]
fn ranges_reach_two_deviations_to_each_side() {
    let text = ranges::written(&of(MOTOR), &[]);
    assert!(text.contains("dr.joint_armature,\n            params={\"asset_cfg\": where, \"operation\": \"abs\", \"ranges\": (4.0000e-5, 6.0000e-5)}"), "{text}");
}

#[test]
fn what_a_format_cannot_hold_is_told_with_its_cost() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    std::fs::write(file("model.toml"), format!("{MOTOR}[known.dead_zone]\nhalf_width_v = 1.0\n")).unwrap();
    let rows: String = (0..2000)
        .map(|k| format!("{},{}\n", f64::from(k) * 1e-3, 4.0 * (f64::from(k) * 0.01).sin()))
        .collect();
    std::fs::write(file("log.csv"), format!("t_s,u_v\n{rows}")).unwrap();
    let mut command = truing();
    command.current_dir(folder.path()).args([
        "export",
        "--to",
        "urdf",
        "model.toml",
        "--log",
        "log.csv",
        "--out",
        "servo.urdf",
    ]);
    let output = command.output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && file("servo.urdf").is_file(), "{told}");
    assert!(told.starts_with("not held: dead_zone; it costs "), "{told}");
}
