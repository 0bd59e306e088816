//! The core of the workbench: tables in memory in, a result out. No terminal, no process, and no report in it.
//!
//! ```text
//! log → simulate → residual → localise → name → extend
//! ```

#![deny(clippy::print_stdout, clippy::print_stderr)]

/// Declares an enum together with all its variants, in order, and a word for each.
#[macro_export]
macro_rules! worded {
    (
        $(#[$about:meta])+
        pub enum $name:ident: $word:ident { $($(#[$doc:meta])+ $variant:ident = $text:literal,)+ }
    ) => {
        $(#[$about])+
        pub enum $name { $($(#[$doc])+ $variant,)+ }

        impl $name {
            /// All of them, in order.
            pub const ALL: [Self; [$($text),+].len()] = [$(Self::$variant),+];

            /// Its word in files and tables.
            pub fn $word(self) -> &'static str {
                match self { $(Self::$variant => $text),+ }
            }
        }
    };
}

pub mod gap;
pub mod outcome;
pub mod system;
pub mod text;
