//! `truing monitor`: a live view of the servo in the terminal while it commissions and tracks.

use super::commission::{BUDGET_S, Knowledge};
use super::firmware::Firmware;
use super::track::profile;
use crate::commission_report::CommissionJson;
use crate::session::{Progress, Task};
use clap::Args;
use servo::axis::Sample;
use servo::protect::Fault;
use servo::record::Limit;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// How often the view is drawn.
const REFRESH: Duration = Duration::from_millis(100);
/// … where there is no terminal to redraw.
const LINE: Duration = Duration::from_secs(1);

/// Arguments of `truing monitor`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// What is known about the motor.
    #[command(flatten)]
    pub knowledge: Knowledge,
    /// The motion, as in `truing track`.
    #[arg(long)]
    pub profile: String,
    /// Do not slow a simulated motor down to real time.
    #[arg(long)]
    pub fast: bool,
}

/// Runs and shows.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let config = arguments.firmware.axis()?;
    let first = arguments
        .knowledge
        .task(BUDGET_S, arguments.firmware.seed, &config)?;
    let track = Task::Track {
        profile: profile(&arguments.profile)?,
        compensation: true,
    };
    let tasks: Vec<Task> = first.into_iter().chain([track]).collect();
    let mut view = View::new(arguments.fast);
    arguments
        .firmware
        .run_with(config, &tasks, &mut |progress| view.show(&progress))?;
    Ok(())
}

/// The screen.
struct View {
    begin: Instant,
    drawn: Option<Instant>,
    lines: usize,
    terminal: bool,
    fast: bool,
}

impl View {
    fn new(fast: bool) -> Self {
        Self {
            begin: Instant::now(),
            drawn: None,
            lines: 0,
            terminal: std::io::stdout().is_terminal(),
            fast,
        }
    }

    fn show(&mut self, progress: &Progress) {
        let Some(row) = progress.log.rows.last() else {
            return;
        };
        let simulated = Duration::from_secs_f64(f64::from(row.tick) / f64::from(progress.log.config.tick_hz));
        if !self.fast {
            std::thread::sleep(simulated.saturating_sub(self.begin.elapsed()));
        }
        let wait = if self.terminal { REFRESH } else { LINE };
        if self.drawn.is_some_and(|drawn| drawn.elapsed() < wait) {
            return;
        }
        self.drawn = Some(Instant::now());
        let lines = lines(progress);
        if !self.terminal {
            println!("{}", lines.join("  |  "));
            return;
        }
        let up = if self.lines > 0 {
            format!("\x1b[{}A", self.lines)
        } else {
            String::new()
        };
        let body: String = lines.iter().map(|line| format!("\x1b[2K{line}\n")).collect();
        print!("{up}{body}");
        let _ = std::io::stdout().flush();
        self.lines = lines.len();
    }
}

/// What there is to see, one line a subject; always the same number of lines.
fn lines(progress: &Progress) -> Vec<String> {
    let log = progress.log;
    let Some(row) = log.rows.last() else {
        return Vec::new();
    };
    let (config, record) = (&log.config, &row.record);
    let time = f64::from(row.tick) / f64::from(config.tick_hz);
    let set_point = log.rad(f64::from(record.reference_q8) / 256.0);
    let position = log.rad(f64::from(record.count.wrapping_sub(log.zero())) + 0.5);
    let speed = log.rad(f64::from(record.speed_q20) / f64::from(1 << 20)) * f64::from(config.tick_hz);
    let supply = match record.vbus_raw {
        Sample::VBUS_NOT_MEASURED => f64::from(config.supply_nominal_v),
        raw => f64::from(raw) * f64::from(config.vbus_v_per_lsb),
    };
    let volts = f64::from(record.duty) / f64::from(config.pwm_full_scale) * supply;
    let limit = match record.limit {
        Limit::None => "none".to_owned(),
        other => format!("{other:?}").to_lowercase(),
    };
    let fault = match record.fault {
        Fault::None => "none".to_owned(),
        other => crate::servo_link::fault_advice(other),
    };
    let mut lines = vec![
        format!(
            "{time:8.2} s   {} ({:.0} %)   bridge {:?}",
            progress.task,
            100.0 * progress.share,
            record.bridge
        ),
        format!(
            "set-point {set_point:9.4} rad   position {position:9.4} rad   error {:9.4} rad",
            set_point - position
        ),
        format!("speed {speed:9.3} rad/s   voltage {volts:7.3} V of {supply:.2} V"),
        format!(
            "limit {limit}   fault {fault}   gain {:?}   dead zone {:?}   advisory {}",
            record.gain_source,
            record.dead_zone_source,
            crate::servo_link::advisory_text(record.advisory).unwrap_or("none")
        ),
    ];
    let report = log
        .outcomes
        .last()
        .and_then(|(_, outcome)| CommissionJson::new(outcome, config).ok());
    lines.push(match report {
        Some(report) => report
            .numbers()
            .iter()
            .map(estimate)
            .collect::<Vec<_>>()
            .join("   "),
        None => "estimates: none yet".to_owned(),
    });
    lines
}

fn estimate((name, unit, number): &(&str, &str, crate::commission_report::Number)) -> String {
    match number.value {
        Some(value) => format!(
            "{name} {value:.3} {unit}{}",
            if number.trusted { "" } else { " (not trusted)" }
        ),
        None => format!("{name} -"),
    }
}
