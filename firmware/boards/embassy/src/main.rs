//! The runtime under embassy. The servo period is the task of an executor that runs in a high-priority interrupt and
//! owns the servo, so nothing is locked. Tasks of the executor in `main` send it external events (other tables, another
//! tool).
//!
//! | pin | function |
//! |---|---|
//! | PA4, PA5, PA6, PA7 | SPI1: select, clock, in, out: the motion side |
//! | PB0 | button to ground: to the other tables and back |
//! | PB1 | button to ground: the next tool |
#![no_std]
#![no_main]
#![deny(unsafe_code)]

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::exti::{ExtiInput, InterruptHandler};
use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::typelevel::{EXTI0, EXTI1};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::{Async, Blocking};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, Spi};
use embassy_stm32::time::Hertz;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker};
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use static_cell::ConstStaticCell;
use trueaxis::{Compensation, Inputs, Servo, capacities, include_blob};
use trueaxis_firmware::device::{Command, CorrectionSink, FAULTS, PositionSource};
use trueaxis_firmware::spi::{Polled, Tolerance};

/// Capacities for this machine and the tables of one compensation.
type Room = capacities!(axes: 5, banks: 16, tables: 32, terms: 64, grids: 1);
type Tables = Compensation<'static, Room>;
/// The servo that uses them.
type Corrected = Servo<&'static Tables>;
/// The motion side.
type Motion = Polled<ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, NoDelay>, 5>;
/// A message between tasks.
type Told<T> = Signal<CriticalSectionRawMutex, T>;

/// One machine, corrected with two policies (`docs/src/policies.md`); `cargo xtask boards` generates these blobs.
static ORIENTATION: &[u8] = include_blob!(concat!(env!("TRUEAXIS_BLOBS"), "/orientation.trax"));
static DIRECTION: &[u8] = include_blob!(concat!(env!("TRUEAXIS_BLOBS"), "/direction.trax"));
/// Tool lengths, mm: the first auxiliary input of these tables.
const TOOLS: [f32; 3] = [130.0, 95.5, 160.25];
/// Servo periods per second, and a period in s.
const RATE: u64 = 1000;
const PERIOD: f32 = 1.0 / RATE as f32;

static SERVO: InterruptExecutor = InterruptExecutor::new();
static CHANGE: Told<()> = Signal::new();
static TOOL_LENGTH: Told<f32> = Signal::new();

embassy_stm32::bind_interrupts!(struct Lines {
    EXTI0 => InterruptHandler<EXTI0>;
    EXTI1 => InterruptHandler<EXTI1>;
});

/// Restarts, with corrections at zero.
fn stop() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    stop()
}

/// An interrupt of an unused peripheral: the servo's executor runs in it.
#[interrupt]
#[allow(unsafe_code)]
unsafe fn UART4() {
    // SAFETY: this is the interrupt that `SERVO` is started with, and nothing else calls this.
    unsafe { SERVO.on_interrupt() }
}

/// The servo periods.
#[embassy_executor::task]
async fn servo(mut motion: Motion, tables: [&'static Tables; 2]) {
    let [orientation, direction] = tables;
    let mut servo = Corrected::new(orientation);
    servo.enable();
    let mut length = TOOLS[0];
    let mut periods = Ticker::every(Duration::from_hz(RATE));
    loop {
        periods.next().await;
        if CHANGE.try_take().is_some() {
            // While a change is in progress the button has no effect.
            let is_first = core::ptr::eq(servo.compensation(), orientation);
            let _ = servo.swap(if is_first { direction } else { orientation });
        }
        if let Some(other) = TOOL_LENGTH.try_take() {
            // The length is faded in, all axes together.
            length = other;
        }
        let (mut commands, mut corrections) = motion.poll();
        // Without a command no axis counts as referenced: the correction is held, then ramped out.
        let command: Command<[f32; 5]> = commands.take().unwrap_or(Command::new([f32::NAN; 5], 0));
        let regular = !commands.regularity().fault;
        let mut inputs = Inputs::at(command.axes);
        inputs.auxiliaries[0] = length;
        let correction = servo.advance(&inputs, command.referenced, PERIOD);
        let wrong = correction.status.conditions.0 & FAULTS.0 != 0;
        corrections.give(correction, regular && !wrong);
    }
}

/// The button for the next tool.
#[embassy_executor::task]
async fn tools(mut button: ExtiInput<'static, Async>) {
    for length in TOOLS.iter().cycle().skip(1) {
        button.wait_for_falling_edge().await;
        TOOL_LENGTH.signal(*length);
    }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    static MEMORY: [ConstStaticCell<Tables>; 2] =
        [const { ConstStaticCell::new(Tables::empty()) }; 2];

    let [orientation, direction] = MEMORY.each_ref().map(ConstStaticCell::take);
    if orientation.load(ORIENTATION).is_err() || direction.load(DIRECTION).is_err() {
        stop();
    }
    let chip = embassy_stm32::init(clocks());
    let mut config = Config::default();
    config.frequency = Hertz::mhz(10);
    let bus = Spi::new_blocking(chip.SPI1, chip.PA5, chip.PA7, chip.PA6, config);
    let select = Output::new(chip.PA4, Level::High, Speed::VeryHigh);
    let Ok(device) = ExclusiveDevice::new_no_delay(bus, select);
    let mut change = ExtiInput::new(chip.PB0, chip.EXTI0, Pull::Up, Lines);
    let next = ExtiInput::new(chip.PB1, chip.EXTI1, Pull::Up, Lines);

    interrupt::UART4.set_priority(Priority::P6);
    let urgent = SERVO.start(interrupt::UART4);
    let (Ok(servo), Ok(tools)) = (
        servo(
            Polled::new(device, Tolerance::USUAL),
            [orientation, direction],
        ),
        tools(next),
    ) else {
        stop()
    };
    urgent.spawn(servo);
    spawner.spawn(tools);
    loop {
        change.wait_for_falling_edge().await;
        CHANGE.signal(());
    }
}

/// 168 MHz from the internal oscillator of 16 MHz.
fn clocks() -> embassy_stm32::Config {
    use embassy_stm32::rcc::{
        AHBPrescaler, APBPrescaler, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
    };
    let mut config = embassy_stm32::Config::default();
    config.rcc.pll_src = PllSource::HSI;
    config.rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV8,
        mul: PllMul::MUL168,
        divp: Some(PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}
