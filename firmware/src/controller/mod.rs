//! The main loop, which is the same on every board.
//!
//! | file | what it holds |
//! |---|---|
//! | `servo` | the servo side, shared between the interrupt and the main loop |
//! | `standstill` | whether the machine stands still with its drives off |
//! | `signals` | the lamp |
//! | `liveness` | whether both live: watchdog and fault pin |
//! | `by_frames` | the servo period of a board whose frames give the clock |
//! | `line` | a serial line whose bytes are moved by DMA |
//! | `serial` | the receiving end of one whose bytes come in an interrupt |

mod by_frames;
mod line;
mod liveness;
mod serial;
mod servo;
mod signals;
mod standstill;
#[cfg(test)]
mod tests;

pub use by_frames::{ByFrames, Silence, Slave};
pub use line::{Line, LineDma, LineMemory};
pub use liveness::{Beat, Heart, Liveness, Watchdog};
pub use serial::received;
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

/// Between two readings of the sensors, ms.
const SENSOR_PERIOD: u32 = 1000;
/// Between two steps of the temperature inputs, ms.
const INPUT_PERIOD: u32 = 20;

/// What a board brings.
pub struct Board<F, P, D, L, T: Thermometer, const N: usize> {
    /// The table slots.
    pub flash: F,
    /// The serial line to the host.
    pub port: P,
    /// High while the drives are off.
    pub drives_off: D,
    /// Lamp.
    pub lamp: L,
    /// Sensors.
    pub temperatures: Temperatures<T, N>,
    /// Writes to the log.
    pub log: fn(Event),
}

/// What is worth a line in the log.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// What a slot holds at start.
    Found(Slot, SlotState),
    /// The active slot is another.
    Active(Option<Slot>),
    /// The lamp shows something else.
    Shown(Shown),
}

/// Writes to the log: for [`Board::log`].
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

/// The main loop between two turns.
pub struct MainLoop<'l, F, P, D, L, T: Thermometer, C: Room, const N: usize> {
    device: Device<F, Access<C>, Standstill<D, C>, C>,
    servo: Access<C>,
    link: &'l mut Link,
    port: P,
    duties: Duties<L, T, N>,
    /// When the duties were done, ms.
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
    /// Starts the device; the servo interrupt may begin before.
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

    /// One turn. False if nothing more is to be done until the next interrupt.
    pub fn turn(&mut self) -> bool {
        self.servo.lives();
        // What cannot be sent is asked for again.
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

    /// Turns for ever; `wait` returns after an interrupt, at the latest that of the next servo period.
    pub fn run(mut self, mut wait: impl FnMut()) -> ! {
        loop {
            if !self.turn() {
                wait();
            }
        }
    }
}

/// What is to be done beside the link, once per millisecond.
struct Duties<L, T: Thermometer, const N: usize> {
    signals: Signals<L>,
    temperatures: Temperatures<T, N>,
    log: Log,
    /// For which active slot the sensors have been assigned.
    assigned: Option<Option<Slot>>,
    /// When the sensors have been read, ms.
    read: u32,
    /// When the inputs have been advanced, ms.
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

/// What has been logged last: only changes are.
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
