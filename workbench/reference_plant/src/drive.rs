//! The drive: from the command to the voltage that it offers the winding.
//!
//! ```text
//! command → delay → lag → gain → offset → dead zone → limit → × supply → winding
//! ```
//!
//! A duty becomes volts by the supply of that very moment, before the lag. A command in volts is realised with the
//! nominal supply, so a sagging supply scales it at the end.

use crate::rosenbrock::State;

/// What the drive is told; held until the next command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Volts at the winding, for a supply at its nominal value.
    Volts(f64),
    /// Share of the supply, −1 … 1.
    Duty(f64),
    /// Torque (N m) or force (N) of an axis whose inner current loop is taken as ideal; the winding plays no part.
    Torque(f64),
}

/// What the bridge does while its switches are off inside a PWM period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decay {
    /// The winding is shorted: its mean voltage is proportional to the duty.
    Slow,
    /// The winding works against the supply through the diodes until its current is zero, once a PWM period.
    Fast {
        /// PWM frequency, Hz.
        pwm_hz: f64,
    },
}

/// How a threshold bends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Knee {
    /// A corner.
    Hard,
    /// `x / (1 + |x/limit|^(1/s))^s`, the form of compression in amplifiers (C. Rapp, 1991); s > 0.
    Compression(f64),
    /// The corner replaced by the integral of a logistic step of this width, V.
    Logistic(f64),
}

/// The input chain. Arrays hold the positive and the negative direction; both entries are positive magnitudes.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Nominal (unloaded) supply, V.
    pub supply_v: f64,
    /// Inner resistance of the supply, Ω.
    pub source_ohm: f64,
    /// Capacitance across the bridge, F; 0: none.
    pub bus_farad: f64,
    /// Relative rms of a slow ripple of the supply (Ornstein–Uhlenbeck, [`Drive::ripple_s`]).
    pub ripple: f64,
    /// Correlation time of the ripple, s.
    pub ripple_s: f64,
    /// Pure delay, s.
    pub delay_s: f64,
    /// First-order lag, s; 0: none.
    pub lag_s: f64,
    /// Ratio of true to commanded voltage in either direction.
    pub gain: [f64; 2],
    /// Added voltage, V.
    pub offset_v: f64,
    /// Half widths of the dead zone, V.
    pub dead_zone_v: [f64; 2],
    /// Shape of its corners ([`Knee::Compression`] counts as hard here).
    pub dead_zone_knee: Knee,
    /// Limits behind the dead zone, V; infinite: none.
    pub limit_v: [f64; 2],
    /// Shape of their corners.
    pub limit_knee: Knee,
    /// Voltage lost against the current, V (brushes, transistors).
    pub drop_v: f64,
    /// Largest current, A; infinite: none. The drive holds the current there.
    pub current_limit_a: f64,
    /// Behaviour inside a PWM period.
    pub decay: Decay,
}

impl Drive {
    /// An ideal drive on a stiff supply.
    pub fn ideal(supply_v: f64) -> Self {
        Self {
            supply_v,
            source_ohm: 0.0,
            bus_farad: 0.0,
            ripple: 0.0,
            ripple_s: 0.05,
            delay_s: 0.0,
            lag_s: 0.0,
            gain: [1.0; 2],
            offset_v: 0.0,
            dead_zone_v: [0.0; 2],
            dead_zone_knee: Knee::Hard,
            limit_v: [f64::INFINITY; 2],
            limit_knee: Knee::Hard,
            drop_v: 0.0,
            current_limit_a: f64::INFINITY,
            decay: Decay::Slow,
        }
    }

    /// Supply voltage at this moment. `ripple_v` is the momentary ripple.
    pub fn supply(&self, command: Command, ripple_v: f64, y: &State) -> f64 {
        if self.bus_farad > 0.0 {
            return y[super::state::BUS];
        }
        let share = self.duty(command);
        self.supply_v + ripple_v - self.source_ohm * share * y[super::state::CURRENT]
    }

    /// The command as a share of the nominal supply.
    pub fn duty(&self, command: Command) -> f64 {
        match command {
            Command::Volts(u) => u / self.supply_v,
            Command::Duty(d) => d,
            Command::Torque(_) => 0.0,
        }
    }

    /// The command in volts, before the lag.
    pub fn requested(&self, command: Command, supply: f64) -> f64 {
        match command {
            Command::Volts(u) => u,
            Command::Duty(d) => d * supply,
            Command::Torque(_) => 0.0,
        }
    }

    /// Voltage in front of the dead zone, from the (lagged) request.
    pub fn scaled(&self, request: f64) -> f64 {
        self.gain[usize::from(request < 0.0)] * request + self.offset_v
    }

    /// Behind the dead zone, in the given piece of it.
    pub fn behind_dead_zone(&self, x: f64, piece: Piece) -> f64 {
        let [positive, negative] = self.dead_zone_v;
        if positive == 0.0 && negative == 0.0 {
            // A voltage that grows from exactly 0 leaves no edge behind: without a zone there are no pieces.
            return x;
        }
        if let Knee::Logistic(width) = self.dead_zone_knee {
            return soft_ramp(x - positive, width) - soft_ramp(-x - negative, width);
        }
        match piece {
            Piece::Above => x - positive,
            Piece::Below => x + negative,
            Piece::Inside => 0.0,
        }
    }

    /// Behind the limit, in the given piece of it.
    pub fn behind_limit(&self, x: f64, piece: Piece) -> f64 {
        let [positive, negative] = self.limit_v;
        let limit = if x < 0.0 { negative } else { positive };
        match self.limit_knee {
            Knee::Compression(s) if limit.is_finite() => x / (1.0 + (x / limit).abs().powf(1.0 / s)).powf(s),
            Knee::Logistic(width) if limit.is_finite() => {
                x - soft_ramp(x - positive, width) + soft_ramp(-x - negative, width)
            }
            _ => match piece {
                Piece::Above => positive,
                Piece::Below => -negative,
                Piece::Inside => x,
            },
        }
    }

    /// Scale by the supply, for commands in volts.
    pub fn supplied(&self, command: Command, x: f64, supply: f64) -> f64 {
        match command {
            Command::Volts(_) => x * supply / self.supply_v,
            _ => x,
        }
    }
}

/// Where a value lies between two thresholds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// Beyond the positive threshold.
    Above,
    /// Between the thresholds.
    Inside,
    /// Beyond the negative threshold.
    Below,
}

impl Piece {
    /// The piece that holds `x`, thresholds `positive` and `−negative`.
    pub fn of(x: f64, [positive, negative]: [f64; 2]) -> Self {
        if x > positive {
            Self::Above
        } else if x < -negative {
            Self::Below
        } else {
            Self::Inside
        }
    }

    /// Distance to the nearest way out of this piece; negative once outside.
    pub fn margin(self, x: f64, [positive, negative]: [f64; 2]) -> f64 {
        match self {
            Self::Above => x - positive,
            Self::Below => -negative - x,
            Self::Inside => (positive - x).min(x + negative),
        }
    }
}

/// `width · ln(1 + e^(x/width))`: max(x, 0) with a rounded corner.
fn soft_ramp(x: f64, width: f64) -> f64 {
    let z = x / width;
    if z > 30.0 { x } else { width * z.exp().ln_1p() }
}
