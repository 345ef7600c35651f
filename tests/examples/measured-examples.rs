//! Rewrites the error files of `examples/mill-21` and `examples/five-axis-30` in this workspace.

use trueaxis_tests::measured::{five_axis_30, mill_21};

fn main() -> std::io::Result<()> {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
    std::fs::write(format!("{examples}/mill-21/errors-21.toml"), mill_21())?;
    std::fs::write(
        format!("{examples}/five-axis-30/errors-30.toml"),
        five_axis_30(),
    )
}
