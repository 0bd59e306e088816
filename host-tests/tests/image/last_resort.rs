//! A panic or fault below the control interrupt: the image's own handlers on QEMU's core, while control drives the bridge.

use trials::test_image::{built, qemu};

#[test]
fn the_bridge_stays_off_after_a_panic_or_fault_although_control_drives_it() {
    let image = built("firmware", "last-resort-check");
    for (letter, way) in [
        ("i", "a panic in idle"),
        ("l", "a panic in link"),
        ("f", "a hard fault in idle"),
        ("u", "an unexpected interrupt"),
    ] {
        let servo_under_test = tempfile::tempdir().expect("a folder");
        std::fs::write(servo_under_test.path().join("way"), letter).expect("a file");
        let status = qemu(&image)
            .current_dir(servo_under_test.path())
            .status()
            .expect("QEMU can be started; try `cargo xtask setup`");
        // 1: the bridge is driven again; 2: nothing of the kind happened.
        assert_eq!(status.code(), Some(0), "{way}");
    }
}
