//! `--port`, and errors of the link.

use super::bad_input::BadInput;
use clap::Args;
use trueaxis_link::{Client, ControlError, LinkError, LinkedController, Port, UploadError};

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
        let port = trueaxis_link::open(&self.port, self.baud)
            .map_err(|error| BadInput::new(error.to_string(), error.remedy()))?;
        Client::connect(port).map_err(|error| self.bad(&error))
    }

    /// Describes an error of the link.
    pub fn bad(&self, error: &LinkError) -> BadInput {
        BadInput::new(format!("{}: {error}", self.port), error.remedy())
    }

    /// Describes why a setting was refused.
    pub fn refused(&self, error: &ControlError) -> BadInput {
        BadInput::new(format!("{}: {error}", self.port), error.remedy())
    }

    /// Describes why a blob was not uploaded.
    pub fn bad_flash(&self, error: &UploadError) -> BadInput {
        BadInput::new(format!("{}: {error}", self.port), error.remedy())
    }
}
