//! The command `trueaxis`, a thin layer over the libraries.
#![forbid(unsafe_code)]
// The page for browsers calls a part of the commands.
#![cfg_attr(target_family = "wasm", allow(dead_code))]

/// Like that of the standard library, which panics once nobody reads the pipe any more.
macro_rules! eprint {
    ($($part:tt)*) => {{
        use std::io::Write;
        let _ = write!(std::io::stderr(), $($part)*);
    }};
}

/// Likewise.
macro_rules! eprintln {
    ($($part:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stderr(), $($part)*);
    }};
}

mod commands;

use std::process::ExitCode;

#[cfg(not(windows))]
fn main() -> ExitCode {
    commands::run()
}

/// On Windows the main thread has a stack of 1 MB, an eighth of other systems', which an identification exceeds.
#[cfg(windows)]
fn main() -> ExitCode {
    const STACK: usize = 8 << 20;
    let thread = std::thread::Builder::new().stack_size(STACK);
    match thread.spawn(commands::run).map(|running| running.join()) {
        Ok(Ok(code)) => code,
        // The panic has said why.
        Ok(Err(_)) => ExitCode::from(101),
        Err(error) => {
            eprintln!("error: no thread: {error}");
            ExitCode::from(101)
        }
    }
}
