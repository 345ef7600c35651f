//! What `trueaxis generate` writes for some of the blobs.

macro_rules! generated {
    ($name:ident $file:literal) => {
        pub mod $name {
            include!(concat!(env!("TRUEAXIS_BENCH_BLOBS"), "/", $file));
        }
    };
}

generated!(huron13 "huron13.rs");
generated!(huron13_direction "huron13-direction.rs");
generated!(kolibri10_direction "kolibri10-direction.rs");
generated!(document40 "document40.rs");
