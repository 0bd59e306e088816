//! What goes over the wire and what is kept: frames, parameters, the store and the settings of an axis file.

mod current_zero;
mod in_force;
mod link;
mod optional;
mod parameters;
mod reasons;
mod scales;
mod settings_table;
mod setup;
mod store;
mod wire_bytes;
mod wrap;
