//! The main loop, which is the same on every board.

use defmt::{info, warn};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io::{Read, ReadReady, Write};
use trueaxis_firmware::device::{Device, Identity, Machine, ServoAccess};
use trueaxis_firmware::link::Link;
use trueaxis_firmware::places::Loader;
use trueaxis_firmware::slots::{Slot, Slots, TableFlash};
use trueaxis_firmware::temperature::{Temperatures, Thermometer};

use crate::Tables;
use crate::servo::{Access, milliseconds};
use crate::signals::{Shown, Signals};
use crate::standstill::Standstill;

/// Between two readings of the sensors, ms.
const SENSOR_PERIOD: u32 = 1000;
/// Between two steps of the temperature inputs, ms.
const INPUT_PERIOD: u32 = 20;

/// What a board brings.
pub struct Board<F, P, D, L, H, T, const N: usize> {
    /// The table slots.
    pub flash: F,
    /// The serial line to the host.
    pub port: P,
    /// High while the drives are off.
    pub drives_off: D,
    /// Lamp.
    pub lamp: L,
    /// Fault pin: high while there is no fault.
    pub healthy: H,
    /// Sensors.
    pub temperatures: Temperatures<T, N>,
}

/// Starts the device and serves the link for ever; the servo interrupt may begin before.
pub fn run<F, P, D, L, H, T, const N: usize>(
    board: Board<F, P, D, L, H, T, N>,
    link: &mut Link,
    loader: Loader<Tables>,
    mut servo: Access,
    identity: Identity,
) -> !
where
    F: TableFlash,
    P: Read + ReadReady + Write,
    D: InputPin,
    L: OutputPin,
    H: OutputPin,
    T: Thermometer,
{
    let Board {
        flash,
        mut port,
        drives_off,
        lamp,
        healthy,
        temperatures,
    } = board;
    let slots = Slots::open(flash);
    for slot in Slot::BOTH {
        info!("slot {}: {}", slot, slots.state(slot));
    }
    let mut device = Device::start(slots, loader, servo, Standstill::new(drives_off), identity);
    let mut duties = Duties {
        signals: Signals::new(lamp, healthy),
        temperatures,
        log: Log::default(),
        assigned: None,
        read: 0,
        advanced: 0,
    };
    let mut last = milliseconds();
    loop {
        // What cannot be sent is asked for again.
        let _ = link.poll(&mut port, &mut device);
        let now = milliseconds();
        if now != last {
            last = now;
            let commands = servo.with(|side| *side.positions());
            device.machine().observe(&commands, now);
            duties.step(&device, &mut servo, now);
        }
        if !port.read_ready().unwrap_or(false) {
            // At the latest until the next servo period.
            cortex_m::asm::wfi();
        }
    }
}

/// What is to be done beside the link, once per millisecond.
struct Duties<L, H, T, const N: usize> {
    signals: Signals<L, H>,
    temperatures: Temperatures<T, N>,
    log: Log,
    /// For which active slot the sensors have been assigned.
    assigned: Option<Option<Slot>>,
    /// When the sensors have been read, ms.
    read: u32,
    /// When the inputs have been advanced, ms.
    advanced: u32,
}

impl<L: OutputPin, H: OutputPin, T: Thermometer, const N: usize> Duties<L, H, T, N> {
    fn step<F, M>(&mut self, device: &Device<F, Access, M, Tables>, servo: &mut Access, now: u32)
    where
        F: TableFlash,
        M: Machine,
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
        let shown = self.signals.show(servo, fault, now);
        self.log.note(shown, active);
    }
}

/// What has been logged last: only changes are.
#[derive(Default)]
struct Log {
    shown: Option<Shown>,
    active: Option<Option<Slot>>,
}

impl Log {
    fn note(&mut self, shown: Shown, active: Option<Slot>) {
        if self.active != Some(active) {
            self.active = Some(active);
            info!("active slot: {}", active);
        }
        if self.shown != Some(shown) {
            self.shown = Some(shown);
            match shown {
                Shown::Correcting => info!("correcting"),
                Shown::Idle => info!("idle"),
                Shown::Fault => warn!("fault"),
            }
        }
    }
}
