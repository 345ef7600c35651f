//! Writes `everything.trax` of the golden blobs into the current folder.
//!
//! Only for a new version of the format: blobs of released versions never change.

fn main() -> std::io::Result<()> {
    let blob = trueaxis_tests::golden::everything()
        .encode()
        .map_err(std::io::Error::other)?;
    std::fs::write("everything.trax", &*blob)
}
