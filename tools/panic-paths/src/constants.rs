//! Which constant a register holds. Code that is compiled for size loads the address of a function that it calls several times into
//! a register: such a call says where it goes, two instructions earlier.

/// What the registers hold, as far as the code just before has loaded it from nowhere but the code itself.
#[derive(Default)]
pub struct Constants([Option<u32>; 16]);

impl Constants {
    /// The value of a register.
    pub fn get(&self, register: u16) -> Option<u32> {
        self.0[usize::from(register & 15)]
    }

    /// Follows an instruction at this address; `word` reads the image. What loads from memory makes a register unknown.
    pub fn follow(&mut self, at: u32, first: u16, second: u16, word: impl Fn(u32) -> u32) {
        let base = (at + 4) & !3;
        let wide = usize::from((second >> 8) & 15);
        match first {
            // MOVW, MOVT.
            _ if first & 0xFBF0 == 0xF240 => self.0[wide] = Some(immediate(first, second)),
            _ if first & 0xFBF0 == 0xF2C0 => {
                self.0[wide] = self.0[wide].map(|low| low & 0xFFFF | immediate(first, second) << 16);
            }
            // LDR from beside the code.
            _ if first & 0xF800 == 0x4800 => {
                let value = word(base + 4 * u32::from(first & 0xFF));
                self.0[usize::from((first >> 8) & 7)] = Some(value);
            }
            0xF8DF => self.0[usize::from(second >> 12)] = Some(word(base + u32::from(second & 0xFFF))),
            // MOV.
            _ if first & 0xFF00 == 0x4600 => {
                self.0[usize::from((first >> 4) & 8 | first & 7)] = self.get(first >> 3);
            }
            _ => self.forget(first, second),
        }
    }

    /// LDR and LDM of any kind, POP.
    fn forget(&mut self, first: u16, second: u16) {
        match first {
            _ if first & 0xF800 == 0x6800 || first & 0xFE00 == 0x5800 => {
                self.0[usize::from(first & 7)] = None
            }
            _ if first & 0xF800 == 0x9800 => self.0[usize::from((first >> 8) & 7)] = None,
            _ if first & 0xFF70 == 0xF850 => self.0[usize::from(second >> 12)] = None,
            _ if first & 0xF800 == 0xC800 || first & 0xFE00 == 0xBC00 => self.forget_all(first & 0xFF),
            // LDRD, and LDM with a list.
            _ if first & 0xFE50 == 0xE850 && first & 0x40 != 0 => {
                self.forget_all(1 << (second >> 12) | 1 << ((second >> 8) & 15));
            }
            _ if first & 0xFE50 == 0xE810 => self.forget_all(second),
            _ => {}
        }
    }

    fn forget_all(&mut self, list: u16) {
        let registers = self.0.iter_mut().enumerate();
        registers.filter(|(register, _)| list >> register & 1 != 0).for_each(|(_, value)| *value = None);
    }
}

/// The constant of MOVW and MOVT.
fn immediate(first: u16, second: u16) -> u32 {
    let parts = [(first & 15, 12), ((first >> 10) & 1, 11), ((second >> 12) & 7, 8), (second & 0xFF, 0)];
    parts.iter().map(|&(bits, shift)| u32::from(bits) << shift).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_of_moves_is_a_constant_until_a_load_overwrites_it() {
        let mut constants = Constants::default();
        // MOVW R4, #0x6949; MOVT R4, #0x0800; LDR R4, [R0].
        constants.follow(0, 0xF646, 0x1449, |_| 0);
        constants.follow(4, 0xF6C0, 0x0400, |_| 0);
        assert_eq!(constants.get(4), Some(0x0800_6949));
        constants.follow(8, 0x6804, 0, |_| 0);
        assert_eq!(constants.get(4), None);
    }

    #[test]
    fn a_word_beside_the_code_is_a_constant() {
        let mut constants = Constants::default();
        // LDR R3, [PC, #8].
        constants.follow(2, 0x4B02, 0, |address| address);
        assert_eq!(constants.get(3), Some(12));
    }
}
