//! Register accesses of the chip's code, on the host: the addresses of the chip are mapped without any permission, so every
//! access faults. The fault handler carries out a plain load or store of a word between a processor register and the model of the
//! chip. For any other instruction it puts into memory what the model holds there, lets the instruction pass, and hands to the model
//! what has been written: that costs two changes of permission and a second signal, which take most of a test's time.

use super::machine::Chip;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, Once};

/// Peripherals of the chip: APB1, APB2 and the ports of AHB1; the cycle counter, the debug unit.
const REGIONS: [(usize, usize); 3] =
    [(0x4000_0000, 0x0003_0000), (0xE000_1000, 0x1000), (0xE004_2000, 0x1000)];
const PAGE: usize = 0x1000;
/// Trap flag of the processor: one instruction, then a trap.
const SINGLE_STEP: i64 = 0x100;
/// Page faults: this bit of the error code tells a write.
const WRITES: i64 = 2;

static CHIP: Mutex<Option<Chip>> = Mutex::new(None);
/// The word that is being accessed, with bit 0 set for a write.
static ACCESS: AtomicUsize = AtomicUsize::new(0);
/// One test at a time has the chip.
static TURN: Mutex<()> = Mutex::new(());

/// The chip of one test.
pub struct Bench {
    _turn: MutexGuard<'static, ()>,
}

impl Bench {
    /// A chip after reset.
    pub fn new(chip: Chip) -> Self {
        static MAPPED: Once = Once::new();
        let turn = TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        MAPPED.call_once(map);
        *lock() = Some(chip);
        Self { _turn: turn }
    }

    /// The chip, between two accesses.
    pub fn chip<R>(&self, look: impl FnOnce(&mut Chip) -> R) -> R {
        look(lock().as_mut().expect("a chip"))
    }
}

/// Passes time of the chip that is running: the program waits.
pub fn pass(clocks: u64) -> u64 {
    let mut chip = lock();
    let chip = chip.as_mut().expect("a chip");
    chip.run(clocks);
    chip.now
}

fn lock() -> MutexGuard<'static, Option<Chip>> {
    CHIP.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn map() {
    // SAFETY: the addresses lie far below those of a program of 64 bits; the handlers touch this mapping alone.
    unsafe {
        let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_FIXED_NOREPLACE | libc::MAP_NORESERVE;
        for (base, length) in REGIONS {
            let mapped = libc::mmap(base as *mut _, length, libc::PROT_NONE, flags, -1, 0);
            assert_eq!(mapped as usize, base, "the addresses of the chip are taken");
        }
        for (signal, handler) in
            [(libc::SIGSEGV, on_access as *const () as usize), (libc::SIGTRAP, on_step as *const () as usize)]
        {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = handler;
            action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
            assert_eq!(libc::sigaction(signal, &action, std::ptr::null_mut()), 0);
        }
    }
}

/// The processor's registers in the order of their numbers in an instruction.
const REGISTERS: [i32; 16] = [
    libc::REG_RAX,
    libc::REG_RCX,
    libc::REG_RDX,
    libc::REG_RBX,
    libc::REG_RSP,
    libc::REG_RBP,
    libc::REG_RSI,
    libc::REG_RDI,
    libc::REG_R8,
    libc::REG_R9,
    libc::REG_R10,
    libc::REG_R11,
    libc::REG_R12,
    libc::REG_R13,
    libc::REG_R14,
    libc::REG_R15,
];

/// A `mov` of 32 bits between a register, or a number, and memory.
enum Move {
    Load(usize),
    Store(usize),
    Number(u32),
}

/// The instruction, if it is such a `mov`, and its length (Intel SDM volume 2, chapter 2: REX prefix, opcode, ModR/M, SIB, displacement).
fn moved(code: impl Fn(usize) -> u8) -> Option<(Move, usize)> {
    let rex = Some(code(0)).filter(|byte| byte >> 4 == 4);
    let (prefix, rex) = (usize::from(rex.is_some()), rex.unwrap_or(0));
    if rex & 8 != 0 {
        return None;
    }
    let (opcode, form) = (code(prefix), code(prefix + 1));
    let register = usize::from(form >> 3 & 7 | (rex & 4) << 1);
    let (mode, scaled) = (form >> 6, form & 7 == 4);
    let displacement = match mode {
        1 => 1,
        0 if form & 7 != 5 && !(scaled && code(prefix + 2) & 7 == 5) => 0,
        _ => 4,
    };
    let length = prefix + 2 + usize::from(scaled) + displacement;
    match opcode {
        _ if mode == 3 => None,
        0x8B => Some((Move::Load(register), length)),
        0x89 => Some((Move::Store(register), length)),
        0xC7 => {
            let number = u32::from_le_bytes(std::array::from_fn(|k| code(length + k)));
            Some((Move::Number(number), length + 4))
        }
        _ => None,
    }
}

fn page(address: usize) -> *mut libc::c_void {
    (address & !(PAGE - 1)) as *mut _
}

extern "C" fn on_access(signal: i32, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    // SAFETY: the kernel hands both over; the word lies in the mapping above.
    unsafe {
        let address = (*info).si_addr() as usize;
        if !REGIONS.iter().any(|(base, length)| (*base..base + length).contains(&address)) {
            // Not an access to the chip: the default ends the program when the instruction is tried again.
            libc::signal(signal, libc::SIG_DFL);
            return;
        }
        let registers = &mut (*context.cast::<libc::ucontext_t>()).uc_mcontext.gregs;
        let writes = registers[libc::REG_ERR as usize] & WRITES != 0;
        let word = address & !3;
        let held = lock().as_mut().map_or(0, |chip| chip.read(word as u32));
        let code = registers[libc::REG_RIP as usize] as *const u8;
        if let Some((moved, length)) = moved(|at| code.add(at).read()).filter(|_| address == word) {
            let written = match moved {
                Move::Load(register) => {
                    registers[REGISTERS[register] as usize] = held.into();
                    None
                }
                Move::Store(register) => Some(registers[REGISTERS[register] as usize] as u32),
                Move::Number(number) => Some(number),
            };
            if let (Some(value), Some(chip)) = (written, lock().as_mut()) {
                chip.write(word as u32, value);
            }
            registers[libc::REG_RIP as usize] += length as i64;
            return;
        }
        libc::mprotect(page(word), PAGE, libc::PROT_READ | libc::PROT_WRITE);
        (word as *mut u32).write_volatile(held);
        ACCESS.store(word | usize::from(writes), Ordering::Relaxed);
        registers[libc::REG_EFL as usize] |= SINGLE_STEP;
    }
}

extern "C" fn on_step(_signal: i32, _info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    // SAFETY: as above; the page has been opened for the one instruction that has just passed.
    unsafe {
        let access = ACCESS.load(Ordering::Relaxed);
        let word = access & !3;
        if access & 1 != 0
            && let Some(chip) = lock().as_mut()
        {
            chip.write(word as u32, (word as *const u32).read_volatile());
        }
        libc::mprotect(page(word), PAGE, libc::PROT_NONE);
        (*context.cast::<libc::ucontext_t>()).uc_mcontext.gregs[libc::REG_EFL as usize] &= !SINGLE_STEP;
    }
}
