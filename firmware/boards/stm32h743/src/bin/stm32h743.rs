//! trueaxis on an STM32H743. Wiring: see `stm32h743.rs` of the library.
#![no_std]
#![no_main]

use core::cell::Cell;
use core::mem::MaybeUninit;

use cortex_m::peripheral::DWT;
use cortex_m_rt::{entry, exception};
use critical_section::Mutex;
use embassy_stm32::Peri;
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{AnyPin, Input, Level, Output, OutputOpenDrain, Pull, Speed};
use embassy_stm32::interrupt::{self, Interrupt};
use embassy_stm32::peripherals::IWDG1;
use embassy_stm32::usart::{Config as SerialConfig, Uart};
use embassy_stm32::wdg::IndependentWatchdog;
use trueaxis::link::{Restart, Tail};
use trueaxis_cortex_m::{Cycling, leave, stop};
#[cfg(not(feature = "log"))]
use trueaxis_firmware::controller::Event;
use trueaxis_firmware::controller::{Beat, Board, ByFrames, Heart, MainLoop, Shell, Watchdog};
use trueaxis_firmware::cycles::Cycles;
use trueaxis_firmware::device::{Identity, ServoSide};
use trueaxis_firmware::double_buffer::DoubleBuffer;
use trueaxis_firmware::link::Link;
use trueaxis_firmware::spi::Tolerance;
use trueaxis_firmware::temperature::{Settings, Temperatures};
use trueaxis_sensors::{SoftI2c, Tmp117, Tmp117Address};
use trueaxis_stm32h743::bare;
use trueaxis_stm32h743::stm32h743::dma::Stream;
use trueaxis_stm32h743::stm32h743::{
    BAUD, CORE, Motion, Random, SecondBank, Serial, Silence, clocks, supply,
};
use trueaxis_stm32h743::{AXES, PERIOD, RATE, Tables};
#[cfg(feature = "log")]
use {defmt_rtt as _, trueaxis_firmware::controller::log};

/// State owned by the servo interrupt.
struct Servo {
    frames: ByFrames<Motion, Silence, AXES>,
    heart: Heart<Output<'static>, Dog>,
}

/// The independent watchdog.
struct Dog(IndependentWatchdog<'static, IWDG1>);

impl Watchdog for Dog {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// Nominal watchdog timeout without a servo interrupt or a main loop, µs.
const BITES: u32 = 10_000;

static BUFFERS: DoubleBuffer<Tables> = DoubleBuffer::new();
static SHELL: Shell<Tables> = Shell::new(RATE);

#[cfg(feature = "log")]
defmt::timestamp!("{=u32:ms}", SHELL.milliseconds());

/// Without a probe nobody reads events.
#[cfg(not(feature = "log"))]
fn log(_: Event) {}

/// Holds it between servo interrupts.
static SERVO: Mutex<Cell<Option<&'static mut Servo>>> = Mutex::new(Cell::new(None));

/// A failed start is repeated; until it succeeds the fault pin is not driven, which signals a fault.
fn fail(line: u32, what: &str) -> ! {
    let file = Tail::of(what);
    stop(&Restart::Panic { line, file })
}

/// Reports that the main loop is alive, from anywhere; returns the time, ms.
fn alive() -> u32 {
    SHELL.liveness().main_loop();
    SHELL.milliseconds()
}

#[entry]
fn main() -> ! {
    // Otherwise their initial values would be stored in flash.
    static mut SIDE: MaybeUninit<ServoSide<Tables>> = MaybeUninit::uninit();
    static mut OWN: MaybeUninit<Servo> = MaybeUninit::uninit();
    static mut LINK: MaybeUninit<Link> = MaybeUninit::uninit();

    let Some(mut core) = cortex_m::Peripherals::take() else {
        fail(line!(), "started twice")
    };
    let Some((loader, servo)) = BUFFERS.split() else {
        fail(line!(), "started twice")
    };
    let restart = trueaxis_cortex_m::start(supply::flags(), bare::fault_pin_low);
    // Without its clock it waits here, with the fault pin low.
    let chip = embassy_stm32::init(clocks());
    supply::watch_clock();
    supply::wait_for_probe();
    supply::watch_over();
    core.DCB.enable_trace();
    DWT::unlock();
    core.DWT.enable_cycle_counter();

    let Some(memory) = bare::shared::shared(&mut core.MPU) else {
        fail(line!(), "started twice")
    };
    let mut rate = SerialConfig::default();
    rate.baudrate = BAUD;
    let Ok(line) = Uart::new_blocking(chip.USART3, chip.PD9, chip.PD8, rate) else {
        fail(line!(), "no such baud rate")
    };
    let receive = Stream::usart3_receives(chip.DMA1_CH0);
    let port = Serial::start(line, receive, Stream::usart3_sends(chip.DMA1_CH1), memory);

    let pins = (chip.PA4, chip.PA5, chip.PA6, chip.PD7);
    let receive = Stream::spi1_receives(chip.DMA2_CH0);
    let send = Stream::spi1_sends(chip.DMA2_CH1);
    let motion = Motion::new(chip.SPI1, pins, receive, send, memory);

    let [clock, data] = [chip.PB8.into(), chip.PB9.into()].map(|pin: Peri<'_, AnyPin>| {
        OutputOpenDrain::new_pull(pin, Level::High, Speed::Low, Pull::Up)
    });
    let sensor_bus = SoftI2c::new(clock, data, Cycling::new(CORE));
    let mut sensor = Tmp117::new(sensor_bus, Tmp117Address::Ground);

    let flash = Flash::new_blocking(chip.FLASH);
    let flash = SecondBank::new(flash, core.SCB, &mut core.CPUID, alive);
    let Some(flash) = bare::mirrored(flash) else {
        fail(line!(), "started twice")
    };

    let access = SHELL.share(SIDE.write(ServoSide::new(servo, PERIOD)));
    let mut watchdog = IndependentWatchdog::new(chip.IWDG1, BITES);
    watchdog.unleash();
    let healthy = Output::new(chip.PB0, Level::Low, Speed::Low);
    let silence = Silence::start(chip.TIM2);
    let own = OWN.write(Servo {
        frames: ByFrames::start(motion, silence, Tolerance::USUAL),
        heart: Heart::new(healthy, Dog(watchdog)),
    });
    critical_section::with(|token| SERVO.borrow(token).set(Some(own)));
    bare::start_interrupts([Interrupt::EXTI4, Interrupt::TIM2]);

    let board = Board {
        flash,
        port,
        drives_off: Input::new(chip.PB1, Pull::Down),
        lamp: Output::new(chip.PE1, Level::Low, Speed::Low),
        temperatures: Temperatures::new([("bed", || sensor.celsius())], Settings::MACHINE),
        log,
    };
    let identity = Identity {
        firmware: concat!("trueaxis ", env!("CARGO_PKG_VERSION")),
        board: "stm32h743",
        period: PERIOD,
        restart,
    };
    let link = LINK.write(Link::new(&mut Random::new(chip.RNG)));
    MainLoop::start(board, link, loader, access, identity).run(cortex_m::asm::wfi)
}

/// One servo period: a frame has ended, or none has arrived in time.
#[inline(never)] // Once, for both interrupts.
fn servo() {
    let Some(own) = critical_section::with(|token| SERVO.borrow(token).take()) else {
        return;
    };
    if let Some(healthy) = own.frames.period(&SHELL, &Cycles)
        && own.heart.beat(SHELL.liveness(), healthy) == Beat::Dead
    {
        // The watchdog is no longer fed; this is the reason.
        leave(&Restart::MainLoopStopped);
    }
    critical_section::with(|token| SERVO.borrow(token).set(Some(own)));
}

#[embassy_stm32::interrupt]
fn EXTI4() {
    servo();
}

#[embassy_stm32::interrupt]
fn TIM2() {
    servo();
}

/// The external clock has stopped; the processor continues with its internal oscillator.
// SAFETY: called only by the processor, and it does not return.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    stop(&Restart::ClockStopped)
}

/// Restarts: disabled, with corrections at zero, after an interval in which the fault pin is not driven.
// When inlined, the compiler sees that the message is never read, and omits all code that would write it.
#[allow(unused_attributes)]
#[inline(always)]
#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    trueaxis_cortex_m::stop_after(info)
}
