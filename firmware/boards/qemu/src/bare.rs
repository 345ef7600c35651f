//! Registers at fixed addresses: the only file of this crate with `unsafe`.
#![allow(unsafe_code)]

/// The first UART of the MPS2 boards, a CMSDK APB UART.
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

    /// Number of the interrupt for a received byte.
    const RECEIVED: u16 = 0;

    /// Queue into which the interrupt puts received bytes.
    static BYTES: Mutex<RefCell<Option<Producer<'static, u8>>>> = Mutex::new(RefCell::new(None));

    /// The number of an interrupt, for the interrupt controller.
    #[derive(Clone, Copy)]
    struct Number(u16);

    // SAFETY: the number is constant, and this board has that interrupt.
    unsafe impl cortex_m::interrupt::InterruptNumber for Number {
        fn number(self) -> u16 {
            self.0
        }
    }

    fn read(register: usize) -> u32 {
        // SAFETY: the constants above are registers of this board in any case; reading them does not change memory of
        // this program.
        unsafe { (register as *const u32).read_volatile() }
    }

    fn write(register: usize, value: u32) {
        // SAFETY: as above; the UART has no access to memory.
        unsafe { (register as *mut u32).write_volatile(value) }
    }

    /// Enables both directions; received bytes go to `bytes`. QEMU ignores the baud rate.
    pub fn start(bytes: Producer<'static, u8>) {
        critical_section::with(|token| BYTES.borrow(token).replace(Some(bytes)));
        write(DIVIDER, 16);
        // Transmit, receive, interrupt on receive.
        write(CONTROL, 0b1011);
        // SAFETY: the handler is below; what it shares is in a `Mutex` of `critical_section`.
        unsafe { cortex_m::peripheral::NVIC::unmask(Number(RECEIVED)) };
    }

    /// Whether a byte can be sent.
    pub fn writable() -> bool {
        read(STATE) & 0b01 == 0
    }

    /// Sends a byte.
    pub fn send(byte: u8) {
        write(DATA, byte.into());
    }

    /// Handles all interrupts except SysTick; only that of a received byte is enabled.
    // SAFETY: called only by the processor. It may interrupt anything but a critical section, and accesses only data
    // that is protected by one.
    #[exception]
    unsafe fn DefaultHandler(_: i16) {
        write(INTERRUPT, 0b10);
        while read(STATE) & 0b10 != 0 {
            let byte = (read(DATA) & 0xFF) as u8;
            critical_section::with(|token| {
                if let Some(bytes) = BYTES.borrow_ref_mut(token).as_mut() {
                    // If there is no room the byte is lost, and so is its frame, which is then requested again.
                    let _ = bytes.enqueue(byte);
                }
            });
        }
    }
}
