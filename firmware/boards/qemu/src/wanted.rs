//! Failures requested by a test.

use semihosting::experimental::env::args;

/// Maximum length of the command line in bytes: the name of the program is a path.
const COMMAND: usize = 1024;

/// A failure to cause, once.
pub enum Wanted {
    /// An error detected by the program.
    Panic,
    /// An error detected by the processor.
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
