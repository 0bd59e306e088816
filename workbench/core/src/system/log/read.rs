//! Reading a log from a table of numbers, with every defect reported by line and column.

use super::bridging::{self, Bridged};
use super::cells::{Cells, Place};
use super::column_plan::{OUTPUTS, Origin, Plan};
use super::columns::Columns;
use super::formula::Formula;
use super::names::Quantity;
use super::pieces::Piece;
use super::strays::{self, Strays};
use super::{Dynamic, Input, Reading, Run, folded, rates, time_line};
use crate::text::input_error::InputError;
use servo::axis::Bridge;
use std::fmt::Display;

/// Fewer rows than this in a run say nothing about dynamics. Chosen by judgement; not studied.
pub(super) const FEWEST_ROWS: usize = 20;

/// Cells with their meaning. What becomes a part of the log is taken out of them.
pub(super) struct Sheet<'a> {
    pub(super) source: &'a str,
    pub(super) cells: Cells,
    pub(super) plan: Plan,
    supply_v: Option<f64>,
    output_needed: bool,
    /// The user has spoken of the time.
    pub(super) time_stated: bool,
    from_s: Option<f64>,
    to_s: Option<f64>,
}

impl<'a> Sheet<'a> {
    pub(super) fn open(
        source: &'a str,
        cells: Cells,
        columns: &Columns,
        output_needed: bool,
    ) -> Result<Reading, InputError> {
        let plan = columns.plan(source, &cells, output_needed)?;
        plan.complete(source, &cells)?;
        Self::of(source, cells, plan, columns, output_needed).reading()
    }

    pub(super) fn of(source: &'a str, cells: Cells, plan: Plan, said: &Columns, output_needed: bool) -> Self {
        let time_stated = said.mentions(Quantity::Time);
        let Columns { supply_v, from_s, to_s, .. } = *said;
        Self { source, cells, plan, supply_v, output_needed, time_stated, from_s, to_s }
    }

    /// The log, and how it was read.
    pub(super) fn reading(mut self) -> Result<Reading, InputError> {
        let mut notes: Vec<String> = self.cells.told.clone().into_iter().collect();
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

    /// A column that is there and holds nothing is not there. One that nothing is computed from is not kept.
    fn leave_out_empty_columns(&mut self) -> Option<String> {
        let empty = |origin: &Origin| match origin.formula {
            Formula::Scaled { index, .. } => {
                self.cells.columns.get(index).is_some_and(|column| column.empty == self.cells.rows)
            }
            Formula::Expression { .. } => false,
        };
        let (gone, kept): (Vec<Origin>, Vec<Origin>) = self.plan.origins.drain(..).partition(empty);
        self.plan.origins = kept;
        for index in 0..self.cells.columns.len() {
            if self.uses(index) == 0 {
                self.cells.columns[index].values = Vec::new();
            }
        }
        let names: Vec<String> = gone.iter().map(|origin| format!("`{}`", origin.name)).collect();
        (!names.is_empty()).then(|| format!("Columns without a value are left out: {}.", names.join(", ")))
    }

    /// How many quantities are computed from a column.
    pub(super) fn uses(&self, index: usize) -> usize {
        self.plan.origins.iter().filter(|origin| origin.formula.indices().contains(&index)).count()
    }

    /// Said where a duty is multiplied by a supply that the log does not have.
    fn supply_note(&self) -> Option<String> {
        let needed = self.has(Quantity::Duty) && !self.has(Quantity::Voltage) && !self.has(Quantity::Supply);
        let supply = self.supply_v.filter(|_| needed)?;
        Some(format!(
            "The duty is multiplied by {supply} V, the model's [supply] nominal_v: the log has no vbus_v."
        ))
    }

    /// The first of several columns that is there.
    fn first(&mut self, wanted: &[Quantity]) -> Result<Option<(Quantity, Vec<f64>)>, InputError> {
        for quantity in wanted {
            if let Some(values) = self.column(*quantity)? {
                return Ok(Some((*quantity, values)));
            }
        }
        Ok(None)
    }

    /// What drives the axis. A duty is multiplied by the supply voltage of the same row.
    pub(super) fn input(&mut self) -> Result<(Input, Vec<f64>), InputError> {
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

    /// A row cannot be used.
    pub(super) fn wrong(&self, row: usize, what: impl Display) -> InputError {
        InputError::at(self.source, self.cells.place(row), what)
    }

    pub(super) fn lacks(&self, wanted: &str) -> InputError {
        let listed = self.cells.header.join(", ");
        let what = format!("no column {wanted} holds a value; map one with --columns (header: {listed})");
        self.cells.wrong_names(self.source, what)
    }

    fn volts_from_duty(&self, mut duty: Vec<f64>) -> Result<Vec<f64>, InputError> {
        let logged = self.copy(Quantity::Supply)?;
        let known = || self.supply_v.map(|supply| vec![supply; duty.len()]);
        let supply = logged.or_else(known).ok_or_else(|| self.lacks("vbus_v, which `duty` needs,"))?;
        if let Some(row) = supply.iter().position(|volts| *volts <= 0.0) {
            let volts = supply[row];
            let what =
                format!("column vbus_v: {volts} V is no supply, which `duty` needs; state it in volts");
            return Err(self.wrong(row, what));
        }
        if let Some(row) = duty.iter().position(|d| d.abs() > 1.0 + 1e-6) {
            let most = duty.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
            let origin = self.plan.origin(Quantity::Duty);
            let what = format!(
                "column duty: {} lies outside −1 … 1, as others do up to {most}; map it with its full scale, for example \
                 --columns \"duty={}/{}\"",
                duty[row],
                origin.map_or("duty", |origin| &origin.name),
                super::propose::full_scale(most)
            );
            return Err(self.wrong(row, what));
        }
        duty.iter_mut().zip(&supply).for_each(|(d, v)| *d *= v);
        Ok(duty)
    }

    /// Factor from the file's column to the SI unit.
    pub(super) fn factor(&self, quantity: Quantity) -> f64 {
        self.plan.origin(quantity).map_or(1.0, Origin::factor)
    }

    /// All rows as one run, the run that each of them belongs to, what drives the axis, and whether it is linear. A row
    /// whose run or bridge is not known has no input.
    fn single_run(&mut self) -> Result<(Run, Vec<f64>, Input, bool), InputError> {
        let mut time = self.column(Quantity::Time)?.ok_or_else(|| self.lacks("for the time"))?;
        from_its_beginning(&mut time);
        let (input, values) = self.input()?;
        let position = self.first(&[Quantity::Angle, Quantity::Position])?;
        let speed = self.first(&[Quantity::AngularSpeed, Quantity::LinearSpeed])?;
        let linear = self.linear(position.as_ref(), speed.as_ref())?;
        let bridge = self.column(Quantity::Bridge)?;
        let id = self.ids(time.len())?;
        let lost =
            |row: &usize| id[*row].is_nan() || bridge.as_ref().is_some_and(|bridge| bridge[*row].is_nan());
        let lost: Vec<usize> = (0..time.len()).filter(lost).collect();
        let mut whole = Run {
            id: 0,
            bridge: self.bridge(bridge, time.len())?,
            input: values,
            position: position.map(|pair| pair.1),
            speed: speed.map(|pair| pair.1),
            current_a: self.column(Quantity::Current)?,
            supply_v: self.column(Quantity::Supply)?,
            t_s: time,
        };
        lost.iter().for_each(|row| whole.input[*row] = f64::NAN);
        Ok((whole, id, input, linear))
    }

    fn dynamic(&mut self, notes: &mut Vec<String>) -> Result<Dynamic, InputError> {
        notes.extend(self.unfold());
        let (mut whole, mut id, input, linear) = self.single_run()?;
        let merged = rates::merge(&mut whole, |row, other| id[row] == id[other]);
        let same = |row: usize| id[row] == id[row - 1] || id[row].is_nan();
        let mended =
            time_line::mend(&mut whole.t_s, self.factor(Quantity::Time), same, |row| self.cells.place(row));
        let mut mended = mended.map_err(|what| InputError::file(self.source, what))?;
        mended.dropped.extend(merged);
        mended.dropped.sort_unstable();
        self.begin_anew(&mut id, &mended.restarts);
        let (rows, note) = rates::joined(&mut whole, |row, other| id[row] == id[other]).unzip();
        let rows = rows.unwrap_or_else(|| (0..whole.rows()).collect());
        let rows = self.within(&whole.t_s, rows, &mended.dropped);
        notes.extend(mended.notes.into_iter().chain(note));
        self.check_crop(&whole.t_s, &rows)?;
        whole.keep(&rows);
        let id: Vec<f64> = rows.iter().map(|row| id[*row]).collect();
        let mut lost: Vec<bool> =
            (0..rows.len()).map(|row| whole.t_s[row].is_nan() || whole.input[row].is_nan()).collect();
        let strays = self.strays(&whole, &rows, input, linear)?;
        let bad = whole.take_out(&strays, &mut lost, |row| self.cells.place(rows[row]));
        self.check_share(&bridging::holes(&whole, &lost), &rows)?;
        let bridged = bridging::bridge(&mut whole, &lost, |row| id[row]);
        let all = whole.rows();
        let runs = whole.parted(&self.pieces(&rows, &id, &bridged)?);
        let left: usize = runs.iter().map(Run::rows).sum();
        let what = if bad.is_some() { "empty or bad" } else { "empty" };
        notes.extend(bridged.sentence(all, left).map(|text| text.replace("empty", what)));
        notes.extend(bad.map(|text| format!("{}: {text}", self.source)));
        Ok(Dynamic { source: self.source.to_owned(), input, linear, runs, names: self.plan.names.clone() })
    }

    /// Of these rows those that are not dropped and lie in the part of the log that is read.
    fn within(&self, t_s: &[f64], mut rows: Vec<usize>, dropped: &[usize]) -> Vec<usize> {
        let outside = |row: usize| {
            self.from_s.is_some_and(|from| t_s[row] < from) || self.to_s.is_some_and(|to| t_s[row] > to)
        };
        rows.retain(|row| dropped.binary_search(row).is_err() && !outside(*row));
        rows
    }

    /// Cells that cannot be, column by column; `at`: which rows of the file they are. Many that lie among the others are the sensor's way; many outside of them are no log.
    fn strays(&self, run: &Run, at: &[usize], input: Input, linear: bool) -> Result<Vec<Strays>, InputError> {
        let most = bridging::MOST * run.rows() as f64;
        let mut found = strays::found(run, input.column(), linear, self.supply_v);
        if let Some(many) = found.iter().find(|it| it.outside && it.count() as f64 > most) {
            let (column, count, rows, most) =
                (&many.column, many.count(), run.rows(), 100.0 * bridging::MOST);
            let what = format!(
                "column {column}: {count} of {rows} rows hold values far outside of what the others hold, up to {most:.0} % are left out: clean the column"
            );
            return Err(self.wrong(at[many.rows[0].start], what));
        }
        found.retain(|it| it.count() as f64 <= most);
        Ok(found)
    }

    /// Positions that fold, and signs in a bit of their own.
    fn unfold(&mut self) -> Vec<String> {
        let mut notes = Vec::new();
        for origin in self.plan.origins.iter().filter(|origin| OUTPUTS.contains(&origin.quantity)) {
            let position = origin.quantity == Quantity::Angle;
            let scaled = position && matches!(origin.formula, Formula::Scaled { .. });
            let turn = scaled.then(|| std::f64::consts::TAU / origin.factor().abs());
            for index in origin.formula.indices() {
                if let Some(column) = self.cells.columns.get_mut(*index) {
                    let name = &self.cells.header[*index];
                    notes.extend(folded::unfold(&mut column.values, name, turn, position));
                }
            }
        }
        notes
    }

    /// Which run each row belongs to: by the column `run`, else by the headers in the middle of the file.
    fn ids(&mut self, rows: usize) -> Result<Vec<f64>, InputError> {
        let starts = std::mem::take(&mut self.cells.restarts);
        let first = starts.partition_point(|start| *start == 0);
        let part = |row: usize| (starts.partition_point(|start| *start <= row) - first) as f64;
        Ok(self.column(Quantity::Run)?.unwrap_or_else(|| (0..rows).map(part).collect()))
    }

    /// A run of the file keeps its number in all of its parts.
    fn begin_anew(&self, id: &mut [f64], restarts: &[usize]) {
        let step = if self.has(Quantity::Run) { 1.0 / (1.0 + restarts.len() as f64) } else { 1.0 };
        for start in restarts {
            id[*start..].iter_mut().for_each(|id| *id += step);
        }
    }

    fn check_crop(&self, t_s: &[f64], rows: &[usize]) -> Result<(), InputError> {
        if !rows.is_empty() {
            return Ok(());
        }
        let (first, last) =
            t_s.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |ends, t| (ends.0.min(*t), ends.1.max(*t)));
        let what = format!("has no rows between --from and --to; it goes from {first} s to {last} s");
        Err(InputError::file(self.source, what))
    }

    /// Rows with holes are bridged while they are few.
    pub(super) fn check_share(&self, holes: &[usize], lines: &[usize]) -> Result<(), InputError> {
        let rows = lines.len();
        let Some(first) = holes.first().filter(|_| holes.len() as f64 > bridging::MOST * rows as f64) else {
            return Ok(());
        };
        let first = &lines[*first];
        let indices = self.plan.origins.iter().flat_map(|origin| origin.formula.indices());
        let hole = |index: &usize| {
            let hole = self.cells.columns.get(*index)?.hole.as_ref()?;
            (hole.0 == *first).then_some((*index, &hole.1))
        };
        let (index, cell) = indices.filter_map(hole).next().map_or((0, ""), |known| (known.0, known.1));
        let what = format!(
            "column {}: `{cell}` is not a finite number, and {} of {rows} rows have such cells; up to {:.0} % are bridged: fill or \
             remove them, or leave a column out with --columns \"NAME=none\"",
            self.cells.header[index],
            holes.len(),
            100.0 * bridging::MOST
        );
        Err(self.wrong(*first, what))
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
            (Some(a), Some(b)) if a != b => {
                let what =
                    "position and speed belong to different axes (rad and m); map one of them with --columns";
                Err(InputError::at(self.source, Place { number: 1, ..self.cells.head }, what))
            }
            (a, b) => Ok(a.or(b) == Some(true)),
        }
    }

    fn bridge(&self, values: Option<Vec<f64>>, rows: usize) -> Result<Vec<Bridge>, InputError> {
        let Some(values) = values else { return Ok(vec![Bridge::Driven; rows]) };
        let code = |(row, value): (usize, &f64)| match *value {
            0.0 => Ok(Bridge::Open),
            1.0 => Ok(Bridge::Driven),
            2.0 => Ok(Bridge::Shorted),
            // Such a row is left out.
            value if value.is_nan() => Ok(Bridge::Driven),
            _ => Err(self
                .wrong(row, format!("column bridge: {value} is none of 0 (open), 1 (driven), 2 (shorted)"))),
        };
        values.iter().enumerate().map(code).collect()
    }

    /// Cuts the rows where the run number changes or a row is left out. `at`: which rows of the file they are.
    fn pieces(&self, lines: &[usize], id: &[f64], bridged: &Bridged) -> Result<Vec<Piece>, InputError> {
        let (mut pieces, mut shortest, mut start) = (Vec::new(), None, 0);
        for end in 1..=lines.len() {
            if end < lines.len() && id[end] == id[end - 1] && bridged.kept[end] == bridged.kept[end - 1] {
                continue;
            }
            if bridged.kept[start] && end - start >= FEWEST_ROWS {
                pieces.push((start..end, id[start] as i64));
            } else if bridged.kept[start] && shortest.is_none() {
                shortest = Some((start, end));
            }
            start = end;
        }
        match shortest {
            // What is left between two holes may be short; a run of the file may not.
            Some((start, end)) if bridged.removed == 0 || pieces.is_empty() => {
                let (id, rows) = (id[start], end - start);
                let what = format!("run {id} has {rows} rows; at least {FEWEST_ROWS} are needed");
                Err(self.wrong(lines[start], what))
            }
            _ => Ok(pieces),
        }
    }
}

/// A time since 1970 or since the start of a computer, s, counts from the first row. Chosen by judgement; not
/// studied.
const LONG_AGO_S: f64 = 1e7;

fn from_its_beginning(time: &mut [f64]) {
    let first = time.iter().copied().find(|time| time.is_finite()).unwrap_or(0.0);
    if first.abs() > LONG_AGO_S {
        time.iter_mut().for_each(|time| *time -= first);
    }
}
