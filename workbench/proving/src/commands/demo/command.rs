//! `truing demo`: the main job end to end. `cargo xtask demo` runs it after set-up.

use crate::commands::demo::{self, Event, Options};
use indicatif::{ProgressBar, ProgressStyle};

/// Runs and tells.
pub fn run(options: &Options) -> anyhow::Result<()> {
    let bar = ProgressBar::new(1000);
    bar.set_style(ProgressStyle::with_template("  {msg:24} {bar:40} {percent:>3} %")?);
    let mut step = 0;
    demo::run(options, &mut |event| match event {
        Event::Step(title) => {
            step += 1;
            bar.reset();
            outln!("\n{step}. {title}");
        }
        Event::Found(text) => {
            bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
            bar.finish_and_clear();
            text.lines().for_each(|line| outln!("   {line}"));
        }
        Event::Progress(task, share) => {
            bar.set_message(task.to_owned());
            share.map_or_else(|| bar.tick(), |share| bar.set_position((share * 1000.0) as u64));
        }
    })?;
    let out = options.out.display();
    outln!("\nThe report: {out}/report.html");
    outln!(
        "Beside it: summary.json, model-before.toml, model-after.toml, run.csv, hidden-motor.toml, improve/"
    );
    Ok(())
}
