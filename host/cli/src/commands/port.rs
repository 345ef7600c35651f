//! `--port`, and errors of the link.

use super::bad_input::BadInput;
use clap::Args;
use trueaxis::LoadError;
use trueaxis::link::Refusal;
use trueaxis_controllers::link::{
    self, BadPort, Client, LinkError, LinkedController, Port, UploadError,
};

/// Connection to the controller.
#[derive(Args)]
pub struct PortArguments {
    /// Serial device, pseudo-terminal, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    pub port: String,
    /// Baud rate of a serial device
    #[arg(long, value_name = "RATE", default_value_t = Self::BAUD)]
    pub baud: u32,
}

/// Connection to a board, or to the HAL component of LinuxCNC on this computer.
#[derive(Args)]
pub struct Connection {
    /// Serial device, pseudo-terminal, or tcp:HOST:PORT
    #[arg(
        long,
        value_name = "PORT",
        required_unless_present = "hal",
        conflicts_with = "hal"
    )]
    port: Option<String>,
    /// Baud rate of a serial device
    #[arg(long, value_name = "RATE", default_value_t = 115_200)]
    baud: u32,
    /// The component in the running LinuxCNC on this computer
    #[arg(long)]
    hal: bool,
}

impl Connection {
    /// The port of a board; `None` for HAL.
    pub fn port(&self) -> Option<PortArguments> {
        Some(PortArguments {
            port: self.port.clone()?,
            baud: self.baud,
        })
    }
}

/// A client on any port.
pub type AnyClient = Client<Box<dyn Port + Send>>;

impl PortArguments {
    /// Baud rate of a serial device if none is given.
    pub const BAUD: u32 = 115_200;

    /// Opens the port and performs the handshake.
    pub fn connect(&self) -> Result<(AnyClient, LinkedController), BadInput> {
        let port = link::open(&self.port, self.baud).map_err(|error| {
            let remedy = match &error {
                BadPort::Address(_) => "give tcp:HOST:PORT, for example tcp:localhost:4444",
                BadPort::Open(..) => {
                    "check that the controller is connected, that the name is right and that no other program has the port open"
                }
            };
            BadInput::new(error.to_string(), remedy)
        })?;
        Client::connect(port).map_err(|error| self.bad(&error))
    }

    /// Describes an error of the link.
    pub fn bad(&self, error: &LinkError) -> BadInput {
        BadInput::new(format!("{}: {error}", self.port), remedy(error))
    }

    /// Describes why a blob was not uploaded.
    pub fn bad_flash(&self, error: &UploadError) -> BadInput {
        let remedy = match error {
            UploadError::Blob(_) => "copy the file again (as binary), or compile it again",
            UploadError::OtherMachine { .. } => {
                "check that this is the right file and the right port; --force if it is meant so"
            }
            UploadError::TooLarge(_) => {
                "compile it with the --target that `trueaxis flash --dry-run` prints, or build the firmware with larger capacities"
            }
            UploadError::Link(error) => remedy(error),
            UploadError::NotReady(_) => "`trueaxis monitor` shows the reason",
            UploadError::NotVerified(_) => {
                "flash it again; if that does not help, the flash memory is worn out"
            }
        };
        BadInput::new(format!("{}: {error}", self.port), remedy)
    }
}

fn remedy(error: &LinkError) -> &'static str {
    match error {
        LinkError::Port(_) => {
            "check the cable, and run the command again: an upload goes on where it was"
        }
        LinkError::Silent => {
            "check that the controller runs, the port, and --baud; an upload goes on where it was"
        }
        LinkError::Version { .. } => "use the version of trueaxis that belongs to the firmware",
        LinkError::Unexpected => "use the version of trueaxis that belongs to the firmware",
        LinkError::Refused(refusal) => match refusal {
            Refusal::NotStandstill => {
                "stop the machine and switch its drives off: this controller pauses while it writes flash"
            }
            Refusal::Busy => {
                "wait until the change of compensation or the upload is over; `trueaxis monitor` shows it"
            }
            Refusal::Uploading { .. } => {
                "wait until the other upload is over, or until it is given up, and run the command again"
            }
            Refusal::Wear { .. } => {
                "flash memory wears: find out what uploads that often, wait, and run the command again"
            }
            Refusal::Full => {
                "flash a compensation with --activate, or `trueaxis control … rollback`: the other slot has room"
            }
            Refusal::NoCompensation => "flash one with --activate first",
            Refusal::NotValid => {
                "`trueaxis monitor` shows the slots; flash a compensation with --activate"
            }
            Refusal::Suspended => "wait until the upload is over, or until it is given up",
            Refusal::Weight(_) => {
                "give a weight within the limits; `trueaxis control … show` lists them"
            }
            Refusal::Unknown => "use the version of trueaxis that belongs to the firmware",
            Refusal::Load(LoadError::TooSmall { .. }) => {
                "compile it with a larger --tolerance, or build the firmware with larger capacities"
            }
            Refusal::OtherMachine => "check that this is the right file; --force if it is meant so",
            Refusal::Unusable { .. } => {
                "the active compensation stays in use; restart the controller to try the slot once more, then replace the part: its flash memory is worn out"
            }
            Refusal::NoNonce => {
                "restart the controller; if that does not help, its random number generator does not work"
            }
            Refusal::Spoiled | Refusal::Flash => {
                "flash it again; if that does not help, the flash memory is worn out"
            }
            _ => "see `trueaxis monitor` for the state of the controller",
        },
    }
}
