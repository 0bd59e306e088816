//! What a log does not test: directions and quadrants in which it holds no data, or everything, where it does not move.

use crate::gap::dataset::{Dataset, speeds};
use crate::outcome::Outcome;

/// Inputs and speeds below this part of the log's largest are counted in no quadrant. Chosen by judgement; not
/// studied.
const NEAR_ZERO: f64 = 0.03;
/// A quadrant with a smaller share of the samples is not tested. Chosen by judgement; not studied.
const FEWEST: f64 = 0.002;

/// A quadrant of the plane of input and speed.
struct Quadrant {
    input: f64,
    speed: f64,
    text: &'static str,
}

const QUADRANTS: [Quadrant; 4] = [
    Quadrant { input: 1.0, speed: 1.0, text: "driving forwards (input > 0, speed > 0)" },
    Quadrant { input: -1.0, speed: -1.0, text: "driving backwards (input < 0, speed < 0)" },
    Quadrant { input: -1.0, speed: 1.0, text: "braking against forward motion (input < 0, speed > 0)" },
    Quadrant { input: 1.0, speed: -1.0, text: "braking against backward motion (input > 0, speed < 0)" },
];

/// One note that names the quadrants without data; none if all have some.
pub fn missing(dataset: &Dataset) -> Vec<String> {
    let (largest_input, largest_speed) = (dataset.scales.input, dataset.scales.speed);
    let mut counts = [0usize; 4];
    let mut samples = 0;
    for run in dataset.runs.iter().filter(|run| run.log == 0) {
        samples += run.speed.len();
        let speeds = if dataset.of_position { speeds(run) } else { run.speed.measured.clone() };
        for (block, speed) in run.speed.block.iter().zip(&speeds) {
            let input = run.input[run.first_row[*block as usize] as usize] / largest_input;
            let speed = speed / largest_speed;
            let inside = |quadrant: &Quadrant| {
                input * quadrant.input > NEAR_ZERO && speed * quadrant.speed > NEAR_ZERO
            };
            if let Some(found) = QUADRANTS.iter().position(inside) {
                counts[found] += 1;
            }
        }
    }
    let few = |count: usize| (count as f64) < FEWEST * samples as f64;
    let empty: Vec<&str> = QUADRANTS
        .iter()
        .zip(counts)
        .filter(|(_, count)| few(*count))
        .map(|(quadrant, _)| quadrant.text)
        .collect();
    if empty.is_empty() {
        return Vec::new();
    }
    vec![format!("the log has no data of {}: what acts only there is not tested", empty.join(", nor of "))]
}

/// A log whose speeds stay below this part of what its input could reach does not move. Chosen by judgement; not
/// studied.
const SMALLEST_MOTION: f64 = 0.005;

/// If nothing moves, nothing can be tested.
pub fn not_excited(dataset: &Dataset) -> Option<Outcome> {
    let scales = &dataset.scales;
    // Rounding of one step alone spreads over some three σ. Chosen by judgement; not studied.
    let moves = dataset.range() > 5.0 * dataset.sigma && scales.motion > SMALLEST_MOTION * scales.reachable;
    (!moves).then(|| Outcome {
        notes: still(dataset),
        ..Outcome::untested(dataset.signal, dataset.sigma, dataset.unit())
    })
}

/// What a log that does not move lacks.
fn still(dataset: &Dataset) -> Vec<String> {
    let mut notes = [dataset.notes.clone(), missing(dataset)].concat();
    // Noise alone would change a reading.
    let silent = match dataset.scales.motion > 0.0 {
        true => String::new(),
        false => format!(
            " ({} has one value in every row: is the encoder connected, and is it the right column?)",
            dataset.signal
        ),
    };
    notes.push(format!(
        "the log never moves{silent}: drive the axis in both directions with more than {} {}",
        crate::text::figures::figure(dataset.scales.input),
        dataset.input.unit()
    ));
    notes
}
