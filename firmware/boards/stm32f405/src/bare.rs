//! Memory and registers at fixed addresses: the only file of this crate with `unsafe`.
#![allow(unsafe_code)]

/// The table slots of the STM32F405, as `memory.x` places them.
#[cfg(feature = "stm32f405")]
pub mod slots {
    use trueaxis_firmware::slots::Slot;

    unsafe extern "C" {
        safe static __slot_a_start: u8;
        safe static __slot_a_end: u8;
        safe static __slot_b_start: u8;
        safe static __slot_b_end: u8;
    }

    /// First address of a slot, and the one behind its last.
    pub fn addresses(slot: Slot) -> [usize; 2] {
        let [start, end] = match slot {
            Slot::A => [&raw const __slot_a_start, &raw const __slot_a_end],
            Slot::B => [&raw const __slot_b_start, &raw const __slot_b_end],
        };
        [start.addr(), end.addr()]
    }

    /// The first bytes of a slot in place, at most all.
    pub fn bytes(slot: Slot, length: usize) -> &'static [u8] {
        let [start, end] = addresses(slot);
        let length = length.min(end - start);
        // SAFETY: `memory.x` gives this range to nothing else, it is flash that the processor can
        // read for as long as it runs, and every byte of it is a valid u8. The flash controller
        // changes it only for `NorFlash::erase` and `write` of the one driver, which `Slots` calls
        // for bytes of a slot that is not active, or behind its blob; of the former nobody keeps a
        // reference across a change (`TableFlash::in_place`, `Loader::vacate`), and of the latter
        // none is given away.
        unsafe { core::slice::from_raw_parts(start as *const u8, length) }
    }
}

/// In QEMU: the slots in memory, mirrored from a file.
#[cfg(feature = "qemu")]
pub mod mirror {
    use core::cell::UnsafeCell;
    use core::sync::atomic::{AtomicBool, Ordering};
    use trueaxis_firmware::slots::Slot;

    /// Bytes of a slot: those of the STM32F405.
    pub const LENGTH: usize = 256 * 1024;

    #[repr(C, align(32))]
    struct Cell(UnsafeCell<[u8; LENGTH]>);

    // SAFETY: only the one `Mirror` reaches it; see there.
    unsafe impl Sync for Cell {}

    static CELLS: [Cell; 2] = [const { Cell(UnsafeCell::new([0; LENGTH])) }; 2];
    static TAKEN: AtomicBool = AtomicBool::new(false);

    /// The slots in memory. There is one.
    pub struct Mirror(());

    impl Mirror {
        /// The mirror, the first time this is called.
        pub fn take() -> Option<Self> {
            (!TAKEN.swap(true, Ordering::Relaxed)).then_some(Self(()))
        }

        /// Bytes of a slot in place; none if they are not all within it.
        pub fn bytes(&self, slot: Slot, at: usize, length: usize) -> &'static [u8] {
            let start = CELLS[slot.index()].0.get().cast::<u8>().cast_const();
            if !is_within(at, length) {
                return &[];
            }
            // SAFETY: these bytes are within their cell, which is initialised and lives for ever.
            // They are changed by `write` alone, which needs the one `Mirror` mutably: `Slots`
            // writes only bytes of a slot that is not active, or behind its blob; of the former
            // nobody keeps a reference across a change (`TableFlash::in_place`, `Loader::vacate`),
            // and of the latter the only one is the driver's own, which ends before.
            unsafe { core::slice::from_raw_parts(start.add(at), length) }
        }

        /// Replaces bytes of a slot; false, and nothing, if they are not all within it.
        pub fn write(&mut self, slot: Slot, at: usize, bytes: &[u8]) -> bool {
            let start = CELLS[slot.index()].0.get().cast::<u8>();
            if !is_within(at, bytes.len()) {
                return false;
            }
            // SAFETY: these bytes are within their cell; `self` is the one `Mirror`, and is borrowed
            // mutably; for references to them that `bytes` has given away see there.
            let place = unsafe { core::slice::from_raw_parts_mut(start.add(at), bytes.len()) };
            place.copy_from_slice(bytes);
            true
        }
    }

    /// Whether so many bytes from a place on are within a slot.
    fn is_within(at: usize, length: usize) -> bool {
        at.checked_add(length).is_some_and(|end| end <= LENGTH)
    }
}

/// In QEMU: the first UART of the MPS2 boards, a CMSDK APB UART.
#[cfg(feature = "qemu")]
pub mod uart {
    use core::cell::RefCell;
    use cortex_m_rt::exception;
    use critical_section::Mutex;
    use heapless::spsc::Producer;

    const BASE: usize = 0x4000_4000;
    const DATA: usize = BASE;
    const STATE: usize = BASE + 4;
    const CONTROL: usize = BASE + 8;
    const INTERRUPT: usize = BASE + 12;
    const DIVIDER: usize = BASE + 16;

    /// Number of the interrupt for a byte that has come.
    const RECEIVED: u16 = 0;

    /// Where the interrupt puts what has come.
    static BYTES: Mutex<RefCell<Option<Producer<'static, u8>>>> = Mutex::new(RefCell::new(None));

    /// The number of an interrupt, for the interrupt controller.
    #[derive(Clone, Copy)]
    struct Number(u16);

    // SAFETY: the number stays the same, and this board has that interrupt.
    unsafe impl cortex_m::interrupt::InterruptNumber for Number {
        fn number(self) -> u16 {
            self.0
        }
    }

    fn read(register: usize) -> u32 {
        // SAFETY: the constants above, which are registers of this board whatever else it runs;
        // reading them changes no memory of this program.
        unsafe { (register as *const u32).read_volatile() }
    }

    fn write(register: usize, value: u32) {
        // SAFETY: as above; the UART has no access to memory.
        unsafe { (register as *mut u32).write_volatile(value) }
    }

    /// Enables both directions; what comes goes to `bytes`. QEMU ignores the rate.
    pub fn start(bytes: Producer<'static, u8>) {
        critical_section::with(|token| BYTES.borrow(token).replace(Some(bytes)));
        write(DIVIDER, 16);
        // Transmit, receive, interrupt on receive.
        write(CONTROL, 0b1011);
        // SAFETY: the handler is below; what it shares is in a `Mutex` of `critical_section`.
        unsafe { cortex_m::peripheral::NVIC::unmask(Number(RECEIVED)) };
    }

    /// A byte can be sent.
    pub fn writable() -> bool {
        read(STATE) & 0b01 == 0
    }

    /// Sends a byte.
    pub fn send(byte: u8) {
        write(DATA, byte.into());
    }

    /// All interrupts but the one of SysTick: only that of a byte is enabled.
    // SAFETY: called by the processor alone; it may interrupt anything but a critical section, and
    // touches only what is behind one.
    #[exception]
    unsafe fn DefaultHandler(_: i16) {
        write(INTERRUPT, 0b10);
        while read(STATE) & 0b10 != 0 {
            let byte = (read(DATA) & 0xFF) as u8;
            critical_section::with(|token| {
                if let Some(bytes) = BYTES.borrow_ref_mut(token).as_mut() {
                    // Without room it is lost, and so is its frame, which is asked for again.
                    let _ = bytes.enqueue(byte);
                }
            });
        }
    }
}

/// Lets interrupts come, whose handlers are in place.
#[cfg(feature = "stm32f405")]
pub fn start_interrupts<const N: usize>(
    nvic: &mut cortex_m::peripheral::NVIC,
    interrupts: [stm32f4xx_hal::pac::Interrupt; N],
) {
    for interrupt in interrupts {
        // SAFETY: no code of this crate relies on an interrupt being masked by its priority or by
        // its enable bit: what handlers share with the main loop is in a `Mutex` of
        // `critical_section`, which masks all of them.
        unsafe {
            // All the same: none interrupts another.
            nvic.set_priority(interrupt, 0x10);
            cortex_m::peripheral::NVIC::unmask(interrupt);
        }
    }
}
