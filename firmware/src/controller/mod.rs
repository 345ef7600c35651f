//! The main loop, which is the same on every board.
//!
//! | file | contents |
//! |---|---|
//! | `servo` | the servo side, shared between the interrupt and the main loop |
//! | `standstill` | whether the machine stands still with its drives off |
//! | `signals` | the lamp |
//! | `liveness` | monitoring of both: watchdog and fault pin |
//! | `by_frames` | servo periods of a board clocked by frames |
//! | `line` | a serial line whose bytes are transferred by DMA |
//! | `serial` | the receiving end of a serial line read by an interrupt |

mod by_frames;
mod line;
mod liveness;
mod servo;
mod signals;
mod standstill;
#[cfg(test)]
mod tests;

pub use by_frames::{ByFrames, Silence, Slave};
pub use line::{Line, LineDma, LineMemory};
pub use liveness::{Beat, Heart, Liveness, Watchdog};
pub use servo::{Access, Shell};
pub use signals::{Shown, Signals};
pub use standstill::Standstill;

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io::{Read, ReadReady, Write};
use trueaxis::Room;

use crate::device::{Device, Identity, ServoAccess};
use crate::double_buffer::Loader;
use crate::link::Link;
use crate::slots::{Slot, SlotState, Slots, TableFlash};
use crate::temperature::{Temperatures, Thermometer};

/// Time between two readings of the sensors, ms.
const SENSOR_PERIOD: u32 = 1000;
/// Time between two steps of the temperature inputs, ms.
const INPUT_PERIOD: u32 = 20;

/// The parts that a board provides.
pub struct Board<F, P, D, L, T: Thermometer, const N: usize> {
    /// Flash with the table slots.
    pub flash: F,
    /// The serial line to the host.
    pub port: P,
    /// High while the drives are off.
    pub drives_off: D,
    /// Lamp.
    pub lamp: L,
    /// Temperature sensors.
    pub temperatures: Temperatures<T, N>,
    /// Writes an event to the log.
    pub log: fn(Event),
}

/// An event for the log.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// Content of a slot at start.
    Found(Slot, SlotState),
    /// The active slot has changed.
    Active(Option<Slot>),
    /// The lamp state has changed.
    Shown(Shown),
}

/// Writes an event to the log, for use as [`Board::log`].
#[cfg(all(feature = "defmt", target_os = "none"))]
pub fn log(event: Event) {
    match event {
        Event::Found(slot, state) => defmt::info!("slot {}: {}", slot, state),
        Event::Active(slot) => defmt::info!("active slot: {}", slot),
        Event::Shown(Shown::Correcting) => defmt::info!("correcting"),
        Event::Shown(Shown::Idle) => defmt::info!("idle"),
        Event::Shown(Shown::Fault) => defmt::warn!("fault"),
    }
}

/// State of the main loop.
pub struct MainLoop<'l, F, P, D, L, T: Thermometer, C: Room, const N: usize> {
    device: Device<F, Access<C>, Standstill<D, C>, C>,
    servo: Access<C>,
    link: &'l mut Link,
    port: P,
    duties: Duties<L, T, N>,
    /// Time of the last duties, ms.
    last: u32,
}

impl<'l, F, P, D, L, T, C: Room, const N: usize> MainLoop<'l, F, P, D, L, T, C, N>
where
    F: TableFlash,
    P: Read + ReadReady + Write,
    D: InputPin,
    L: OutputPin,
    T: Thermometer,
{
    /// Starts the device; the servo interrupt may already be running.
    #[must_use]
    pub fn start(
        board: Board<F, P, D, L, T, N>,
        link: &'l mut Link,
        loader: Loader<C>,
        servo: Access<C>,
        identity: Identity,
    ) -> Self {
        let slots = Slots::open(board.flash);
        for slot in Slot::BOTH {
            (board.log)(Event::Found(slot, slots.state(slot)));
        }
        let machine = Standstill::new(board.drives_off);
        Self {
            device: Device::start(slots, loader, servo, machine, identity),
            servo,
            link,
            port: board.port,
            duties: Duties {
                signals: Signals::new(board.lamp),
                temperatures: board.temperatures,
                log: Log::new(board.log),
                assigned: None,
                read: 0,
                advanced: 0,
            },
            last: servo.milliseconds(),
        }
    }

    /// One turn. Returns false if there is nothing to do until the next interrupt.
    pub fn turn(&mut self) -> bool {
        self.servo.lives();
        // The host repeats a request if its answer could not be sent.
        let _ = self.link.poll(&mut self.port, &mut self.device);
        let now = self.servo.milliseconds();
        if now != self.last {
            self.last = now;
            let commands = self.servo.with(|side| *side.positions());
            self.device.machine().observe(&commands, now);
            self.duties.step(&self.device, &mut self.servo, now);
        }
        self.port.read_ready().unwrap_or(false)
    }

    /// Runs for ever; `wait` returns after an interrupt, no later than that of the next servo period.
    pub fn run(mut self, mut wait: impl FnMut()) -> ! {
        loop {
            if !self.turn() {
                wait();
            }
        }
    }
}

/// The tasks beside the link, run once per millisecond.
struct Duties<L, T: Thermometer, const N: usize> {
    signals: Signals<L>,
    temperatures: Temperatures<T, N>,
    log: Log,
    /// Active slot for which the sensors were assigned last.
    assigned: Option<Option<Slot>>,
    /// Time of the last sensor reading, ms.
    read: u32,
    /// Time of the last input step, ms.
    advanced: u32,
}

impl<L: OutputPin, T: Thermometer, const N: usize> Duties<L, T, N> {
    fn step<F, D, C: Room>(
        &mut self,
        device: &Device<F, Access<C>, Standstill<D, C>, C>,
        servo: &mut Access<C>,
        now: u32,
    ) where
        F: TableFlash,
        D: InputPin,
    {
        let active = device.slots().active();
        if self.assigned != Some(active) {
            self.assigned = Some(active);
            let auxiliaries = device.compensation().auxiliaries();
            self.temperatures.assign(auxiliaries);
        }
        let elapsed = now.wrapping_sub(self.read);
        if elapsed >= SENSOR_PERIOD {
            self.read = now;
            self.temperatures.poll(elapsed as f32 * 0.001);
        }
        let elapsed = now.wrapping_sub(self.advanced);
        if elapsed >= INPUT_PERIOD {
            self.advanced = now;
            let free = servo.with(|side| side.is_at_zero());
            self.temperatures.advance(elapsed as f32 * 0.001, free);
            for (number, value) in self.temperatures.values() {
                servo.with(|side| side.set_auxiliary(number, value));
            }
            servo.with(|side| side.set_sensors_lost(self.temperatures.lost()));
        }
        let fault = device.fault().is_some();
        servo.with(|side| side.set_faulty(fault));
        let shown = self.signals.show(servo, now);
        self.log.note(shown, active);
    }
}

/// State logged last, because only changes are logged.
struct Log {
    write: fn(Event),
    shown: Option<Shown>,
    active: Option<Option<Slot>>,
}

impl Log {
    const fn new(write: fn(Event)) -> Self {
        Self {
            write,
            shown: None,
            active: None,
        }
    }

    fn note(&mut self, shown: Shown, active: Option<Slot>) {
        if self.active != Some(active) {
            self.active = Some(active);
            (self.write)(Event::Active(active));
        }
        if self.shown != Some(shown) {
            self.shown = Some(shown);
            (self.write)(Event::Shown(shown));
        }
    }
}
