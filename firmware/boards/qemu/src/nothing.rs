//! Pins, a watchdog and sensors that do not exist.

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use trueaxis_firmware::controller::Watchdog;

/// An unconnected pin that reads high: the drives of this machine are always off.
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

/// A watchdog that never fires: time here is that of the host, which may be busy.
pub struct NoDog;

impl Watchdog for NoDog {
    fn feed(&mut self) {}
}

/// An empty list of sensors.
pub const NO_SENSORS: [(&str, fn() -> Result<Option<f32>, Infallible>); 0] = [];
