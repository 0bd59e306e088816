//! Of which variable an effect is a curve, and where in it the effect shows.

/// The variable that alone decides what the effect does at a moment, and the part of it that shows the effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// It is no such curve: it delays, remembers, or depends on several variables.
    Nowhere,
    /// The input, inside the edges of the dead zone.
    SmallInputs,
    /// The input, beyond the limit.
    LargeInputs,
    /// The current, by its direction.
    Current,
    /// The speed, by its direction.
    Direction,
    /// The speed, most of all near standstill.
    SlowMotion,
    /// The speed: it grows with it.
    FastMotion,
    /// The place within a period of the turn.
    Turn,
}
