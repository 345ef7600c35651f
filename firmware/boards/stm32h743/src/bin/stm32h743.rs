//! trueaxis on an STM32H743. Wiring: see `stm32h743.rs` of the library.
#![no_std]
#![no_main]

use core::cell::{Cell, RefCell};
use core::mem::MaybeUninit;

use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use critical_section::Mutex;
use defmt_rtt as _;
use embassy_stm32::Peri;
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{AnyPin, Input, Level, Output, OutputOpenDrain, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{TIM2, USART3};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config as SpiConfig, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_stm32::usart::{BufferedInterruptHandler, BufferedUart, Config as SerialConfig};
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use trueaxis_firmware::controller::{Board, MainLoop, Shared, Shell, log};
use trueaxis_firmware::cycles::Cycles;
use trueaxis_firmware::device::{Identity, ServoSide};
use trueaxis_firmware::link::Link;
use trueaxis_firmware::places::Places;
use trueaxis_firmware::spi::SpiMotion;
use trueaxis_firmware::temperature::{Settings, SoftI2c, Temperatures, Tmp117, Tmp117Address};
use trueaxis_stm32h743::bare;
use trueaxis_stm32h743::stm32h743::{BAUD, Cycling, SecondBank, clocks};
use trueaxis_stm32h743::{PERIOD, RATE, Tables};

embassy_stm32::bind_interrupts!(struct Lines {
    USART3 => BufferedInterruptHandler<USART3>;
});

/// The motion side: an SPI bus with one select line.
type Motion = SpiMotion<ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, NoDelay>>;

/// What the servo interrupt owns.
struct Servo {
    timer: Timer<'static, TIM2>,
    motion: Motion,
}

static PLACES: Places<Tables> = Places::new();
static SHELL: Shell<Tables> = Shell::new(RATE);
/// On its way from `main` to the interrupt.
static SERVO: Mutex<Cell<Option<Servo>>> = Mutex::new(Cell::new(None));

/// A start that fails is tried again: until then the fault pin is not driven, which is a fault.
fn stop(what: &str) -> ! {
    defmt::error!("{}", what);
    cortex_m::peripheral::SCB::sys_reset()
}

#[entry]
fn main() -> ! {
    // Their first values would be stored in flash.
    static mut SIDE: MaybeUninit<Shared<Tables>> = MaybeUninit::uninit();
    static mut LINK: MaybeUninit<Link> = MaybeUninit::uninit();
    // Two frames of the link each.
    static mut RECEIVED: [u8; 2048] = [0; 2048];
    static mut SENDING: [u8; 2048] = [0; 2048];

    let Some(mut core) = cortex_m::Peripherals::take() else {
        stop("started twice")
    };
    let Some((loader, driven)) = PLACES.split() else {
        stop("started twice")
    };
    let chip = embassy_stm32::init(clocks());
    core.DCB.enable_trace();
    DWT::unlock();
    core.DWT.enable_cycle_counter();

    let mut rate = SerialConfig::default();
    rate.baudrate = BAUD;
    let port = BufferedUart::new(
        chip.USART3,
        chip.PD9,
        chip.PD8,
        SENDING,
        RECEIVED,
        Lines,
        rate,
    );
    let Ok(port) = port else {
        stop("no such baud rate")
    };
    // The servo comes first.
    interrupt::USART3.set_priority(Priority::P1);

    let mut config = SpiConfig::default();
    config.frequency = Hertz(10_000_000);
    let bus = Spi::new_blocking(chip.SPI1, chip.PA5, chip.PD7, chip.PA6, config);
    let select = Output::new(chip.PA4, Level::High, Speed::High);
    let Ok(device) = ExclusiveDevice::new_no_delay(bus, select);
    let timer = Timer::new(chip.TIM2);
    timer.set_frequency(Hertz(RATE), RoundTo::Faster);
    timer.enable_update_interrupt(true);
    timer.start();

    let [clock, data] = [chip.PB8.into(), chip.PB9.into()].map(|pin: Peri<'_, AnyPin>| {
        OutputOpenDrain::new_pull(pin, Level::High, Speed::Low, Pull::Up)
    });
    let sensor_bus = SoftI2c::new(clock, data, Cycling);
    let sensor = Tmp117::new(sensor_bus, Tmp117Address::Ground);

    let flash = Flash::new_blocking(chip.FLASH);
    let flash = SecondBank::new(flash, core.SCB, &mut core.CPUID);
    let Some(flash) = bare::mirrored(flash) else {
        stop("started twice")
    };

    let side = SIDE.write(Mutex::new(RefCell::new(ServoSide::new(driven, PERIOD))));
    let access = SHELL.share(side);
    critical_section::with(|token| {
        let motion = SpiMotion::new(device);
        SERVO.borrow(token).set(Some(Servo { timer, motion }));
    });
    bare::start_servo(interrupt::TIM2);

    let board = Board {
        flash,
        port,
        drives_off: Input::new(chip.PB1, Pull::Down),
        lamp: Output::new(chip.PE1, Level::Low, Speed::Low),
        healthy: Output::new(chip.PB0, Level::Low, Speed::Low),
        temperatures: Temperatures::new([("bed", sensor)], Settings::MACHINE),
        log,
    };
    let identity = Identity {
        firmware: concat!("trueaxis ", env!("CARGO_PKG_VERSION")),
        board: "stm32h743",
        period: PERIOD,
    };
    let link = LINK.write(Link::new());
    MainLoop::start(board, link, loader, access, identity).run(cortex_m::asm::wfi)
}

#[embassy_stm32::interrupt]
fn TIM2() {
    static mut OWN: Option<Servo> = None;

    if OWN.is_none() {
        *OWN = critical_section::with(|token| SERVO.borrow(token).take());
    }
    if let Some(Servo { timer, motion }) = OWN {
        // The flag that has called this.
        timer.clear_update_interrupt();
        let (mut source, mut sink) = motion.ends();
        SHELL.tick(&mut source, &mut sink, &Cycles);
    }
}

/// Starts again: disabled, with corrections zero, after an interval in which the fault pin is not
/// driven.
#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    // Without the message, for which the program would have to know how everything is written.
    if let Some(place) = info.location() {
        defmt::error!("panic in {}, line {}", place.file(), place.line());
    }
    cortex_m::peripheral::SCB::sys_reset()
}
