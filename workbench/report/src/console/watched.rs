//! A search that can be watched.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;
use truing_core::gap::{self, Options};
use truing_core::outcome::Outcome;
use truing_core::system::log::Log;
use truing_core::system::model::Model;
use truing_core::text::input_error::InputError;

/// The gap workflow with a bar that shows its progress.
pub fn watched(model: &Model, log: &Log, holdouts: &[Log], options: &Options) -> Result<Outcome, InputError> {
    let bar = progress_bar();
    let outcome = gap::run(model, log, holdouts, options, &|text| {
        if text.is_empty() {
            bar.inc(1)
        } else {
            bar.set_message(text.to_owned());
            // Without a terminal there is no bar: a line a round says that it lives.
            if bar.is_hidden() {
                let (seconds, fitted) = (bar.elapsed().as_secs(), bar.position());
                errln!("{seconds} s, {fitted} candidates fitted, {text}");
            }
        }
    });
    bar.finish_and_clear();
    outcome.map(|outcome| Outcome { runtime_s: bar.elapsed().as_secs_f64(), ..outcome })
}

fn progress_bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {elapsed} {pos} candidates fitted, {msg}");
    let bar = ProgressBar::new_spinner().with_style(style.expect("a constant template"));
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}
