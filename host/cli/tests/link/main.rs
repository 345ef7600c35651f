//! Host and controller together: the client and the command `trueaxis` with a device simulated on the desktop.

mod calibrate;
mod command;
mod control;
mod frozen;
mod hosts;
mod lossy;
mod served;
mod simulated;
mod specimen;
mod wire;
