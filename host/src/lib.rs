//! Host library.
#![forbid(unsafe_code)]
