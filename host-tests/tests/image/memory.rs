//! The image's own functions that copy and clear memory, with every alignment, on QEMU's core.

use trials::test_image::{built, qemu};

#[test]
fn copies_and_clears_are_right_with_every_alignment_and_length() {
    let status = qemu(&built("firmware", "memory-check"))
        .status()
        .expect("QEMU can be started; try `cargo xtask setup`");
    assert!(status.success(), "the image ended with {status}");
}
