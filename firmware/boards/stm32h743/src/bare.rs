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

/// Length of a slot in bytes, as placed by `memory.x`.
pub const SLOT: usize = 256 * 1024;

/// Number of bytes that share an error-correcting code.
const WORD: usize = 32;

/// Configuration and control register of the processor, and its fault status register (Arm v7-M reference manual,
/// B3.2.8 and B3.2.15).
const CCR: *mut u32 = 0xE000_ED14 as *mut u32;
const CFSR: *mut u32 = 0xE000_ED28 as *mut u32;
/// In the first: bus faults are ignored at priorities that nothing can interrupt.
const BFHFNMIGN: u32 = 1 << 8;
/// In the second: all bus faults.
const BUS_FAULTS: u32 = 0xFF00;

unsafe extern "C" {
    safe static __slot_a_start: u8;
    safe static __slot_b_start: u8;
}

/// The mirror, in memory that is not initialised before the program starts.
#[unsafe(link_section = ".mirror")]
static mut MIRROR: MaybeUninit<Memory<SLOT>> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

/// The slots, mirrored in memory; on the first call only.
///
/// While bank 2 is busy the servo reads neither program nor samples there.
pub fn mirrored(flash: SecondBank) -> Option<Mirrored<SecondBank, SLOT>> {
    if TAKEN.swap(true, Ordering::Relaxed) {
        return None;
    }
    let starts = [&raw const __slot_a_start, &raw const __slot_b_start];
    let starts = starts.map(|start| start.addr() as u32 - 0x0800_0000);
    // SAFETY: the mirror is accessed only here, and once. Zeros are a valid `Memory`, as returned by `Memory::new`.
    let memory = unsafe {
        let memory = &raw mut MIRROR;
        memory.write_bytes(0, 1);
        (*memory).assume_init_mut()
    };
    Some(Mirrored::open(flash, starts, WhileBusy::DualBank, memory))
}

/// Copies bytes of the flash; returns false if the error-correcting code of one of their words reports an error, for
/// which any other access would be a bus fault. Interrupts are blocked for the time of one word.
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

/// Reads bytes of one word.
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
    // SAFETY: two registers of the processor, which no other code of this program accesses. At the second-highest
    // priority, set by `cpsid f`, a bus fault is ignored and the data read is arbitrary; the fault is over before
    // `cpsie f`. The addresses are within the flash, as checked by the caller, and nothing writes there meanwhile.
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
        // Writing a one clears a bit.
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

/// Enables interrupts whose handlers are in place, all with the highest priority.
pub fn start_interrupts<const N: usize>(interrupts: [Interrupt; N]) {
    for interrupt in interrupts {
        interrupt.set_priority(Priority::P0);
        // SAFETY: no code of this crate relies on masking the interrupt by its enable bit: everything that its handler
        // shares with the main loop is in a `Mutex` of `critical_section`.
        unsafe { interrupt.enable() };
    }
}

/// Memory that DMA1 and DMA2 can reach, unlike that of the other data, and that the data cache does not cache.
pub mod shared {
    use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

    use cortex_m::peripheral::MPU;
    use embassy_stm32::pac::RCC;
    use trueaxis_firmware::controller::LineMemory;

    use crate::stm32h743::LENGTH;

    /// Memory shared by hardware and program.
    pub struct Shared {
        /// Buffers of the serial line.
        pub line: LineMemory,
        /// The received frame of the motion side.
        pub received: [AtomicU8; LENGTH],
        /// The answer to send.
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

    /// Region 0: 32 KiB (2¹⁵) of normal, uncached memory, readable and writable by all, not executable (Arm v7-M
    /// reference manual, B3.5.9).
    const REGION: u32 = NO_PROGRAM | EVERYBODY | NOT_CACHED | SHAREABLE | SIZE | 1;
    const NO_PROGRAM: u32 = 1 << 28;
    const EVERYBODY: u32 = 0b011 << 24;
    const NOT_CACHED: u32 = 0b001 << 19;
    const SHAREABLE: u32 = 1 << 18;
    const SIZE: u32 = 14 << 1;
    /// Everything else keeps the processor's default map; enabled.
    const ALL_ELSE: u32 = 1 << 2 | 1;

    /// The memory; on the first call only.
    pub fn shared(mpu: &mut MPU) -> Option<&'static Shared> {
        if TAKEN.swap(true, Ordering::Relaxed) {
            return None;
        }
        RCC.ahb2enr().modify(|w| w.set_sram3en(true));
        // The clock runs once this has been read.
        let _ = RCC.ahb2enr().read();
        let (start, end) = (
            (&raw const __shared_start).addr(),
            (&raw const __shared_end).addr(),
        );
        // SAFETY: the registers belong to the caller. The region is used only by this program and has not been accessed
        // yet; it receives the initial bytes of `SHARED`: zeros. Its start is aligned to its size and its end to a
        // word: `stm32h743.x`.
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

/// Drives the fault pin, PB0, low; may be called from anywhere.
pub fn fault_pin_low() {
    // One store to the register that sets and clears pins; it affects no other pin.
    embassy_stm32::pac::GPIOB
        .bsrr()
        .write(|w| w.set_br(0, true));
}
