//! Shared by `export cec` and `import cec`.

use super::bad_input::BadInput;
use trueaxis_export::cec::AxesError;

/// Describes what is wrong with `--axes`.
pub fn axes(error: &AxesError) -> BadInput {
    BadInput::new(
        format!("--axes: {error}"),
        "write the controller's number or name of each axis: X=AX1,Y=AX2,Z=AX3,A=AX4,C=AX5",
    )
}
