//! trueaxis on an STM32H743. Wiring: see `stm32h743.rs` of the library.
#![no_std]
#![no_main]

use core::cell::Cell;
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
use embassy_stm32::pac::RCC;
use embassy_stm32::peripherals::{IWDG1, TIM2, USART3};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config as SpiConfig, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_stm32::usart::{BufferedInterruptHandler, BufferedUart, Config as SerialConfig};
use embassy_stm32::wdg::IndependentWatchdog;
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use trueaxis::link::{Restart, Tail};
use trueaxis_cortex_m::{Cycling, leave};
use trueaxis_firmware::controller::{Beat, Board, Heart, MainLoop, Shell, Watchdog, log};
use trueaxis_firmware::cycles::Cycles;
use trueaxis_firmware::device::{Identity, ServoSide};
use trueaxis_firmware::link::Link;
use trueaxis_firmware::places::Places;
use trueaxis_firmware::record::Flags;
use trueaxis_firmware::spi::{Polled, Tolerance};
use trueaxis_firmware::temperature::{Settings, SoftI2c, Temperatures, Tmp117, Tmp117Address};
use trueaxis_stm32h743::bare;
use trueaxis_stm32h743::stm32h743::{BAUD, CORE, SecondBank, clocks};
use trueaxis_stm32h743::{AXES, PERIOD, RATE, Tables};

embassy_stm32::bind_interrupts!(struct Lines {
    USART3 => BufferedInterruptHandler<USART3>;
});

/// The motion side: an SPI bus with one select line.
type Motion =
    Polled<ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, NoDelay>, AXES>;

/// What the servo interrupt owns.
struct Servo {
    timer: Timer<'static, TIM2>,
    motion: Motion,
    heart: Heart<Output<'static>, Dog>,
}

/// The independent watchdog.
struct Dog(IndependentWatchdog<'static, IWDG1>);

impl Watchdog for Dog {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// Nominally so long without a servo interrupt or a main loop until the watchdog bites, µs.
const BITES: u32 = 10_000;

static PLACES: Places<Tables> = Places::new();
static SHELL: Shell<Tables> = Shell::new(RATE);

defmt::timestamp!("{=u32:ms}", SHELL.milliseconds());

/// On its way from `main` to the interrupt.
static SERVO: Mutex<Cell<Option<Servo>>> = Mutex::new(Cell::new(None));

/// A start that fails is tried again: until then the fault pin is not driven, which is a fault.
fn fail(line: u32, what: &str) -> ! {
    let file = Tail::of(what);
    trueaxis_cortex_m::stop(&Restart::Panic { line, file })
}

/// Why the last reset was, as the hardware says; the next one begins with a clean slate.
fn flags() -> Flags {
    let rsr = RCC.rsr().read();
    RCC.rsr().modify(|w| w.set_rmvf(true));
    Flags {
        power_on: rsr.porrstf(),
        brown_out: rsr.borrstf(),
        watchdog: rsr.iwdg1rstf(),
        software: rsr.sftrstf(),
        pin: rsr.pinrstf(),
    }
}

/// The main loop lives, wherever it is; the time, ms.
fn alive() -> u32 {
    SHELL.liveness().main_loop();
    SHELL.milliseconds()
}

#[entry]
fn main() -> ! {
    // Their first values would be stored in flash.
    static mut SIDE: MaybeUninit<ServoSide<Tables>> = MaybeUninit::uninit();
    static mut LINK: MaybeUninit<Link> = MaybeUninit::uninit();
    // Two frames of the link each.
    static mut RECEIVED: [u8; 2048] = [0; 2048];
    static mut SENDING: [u8; 2048] = [0; 2048];

    let Some(mut core) = cortex_m::Peripherals::take() else {
        fail(line!(), "started twice")
    };
    let Some((loader, driven)) = PLACES.split() else {
        fail(line!(), "started twice")
    };
    let restart = trueaxis_cortex_m::start(flags(), bare::fault_pin_low);
    if restart.is_fault() {
        defmt::warn!("started after: {}", restart);
    }
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
        fail(line!(), "no such baud rate")
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
    let sensor_bus = SoftI2c::new(clock, data, Cycling::new(CORE));
    let sensor = Tmp117::new(sensor_bus, Tmp117Address::Ground);

    let flash = Flash::new_blocking(chip.FLASH);
    let flash = SecondBank::new(flash, core.SCB, &mut core.CPUID, alive);
    let Some(flash) = bare::mirrored(flash) else {
        fail(line!(), "started twice")
    };

    let access = SHELL.share(SIDE.write(ServoSide::new(driven, PERIOD)));
    let mut watchdog = IndependentWatchdog::new(chip.IWDG1, BITES);
    watchdog.unleash();
    let healthy = Output::new(chip.PB0, Level::Low, Speed::Low);
    let servo = Servo {
        timer,
        motion: Polled::new(device, Tolerance::USUAL),
        heart: Heart::new(healthy, Dog(watchdog)),
    };
    critical_section::with(|token| SERVO.borrow(token).set(Some(servo)));
    bare::start_servo(interrupt::TIM2);

    let board = Board {
        flash,
        port,
        drives_off: Input::new(chip.PB1, Pull::Down),
        lamp: Output::new(chip.PE1, Level::Low, Speed::Low),
        temperatures: Temperatures::new([("bed", sensor)], Settings::MACHINE),
        log,
    };
    let identity = Identity {
        firmware: concat!("trueaxis ", env!("CARGO_PKG_VERSION")),
        board: "stm32h743",
        period: PERIOD,
        restart,
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
    if let Some(Servo {
        timer,
        motion,
        heart,
    }) = OWN
    {
        // The flag that has called this.
        timer.clear_update_interrupt();
        let (mut source, mut sink) = motion.poll();
        let healthy = SHELL.tick(&mut source, &mut sink, &Cycles);
        if heart.beat(SHELL.liveness(), healthy) == Beat::Dead {
            // It is not fed any more; this is why.
            leave(&Restart::MainLoopStopped);
        }
    }
}

/// Starts again: disabled, with corrections zero, after an interval in which the fault pin is not
/// driven.
// Inlined, the compiler sees that nobody reads the message, and leaves out all that would write it.
#[allow(unused_attributes)]
#[inline(always)]
#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    trueaxis_cortex_m::stop_after(info)
}
