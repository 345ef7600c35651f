//! trueaxis in QEMU: `qemu-system-arm -machine mps2-an386 -serial tcp::4000,server,nowait …`.
#![no_std]
#![no_main]

use core::cell::RefCell;

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use critical_section::Mutex;
use defmt_semihosting as _;
use heapless::spsc::Queue;
use trueaxis_firmware::controller::{Board, MainLoop};
use trueaxis_firmware::device::{Identity, LinkOnly, NoClock};
use trueaxis_firmware::link::Link;
use trueaxis_firmware::temperature::{Settings, Temperatures};
use trueaxis_stm32f405::bare::mirror::Mirror;
use trueaxis_stm32f405::qemu::{FileFlash, NoPin, NoSensor, RELOAD, Uart};
use trueaxis_stm32f405::{PERIOD, Places, RATE, ServoSide, Shared, Shell, log};

static PLACES: Places = Places::new();
static SHELL: Shell = Shell::new(RATE);

/// Ends QEMU with an error.
fn stop(what: &str) -> ! {
    defmt::error!("{}", what);
    semihosting::process::exit(1)
}

#[entry]
fn main() -> ! {
    static mut SIDE: Option<Shared> = None;
    static mut LINK: Link = Link::new();
    // Two frames of the link.
    static mut BYTES: Queue<u8, 4096> = Queue::new();

    let (Some(mut core), Some(mirror)) = (cortex_m::Peripherals::take(), Mirror::take()) else {
        stop("started twice")
    };
    let Some((loader, driven)) = PLACES.split() else {
        stop("started twice")
    };
    let Ok(flash) = FileFlash::open(mirror) else {
        stop("no file for the flash")
    };
    let side = SIDE.insert(Mutex::new(RefCell::new(ServoSide::new(driven, PERIOD))));
    let access = SHELL.share(side);
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(RELOAD - 1);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    core.SYST.enable_interrupt();
    let board = Board {
        flash,
        port: Uart::start(BYTES),
        drives_off: NoPin,
        lamp: NoPin,
        healthy: NoPin,
        temperatures: Temperatures::<NoSensor, 0>::new([], Settings::MACHINE),
        log,
    };
    let identity = Identity {
        firmware: concat!("trueaxis ", env!("CARGO_PKG_VERSION")),
        board: "qemu mps2-an386",
        period: PERIOD,
    };
    MainLoop::start(board, LINK, loader, access, identity).run(cortex_m::asm::wfi)
}

#[exception]
fn SysTick() {
    // Time in QEMU is that of the computer it runs on, and says nothing about the processor.
    SHELL.tick(&mut LinkOnly, &mut LinkOnly, &NoClock);
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    semihosting::process::exit(101)
}
