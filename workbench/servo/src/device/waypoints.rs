//! A profile of points in time, as a file gives it, → points of a stream, with a speed for each of them.
//!
//! Where the file has no speed, it is that of the parabola through a point and its neighbours (its error falls with the
//! square of their distance); where the profile stands on one side of a point, the speed there is zero, so that what
//! rests stays at rest and a jump does not swing over.

/// A point of a profile.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Waypoint {
    /// s.
    pub time_s: f64,
    /// rad, from where the axis is.
    pub theta_rad: f64,
    /// rad/s, if the file says it.
    pub omega_rad_s: Option<f64>,
    /// rad/s², if the file says it.
    pub alpha_rad_s2: Option<f64>,
}

/// A point to be sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Control ticks from the beginning of the profile.
    pub tick: u32,
    /// rad.
    pub theta_rad: f64,
    /// rad/s.
    pub omega_rad_s: f64,
    /// rad/s².
    pub alpha_rad_s2: Option<f64>,
}

/// The same way with all times multiplied by `factor`, speeds and accelerations to match.
pub fn slower(profile: &[Waypoint], factor: f64) -> Vec<Waypoint> {
    let stretched = profile.iter().map(|point| Waypoint {
        time_s: point.time_s * factor,
        theta_rad: point.theta_rad,
        omega_rad_s: point.omega_rad_s.map(|omega| omega / factor),
        alpha_rad_s2: point.alpha_rad_s2.map(|alpha| alpha / (factor * factor)),
    });
    stretched.collect()
}

/// Points at least `spacing` control ticks apart; the first and the last are among them, at rest.
pub fn knots(profile: &[Waypoint], tick_hz: u32, spacing: u32) -> Vec<Knot> {
    let kept = thinned(profile, f64::from(tick_hz), f64::from(spacing));
    let begin = kept.first().map_or(0.0, |first| first.time_s);
    let last = kept.len().saturating_sub(1);
    (0..kept.len())
        .map(|index| {
            let point = &kept[index];
            let inner = index > 0 && index < last;
            Knot {
                tick: ((point.time_s - begin) * f64::from(tick_hz)).round() as u32,
                theta_rad: point.theta_rad,
                omega_rad_s: match inner {
                    true => point.omega_rad_s.unwrap_or_else(|| slope(&kept[index - 1..=index + 1])),
                    false => 0.0,
                },
                alpha_rad_s2: point.alpha_rad_s2.filter(|_| inner),
            }
        })
        .collect()
}

/// Without the points that come too soon after the one before; the last one stays, and takes the place of such a one.
fn thinned(profile: &[Waypoint], tick_hz: f64, spacing: f64) -> Vec<Waypoint> {
    let tick = |point: &Waypoint| (point.time_s * tick_hz).round();
    let mut kept: Vec<Waypoint> = Vec::new();
    for point in profile {
        if kept.last().is_none_or(|last| tick(point) - tick(last) >= spacing) {
            kept.push(*point);
        }
    }
    if let (Some(last), Some(end)) = (kept.last().copied(), profile.last())
        && last != *end
    {
        if kept.len() > 1 {
            kept.pop();
        }
        kept.push(*end);
    }
    kept
}

/// Slope of the parabola through three points in the middle one.
fn slope(three: &[Waypoint]) -> f64 {
    let &[before, here, after] = three else { return 0.0 };
    let (left, right) = (here.time_s - before.time_s, after.time_s - here.time_s);
    let (falling, rising) =
        ((here.theta_rad - before.theta_rad) / left, (after.theta_rad - here.theta_rad) / right);
    if falling == 0.0 || rising == 0.0 {
        return 0.0;
    }
    (falling * right + rising * left) / (left + right)
}
