//! Tasks that move the shaft, with or without a capture.

use super::kept::Kept;
use super::{
    Arrival, Captured, Done, LONGEST_REST_S, Listener, PAUSE_S, Performed, Profile, STILL_S, Session, Span,
    Target,
};
use crate::device::feasible::Ability;
use crate::device::waypoints::{self, Waypoint};
use servo::link::protocol::Command;
use servo::motion::excitation::Waveform;
use servo::motion::stream::Point;
use servo::record::{Activity, Advisory};
use std::f32::consts::TAU;
use truing_core::text::input_error::InputError;

/// After a motion the axis holds for so long, s; chatter is counted here.
pub const HOLD_S: f64 = 1.0;
/// The shortest stretch of the log that counts as a run, s.
const LEAST_RUN_S: f64 = 0.1;
/// Nor does a move.
const LONGEST_MOVE_S: f64 = 600.0;
/// A piece of a capture has arrived after so long, s.
const READ_S: f64 = 0.001;
/// Points of a stream are at least so far apart: in lock-step a command takes a few ticks, on a line some milliseconds.
const SPACING_TICKS: u32 = 8;
const SPACING_S: f64 = 0.010;

impl Session {
    pub(super) fn track(
        &mut self,
        profile: &Profile,
        compensation: bool,
        progress: &mut Listener,
    ) -> Performed {
        let profile = &self.feasible(profile)?;
        self.command(Command::Compensation(compensation))?;
        self.command(Command::Arm)?;
        self.come_to_rest(progress)?;
        let captures = self.arm_capture()?;
        self.begin_run();
        let start = match profile {
            Profile::Sine { amplitude_rad, frequency_hz, seconds } => self.command(Command::TrackSine {
                amplitude_rad: *amplitude_rad,
                frequency_hz: *frequency_hz,
                duration_ms: (seconds * 1000.0).round() as u32,
            })?,
            Profile::Step { amplitude_rad, .. } => {
                self.command(Command::Position(self.here() + amplitude_rad))?
            }
            Profile::Points(points) => self.follow(points, progress)?,
        };
        let hold = start + self.ticks(profile.seconds());
        let end = hold + self.ticks(HOLD_S);
        let faulted = |kept: &Kept| kept.activity() == Activity::Faulted;
        let reached = self.run_to(end, faulted, "tracking", progress)?;
        let faulted = self.stop_motion(captures)?;
        Ok(Done::Tracked(Span { start, hold: hold.min(reached), end: reached, faulted }))
    }

    /// The profile, or the one that is left of it for [`super::Task::Fit`]; an error if the motor cannot do it.
    fn feasible(&mut self, profile: &Profile) -> Result<Profile, InputError> {
        let known = self.kept.borrow().known;
        let ability = Ability::of(&self.config(), &known);
        let Some(short) = ability.and_then(|ability| ability.shortfall(profile)) else {
            return Ok(profile.clone());
        };
        if !self.fit {
            return Err(InputError(short.to_string()));
        }
        self.fitted = Some(short);
        Ok(short.fit(profile))
    }

    /// The servo opens the bridge by itself; the shaft is watched while it coasts.
    pub(super) fn excite(&mut self, waveform: &Waveform, progress: &mut Listener) -> Performed {
        self.command(Command::Arm)?;
        let captures = self.arm_capture()?;
        self.begin_run();
        let start = self.command(Command::Excite(*waveform))?;
        let end = start + self.ticks(f64::from(waveform.duration_ms) / 1000.0);
        let over = |kept: &Kept| kept.now() > start && kept.activity() != Activity::Driving;
        let reached = self.run_to(end, over, "excitation", progress)?;
        let faulted = self.stop_motion(captures)?;
        self.command(Command::Parameters)?;
        let mute = || InputError("the servo does not tell what it knows; update its firmware".into());
        let learned = self.kept.borrow().estimates.ok_or_else(mute)?;
        Ok(Done::Excited(Span { start, hold: reached, end: reached, faulted }, Box::new(learned)))
    }

    pub(super) fn go(&mut self, target: Target, progress: &mut Listener) -> Performed {
        self.command(Command::Arm)?;
        self.come_to_rest(progress)?;
        self.begin_run();
        let start = self.command(match target {
            Target::To(rad) => Command::GoTo(rad),
            Target::By(rad) => Command::Position(self.here() + rad),
        })?;
        // The records of the standstill before are none of the arrival.
        let first = start + self.ticks(STILL_S);
        self.run_to(first, |_| false, "moving", progress)?;
        let still = self.standstill();
        let faulted = |kept: &Kept| kept.activity() == Activity::Faulted;
        let over = |kept: &Kept| faulted(kept) || kept.activity() == Activity::Holding && kept.stands(still);
        let arrived = self.run_to(start + self.ticks(LONGEST_MOVE_S), over, "moving", progress)?;
        self.run_to(arrived + self.ticks(HOLD_S), faulted, "holding", progress)?;
        let arrival = Arrival {
            seconds: f64::from(arrived - start) / f64::from(self.config().tick_hz) - STILL_S,
            error_rad: self.off_target(),
            held: self.kept.borrow().activity() == Activity::Holding,
        };
        self.command(Command::Stop)?;
        self.pause(PAUSE_S)?;
        Ok(Done::Moved(arrival))
    }

    /// Streams the points as far ahead of their time as the servo has room; returns the tick in which the first one
    /// counts. A fault, or a stream that runs dry, ends it early.
    fn follow(&mut self, points: &[Waypoint], progress: &mut Listener) -> Result<u32, InputError> {
        let spacing = match self.every {
            0 | 1 => SPACING_TICKS,
            // On a real line.
            _ => self.ticks(SPACING_S).max(SPACING_TICKS),
        };
        let knots = waypoints::knots(points, self.config().tick_hz, spacing);
        // Where it holds, to a part of a count: a counter that reads n stands for n + ½.
        let half = 0.5 * TAU / self.config().counts_per_rev as f32;
        let holds = self.kept.borrow().activity() == Activity::Holding;
        let centre = self.here() - if holds { self.off_target() + half } else { 0.0 };
        if let Some(first) = knots.first().filter(|first| first.theta_rad != 0.0) {
            self.command(Command::Position(centre + first.theta_rad as f32))?;
            let end = self.kept.borrow().now() + self.ticks(LONGEST_REST_S);
            let begun = self.kept.borrow().now() + self.ticks(STILL_S);
            let arrived = |kept: &Kept| kept.now() > begun && kept.activity() != Activity::Tracking;
            self.run_to(end, arrived, "settling", progress)?;
        }
        let over = |kept: &Kept| {
            let last = kept.log.rows.last().map(|row| row.record);
            kept.activity() == Activity::Faulted
                || last.is_some_and(|record| record.advisory == Advisory::StreamRanDry)
        };
        let mut start = None;
        for next in 1..knots.len() {
            let (before, knot) = (&knots[next - 1], &knots[next]);
            let sent = self.command(Command::Stream(Point {
                position_rad: centre + knot.theta_rad as f32,
                speed_rad_s: knot.omega_rad_s as f32,
                acceleration_rad_s2: knot.alpha_rad_s2.map(|alpha| alpha as f32),
                ticks: knot.tick - before.tick,
            }))?;
            let start = *start.get_or_insert(sent);
            // Only when this one has been reached is there room for the next.
            let due = start + knots[next.saturating_sub(Point::ROOM)].tick;
            if self.kept.borrow().now() <= due {
                self.run_to(due + 1, over, "tracking", progress)?;
            }
            if over(&self.kept.borrow()) {
                break;
            }
        }
        start.ok_or_else(|| {
            InputError("the profile has no two points that are far enough apart in time".into())
        })
    }

    /// Holds the position where the axis is now, until it stands: a motor with little friction coasts for long.
    fn come_to_rest(&mut self, progress: &mut Listener) -> Result<(), InputError> {
        let here = self.here();
        self.command(Command::Position(here))?;
        let still = self.standstill();
        let stands = |kept: &Kept| kept.activity() == Activity::Holding && kept.stands(still);
        let end = self.kept.borrow().now() + self.ticks(LONGEST_REST_S);
        // The rows of the commissioning are no standstill of this hold.
        let first = self.kept.borrow().now() + self.ticks(STILL_S);
        self.run_to(first, |_| false, "settling", progress)?;
        let reached = self.run_to(end, stands, "settling", progress)?;
        if reached >= end {
            // The move to the standstill has not ended: give it up and begin from wherever the axis is.
            self.command(Command::Stop)?;
            self.command(Command::Arm)?;
        }
        Ok(())
    }

    fn begin_run(&mut self) {
        let kept = self.kept.get_mut();
        let start = kept.now() + 1;
        let last = kept.log.run_starts.last();
        let began = kept.log.rows.iter().rposition(|row| Some(&row.tick) == last);
        let ticks = kept.log.rows.len() - began.unwrap_or(0);
        // A few ticks before the first motion are no run of their own.
        if ticks as f64 > LEAST_RUN_S * f64::from(kept.log.config.tick_hz) {
            kept.log.run_starts.push(start);
        }
    }

    /// Records without motion that make a standstill.
    pub fn standstill(&self) -> usize {
        (self.ticks(STILL_S) as usize / self.every.max(1) as usize).max(2)
    }

    /// Position now, rad from power-up.
    pub fn here(&self) -> f32 {
        let kept = self.kept.borrow();
        let counts = kept.log.rows.last().map_or(0, |row| row.record.count.wrapping_sub(kept.log.zero()));
        counts as f32 * TAU / kept.log.config.counts_per_rev as f32
    }

    /// Position minus set-point now, rad.
    fn off_target(&self) -> f32 {
        let kept = self.kept.borrow();
        let ahead = kept.log.rows.last().map_or(0, |row| row.record.ahead_q8(kept.log.zero()));
        -(ahead as f32) / 256.0 * TAU / kept.log.config.counts_per_rev as f32
    }

    /// True if there is something to capture.
    fn arm_capture(&mut self) -> Result<bool, InputError> {
        let Some((trigger, before)) = self.capture.take() else {
            return Ok(false);
        };
        self.command(Command::CaptureArm { trigger, before })?;
        // So that there is something from before the motion.
        self.pause(PAUSE_S)?;
        Ok(true)
    }

    /// Bridge open, and the capture read out. True if a fault was latched.
    fn stop_motion(&mut self, captures: bool) -> Result<bool, InputError> {
        let faulted = self.kept.borrow().activity() == Activity::Faulted;
        self.command(Command::Stop)?;
        self.pause(PAUSE_S)?;
        if captures {
            self.read_capture()?;
        }
        Ok(faulted)
    }

    /// Piece by piece, until one comes back empty.
    fn read_capture(&mut self) -> Result<(), InputError> {
        self.kept.get_mut().captured = Some(Captured::default());
        loop {
            let held = |kept: &Kept| kept.captured.as_ref().map_or(0, |captured| captured.shots.len());
            let from = held(&self.kept.borrow());
            self.command(Command::CaptureRead(from as u16))?;
            // The piece follows its answer.
            self.pause(READ_S)?;
            if held(&self.kept.borrow()) == from {
                return Ok(());
            }
        }
    }
}
