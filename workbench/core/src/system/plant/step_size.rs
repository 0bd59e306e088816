//! How finely a plant is simulated: step lengths and rates are rounded, so that plants that differ little advance together.

/// How motor and load hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// They are one body.
    Rigid,
    /// The load has no inertia and follows within a gap.
    Play,
    /// A spring.
    Spring,
    /// A gap with compliant teeth.
    Contact,
    /// A gap with hard teeth.
    Gap,
}

/// The rounded step length of a plant, and the rate that parts a step further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepSize {
    /// How motor and load hang together: another coupling has other rates.
    pub coupling: Coupling,
    /// Rounded logarithm of the time constant.
    pub time: i32,
    /// Rounded logarithm of the rate of spring or teeth.
    pub rate: i32,
}

impl StepSize {
    /// As fine as each of two needs to be.
    pub fn finer(self, other: Self) -> Self {
        if self.coupling != other.coupling {
            return self;
        }
        Self { time: self.time.min(other.time), rate: self.rate.max(other.rate), ..self }
    }
}
