//! Drivers as the temperature inputs of a controller.

use std::cell::Cell;

use trueaxis::{Auxiliary, AuxiliaryKind};
use trueaxis_firmware::temperature::{Settings, Temperatures};
use trueaxis_sensors::{Divider, Ntc, Resistive, SensorError, Side};

type Read<'s> = &'s mut dyn FnMut() -> Result<Option<f32>, SensorError>;

/// An open or shorted sensor beside a good one of another kind is lost and reported, and its input is held.
#[test]
fn an_open_or_shorted_resistor_is_lost_and_its_input_held() {
    for (fault, error) in [(1.0, SensorError::Open), (0.0, SensorError::Short)] {
        let ratio = Cell::new(0.5);
        let divider = Divider {
            resistor: 10_000.0,
            sensor: Side::Low,
        };
        let mut bed = Resistive::new(|| Ok(Some(ratio.get())), divider, Ntc::VISHAY_10K_3977);
        let (mut bed, mut column) = (|| bed.celsius(), || Ok(Some(21.0)));
        let sensors: [(&str, Read<'_>); 2] = [("bed", &mut bed), ("column", &mut column)];
        let mut temperatures = Temperatures::new(sensors, Settings::MACHINE);
        let inputs = ["bed", "column"].map(|name| Auxiliary {
            kind: AuxiliaryKind::Temperature,
            name: name.try_into().expect("at most 16 bytes"),
            reference: 20.0,
            sensor: trueaxis::Sensor::USUAL,
        });
        temperatures.assign(&inputs);
        for _ in 0..3 {
            temperatures.poll(1.0);
        }
        temperatures.advance(0.0, true);
        let before: Vec<(usize, f32)> = temperatures.values().collect();
        assert!((before[0].1 - 5.0).abs() < 1e-3, "{before:?}");
        assert_eq!(before[1], (1, 1.0));
        assert_eq!(temperatures.lost(), 0);
        ratio.set(fault);
        for second in 1..=20 {
            temperatures.poll(1.0);
            temperatures.advance(1.0, false);
            assert_eq!(temperatures.values().collect::<Vec<_>>(), before);
            assert_eq!(temperatures.lost(), u8::from(second > 5));
        }
        let (name, _, lost, found) = temperatures.sensors().next().expect("the bed");
        assert_eq!((name, lost, found), ("bed", true, Some(error)));
    }
}
