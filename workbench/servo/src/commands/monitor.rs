//! `truing monitor`: a live view of the servo in the terminal while it commissions and tracks.

use super::commission::{self, Motion};
use super::firmware::fault_ended;
use crate::device::board;
use crate::device::link::{advisory_text, fault_advice};
use crate::device::run_log::RunLog;
use crate::device::session::{Done, Progress, Task};
use clap::Args;
use servo::axis::Sample;
use servo::identify::estimate::{EstimatesReport, Reported};
use servo::protect::Fault;
use servo::record::{Activity, Record, Referenced};
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use truing_report::console::{interrupt, screen};

/// How often the view is drawn.
const REFRESH: Duration = Duration::from_millis(100);
/// Columns of a narrow terminal.
const WIDTH: usize = 78;
/// Time between two lines where there is no terminal to redraw.
const LINE: Duration = Duration::from_secs(1);

/// Arguments of `truing monitor`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo, and what is known about its motor.
    #[command(flatten)]
    pub motion: Motion,
    /// The motion, as in `truing track`.
    #[arg(long, required_unless_present = "board")]
    pub profile: Option<String>,
    /// Print how the board is, and move nothing: its name, scales, clock, gate drivers and zeros of the current.
    #[arg(long, conflicts_with = "profile")]
    pub board: bool,
    /// As in `truing track`.
    #[arg(long, requires = "reference")]
    pub check: bool,
    /// Do not slow a simulated motor down to real time.
    #[arg(long)]
    pub fast: bool,
}

/// Runs and shows.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let _hold = interrupt::hold();
    let Motion { firmware, knowledge } = &arguments.motion;
    if arguments.board {
        firmware.files().check()?;
        let mut client = firmware.client(&firmware.axis_file.read()?.config)?;
        out!("{}", board::text(&client.hello()?));
        return Ok(());
    }
    let text = arguments.profile.as_deref().unwrap_or_default();
    arguments.motion.files(text).check_ready()?;
    let (setup, first, motion) = arguments.motion.follows(text)?;
    // The mark of `--reference`, once more.
    let again = knowledge.reference.filter(|_| arguments.check).map(Task::Reference);
    let tasks: Vec<Task> = first.into_iter().chain([motion]).chain(again).collect();
    let mut view = View::new(arguments.fast);
    let result = firmware.run_with(&setup, &tasks, &mut |progress| view.show(&progress))?;
    let result = result.complete()?;
    match result.done.last() {
        Some(Done::Tracked(span) | Done::Excited(span, _)) if span.faulted => {
            Err(fault_ended(&result.log).into())
        }
        Some(Done::Commissioned(_)) => commission::succeeded(&result).map(|_| ()),
        _ => knowledge.lost_counts(&result),
    }
}

/// The screen.
struct View {
    /// When the first row came, and the servo's own time in it.
    begin: Option<(Instant, Duration)>,
    drawn: Option<Instant>,
    lines: usize,
    terminal: bool,
    fast: bool,
}

impl View {
    fn new(fast: bool) -> Self {
        Self { begin: None, drawn: None, lines: 0, terminal: std::io::stdout().is_terminal(), fast }
    }

    fn show(&mut self, progress: &Progress) {
        let Some(row) = progress.log.rows.last() else {
            return;
        };
        if !self.fast {
            let seconds = f64::from(row.tick) / f64::from(progress.log.config.tick_hz);
            self.pace(Duration::from_secs_f64(seconds));
        }
        let wait = if self.terminal { REFRESH } else { LINE };
        if self.drawn.is_some_and(|drawn| drawn.elapsed() < wait) {
            return;
        }
        self.drawn = Some(Instant::now());
        let lines = lines(progress);
        if screen::is_broken() {
            // Nobody watches any more.
            interrupt::ask();
        }
        if !self.terminal {
            outln!("{}", lines.join("  |  "));
            return;
        }
        // A picture that is wider or higher than the terminal would scroll.
        let (rows, columns) = screen::size().unwrap_or((usize::MAX, WIDTH));
        let options = textwrap::Options::new(columns).subsequent_indent("      ");
        let lines: Vec<_> = lines.iter().flat_map(|line| textwrap::wrap(line, &options)).collect();
        let lines = &lines[..lines.len().min(rows.saturating_sub(1))];
        // Back to the first line of the last picture, and clear what is below.
        let up = match self.lines {
            0 => String::new(),
            lines => format!("\x1b[{lines}A\x1b[J"),
        };
        outln!("{up}{}", lines.join("\n"));
        screen::flush();
        self.lines = lines.len();
    }

    /// Slows a simulated motor down to real time. Time counts from the first row, because a servo on a line may have been
    /// switched on long before.
    fn pace(&mut self, servo_time: Duration) {
        let (begin, first) = *self.begin.get_or_insert((Instant::now(), servo_time));
        std::thread::sleep(servo_time.saturating_sub(first).saturating_sub(begin.elapsed()));
    }
}

/// What there is to see, one subject a line.
fn lines(progress: &Progress) -> Vec<String> {
    let log = progress.log;
    let Some(row) = log.rows.last() else {
        return Vec::new();
    };
    let record = &row.record;
    let (seconds, share) = (f64::from(row.tick) / f64::from(log.config.tick_hz), 100.0 * progress.share);
    let mut lines = vec![
        format!("{seconds:8.2} s   {} ({share:.0} %)   bridge {}", progress.task, word(record.bridge)),
        motion(log, record),
        drive(log, record),
        format!(
            "limit {}   position {}   gain {}   dead zone {}, {}",
            word(record.limit),
            match record.referenced {
                Referenced::Yes => "absolute",
                Referenced::Searching => "searching for zero",
                Referenced::No | Referenced::Missed => "from power-up",
            },
            word(record.gain_source),
            word(record.dead_zone_source[0]),
            word(record.dead_zone_source[1])
        ),
    ];
    let fault = match record.fault {
        Fault::None => "none".to_owned(),
        other => fault_advice(other),
    };
    lines.push(format!("fault {fault}"));
    lines.extend(advisory_text(record.advisory).iter().map(|text| (*text).to_owned()));
    match progress.estimates {
        Some(report) => lines.extend(estimates(report)),
        None => lines.push("estimates: none yet".to_owned()),
    }
    lines
}

/// The variant's name in small letters.
fn word(code: impl std::fmt::Debug) -> String {
    format!("{code:?}").to_lowercase()
}

/// Where it is to be and where it is. While no loop is closed there is no set-point.
fn motion(log: &RunLog, record: &Record) -> String {
    let position = log.rad(f64::from(record.count.wrapping_sub(log.zero())) + 0.5);
    match record.activity {
        Activity::Tracking | Activity::Holding => {
            let set_point = log.rad(log.reference(record));
            let error = set_point - position;
            format!("set-point {set_point:9.4} rad   position {position:9.4} rad   error {error:8.4} rad")
        }
        _ => format!("set-point         - rad   position {position:9.4} rad"),
    }
}

fn drive(log: &RunLog, record: &Record) -> String {
    let config = &log.config;
    let (speed, supply) = (log.rad_s(record.speed_q20), log.supply_v(record));
    let volts = f64::from(record.duty) / f64::from(config.pwm_full_scale) * supply;
    let current = match Sample::sensed(record.current_raw) {
        None => String::new(),
        Some(raw) => format!("   current {:7.3} A", f64::from(raw) * f64::from(config.current_a_per_lsb)),
    };
    format!("speed {speed:9.3} rad/s   voltage {volts:7.3} V of {supply:.2} V{current}")
}

/// Both directions of a number in one line.
fn estimates(report: &EstimatesReport) -> [String; 3] {
    let (gain, time) = (number(&report.gain_rad_s_per_v, "rad/s/V"), number(&report.time_constant_s, "s"));
    let pair = |name: &str, [positive, negative]: [&Reported; 2]| {
        format!("{name:12} + {}   \u{2212} {}", number(positive, "V"), number(negative, "V"))
    };
    [
        pair("dead zone", [&report.dead_zone_pos_v, &report.dead_zone_neg_v]),
        pair("saturation", [&report.saturation_pos_v, &report.saturation_neg_v]),
        format!("{:12}   {gain}   time constant {time}", "gain"),
    ]
}

fn number(reported: &Reported, unit: &str) -> String {
    match (reported.value, reported.trusted) {
        (Some(value), true) => format!("{value:.4} {unit}"),
        (Some(value), false) => format!("{value:.4} {unit} (not trusted)"),
        (None, _) => "not seen".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_servo_that_was_switched_on_an_hour_ago_is_shown_at_once() {
        let (mut view, begin) = (View::new(false), Instant::now());
        view.pace(Duration::from_secs(3600));
        assert!(begin.elapsed() < Duration::from_secs(60));
        view.pace(Duration::from_millis(3_600_020));
        assert!(begin.elapsed() >= Duration::from_millis(20));
    }
}
