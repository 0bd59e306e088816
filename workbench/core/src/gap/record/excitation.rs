//! What a log does not test: directions and quadrants in which it holds no data, or everything, where it does not move.

use crate::gap::dataset::{Dataset, speeds};
use crate::outcome::Outcome;
use crate::text::figures::figure;
use servo::axis::Bridge;

/// Inputs and speeds below this part of the log's largest are counted in no quadrant. Chosen by judgement; not
/// studied.
const NEAR_ZERO: f64 = 0.03;
/// A quadrant with a smaller share of the samples is not tested. Chosen by judgement; not studied.
const FEWEST: f64 = 0.002;

/// Inputs that differ by less than this part of the largest are one level. Chosen by judgement; not studied.
const ONE_LEVEL: f64 = 0.1;

/// The quadrants of the plane of input and speed: the signs of both, and what the motor does there.
const QUADRANTS: [(f64, f64, &str); 4] = [
    (1.0, 1.0, "driving forwards (input > 0, speed > 0)"),
    (-1.0, -1.0, "driving backwards (input < 0, speed < 0)"),
    (-1.0, 1.0, "braking against forward motion (input < 0, speed > 0)"),
    (1.0, -1.0, "braking against backward motion (input > 0, speed < 0)"),
];

/// Notes that name the quadrants without data, and an input of one level; none if all is there.
pub fn missing(dataset: &Dataset) -> Vec<String> {
    let (mut counts, mut samples) = ([0usize; 4], 0);
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for run in dataset.runs.iter().filter(|run| run.log == 0) {
        samples += run.speed.len();
        let speeds = if dataset.of_position { speeds(run) } else { run.speed.measured.clone() };
        for (block, speed) in run.speed.block.iter().zip(&speeds) {
            let driven = run.bridge[*block as usize] == Bridge::Driven;
            let input = if driven { run.input[run.first_row[*block as usize] as usize] } else { 0.0 };
            let (input, speed) = (input / dataset.scales.input, speed / dataset.scales.speed);
            for (count, (u, omega, _)) in counts.iter_mut().zip(QUADRANTS) {
                *count += usize::from(input * u > NEAR_ZERO && speed * omega > NEAR_ZERO);
            }
            if speed.abs() > NEAR_ZERO {
                (lowest, highest) = (lowest.min(input), highest.max(input));
            }
        }
    }
    let few = |count: usize| (count as f64) < FEWEST * samples as f64;
    let empty = QUADRANTS.iter().zip(counts).filter(|(_, count)| few(*count)).map(|(quadrant, _)| quadrant.2);
    let empty = empty.collect::<Vec<&str>>().join(", nor of ");
    let quadrants = format!("the log has no data of {empty}: what acts only there is not tested");
    let (input, unit) = (figure(dataset.scales.input * highest), dataset.input.unit());
    let level = format!(
        "the log moves under one input only, {input} {unit}: friction and a wrong gain look alike there, other levels tell them apart"
    );
    let one = moves(dataset) && (0.0..ONE_LEVEL).contains(&(highest - lowest));
    let said = [(!empty.is_empty(), quadrants), (one, level)];
    said.into_iter().filter_map(|(so, note)| so.then_some(note)).collect()
}

/// A log whose speeds stay below this part of what its input could reach does not move. Chosen by judgement; not
/// studied.
const SMALLEST_MOTION: f64 = 0.005;

/// True if more moves than noise.
fn moves(dataset: &Dataset) -> bool {
    // Rounding of one step alone spreads over some three σ. Chosen by judgement; not studied.
    let range = dataset.range() > 5.0 * dataset.sigma;
    range && dataset.scales.motion > SMALLEST_MOTION * dataset.scales.reachable
}

/// If nothing moves, nothing can be tested.
pub fn not_excited(dataset: &Dataset) -> Option<Outcome> {
    (!moves(dataset)).then(|| Outcome {
        notes: still(dataset),
        ..Outcome::untested(dataset.signal, dataset.sigma, dataset.unit())
    })
}

/// What a log that does not move lacks.
fn still(dataset: &Dataset) -> Vec<String> {
    let mut notes = [dataset.notes.clone(), missing(dataset)].concat();
    // Noise alone would change a reading.
    let asked = "has one value in every row: is the encoder connected, and is it the right column?";
    let silent =
        if dataset.scales.motion > 0.0 { String::new() } else { format!(" ({} {asked})", dataset.signal) };
    let (input, unit) = (figure(dataset.scales.input), dataset.input.unit());
    notes.push(format!(
        "the log never moves{silent}: drive the axis in both directions with more than {input} {unit}"
    ));
    notes
}
