//! Reading a log from CSV, with every defect reported by line and column.

use super::columns::{Columns, Quantity, Source};
use super::{Dynamic, Input, Log, Run, Table};
use crate::console::input_error::InputError;
use servo::axis::Bridge;
use std::path::Path;

/// Fewer rows than this in a run say nothing about dynamics.
const FEWEST_ROWS: usize = 20;
/// Fewer points than this make no steady-state curve.
const FEWEST_POINTS: usize = 4;

/// Reads a log from a file.
pub fn read(path: &Path, columns: &Columns) -> Result<Log, InputError> {
    parse(&path.display().to_string(), &text_of(path)?, columns)
}

/// Reads a record that need not have an output: what a simulation is driven by.
pub fn read_input(path: &Path, columns: &Columns) -> Result<Log, InputError> {
    parse_for(&path.display().to_string(), &text_of(path)?, columns, false)
}

/// Reads a log from a text; `source` names it in messages.
pub fn parse(source: &str, text: &str, columns: &Columns) -> Result<Log, InputError> {
    parse_for(source, text, columns, true)
}

fn text_of(path: &Path) -> Result<String, InputError> {
    let source = path.display();
    let bytes = std::fs::read(path)
        .map_err(|e| InputError::file(&source, format!("cannot be read ({e}); check the path")))?;
    String::from_utf8(bytes)
        .map_err(|_| InputError::file(&source, "is not a text file; export it as CSV in UTF-8"))
}

fn parse_for(source: &str, text: &str, columns: &Columns, output_needed: bool) -> Result<Log, InputError> {
    let cells = Cells::read(source, text)?;
    let found = columns.locate(source, &cells.header)?;
    let sheet = Sheet { source, cells: &cells, found: &found, output_needed };
    if sheet.has(Quantity::Time) { sheet.dynamic().map(Log::Dynamic) } else { sheet.table().map(Log::Table) }
}

/// The raw cells of a file with their line numbers.
struct Cells {
    header: Vec<String>,
    rows: Vec<(u64, csv::StringRecord)>,
}

impl Cells {
    fn read(source: &str, text: &str) -> Result<Self, InputError> {
        let text = text.trim_start_matches('\u{feff}');
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| InputError::file(source, e))?;
        let header: Vec<String> = header.iter().map(str::to_owned).collect();
        if header.iter().all(String::is_empty) {
            return Err(InputError::file(
                source,
                "is empty; expected a header line such as t_s,u_v,theta_rad",
            ));
        }
        if header.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(InputError::line(
                source,
                1,
                "starts with numbers; add a header line such as t_s,u_v,theta_rad",
            ));
        }
        let mut rows = Vec::new();
        for row in reader.records() {
            let row = row.map_err(|e| broken_row(source, &e))?;
            rows.push((row.position().map_or(0, csv::Position::line), row));
        }
        if rows.is_empty() {
            return Err(InputError::file(source, "has a header but no rows; the log was not written"));
        }
        Ok(Self { header, rows })
    }
}

/// A row with too few or too many cells: mostly a file cut off while it was written.
fn broken_row(source: &str, error: &csv::Error) -> InputError {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            let what = format!(
                "has {len} cells where the header has {expected_len}; the file is truncated or damaged, remove the row"
            );
            InputError::line(source, line, what)
        }
        _ => InputError::file(source, error),
    }
}

/// Cells with their meaning.
struct Sheet<'a> {
    source: &'a str,
    cells: &'a Cells,
    found: &'a [Source],
    output_needed: bool,
}

impl Sheet<'_> {
    fn has(&self, quantity: Quantity) -> bool {
        self.found.iter().any(|source| source.quantity == quantity)
    }

    /// A column in SI units, if the file has it.
    fn column(&self, quantity: Quantity) -> Result<Option<Vec<f64>>, InputError> {
        let Some(source) = self.found.iter().find(|source| source.quantity == quantity) else {
            return Ok(None);
        };
        let rows = self.cells.rows.iter();
        rows.map(|(line, row)| self.number(*line, row, source)).collect::<Result<_, _>>().map(Some)
    }

    fn number(&self, line: u64, row: &csv::StringRecord, source: &Source) -> Result<f64, InputError> {
        let name = &self.cells.header[source.index];
        let cell = row.get(source.index).unwrap_or("");
        let wrong =
            |what: &str| InputError::line(self.source, line, format!("column {name}: `{cell}` {what}"));
        let value: f64 =
            cell.parse().map_err(|_| wrong("is not a number; correct the cell or remove the row"))?;
        if value.is_finite() {
            Ok(value * source.factor)
        } else {
            Err(wrong("is not a finite number; remove the row"))
        }
    }

    /// The first of several columns that is there.
    fn first(&self, wanted: &[Quantity]) -> Result<Option<(Quantity, Vec<f64>)>, InputError> {
        for quantity in wanted {
            if let Some(values) = self.column(*quantity)? {
                return Ok(Some((*quantity, values)));
            }
        }
        Ok(None)
    }

    fn missing(&self, wanted: &str, stems: &[&str]) -> InputError {
        InputError::line(self.source, 1, Columns::missing(&self.cells.header, wanted, stems))
    }

    /// What drives the axis. A duty is multiplied by the supply voltage of the same row.
    fn input(&self) -> Result<(Input, Vec<f64>), InputError> {
        use Quantity::{CurrentInput, Duty, Force, Torque, Voltage};
        let missing = || {
            self.missing(
                "for the input (u_v, duty with vbus_v, current_a, torque_nm or force_n)",
                &["u", "v", "duty", "torque", "force", "current"],
            )
        };
        let (quantity, values) =
            self.first(&[Voltage, Duty, Torque, Force, CurrentInput])?.ok_or_else(missing)?;
        match quantity {
            Duty => Ok((Input::Voltage, self.volts_from_duty(values)?)),
            CurrentInput => Ok((Input::Current, values)),
            Torque => Ok((Input::Torque, values)),
            Force => Ok((Input::Force, values)),
            _ => Ok((Input::Voltage, values)),
        }
    }

    fn volts_from_duty(&self, duty: Vec<f64>) -> Result<Vec<f64>, InputError> {
        let supply = self
            .column(Quantity::Supply)?
            .ok_or_else(|| self.missing("vbus_v, which `duty` needs to become a voltage", &["vbus", "v"]))?;
        if let Some(row) = duty.iter().position(|d| d.abs() > 1.0 + 1e-6) {
            let what = format!(
                "column duty: {} lies outside −1 … 1; map it with a factor, --columns \"duty=NAME*FACTOR\"",
                duty[row]
            );
            return Err(InputError::line(self.source, self.cells.rows[row].0, what));
        }
        Ok(duty.iter().zip(&supply).map(|(d, v)| d * v).collect())
    }

    fn table(&self) -> Result<Table, InputError> {
        let (input, u_v) = self.input()?;
        let omega = self.column(Quantity::AngularSpeed)?;
        let omega_rad_s = omega.ok_or_else(|| {
            self.missing(
                "omega_rad_s or speed_rpm (and no t_s: a steady-state table)",
                &["omega", "speed", "w"],
            )
        })?;
        if input != Input::Voltage {
            return Err(InputError::file(
                self.source,
                "a steady-state table needs a voltage (u_v); add t_s for other inputs",
            ));
        }
        if u_v.len() < FEWEST_POINTS {
            let what =
                format!("has {} points; a steady-state curve needs at least {FEWEST_POINTS}", u_v.len());
            return Err(InputError::file(self.source, what));
        }
        Ok(Table {
            source: self.source.to_owned(),
            u_v,
            omega_rad_s,
            speed_unit_rad_s: self.factor(Quantity::AngularSpeed),
        })
    }

    /// Factor from the file's column to the SI unit.
    fn factor(&self, quantity: Quantity) -> f64 {
        self.found.iter().find(|source| source.quantity == quantity).map_or(1.0, |source| source.factor)
    }

    fn dynamic(&self) -> Result<Dynamic, InputError> {
        let time = self.column(Quantity::Time)?.expect("asked by the caller");
        let (input, values) = self.input()?;
        let position = self.first(&[Quantity::Angle, Quantity::Position])?;
        let speed = self.first(&[Quantity::AngularSpeed, Quantity::LinearSpeed])?;
        let linear = self.linear(position.as_ref(), speed.as_ref())?;
        let id = self.column(Quantity::Run)?.unwrap_or_else(|| vec![0.0; time.len()]);
        let whole = Run {
            id: 0,
            bridge: self.bridge(time.len())?,
            input: values,
            position: position.map(|pair| pair.1),
            speed: speed.map(|pair| pair.1),
            current_a: self.column(Quantity::Current)?,
            supply_v: self.column(Quantity::Supply)?,
            t_s: time,
        };
        let runs = self.split(&whole, &id)?;
        Ok(Dynamic { source: self.source.to_owned(), input, linear, runs })
    }

    /// True if the axis is linear; an output must be there, and position and speed must agree.
    fn linear(
        &self,
        position: Option<&(Quantity, Vec<f64>)>,
        speed: Option<&(Quantity, Vec<f64>)>,
    ) -> Result<bool, InputError> {
        match (position.map(|p| p.0 == Quantity::Position), speed.map(|s| s.0 == Quantity::LinearSpeed)) {
            (None, None) if !self.output_needed => Ok(false),
            (None, None) => Err(self.missing(
                "for the output (theta_rad, q_m, omega_rad_s or v_m_s)",
                &["theta", "q", "omega", "w", "v", "speed"],
            )),
            (Some(a), Some(b)) if a != b => Err(InputError::line(
                self.source,
                1,
                "position and speed belong to different axes (rad and m); map one of them with --columns",
            )),
            (a, b) => Ok(a.or(b) == Some(true)),
        }
    }

    fn bridge(&self, rows: usize) -> Result<Vec<Bridge>, InputError> {
        let Some(values) = self.column(Quantity::Bridge)? else {
            return Ok(vec![Bridge::Driven; rows]);
        };
        let code = |(row, value): (usize, &f64)| match *value {
            0.0 => Ok(Bridge::Open),
            1.0 => Ok(Bridge::Driven),
            2.0 => Ok(Bridge::Shorted),
            _ => Err(InputError::line(
                self.source,
                self.cells.rows[row].0,
                format!("column bridge: {value} is none of 0 (open), 1 (driven), 2 (shorted)"),
            )),
        };
        values.iter().enumerate().map(code).collect()
    }

    /// Cuts the rows where the run number changes; inside a run time must increase.
    fn split(&self, whole: &Run, id: &[f64]) -> Result<Vec<Run>, InputError> {
        let mut runs = Vec::new();
        let mut start = 0;
        for end in 1..=id.len() {
            if end < id.len() && id[end] == id[end - 1] {
                self.increasing(&whole.t_s, end)?;
                continue;
            }
            if end - start < FEWEST_ROWS {
                let what =
                    format!("run {} has {} rows; at least {FEWEST_ROWS} are needed", id[start], end - start);
                return Err(InputError::line(self.source, self.cells.rows[start].0, what));
            }
            runs.push(whole.rows_between(start, end, id[start] as i64));
            start = end;
        }
        Ok(runs)
    }

    fn increasing(&self, time: &[f64], row: usize) -> Result<(), InputError> {
        if time[row] > time[row - 1] {
            return Ok(());
        }
        let what = format!(
            "time does not increase ({} s after {} s); remove the row, or number the runs in a column `run`",
            time[row],
            time[row - 1]
        );
        Err(InputError::line(self.source, self.cells.rows[row].0, what))
    }
}

impl Run {
    /// The rows `start..end` as a run of their own.
    pub fn rows_between(&self, start: usize, end: usize, id: i64) -> Self {
        let cut = |values: &Option<Vec<f64>>| values.as_ref().map(|values| values[start..end].to_vec());
        Self {
            id,
            t_s: self.t_s[start..end].to_vec(),
            input: self.input[start..end].to_vec(),
            bridge: self.bridge[start..end].to_vec(),
            position: cut(&self.position),
            speed: cut(&self.speed),
            current_a: cut(&self.current_a),
            supply_v: cut(&self.supply_v),
        }
    }
}
