//! One file a subcommand.

pub mod record;
