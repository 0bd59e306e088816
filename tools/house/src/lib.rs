//! Figures of the code base itself: how much code there is, how long its functions and files are, and which room of a
//! package uses which other. `cargo xtask house` prints them, and the tests of the room `house` in `host-tests/` hold them.
//!
//! A **room** is a top module of a package: a file or a folder of its `src/`. An **arrow** leads from a room to another one
//! whose items it names. Rooms lie in floors; an arrow that leads to a higher floor is **upward**, and rooms that reach one
//! another form a **circle**.

pub mod arrows;
pub mod body;
pub mod code;
pub mod figures;
pub mod floors;
pub mod parts;
pub mod paths;
pub mod source;

/// The project's folder.
pub fn root() -> &'static std::path::Path {
    let tools = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    tools.and_then(std::path::Path::parent).expect("tools/house lies in the project")
}
