//! A TMP117 simulated according to its data sheet, and the driver's response.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal::i2c::{self, ErrorType, I2c, NoAcknowledgeSource, Operation};

use crate::{SensorError, Tmp117, Tmp117Address};

/// A TMP117, from the point of view of the bus.
#[derive(Clone, Debug)]
struct Chip {
    connected: bool,
    /// Value of every read if a line is stuck.
    stuck: Option<u8>,
    identity: u16,
    configuration: u16,
    temperature: i16,
    fresh: bool,
}

#[derive(Clone, Debug)]
struct Bus(Rc<RefCell<Chip>>);

impl ErrorType for Bus {
    type Error = i2c::ErrorKind;
}

impl I2c for Bus {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), i2c::ErrorKind> {
        let mut chip = self.0.borrow_mut();
        if !chip.connected || address != 0x49 {
            return Err(i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        let mut register = 0;
        for operation in operations {
            match operation {
                Operation::Write([pointer]) => register = *pointer,
                Operation::Write([1, high, low]) => {
                    chip.configuration = u16::from_be_bytes([*high, *low]);
                }
                Operation::Write(other) => panic!("{other:?}"),
                Operation::Read(bytes) => {
                    let value = match register {
                        0 => chip.temperature.cast_unsigned(),
                        1 => chip.configuration | u16::from(chip.fresh) << 13,
                        15 => chip.identity,
                        other => panic!("register {other}"),
                    };
                    if register < 2 {
                        chip.fresh = false;
                    }
                    bytes.copy_from_slice(&value.to_be_bytes());
                    if let Some(stuck) = chip.stuck {
                        bytes.fill(stuck);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Bus {
    /// A sensor as delivered, but in one-shot mode.
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Chip {
            connected: true,
            stuck: None,
            identity: 0x1117,
            configuration: 0x0C20,
            temperature: i16::MIN,
            fresh: false,
        })))
    }

    fn sensor(&self) -> Tmp117<Self> {
        Tmp117::new(self.clone(), Tmp117Address::Supply)
    }
}

#[test]
fn the_sensor_is_configured_and_read() {
    let bus = Bus::new();
    let mut sensor = bus.sensor();
    // One-shot mode: it is switched to continuous conversion first.
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(bus.0.borrow().configuration, 0x0220);
    assert_eq!(sensor.celsius(), Ok(None));
    // Values of table 7-1 of the datasheet, and the ends of the range.
    for (register, celsius) in [
        (0x0C80, 25.0),
        (0x0001, 0.007_812_5),
        (0x0000, 0.0),
        (-1, -0.007_812_5),
        (-0x0C80, -25.0),
        (0x4B00, 150.0),
        (-0x1B80, -55.0),
    ] {
        bus.0.borrow_mut().temperature = register;
        bus.0.borrow_mut().fresh = true;
        assert_eq!(sensor.celsius(), Ok(Some(celsius)));
        // Each result is returned once.
        assert_eq!(sensor.celsius(), Ok(None));
    }
    // The value after a reset, and values outside the measuring range.
    for register in [i16::MIN, i16::MAX, 0x4B01, -0x1B81] {
        bus.0.borrow_mut().temperature = register;
        bus.0.borrow_mut().fresh = true;
        assert_eq!(sensor.celsius(), Err(SensorError::Implausible));
    }
    // It has lost power, and with it its configuration.
    bus.0.borrow_mut().configuration = 0x0C20;
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(bus.0.borrow().configuration, 0x0220);
}

#[test]
fn a_missing_sensor_and_stuck_lines_are_errors() {
    let bus = Bus::new();
    let mut sensor = bus.sensor();
    bus.0.borrow_mut().connected = false;
    let missing = i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    assert_eq!(sensor.celsius(), Err(SensorError::Bus(missing)));
    bus.0.borrow_mut().connected = true;
    for (stuck, found) in [(0, 0), (0xFF, 0xFFFF)] {
        bus.0.borrow_mut().stuck = Some(stuck);
        assert_eq!(sensor.celsius(), Err(SensorError::Identity { found }));
    }
    bus.0.borrow_mut().stuck = None;
    bus.0.borrow_mut().identity = 0x0190;
    assert_eq!(
        sensor.celsius(),
        Err(SensorError::Identity { found: 0x0190 })
    );
    bus.0.borrow_mut().identity = 0x0117;
    assert_eq!(sensor.celsius(), Ok(None));
}
