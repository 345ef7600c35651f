//! Memory and registers at fixed addresses: the only file of this crate with `unsafe`.
#![allow(unsafe_code)]

use core::arch::asm;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering, compiler_fence};

use embassy_stm32::interrupt::{Interrupt, InterruptExt, Priority};
use embassy_stm32::pac::FLASH;
use trueaxis_firmware::mirror::{Memory, Mirrored};
use trueaxis_firmware::slots::WhileBusy;

use crate::stm32h743::SecondBank;

/// Bytes of a slot, as `memory.x` places them.
pub const SLOT: usize = 256 * 1024;

/// Bytes that have an error-correcting code together.
const WORD: usize = 32;

/// Configuration and control register of the processor, and the status of its faults (Arm v7-M
/// reference manual, B3.2.8 and B3.2.15).
const CCR: *mut u32 = 0xE000_ED14 as *mut u32;
const CFSR: *mut u32 = 0xE000_ED28 as *mut u32;
/// In the first: faults of the bus are ignored where nothing can interrupt.
const BFHFNMIGN: u32 = 1 << 8;
/// In the second: all faults of the bus.
const BUS_FAULTS: u32 = 0xFF00;

unsafe extern "C" {
    safe static __slot_a_start: u8;
    safe static __slot_b_start: u8;
}

/// The mirror, in memory that is not filled before the program starts.
#[unsafe(link_section = ".mirror")]
static mut MIRROR: MaybeUninit<Memory<SLOT>> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

/// The slots, mirrored in memory, the first time this is called.
///
/// While bank 2 is busy the servo reads neither program nor samples there.
pub fn mirrored(flash: SecondBank) -> Option<Mirrored<SecondBank, SLOT>> {
    if TAKEN.swap(true, Ordering::Relaxed) {
        return None;
    }
    let starts = [&raw const __slot_a_start, &raw const __slot_b_start];
    let starts = starts.map(|start| start.addr() as u32 - 0x0800_0000);
    // SAFETY: the mirror is reached here alone, and once. Zeros are a `Memory`, as `Memory::new` gives it.
    // It is given to the one caller, who gives it to `Slots` in `MainLoop::start`, which does what
    // `open` wants.
    unsafe {
        let memory = &raw mut MIRROR;
        memory.write_bytes(0, 1);
        let memory = (*memory).assume_init_mut();
        Some(Mirrored::open(flash, starts, WhileBusy::DualBank, memory))
    }
}

/// Copies bytes of the flash; false if the error-correcting code of a word of them does not hold, where
/// any other access is a fault of the bus. Nothing interrupts it for as long as a word takes.
pub fn read(address: usize, bytes: &mut [u8]) -> bool {
    let mut whole = true;
    let mut at = 0;
    while at < bytes.len() {
        // To the end of the word.
        let count = (WORD - (address + at) % WORD).min(bytes.len() - at);
        whole &= read_word(address + at, &mut bytes[at..at + count]);
        at += count;
    }
    whole
}

/// Bytes of one word.
fn read_word(address: usize, bytes: &mut [u8]) -> bool {
    let errors = || {
        let bank = |number| {
            let status = FLASH.bank(number).sr().read();
            status.dbeccerr()
        };
        bank(0) || bank(1)
    };
    let clear = || {
        for number in 0..2 {
            FLASH.bank(number).ccr().write(|w| w.set_clr_dbeccerr(true));
        }
    };
    clear();
    // SAFETY: two registers of the processor, which no other code of this program touches. With the
    // highest priority but one, which `cpsid f` gives, a fault of the bus is ignored and what was
    // read is anything; it is over before `cpsie f`. The addresses are within the flash, which the
    // caller has looked at, and nobody writes there meanwhile.
    let faults = unsafe {
        asm!("cpsid f", options(nomem, nostack, preserves_flags));
        compiler_fence(Ordering::SeqCst);
        CCR.write_volatile(CCR.read_volatile() | BFHFNMIGN);
        cortex_m::asm::dsb();
        for (at, byte) in (address..).zip(&mut *bytes) {
            *byte = (at as *const u8).read_volatile();
        }
        cortex_m::asm::dsb();
        let faults = CFSR.read_volatile() & BUS_FAULTS;
        // What is written as one is cleared.
        CFSR.write_volatile(faults);
        CCR.write_volatile(CCR.read_volatile() & !BFHFNMIGN);
        cortex_m::asm::dsb();
        compiler_fence(Ordering::SeqCst);
        asm!("cpsie f", options(nomem, nostack, preserves_flags));
        faults
    };
    let good = faults == 0 && !errors();
    clear();
    good
}

/// Lets the servo interrupt come, whose handler is in place, before all others.
pub fn start_servo(interrupt: Interrupt) {
    interrupt.set_priority(Priority::P0);
    // SAFETY: no code of this crate relies on the interrupt being masked by its enable bit: what its
    // handler shares with the main loop is in a `Mutex` of `critical_section`.
    unsafe { interrupt.enable() };
}

/// Drives the fault pin low, from anywhere: PB0.
pub fn fault_pin_low() {
    // One store to the register that sets and clears pins; it changes no other pin.
    embassy_stm32::pac::GPIOB
        .bsrr()
        .write(|w| w.set_br(0, true));
}
