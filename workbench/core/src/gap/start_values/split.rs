//! From what a log shows (gain, time constant, current) to the numbers of a model that are not known.

use super::line::Line;
use crate::system::effects;
use crate::system::log::{Dynamic, Input, Log, Run};
use crate::system::model::{DRIVEN_DIRECTLY, Draft, ELECTRICAL, VISCOUS_V};
use crate::text::input_error::InputError;
use nalgebra::{Matrix2, Vector2};
use servo::axis::Bridge;

/// Time constant that stands in for one that a table of settled speeds does not show, s. Chosen by judgement; not
/// studied.
const TIME_CONSTANT_S: f64 = 0.1;
/// Time constant of a winding as a part of the mechanical one. Small motors have 0.3 to 3 ms beside 5 to 50 ms.
/// Chosen by judgement; not studied.
const WINDING: f64 = 0.03;
/// The same in seconds, at most: windings of geared and hub motors have up to 10 ms, and what is slower is more often a filter of the
/// reading. Chosen by judgement; of 50 drawn motors 2 ms leave ten lags beside the hidden effect, none at all two.
const WINDING_S: f64 = 1e-2;
/// Viscous friction as a part of the damping by the back-EMF: bearings and grease of small motors lose a few per cent
/// of it. Chosen by judgement; not studied.
const VISCOUS: f64 = 0.05;
/// Torque or force per unit of input, a key of `inertia`.
const GAIN: &str = effects::DRIVE_GAIN.name;
/// Rows that show resistance and back-EMF. Chosen by judgement; not studied.
const ROWS: usize = 20;

/// Start values for what is not known.
#[derive(Clone, Debug, Default)]
pub struct Split {
    /// Numbers by key.
    pub numbers: Vec<(&'static str, f64)>,
    /// The log cannot tell the numbers of a motor apart: the model becomes of this kind.
    pub kind: Option<&'static str>,
    /// Resistance and back-EMF constant were found from the measured current.
    pub measured_winding: bool,
    /// Every number of the base is the log's own: the model is a fit to the log.
    pub fit: bool,
    /// The log shows no time constant, and the number stands in for one.
    pub guessed: bool,
    /// What the reader must know besides.
    pub notes: Vec<String>,
}

/// Resistance and back-EMF constant from voltage, current and speed: u = R i + Ke ω.
#[derive(Clone, Copy, Debug)]
pub struct Winding {
    r_ohm: f64,
    ke_vs_per_rad: f64,
}

impl Winding {
    /// From the rows whose voltage was held for two rows at least, so that the current had settled.
    pub fn of(log: &Dynamic) -> Option<Self> {
        let (mut normal, mut aim, mut rows) = (Matrix2::zeros(), Vector2::zeros(), 0);
        for run in &log.runs {
            let (Some(current), Some(speed)) = (&run.current_a, &run.speed) else { return None };
            for k in (1..run.rows()).filter(|k| held(run, *k)) {
                let row = Vector2::new(current[k], speed[k]);
                normal += row * row.transpose();
                aim += row * run.input[k];
                rows += 1;
            }
        }
        let solved = normal.try_inverse().filter(|_| rows >= ROWS)? * aim;
        (solved.x > 0.0 && solved.y > 0.0).then_some(Self { r_ohm: solved.x, ke_vs_per_rad: solved.y })
    }
}

fn held(run: &Run, row: usize) -> bool {
    run.bridge[row] != Bridge::Open
        && run.bridge[row - 1] == run.bridge[row]
        && run.input[row - 1] == run.input[row]
}

/// Gain and time constant are the log's own. What is friction of the damping shows where the bridge is open, and the winding where rows
/// are no further apart than its time constant.
pub fn first_order(draft: &Draft, line: &Line, log: &Log) -> Split {
    let (gain, seconds) = (line.gain.abs(), line.time_constant_s.unwrap_or(TIME_CONSTANT_S));
    let winding = (WINDING * seconds).min(WINDING_S);
    let all = [
        ("gain_rad_s_per_v", gain),
        ("time_constant_s", seconds),
        (VISCOUS_V, VISCOUS / gain),
        (ELECTRICAL, winding),
    ];
    let shows = |key: &str| match (key, log) {
        (VISCOUS_V, Log::Dynamic(it)) => it.runs.iter().any(|run| run.bridge.contains(&Bridge::Open)),
        (ELECTRICAL, Log::Dynamic(it)) => it.runs.iter().any(|run| run.sample_s() <= winding),
        (key, _) => ![VISCOUS_V, ELECTRICAL].contains(&key),
    };
    let missing = |(key, _): &(&str, f64)| draft.number(key).is_none();
    // What the log does not show is left out, as if nobody had asked for it.
    let start = |(key, number)| match shows(key) {
        true => Some((key, number)),
        false => wanted(draft, key).then_some((key, 0.0)),
    };
    let numbers: Vec<_> = all.into_iter().filter(missing).filter_map(start).collect();
    Split {
        fit: all[..2].iter().all(missing),
        guessed: line.time_constant_s.is_none(),
        numbers,
        ..Split::default()
    }
}

/// Gain and time constant of a motor with Kt = Ke = K: K/(K² + b R) and R J/(K² + b R).
pub fn motor(draft: &Draft, line: &Line, log: &Log, winding: Option<Winding>) -> Result<Split, InputError> {
    let (gain, seconds) = (line.gain.abs(), line.time_constant_s.unwrap_or(TIME_CONSTANT_S));
    let known = [draft.number("R_ohm"), draft.number("Kt_nm_per_a"), draft.number("J_kgm2")];
    let [r, k, j] = known;
    let missing = known.iter().filter(|number| number.is_none()).count();
    if winding.is_none() && missing > 1 {
        return as_first_order(draft, line, log);
    }
    let b = draft.number("b_nms_per_rad").unwrap_or(0.0);
    let k = k.or(winding.map(|it| it.ke_vs_per_rad)).unwrap_or(1.0 / gain);
    let r = r.or(winding.map(|it| it.r_ohm));
    // With J known and R not, R J/(K² + b R) = T gives R; a tenth keeps it positive where b alone explains T.
    let r = r.or(j.map(|j| seconds * k * k / (j - seconds * b).max(0.1 * j))).unwrap_or(1.0);
    let j = j.unwrap_or(seconds * (k * k + b * r) / r);
    let all = [
        ("R_ohm", r),
        ("L_h", WINDING * seconds * r),
        ("Kt_nm_per_a", k),
        ("J_kgm2", j),
        ("b_nms_per_rad", VISCOUS * k * k / r),
    ];
    Ok(Split {
        numbers: all.into_iter().filter(|(key, _)| wanted(draft, key)).collect(),
        measured_winding: winding.is_some() && missing > 0,
        ..Split::default()
    })
}

fn wanted(draft: &Draft, key: &str) -> bool {
    draft.unknown().iter().any(|unknown| unknown.key == key)
}

/// A linear axis has no motor constant in it: force and mass count per unit of the input.
pub fn linear(line: &Line) -> Split {
    let mass = line.acceleration_per_input().map_or(1.0, |it| 1.0 / it.abs());
    let seconds = line.time_constant_s.unwrap_or(TIME_CONSTANT_S);
    Split {
        numbers: vec![("mass_kg", mass), ("viscous", mass / seconds), (GAIN, 1.0)],
        kind: Some(DRIVEN_DIRECTLY),
        fit: true,
        ..Split::default()
    }
}

/// Two of resistance, torque constant and inertia are not known, and no current was measured.
fn as_first_order(draft: &Draft, line: &Line, log: &Log) -> Result<Split, InputError> {
    let model = draft.stated();
    let torque =
        model.known.iter().find(|known| known.effect.parameters.iter().any(|it| it.unit.contains("N m")));
    if let Some(known) = torque {
        let name = known.effect.name;
        let what = format!(
            "[known.{name}] states a torque, but R_ohm, Kt_nm_per_a and J_kgm2 are not known well enough to say what it does; state two of them"
        );
        return Err(InputError::file(&model.source, what));
    }
    Ok(Split { kind: Some("first_order"), ..first_order(draft, line, log) })
}

/// A motor whose current or torque is held: its winding does not show, and the acceleration is Kt i/J.
pub fn held_current(draft: &Draft, line: &Line, input: Input) -> Result<Split, InputError> {
    let per_input = line.acceleration_per_input().map_or(1.0, f64::abs);
    let (k, j) = (draft.number("Kt_nm_per_a"), draft.number("J_kgm2"));
    let (k, j) = match (k, j, input) {
        (Some(k), Some(j), _) => (k, j),
        (Some(k), None, Input::Current) => (k, k / per_input),
        (None, Some(j), Input::Current) => (per_input * j, j),
        (k, None, Input::Torque | Input::Force) => (k.unwrap_or(1.0), 1.0 / per_input),
        (None, Some(j), _) => (1.0, j),
        (None, None, _) => {
            let what = "the log is driven by a current, so that only Kt_nm_per_a over J_kgm2 shows: state one of them in the model file";
            return Err(InputError::file(&draft.stated().source, what));
        }
        (Some(k), None, _) => (k, k / per_input),
    };
    // Friction alone ends the acceleration of a motor whose current is held.
    let b = line.time_constant_s.map_or(VISCOUS * k * k, |seconds| j / seconds);
    let all = [("R_ohm", 1.0), ("L_h", 0.0), ("Kt_nm_per_a", k), ("J_kgm2", j), ("b_nms_per_rad", b)];
    let numbers: Vec<_> = all.into_iter().filter(|(key, _)| wanted(draft, key)).collect();
    let unseen = numbers.iter().any(|(key, _)| *key == "R_ohm");
    let notes = unseen
        .then(|| "The winding does not show where the current is held; R_ohm = 1 stands for it".to_owned());
    Ok(Split { numbers, notes: notes.into_iter().collect(), ..Split::default() })
}

/// An axis that is driven by its input directly.
pub fn inertia(draft: &Draft, line: &Line) -> Split {
    let per_input = line.acceleration_per_input().map_or(1.0, f64::abs);
    let seconds = line.time_constant_s.unwrap_or(TIME_CONSTANT_S);
    let key = if draft.stated().linear() { "mass_kg" } else { "inertia_kgm2" };
    let (gain, inertia) = match (draft.number(GAIN), draft.number(key)) {
        (Some(gain), Some(inertia)) => (gain, inertia),
        (Some(gain), None) => (gain, gain / per_input),
        (None, Some(inertia)) => (per_input * inertia, inertia),
        (None, None) => (1.0, 1.0 / per_input),
    };
    let all = [(key, inertia), ("viscous", inertia / seconds), (GAIN, gain)];
    let neither = wanted(draft, GAIN) && wanted(draft, key);
    let notes = neither.then(|| {
        "Neither drive_gain nor the inertia is known: drive_gain = 1 stands for it, and torques or forces count in units of the input".to_owned()
    });
    Split {
        numbers: all.into_iter().filter(|(key, _)| wanted(draft, key)).collect(),
        notes: notes.into_iter().collect(),
        fit: neither,
        ..Split::default()
    }
}
