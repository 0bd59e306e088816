//! Branches by hand from the encodings of the architecture reference manual, all at address 0x100.

use panic_paths::accepted;
use panic_paths::thumb::{Flow, flow, length, pushed};
use panic_paths::walk::Finding;

const AT: u32 = 0x100;

#[test]
fn lengths() {
    assert_eq!((length(0xE7FE), length(0xE800), length(0xF7FF), length(0xBD10)), (2, 4, 4, 2));
}

#[test]
fn branches_go_where_the_manual_says() {
    for (first, second, to, name) in [
        (0xF000, 0xF800, 0x104, "bl to the next"),
        (0xF7FF, 0xFFFE, 0x100, "bl to itself"),
        (0xF000, 0xF801, 0x106, "bl two further"),
        (0xF000, 0xB800, 0x104, "b.w to the next"),
        (0xF7FF, 0xBFFE, 0x100, "b.w to itself"),
        (0xF000, 0x8000, 0x104, "beq.w to the next"),
        (0xE7FE, 0, 0x100, "b to itself"),
        (0xD0FE, 0, 0x100, "beq to itself"),
        (0xD101, 0, 0x106, "bne two further"),
        (0xB100, 0, 0x104, "cbz to the next"),
        (0xBB08, 0, 0x146, "cbnz 66 further"),
    ] {
        assert_eq!(flow(AT, first, second), Flow::To(to), "{name}");
    }
}

#[test]
fn returns_and_barriers_go_on_and_registers_are_told() {
    for (first, second, name) in [
        (0x4770, 0, "bx lr"),
        (0xBD10, 0, "pop {r4, pc}"),
        (0xF3BF, 0x8F4F, "dsb sy"),
        (0xDF00, 0, "svc"),
        (0xFB01, 0xF000, "mul"),
    ] {
        assert_eq!(flow(AT, first, second), Flow::On, "{name}");
    }
    for (code, name) in [(0x4718, "bx r3"), (0x4798, "blx r3")] {
        assert_eq!(flow(AT, code, 0), Flow::Register, "{name}");
    }
}

#[test]
fn what_is_taken_off_the_stack_is_counted() {
    for (first, second, bytes, name) in [
        (0xB5F0, 0, 20, "push {r4-r7, lr}"),
        (0xE92D, 0x0F00, 16, "push.w {r8-r11}"),
        (0xF84D, 0x3D04, 4, "str r3, [sp, #-4]!"),
        (0xED2D, 0x8B04, 16, "vpush {d8, d9}"),
        (0xED2D, 0x8A01, 4, "vpush {s16}"),
        (0xB086, 0, 24, "sub sp, #24"),
        (0xF5AD, 0x7D39, 740, "sub.w sp, sp, #740"),
        (0xF2AD, 0x4D14, 1044, "subw sp, sp, #1044"),
        (0xB006, 0, 0, "add sp, #24"),
        (0xBDF0, 0, 0, "pop {r4-r7, pc}"),
        (0xF5A3, 0x7D39, 0, "sub.w sp, r3, #740, which is no constant step"),
    ] {
        assert_eq!(pushed(first, second), bytes, "{name}");
    }
}

#[test]
fn the_accepted_list_can_be_read_and_every_line_has_its_reason() {
    let list = accepted::parse(include_str!("../accepted.txt")).expect("a good list");
    assert!(!list.is_empty());
    assert!(list.iter().all(|line| line.reason.len() > 10));
    let finding = |function: &str, panic: &str| Finding { function: function.into(), panic: panic.into() };
    let pattern =
        accepted::parse("a::b::* | core::panicking::panic_bounds_check | reason").expect("one line");
    assert!(pattern[0].covers(&finding("a::b::c", "core::panicking::panic_bounds_check")));
    assert!(!pattern[0].covers(&finding("a::c", "core::panicking::panic_bounds_check")));
    assert!(!pattern[0].covers(&finding("a::b::c", "core::panicking::panic_fmt")));
    assert!(accepted::parse("no reason | given").is_err());
}
