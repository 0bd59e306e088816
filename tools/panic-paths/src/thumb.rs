//! The branches among Thumb-2 instructions, and nothing else: where control may leave an instruction, and how long it is.
//! Encodings: ARMv7-M Architecture Reference Manual (ARM DDI 0403), A5.1 (lengths), A7.7.12 (`B`), A7.7.18 (`BL`),
//! A7.7.19 (`BLX`), A7.7.20 (`BX`), A7.7.21 (`CBZ`). And what takes memory off the stack: A7.7.99 (`PUSH`), A7.7.174 (`SUB`
//! from the stack pointer), A7.7.161 (`STR` with write-back), A7.7.256 (`VPUSH`). All other instructions are stepped over, so that floating point and DSP
//! instructions need no tables.

/// What an instruction does to the flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Goes on, returns, or stays within a jump table of its function.
    On,
    /// May go to this address: a call or a branch.
    To(u32),
    /// Goes where a register says, which is not the link register.
    Register,
}

/// Link register.
const LR: u16 = 14;

/// Bytes of the instruction that begins with `first`: 4 for 0b11101, 0b11110 and 0b11111 in the upper five bits, else 2.
#[must_use]
pub fn length(first: u16) -> u32 {
    if first >= 0xE800 { 4 } else { 2 }
}

/// The flow of the instruction at `address`. `second` is 0 for instructions of 2 bytes.
#[must_use]
pub fn flow(address: u32, first: u16, second: u16) -> Flow {
    match length(first) {
        2 => short(address, first),
        _ => long(address, first, second),
    }
}

fn short(address: u32, code: u16) -> Flow {
    let to = |offset: i32| Flow::To(address.wrapping_add(4).wrapping_add_signed(offset));
    let register = (code >> 3) & 15;
    match code {
        // B<c>, imm8; conditions 14 and 15 are UDF and SVC.
        _ if code >> 12 == 0b1101 && (code >> 8) & 15 < 14 => to(i32::from(code as u8 as i8) * 2),
        // B, imm11.
        _ if code >> 11 == 0b11100 => to(sign_extended(u32::from(code & 0x7FF) << 1, 12)),
        // CBZ, CBNZ: forwards.
        _ if code & 0xF500 == 0xB100 => to(i32::from((code >> 3) & 31) * 2 + i32::from((code >> 9) & 1) * 64),
        // BLX register; BX register.
        _ if code & 0xFF87 == 0x4780 => Flow::Register,
        _ if code & 0xFF87 == 0x4700 && register != LR => Flow::Register,
        _ => Flow::On,
    }
}

fn long(address: u32, first: u16, second: u16) -> Flow {
    let bit = |word: u16, place: u32| u32::from(word >> place) & 1;
    if first >> 11 != 0b11110 || second & 0x8000 == 0 {
        return Flow::On;
    }
    let (sign, low) = (bit(first, 10), u32::from(second & 0x7FF) << 1);
    let (j1, j2) = (bit(second, 13), bit(second, 11));
    let offset = match (bit(second, 14), bit(second, 12)) {
        // BL; B.W, imm24.
        (_, 1) => {
            let (i1, i2) = (1 ^ j1 ^ sign, 1 ^ j2 ^ sign);
            let high = u32::from(first & 0x3FF) << 12;
            sign_extended(sign << 24 | i1 << 23 | i2 << 22 | high | low, 25)
        }
        // B<c>.W, imm20; conditions 14 and 15 are other instructions.
        (0, 0) if (first >> 6) & 15 < 14 => {
            let high = u32::from(first & 0x3F) << 12;
            sign_extended(sign << 20 | j2 << 19 | j1 << 18 | high | low, 21)
        }
        _ => return Flow::On,
    };
    Flow::To(address.wrapping_add(4).wrapping_add_signed(offset))
}

fn sign_extended(value: u32, bits: u32) -> i32 {
    ((value << (32 - bits)) as i32) >> (32 - bits)
}

/// Bytes that an instruction takes off the stack pointer by a constant.
#[must_use]
pub fn pushed(first: u16, second: u16) -> u32 {
    let immediate =
        u32::from(second & 0xFF) | u32::from(second >> 12 & 7) << 8 | u32::from(first >> 10 & 1) << 11;
    match first {
        // PUSH, registers 0 to 7 and the link register.
        0xB400..=0xB5FF => 4 * (first & 0x1FF).count_ones(),
        // SUB SP, imm7.
        0xB080..=0xB0FF => 4 * u32::from(first & 0x7F),
        // PUSH.W
        0xE92D => 4 * second.count_ones(),
        // STR register, [SP, #-4]!
        0xF84D if second & 0x0FFF == 0x0D04 => 4,
        // VPUSH, both sizes of registers: the count is in words.
        0xED2D | 0xED6D if second & 0x0E00 == 0x0A00 => 4 * u32::from(second & 0xFF),
        // SUB.W SP, SP, constant; SUBW SP, SP, imm12.
        0xF1AD | 0xF5AD if second & 0x8F00 == 0x0D00 => expanded(immediate),
        0xF2AD | 0xF6AD if second & 0x8F00 == 0x0D00 => immediate,
        _ => 0,
    }
}

/// A modified immediate constant (A5.3.2): a byte, repeated or rotated.
fn expanded(immediate: u32) -> u32 {
    let byte = immediate & 0xFF;
    match immediate >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (0x80 | byte & 0x7F).rotate_right(immediate >> 7),
    }
}
