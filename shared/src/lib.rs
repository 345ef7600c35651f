//! Compensation tables for machine tools, evaluated at servo rate.
//!
//! A [`Compensation`] is read in place from a blob (`.trax`) and turns the commanded positions of a machine into
//! corrections Δq, which the controller *adds* to the commands (machining mode). It consists of *tables* over one input
//! each, of *terms* (weight × product of tables → one output axis) and of *grids*. The same blob gives the same bits on
//! every target: arithmetic is f32 with `+ − ×` and casts, in a fixed order. This assumes the default rounding mode and
//! subnormal numbers that are not flushed to zero.
//!
//! ```
//! use trueaxis::{Compensation, Inputs, Servo, capacities};
//!
//! // Five axes (in the blob's order: Y, A, C, X, Z), and room for its tables. On a controller a
//! // `static`: it is large.
//! type Room = capacities!(axes: 5, banks: 8, tables: 32, terms: 64, grids: 1);
//! type Tables<'a> = Compensation<'a, Room>;
//!
//! let mut tables = Tables::empty();
//! tables.load(trueaxis::include_blob!(concat!(
//!     env!("CARGO_MANIFEST_DIR"),
//!     "/examples/huron-13.trax"
//! )))?;
//! let mut servo = Servo::new(&tables);
//! servo.enable();
//! // In every servo period: uncorrected commands, which axes are referenced, the period in s.
//! let commands = Inputs::at([100.0, 30.0, 45.0, -50.0, -120.0]);
//! for _ in 0..2000 {
//!     servo.update(&commands, 0b1_1111, 0.001);
//! }
//! let correction = servo.update(&commands, 0b1_1111, 0.001);
//! assert_eq!(servo.factor(), 1.0);
//! assert!(correction.status.conditions.names().next().is_none());
//! let to_drive = commands.axes[0] + correction.dq[0];
//! assert!((to_drive - 100.0).abs() < 0.2 && to_drive != 100.0);
//! # Ok::<(), trueaxis::LoadError>(())
//! ```
//!
//! Positions and corrections are in mm and degrees. Only the feature `encode`, with which hosts build blobs (`Draft`),
//! allocates.

// Modules, most of which use only those before them: `format`, `description`, `room`, `weights`, `inputs`, `lag`,
// `load_error`, `checksum`, `header` (shared numbers and data) · `plan` (the data that evaluation reads, and the
// guarantees of its unsafe code) · `access`, `product`, `kernel` (the evaluation) · `contents`, `blob`, `magnitude`,
// `reach` (the rest of the blob, and its checks) · `compensation` · `measure`, `handle`, `draft` (around it) ·
// `direction`, `guard`, `pace`, `ramp`, `catch_up`, `status` · `servo` · `link`.

#![no_std]
#![deny(missing_docs)]

/// Compiles the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(target_endian = "big")]
compile_error!("blobs are read in place and are little-endian");

#[cfg(feature = "encode")]
extern crate alloc;
#[cfg(any(test, feature = "count"))]
extern crate std;

mod access;
mod blob;
mod catch_up;
mod checksum;
mod compensation;
mod contents;
mod description;
mod direction;
#[cfg(feature = "encode")]
mod draft;
mod embed;
mod format;
mod guard;
mod handle;
mod header;
mod inputs;
mod kernel;
mod lag;
#[cfg(feature = "link")]
pub mod link;
mod load_error;
mod magnitude;
mod measure;
#[cfg(feature = "encode")]
mod notes;
#[cfg(all(test, feature = "encode"))]
mod oracle;
mod pace;
mod plan;
mod product;
mod ramp;
mod reach;
mod room;
mod servo;
#[cfg(all(test, feature = "encode"))]
mod specimen;
mod status;
mod weights;
mod work;

pub use checksum::Checksum;
pub use compensation::{Compensation, TermView};
pub use description::{
    ADJUSTABLE, AUXILIARIES, Auxiliary, AuxiliaryKind, Axis, Bank, Direction, FACTORS, GRID_INPUTS,
    GRID_OUTPUTS, Grid, GridAxis, Interpolation, Name, Policy, SampleFormat, Sensor, Term,
};
pub use direction::Reversal;
#[cfg(feature = "encode")]
pub use draft::{AlignedBlob, Draft, DraftBank, DraftGrid, EncodeError, Largest};
#[doc(hidden)]
pub use embed::Aligned;
pub use format::{ALIGNMENT, HEADER, LARGEST_BLOB, MAGIC, VERSION};
pub use handle::{Generated, Handle, OtherBits};
pub use header::Header;
pub use inputs::{Inputs, Travel, Travelling};
pub use lag::Lag;
pub use load_error::{LoadError, Part};
#[cfg(feature = "encode")]
pub use notes::{Notes, Zone};
pub use pace::RISE;
pub use reach::MOST_PERIODS;
pub use room::{Counts, Holds, List, Room, Row, Usual};
pub use servo::{LONGEST_PERIOD, NotTaken, OVERTRAVEL, PATIENCE, Refused, SHORTEST_PERIOD, Servo};
pub use status::{Conditions, Correction, Status};
pub use weights::{WeightError, Weights};
#[cfg(feature = "count")]
#[doc(hidden)]
pub use work::{MOST_ROUNDS, rounds};
