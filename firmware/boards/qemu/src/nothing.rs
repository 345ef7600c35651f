//! Pins, a watchdog and sensors that are not there.

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use trueaxis_firmware::controller::Watchdog;
use trueaxis_firmware::temperature::{SensorError, Thermometer};

/// A pin that leads nowhere and reads high: of this machine the drives are always off.
pub struct NoPin;

impl ErrorType for NoPin {
    type Error = Infallible;
}

impl OutputPin for NoPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl InputPin for NoPin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(false)
    }
}

/// A watchdog that does not bite: time here is that of the computer, which may be busy.
pub struct NoDog;

impl Watchdog for NoDog {
    fn feed(&mut self) {}
}

/// There are no sensors.
pub enum NoSensor {}

impl Thermometer for NoSensor {
    fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
        match *self {}
    }
}
