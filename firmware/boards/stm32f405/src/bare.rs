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

    /// First address of a slot, and the one behind its last.
    pub fn addresses(slot: Slot) -> [usize; 2] {
        let [start, end] = match slot {
            Slot::A => [&raw const __slot_a_start, &raw const __slot_a_end],
            Slot::B => [&raw const __slot_b_start, &raw const __slot_b_end],
        };
        [start.addr(), end.addr()]
    }

    /// The first bytes of a slot in place, at most all.
    pub fn bytes(slot: Slot, length: usize) -> Mapped {
        let [start, end] = addresses(slot);
        let length = length.min(end - start);
        // SAFETY: `memory.x` gives this range to nothing else, it is flash that the processor can
        // read for as long as it runs, and every byte of it is a valid u8. The flash controller
        // changes it only for `NorFlash::erase` and `write` of the one driver: there is one `FLASH`.
        unsafe { Mapped::new(start as *const u8, length) }
    }
}

/// Lets interrupts come, whose handlers are in place: of the highest priority, all the same.
pub fn start_interrupts<const N: usize>(
    nvic: &mut cortex_m::peripheral::NVIC,
    interrupts: [stm32f4xx_hal::pac::Interrupt; N],
) {
    for interrupt in interrupts {
        // SAFETY: no code of this crate relies on an interrupt being masked by its priority or by
        // its enable bit: what handlers share with the main loop is in a `Mutex` of
        // `critical_section`, which masks all of them.
        unsafe {
            nvic.set_priority(interrupt, 0);
            cortex_m::peripheral::NVIC::unmask(interrupt);
        }
    }
}

/// DMA between the data register of a peripheral and bytes of a static.
pub mod dma {
    use core::sync::atomic::{AtomicU8, Ordering, fence};
    use stm32f4xx_hal::dma::traits::Stream;
    use stm32f4xx_hal::dma::{DmaChannel, DmaDataSize, DmaDirection};

    /// A data register: its address.
    #[derive(Clone, Copy)]
    #[repr(u32)]
    pub enum End {
        /// Of SPI1.
        Spi1 = 0x4001_300C,
        /// Of USART2.
        Usart2 = 0x4000_4404,
    }

    /// Starts a transfer of all `bytes`, or of all of them again and again.
    pub fn start<S: Stream>(
        stream: &mut S,
        channel: DmaChannel,
        direction: DmaDirection,
        end: End,
        bytes: &'static [AtomicU8],
        again: bool,
    ) {
        stop(stream);
        // No static of this chip has more: the RAM has 128 KiB, and the longest of these 4.
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
        // What has been stored before is there when the hardware reads it.
        fence(Ordering::SeqCst);
        // SAFETY: all registers are set: bytes on both ends, an address of a data register, and as
        // many bytes as there are. They live for ever, and whoever reads or writes them does so
        // atomically, so it does not matter when the hardware does.
        unsafe {
            stream.set_memory_size(DmaDataSize::Byte);
            stream.set_peripheral_size(DmaDataSize::Byte);
            stream.enable();
        }
    }

    /// Ends a transfer wherever it is.
    pub fn stop<S: Stream>(stream: &mut S) {
        // SAFETY: how many bytes have been transferred stays in the stream; whoever reads the others
        // finds those of an earlier transfer, which are bytes too.
        unsafe { stream.disable() };
        while stream.is_enabled() {}
        stream.clear_all_flags();
        // What is read after this is what the hardware has written.
        fence(Ordering::SeqCst);
    }
}

/// Takes everything out of SPI1, whatever state it is in; its clock goes on.
pub fn reset_spi1(_: &mut stm32f4xx_hal::pac::SPI1) {
    use stm32f4xx_hal::pac::SPI1;
    use stm32f4xx_hal::rcc::Reset;
    // SAFETY: the driver sets and clears the one bit by its alias in the bit band, in one access each;
    // whoever else uses that register is not disturbed. The caller has SPI1.
    unsafe { SPI1::reset_unchecked() };
}

/// The independent watchdog, which the servo interrupt feeds and the main loop adjusts.
pub mod iwdg {
    use stm32f4xx_hal::pac::IWDG;

    fn registers() -> &'static stm32f4xx_hal::pac::iwdg::RegisterBlock {
        // SAFETY: the registers of a peripheral that nothing else of this program uses. Each
        // function below leaves them so that any other may follow, at any time.
        unsafe { &*IWDG::ptr() }
    }

    fn key(key: u16) {
        // SAFETY: the keys below are those of RM0090, 21.4.1.
        registers().kr().write(|w| unsafe { w.key().bits(key) });
    }

    /// It begins to count.
    pub fn start() {
        key(0xCCCC);
    }

    /// It begins to count anew. Ends a `set` that it interrupts, so that must be masked.
    pub fn feed() {
        key(0xAAAA);
    }

    /// A change is on its way.
    pub fn is_changing() -> bool {
        let state = registers().sr().read();
        state.pvu().bit_is_set() || state.rvu().bit_is_set()
    }

    /// Prescaler 4 · 2ⁿ and the count from which it counts down.
    pub fn set(prescaler: u8, reload: u16) {
        key(0x5555);
        // SAFETY: every value of three and of twelve bits has a meaning.
        unsafe {
            registers().pr().write(|w| w.pr().bits(prescaler & 0b111));
            registers().rlr().write(|w| w.rl().bits(reload & 0xFFF));
        }
        key(0xAAAA);
    }
}

/// Drives the fault pin low, from anywhere: PB0.
pub fn fault_pin_low() {
    // SAFETY: one store to the register that sets and clears pins; it changes no other pin.
    unsafe {
        (*stm32f4xx_hal::pac::GPIOB::ptr())
            .bsrr()
            .write(|w| w.br0().set_bit());
    }
}
