//! Writes `everything.trax` and `lag.trax` of the golden blobs into the current folder.
//!
//! Only for a new version of the format: blobs of released versions never change.

use trueaxis_tests::golden::{everything, lag};

fn main() -> std::io::Result<()> {
    for (name, draft) in [("everything", everything()), ("lag", lag())] {
        let blob = draft.encode().map_err(std::io::Error::other)?;
        std::fs::write(format!("{name}.trax"), &*blob)?;
    }
    Ok(())
}
