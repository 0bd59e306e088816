//! Reading a log from a table of numbers, with every defect reported by line and column.

use super::bridging::{self, Bridged};
use super::columns::Columns;
use super::dialect::Cells;
use super::formula::Formula;
use super::names::Quantity;
use super::plan::{Plan, Source};
use super::text::missing;
use super::{Dynamic, Input, Reading, Run, Table};
use crate::console::input_error::InputError;
use servo::axis::Bridge;

/// Fewer rows than this in a run say nothing about dynamics.
pub(super) const FEWEST_ROWS: usize = 20;
/// Fewer points than this make no steady-state curve.
const FEWEST_POINTS: usize = 4;

/// Cells with their meaning.
pub(super) struct Sheet<'a> {
    source: &'a str,
    cells: &'a Cells,
    plan: Plan,
    supply_v: Option<f64>,
    output_needed: bool,
}

impl<'a> Sheet<'a> {
    pub(super) fn open(
        source: &'a str,
        cells: &'a Cells,
        columns: &Columns,
        output_needed: bool,
    ) -> Result<Reading, InputError> {
        let plan = columns.plan(source, cells, output_needed)?;
        plan.complete(source, cells.header_line)?;
        Self::of(source, cells, plan, columns, output_needed).reading()
    }

    pub(super) fn of(
        source: &'a str,
        cells: &'a Cells,
        plan: Plan,
        columns: &Columns,
        output_needed: bool,
    ) -> Self {
        Self { source, cells, plan, supply_v: columns.supply_v, output_needed }
    }

    /// The log, and how it was read.
    pub(super) fn reading(mut self) -> Result<Reading, InputError> {
        let mut notes: Vec<String> = self.cells.dialect.sentence().into_iter().collect();
        notes.extend(self.plan.note(&self.cells.header));
        notes.extend(self.leave_out_empty_columns());
        notes.extend(self.supply_note());
        let log = match self.has(Quantity::Time) {
            true => self.dynamic(&mut notes)?.into(),
            false => self.table(&mut notes)?.into(),
        };
        Ok(Reading { log, notes })
    }

    fn has(&self, quantity: Quantity) -> bool {
        self.plan.has(quantity)
    }

    /// A column that is there and holds nothing is not there.
    fn leave_out_empty_columns(&mut self) -> Option<String> {
        let empty = |source: &Source| match source.formula {
            Formula::Scaled { index, .. } if index < self.cells.header.len() => {
                self.cells.rows.iter().all(|row| missing(row.1.get(index).unwrap_or("")))
            }
            _ => false,
        };
        let (gone, kept): (Vec<Source>, Vec<Source>) = self.plan.sources.drain(..).partition(empty);
        self.plan.sources = kept;
        let names: Vec<String> = gone.iter().map(|source| format!("`{}`", source.name)).collect();
        (!names.is_empty()).then(|| format!("Columns without a value are left out: {}.", names.join(", ")))
    }

    /// Said where a duty is multiplied by a supply that the log does not have.
    fn supply_note(&self) -> Option<String> {
        let needed = self.has(Quantity::Duty) && !self.has(Quantity::Voltage) && !self.has(Quantity::Supply);
        let supply = self.supply_v.filter(|_| needed)?;
        Some(format!(
            "The duty is multiplied by {supply} V, the model's [supply] nominal_v: the log has no vbus_v."
        ))
    }

    /// A column in SI units, if the file has it; NaN where a cell is empty.
    fn column(&self, quantity: Quantity) -> Result<Option<Vec<f64>>, InputError> {
        let Some(source) = self.plan.sources.iter().find(|source| source.quantity == quantity) else {
            return Ok(None);
        };
        let mut cells = Vec::new();
        let rows = 0..self.cells.rows.len();
        rows.map(|row| self.value(row, source, &mut cells)).collect::<Result<_, _>>().map(Some)
    }

    fn value(&self, row: usize, source: &Source, cells: &mut Vec<f64>) -> Result<f64, InputError> {
        cells.clear();
        for index in source.formula.indices() {
            cells.push(self.number(row, *index)?);
        }
        let value = source.formula.value(cells, source.unit);
        if value.is_finite() || cells.iter().any(|cell| cell.is_nan()) {
            return Ok(value);
        }
        let what = format!(
            "--columns, `{}` gives {value} here; correct the expression or remove the row",
            source.name
        );
        Err(InputError::line(self.source, self.cells.rows[row].0, what))
    }

    /// One cell; the column behind the last one is the number of the row.
    fn number(&self, row: usize, index: usize) -> Result<f64, InputError> {
        let Some(name) = self.cells.header.get(index) else {
            return Ok(row as f64);
        };
        let (line, record) = &self.cells.rows[row];
        let cell = record.get(index).unwrap_or("");
        match self.cells.dialect.number(cell) {
            Some(value) if value.is_infinite() => {
                let what = format!("column {name}: `{cell}` is not a finite number; remove the row");
                Err(InputError::line(self.source, *line, what))
            }
            Some(value) => Ok(value),
            None if missing(cell) => Ok(f64::NAN),
            None => {
                Err(InputError::line(self.source, *line, format!("column {name}: {}", self.no_number(cell))))
            }
        }
    }

    fn no_number(&self, cell: &str) -> String {
        let clock = cell.matches(':').count() > 0 && cell.starts_with(|first: char| first.is_ascii_digit());
        if clock {
            return format!(
                "`{cell}` is a time of day; write seconds, or leave the column out and map t_s=row*SECONDS"
            );
        }
        let comma = self.cells.dialect.decimal_comma;
        match (comma, cell.contains('.'), cell.contains(',')) {
            (true, true, _) => {
                format!(
                    "`{cell}` has a point where the file has decimal commas; write all numbers in one way"
                )
            }
            (false, _, true) => {
                format!(
                    "`{cell}` has a comma where the file has decimal points; write all numbers in one way"
                )
            }
            _ => format!("`{cell}` is not a number; correct the cell or remove the row"),
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

    /// What drives the axis. A duty is multiplied by the supply voltage of the same row.
    fn input(&self) -> Result<(Input, Vec<f64>), InputError> {
        use Quantity::{CurrentInput, Duty, Force, Torque, Voltage};
        let found = self.first(&[Voltage, Duty, Torque, Force, CurrentInput])?;
        let (quantity, values) = found.ok_or_else(|| self.lacks("for the input"))?;
        match quantity {
            Duty => Ok((Input::Voltage, self.volts_from_duty(values)?)),
            CurrentInput => Ok((Input::Current, values)),
            Torque => Ok((Input::Torque, values)),
            Force => Ok((Input::Force, values)),
            _ => Ok((Input::Voltage, values)),
        }
    }

    fn lacks(&self, wanted: &str) -> InputError {
        let listed = self.cells.header.join(", ");
        let what = format!("no column {wanted} holds a value; map one with --columns (header: {listed})");
        InputError::line(self.source, self.cells.header_line, what)
    }

    fn volts_from_duty(&self, duty: Vec<f64>) -> Result<Vec<f64>, InputError> {
        let logged = self.column(Quantity::Supply)?;
        let known = || self.supply_v.map(|supply| vec![supply; duty.len()]);
        let supply = logged.or_else(known).ok_or_else(|| self.lacks("vbus_v, which `duty` needs,"))?;
        if let Some(row) = supply.iter().position(|volts| *volts <= 0.0) {
            let what = format!(
                "column vbus_v: {} V is no supply, which `duty` needs; state it in volts",
                supply[row]
            );
            return Err(InputError::line(self.source, self.cells.rows[row].0, what));
        }
        if let Some(row) = duty.iter().position(|d| d.abs() > 1.0 + 1e-6) {
            let most = duty.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
            let source = self.plan.sources.iter().find(|source| source.quantity == Quantity::Duty);
            let what = format!(
                "column duty: {} lies outside −1 … 1, as others do up to {most}; map it with its full scale, for example \
                 --columns \"duty={}/{}\"",
                duty[row],
                source.map_or("duty", |source| &source.name),
                super::propose::full_scale(most)
            );
            return Err(InputError::line(self.source, self.cells.rows[row].0, what));
        }
        Ok(duty.iter().zip(&supply).map(|(d, v)| d * v).collect())
    }

    fn table(&self, notes: &mut Vec<String>) -> Result<Table, InputError> {
        let (input, u_v) = self.input()?;
        let omega = self.column(Quantity::AngularSpeed)?;
        let omega = omega.ok_or_else(|| self.lacks("omega_rad_s (and no t_s: a steady-state table)"))?;
        let pairs = u_v.into_iter().zip(omega);
        let (kept, holes): (Vec<_>, Vec<_>) = pairs.enumerate().partition(|(_, (u, w))| !(u + w).is_nan());
        let holes: Vec<usize> = holes.into_iter().map(|hole| hole.0).collect();
        self.check_share(&holes)?;
        notes.extend(
            (!holes.is_empty()).then(|| format!("{} rows with empty cells are left out.", holes.len())),
        );
        let (u_v, omega_rad_s): (Vec<f64>, Vec<f64>) = kept.into_iter().map(|point| point.1).unzip();
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
        self.plan.sources.iter().find(|source| source.quantity == quantity).map_or(1.0, Source::factor)
    }

    fn dynamic(&self, notes: &mut Vec<String>) -> Result<Dynamic, InputError> {
        let time = self.column(Quantity::Time)?.ok_or_else(|| self.lacks("for the time"))?;
        let (input, values) = self.input()?;
        let position = self.first(&[Quantity::Angle, Quantity::Position])?;
        let speed = self.first(&[Quantity::AngularSpeed, Quantity::LinearSpeed])?;
        let linear = self.linear(position.as_ref(), speed.as_ref())?;
        let bridge = self.column(Quantity::Bridge)?.unwrap_or_else(|| vec![1.0; time.len()]);
        let id = self.column(Quantity::Run)?.unwrap_or_else(|| self.parts(time.len()));
        let needed = [&time, &values, &bridge, &id];
        let lost: Vec<bool> =
            (0..time.len()).map(|row| needed.iter().any(|column| column[row].is_nan())).collect();
        let mut whole = Run {
            id: 0,
            bridge: self.bridge(&bridge)?,
            input: values,
            position: position.map(|pair| pair.1),
            speed: speed.map(|pair| pair.1),
            current_a: self.column(Quantity::Current)?,
            supply_v: self.column(Quantity::Supply)?,
            t_s: time,
        };
        self.check_share(&bridging::holes(&whole, &lost))?;
        let bridged = bridging::bridge(&mut whole, &lost, &id);
        let runs = self.split(&whole, &id, &bridged)?;
        let rows: usize = runs.iter().map(Run::rows).sum();
        notes.extend(bridged.sentence(whole.rows(), rows));
        Ok(Dynamic { source: self.source.to_owned(), input, linear, runs })
    }

    /// Numbers of the parts between headers that stand in the middle of the file.
    fn parts(&self, rows: usize) -> Vec<f64> {
        let part = |row| self.cells.restarts.iter().filter(|start| **start > 0 && **start <= row).count();
        (0..rows).map(|row| part(row) as f64).collect()
    }

    /// Rows with holes are bridged while they are few.
    fn check_share(&self, holes: &[usize]) -> Result<(), InputError> {
        let rows = self.cells.rows.len();
        let Some(first) = holes.first().filter(|_| holes.len() as f64 > bridging::MOST * rows as f64) else {
            return Ok(());
        };
        let (line, record) = &self.cells.rows[*first];
        let indices = self.plan.sources.iter().flat_map(|source| source.formula.indices());
        let hole = |index: &&usize| record.get(**index).is_some_and(missing);
        let index = indices.into_iter().find(hole).copied().unwrap_or(0);
        let what = format!(
            "column {}: `{}` is not a finite number, and {} of {rows} rows have such cells; up to {:.0} % are bridged: fill or \
             remove them, or leave a column out with --columns \"NAME=none\"",
            self.cells.header[index],
            record.get(index).unwrap_or(""),
            holes.len(),
            100.0 * bridging::MOST
        );
        Err(InputError::line(self.source, *line, what))
    }

    /// True if the axis is linear; an output must be there, and position and speed must agree.
    fn linear(
        &self,
        position: Option<&(Quantity, Vec<f64>)>,
        speed: Option<&(Quantity, Vec<f64>)>,
    ) -> Result<bool, InputError> {
        match (position.map(|p| p.0 == Quantity::Position), speed.map(|s| s.0 == Quantity::LinearSpeed)) {
            (None, None) if !self.output_needed => Ok(false),
            (None, None) => Err(self.lacks("for the output")),
            (Some(a), Some(b)) if a != b => Err(InputError::line(
                self.source,
                1,
                "position and speed belong to different axes (rad and m); map one of them with --columns",
            )),
            (a, b) => Ok(a.or(b) == Some(true)),
        }
    }

    fn bridge(&self, values: &[f64]) -> Result<Vec<Bridge>, InputError> {
        let code = |(row, value): (usize, &f64)| match *value {
            0.0 => Ok(Bridge::Open),
            1.0 => Ok(Bridge::Driven),
            2.0 => Ok(Bridge::Shorted),
            // Such a row is left out.
            value if value.is_nan() => Ok(Bridge::Driven),
            _ => Err(InputError::line(
                self.source,
                self.cells.rows[row].0,
                format!("column bridge: {value} is none of 0 (open), 1 (driven), 2 (shorted)"),
            )),
        };
        values.iter().enumerate().map(code).collect()
    }

    /// Cuts the rows where the run number changes or a row is left out; inside a piece time must increase.
    fn split(&self, whole: &Run, id: &[f64], bridged: &Bridged) -> Result<Vec<Run>, InputError> {
        let mut runs = Vec::new();
        let mut shortest = None;
        let mut start = 0;
        for end in 1..=id.len() {
            if end < id.len() && id[end] == id[end - 1] && bridged.kept[end] == bridged.kept[end - 1] {
                if bridged.kept[end] {
                    self.increasing(&whole.t_s, end)?;
                }
                continue;
            }
            if bridged.kept[start] && end - start >= FEWEST_ROWS {
                runs.push(whole.rows_between(start, end, id[start] as i64));
            } else if bridged.kept[start] && shortest.is_none() {
                shortest = Some((start, end));
            }
            start = end;
        }
        match shortest {
            // What is left between two holes may be short; a run of the file may not.
            Some((start, end)) if bridged.removed == 0 || runs.is_empty() => {
                let what =
                    format!("run {} has {} rows; at least {FEWEST_ROWS} are needed", id[start], end - start);
                Err(InputError::line(self.source, self.cells.rows[start].0, what))
            }
            _ => Ok(runs),
        }
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
