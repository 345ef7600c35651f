//! trueaxis on an STM32F405. Wiring: see `stm32f405.rs` of the library.
#![no_std]
#![no_main]

use core::cell::{Cell, RefCell};
use core::mem::MaybeUninit;

use cortex_m_rt::entry;
use critical_section::Mutex;
use defmt_rtt as _;
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use heapless::spsc::Queue;
use stm32f4xx_hal::gpio::{Output, PA4, PinState, Pull};
use stm32f4xx_hal::interrupt;
use stm32f4xx_hal::pac::{Interrupt, Peripherals, SPI1, TIM2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::{Config as SerialConfig, RxListen, Serial};
use stm32f4xx_hal::spi::{Mode, Phase, Polarity, Spi};
use stm32f4xx_hal::timer::{CounterHz, Event};
use trueaxis_firmware::controller::{Board, MainLoop, Shared, Shell, log};
use trueaxis_firmware::cycles::Cycles;
use trueaxis_firmware::device::{Identity, ServoSide};
use trueaxis_firmware::link::Link;
use trueaxis_firmware::places::Places;
use trueaxis_firmware::spi::SpiMotion;
use trueaxis_firmware::temperature::{Settings, SoftI2c, Temperatures, Tmp117, Tmp117Address};
use trueaxis_stm32f405::bare;
use trueaxis_stm32f405::stm32f405::{BAUD, InternalFlash, Received, Uart};
use trueaxis_stm32f405::{PERIOD, RATE, Tables};

/// The motion side: an SPI bus with one select line.
type Motion = SpiMotion<ExclusiveDevice<Spi<SPI1>, PA4<Output>, NoDelay>>;

/// What the servo interrupt owns.
struct Servo {
    timer: CounterHz<TIM2>,
    motion: Motion,
}

static PLACES: Places<Tables> = Places::new();
static SHELL: Shell<Tables> = Shell::new(RATE);
/// On their way from `main` to the interrupts.
static SERVO: Mutex<Cell<Option<Servo>>> = Mutex::new(Cell::new(None));
static RECEIVED: Mutex<Cell<Option<Received>>> = Mutex::new(Cell::new(None));

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
    // Nearly two frames of the link.
    static mut BYTES: Queue<u8, 2048> = Queue::new();

    let (Some(mut core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else {
        stop("started twice")
    };
    let Some((loader, driven)) = PLACES.split() else {
        stop("started twice")
    };
    let mut rcc = chip.RCC.freeze(Config::hsi().sysclk(168.MHz()));
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();

    let (a, b, c) = (
        chip.GPIOA.split(&mut rcc),
        chip.GPIOB.split(&mut rcc),
        chip.GPIOC.split(&mut rcc),
    );
    let rate = SerialConfig::default().baudrate(BAUD.bps());
    let Ok(serial) = Serial::new(chip.USART2, (a.pa2, a.pa3), rate, &mut rcc) else {
        stop("no such baud rate")
    };
    let (send, mut receive) = serial.split();
    receive.listen();
    let (bytes_in, bytes_out) = BYTES.split();

    let mode = Mode {
        polarity: Polarity::IdleLow,
        phase: Phase::CaptureOnFirstTransition,
    };
    let pins = (Some(a.pa5), Some(a.pa6), Some(a.pa7));
    let bus = Spi::new(chip.SPI1, pins, mode, 10.MHz(), &mut rcc);
    let Ok(device) = ExclusiveDevice::new_no_delay(bus, a.pa4.into_push_pull_output());
    let mut timer = chip.TIM2.counter_hz(&mut rcc);
    if timer.start(RATE.Hz()).is_err() {
        stop("no such servo rate");
    }
    timer.listen(Event::Update);

    // Not the peripheral: its driver waits for ever on a line that is stuck.
    let mut clock = b.pb6.into_open_drain_output_in_state(PinState::High);
    clock.set_internal_resistor(Pull::Up);
    let mut data = b.pb7.into_open_drain_output_in_state(PinState::High);
    data.set_internal_resistor(Pull::Up);
    let sensor_bus = SoftI2c::new(clock, data, chip.TIM5.delay_us(&mut rcc));
    let sensor = Tmp117::new(sensor_bus, Tmp117Address::Ground);

    let side = SIDE.write(Mutex::new(RefCell::new(ServoSide::new(driven, PERIOD))));
    let access = SHELL.share(side);
    critical_section::with(|token| {
        let motion = SpiMotion::new(device);
        SERVO.borrow(token).set(Some(Servo { timer, motion }));
        let received = Received::new(receive, bytes_in);
        RECEIVED.borrow(token).set(Some(received));
    });
    bare::start_interrupts(&mut core.NVIC, [Interrupt::USART2, Interrupt::TIM2]);

    let board = Board {
        flash: InternalFlash::new(chip.FLASH),
        port: Uart::new(send, bytes_out),
        drives_off: b.pb1.into_pull_down_input(),
        lamp: c.pc13.into_push_pull_output(),
        healthy: b.pb0.into_push_pull_output(),
        temperatures: Temperatures::new([("bed", sensor)], Settings::MACHINE),
        log,
    };
    let identity = Identity {
        firmware: concat!("trueaxis ", env!("CARGO_PKG_VERSION")),
        board: "stm32f405",
        period: PERIOD,
    };
    let link = LINK.write(Link::new());
    MainLoop::start(board, link, loader, access, identity).run(cortex_m::asm::wfi)
}

#[interrupt]
fn TIM2() {
    static mut OWN: Option<Servo> = None;

    if OWN.is_none() {
        *OWN = critical_section::with(|token| SERVO.borrow(token).take());
    }
    if let Some(Servo { timer, motion }) = OWN {
        // Clears the flag that has called this.
        let _ = timer.wait();
        let (mut source, mut sink) = motion.ends();
        SHELL.tick(&mut source, &mut sink, &Cycles);
    }
}

#[interrupt]
fn USART2() {
    static mut OWN: Option<Received> = None;

    if OWN.is_none() {
        *OWN = critical_section::with(|token| RECEIVED.borrow(token).take());
    }
    if let Some(received) = OWN {
        received.take();
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
