//! Memory and registers at fixed addresses: the only file of this crate with `unsafe`.
#![allow(unsafe_code)]

/// The table slots of the STM32F405, as `memory.x` places them.
pub mod slots {
    use trueaxis_firmware::slots::{Mapped, Slot};

    unsafe extern "C" {
        safe static __slot_a_start: u8;
        safe static __slot_a_end: u8;
        safe static __slot_b_start: u8;
        safe static __slot_b_end: u8;
    }

    /// First address of a slot, and the address after its end.
    pub fn addresses(slot: Slot) -> [usize; 2] {
        let [start, end] = match slot {
            Slot::A => [&raw const __slot_a_start, &raw const __slot_a_end],
            Slot::B => [&raw const __slot_b_start, &raw const __slot_b_end],
        };
        [start.addr(), end.addr()]
    }

    /// The first bytes of a slot in place, limited to its length.
    pub fn bytes(slot: Slot, length: usize) -> Mapped {
        let [start, end] = addresses(slot);
        let length = length.min(end - start);
        // SAFETY: `memory.x` reserves this range for the slots, it is flash that the processor can always read, and
        // every byte of it is a valid u8. The flash controller changes it only in `NorFlash::erase` and `write` of the
        // one driver: there is one `FLASH`.
        unsafe { Mapped::new(start as *const u8, length) }
    }
}

/// Enables interrupts whose handlers are in place, all with the highest priority.
pub fn start_interrupts<const N: usize>(
    nvic: &mut cortex_m::peripheral::NVIC,
    interrupts: [stm32f4xx_hal::pac::Interrupt; N],
) {
    for interrupt in interrupts {
        // SAFETY: no code of this crate relies on masking an interrupt by its priority or its enable bit: everything
        // that handlers share with the main loop is in a `Mutex` of `critical_section`, which masks all of them.
        unsafe {
            nvic.set_priority(interrupt, 0);
            cortex_m::peripheral::NVIC::unmask(interrupt);
        }
    }
}

/// DMA between the data register of a peripheral and the bytes of a static.
pub mod dma {
    use core::sync::atomic::{AtomicU8, Ordering, fence};
    use stm32f4xx_hal::dma::traits::Stream;
    use stm32f4xx_hal::dma::{DmaChannel, DmaDataSize, DmaDirection};

    /// Address of a data register.
    #[derive(Clone, Copy)]
    #[repr(u32)]
    pub enum End {
        /// Of SPI1.
        Spi1 = 0x4001_300C,
        /// Of USART2.
        Usart2 = 0x4000_4404,
    }

    /// Starts a transfer of all `bytes`, once or cyclically.
    pub fn start<S: Stream>(
        stream: &mut S,
        channel: DmaChannel,
        direction: DmaDirection,
        end: End,
        bytes: &'static [AtomicU8],
        again: bool,
    ) {
        stop(stream);
        // No static of this chip is longer: the RAM has 128 KiB, and the longest of these is 4 KiB.
        let count = u16::try_from(bytes.len()).unwrap_or(0);
        stream.set_channel(channel);
        stream.set_direction(direction);
        stream.set_peripheral_address(end as u32);
        stream.set_memory_address(bytes.as_ptr() as u32);
        stream.set_number_of_transfers(count);
        stream.set_memory_increment(true);
        stream.set_peripheral_increment(false);
        stream.set_circular_mode(again);
        stream.set_fifo_enable(false);
        // Earlier stores must be visible to the hardware.
        fence(Ordering::SeqCst);
        // SAFETY: all registers are set: bytes on both ends, the address of a data register, and the number of bytes.
        // They live for ever, and the program accesses them atomically, so it does not matter when the hardware does.
        unsafe {
            stream.set_memory_size(DmaDataSize::Byte);
            stream.set_peripheral_size(DmaDataSize::Byte);
            stream.enable();
        }
    }

    /// Ends a transfer at any point.
    pub fn stop<S: Stream>(stream: &mut S) {
        // SAFETY: the stream keeps the number of transferred bytes; the remaining bytes are those of an earlier
        // transfer, which are valid too.
        unsafe { stream.disable() };
        while stream.is_enabled() {}
        stream.clear_all_flags();
        // Later reads must see what the hardware has written.
        fence(Ordering::SeqCst);
    }
}

/// Resets SPI1 from any state; its clock keeps running.
pub fn reset_spi1(_: &mut stm32f4xx_hal::pac::SPI1) {
    use stm32f4xx_hal::pac::SPI1;
    use stm32f4xx_hal::rcc::Reset;
    // SAFETY: the driver sets and clears the one bit through its alias in the bit band, in a single access each, so
    // other users of that register are not disturbed. The caller owns SPI1.
    unsafe { SPI1::reset_unchecked() };
}

/// The independent watchdog, which the servo interrupt feeds and the main loop adjusts.
pub mod iwdg {
    use stm32f4xx_hal::pac::IWDG;

    fn registers() -> &'static stm32f4xx_hal::pac::iwdg::RegisterBlock {
        // SAFETY: the registers of a peripheral used by nothing else in this program. After each function below, any
        // other may be called at any time.
        unsafe { &*IWDG::ptr() }
    }

    fn key(key: u16) {
        // SAFETY: the keys below are those of RM0090, 21.4.1.
        registers().kr().write(|w| unsafe { w.key().bits(key) });
    }

    /// Starts counting.
    pub fn start() {
        key(0xCCCC);
    }

    /// Restarts the count. Interrupting a `set` would end it, so this must be masked during that.
    pub fn feed() {
        key(0xAAAA);
    }

    /// Whether a change is in progress.
    pub fn is_changing() -> bool {
        let state = registers().sr().read();
        state.pvu().bit_is_set() || state.rvu().bit_is_set()
    }

    /// Sets the prescaler 4 · 2ⁿ and the reload value from which it counts down.
    pub fn set(prescaler: u8, reload: u16) {
        key(0x5555);
        // SAFETY: all values of three and of twelve bits are valid.
        unsafe {
            registers().pr().write(|w| w.pr().bits(prescaler & 0b111));
            registers().rlr().write(|w| w.rl().bits(reload & 0xFFF));
        }
        key(0xAAAA);
    }
}

/// Drives the fault pin, PB0, low; may be called from anywhere.
pub fn fault_pin_low() {
    // SAFETY: one store to the register that sets and clears pins; it affects no other pin.
    unsafe {
        (*stm32f4xx_hal::pac::GPIOB::ptr())
            .bsrr()
            .write(|w| w.br0().set_bit());
    }
}
