//! The picture of `docs/hardware.md`: PWM, current and sampling of one axis, out of the model.

use super::machine::Chip;
use super::motor::Leg;
use super::own::rig::TICK;
use super::tests::{CARRIER, on};
use servo::axis::Bridge;
use std::fmt::Write as _;
use std::path::Path;

const WIDTH: f64 = 720.0;
const LEFT: f64 = 92.0;
const RIGHT: f64 = 16.0;
/// Rows of line a, line b and the current, each with its height in pixels.
const ROWS: [(f64, &str); 3] = [(36.0, "terminal a"), (92.0, "terminal b"), (148.0, "current")];
const HEIGHT: f64 = 32.0;

/// Two ticks of a quarter of full duty at a standing shaft.
fn drawing() -> String {
    let mut rig = on::<1>(&CARRIER, false);
    rig.bench.chip(|chip| chip.motors[0].turned = Some(0.0));
    (0..60).for_each(|_| rig.tick([(Bridge::Driven, 1050)]));
    let edges = rig.record([(Bridge::Driven, 1050)]);
    let (trace, sampled) =
        rig.bench.chip(|chip: &mut Chip| (std::mem::take(&mut chip.trace), chip.sampled.clone()));
    let begin = edges[0].0;
    let sampled: Vec<u64> = sampled.into_iter().filter(|at| *at < begin + 2 * TICK).collect();
    let x = |at: u64| LEFT + (at - begin) as f64 / (2 * TICK) as f64 * (WIDTH - LEFT - RIGHT);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} 232\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <title>PWM, current and sampling in the register model</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    );
    for at in &sampled {
        let x = x(at - 28 * 8);
        let _ = writeln!(text, "<path d=\"M{x:.1} 20V196\" stroke=\"#888\" stroke-dasharray=\"3 3\"/>");
        let _ = writeln!(
            text,
            "<text x=\"{x:.1}\" y=\"14\" text-anchor=\"end\" fill=\"#444\">update, trigger</text>"
        );
    }
    for (row, (top, name)) in ROWS.into_iter().enumerate() {
        let _ = writeln!(text, "<text x=\"8\" y=\"{:.1}\">{name}</text>", top + HEIGHT / 2.0 + 4.0);
        let mut path = String::new();
        match row {
            0 | 1 => {
                for pair in edges.windows(2) {
                    let y = if pair[0].1[0][row] == Leg::High { top } else { top + HEIGHT };
                    let _ = write!(
                        path,
                        "{}{:.1} {y:.1}H{:.1}",
                        if path.is_empty() { "M" } else { "L" },
                        x(pair[0].0),
                        x(pair[1].0)
                    );
                }
            }
            _ => {
                let y = |ampere: f64| top + HEIGHT - (ampere - 1.42) / 0.16 * HEIGHT;
                for (at, ampere) in trace.iter().filter(|(at, _)| *at >= begin && *at <= begin + 2 * TICK) {
                    let _ = write!(
                        path,
                        "{}{:.1} {:.1}",
                        if path.is_empty() { "M" } else { "L" },
                        x(*at),
                        y(*ampere)
                    );
                }
                for at in &sampled {
                    let near = trace.iter().min_by_key(|(other, _)| other.abs_diff(*at)).expect("a trace");
                    let _ = writeln!(
                        text,
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"#c2410c\"/>",
                        x(*at),
                        y(near.1)
                    );
                }
            }
        }
        let _ = writeln!(text, "<path d=\"{path}\" fill=\"none\" stroke=\"#1d4ed8\" stroke-width=\"1.5\"/>");
    }
    text.push_str("<text x=\"92\" y=\"216\" fill=\"#444\">Two control ticks of 100 µs, a quarter of full duty, DRV8874. Dots: the current is sampled.</text>\n</svg>\n");
    text
}

#[test]
fn the_picture_of_pwm_and_sampling_is_the_model_s() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/images/pwm.svg");
    let drawn = drawing();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &drawn).expect("the picture can be written");
    }
    let shown = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(shown, drawn, "docs/images/pwm.svg is old: run this test with UPDATE_DOCS=1");
}
