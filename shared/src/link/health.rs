//! State of the controller itself, for diagnosis after a fault.

use core::fmt;

use serde::{Deserialize, Serialize};

/// The end of a name: its last bytes, as many as fit, padded with zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tail(pub [u8; Self::MOST]);

impl Tail {
    /// Capacity in bytes.
    pub const MOST: usize = 24;

    /// Keeps the last bytes of a name.
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

/// Prints the printable characters.
impl fmt::Display for Tail {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for byte in self.0.iter().take_while(|byte| **byte != 0) {
            let shown = if byte.is_ascii_graphic() { *byte } else { b'?' };
            write!(f, "{}", char::from(shown))?;
        }
        Ok(())
    }
}

/// Why the controller started. Variants may only be appended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Restart {
    /// Unknown.
    #[default]
    Unknown,
    /// The supply was switched on.
    PowerOn,
    /// The supply was too low.
    BrownOut,
    /// The reset pin.
    Pin,
    /// Requested by a probe or by the program.
    Software,
    /// The watchdog fired: the servo interrupt had stopped.
    ServoStopped,
    /// The watchdog fired: the main loop had stopped.
    MainLoopStopped,
    /// An exception of the processor.
    Exception {
        /// Program counter at the exception.
        address: u32,
        /// Cause as reported by the processor: on a Cortex-M the register CFSR.
        status: u32,
    },
    /// The program panicked.
    Panic {
        /// Line in the source file.
        line: u32,
        /// The end of the path of the source file.
        file: Tail,
    },
    /// The crystal oscillator had stopped.
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

/// State of the controller. All counts start at 0 when it starts, and wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Health {
    /// There is no fault; the fault pin shows the same.
    pub healthy: bool,
    /// Why the controller started.
    pub restart: Restart,
    /// Servo periods with a new command from the motion side.
    pub frames: u32,
    /// Servo periods without a new command, after the first.
    pub repeated: u32,
    /// Commands without a servo period of their own.
    pub skipped: u32,
    /// Invalid frames.
    pub damaged: u32,
    /// How often these errors exceeded the tolerated number.
    pub faults: u32,
    /// Servo periods for which the previous one left no time.
    pub overruns: u32,
    /// Frames of the host with missing or corrupted bytes.
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
