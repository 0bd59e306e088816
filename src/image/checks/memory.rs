//! A test image: copies and clears with every alignment and every length up to some blocks, and looks at each byte. The
//! test `memory` runs it in QEMU.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../memory.rs"]
mod memory;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is a test image for QEMU: `cargo test --package host-tests --test image memory::` builds and runs it."
    );
}

#[cfg(target_os = "none")]
mod image {
    use cortex_m_rt::entry;
    use stm32f4xx_hal as _;

    /// Three rounds of the widest loop and what is left of a fourth.
    const LONGEST: usize = 131;
    /// Bytes before and behind that must stay as they are.
    const MARGIN: usize = 8;
    const ROOM: usize = MARGIN + 3 + LONGEST + MARGIN;
    const UNTOUCHED: u8 = 0xA5;

    type Copy = unsafe extern "C" fn(*mut u8, *const u8, usize) -> *mut u8;
    type Clear = unsafe extern "C" fn(*mut u8, usize);
    type Fill = unsafe extern "C" fn(*mut u8, usize, i32);

    unsafe extern "C" {
        fn memcpy(to: *mut u8, from: *const u8, bytes: usize) -> *mut u8;
        fn __aeabi_memcpy(to: *mut u8, from: *const u8, bytes: usize) -> *mut u8;
        fn __aeabi_memcpy4(to: *mut u8, from: *const u8, bytes: usize) -> *mut u8;
        fn __aeabi_memcpy8(to: *mut u8, from: *const u8, bytes: usize) -> *mut u8;
        fn __aeabi_memclr(to: *mut u8, bytes: usize);
        fn __aeabi_memclr4(to: *mut u8, bytes: usize);
        fn __aeabi_memclr8(to: *mut u8, bytes: usize);
        fn __aeabi_memset(to: *mut u8, bytes: usize, byte: i32);
        fn __aeabi_memset4(to: *mut u8, bytes: usize, byte: i32);
        fn __aeabi_memset8(to: *mut u8, bytes: usize, byte: i32);
    }

    #[repr(align(8))]
    struct Room([u8; ROOM]);

    #[entry]
    fn main() -> ! {
        let any = [0, 1, 2, 3].map(|to| [0, 1, 2, 3].map(|from| (to, from)));
        let right = any
            .as_flattened()
            .iter()
            .all(|&(to, from)| copies(__aeabi_memcpy, to, from) && copies(memcpy, to, from))
            && returns_its_target()
            && copies(__aeabi_memcpy4, 0, 0)
            && copies(__aeabi_memcpy8, 0, 0)
            && [0, 1, 2, 3].iter().all(|&to| clears(__aeabi_memclr, to))
            && clears(__aeabi_memclr4, 0)
            && clears(__aeabi_memclr8, 0)
            && [0, 1, 2, 3].iter().all(|&to| fills(__aeabi_memset, to))
            && fills(__aeabi_memset4, 0)
            && fills(__aeabi_memset8, 0);
        semihosting::process::exit(if right { 0 } else { 1 })
    }

    fn copies(copy: Copy, to: usize, from: usize) -> bool {
        let source = Room(core::array::from_fn(|index| index as u8));
        (0..=LONGEST).all(|length| {
            let mut room = Room([UNTOUCHED; ROOM]);
            let (to, from) = (MARGIN + to, MARGIN + from);
            // SAFETY: both rooms hold an offset of three, the longest length and a margin.
            unsafe { copy(room.0.as_mut_ptr().add(to), source.0.as_ptr().add(from), length) };
            as_expected(&room, to, length, |index| source.0[from + index])
        })
    }

    fn clears(clear: Clear, to: usize) -> bool {
        (0..=LONGEST).all(|length| {
            let mut room = Room([UNTOUCHED; ROOM]);
            let to = MARGIN + to;
            // SAFETY: as above.
            unsafe { clear(room.0.as_mut_ptr().add(to), length) };
            as_expected(&room, to, length, |_| 0)
        })
    }

    fn fills(fill: Fill, to: usize) -> bool {
        const BYTE: u8 = 0x3C;
        (0..=LONGEST).all(|length| {
            let mut room = Room([UNTOUCHED; ROOM]);
            let to = MARGIN + to;
            // SAFETY: as above.
            unsafe { fill(room.0.as_mut_ptr().add(to), length, i32::from(BYTE)) };
            as_expected(&room, to, length, |_| BYTE)
        })
    }

    fn as_expected(room: &Room, to: usize, length: usize, expected: impl Fn(usize) -> u8) -> bool {
        room.0.iter().enumerate().all(|(index, &byte)| {
            let inside = (to..to + length).contains(&index);
            byte == if inside { expected(index - to) } else { UNTOUCHED }
        })
    }

    /// C's function does; those of the ABI return nothing.
    fn returns_its_target() -> bool {
        let (source, mut room) = (Room([0; ROOM]), Room([0; ROOM]));
        let to = room.0.as_mut_ptr();
        // SAFETY: both rooms are that long.
        unsafe { memcpy(to, source.0.as_ptr(), LONGEST) == to }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        semihosting::process::exit(101)
    }
}
