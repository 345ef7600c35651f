//! The firmware of the board in QEMU: `qemu-system-arm -machine mps2-an386 -serial tcp::4000,server,nowait …`.
#![no_std]
#![no_main]

use cortex_m_rt::{entry, exception};
use trueaxis_firmware::controller::Shell;
use trueaxis_firmware::double_buffer::DoubleBuffer;
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_qemu::{Memory, Stand};
use trueaxis_stm32f405::{RATE, Tables};

static BUFFERS: DoubleBuffer<Tables> = DoubleBuffer::new();
static SHELL: Shell<Tables> = Shell::new(RATE);

#[entry]
fn main() -> ! {
    static mut MEMORY: Memory<Tables> = Memory::new();

    let stand = Stand {
        name: "qemu mps2-an386",
        rate: RATE,
        // As on the STM32F405, so that the same behaviour is tested here.
        while_busy: WhileBusy::Standstill,
    };
    trueaxis_qemu::run::<_, 4>(stand, &BUFFERS, &SHELL, MEMORY)
}

#[exception]
fn SysTick() {
    trueaxis_qemu::tick(&SHELL);
}
