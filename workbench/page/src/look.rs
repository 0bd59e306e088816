//! A log before any model is asked: what `truing look` sees, and the curves.

use std::io::{BufRead, Result as Read};
use truing_core::system::log::look::{self, Look};
use truing_core::system::log::{Bytes, Columns, Dynamic, Input, Log, Source};
use truing_core::system::model;
use truing_core::text::input_error::InputError;
use wasm_bindgen::prelude::{JsError, wasm_bindgen};

/// The formats besides text and JSON.
pub const SOURCES: &[&dyn Source] = &[];

/// What is seen in a file, and what is drawn of it.
#[wasm_bindgen(getter_with_clone)]
#[derive(Default)]
pub struct Looked {
    /// `truing-look/1`, with `written` besides: how the file is written, in some words.
    pub json: String,
    /// Abscissas: time in s, or the input of a table.
    pub x: Vec<f64>,
    /// Where each run begins in them; empty for a table.
    pub starts: Vec<u32>,
    /// Input; empty for a table.
    pub input: Vec<f64>,
    /// Output.
    pub output: Vec<f64>,
    /// Labels of abscissas, input and output.
    pub labels: Vec<String>,
}

/// Looks at the bytes of a log. `columns` as `--columns`; the text of a model, which may be empty or not readable yet, says what
/// supply and encoder are.
#[wasm_bindgen]
pub fn look(name: &str, bytes: &[u8], columns: &str, model: &str) -> Result<Looked, JsError> {
    let columns = columns_of(columns, model)?;
    let open = || -> Read<Box<dyn BufRead + '_>> { Ok(Box::new(bytes)) };
    let look = look::look(Bytes { name, open: &open, sources: SOURCES }, &columns)?;
    Ok(Looked { json: json(&look)?, ..look.log.as_ref().map(preview).unwrap_or_default() })
}

fn columns_of(columns: &str, text: &str) -> Result<Columns, InputError> {
    match model::parse_draft("model", text) {
        Ok(draft) => Columns::of(columns, draft.stated()),
        Err(_) => columns.parse(),
    }
}

fn json(look: &Look) -> Result<String, serde_json::Error> {
    let mut json = serde_json::to_value(look)?;
    json["written"] = look.written.as_str().into();
    Ok(json.to_string())
}

fn preview(log: &Log) -> Looked {
    match log {
        Log::Dynamic(record) => over_time(record),
        Log::Table(table) => Looked {
            x: table.u_v.clone(),
            output: table.omega_rad_s.clone(),
            labels: ["voltage, V", "", "settled speed, rad/s"].map(str::to_owned).to_vec(),
            ..Looked::default()
        },
    }
}

/// Every run over its own time: its speed, or its position where no speed is logged.
fn over_time(record: &Dynamic) -> Looked {
    let speeds = record.runs.iter().all(|run| run.speed.is_some());
    let mut drawn = Looked { labels: labels(record, speeds), ..Looked::default() };
    for run in &record.runs {
        let output = if speeds { &run.speed } else { &run.position };
        drawn.starts.push(drawn.x.len() as u32);
        drawn.x.extend(&run.t_s);
        drawn.input.extend(&run.input);
        // A run without the position that the others have has a gap here.
        let gap = || vec![f64::NAN; run.rows()];
        drawn.output.extend(output.clone().unwrap_or_else(gap));
    }
    drawn
}

fn labels(record: &Dynamic, speeds: bool) -> Vec<String> {
    let input = match record.input {
        Input::Voltage => "voltage",
        Input::Current => "current",
        Input::Torque => "torque",
        Input::Force => "force",
    };
    let output = match (speeds, record.linear) {
        (true, false) => "speed, rad/s",
        (true, true) => "speed, m/s",
        (false, false) => "angle, rad",
        (false, true) => "position, m",
    };
    vec!["time, s".into(), format!("{input}, {}", record.input.unit()), output.into()]
}
