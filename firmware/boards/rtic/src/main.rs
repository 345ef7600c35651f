//! The runtime under RTIC. The servo period is the task with the highest priority. External events (other tables,
//! another tool) are tasks below it, and wait for the end of a period if necessary.
//!
//! | pin | function |
//! |---|---|
//! | PA4, PA5, PA6, PA7 | SPI1: select, clock, in, out: the motion side |
//! | PB0 | button to ground: to the other tables and back |
//! | PB1 | button to ground: the next tool |
#![no_std]
#![no_main]
#![deny(unsafe_code)]

use trueaxis::{Compensation, Servo, capacities, include_blob};

/// Capacities for this machine and the tables of one compensation.
type Room = capacities!(axes: 5, banks: 16, tables: 32, terms: 64, grids: 1);
type Tables = Compensation<'static, Room>;
/// The servo that uses them.
type Corrected = Servo<&'static Tables>;

/// One machine, corrected with two policies (`docs/src/policies.md`); `cargo xtask boards` generates these blobs.
static ORIENTATION: &[u8] = include_blob!(concat!(env!("TRUEAXIS_BLOBS"), "/orientation.trax"));
static DIRECTION: &[u8] = include_blob!(concat!(env!("TRUEAXIS_BLOBS"), "/direction.trax"));
/// Tool lengths, mm: the first auxiliary input of these tables.
const TOOLS: [f32; 3] = [130.0, 95.5, 160.25];
/// Servo periods per second, and a period in s.
const RATE: u32 = 1000;
const PERIOD: f32 = 1.0 / RATE as f32;

/// Restarts, with corrections at zero.
fn stop() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    stop()
}

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use super::{Corrected, DIRECTION, ORIENTATION, PERIOD, RATE, TOOLS, Tables, stop};
    use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
    use stm32f4xx_hal::gpio::{Edge, Input, Output, PA4, PB0, PB1};
    use stm32f4xx_hal::pac::{SPI1, TIM2};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc::Config;
    use stm32f4xx_hal::spi::{Mode, Phase, Polarity, Spi};
    use stm32f4xx_hal::timer::{CounterHz, Event};
    use trueaxis::Inputs;
    use trueaxis_firmware::device::{Command, CorrectionSink, FAULTS, PositionSource};
    use trueaxis_firmware::spi::{Polled, Tolerance};

    #[shared]
    struct Shared {
        servo: Corrected,
        /// Index of the tool in the spindle.
        tool: usize,
    }

    #[local]
    struct Local {
        timer: CounterHz<TIM2>,
        motion: Polled<ExclusiveDevice<Spi<SPI1>, PA4<Output>, NoDelay>, 5>,
        change: PB0<Input>,
        next: PB1<Input>,
        tables: [&'static Tables; 2],
    }

    #[init(local = [orientation: Tables = Tables::empty(), direction: Tables = Tables::empty()])]
    fn init(context: init::Context) -> (Shared, Local) {
        let (mut chip, memory) = (context.device, context.local);
        if memory.orientation.load(ORIENTATION).is_err()
            || memory.direction.load(DIRECTION).is_err()
        {
            stop();
        }
        let tables: [&'static Tables; 2] = [memory.orientation, memory.direction];
        let mut servo = Corrected::new(tables[0]);
        servo.enable();

        let mut rcc = chip.RCC.freeze(Config::hsi().sysclk(168.MHz()));
        let (a, b) = (chip.GPIOA.split(&mut rcc), chip.GPIOB.split(&mut rcc));
        let mode = Mode {
            polarity: Polarity::IdleLow,
            phase: Phase::CaptureOnFirstTransition,
        };
        let pins = (Some(a.pa5), Some(a.pa6), Some(a.pa7));
        let bus = Spi::new(chip.SPI1, pins, mode, 10.MHz(), &mut rcc);
        let Ok(device) = ExclusiveDevice::new_no_delay(bus, a.pa4.into_push_pull_output());

        let mut lines = chip.SYSCFG.constrain(&mut rcc);
        let (mut change, mut next) = (b.pb0.into_pull_up_input(), b.pb1.into_pull_up_input());
        change.make_interrupt_source(&mut lines);
        change.trigger_on_edge(&mut chip.EXTI, Edge::Falling);
        change.enable_interrupt(&mut chip.EXTI);
        next.make_interrupt_source(&mut lines);
        next.trigger_on_edge(&mut chip.EXTI, Edge::Falling);
        next.enable_interrupt(&mut chip.EXTI);

        let mut timer = chip.TIM2.counter_hz(&mut rcc);
        if timer.start(RATE.Hz()).is_err() {
            stop();
        }
        timer.listen(Event::Update);
        let shared = Shared { servo, tool: 0 };
        let local = Local {
            timer,
            motion: Polled::new(device, Tolerance::USUAL),
            change,
            next,
            tables,
        };
        (shared, local)
    }

    /// One servo period.
    #[task(binds = TIM2, priority = 2, local = [timer, motion], shared = [servo, tool])]
    fn period(context: period::Context) {
        let local = context.local;
        // Clears the flag that triggered this.
        let _ = local.timer.wait();
        let (mut commands, mut corrections) = local.motion.poll();
        // Without a command no axis counts as referenced: the correction is held, then ramped out.
        let command: Command<[f32; 5]> = commands.take().unwrap_or(Command::new([f32::NAN; 5], 0));
        let regular = !commands.regularity().fault;
        let mut inputs = Inputs::at(command.axes);
        (context.shared.servo, context.shared.tool).lock(|servo, tool| {
            if let Some(length) = TOOLS.get(*tool) {
                inputs.auxiliaries[0] = *length;
            }
            let correction = servo.advance(&inputs, command.referenced, PERIOD);
            let wrong = correction.status.conditions.0 & FAULTS.0 != 0;
            corrections.give(correction, regular && !wrong);
        });
    }

    /// Switches to the other tables; while a change is in progress the button has no effect.
    #[task(binds = EXTI0, priority = 1, local = [change, tables], shared = [servo])]
    fn change(mut context: change::Context) {
        context.local.change.clear_interrupt_pending_bit();
        let [orientation, direction] = *context.local.tables;
        context.shared.servo.lock(|servo| {
            let is_first = core::ptr::eq(servo.compensation(), orientation);
            let _ = servo.swap(if is_first { direction } else { orientation });
        });
    }

    /// Selects the next tool: its length is faded in, all axes together.
    #[task(binds = EXTI1, priority = 1, local = [next], shared = [tool])]
    fn tool(mut context: tool::Context) {
        context.local.next.clear_interrupt_pending_bit();
        let tool = &mut context.shared.tool;
        tool.lock(|tool| *tool = (*tool + 1) % TOOLS.len());
    }
}
