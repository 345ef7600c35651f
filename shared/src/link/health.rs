//! How well the controller itself is: what a machine builder looks at after a fault.

use core::fmt;

use serde::{Deserialize, Serialize};

/// The end of a name: as many of its last bytes as there is room for, zeros behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tail(pub [u8; Self::MOST]);

impl Tail {
    /// Bytes that there is room for.
    pub const MOST: usize = 24;

    /// The last bytes of a name.
    #[must_use]
    pub fn of(name: &str) -> Self {
        let mut bytes = [0; Self::MOST];
        let name = name.as_bytes();
        let from = name.len().saturating_sub(Self::MOST);
        let last = name.get(from..).unwrap_or(name);
        for (place, byte) in bytes.iter_mut().zip(last) {
            *place = *byte;
        }
        Self(bytes)
    }
}

/// What is printable of it.
impl fmt::Display for Tail {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for byte in self.0.iter().take_while(|byte| **byte != 0) {
            let shown = if byte.is_ascii_graphic() { *byte } else { b'?' };
            write!(f, "{}", char::from(shown))?;
        }
        Ok(())
    }
}

/// Why the controller has started. The variants may only be appended to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Restart {
    /// Nothing is known.
    #[default]
    Unknown,
    /// The supply has come.
    PowerOn,
    /// The supply was too low.
    BrownOut,
    /// The reset pin.
    Pin,
    /// A probe or the program wanted it.
    Software,
    /// The watchdog: the servo interrupt had stopped.
    ServoStopped,
    /// The watchdog: the main loop had stopped.
    MainLoopStopped,
    /// An exception of the processor.
    Exception {
        /// Where the program was.
        address: u32,
        /// Why, as the processor says it: on a Cortex-M the register CFSR.
        status: u32,
    },
    /// A mistake in the program that it has noticed itself.
    Panic {
        /// Line of its source.
        line: u32,
        /// The end of the path of its source.
        file: Tail,
    },
    /// Its crystal had stopped.
    ClockStopped,
}

impl fmt::Display for Restart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("unknown"),
            Self::PowerOn => f.write_str("power on"),
            Self::BrownOut => f.write_str("the supply was too low"),
            Self::Pin => f.write_str("the reset pin"),
            Self::Software => f.write_str("a probe or the program"),
            Self::ServoStopped => f.write_str("the watchdog: the servo interrupt had stopped"),
            Self::MainLoopStopped => f.write_str("the watchdog: the main loop had stopped"),
            Self::Exception { address, status } => {
                write!(f, "an exception at {address:#010x}, status {status:#010x}")
            }
            Self::Panic { line, file } => write!(f, "a panic in …{file}, line {line}"),
            Self::ClockStopped => f.write_str("the crystal had stopped"),
        }
    }
}

impl Restart {
    /// Whether a fault was the reason.
    #[must_use]
    pub const fn is_fault(&self) -> bool {
        matches!(
            self,
            Self::BrownOut
                | Self::ServoStopped
                | Self::MainLoopStopped
                | Self::Exception { .. }
                | Self::Panic { .. }
                | Self::ClockStopped
        )
    }
}

/// How well the controller is. All counts are since start, with wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Health {
    /// There is no fault: what the fault pin shows.
    pub healthy: bool,
    /// Why it has started.
    pub restart: Restart,
    /// Servo periods with a new command of the motion side.
    pub frames: u32,
    /// Periods without one, after the first.
    pub repeated: u32,
    /// Commands that no period was there for.
    pub skipped: u32,
    /// Frames that were none.
    pub damaged: u32,
    /// How often all this was more than is tolerated.
    pub faults: u32,
    /// Periods that the one before had not left time for.
    pub overruns: u32,
    /// Frames of the host that had lost bytes, or had others.
    pub garbled: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_tail_is_the_end_of_a_name_and_shows_what_is_printable() {
        assert_eq!(Tail::of("").to_string(), "");
        assert_eq!(Tail::of("src/main.rs").to_string(), "src/main.rs");
        let long = "firmware/src/controller/servo.rs";
        assert_eq!(Tail::of(long).to_string(), long[long.len() - 24..]);
        assert_eq!(Tail::of("a\u{7}b c").to_string(), "a?b?c");
    }

    #[test]
    fn what_a_fault_is_and_what_is_not() {
        let exception = Restart::Exception {
            address: 0x0800_1234,
            status: 0x8200,
        };
        let panic = Restart::Panic {
            line: 7,
            file: Tail::of("spi.rs"),
        };
        for fault in [
            Restart::BrownOut,
            Restart::ServoStopped,
            Restart::MainLoopStopped,
            exception,
            panic,
            Restart::ClockStopped,
        ] {
            assert!(fault.is_fault(), "{fault}");
        }
        for none in [
            Restart::Unknown,
            Restart::PowerOn,
            Restart::Pin,
            Restart::Software,
        ] {
            assert!(!none.is_fault(), "{none}");
        }
        assert_eq!(
            exception.to_string(),
            "an exception at 0x08001234, status 0x00008200"
        );
        assert_eq!(panic.to_string(), "a panic in …spi.rs, line 7");
    }
}
