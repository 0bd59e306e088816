//! The last trusted value of every number that the loops use: a number that has lost its trust keeps it.

use crate::compensate::SignSource;
use crate::identify::estimate::{Estimate, Estimates, Mechanism, Standing};
use crate::record::Source;
use crate::units::{Direction, Voltage};

/// What of a [`super::design::Design`] has to follow next. One stage a control tick, because each divides in single precision; from
/// the last to the first, so that the greater of two is the one that is to be done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Nothing.
    #[default]
    Done,
    /// What set-points may ask for.
    Limits,
    /// The least that the motor must do.
    Expectation,
    /// Compensator, and the dead zone of the observer.
    DeadZone,
    /// Gains of the loops.
    Loops,
    /// Linear motor and observer.
    Motor,
}

/// One number with its source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Trusted {
    value: i32,
    pub(super) source: Source,
}

impl Trusted {
    /// Takes what was trusted when it was stored.
    pub(super) fn restore(&mut self, estimate: &Estimate) {
        if let Some(value) = estimate.trusted() {
            *self = Self { value, source: Source::Stored };
        }
    }

    /// The held value as a trusted estimate, unless there is one.
    pub(super) fn complete(&self, known: &Estimate) -> Estimate {
        match (known.trusted(), self.value()) {
            (None, Some(value)) => Estimate { value, u95: known.u95, standing: Standing::Trusted },
            _ => *known,
        }
    }

    /// Takes a trusted estimate, or keeps what was trusted before. A stored number counts as such until another one is
    /// measured.
    pub(super) fn adopt(&mut self, estimate: &Estimate) {
        match estimate.trusted() {
            Some(value) if self.source == Source::Stored && value == self.value => {}
            Some(value) => *self = Self { value, source: Source::Trusted },
            None if self.source == Source::Trusted => self.source = Source::LastTrusted,
            None => {}
        }
    }

    pub(super) fn value(&self) -> Option<i32> {
        (self.source != Source::None).then_some(self.value)
    }
}

/// The last trusted value of everything the loops use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LastTrusted {
    pub(super) dead_zone: [Trusted; 2],
    pub(super) saturation: [Trusted; 2],
    pub(super) gain: Trusted,
    pub(super) time_constant: Trusted,
    mechanism: Mechanism,
    /// Difference of the dead zones, positive less negative, as they were first known.
    split: Option<i32>,
}

impl LastTrusted {
    /// Takes what is trusted; the stage from which the design has to follow.
    pub fn adopt(&mut self, estimates: &Estimates) -> Stage {
        let before = *self;
        for side in Direction::BOTH {
            self.dead_zone[side].adopt(&estimates.dead_zone[side]);
            self.saturation[side].adopt(&estimates.saturation[side]);
        }
        self.gain.adopt(&estimates.gain);
        self.time_constant.adopt(&estimates.time_constant);
        if estimates.mechanism != Mechanism::Unclear {
            self.mechanism = estimates.mechanism;
        }
        self.split = self.split.or(self.difference());
        if before == *self {
            Stage::Done
        } else if (before.gain, before.time_constant) == (self.gain, self.time_constant) {
            Stage::DeadZone
        } else {
            Stage::Motor
        }
    }

    /// Takes what an earlier life has trusted, and nothing else; the stage from which the design has to follow.
    pub fn restore(&mut self, estimates: &Estimates) -> Stage {
        *self = Self::default();
        for side in Direction::BOTH {
            self.dead_zone[side].restore(&estimates.dead_zone[side]);
            self.saturation[side].restore(&estimates.saturation[side]);
        }
        self.gain.restore(&estimates.gain);
        self.time_constant.restore(&estimates.time_constant);
        self.mechanism = estimates.mechanism;
        self.split = self.difference();
        Stage::Motor
    }

    /// What is adopted next was measured anew.
    pub fn begin_anew(&mut self) {
        self.split = None;
    }

    /// What is to be stored: what is known now, and where that has lost its trust, the last value that had it.
    #[must_use]
    pub fn complete(&self, known: &Estimates) -> Estimates {
        let pair =
            |held: &[Trusted; 2], known: &[Estimate; 2]| [0, 1].map(|side| held[side].complete(&known[side]));
        Estimates {
            dead_zone: pair(&self.dead_zone, &known.dead_zone),
            saturation: pair(&self.saturation, &known.saturation),
            gain: self.gain.complete(&known.gain),
            time_constant: self.time_constant.complete(&known.time_constant),
            mechanism: self.mechanism,
            ..*known
        }
    }

    pub(super) fn sign_source(&self) -> SignSource {
        match self.mechanism {
            Mechanism::InputDeadZone => SignSource::Command,
            Mechanism::VoltageDrop => SignSource::Current,
            Mechanism::Friction | Mechanism::Unclear => SignSource::Reference,
        }
    }

    pub(super) fn difference(&self) -> Option<i32> {
        let [positive, negative] = self.dead_zone.map(|held| held.value());
        Some(positive?.saturating_sub(negative?))
    }

    /// Dead zones with which motion is judged. A load that stays while they are learned makes one smaller and the other
    /// larger by the same voltage, and may be gone again: what the smaller one has lost so is given back to it.
    pub(super) fn unloaded(&self) -> [Option<Voltage>; 2] {
        let load = match (self.split, self.difference()) {
            (Some(first), Some(now)) => first.saturating_sub(now) / 2,
            _ => 0,
        };
        let [positive, negative] = self.dead_zone.map(|held| held.value());
        let with = |width: Option<i32>, lost: i32| Some(Voltage(width?.saturating_add(lost.max(0))));
        [with(positive, load), with(negative, load.saturating_neg())]
    }

    pub(super) fn widths(&self) -> [Voltage; 2] {
        self.dead_zone.map(|held| Voltage(held.value().unwrap_or(0)))
    }
}
