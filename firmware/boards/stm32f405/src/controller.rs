//! The main loop, which is the same on every board.

use defmt::{info, warn};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io::{Read, ReadReady, Write};
use trueaxis_firmware::device::{Device, Identity, ServoAccess};
use trueaxis_firmware::link::Link;
use trueaxis_firmware::places::Loader;
use trueaxis_firmware::slots::{Slot, Slots, TableFlash};
use trueaxis_firmware::temperature::{Temperatures, Thermometer};

use crate::servo::{Access, milliseconds};
use crate::signals::{Shown, Signals};
use crate::standstill::Standstill;
use crate::{AXES, GRIDS, TABLES, TERMS};

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
    loader: Loader<AXES, TABLES, TERMS, GRIDS>,
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
        mut temperatures,
    } = board;
    let slots = Slots::open(flash);
    for slot in Slot::BOTH {
        info!("slot {}: {}", slot, slots.state(slot));
    }
    let mut device = Device::start(slots, loader, servo, Standstill::new(drives_off), identity);
    let mut signals = Signals::new(lamp, healthy);
    let mut log = Log::default();
    let (mut read, mut advanced) = (0, 0);
    let mut assigned = None;
    loop {
        // What cannot be sent is asked for again.
        let _ = link.poll(&mut port, &mut device);
        let now = milliseconds();
        let commands = servo.with(|side| *side.positions());
        device.machine().observe(&commands, now);

        let active = device.slots().active();
        if assigned != Some(active) {
            assigned = Some(active);
            temperatures.assign(device.compensation().auxiliaries());
        }
        if now.wrapping_sub(read) >= SENSOR_PERIOD {
            temperatures.poll(now.wrapping_sub(read) as f32 * 0.001);
            read = now;
        }
        if now.wrapping_sub(advanced) >= INPUT_PERIOD {
            let free = servo.with(|side| side.is_at_zero());
            temperatures.advance(now.wrapping_sub(advanced) as f32 * 0.001, free);
            advanced = now;
            for (number, value) in temperatures.values() {
                servo.with(|side| side.set_auxiliary(number, value));
            }
            servo.with(|side| side.set_sensors_lost(temperatures.lost()));
        }
        let shown = signals.show(&mut servo, device.fault().is_some(), now);
        log.note(shown, active);
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
