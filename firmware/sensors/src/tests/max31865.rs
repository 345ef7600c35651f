//! A MAX31865 simulated according to its data sheet, and a driver that reports what is wrong.

use std::cell::RefCell;
use std::format;
use std::rc::Rc;

use embedded_hal::spi::{self, SpiDevice};

use crate::{Conversion, Faults, Mains, Max31865, Platinum, SensorError, Wires};

/// A MAX31865, from the point of view of the bus.
#[derive(Debug)]
struct Chip {
    connected: bool,
    /// Value of every read if nothing drives the line.
    idle: u8,
    registers: [u8; 8],
    /// The next result, 15 bits.
    code: u16,
    /// Faults found by a check of the wires.
    wires: u8,
    /// Faults that are always monitored: voltages.
    voltage: u8,
}

#[derive(Clone, Debug)]
struct Spi(Rc<RefCell<Chip>>);

impl spi::ErrorType for Spi {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Spi {
    fn transaction(
        &mut self,
        operations: &mut [spi::Operation<'_, u8>],
    ) -> Result<(), spi::ErrorKind> {
        let mut chip = self.0.borrow_mut();
        if chip.idle == 0x55 {
            return Err(spi::ErrorKind::ModeFault);
        }
        let mut address = None;
        for operation in operations {
            match operation {
                spi::Operation::Write(bytes) => {
                    for &byte in *bytes {
                        match address {
                            None => address = Some(byte),
                            Some(at) => {
                                chip.write(at, byte);
                                address = Some(at + 1);
                            }
                        }
                    }
                }
                spi::Operation::Read(bytes) => {
                    let at = usize::from(address.expect("an address first"));
                    if chip.connected {
                        bytes.copy_from_slice(&chip.registers[at..at + bytes.len()]);
                    } else {
                        bytes.fill(chip.idle);
                    }
                }
                other => panic!("{other:?}"),
            }
        }
        Ok(())
    }
}

impl Chip {
    fn write(&mut self, address: u8, byte: u8) {
        if !self.connected {
            return;
        }
        match address {
            0x80 => {
                if byte & 2 != 0 {
                    assert_eq!(byte & 0x2C, 0, "cleared alone");
                    self.registers[7] = 0;
                    self.registers[2] &= !1;
                }
                if byte & 0x0C != 0 {
                    assert_eq!(byte & 0xEC, 0x84, "a check with its own timing");
                }
                if byte & 0x20 != 0 {
                    assert_eq!(byte & 0xC0, 0x80, "fed, and normally off");
                }
                self.registers[0] = byte & !2;
            }
            0x83..=0x86 => self.registers[usize::from(address - 0x80)] = byte,
            other => panic!("{other:02X}"),
        }
    }

    /// Enough time for a pending operation to finish.
    fn elapse(&mut self) {
        let configuration = self.registers[0];
        if configuration & 0x0C != 0 {
            self.registers[7] |= self.wires;
        }
        if configuration & 0x60 != 0 {
            let word = |at: usize| u16::from_be_bytes([self.registers[at], self.registers[at + 1]]);
            let (high, low) = (word(3) >> 1, word(5) >> 1);
            self.registers[7] |= u8::from(self.code >= high) << 7 | u8::from(self.code <= low) << 6;
            let [a, b] = (self.code << 1).to_be_bytes();
            (self.registers[1], self.registers[2]) = (a, b);
        }
        self.registers[0] &= !0x2C;
        self.registers[7] |= self.voltage;
        self.registers[2] |= u8::from(self.registers[7] != 0);
    }
}

impl Spi {
    /// As after power-up, with a PT100 of 25 °C on 400 Ω.
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Chip {
            connected: true,
            idle: 0xFF,
            registers: [0, 0, 0, 0xFF, 0xFF, 0, 0, 0],
            code: 8988,
            wires: 0,
            voltage: 0,
        })))
    }

    fn sensor(&self, conversion: Conversion) -> Max31865<Self> {
        let (wires, mains) = (Wires::Two, Mains::Hz50);
        Max31865::new(
            self.clone(),
            Platinum::PT100,
            400.0,
            wires,
            mains,
            conversion,
        )
    }

    fn elapse(&self) {
        self.0.borrow_mut().elapse();
    }

    fn configuration(&self) -> u8 {
        self.0.borrow().registers[0]
    }
}

/// The next reading, within several calls.
fn reading(chip: &Spi, sensor: &mut Max31865<Spi>) -> f32 {
    for _ in 0..4 {
        chip.elapse();
        if let Some(celsius) = sensor.celsius().expect("no fault") {
            return celsius;
        }
    }
    panic!("no reading")
}

/// Table 9 of the data sheet: °C of a PT100, and the code with 400 Ω.
const TABLE_9: [(f32, u16); 34] = [
    (-200.0, 1517),
    (-175.0, 2394),
    (-150.0, 3254),
    (-125.0, 4101),
    (-100.0, 4936),
    (-75.0, 5762),
    (-50.0, 6579),
    (-40.0, 6903),
    (-30.0, 7227),
    (-20.0, 7550),
    (-10.0, 7871),
    (0.0, 8192),
    (10.0, 8512),
    (20.0, 8830),
    (30.0, 9148),
    (40.0, 9465),
    (50.0, 9781),
    (60.0, 10096),
    (70.0, 10410),
    (80.0, 10723),
    (90.0, 11035),
    (100.0, 11346),
    (110.0, 11657),
    (120.0, 11966),
    (130.0, 12274),
    (140.0, 12582),
    (150.0, 12888),
    (160.0, 13194),
    (170.0, 13498),
    (180.0, 13802),
    (190.0, 14104),
    (200.0, 14406),
    (225.0, 15156),
    (250.0, 15901),
];

#[test]
fn codes_are_the_temperatures_of_the_data_sheet() {
    for conversion in [Conversion::Automatic, Conversion::OneShot] {
        let chip = Spi::new();
        let mut sensor = chip.sensor(conversion);
        for (celsius, code) in TABLE_9 {
            chip.0.borrow_mut().code = code;
            // A conversion that began earlier may end with the previous code.
            reading(&chip, &mut sensor);
            let found = reading(&chip, &mut sensor);
            // Half a code is 0.006 Ω, and 0.36 Ω is 1 K.
            assert!((found - celsius).abs() < 0.017, "{celsius}: {found}");
        }
    }
}

#[test]
fn automatic_conversion_gives_a_reading_with_every_call() {
    let chip = Spi::new();
    let mut sensor = chip.sensor(Conversion::Automatic);
    // The wires are checked first; then it converts.
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(chip.configuration(), 0x85);
    // The check is not complete.
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(chip.configuration(), 0x85);
    chip.elapse();
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(chip.configuration(), 0xC1);
    // No conversion is complete.
    assert_eq!(sensor.celsius(), Ok(None));
    for _ in 0..3 {
        chip.elapse();
        assert!(matches!(sensor.celsius(), Ok(Some(_))));
        assert_eq!(chip.configuration(), 0xC1);
    }
}

#[test]
fn one_shot_checks_the_wires_before_each_reading() {
    let chip = Spi::new();
    let mut sensor = chip.sensor(Conversion::OneShot);
    assert_eq!(sensor.celsius(), Ok(None));
    for _ in 0..3 {
        assert_eq!(chip.configuration(), 0x85);
        chip.elapse();
        assert_eq!(sensor.celsius(), Ok(None));
        assert_eq!(chip.configuration(), 0xA1);
        chip.elapse();
        assert!(matches!(sensor.celsius(), Ok(Some(_))));
    }
    // A wire that comes off later is detected too.
    chip.0.borrow_mut().wires = 0x20;
    chip.elapse();
    let wiring = SensorError::Wiring(Faults::REFERENCE_HIGH);
    assert_eq!(sensor.celsius(), Err(wiring));
}

#[test]
fn wires_mains_and_thresholds_are_set() {
    for (wires, mains, configuration) in [
        (Wires::Two, Mains::Hz60, 0x84),
        (Wires::Four, Mains::Hz50, 0x85),
        (Wires::Three, Mains::Hz60, 0x94),
        (Wires::Three, Mains::Hz50, 0x95),
    ] {
        let chip = Spi::new();
        let mut sensor = Max31865::new(
            chip.clone(),
            Platinum::PT1000,
            4300.0,
            wires,
            mains,
            Conversion::Automatic,
        );
        assert_eq!(sensor.celsius(), Ok(None));
        assert_eq!(chip.configuration(), configuration);
        // 3905.0 and 184.8 of 4300 Ω, in units of 2^-15, above the fault bit.
        let thresholds = chip.0.borrow().registers[3..7].to_vec();
        let [a, b] = (29_757_u16 << 1).to_be_bytes();
        let [c, d] = (1_408_u16 << 1).to_be_bytes();
        assert_eq!(thresholds, [a, b, c, d]);
        chip.0.borrow_mut().code = 8_366; // 1097.82 Ω
        let celsius = reading(&chip, &mut sensor);
        assert!((celsius - 25.125).abs() < 0.01, "{celsius}");
        assert_eq!(
            sensor.release().configuration() & 0x11,
            configuration & 0x11
        );
    }
    // A reference that is too small: no threshold exceeds full scale, which an open sensor reads.
    let chip = Spi::new();
    let mut sensor = Max31865::new(
        chip.clone(),
        Platinum::PT100,
        200.0,
        Wires::Three,
        Mains::Hz50,
        Conversion::Automatic,
    );
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(chip.0.borrow().registers[3..5], [0xFF, 0xFE]);
}

#[test]
fn every_fault_bit_is_named_and_cleared() {
    for (bit, name, open, short) in [
        (0x80, "open: resistance above the threshold", true, false),
        (0x40, "shorted: resistance below the threshold", false, true),
        (0x20, "open: REFIN- high", true, false),
        (0x10, "shorted to ground: REFIN- low", false, true),
        (0x08, "shorted to ground: RTDIN- low", false, true),
        (0x04, "voltage outside the supply", false, false),
    ] {
        let chip = Spi::new();
        let mut sensor = chip.sensor(Conversion::Automatic);
        reading(&chip, &mut sensor);
        chip.0.borrow_mut().registers[7] = bit;
        let error = sensor.celsius().expect_err("a fault");
        let SensorError::Wiring(faults) = error else {
            panic!("{error}")
        };
        assert_eq!(faults.bits(), bit);
        assert_eq!(format!("{error}"), name);
        assert_eq!((error.is_open(), error.is_short()), (open, short));
        // The faults are cleared, and the wires are checked again.
        assert_eq!(chip.0.borrow().registers[7], 0);
        assert_eq!(chip.configuration(), 0x85);
        let celsius = reading(&chip, &mut sensor);
        // 8988 codes are 109.717 Ω.
        assert!((celsius - 24.96).abs() < 0.01, "{celsius}");
    }
    let error = SensorError::Wiring(Faults::INPUT_LOW);
    assert!(!error.is_open() && error != SensorError::Short);
}

#[test]
fn an_open_sensor_names_every_fault_while_it_lasts() {
    let chip = Spi::new();
    let mut sensor = chip.sensor(Conversion::Automatic);
    reading(&chip, &mut sensor);
    // Full scale, and the next check finds REFIN− high.
    chip.0.borrow_mut().code = 0x7FFF;
    chip.0.borrow_mut().wires = 0x20;
    chip.elapse();
    assert_eq!(sensor.celsius(), Err(SensorError::Wiring(Faults::HIGH)));
    for _ in 0..5 {
        chip.elapse();
        let wiring = SensorError::Wiring(Faults::REFERENCE_HIGH);
        assert_eq!(sensor.celsius(), Err(wiring));
    }
    // Shorted, and near a supply.
    chip.0.borrow_mut().wires = 0x18;
    chip.0.borrow_mut().voltage = 0x04;
    chip.elapse();
    let error = sensor.celsius().expect_err("faults");
    assert_eq!(
        format!("{error}"),
        "shorted to ground: REFIN- low, shorted to ground: RTDIN- low, voltage outside the supply"
    );
    chip.0.borrow_mut().wires = 0;
    chip.0.borrow_mut().voltage = 0;
    chip.0.borrow_mut().code = 3;
    chip.elapse();
    // The check finds nothing, but the conversion does.
    assert_eq!(sensor.celsius(), Ok(None));
    chip.elapse();
    assert_eq!(sensor.celsius(), Err(SensorError::Wiring(Faults::LOW)));
}

#[test]
fn a_converter_that_is_not_there_is_named_and_one_that_comes_back_is_set() {
    let chip = Spi::new();
    let mut sensor = chip.sensor(Conversion::Automatic);
    chip.0.borrow_mut().connected = false;
    for (idle, found) in [(0xFF, 0xFFFF), (0, 0)] {
        chip.0.borrow_mut().idle = idle;
        for _ in 0..3 {
            assert_eq!(sensor.celsius(), Err(SensorError::Identity { found }));
        }
    }
    // A plausible configuration on the bus is not enough.
    chip.0.borrow_mut().idle = 0x81;
    let found = 0x8181;
    assert_eq!(sensor.celsius(), Err(SensorError::Identity { found }));
    chip.0.borrow_mut().connected = true;
    let before = reading(&chip, &mut sensor);
    // It loses power: it is configured again, and no reset register is read as a value.
    chip.0.borrow_mut().registers = [0, 0, 0, 0xFF, 0xFF, 0, 0, 0];
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(chip.configuration(), 0x85);
    assert_eq!(reading(&chip, &mut sensor), before);
    // A single bit of the configuration flips: supply, conversion, wires, filter.
    for bit in [0x80, 0x40, 0x10, 0x01] {
        chip.0.borrow_mut().registers[0] ^= bit;
        assert_eq!(sensor.celsius(), Ok(None));
        assert_eq!(chip.configuration(), 0x85);
        assert_eq!(reading(&chip, &mut sensor), before);
    }
    // Only the thresholds are lost.
    chip.0.borrow_mut().registers[6] ^= 2;
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(reading(&chip, &mut sensor), before);
    // The bus itself fails.
    chip.0.borrow_mut().idle = 0x55;
    let error = SensorError::Spi(spi::ErrorKind::ModeFault);
    assert_eq!(sensor.celsius(), Err(error));
}
