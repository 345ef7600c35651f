//! Host and controller together: the client and the command `trueaxis` against a device on the
//! desktop.

mod command;
mod control;
mod hosts;
mod lossy;
mod served;
mod specimen;
mod wire;
