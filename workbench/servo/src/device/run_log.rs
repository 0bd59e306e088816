//! What the firmware saw and did, every control tick: in memory, and as a log in format 1 with all that a bit-exact
//! replay needs (raw integers as columns; commands and results of commissionings as comment lines).
//!
//! | further column | meaning |
//! |---|---|
//! | `command_raw` | duty that acts from this row to the next, PWM counts (as `u_v`, after the PWM's delay) |
//! | `reference_rad`, `speed_estimate_rad_s` | the firmware's set-point and speed estimate |
//! | `activity`, `phase`, `limit`, `fault`, `referenced` | codes of the record (`servo::record`, `servo::commission::Phase`, `servo::motion::referencing`) |
//! | `motor_flags` | flags of the motor program; absent if it has set none |
//! | `digest` | CRC-32 of the whole record: one wrong bit anywhere shows |

use servo::axis::{Bridge, Sample};
use servo::commission::Outcome;
use servo::config::Config;
use servo::link::protocol::Command;
use servo::protect::Fault;
use servo::record::{Record, Referenced, ahead_q8};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::str::FromStr;
use truing_core::text::input_error::InputError;

/// One control tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Number since power-up.
    pub tick: u32,
    /// Cost of the tick in counts of the board's clock. Not in the file: it is no function of the input.
    pub cost: u32,
    /// What the motor program wants to have logged, as known at the start of the tick; the firmware never sees it.
    pub motor_flags: u32,
    /// Everything else.
    pub record: Record,
}

/// A whole session.
#[derive(Clone, Debug, PartialEq)]
pub struct RunLog {
    /// What the axis was told to be.
    pub config: Config,
    /// In the order of time.
    pub rows: Vec<Row>,
    /// Accepted commands with the tick at whose start they acted.
    pub commands: Vec<(u32, Command)>,
    /// Ends of commissionings.
    pub outcomes: Vec<(u32, Outcome)>,
    /// First ticks of the parts that the column `run` numbers.
    pub run_starts: Vec<u32>,
}

/// What a replay needs of one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trace {
    /// Number since power-up.
    pub tick: u32,
    /// What the board read.
    pub sample: Sample,
    /// State of the bridge that acted.
    pub bridge: Bridge,
    /// Duty that acted.
    pub duty: i16,
    /// The latched fault.
    pub fault: Fault,
    /// What was known about zero; a log of an earlier version does not tell.
    pub referenced: Referenced,
    /// [`digest`] of the record.
    pub digest: u32,
}

/// A session as a replay needs it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tape {
    /// Every tick.
    pub traces: Vec<Trace>,
    /// Accepted commands.
    pub commands: Vec<(u32, Command)>,
    /// Ends of commissionings.
    pub outcomes: Vec<(u32, Outcome)>,
}

/// A set-point that is told modulo 2²⁴ counts, beside the count: counts from power-up.
pub fn reference(reference_q8: i32, count: i32, zero: i32) -> f64 {
    f64::from(count.wrapping_sub(zero)) + f64::from(ahead_q8(reference_q8, count, zero)) / 256.0
}

/// CRC-32 of a record as it travels.
pub fn digest(record: &Record) -> u32 {
    const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut buffer = [0; 256];
    postcard::to_slice(record, &mut buffer).map_or(0, |bytes| CHECKSUM.checksum(bytes))
}

impl RunLog {
    /// An empty one.
    pub fn new(config: Config) -> Self {
        Self { config, rows: Vec::new(), commands: Vec::new(), outcomes: Vec::new(), run_starts: Vec::new() }
    }

    /// For the replay.
    pub fn tape(&self) -> Tape {
        let trace = |row: &Row| Trace {
            tick: row.tick,
            sample: Sample {
                count: row.record.count,
                vbus_raw: row.record.vbus_raw,
                current_raw: row.record.current_raw,
            },
            bridge: row.record.bridge,
            duty: row.record.duty,
            fault: row.record.fault,
            referenced: row.record.referenced,
            digest: digest(&row.record),
        };
        Tape {
            traces: self.rows.iter().map(trace).collect(),
            commands: self.commands.clone(),
            outcomes: self.outcomes.clone(),
        }
    }

    /// Encoder count at power-up.
    pub fn zero(&self) -> i32 {
        self.rows.first().map_or(0, |row| row.record.count)
    }

    /// Set-point of a record, counts from power-up.
    pub fn reference(&self, record: &Record) -> f64 {
        reference(record.reference_q8, record.count, self.zero())
    }

    /// The fault that ended the last motion: what is latched behind it is another one's consequence.
    pub fn fault(&self) -> Fault {
        let first = self.ended().and_then(|(_, after)| after.first());
        first.map_or(Fault::None, |row| row.record.fault)
    }

    /// The rows of the last motion until a fault was latched, and those from there on; `None`: none was.
    pub fn ended(&self) -> Option<(&[Row], &[Row])> {
        let armed = self.commands.iter().rev().find(|(_, command)| matches!(command, Command::Arm));
        let rows =
            &self.rows[armed.map_or(0, |(tick, _)| self.rows.partition_point(|row| row.tick < *tick))..];
        let at = rows.iter().position(|row| row.record.fault != Fault::None)?;
        Some(rows.split_at(at))
    }

    /// The supply as it was measured last, V.
    pub fn last_supply_v(&self) -> Option<f32> {
        let raw = self.rows.last()?.record.vbus_raw;
        (raw != Sample::VBUS_NOT_MEASURED).then(|| f32::from(raw) * self.config.vbus_v_per_lsb)
    }

    /// The supply in a record, the nominal one where none was measured, V.
    pub fn supply_v(&self, record: &Record) -> f64 {
        match record.vbus_raw {
            Sample::VBUS_NOT_MEASURED => f64::from(self.config.supply_nominal_v),
            raw => f64::from(raw) * f64::from(self.config.vbus_v_per_lsb),
        }
    }

    /// Counts per tick, Q20 → rad/s.
    pub fn rad_s(&self, speed_q20: i32) -> f64 {
        self.rad(f64::from(speed_q20) / f64::from(1 << 20)) * f64::from(self.config.tick_hz)
    }

    /// Counts → rad at the controlled shaft.
    pub fn rad(&self, counts: f64) -> f64 {
        counts * TAU / f64::from(self.config.counts_per_rev)
    }

    /// Writes the file; through a neighbour, so that an earlier file stays whole if anything fails.
    pub fn save(&self, path: &Path) -> anyhow::Result<()> {
        truing_report::report::write_atomically(path, &self.to_csv())
    }

    /// The whole log as text.
    pub fn to_csv(&self) -> String {
        let mut text = String::with_capacity(96 * self.rows.len());
        let sensed = Sensed::of(&self.rows);
        let mut commands = self.commands.iter().peekable();
        let mut outcomes = self.outcomes.iter().peekable();
        text.push_str("# truing-run/1: every control tick of the firmware; units in the names; _raw: the chip's own integers\n");
        text.push_str(&sensed.header());
        for row in &self.rows {
            while let Some((tick, command)) = commands.next_if(|(tick, _)| *tick <= row.tick) {
                comment(&mut text, "command", *tick, command);
            }
            self.line(&mut text, row, &sensed);
            while let Some((tick, outcome)) = outcomes.next_if(|(tick, _)| *tick <= row.tick) {
                comment(&mut text, "outcome", *tick, outcome);
            }
        }
        text
    }

    fn line(&self, text: &mut String, row: &Row, sensed: &Sensed) {
        let (config, record) = (&self.config, &row.record);
        let supply = self.supply_v(record);
        let share = match record.bridge {
            Bridge::Driven => f64::from(record.duty) / f64::from(config.pwm_full_scale),
            _ => 0.0,
        };
        let time = f64::from(row.tick) / f64::from(config.tick_hz);
        let theta = self.rad(f64::from(record.count));
        let _ = write!(text, "{time:.7},{:.6},{},{theta:.7},", share * supply, record.bridge as u8);
        if sensed.current {
            let _ =
                write!(text, "{:.5},", f64::from(record.current_raw) * f64::from(config.current_a_per_lsb));
        }
        if sensed.supply {
            let _ = write!(text, "{supply:.5},");
        }
        let reference = self.rad(self.reference(record));
        let speed = self.rad_s(record.speed_q20);
        let _ = writeln!(
            text,
            "{},{},{},{},{},{reference:.7},{speed:.5},{},{},{},{},{},{}{}",
            record.count,
            record.vbus_raw,
            record.current_raw,
            record.duty,
            self.run(row.tick),
            record.activity as u8,
            record.phase,
            record.limit as u8,
            record.fault as u8,
            digest(record),
            record.referenced as u8,
            if sensed.flags { format!(",{}", row.motor_flags) } else { String::new() },
        );
    }

    fn run(&self, tick: u32) -> usize {
        self.run_starts.iter().filter(|start| **start <= tick).count()
    }
}

/// Which sensors the motor has.
struct Sensed {
    current: bool,
    supply: bool,
    flags: bool,
}

impl Sensed {
    fn of(rows: &[Row]) -> Self {
        let every = |has: fn(&Record) -> bool| !rows.is_empty() && rows.iter().all(|row| has(&row.record));
        Self {
            current: every(|record| Sample::sensed(record.current_raw).is_some()),
            supply: every(|record| record.vbus_raw != Sample::VBUS_NOT_MEASURED),
            flags: rows.iter().any(|row| row.motor_flags != 0),
        }
    }

    fn header(&self) -> String {
        let current = if self.current { "i_a," } else { "" };
        let supply = if self.supply { "vbus_v," } else { "" };
        let flags = if self.flags { ",motor_flags" } else { "" };
        format!(
            "t_s,u_v,bridge,theta_rad,{current}{supply}count,vbus_raw,current_raw,command_raw,run,\
             reference_rad,speed_estimate_rad_s,activity,phase,limit,fault,digest,referenced{flags}\n"
        )
    }
}

fn comment(text: &mut String, kind: &str, tick: u32, content: &impl serde::Serialize) {
    if let Ok(json) = serde_json::to_string(content) {
        let _ = writeln!(text, "# {kind} {tick} {json}");
    }
}

impl Tape {
    /// Reads a log that [`RunLog::save`] has written.
    pub fn read(path: &Path, config: &Config) -> Result<Self, InputError> {
        Self::parse(&path.display().to_string(), &truing_files::text(path)?, config)
    }

    /// Reads a text; `source` names it in messages.
    pub fn parse(source: &str, text: &str, config: &Config) -> Result<Self, InputError> {
        let mut tape = Tape::default();
        let mut columns = None;
        for (number, line) in (1..).zip(text.lines()) {
            match (line.strip_prefix('#'), &columns) {
                (Some(comment), _) => tape.comment(source, number, comment)?,
                (None, None) => columns = Some(Columns::locate(source, line)?),
                (None, Some(columns)) => tape.traces.push(columns.trace(source, number, line, config)?),
            }
        }
        if tape.traces.is_empty() || tape.commands.is_empty() {
            let what =
                "holds no ticks or no commands to replay; use a log that `truing track --log` has written";
            return Err(InputError::file(source, what));
        }
        Ok(tape)
    }

    fn comment(&mut self, source: &str, number: u64, comment: &str) -> Result<(), InputError> {
        let mut parts = comment.trim().splitn(3, ' ');
        let (kind, tick, json) = (parts.next(), parts.next(), parts.next());
        let (Some(kind @ ("command" | "outcome")), Some(tick), Some(json)) = (kind, tick, json) else {
            return Ok(());
        };
        let broken =
            || InputError::line(source, number, "this comment is not as it was written; make the log anew");
        let tick = tick.parse().map_err(|_| broken())?;
        match kind {
            "command" => self.commands.push((tick, serde_json::from_str(json).map_err(|_| broken())?)),
            _ => self.outcomes.push((tick, serde_json::from_str(json).map_err(|_| broken())?)),
        }
        Ok(())
    }
}

/// Places of the columns that a replay reads.
struct Columns([usize; 8], Option<usize>);

const NAMES: [&str; 8] =
    ["t_s", "count", "vbus_raw", "current_raw", "bridge", "command_raw", "digest", "fault"];

impl Columns {
    fn locate(source: &str, header: &str) -> Result<Self, InputError> {
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        let mut places = [0; 8];
        for (place, name) in places.iter_mut().zip(NAMES) {
            *place = names.iter().position(|other| *other == name).ok_or_else(|| {
                let what = format!(
                    "lacks the column {name}; a replay needs a log that `truing track --log` has written"
                );
                InputError::file(source, what)
            })?;
        }
        Ok(Self(places, names.iter().position(|name| *name == "referenced")))
    }

    fn trace(&self, source: &str, number: u64, line: &str, config: &Config) -> Result<Trace, InputError> {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let fault: usize = self.cell(source, number, &cells, 7)?;
        let bridge = match self.cell::<u8>(source, number, &cells, 4)? {
            0 => Bridge::Open,
            1 => Bridge::Driven,
            _ => Bridge::Shorted,
        };
        Ok(Trace {
            tick: (self.cell::<f64>(source, number, &cells, 0)? * f64::from(config.tick_hz)).round() as u32,
            sample: Sample {
                count: self.cell(source, number, &cells, 1)?,
                vbus_raw: self.cell(source, number, &cells, 2)?,
                current_raw: self.cell(source, number, &cells, 3)?,
            },
            bridge,
            duty: self.cell(source, number, &cells, 5)?,
            // Numbers count from 1; 0 and what this version does not know are none.
            fault: fault.checked_sub(1).and_then(|place| Fault::ALL.get(place).copied()).unwrap_or_default(),
            referenced: match self.1.and_then(|place| cells.get(place).copied()) {
                Some("1") => Referenced::Searching,
                Some("2") => Referenced::Yes,
                Some("3") => Referenced::Missed,
                _ => Referenced::No,
            },
            digest: self.cell(source, number, &cells, 6)?,
        })
    }

    /// The number of a row in the column that is `column`th of [`NAMES`].
    fn cell<T: FromStr>(
        &self,
        source: &str,
        line: u64,
        cells: &[&str],
        column: usize,
    ) -> Result<T, InputError> {
        cells.get(self.0[column]).and_then(|cell| cell.parse().ok()).ok_or_else(|| {
            let name = NAMES[column];
            let what = format!("column {name} is not the number it was written as; make the log anew");
            InputError::line(source, line, what)
        })
    }
}
