//! How many cases a test tries that would otherwise take long.

/// `usual` cases, or `all` of them if the environment variable `TRUEAXIS_CASES` is `all`, as in
/// `cargo xtask prove`. The usual ones are among all of them.
///
/// # Panics
/// If the variable has another value.
#[must_use]
pub fn usual_or_all<T>(usual: T, all: T) -> T {
    match std::env::var("TRUEAXIS_CASES").as_deref() {
        Err(std::env::VarError::NotPresent) => usual,
        Ok("all") => all,
        other => panic!("TRUEAXIS_CASES is {other:?}: write `all`, or leave it out"),
    }
}
