//! An I²C master on two pins that never blocks for ever.
//!
//! Drivers of microcontrollers wait for flags of the hardware. With a stuck line or without pull-ups some never return,
//! and the link to the host would be lost together with the sensor. Here every wait is bounded, so a stuck line is an
//! error.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

/// Half a clock period, ns: 50 kHz including the time that the pins take.
const HALF: u32 = 10_000;
/// Longest clock stretching by a device, in half clock periods: 1 ms.
const STRETCH: u32 = 100;

const STUCK: ErrorKind = ErrorKind::Bus;

/// A master on two open-drain pins, clock and data, with pull-ups.
#[derive(Debug)]
pub struct SoftI2c<C, D, W> {
    clock: C,
    data: D,
    delay: W,
}

impl<C, D, W> SoftI2c<C, D, W>
where
    C: InputPin + OutputPin,
    D: InputPin + OutputPin,
    W: DelayNs,
{
    /// The pins must be high or released.
    pub const fn new(clock: C, data: D, delay: W) -> Self {
        Self { clock, data, delay }
    }

    fn put(&mut self, high: bool) -> Result<(), ErrorKind> {
        self.data.set_state(high.into()).map_err(|_| STUCK)
    }

    fn lower(&mut self) -> Result<(), ErrorKind> {
        self.clock.set_low().map_err(|_| STUCK)?;
        self.delay.delay_ns(HALF);
        Ok(())
    }

    /// Releases the clock, and waits while a device holds it.
    fn raise(&mut self) -> Result<(), ErrorKind> {
        self.clock.set_high().map_err(|_| STUCK)?;
        for _ in 0..STRETCH {
            self.delay.delay_ns(HALF);
            if self.clock.is_high().map_err(|_| STUCK)? {
                return Ok(());
            }
        }
        Err(STUCK)
    }

    /// One clock; returns the level of the data line while it is high.
    fn bit(&mut self, high: bool) -> Result<bool, ErrorKind> {
        self.put(high)?;
        self.raise()?;
        let read = self.data.is_high().map_err(|_| STUCK)?;
        self.lower()?;
        Ok(read)
    }

    fn start(&mut self) -> Result<(), ErrorKind> {
        self.put(true)?;
        self.raise()?;
        if self.data.is_low().map_err(|_| STUCK)? {
            return Err(STUCK);
        }
        self.put(false)?;
        self.delay.delay_ns(HALF);
        self.lower()
    }

    fn stop(&mut self) -> Result<(), ErrorKind> {
        self.put(false)?;
        self.raise()?;
        self.put(true)?;
        self.delay.delay_ns(HALF);
        Ok(())
    }

    fn send(&mut self, byte: u8, source: NoAcknowledgeSource) -> Result<(), ErrorKind> {
        for k in (0..8).rev() {
            self.bit(byte >> k & 1 == 1)?;
        }
        if self.bit(true)? {
            Err(ErrorKind::NoAcknowledge(source))
        } else {
            Ok(())
        }
    }

    fn receive(&mut self, last: bool) -> Result<u8, ErrorKind> {
        let mut byte = 0;
        for _ in 0..8 {
            byte = byte << 1 | u8::from(self.bit(true)?);
        }
        // The device continues as long as it is acknowledged.
        self.bit(last)?;
        Ok(byte)
    }

    fn carry_out(&mut self, address: u8, steps: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let is_read = |step: &Operation<'_>| matches!(step, Operation::Read(_));
        let mut before = None;
        for k in 0..steps.len() {
            let same_follows = steps.get(k + 1).is_some_and(is_read);
            let Some(step) = steps.get_mut(k) else { break };
            let read = is_read(step);
            if before != Some(read) {
                self.start()?;
                let address = address << 1 | u8::from(read);
                self.send(address, NoAcknowledgeSource::Address)?;
            }
            before = Some(read);
            match step {
                Operation::Write(bytes) => {
                    for &byte in *bytes {
                        self.send(byte, NoAcknowledgeSource::Data)?;
                    }
                }
                Operation::Read(bytes) => {
                    let count = bytes.len();
                    for (place, byte) in bytes.iter_mut().enumerate() {
                        *byte = self.receive(place + 1 == count && !same_follows)?;
                    }
                }
            }
        }
        Ok(())
    }
}

impl<C, D, W> ErrorType for SoftI2c<C, D, W> {
    type Error = ErrorKind;
}

impl<C, D, W> I2c for SoftI2c<C, D, W>
where
    C: InputPin + OutputPin,
    D: InputPin + OutputPin,
    W: DelayNs,
{
    fn transaction(&mut self, address: u8, steps: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let done = self.carry_out(address, steps);
        // Also after a failure, so that the devices release the bus.
        let stopped = self.stop();
        done.and(stopped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use embedded_hal::digital;
    use std::cell::RefCell;
    use std::rc::Rc;
    use std::vec::Vec;

    /// The two lines, with a scripted device.
    #[derive(Default)]
    struct Wires {
        clock: bool,
        data: bool,
        stuck_clock: bool,
        stuck_data: bool,
        /// For each rising clock, whether the device pulls the data line.
        script: Vec<bool>,
        /// For each rising clock, the level that the master drives.
        shown: Vec<bool>,
    }

    impl Wires {
        fn pulled(&self) -> bool {
            let now = self.shown.len().wrapping_sub(usize::from(self.clock));
            self.stuck_data || self.script.get(now).copied().unwrap_or(false)
        }
    }

    #[derive(Clone)]
    struct Clock(Rc<RefCell<Wires>>);
    #[derive(Clone)]
    struct Data(Rc<RefCell<Wires>>);

    impl digital::ErrorType for Clock {
        type Error = Infallible;
    }
    impl digital::ErrorType for Data {
        type Error = Infallible;
    }

    impl OutputPin for Clock {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0.borrow_mut().clock = false;
            Ok(())
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            let mut wires = self.0.borrow_mut();
            if !wires.clock {
                let data = wires.data;
                wires.shown.push(data);
            }
            wires.clock = true;
            Ok(())
        }
    }

    impl OutputPin for Data {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0.borrow_mut().data = false;
            Ok(())
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0.borrow_mut().data = true;
            Ok(())
        }
    }

    impl InputPin for Clock {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            let wires = self.0.borrow();
            Ok(wires.clock && !wires.stuck_clock)
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            self.is_high().map(|high| !high)
        }
    }

    impl InputPin for Data {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            let wires = self.0.borrow();
            Ok(wires.data && !wires.pulled())
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            self.is_high().map(|high| !high)
        }
    }

    struct NoTime;

    impl DelayNs for NoTime {
        fn delay_ns(&mut self, _: u32) {}
    }

    fn bus(wires: Wires) -> (Rc<RefCell<Wires>>, SoftI2c<Clock, Data, NoTime>) {
        let wires = Rc::new(RefCell::new(wires));
        let bus = SoftI2c::new(Clock(wires.clone()), Data(wires.clone()), NoTime);
        (wires, bus)
    }

    fn bits(text: &str, one: char) -> Vec<bool> {
        let bits = text.chars().filter(|c| !c.is_whitespace());
        bits.map(|c| c == one).collect()
    }

    #[test]
    fn a_register_is_read() {
        // Start, address 48 for writing, register 00, repeated start, for reading, 0C 80, stop. P: the device pulls, to
        // acknowledge or to send a 0.
        let script = ". ........P ........P . ........P PPPP..PP. .PPPPPPP. .";
        let shown = "1 100100001 000000001 1 100100011 111111110 111111111 0";
        let (wires, mut bus) = bus(Wires {
            script: bits(script, 'P'),
            ..Wires::default()
        });
        let mut read = [0; 2];
        assert_eq!(bus.write_read(0x48, &[0], &mut read), Ok(()));
        assert_eq!(read, [0x0C, 0x80]);
        assert_eq!(wires.borrow().shown, bits(shown, '1'));
    }

    #[test]
    fn nobody_answers() {
        let (_, mut bus) = bus(Wires::default());
        let refused = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
        assert_eq!(bus.write(0x48, &[1]), Err(refused));
    }

    #[test]
    fn a_stuck_line_is_an_error_and_no_wait() {
        for stuck_clock in [true, false] {
            let (_, mut bus) = bus(Wires {
                stuck_clock,
                stuck_data: !stuck_clock,
                ..Wires::default()
            });
            assert_eq!(bus.read(0x48, &mut [0; 2]), Err(STUCK));
        }
    }
}
