//! Drivers tested with simulated devices, curves with published tables.

mod curves;
mod divider;
mod max31865;
mod tmp117;
