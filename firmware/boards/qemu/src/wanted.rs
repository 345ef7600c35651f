//! What a test wants to go wrong.

use semihosting::experimental::env::args;

/// Most bytes of the command line: the name of the program is a path.
const COMMAND: usize = 1024;

/// What is to go wrong, once.
pub enum Wanted {
    /// A mistake that the program notices.
    Panic,
    /// One that the processor notices.
    Exception,
}

/// The first argument after the name of the program.
pub fn wanted() -> Option<Wanted> {
    let arguments = args::<COMMAND>().ok()?;
    match (&arguments).nth(1)?.ok()? {
        "panic" => Some(Wanted::Panic),
        "exception" => Some(Wanted::Exception),
        _ => None,
    }
}
