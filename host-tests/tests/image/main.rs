//! The firmware image in QEMU, and what it is made of: registers, memory, last resort, stack, instructions.

mod bench_image;
mod board_registers;
mod boards_table;
mod last_resort;
mod memory;
mod qemu;
mod qemu_excitation;
mod qemu_four_axes;
mod qemu_position_load;
mod qemu_referencing;
mod qemu_stack;
mod qemu_store;
mod qemu_stream;
mod qemu_two_axes;
mod serial_door;
