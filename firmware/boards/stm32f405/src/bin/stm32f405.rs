//! trueaxis on an STM32F405. Wiring: see `stm32f405.rs` of the library.
#![no_std]
#![no_main]

use core::cell::Cell;
use core::mem::MaybeUninit;

use cortex_m_rt::{entry, exception};
use critical_section::Mutex;
use stm32f4xx_hal::dma::StreamsTuple;
use stm32f4xx_hal::gpio::{
    Alternate, Edge, ExtiPin, OpenDrain, Output, PA4, PB0, PB6, PB7, PinState, Pull, Speed,
};
use stm32f4xx_hal::interrupt;
use stm32f4xx_hal::pac::{EXTI, Interrupt, Peripherals, RCC, SPI1};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Enable, Rcc};
use stm32f4xx_hal::serial::Serial;
use stm32f4xx_hal::serial::config::{Config as SerialConfig, DmaConfig};
use stm32f4xx_hal::syscfg::SysCfg;
use stm32f4xx_hal::time::Hertz;
use trueaxis::link::{Restart, Tail};
use trueaxis_cortex_m::{Cycling, leave, stop};
#[cfg(not(feature = "log"))]
use trueaxis_firmware::controller::Event;
use trueaxis_firmware::controller::{Beat, Board, ByFrames, Heart, MainLoop, Shell};
use trueaxis_firmware::cycles::Cycles;
use trueaxis_firmware::device::{Identity, ServoSide};
use trueaxis_firmware::double_buffer::DoubleBuffer;
use trueaxis_firmware::link::Link;
use trueaxis_firmware::spi::Tolerance;
use trueaxis_firmware::temperature::{Settings, Temperatures};
use trueaxis_sensors::{SoftI2c, Tmp117, Tmp117Address};
use trueaxis_stm32f405::bare;
use trueaxis_stm32f405::stm32f405::{
    BAUD, Dog, InternalFlash, Motion, Random, Silence, Uart, supply,
};
use trueaxis_stm32f405::{AXES, PERIOD, RATE, Tables};
#[cfg(feature = "log")]
use {defmt_rtt as _, trueaxis_firmware::controller::log};

/// State owned by the servo interrupt.
struct Servo {
    frames: ByFrames<Motion, Silence, AXES>,
    heart: Heart<PB0<Output>, Dog>,
}

static BUFFERS: DoubleBuffer<Tables> = DoubleBuffer::new();
static SHELL: Shell<Tables> = Shell::new(RATE);
/// Holds it between servo interrupts.
static SERVO: Mutex<Cell<Option<&'static mut Servo>>> = Mutex::new(Cell::new(None));

#[cfg(feature = "log")]
defmt::timestamp!("{=u32:ms}", SHELL.milliseconds());

/// Without a probe nobody reads events.
#[cfg(not(feature = "log"))]
fn log(_: Event) {}

/// A failed start is repeated; until it succeeds the fault pin is not driven, which signals a fault.
fn fail(line: u32, what: &str) -> ! {
    let file = Tail::of(what);
    stop(&Restart::Panic { line, file })
}

/// The running clocks. Without its crystal it waits here, with the fault pin low.
fn clocks(unset: RCC) -> Rcc {
    #[cfg(not(feature = "hsi"))]
    let source = Config::hse(trueaxis_stm32f405::stm32f405::CRYSTAL);
    #[cfg(feature = "hsi")]
    let source = Config::hsi();
    let rcc = unset.freeze(source.sysclk(168.MHz()).require_pll48clk());
    #[cfg(not(feature = "hsi"))]
    supply::watch_crystal(&rcc);
    rcc
}

/// The select line, whose rising edge triggers an interrupt.
fn select_line(pin: PA4, lines: &mut SysCfg, mut edges: EXTI) -> (PA4<Alternate<5>>, EXTI) {
    // Without a motion side it is deselected.
    let mut select = pin.into_pull_up_input();
    select.make_interrupt_source(lines);
    select.trigger_on_edge(&mut edges, Edge::Rising);
    select.enable_interrupt(&mut edges);
    let mut select = select.into_alternate::<5>();
    select.set_internal_resistor(Pull::Up);
    (select, edges)
}

type SensorBus = SoftI2c<PB6<Output<OpenDrain>>, PB7<Output<OpenDrain>>, Cycling>;

/// The bus of the temperature sensor. Not the hardware peripheral: its driver waits for ever on a stuck line.
fn sensor_bus(clock: PB6, data: PB7, core: Hertz) -> SensorBus {
    let mut clock = clock.into_open_drain_output_in_state(PinState::High);
    clock.set_internal_resistor(Pull::Up);
    let mut data = data.into_open_drain_output_in_state(PinState::High);
    data.set_internal_resistor(Pull::Up);
    SoftI2c::new(clock, data, Cycling::new(core.raw()))
}

#[entry]
fn main() -> ! {
    // Otherwise their initial values would be stored in flash.
    static mut SIDE: MaybeUninit<ServoSide<Tables>> = MaybeUninit::uninit();
    static mut OWN: MaybeUninit<Servo> = MaybeUninit::uninit();
    static mut LINK: MaybeUninit<Link> = MaybeUninit::uninit();

    let (Some(mut core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else {
        fail(line!(), "started twice")
    };
    let Some((loader, servo)) = BUFFERS.split() else {
        fail(line!(), "started twice")
    };
    let restart = trueaxis_cortex_m::start(supply::flags(&chip.RCC), bare::fault_pin_low);
    supply::watch_over(&chip.FLASH);
    let mut rcc = clocks(chip.RCC);
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    // A probe that halts the program must not cause a fault.
    chip.DBGMCU
        .apb1_fz()
        .modify(|_, w| w.dbg_iwdg_stop().set_bit().dbg_tim2_stop().set_bit());

    let (a, b, c) = (
        chip.GPIOA.split(&mut rcc),
        chip.GPIOB.split(&mut rcc),
        chip.GPIOC.split(&mut rcc),
    );
    let rate = SerialConfig::default()
        .baudrate(BAUD.bps())
        .dma(DmaConfig::TxRx);
    let Ok(line) = Serial::new(chip.USART2, (a.pa2, a.pa3), rate, &mut rcc) else {
        fail(line!(), "no such baud rate")
    };
    let slow = StreamsTuple::new(chip.DMA1, &mut rcc);
    let port = Uart::start(line, slow.5, slow.6);

    let mut lines = chip.SYSCFG.constrain(&mut rcc);
    let (select, edges) = select_line(a.pa4, &mut lines, chip.EXTI);
    // They stay connected without an owner.
    let _ = a.pa5.into_alternate::<5>();
    let _ = a.pa6.into_alternate::<5>().speed(Speed::VeryHigh);
    let _ = a.pa7.into_alternate::<5>();
    SPI1::enable(&mut rcc);
    let fast = StreamsTuple::new(chip.DMA2, &mut rcc);
    let motion = Motion::new(chip.SPI1, fast.2, fast.3, select, edges);

    let sensor_bus = sensor_bus(b.pb6, b.pb7, rcc.clocks.sysclk());
    let mut sensor = Tmp117::new(sensor_bus, Tmp117Address::Ground);

    let access = SHELL.share(SIDE.write(ServoSide::new(servo, PERIOD)));
    let silence = Silence::start(chip.TIM2, &mut rcc);
    let own = OWN.write(Servo {
        frames: ByFrames::start(motion, silence, Tolerance::USUAL),
        heart: Heart::new(b.pb0.into_push_pull_output(), Dog::start()),
    });
    critical_section::with(|token| SERVO.borrow(token).set(Some(own)));
    bare::start_interrupts(&mut core.NVIC, [Interrupt::EXTI4, Interrupt::TIM2]);

    let board = Board {
        flash: InternalFlash::new(chip.FLASH),
        port,
        drives_off: b.pb1.into_pull_down_input(),
        lamp: c.pc13.into_push_pull_output(),
        temperatures: Temperatures::new([("bed", || sensor.celsius())], Settings::MACHINE),
        log,
    };
    let identity = Identity {
        firmware: concat!("trueaxis ", env!("CARGO_PKG_VERSION")),
        board: "stm32f405",
        period: PERIOD,
        restart,
    };
    let link = LINK.write(Link::new(&mut Random::new(chip.RNG, &mut rcc)));
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

#[interrupt]
fn EXTI4() {
    servo();
}

#[interrupt]
fn TIM2() {
    servo();
}

/// The crystal has stopped; the processor continues with its internal oscillator.
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
