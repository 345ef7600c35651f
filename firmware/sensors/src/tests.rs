//! Drivers against simulated devices, curves against published tables.

mod curves;
mod divider;
mod max31865;
mod tmp117;
