//! Terms as products of tables of one input each; every table serves one output.

mod layout;
mod points;

pub use layout::{Factor, Function, Placed, Product, layout, subtracted};
pub use points::{Points, points};
