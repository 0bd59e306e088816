//! Helpers of the tests: measured data that may be absent, skips that are counted, tolerances with their reasons.

pub mod joint;
pub mod measured;
