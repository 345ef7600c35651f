//! The measured blobs.

/// Bytes aligned to 32, like blobs in a table slot.
#[repr(C, align(32))]
pub struct Aligned<B: ?Sized>(pub B);

macro_rules! blob {
    ($file:literal) => {
        &Aligned(*include_bytes!(concat!(
            env!("TRUEAXIS_BENCH_BLOBS"),
            "/",
            $file
        )))
    };
}

/// The thirteen errors of the Huron, with the policy `orientation`.
pub static HURON: &Aligned<[u8]> = blob!("huron13.trax");
/// The thirteen errors of the Huron, with the policy `direction`.
pub static HURON_DIRECTION: &Aligned<[u8]> = blob!("huron13-direction.trax");
/// The ten errors of the Kolibri, with the policy `direction`.
pub static KOLIBRI_DIRECTION: &Aligned<[u8]> = blob!("kolibri10-direction.trax");
/// 25 × 25 × 25 nodes over X Y Z, three outputs, f32.
pub static GRID: &Aligned<[u8]> = blob!("grid25.trax");
/// The 40 tables of the source document: 13, 11, 14, 1 and 1 for X, Y, Z, A and C.
pub static DOCUMENT: &Aligned<[u8]> = blob!("document40.trax");
/// The thirteen errors of the Huron with the scheme `fik`, and with five adjustable weights.
pub static FIK: [&Aligned<[u8]>; 2] = [blob!("huron13-fik.trax"), blob!("huron13-fik-5.trax")];
/// Banks with one and with nine tables, linear and cubic, each table a term.
pub static LINEAR: [&Aligned<[u8]>; 2] = [blob!("linear1.trax"), blob!("linear9.trax")];
pub static CUBIC: [&Aligned<[u8]>; 2] = [blob!("cubic1.trax"), blob!("cubic9.trax")];
/// One set of tables: over positions alone, over two temperatures too, and over two temperatures with a lag each.
pub static THERMAL: [&Aligned<[u8]>; 3] = [
    blob!("thermal0.trax"),
    blob!("thermal2.trax"),
    blob!("thermal2-lag.trax"),
];
