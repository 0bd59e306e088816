//! A search beside the interpreter, which is not held meanwhile: it can be watched and interrupted.

use crate::given::Logs;
use crate::refused;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use truing::cli::gap::Arguments;
use truing::gap;
use truing::outcome::Outcome;
use truing::system::model::{Draft, Model};

/// Time between two looks at signals and progress.
const BEAT: Duration = Duration::from_millis(50);
/// Said of a panic.
const FAULT: &str = "the search failed; this is a fault of truing, please report it";

/// What a search and its watcher share.
#[derive(Default)]
struct Shared {
    cancelled: AtomicBool,
    done: AtomicBool,
    fitted: AtomicU64,
    text: Mutex<String>,
}

/// The search was given up by its caller.
struct Cancelled;

impl Shared {
    /// Called by the search after each candidate, and with a sentence after each round.
    fn told(&self, text: &str) {
        if self.cancelled.load(Ordering::Relaxed) {
            // No error of the engine's: it has no way to be given up.
            resume_unwind(Box::new(Cancelled));
        }
        match text {
            "" => drop(self.fitted.fetch_add(1, Ordering::Relaxed)),
            text => text.clone_into(&mut self.text.lock().unwrap_or_else(PoisonError::into_inner)),
        }
    }
}

/// Runs the gap workflow in a thread of its own. A signal (Ctrl-C) raises at once; the search ends with its present candidate.
pub fn run(
    py: Python<'_>,
    arguments: Arguments,
    draft: Draft,
    logs: Logs,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Model, Outcome)> {
    let (shared, caller, begun) = (Arc::new(Shared::default()), thread::current(), Instant::now());
    let seen = Arc::clone(&shared);
    let search = move || {
        let watched = |model: &_, log: &_, holdouts: &[_], options: &_| {
            let outcome = gap::run(model, log, holdouts, options, &|text| seen.told(text));
            outcome.map(|outcome| Outcome { runtime_s: begun.elapsed().as_secs_f64(), ..outcome })
        };
        let open = |path: &_, columns: &_| logs.open(path, columns);
        let found = catch_unwind(AssertUnwindSafe(|| arguments.analysed(draft, &open, &watched)));
        seen.done.store(true, Ordering::Release);
        caller.unpark();
        found
    };
    let search = thread::Builder::new().name("truing".into()).spawn(search)?;
    while !shared.done.load(Ordering::Acquire) {
        py.detach(|| thread::park_timeout(BEAT));
        if let Err(interrupt) = py.check_signals().and_then(|()| tell(py, progress.as_ref(), &shared, begun))
        {
            shared.cancelled.store(true, Ordering::Relaxed);
            return Err(interrupt);
        }
    }
    let found = py.detach(|| search.join()).and_then(|found| found);
    found.map_err(|_| PyRuntimeError::new_err(FAULT))?.map_err(refused)
}

/// Calls back with seconds, fitted candidates and the last sentence.
fn tell(py: Python<'_>, progress: Option<&Py<PyAny>>, shared: &Shared, begun: Instant) -> PyResult<()> {
    let Some(progress) = progress else { return Ok(()) };
    let text = shared.text.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let told = (begun.elapsed().as_secs_f64(), shared.fitted.load(Ordering::Relaxed), text);
    progress.call1(py, told).map(drop)
}
