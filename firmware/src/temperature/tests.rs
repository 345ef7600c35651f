//! A machine with sensors that fail and return.

use core::cell::Cell;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;

/// Why a sensor of these tests gives no reading.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Unplugged;

/// The sensor's next result, returned once: after that there is no new reading until the next conversion.
#[derive(Debug)]
struct Probe(Cell<Result<Option<f32>, Unplugged>>);

impl Probe {
    fn new() -> Self {
        Self(Cell::new(Ok(None)))
    }

    /// A conversion has ended.
    fn measure(&self, celsius: f32) {
        if self.0.get().is_ok() {
            self.0.set(Ok(Some(celsius)));
        }
    }

    fn connect(&self, connected: bool) {
        self.0
            .set(if connected { Ok(None) } else { Err(Unplugged) });
    }
}

impl Thermometer for &Probe {
    type Error = Unplugged;

    fn celsius(&mut self) -> Result<Option<f32>, Unplugged> {
        let reading = self.0.get();
        self.0.set(reading.map(|_| None));
        reading
    }
}

fn auxiliary(kind: AuxiliaryKind, name: &str, reference: f32) -> Auxiliary {
    Auxiliary {
        kind,
        name: name.try_into().expect("at most 16 bytes"),
        reference,
        sensor: trueaxis::Sensor::USUAL,
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

fn machine<'p>(bed: &'p Probe, column: &'p Probe) -> Temperatures<&'p Probe, 2> {
    let sensors = [("bed", bed), ("column", column)];
    let mut temperatures = Temperatures::new(sensors, Settings::MACHINE);
    temperatures.assign(&inputs());
    temperatures
}

fn values<T: Thermometer, const N: usize>(temperatures: &Temperatures<T, N>) -> Vec<(usize, f32)> {
    temperatures.values().collect()
}

#[test]
fn inputs_are_differences_to_their_references() {
    let (bed, column) = (Probe::new(), Probe::new());
    let mut temperatures = machine(&bed, &column);
    assert_eq!(temperatures.lost(), 0b1110);
    temperatures.poll(1.0);
    for lost in [0b1110, 0b1110, 0b0100] {
        temperatures.advance(1.0, true);
        let unknown = values(&temperatures);
        assert!(unknown[0].1.is_nan() && unknown[2].1.is_nan());
        assert_eq!(unknown[1], (2, 0.0));
        bed.measure(25.0);
        column.measure(20.5);
        temperatures.poll(1.0);
        assert_eq!(temperatures.lost(), lost);
    }
    // Nothing is corrected yet, so the inputs may jump.
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

/// Whether corrections are in or not: a machine that is warm at the start does not count as cold.
#[test]
fn an_input_starts_at_the_first_temperature_and_without_one_at_the_reference() {
    for free in [false, true] {
        let (bed, column) = (Probe::new(), Probe::new());
        let mut temperatures = machine(&bed, &column);
        for second in 1..=8 {
            bed.measure(35.0);
            temperatures.poll(1.0);
            temperatures.advance(1.0, free);
            let [bed, _, column] = values(&temperatures)[..] else {
                panic!("three inputs");
            };
            let warm = if second < 3 { f32::NAN } else { 15.0 };
            assert_eq!(bed.1.to_bits(), warm.to_bits(), "{second} s");
            let absent = if second <= 5 { f32::NAN } else { 0.0 };
            assert_eq!(column.1.to_bits(), absent.to_bits(), "{second} s");
        }
        assert_eq!(temperatures.lost(), 0b1100);
    }
}

#[test]
fn a_lost_sensor_holds_its_value_and_comes_back_slowly() {
    let (bed, column) = (Probe::new(), Probe::new());
    let mut temperatures = machine(&bed, &column);
    temperatures.poll(1.0);
    for _ in 0..3 {
        bed.measure(25.0);
        column.measure(21.0);
        temperatures.poll(1.0);
    }
    temperatures.advance(0.0, true);
    // Silent: no conversion ends any more. Missing: no answer at all.
    for missing in [false, true] {
        bed.connect(!missing);
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
    assert_eq!(error, Some(Unplugged));
    // It is 10 K warmer when it returns, as its first reading shows.
    bed.connect(true);
    temperatures.poll(1.0);
    assert_eq!(temperatures.lost() & 0b0010, 0b0010);
    let mut last = 5.0;
    for _ in 0..300 {
        bed.measure(35.0);
        temperatures.poll(1.0);
        temperatures.advance(1.0, false);
        let value = values(&temperatures)[0].1;
        assert!(value >= last && value - last < 0.100_01, "{last} {value}");
        last = value;
        assert_eq!(temperatures.lost() & 0b0010, 0);
    }
    assert!((last - 15.0).abs() < 1e-3, "{last}");
}

#[test]
fn an_input_falls_with_its_rate_too_and_stands_while_no_time_passes() {
    let (bed, column) = (Probe::new(), Probe::new());
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
        // 0.1 K/s, plus rounding of that many sums.
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
    let mut filter = Filter::<Unplugged>::new(5.0, 5.0);
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
    // The backward-Euler low-pass: after n readings the remainder is (τ/(τ + 1 s))^n of the step.
    let mut filter = Filter::<Unplugged>::new(5.0, 5.0);
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

    /// Whatever sensors and clocks do, the input is finite once it is known, stays within the readings, and moves no
    /// faster than the rate.
    #[test]
    fn inputs_are_bounded_in_value_and_rate(
        events in prop::collection::vec(
            (
                prop_oneof![
                    4 => (-60.0_f32..160.0).prop_map(|celsius| Ok(Some(celsius))),
                    1 => any::<f32>().prop_map(|any| Ok(Some(any))),
                    1 => Just(Ok(None)),
                    1 => Just(Err(Unplugged)),
                ],
                prop_oneof![8 => 0.0_f32..3.0, 1 => any::<f32>()],
            ),
            1..100,
        ),
    ) {
        let mut script = events.iter().map(|event| event.0);
        let sensor = || script.next().expect("one each");
        let mut temperatures = Temperatures::new([("bed", sensor)], Settings::MACHINE);
        temperatures.assign(&[auxiliary(AuxiliaryKind::Temperature, "bed", 20.0)]);
        let mut before = f32::NAN;
        let (mut low, mut high) = (0.0_f32, 0.0_f32);
        for &(reading, elapsed) in &events {
            if let Ok(Some(celsius)) = reading && (-273.15..=2000.0).contains(&celsius) {
                (low, high) = (low.min(celsius - 20.0), high.max(celsius - 20.0));
            }
            temperatures.poll(elapsed);
            temperatures.advance(elapsed, false);
            let value = values(&temperatures)[0].1;
            if value.is_nan() && before.is_nan() {
                prop_assert_eq!(temperatures.lost(), 1);
                continue;
            }
            prop_assert!(value.is_finite());
            let slack = 1e-5 * (high - low);
            prop_assert!((low - slack..=high + slack).contains(&value));
            if (0.0..1e6).contains(&elapsed) && !before.is_nan() {
                prop_assert!((value - before).abs() <= 0.1 * elapsed + 1e-4 * value.abs().max(1.0));
            }
            before = value;
        }
    }
}
