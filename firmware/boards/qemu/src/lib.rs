//! Boards in QEMU: the same program as on real boards, with drivers for QEMU's MPS2 boards.
//!
//! `mps2-an386` is a Cortex-M4F, `mps2-an500` a Cortex-M7, each with 4 MiB of program and of data memory and the same
//! peripherals. QEMU emulates neither flash controllers nor clock trees of real parts, so the slots are a file on the
//! host: killing QEMU is a power loss.
//!
//! | file | contents |
//! |---|---|
//! | `flash` | the slots in a file |
//! | `uart` | the serial line |
//! | `nothing` | pins, a watchdog and sensors that do not exist |
//! | `wanted` | failures requested by a test |
//! | `starts` | counts starts, in a file |
//! | `bare` | all `unsafe`: registers at fixed addresses |
#![no_std]
#![deny(unsafe_code)]

mod bare;
mod flash;
mod nothing;
mod starts;
mod uart;
mod wanted;

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::syst::SystClkSource;
use defmt_semihosting as _;
use heapless::spsc::Queue;
use trueaxis::Room;
use trueaxis_firmware::controller::{Board, Heart, MainLoop, Shell, log};
use trueaxis_firmware::device::{Identity, LinkOnly, NoClock, ServoSide};
use trueaxis_firmware::double_buffer::DoubleBuffer;
use trueaxis_firmware::link::Link;
use trueaxis_firmware::mirror;
use trueaxis_firmware::record::Flags;
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_firmware::temperature::{Settings, Temperatures};

use flash::{FileFlash, SLOT};
use nothing::{NO_SENSORS, NoDog, NoPin};
use starts::Starts;
use uart::Uart;
use wanted::{Wanted, wanted};

/// Clock of SysTick, Hz.
const CLOCK: u32 = 25_000_000;

/// Time for the log, ms.
static NOW: AtomicU32 = AtomicU32::new(0);

defmt::timestamp!("{=u32:ms}", NOW.load(Ordering::Relaxed));

/// The board that QEMU replaces.
pub struct Stand {
    /// How the board names itself in the answer to hello.
    pub name: &'static str,
    /// Servo periods per second.
    pub rate: u32,
    /// How the servo keeps running while its flash is busy.
    pub while_busy: WhileBusy,
}

/// Memory of the program, for a `static mut` of `main`.
pub struct Memory<C: Room> {
    side: MaybeUninit<ServoSide<C>>,
    link: MaybeUninit<Link>,
    /// Room for more than two frames of the link.
    bytes: Queue<u8, 4096>,
    slots: mirror::Memory<SLOT>,
}

impl<C: Room> Default for Memory<C> {
    fn default() -> Self {
        Self::new()
    }
}

impl<C: Room> Memory<C> {
    /// Empty memory.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            side: MaybeUninit::uninit(),
            link: MaybeUninit::uninit(),
            bytes: Queue::new(),
            slots: mirror::Memory::new(),
        }
    }
}

/// Ends QEMU with an error.
fn stop(what: &str) -> ! {
    defmt::error!("{}", what);
    semihosting::process::exit(1)
}

/// The program: starts everything and serves the link for ever. `WRITE`: bytes of a word of the flash.
pub fn run<C: Room, const WRITE: usize>(
    stand: Stand,
    buffers: &'static DoubleBuffer<C>,
    shell: &'static Shell<C>,
    memory: &'static mut Memory<C>,
) -> ! {
    // QEMU has neither reset flags nor a fault pin.
    let restart = trueaxis_cortex_m::start(Flags::default(), || ());
    if !restart.is_fault() {
        match wanted() {
            Some(Wanted::Panic) => panic!("a test wants it"),
            Some(Wanted::Exception) => cortex_m::asm::udf(),
            None => {}
        }
    }
    let (Some(mut core), Some((loader, servo))) = (cortex_m::Peripherals::take(), buffers.split())
    else {
        stop("started twice")
    };
    let Ok(file) = FileFlash::<WRITE>::open() else {
        stop("no file for the flash")
    };
    let period = 1.0 / stand.rate as f32;
    let Memory {
        side,
        link,
        bytes,
        slots,
    } = memory;
    let flash = mirror::Mirrored::open(file, [0, SLOT as u32], stand.while_busy, slots);
    let access = shell.share(side.write(ServoSide::new(servo, period)));
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(CLOCK / stand.rate - 1);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    core.SYST.enable_interrupt();
    let board = Board {
        flash,
        port: Uart::start(bytes),
        drives_off: NoPin,
        lamp: NoPin,
        temperatures: Temperatures::new(NO_SENSORS, Settings::MACHINE),
        log,
    };
    let identity = Identity {
        firmware: concat!("trueaxis ", env!("CARGO_PKG_VERSION")),
        board: stand.name,
        period,
        restart,
    };
    let link = link.write(Link::new(&mut Starts));
    MainLoop::start(board, link, loader, access, identity).run(cortex_m::asm::wfi)
}

/// One servo period; call it from the SysTick handler.
pub fn tick<C: Room>(shell: &Shell<C>) {
    // Time in QEMU is that of its host and says nothing about the processor.
    let healthy = shell.tick(&mut LinkOnly, &mut LinkOnly, &NoClock);
    Heart::new(NoPin, NoDog).beat(shell.liveness(), healthy);
    NOW.store(shell.milliseconds(), Ordering::Relaxed);
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    trueaxis_cortex_m::stop_after(info)
}
