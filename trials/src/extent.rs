//! How far a long proof goes: the ordinary run does a part of it, `cargo xtask test --all` the whole.

/// Set for the whole proofs.
const ALL: &str = "TRUING_ALL";

/// Whether the whole proof is asked for.
pub fn all() -> bool {
    std::env::var_os(ALL).is_some()
}

/// How many cases are done: `part` of `whole` in the ordinary run.
pub fn cases<T>(part: T, whole: T) -> T {
    if all() { whole } else { part }
}
