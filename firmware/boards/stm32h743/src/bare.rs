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
    let memory = unsafe {
        let memory = &raw mut MIRROR;
        memory.write_bytes(0, 1);
        (*memory).assume_init_mut()
    };
    Some(Mirrored::open(flash, starts, WhileBusy::DualBank, memory))
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

/// Lets interrupts come, whose handlers are in place: of the highest priority, all the same.
pub fn start_interrupts<const N: usize>(interrupts: [Interrupt; N]) {
    for interrupt in interrupts {
        interrupt.set_priority(Priority::P0);
        // SAFETY: no code of this crate relies on the interrupt being masked by its enable bit: what its
        // handler shares with the main loop is in a `Mutex` of `critical_section`.
        unsafe { interrupt.enable() };
    }
}

/// Memory that DMA1 and DMA2 reach, unlike that of the other data, and that the data cache leaves alone.
pub mod shared {
    use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

    use cortex_m::peripheral::MPU;
    use embassy_stm32::pac::RCC;
    use trueaxis_firmware::controller::LineMemory;

    use crate::stm32h743::LENGTH;

    /// What the hardware and the program share.
    pub struct Shared {
        /// Of the serial line.
        pub line: LineMemory,
        /// A frame of the motion side.
        pub received: [AtomicU8; LENGTH],
        /// The answer.
        pub sent: [AtomicU8; LENGTH],
    }

    #[unsafe(link_section = ".shared")]
    static SHARED: Shared = Shared {
        line: LineMemory::new(),
        received: [const { AtomicU8::new(0) }; LENGTH],
        sent: [const { AtomicU8::new(0) }; LENGTH],
    };
    static TAKEN: AtomicBool = AtomicBool::new(false);

    unsafe extern "C" {
        safe static __shared_start: u8;
        safe static __shared_end: u8;
    }

    /// Region 0: 32 KiB (2¹⁵) of normal memory that no cache keeps, for all to read and to write, with
    /// no program in it (Arm v7-M reference manual, B3.5.9).
    const REGION: u32 = NO_PROGRAM | EVERYBODY | NOT_CACHED | SHAREABLE | SIZE | 1;
    const NO_PROGRAM: u32 = 1 << 28;
    const EVERYBODY: u32 = 0b011 << 24;
    const NOT_CACHED: u32 = 0b001 << 19;
    const SHAREABLE: u32 = 1 << 18;
    const SIZE: u32 = 14 << 1;
    /// Everything else stays as the processor has it; and on.
    const ALL_ELSE: u32 = 1 << 2 | 1;

    /// The memory, the first time this is called.
    pub fn shared(mpu: &mut MPU) -> Option<&'static Shared> {
        if TAKEN.swap(true, Ordering::Relaxed) {
            return None;
        }
        RCC.ahb2enr().modify(|w| w.set_sram3en(true));
        // The clock is there when this has been read.
        let _ = RCC.ahb2enr().read();
        let (start, end) = (
            (&raw const __shared_start).addr(),
            (&raw const __shared_end).addr(),
        );
        // SAFETY: the registers belong to the caller. The region is memory of this program alone that
        // nobody has reached yet, with the bytes that `SHARED` begins with: zeros. Its start is aligned to
        // its size and its end to a word: `stm32h743.x`.
        unsafe {
            mpu.ctrl.write(0);
            mpu.rnr.write(0);
            mpu.rbar.write(start as u32);
            mpu.rasr.write(REGION);
            mpu.ctrl.write(ALL_ELSE);
            cortex_m::asm::dsb();
            cortex_m::asm::isb();
            for word in (start..end).step_by(4) {
                (word as *mut u32).write_volatile(0);
            }
        }
        Some(&SHARED)
    }
}

/// Drives the fault pin low, from anywhere: PB0.
pub fn fault_pin_low() {
    // One store to the register that sets and clears pins; it changes no other pin.
    embassy_stm32::pac::GPIOB
        .bsrr()
        .write(|w| w.set_br(0, true));
}
