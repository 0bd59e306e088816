//! The logs of a round: a recording that shows as much as it can, and experiments that part the names of a tie.

use crate::bench::Bench;
use crate::record::{self, Limits, Part, Plan, Segment};
use servo::axis::Bridge;
use servo::config::Config;
use servo::optional::Optional;
use servo::protect::Fault;
use servo::store::AxisParameters;
use std::path::Path;
use truing_core::outcome::{self, Experiment};
use truing_core::text::input_error::{InputError, NotDone};
use truing_report::report::write_atomically;
use truing_servo::device::aftermath::fault_text;

/// A plan is not shortened below this share of its length.
const SHORTEST: f64 = 0.55;
/// Share of the segments of a plan that are one pass: every input once, and the first one again at the end.
const ONE_PASS: usize = 2;

/// What to record of a motor of which this is known, within so many seconds; `None`: that does not suffice. Where both passes of a
/// recording take too long, one is made.
pub fn plan(known: &AxisParameters, seconds: f64, seed: u64) -> Result<Option<Plan>, InputError> {
    let of = Some(&known.estimates);
    let planned = |budget_s| Plan::new(&known.config, of, &Limits { budget_s, ..Limits::default() }, seed);
    let whole = planned(None)?;
    if whole.seconds <= seconds {
        return Ok(Some(whole));
    }
    // Not all of a plan becomes shorter: the ways home do not.
    if seconds >= SHORTEST * whole.seconds
        && let Ok(shorter) = planned(Some(seconds))
    {
        return Ok(Some(shorter));
    }
    let once = whole.segments.len().div_ceil(ONE_PASS);
    let once = whole.with(whole.segments[..once].to_vec());
    Ok(Some(once).filter(|once| once.seconds <= seconds))
}

/// The plan of an experiment on the same motor, every level once to each side; `None`: there is nothing to apply, or it
/// takes a sensor that this servo lacks.
pub fn experiment(plan: &Plan, asked: &Experiment) -> Option<Plan> {
    let most = plan.scale.most_v;
    let part = |&outcome::Segment { bridge, u_v, seconds, .. }: &outcome::Segment| {
        let volts = u_v.unwrap_or(0.0).clamp(-most, most);
        let drive = Part::Drive { from_v: volts, to_v: volts, seconds };
        if bridge == Bridge::Open { Part::Open { seconds } } else { drive }
    };
    let parts: Vec<Part> = asked.profile.iter().filter(|_| !asked.needs_current).map(part).collect();
    (!parts.is_empty()).then(|| plan.with(vec![Segment { name: "experiment", parts }]))
}

/// Records, and writes the log. Behind it the servo knows other things than before.
///
/// # Errors
/// The servo is lost or a fault ended the recording.
pub fn record(bench: &mut Bench, known: &AxisParameters, plan: &Plan, path: &Path) -> anyhow::Result<()> {
    let (wire, listening) = bench.line();
    // Where no time constant is trusted, protection is to know all the same how slow the motor is.
    let hint = known.config.time_constant_hint_s.or(Optional::new(plan.scale.tau_s as f32));
    let config = Config { time_constant_hint_s: hint, ..known.config };
    let recorded = record::run(wire, &config.into(), listening, plan, &mut |_| {})?;
    bench.took(&recorded.session.log);
    write_atomically(path, &recorded.to_csv(plan))?;
    let log = &recorded.session.log;
    if log.fault() != Fault::None {
        return Err(NotDone(format!("a fault ended the recording: {}", fault_text(log))).into());
    }
    recorded.session.complete()?;
    Ok(())
}
