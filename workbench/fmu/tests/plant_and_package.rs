//! The FMU without an importer: its Rust layer beside `truing simulate`, and what is packed beside what the library answers. The C border
//! is run by `cargo xtask engines`.

use quick_xml::Reader;
use quick_xml::escape::unescape;
use quick_xml::events::Event;
use quick_xml::events::attributes::Attribute;
use servo::axis::Bridge;
use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::path::Path;
use truing_core::gap::dataset::{FINE, GridRun, Scales, Traces};
use truing_core::system::effects::{
    ACTUATOR_LAG, BACKLASH, CONSTANT_LOAD, COULOMB_FRICTION, Effect, LIBRARY, Meaning, STRIBECK_FRICTION,
    SUPPLY_SAG, THERMAL_RESISTANCE, TRANSPORT_DELAY,
};
use truing_core::system::model::{self, Model};
use truing_fmu::instance::Instance;
use truing_fmu::variables::Role;
use truing_fmu::{MODEL, Version, package};

/// R, K, J and b of a gear motor of 12 V, whose largest input is 10 V.
const MOTOR: [f64; 4] = [2.2, 0.06, 6.2e-5, 1e-5];
/// Rows of a run, each of a millisecond.
const ROWS: usize = 1500;

fn scales() -> Scales {
    let [r, k, j, b] = MOTOR;
    let (torque, damping) = (k / r * 10.0, b + k * k / r);
    let (speed, time) = (torque / damping, j / damping);
    Scales {
        input: 10.0,
        torque,
        speed,
        motion: speed,
        time,
        current: 10.0 / r,
        resistance: r,
        inertia: j,
        reachable: speed,
        duration: 1.5,
    }
}

/// The motor with these effects, each of a size that shows.
fn with(effects: &[&Effect]) -> Model {
    let [r, k, j, b] = MOTOR;
    let mut text = format!(
        "schema = \"truing-model/1\"\ndescription = \"a motor & its < sizes\"\n[motor]\nR_ohm = {r}\nL_h = 1e-3\nKt_nm_per_a = {k}\n\
         J_kgm2 = {j}\nb_nms_per_rad = {b}\n[supply]\nnominal_v = 12.0\n"
    );
    for effect in effects {
        text += &format!("[known.{}]\n", effect.name);
        for parameter in effect.parameters {
            let size = match parameter.meaning {
                Meaning::Ratio => 1.2,
                Meaning::PeriodsPerTurn => 7.0,
                _ => parameter.default.unwrap_or((parameter.lower.max(0.0) + 0.15).min(parameter.upper)),
            };
            text += &format!("{} = {:?}\n", parameter.name, size * scales().of(parameter.scale));
        }
    }
    model::parse("motor.toml", &text).unwrap()
}

/// Reversals and a sine: the voltage changes in some rows and stays in others.
fn voltage(row: usize) -> f64 {
    let t = row as f64 * 1e-3;
    if row < 700 { [9.0, -7.0, 2.5, 0.0][row / 100 % 4] } else { 9.0 * (9.0 * t).sin() }
}

/// Position, speed and current of every row, as `truing simulate` has them.
fn truth(model: &Model) -> Vec<[f64; 3]> {
    let time: Vec<f64> = (0..=ROWS).map(|row| row as f64 / 1000.0).collect();
    let grid = GridRun {
        row_time: time.clone(),
        time,
        bridge: vec![Bridge::Driven; ROWS],
        input: (0..ROWS).map(voltage).collect(),
        first_row: (0..=ROWS as u32).collect(),
        ..GridRun::default()
    };
    let mut traces = Traces::default();
    grid.simulate(&model.physics(), 0.0, FINE, &mut traces);
    (0..=ROWS).map(|row| [traces.integral[row], traces.reading[row], traces.current[row]]).collect()
}

fn reference(instance: &Instance, name: &str) -> u32 {
    instance.variables().iter().position(|it| it.name == name).unwrap_or_else(|| panic!("no {name}")) as u32
}

fn read(instance: &mut Instance) -> [f64; 3] {
    let names = ["angle", "speed", "current"].map(|name| reference(instance, name));
    let mut values = [0.0; 3];
    instance.get(&names, &mut values).unwrap();
    values
}

/// The largest difference over the largest value, of the worst column.
fn apart(one: &[[f64; 3]], other: &[[f64; 3]]) -> f64 {
    assert_eq!(one.len(), other.len());
    let column = |which: usize| {
        let most = other.iter().fold(1e-30, |most: f64, row| most.max(row[which].abs()));
        let worst =
            one.iter().zip(other).fold(0.0, |worst: f64, (a, b)| worst.max((a[which] - b[which]).abs()));
        worst / most
    };
    (0..3).map(column).fold(0.0, f64::max)
}

fn started(model: &Model) -> Instance {
    let mut instance = Instance::of(model.clone()).unwrap();
    instance.begin_at(0.0).unwrap();
    instance.initialized().unwrap();
    instance
}

#[test]
fn an_fmu_runs_as_truing_simulate_does_with_each_effect() {
    for effect in LIBRARY {
        let model = with(&[effect]);
        let mut instance = started(&model);
        let drive = reference(&instance, "voltage");
        let mut rows = vec![read(&mut instance)];
        for row in 0..ROWS {
            instance.set(&[drive], &[voltage(row)]).unwrap();
            instance.step(row as f64 * 1e-3, 1e-3).unwrap();
            rows.push(read(&mut instance));
        }
        let error = apart(&rows, &truth(&model));
        assert!(error <= 1e-9, "{}: {error:.1e}", effect.name);
    }
}

#[test]
fn results_do_not_depend_on_the_communication_steps() {
    let model = with(&[&STRIBECK_FRICTION, &TRANSPORT_DELAY, &ACTUATOR_LAG, &THERMAL_RESISTANCE]);
    let every = |step: f64, count: usize, kept: usize| {
        let mut instance = started(&model);
        let drive = reference(&instance, "voltage");
        instance.set(&[drive], &[8.0]).unwrap();
        let mut rows = Vec::new();
        for k in 0..count {
            instance.step(k as f64 * step, step).unwrap();
            if (k + 1) % kept == 0 {
                rows.push(read(&mut instance));
            }
        }
        rows
    };
    let rows = every(1e-3, 400, 2);
    for (step, count, kept) in [(4e-4, 1000, 5), (2e-3, 200, 1), (1e-4, 4000, 20)] {
        let error = apart(&every(step, count, kept), &rows);
        assert!(error <= 1e-9, "{step}: {error:.1e}");
    }
}

#[test]
fn a_kept_state_comes_back() {
    let model = with(&[&BACKLASH, &TRANSPORT_DELAY]);
    let mut instance = started(&model);
    let drive = reference(&instance, "voltage");
    instance.set(&[drive], &[6.0]).unwrap();
    instance.step(0.0, 0.1).unwrap();
    let kept = instance.now.clone();
    let further = |instance: &mut Instance| {
        instance.set(&[drive], &[-6.0]).unwrap();
        instance.step(0.1, 0.0123).unwrap();
        read(instance)
    };
    let first = further(&mut instance);
    instance.now = kept;
    assert_eq!(further(&mut instance), first);
}

#[test]
fn a_torque_from_outside_is_the_one_of_a_constant_load() {
    let torque = 0.1 * scales().torque;
    let own = format!("[known.{}]\n{} = {torque:?}\n", CONSTANT_LOAD.name, CONSTANT_LOAD.parameters[0].name);
    let text = with(&[]).source_text + &own;
    let mut inside = started(&model::parse("motor.toml", &text).unwrap());
    let mut outside = started(&with(&[]));
    let load = reference(&outside, "load_torque");
    outside.set(&[load], &[torque]).unwrap();
    for instance in [&mut inside, &mut outside] {
        instance.step(0.0, 0.25).unwrap();
    }
    assert!(read(&mut inside)[1] > 1.0);
    assert_eq!(read(&mut inside), read(&mut outside));
}

#[test]
fn what_cannot_be_done_is_said() {
    let mut instance = started(&with(&[]));
    let at = |name: &str| reference(&instance, name);
    let (voltage, speed, resistance) = (at("voltage"), at("speed"), at("R_ohm"));
    let mut says = |act: &dyn Fn(&mut Instance) -> Result<(), String>, what: &str| {
        let said = act(&mut instance).unwrap_err();
        assert!(said.contains(what), "{said}");
    };
    says(&|it| it.set(&[resistance], &[3.0]), "R_ohm is a fixed number");
    says(&|it| it.set(&[speed], &[3.0]), "speed is calculated");
    says(&|it| it.set(&[voltage], &[f64::NAN]), "must be a finite number");
    says(&|it| it.set(&[999], &[1.0]), "value reference 999 is unknown");
    says(&|it| it.step(0.5, 0.1), "the step begins at 0.5 s, but the FMU is at 0 s");
    says(&|it| it.step(0.0, -0.1), "must not be negative");
    instance.reset().unwrap();
    instance.set(&[resistance], &[-1.0]).unwrap();
    assert_eq!(instance.initialized(), Err("R_ohm is -1; it must be greater than 0".into()));
}

#[test]
fn a_number_set_before_the_start_is_that_of_another_model() {
    let other = with(&[]).source_text.replace("R_ohm = 2.2", "R_ohm = 4.4");
    let mut written = started(&model::parse("motor.toml", &other).unwrap());
    let mut set = Instance::of(with(&[])).unwrap();
    let (resistance, drive) = (reference(&set, "R_ohm"), reference(&set, "voltage"));
    set.set(&[resistance], &[4.4]).unwrap();
    set.initialized().unwrap();
    for instance in [&mut written, &mut set] {
        instance.set(&[drive], &[5.0]).unwrap();
        instance.step(0.0, 0.02).unwrap();
    }
    assert_eq!(read(&mut written), read(&mut set));
}

type Attributes = BTreeMap<String, String>;

/// Elements of a file in their order, with their attributes.
fn elements(xml: &str) -> Vec<(String, Attributes)> {
    let mut reader = Reader::from_str(xml);
    let mut all = Vec::new();
    loop {
        match reader.read_event().unwrap() {
            Event::Eof => return all,
            Event::Start(tag) | Event::Empty(tag) => {
                let pair =
                    |it: Attribute| (it.key.as_ref().to_owned(), unescape(&it.value).unwrap().into_owned());
                let attributes = tag.attributes().map(|it| pair(it.unwrap())).collect();
                all.push((tag.name().as_ref().to_owned(), attributes));
            }
            _ => {}
        }
    }
}

/// What an FMU holds, by name.
fn unpacked(bytes: Vec<u8>) -> BTreeMap<String, Vec<u8>> {
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut files = BTreeMap::new();
    for which in 0..zip.len() {
        let mut file = zip.by_index(which).unwrap();
        let mut content = Vec::new();
        file.read_to_end(&mut content).unwrap();
        files.insert(file.name().unwrap().into_owned(), content);
    }
    files
}

#[test]
fn the_description_says_what_the_library_answers() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("library");
    std::fs::write(&library, b"a library").unwrap();
    let model = with(&[&COULOMB_FRICTION, &SUPPLY_SAG]);
    for (version, element, token) in
        [(Version::Two, "ScalarVariable", "guid"), (Version::Three, "Float64", "instantiationToken")]
    {
        let files = unpacked(package::packed(&model, version, &library).unwrap());
        assert_eq!(files.len(), 3);
        let binary = files.iter().find(|(name, _)| name.starts_with("binaries/")).unwrap();
        assert!(Path::new(binary.0).file_stem().unwrap() == "truing_fmu" && binary.1 == b"a library");
        assert_eq!(files[MODEL], model.source_text.as_bytes());
        std::fs::write(folder.path().join("model.toml"), &files[MODEL]).unwrap();
        let all = elements(std::str::from_utf8(&files["modelDescription.xml"]).unwrap());
        assert_eq!(all[0].1["description"], "a motor & its < sizes");
        let mut instance = Instance::open(folder.path(), &all[0].1[token]).unwrap();
        agree(&all, element, &mut instance);
        let error = Instance::open(folder.path(), "{another}").err().unwrap();
        assert!(error.contains("belongs to another model or version"), "{error}");
    }
}

/// Names, references, roles, units and starts of the file are those of the instance.
fn agree(all: &[(String, Attributes)], element: &str, instance: &mut Instance) {
    let units: Vec<&String> = all.iter().filter(|it| it.0 == "Unit").map(|it| &it.1["name"]).collect();
    let places: Vec<usize> = (0..all.len()).filter(|place| all[*place].0 == element).collect();
    let variables = instance.variables().to_vec();
    assert_eq!(places.len(), variables.len());
    for (reference, (place, variable)) in places.into_iter().zip(variables).enumerate() {
        let mut attributes = all[place].1.clone();
        if element == "ScalarVariable" {
            attributes.extend(all[place + 1].1.clone());
        }
        assert_eq!(
            (&attributes["name"], &attributes["valueReference"]),
            (&variable.name, &reference.to_string())
        );
        assert_eq!(attributes.get("unit").cloned().unwrap_or_default(), variable.unit);
        assert!(
            variable.unit.is_empty() || units.contains(&&variable.unit),
            "{} is not defined",
            variable.unit
        );
        let (causality, starts) = match variable.role {
            Role::Time => ("independent", false),
            Role::Parameter(_) => ("parameter", true),
            Role::Input(_) => ("input", true),
            Role::Output(_) => ("output", false),
        };
        assert_eq!((attributes["causality"].as_str(), attributes.contains_key("start")), (causality, starts));
        let mut value = [f64::NAN];
        instance.get(&[reference as u32], &mut value).unwrap();
        let start = attributes.get("start").map_or(0.0, |start| start.parse().unwrap());
        assert_eq!(value, [start], "{}", variable.name);
    }
}

#[test]
fn a_missing_library_says_how_to_build_it() {
    let said = package::library(Some(Path::new("nowhere/libtruing_fmu.so"))).unwrap_err().0;
    assert!(
        said.contains("cargo rustc --release -p truing-fmu --lib --crate-type cdylib")
            && said.contains("--fmu-library"),
        "{said}"
    );
}
