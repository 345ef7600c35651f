//! `trueaxis simulate controller`

mod moving;
mod socket;

use crate::commands::bad_input::BadInput;
use crate::commands::{Outcome, files, output};
use clap::Args;
use moving::SimulatedMachine;
use socket::Socket;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::mock_flash::MockFlash;
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

/// Run the controller of a board on this computer, to try everything without a board
///
/// Runs until it is interrupted; every command with --port works with it. It is the firmware's own controller at 4 kHz,
/// with two slots of 256 KiB that are blank at each start. Its time is that of an ordinary program. Like a serial line,
/// it has one connection at a time; others wait.
///
/// With --machine and --errors, a machine with these errors moves through its travel behind it, all axes referenced, at
/// its reference temperatures. Every 5 s a line tells the largest error of the tool tip, with the corrections of the
/// controller and without.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate controller --port tcp:127.0.0.1:4444 --machine machine.toml --errors errors.toml\n\nIn another window:\n  trueaxis flash machine.trax --port tcp:127.0.0.1:4444 --activate\n  trueaxis control --port tcp:127.0.0.1:4444 enable"
)]
pub struct ControllerArguments {
    /// Where it listens: tcp:127.0.0.1:PORT, or (not on Windows) the name of a pseudo-terminal to make
    #[arg(long, value_name = "PORT")]
    port: String,
    /// The machine that moves behind it (machine.toml; default: none, and the link commands positions)
    #[arg(long, value_name = "FILE", requires = "errors")]
    machine: Option<PathBuf>,
    /// Errors of the machine (errors.toml)
    #[arg(long, value_name = "FILE", requires = "machine")]
    errors: Option<PathBuf>,
}

/// Servo period (s), as on the boards.
const PERIOD: f32 = 0.00025;
/// One period.
const STEP: Duration = Duration::from_micros(250);
/// Time that is made up at most if this program could not run.
const MOST: Duration = Duration::from_millis(100);
/// Between two looks at the line.
const LOOK: Duration = Duration::from_micros(500);
/// Bytes that are erased together, and their number in a slot.
const BLOCK: usize = 4096;
const BLOCKS: usize = 64;

impl ControllerArguments {
    /// The machine behind the controller, if one is given.
    fn files(&self) -> Result<Option<(Machine, ErrorModel)>, BadInput> {
        let (Some(machine), Some(errors)) = (&self.machine, &self.errors) else {
            return Ok(None);
        };
        let machine = files::read_machine(machine)?;
        let errors = files::read_errors(errors, &machine)?;
        Ok(Some((machine, errors)))
    }

    pub fn run(&self) -> Result<Outcome, BadInput> {
        let files = self.files()?;
        let files = files.as_ref();
        let mut moving = files.map(|(m, errors)| SimulatedMachine::new(m, errors));
        let mut socket = Socket::open(&self.port)?;
        let flash = MockFlash::new(BLOCKS).with_while_busy(WhileBusy::DualBank);
        let mut desktop: Desktop<4, BLOCK> = Desktop::start(flash, PERIOD);
        desktop.standstill.set(moving.is_none());
        let behind = files.map_or(String::new(), |(machine, _)| {
            format!(", and {} moves behind it", machine.name)
        });
        let mut going = output::stream(&format!(
            "{}: a controller waits for a connection{behind}\n{}",
            socket.name(),
            moving.as_ref().map_or("", |_| SimulatedMachine::HEAD)
        ))?;
        let (mut last, mut owed) = (Instant::now(), Duration::ZERO);
        while going {
            socket.exchange(&mut desktop.line);
            desktop.turn(0);
            let now = Instant::now();
            owed = (owed + (now - last)).min(MOST);
            last = now;
            while owed >= STEP {
                owed -= STEP;
                match &mut moving {
                    None => desktop.turn(1),
                    Some(moving) => {
                        if let Some(line) = moving.step(&desktop) {
                            going &= output::stream(&line)?;
                        }
                    }
                }
            }
            sleep(LOOK);
        }
        Ok(Outcome::Done)
    }
}
