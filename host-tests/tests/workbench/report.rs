//! The reports: what they must contain, that they are self-contained, and that a failed write leaves the earlier file.

use servo::axis::Bridge;
use std::collections::BTreeMap;
use std::path::PathBuf;
use truing::device::commission_report::Number;
use truing::outcome::*;
use truing::report::html::{Document, Html};
use truing::report::json::Json;
use truing::report::model_file::ModelFile;
use truing::report::section::{Check, Section, Table};
use truing::report::terminal::{Terminal, WIDTH};
use truing::report::{Exporter, write_atomically};

fn value(value: f64, std: f64, unit: &str) -> Value {
    Value { value, std: Some(std), unit: unit.into() }
}

fn effect(name: &str, parameter: (&str, Value), tie: Option<usize>) -> NamedEffect {
    NamedEffect {
        name: name.into(),
        parameters: BTreeMap::from([(parameter.0.to_string(), parameter.1)]),
        derived: BTreeMap::new(),
        gap_before: 6.4,
        gap_after: 0.09,
        evidence: "82 % of the missing torque sits at |u| below 1.3 V, on both sides of zero and in both directions.".into(),
        place: None,
        tie,
    }
}

fn curve(f: impl Fn(f64) -> f64) -> Curve {
    let x: Vec<f64> = (0..400).map(|k| k as f64 * 0.01).collect();
    Curve { y: x.iter().map(|x| f(*x)).collect(), x }
}

fn traces() -> Plot {
    let series = |label: &str, style, curve, role| Series::new(label, curve, style).of(role);
    Plot {
        title: "Speed before and after".into(),
        caption: "The extended model follows the measurement.".into(),
        stage: Stage::Extraction,
        x_label: "time, s".into(),
        y_label: "speed, rad/s".into(),
        series: vec![
            series("measured", Style::Points, curve(|t| 40.0 * (3.0 * t).sin()), Role::Measured),
            series("model as given", Style::Dashed, curve(|t| 50.0 * (3.0 * t).sin()), Role::Given),
            series("extended model", Style::Line, curve(|t| 40.3 * (3.0 * t).sin()), Role::Extended),
        ],
        noise_band: None,
        marks: vec![(1.2, "dead zone 1.2 V".into())],
        held_out: vec![(3.0, 4.0)],
    }
}

fn outcome() -> Outcome {
    Outcome {
        schema: "truing-gap/1",
        verdict: Verdict::Tie,
        grade: Grade::Tie,
        small: vec![Small { name: "quadratic_drag".into(), fit_points: 0.21 }],
        data_sheet: Vec::new(),
        data: vec![],
        effects: vec![
            effect("dead_zone", ("half_width_v", value(1.1, 0.01, "V")), None),
            effect("drive_gain", ("ratio", value(1.31, 0.004, "1")), Some(0)),
        ],
        ties: vec![Tie {
            rivals: vec![vec!["drive_gain".into()], vec!["encoder_scale".into()]],
            separated_by: "the winding current at 6 V".into(),
        }],
        closest_known: vec![],
        holdout: HoldOut {
            signal: "omega_rad_s".into(),
            rmse_before: 6.4,
            rmse_after: 0.09,
            noise_floor: 0.087,
            fit_percent_before: 80.1,
            fit_percent_after: 99.7,
        },
        position: Some(PositionGap { rmse_before: 1.25, rmse_after: 0.03, unit: "rad" }),
        final_records: None,
        within_tolerance: vec![Shift {
            parameter: "J_kgm2".into(),
            shift_percent: 2.0,
            std_percent: 0.4,
            refitted: false,
        }],
        places: vec![Where { region: "0 < |u| < 1.2 V".into(), share_of_squared_error: 0.83, also: vec![] }],
        unexplained: Unexplained::new(0.01, None),
        next_experiment: Some(Experiment {
            peak_current_a: Some(4.21),
            travel: Some(20.0 * std::f64::consts::TAU),
            ..Experiment::new(
                "A logged current tells a drive gain from a sensor scale.".into(),
                vec![
                    Segment { bridge: Bridge::Driven, u_v: Some(6.0), seconds: 1.0 },
                    Segment { bridge: Bridge::Open, u_v: None, seconds: 2.0 },
                ],
                "V",
            )
        }),
        runtime_s: 3.2,
        searched: None,
        notes: vec!["Every second row was held out.".into()],
        steps: vec![
            Step { label: "model as given".into(), gap: 6.4 },
            Step { label: "+ dead_zone".into(), gap: 1.9 },
            Step { label: "+ drive_gain".into(), gap: 0.09 },
        ],
        rivals: vec![Rival {
            names: vec!["coulomb_friction".into()],
            gap: 3.1,
            reason: "acts in coast too <b>".into(),
        }],
        plots: vec![traces()],
        gap_unit: "rad/s".into(),
    }
}

#[test]
fn the_terminal_summary_fits_80_columns_and_says_everything() {
    let text = Terminal.export(&outcome()).unwrap();
    assert!(text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
    for piece in [
        "tie",
        "dead_zone",
        "1.100 ± 0.010 V",
        "drive_gain | encoder_scale",
        "noise floor",
        "80.10 % → 99.70 %",
        "J_kgm2 +2.00 ± 0.40 %",
        "+6 V for 1 s, bridge open for 2 s",
        "It takes up to 4.2 A and 20 turns of the motor",
        "83 %",
        "quadratic_drag (+0.21 points of fit)",
        "Every second row",
    ] {
        assert!(text.contains(piece), "{piece:?} is missing in\n{text}");
    }
}

/// The bar of a line in eighths of a character.
fn eighths(line: &str) -> usize {
    line.chars()
        .map(|c| {
            if ('▉'..='▏').contains(&c) {
                '▐' as usize - c as usize
            } else {
                8 * usize::from(c == '█')
            }
        })
        .sum()
}

#[test]
fn bars_are_in_proportion_to_the_gap() {
    let text = Terminal.export(&outcome()).unwrap();
    let bar = |label: &str| eighths(text.lines().find(|l| l.contains(label)).unwrap());
    let [given, with_zone, with_both, floor] =
        ["model as given", "  + dead_zone", "  + drive_gain", "noise floor"].map(bar);
    assert_eq!(with_zone, (given as f64 * 1.9 / 6.4).round() as usize);
    assert!(with_both <= given / 60 && (1..=with_both).contains(&floor), "{given} {with_both} {floor}");
}

#[test]
fn a_train_of_pulses_is_told_once() {
    let pulse = |u: f64| Segment { bridge: Bridge::Driven, u_v: Some(u), seconds: 0.037 };
    let profile = (0..16).flat_map(|_| [pulse(12.0), pulse(-12.0)]).collect();
    let next_experiment = Some(Experiment::new("fast reversals".into(), profile, "A"));
    let text = Terminal.export(&Outcome { next_experiment, ..outcome() }).unwrap();
    assert!(text.contains("16 times: +12 A for 37 ms, then -12 A for 37 ms"), "{text}");
}

#[test]
fn json_has_exactly_the_keys_of_the_schema() {
    let parsed: serde_json::Value = serde_json::from_str(&Json.export(&outcome()).unwrap()).unwrap();
    let keys: Vec<&str> = parsed.as_object().unwrap().keys().map(String::as_str).collect();
    let mut expected = vec![
        "schema",
        "verdict",
        "grade",
        "effects",
        "small",
        "ties",
        "closest_known",
        "holdout",
        "position",
        "within_tolerance",
        "where",
        "unexplained",
        "next_experiment",
        "runtime_s",
        "notes",
    ];
    let mut found = keys.clone();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(parsed["verdict"], "tie");
    assert_eq!(parsed["grade"], "tie");
    assert_eq!(parsed["effects"][0]["parameters"]["half_width_v"]["std"], 0.01);
    assert_eq!(parsed["effects"][0]["tie"], serde_json::Value::Null);
    assert_eq!(parsed["effects"][1]["tie"], 0);
    assert_eq!(parsed["ties"][0]["rivals"][1][0], "encoder_scale");
    assert_eq!(parsed["next_experiment"]["profile"][1], serde_json::json!({ "bridge": 0, "seconds": 2.0 }));
    assert_eq!(parsed["where"][0]["share_of_squared_error"], 0.83);
}

#[test]
fn html_is_self_contained_escaped_and_tells_the_three_stages() {
    let page = Html { subtitle: "model against log", command: "truing gap" }.export(&outcome()).unwrap();
    for stage in [
        "Detection",
        "Characterisation",
        "Parameter extraction",
        "Next experiment",
        "<details><summary>Considered and rejected: ",
    ] {
        assert!(page.contains(stage), "{stage}");
    }
    assert_eq!(page.matches("<svg").count(), 1, "the traces; the bars are text");
    assert_eq!(page.matches("role=\"img\"").count(), 1, "with words for those who cannot see it");
    assert!(page.contains("<title>Tie: dead_zone and drive_gain</title>"));
    assert!(page.contains("<code>truing gap</code>") && page.contains("prefers-color-scheme: dark"));
    assert!(page.contains("acts in coast too &lt;b&gt;"));
    for outside in ["<link", "<img", "src=", "url(", "@import", "fetch(", "XMLHttpRequest"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("Content-Security-Policy\" content=\"default-src 'none'; "));
    // A name and the origin of the charts' library are no resources.
    let known = ["http://www.w3.org/2000/svg", "https://github.com/leeoniya/uPlot", "http-equiv"];
    assert!(!known.iter().fold(page, |page, name| page.replace(name, "")).contains("http"));
}

/// The data of a chart are those of its plot, a break in the line is one, and a name from a user's file does not end their element.
#[test]
fn a_chart_holds_the_data_of_its_plot_and_nothing_breaks_out_of_it() {
    let mut plot = traces();
    plot.series[1].label = "</script><b>".into();
    plot.series[2].curve.y[7] = f64::NAN;
    let page =
        Document::new("Demo", "").gap("The case", &[], &Outcome { plots: vec![plot.clone()], ..outcome() });
    let page = page.render();
    let (_, data) = page.split_once("<script type=\"application/json\">").unwrap();
    let (data, _) = data.split_once("</script>").unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["series"][1]["label"], "</script><b>");
    let series = &data["series"][2];
    let steps: [f64; 2] = serde_json::from_value(data["steps"].clone()).unwrap();
    let summed = |axis: &str, step: f64| -> Vec<Option<f64>> {
        let mut sum = 0;
        let mut at = |less: &serde_json::Value| {
            sum += less.as_i64()?;
            Some(sum as f64 * step)
        };
        series[axis].as_array().unwrap().iter().map(&mut at).collect()
    };
    let (x, y) = (summed("x", steps[0]), summed("y", steps[1]));
    assert_eq!((x.len(), y.len()), (400, 400));
    for (k, (x, y)) in x.into_iter().zip(y).enumerate() {
        let (at, value) = (plot.series[2].curve.x[k], plot.series[2].curve.y[k]);
        assert!((x.unwrap() - at).abs() <= 0.51 * steps[0], "{k}");
        assert!(y.map_or(k == 7, |y| (y - value).abs() <= 0.51 * steps[1]), "{k}");
    }
    assert!(data.to_string().len() < 12_000, "{}", data.to_string().len());
}

#[test]
fn a_document_of_several_parts_has_a_table_of_contents() {
    let section = Section {
        title: "Closing table".into(),
        text: vec!["Estimates beside the truth.".into()],
        plots: vec![traces()],
        tables: vec![Table {
            caption: "Errors".into(),
            header: vec!["quantity".into(), "chip".into()],
            rows: vec![vec!["dead zone".into(), "1.2 V".into()]],
        }],
        checks: vec![Check { claim: "9 V become 7.8 V".into(), found: "7.80 V".into(), holds: true }],
    };
    let document = Document::new("Demo", "two parts")
        .gap("The case", &["An introduction."], &outcome())
        .section(section);
    let page = document.render();
    for piece in [
        "href=\"#part-2\"",
        "id=\"part-2\"",
        "Closing table",
        "9 V become 7.8 V",
        "holds",
        "An introduction.",
    ] {
        assert!(page.contains(piece), "{piece}");
    }
    document.write(&PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("report.html")).unwrap();
}

#[test]
fn an_outcome_that_could_not_be_tested_claims_no_figures() {
    let mut untested = outcome();
    untested.verdict = Verdict::InsufficientExcitation;
    untested.effects.clear();
    untested.steps.clear();
    let page = Html { subtitle: "", command: "truing gap" }.export(&untested).unwrap();
    assert!(
        page.contains("insufficient excitation") && !page.contains("noise floor") && !page.contains("NaN")
    );
    let text = Terminal.export(&untested).unwrap();
    assert!(text.contains("insufficient excitation") && !text.contains("noise floor"));
}

const MODEL: &str = r#"# a motor of the workshop
schema = "truing-model/1"
[motor]
R_ohm = 1.5
J_kgm2 = 0.001 # total, measured by coasting
[known.coulomb_friction]
level_nm = 0.008
"#;

#[test]
fn the_extended_model_keeps_the_text_and_holds_the_accepted_set() {
    let text = ModelFile { original: MODEL, origin: "truing gap on run.csv" }.export(&outcome()).unwrap();
    assert!(text.starts_with("# a motor of the workshop"));
    assert!(text.contains("J_kgm2 = 0.00102 # total, measured by coasting"), "{text}");
    assert!(!text.contains("[known]"), "{text}");
    for piece in [
        "[known.coulomb_friction]\nlevel_nm = 0.008",
        "[known.dead_zone]\nhalf_width_v = 1.1\nhalf_width_v_std = 0.01",
        "[known.drive_gain]\nratio = 1.31",
        "origin = \"truing gap on run.csv\"",
    ] {
        assert!(text.contains(piece), "{piece:?} is missing in\n{text}");
    }
    assert!(!text.contains("encoder_scale"), "a rival that was not accepted is not part of the model");
}

#[test]
fn a_failed_write_leaves_the_earlier_report_and_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out/report.json");
    write_atomically(&path, "earlier").unwrap();
    Json.write(&outcome(), &path).unwrap();
    let written = std::fs::read_to_string(&path).unwrap();
    assert!(written.contains("truing-gap/1"));
    // A folder in the place of the file cannot be replaced.
    let blocked = folder.path().join("out");
    let error = write_atomically(&blocked, "later").unwrap_err();
    assert!(format!("{error:#}").contains("out: cannot be written"), "{error:#}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), written);
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "no draft is left behind");
}

#[test]
fn every_plot_becomes_a_picture_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    truing::report::pictures::write(&outcome(), folder.path()).unwrap();
    let mut names: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names.len(), outcome().plots.len() + 1, "{names:?}");
    assert!(names.contains(&"gap.svg".to_owned()), "{names:?}");
    for name in names {
        let text = std::fs::read_to_string(folder.path().join(&name)).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{name}");
        assert!(text.contains("xmlns=\"http://www.w3.org/2000/svg\"") && text.contains("fill=\"#fff\""));
    }
}

#[test]
fn sides_that_cannot_be_told_apart_are_one() {
    let mut friction = effect("coulomb_asymmetric", ("neg_nm", value(0.02, 1e-4, "N m")), None);
    friction.parameters.insert("pos_nm".to_owned(), value(0.0201, 1e-4, "N m"));
    let told = |difference: f64| {
        let mut friction = friction.clone();
        let between = value(difference, 1e-4, "N m");
        friction.derived = BTreeMap::from([("pos_nm_minus_neg_nm".to_owned(), between)]);
        let text = Terminal.export(&Outcome { effects: vec![friction], ..outcome() }).unwrap();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert!(told(1e-4).contains("Found: coulomb_friction of 0.02 N m."), "{}", told(1e-4));
    let two = "Found: coulomb_asymmetric of 0.02 N m and 0.02 N m.";
    assert!(told(1e-3).contains(two), "{}", told(1e-3));
}

/// A first-order model has no torque constant: what stands for a torque of its motor of 1 Ω is told in its place.
#[test]
fn friction_of_a_first_order_model_is_told_in_volts() {
    const MODEL: &str = "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\ngain_rad_s_per_v = 15.0\ntime_constant_s = 0.1\n";
    let mut effects = vec![
        effect("coulomb_friction", ("level_nm", value(0.045, 0.001, "N m")), None),
        effect("flexible_coupling", ("damping", value(0.2, 0.1, "N m s/rad")), None),
        effect("current_limit", ("limit_a", value(4.0, 0.1, "A")), None),
    ];
    effects[2].derived = BTreeMap::from([("limit_v".to_owned(), value(4.0, 0.1, "V"))]);
    effects[0].derived = BTreeMap::from([
        ("level_v".to_owned(), value(0.675, 0.015, "V")),
        ("level_rad_s2".to_owned(), value(101.25, 2.25, "rad/s²")),
    ]);
    effects[1].derived = BTreeMap::from([("damping_v".to_owned(), value(3.0, 1.5, "V s/rad"))]);
    let outcome = Outcome { effects, ..outcome() };
    let text = Terminal.export(&outcome).unwrap();
    let html = Html { subtitle: "model against log", command: "truing gap" };
    let page = html.export(&outcome).unwrap();
    for said in [&text, &page] {
        assert!(said.contains("level_v") && said.contains("0.675 ± 0.015 V"), "{said}");
        // 0.675 V · 15 rad/s/V / 0.1 s.
        assert!(said.contains("101.2 ± 2.2 rad/s²"), "{said}");
        assert!(said.contains("damping_v") && said.contains("3.0 ± 1.5 V s/rad"), "{said}");
        assert!(said.contains("limit_v") && said.contains("4.00 ± 0.10 V"), "{said}");
        assert!(!said.contains("N m") && !said.contains("level_nm") && !said.contains("limit_a"), "{said}");
    }
    let json = Json.export(&outcome).unwrap();
    assert!(json.contains("\"level_nm\"") && json.contains("\"level_v\""), "{json}");
    let file = ModelFile { original: MODEL, origin: "log.csv" };
    let extended = file.export(&outcome).unwrap();
    assert!(extended.contains("level_nm = 0.045 # stands for level_v: 0.675 ± 0.015 V"), "{extended}");
    let one = Outcome { effects: outcome.effects[..1].to_vec(), ..outcome.clone() };
    let again = truing::system::model::parse("extended", &file.export(&one).unwrap()).unwrap();
    assert_eq!(again.known[0].values, [0.045]);
    // A torque that is far less certain than its voltage stands behind it.
    let mut motor = outcome.clone();
    motor.effects[0].parameters.insert("level_nm".to_owned(), value(0.045, 0.007, "N m"));
    let text = Terminal.export(&motor).unwrap();
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("0.675 ± 0.015 V (101.2 ± 2.2 rad/s²; 0.0450 ± 0.0070 N m)"), "{words}");
}

#[test]
fn a_plus_minus_is_explained_where_it_stands() {
    let text = Terminal.export(&outcome()).unwrap();
    assert_eq!(text.matches("± is one standard deviation").count(), 1, "{text}");
    let without = Outcome { effects: Vec::new(), within_tolerance: Vec::new(), ..outcome() };
    assert!(!Terminal.export(&without).unwrap().contains('±'));
}

#[test]
fn where_a_named_effect_acts_is_said_in_its_own_variable() {
    let mut named = outcome();
    assert!(
        Terminal.export(&named).unwrap().contains("Where       83 % of the squared error: 0 < |u| < 1.2 V")
    );
    named.effects[0].place = Some("between -1.1 and 1.1 V of input".into());
    let text = Terminal.export(&named).unwrap();
    assert!(text.contains("Where       dead_zone: between -1.1 and 1.1 V of input\n\n"), "{text}");
    let page = Html { subtitle: "", command: "truing gap" }.export(&named).unwrap();
    assert!(
        page.contains("</code> acts between -1.1 and 1.1 V of input.") && page.contains("1.2 V</td>"),
        "{page}"
    );
    let json: serde_json::Value = serde_json::from_str(&Json.export(&named).unwrap()).unwrap();
    assert_eq!(json["effects"][0]["place"], "between -1.1 and 1.1 V of input");
    assert!(json["effects"][1].get("place").is_none());
}

/// The chip's half widths hold 95 %: they are told as intervals, so that ± has one meaning.
#[test]
fn the_chip_s_numbers_are_told_as_intervals() {
    let number = Number { value: Some(1.5764), u95: Some(0.0636), trusted: true, reason: None, advice: None };
    assert_eq!(number.interval("V").unwrap(), "1.5128 … 1.6400 V (95 %)");
    assert_eq!(Number { u95: None, ..number }.interval("V"), None);
}

#[test]
fn a_parameter_of_a_fitted_model_is_refitted_and_not_within_a_tolerance() {
    let mut refitted = outcome();
    refitted.within_tolerance[0].refitted = true;
    let text = Terminal.export(&refitted).unwrap();
    assert!(text.contains("refitted: J_kgm2 +2.00 ± 0.40 %"), "{text}");
    assert!(!text.contains("within what the model allows"), "{text}");
    let page = Html { subtitle: "model against log", command: "truing gap" };
    let page = page.export(&refitted).unwrap();
    assert!(page.contains("refitted") && !page.contains("within their tolerance"));
    assert!(Json.export(&refitted).unwrap().contains("\"refitted\": true"));
    assert!(!Json.export(&outcome()).unwrap().contains("refitted"));
}

#[test]
fn the_extended_model_tells_how_sure_each_name_is() {
    let standing = |outcome: &Outcome, name: &str| {
        let text = ModelFile {
            original: "schema = \"truing-model/1\"\n[motor]\nR_ohm = 2.0\nKt_nm_per_a = 0.05\nJ_kgm2 = 1e-4\n",
            origin: "log.csv",
        }
        .export(outcome)
        .unwrap();
        let model = truing::system::model::parse("extended.toml", &text).unwrap();
        model.standing(name).unwrap().to_owned()
    };
    let tied = outcome();
    assert_eq!(standing(&tied, "dead_zone"), "named");
    assert_eq!(standing(&tied, "drive_gain"), "tie");
    let unexplained = Outcome { verdict: Verdict::Unexplained, ..outcome() };
    assert_eq!(standing(&unexplained, "dead_zone"), "unexplained");
}

/// Names with their sizes and what is left stand in the first sentence; a number within two deviations of 0 is not told as known.
#[test]
fn what_is_left_stands_beside_the_names() {
    let mut named = outcome();
    named.verdict = Verdict::Named;
    named.ties.clear();
    named.effects[1] = effect("constant_load", ("torque_nm", value(0.01, 0.02, "N m")), None);
    named.unexplained = Unexplained::new(0.17, Some("noise-like, correlated in time".into()));
    named.final_records =
        Some(HoldOut { fit_percent_before: 70.0, fit_percent_after: 97.5, ..named.holdout.clone() });
    let text = Terminal.export(&named).unwrap();
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let first = "The model lacks dead_zone of 1.1 V and constant_load; 17 % of the gap (squared) is left.";
    assert!(words.contains(first), "{words}");
    assert!(words.contains("torque_nm not told from 0 (0.010 ± 0.020 N m)"), "{words}");
    assert!(words.contains("records that chose nothing: fit 70.00 % → 97.50 %"), "{words}");
    let json: serde_json::Value = serde_json::from_str(&Json.export(&named).unwrap()).unwrap();
    assert_eq!(json["final"]["fit_percent_after"], 97.5);
    assert_eq!(json["unexplained"]["share_of_gap"], 0.17);
    let plain: serde_json::Value = serde_json::from_str(&Json.export(&outcome()).unwrap()).unwrap();
    assert!(plain.get("final").is_none());
}

/// The number of the headline tells how much there is of an effect, and is not the first in the alphabet.
#[test]
fn a_coupling_is_told_by_its_stiffness_and_a_friction_never_by_nothing() {
    let told = |name: &str, numbers: &[(&str, Value)]| {
        let mut named = outcome();
        named.verdict = Verdict::Named;
        named.ties.clear();
        named.effects.truncate(1);
        named.effects[0] = effect(name, (numbers[0].0, numbers[0].1.clone()), None);
        named.effects[0]
            .parameters
            .extend(numbers.iter().map(|(key, value)| (key.to_string(), value.clone())));
        let text = Terminal.export(&named).unwrap();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let stiffness = ("stiffness_nm_per_rad", value(0.23, 0.01, "N m/rad"));
    let text = told("flexible_coupling", &[stiffness, ("damping", value(0.017, 0.001, "N m s/rad"))]);
    assert!(text.contains("The model lacks flexible_coupling of 0.23 N m/rad"), "{text}");
    let nothing = ("breakaway_nm", Value { value: 0.0, std: None, unit: "N m".into() });
    let text = told("stribeck_friction", &[nothing, ("level_nm", value(0.02, 0.001, "N m"))]);
    assert!(text.contains("The model lacks stribeck_friction of 0.02 N m"), "{text}");
}
