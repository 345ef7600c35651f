//! Machine tools and their error parameters: their files, poses at positions, what an instrument would show of each
//! parameter, and what is left of them with a compensation. Built around the types of `trueaxis-kinematics`.
//!
//! Uses the kinematics and, for positions as a controller reads them, the runtime.

// Modules, most of which use only those before them: `numbers` · `source` (places in files, errors with remedies) ·
// `formats` (CSV; units) · `machine`, `errors` (their files, names, uncertainties) · `kinematics` (paths of the
// kinematics in the host) · `positions`, `motion`, `pose` (rows of positions, tool and axes there) · `explain` ·
// `policy` (what rotary axes correct) · `validate` (the effect of a compensation on the volumetric error) ·
// `uncertainty` (what uncertain parameters leave).

#![forbid(unsafe_code)]

pub mod errors;
pub mod explain;
pub mod formats;
pub mod kinematics;
pub mod machine;
pub mod motion;
pub mod numbers;
pub mod parallel;
pub mod policy;
pub mod pose;
pub mod positions;
pub mod source;
pub mod uncertainty;
pub mod validate;
