//! Helpers of the tests: seeded benches and tolerances with their reasons.
