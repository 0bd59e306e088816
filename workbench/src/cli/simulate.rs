//! `truing simulate`: any model on any input.

use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use truing_core::gap::dataset::{FINE, GridRun, Traces, driven_by};
use truing_files::log::{self, Columns, Dynamic, Log};
use truing_files::model::{self, Model};
use truing_report::console::files::Files;
use truing_report::report::write_atomically;

/// Arguments of `truing simulate`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The model, TOML; its `[known.*]` effects act.
    #[arg(long)]
    pub model: PathBuf,
    /// The input over time, CSV: t_s and u_v (or another input), optionally bridge and run.
    #[arg(long)]
    pub input: PathBuf,
    /// Foreign column names, as in `truing gap`.
    #[arg(long, default_value = "", hide_default_value = true)]
    pub columns: String,
    /// Where to write t_s, the input, bridge, position, speed and current; without it: standard output.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Reads, simulates, writes.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    Files::default()
        .reads("--model", [&arguments.model])
        .reads("--input", [&arguments.input])
        .writes("--out", &arguments.out)
        .check()?;
    let model = model::read(&arguments.model)?;
    let columns = Columns::of(&arguments.columns, &model)?;
    let Log::Dynamic(input) = log::read_input(&arguments.input, &columns)? else {
        anyhow::bail!("{}: has no time column; a simulation needs t_s", arguments.input.display());
    };
    let out = arguments.out.as_deref().unwrap_or(Path::new("-"));
    write_atomically(out, &simulated(&model, &input))
}

/// The simulated record as CSV.
pub fn simulated(model: &Model, input: &Dynamic) -> String {
    let mut plant = driven_by(&model.kind, model.physics(), input.input);
    if !plant.supply_v.is_finite() {
        plant.supply_v =
            input.runs.iter().flat_map(|run| &run.input).fold(0.0, |most: f64, u| most.max(u.abs()));
    }
    let (position, speed) = if model.linear() { ("q_m", "v_m_s") } else { ("theta_rad", "omega_rad_s") };
    let mut text = format!("run,t_s,{},bridge,{position},{speed},i_a\n", input.input.column());
    let mut traces = Traces::default();
    for run in &input.runs {
        let grid = GridRun::of_rows(run);
        grid.simulate(&plant, 0.0, FINE, &mut traces);
        for k in 0..run.rows() {
            let outputs = (traces.integral[k], traces.reading[k], traces.current[k]);
            writeln!(
                text,
                "{},{},{},{},{:.9e},{:.9e},{:.9e}",
                run.id, run.t_s[k], run.input[k], run.bridge[k] as u8, outputs.0, outputs.1, outputs.2
            )
            .expect("writing to a string cannot fail");
        }
    }
    text
}
