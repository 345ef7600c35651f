//! A machine with sensors that come and go.

mod curves;
mod divider;
mod max31865;

use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

use embedded_hal::i2c::{self, ErrorType, I2c, NoAcknowledgeSource, Operation};
use proptest::prelude::*;

use super::*;

/// A TMP117 as seen from the bus.
#[derive(Clone, Debug)]
struct Chip {
    connected: bool,
    /// What every read gives if a line is stuck.
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

    /// A conversion has ended.
    fn measure(&self, celsius: f32) {
        let mut chip = self.0.borrow_mut();
        chip.temperature = (celsius * 128.0) as i16;
        chip.fresh = chip.configuration & 0x0C00 != 0x0C00;
    }

    fn sensor(&self) -> Tmp117<Self> {
        Tmp117::new(self.clone(), Tmp117Address::Supply)
    }
}

fn auxiliary(kind: AuxiliaryKind, name: &str, reference: f32) -> Auxiliary {
    Auxiliary {
        kind,
        name: name.try_into().expect("at most 16 bytes"),
        reference,
    }
}

/// Inputs: a tool length, the bed, a sensor that does not exist, the column.
fn inputs() -> [Auxiliary; 4] {
    [
        auxiliary(AuxiliaryKind::ToolLength, "bed", 130.0),
        auxiliary(AuxiliaryKind::Temperature, "bed", 20.0),
        auxiliary(AuxiliaryKind::Temperature, "nothing", 20.0),
        auxiliary(AuxiliaryKind::Temperature, "column", 21.0),
    ]
}

fn machine(bed: &Bus, column: &Bus) -> Temperatures<Tmp117<Bus>, 2> {
    let sensors = [("bed", bed.sensor()), ("column", column.sensor())];
    let mut temperatures = Temperatures::new(sensors, Settings::MACHINE);
    temperatures.assign(&inputs());
    temperatures
}

fn values<T: Thermometer, const N: usize>(temperatures: &Temperatures<T, N>) -> Vec<(usize, f32)> {
    temperatures.values().collect()
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
        // Each result once.
        assert_eq!(sensor.celsius(), Ok(None));
    }
    // The value after a reset, and what cannot be measured.
    for register in [i16::MIN, i16::MAX, 0x4B01, -0x1B81] {
        bus.0.borrow_mut().temperature = register;
        bus.0.borrow_mut().fresh = true;
        assert_eq!(sensor.celsius(), Err(SensorError::Implausible));
    }
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

#[test]
fn inputs_are_differences_to_their_references() {
    let (bed, column) = (Bus::new(), Bus::new());
    let mut temperatures = machine(&bed, &column);
    assert_eq!(values(&temperatures), [(1, 0.0), (2, 0.0), (3, 0.0)]);
    assert_eq!(temperatures.lost(), 0b1110);
    temperatures.poll(1.0);
    for lost in [0b1110, 0b1110, 0b0100] {
        assert_eq!(values(&temperatures), [(1, 0.0), (2, 0.0), (3, 0.0)]);
        bed.measure(25.0);
        column.measure(20.5);
        temperatures.poll(1.0);
        assert_eq!(temperatures.lost(), lost);
    }
    // Nothing is corrected yet: the inputs may jump.
    temperatures.advance(0.001, true);
    assert_eq!(values(&temperatures), [(1, 5.0), (2, 0.0), (3, -0.5)]);
    // A compensation with another reference for the column: no input jumps.
    let mut inputs = inputs();
    inputs[3].reference = 20.0;
    temperatures.assign(&inputs);
    assert_eq!(values(&temperatures), [(1, 5.0), (2, 0.0), (3, -0.5)]);
    temperatures.assign(&inputs[..2]);
    assert_eq!(values(&temperatures), [(1, 5.0)]);
    assert_eq!(temperatures.lost(), 0);
}

#[test]
fn a_lost_sensor_holds_its_value_and_comes_back_slowly() {
    let (bed, column) = (Bus::new(), Bus::new());
    let mut temperatures = machine(&bed, &column);
    temperatures.poll(1.0);
    for _ in 0..3 {
        bed.measure(25.0);
        column.measure(21.0);
        temperatures.poll(1.0);
    }
    temperatures.advance(0.0, true);
    // Silent: no conversion ends any more. Missing: nobody answers.
    for missing in [false, true] {
        bed.0.borrow_mut().connected = !missing;
        for second in 1..=20 {
            column.measure(21.0);
            temperatures.poll(1.0);
            temperatures.advance(1.0, false);
            assert_eq!(values(&temperatures)[0], (1, 5.0));
            let lost = missing || second > 5;
            assert_eq!(temperatures.lost() & 0b1010, if lost { 0b0010 } else { 0 });
        }
    }
    let (name, celsius, lost, error) = temperatures.sensors().next().expect("the bed");
    assert_eq!((name, celsius, lost), ("bed", Some(25.0), true));
    assert!(matches!(error, Some(SensorError::Bus(_))));
    // Warmer by 10 K when it is back, having lost its configuration.
    bed.0.borrow_mut().connected = true;
    bed.0.borrow_mut().configuration = 0x0C20;
    let mut last = 5.0;
    for second in 0..300 {
        bed.measure(35.0);
        temperatures.poll(1.0);
        temperatures.advance(1.0, false);
        let value = values(&temperatures)[0].1;
        assert!(value >= last && value - last < 0.100_01, "{last} {value}");
        last = value;
        assert_eq!(
            temperatures.lost() & 0b0010,
            if second == 0 { 0b0010 } else { 0 }
        );
    }
    assert!((last - 15.0).abs() < 1e-3, "{last}");
}

#[test]
fn an_input_falls_with_its_rate_too_and_stands_while_no_time_passes() {
    let (bed, column) = (Bus::new(), Bus::new());
    let mut temperatures = machine(&bed, &column);
    for _ in 0..4 {
        bed.measure(25.0);
        temperatures.poll(1.0);
    }
    temperatures.advance(0.0, true);
    for _ in 0..100 {
        bed.measure(15.0);
        temperatures.poll(1.0);
    }
    for second in 0..40 {
        let value = values(&temperatures)[0].1;
        // 0.1 K/s, and the rounding of so many sums.
        assert!((value - (5.0 - 0.1 * second as f32)).abs() < 1e-4);
        for nothing in [0.0, -1.0, f32::NAN] {
            temperatures.advance(nothing, false);
            assert_eq!(values(&temperatures)[0].1, value);
        }
        temperatures.advance(1.0, false);
    }
}

#[test]
fn a_single_wrong_reading_changes_nothing() {
    let mut filter = Filter::new(5.0, 5.0);
    for _ in 0..5 {
        filter.take(Ok(Some(20.0)), 1.0);
    }
    filter.take(Ok(Some(85.0)), 1.0);
    for _ in 0..5 {
        assert_eq!(filter.celsius(), Some(20.0));
        filter.take(Ok(Some(20.0)), 1.0);
    }
}

#[test]
fn a_step_is_followed_as_the_time_constant_says() {
    // The backward-Euler low-pass: after n readings the rest is (τ/(τ + 1 s))^n of the step.
    let mut filter = Filter::new(5.0, 5.0);
    for _ in 0..3 {
        filter.take(Ok(Some(20.0)), 1.0);
    }
    // The median lets a step through with the second reading.
    filter.take(Ok(Some(30.0)), 1.0);
    let mut rest = 10.0;
    for _ in 0..40 {
        filter.take(Ok(Some(30.0)), 1.0);
        rest *= 5.0 / 6.0;
        let celsius = filter.celsius().expect("readings");
        assert!((30.0 - rest - celsius).abs() < 1e-4, "{celsius}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// Whatever sensors and clocks say: the input stays within what was read, moves no faster
    /// than the rate, and is finite.
    #[test]
    fn inputs_are_bounded_in_value_and_rate(
        events in prop::collection::vec(
            (
                prop_oneof![
                    4 => (-60.0_f32..160.0).prop_map(|celsius| Ok(Some(celsius))),
                    1 => any::<f32>().prop_map(|any| Ok(Some(any))),
                    1 => Just(Ok(None)),
                    1 => Just(Err(SensorError::Implausible)),
                ],
                prop_oneof![8 => 0.0_f32..3.0, 1 => any::<f32>()],
            ),
            1..100,
        ),
    ) {
        struct Script(Vec<Result<Option<f32>, SensorError>>);
        impl Thermometer for Script {
            fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
                self.0.pop().expect("one each")
            }
        }
        let script = events.iter().rev().map(|event| event.0).collect();
        let mut temperatures = Temperatures::new([("bed", Script(script))], Settings::MACHINE);
        temperatures.assign(&[auxiliary(AuxiliaryKind::Temperature, "bed", 20.0)]);
        let mut before = 0.0;
        let (mut low, mut high) = (0.0_f32, 0.0_f32);
        for (reading, elapsed) in events {
            if let Ok(Some(celsius)) = reading && (-273.15..=2000.0).contains(&celsius) {
                (low, high) = (low.min(celsius - 20.0), high.max(celsius - 20.0));
            }
            temperatures.poll(elapsed);
            temperatures.advance(elapsed, false);
            let value = values(&temperatures)[0].1;
            prop_assert!(value.is_finite());
            let slack = 1e-5 * (high - low);
            prop_assert!((low - slack..=high + slack).contains(&value));
            if (0.0..1e6).contains(&elapsed) {
                prop_assert!((value - before).abs() <= 0.1 * elapsed + 1e-4 * value.abs().max(1.0));
            }
            before = value;
        }
    }
}
