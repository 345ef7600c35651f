//! Proves that reports, and the page with the command in it, compute, show and print in real browsers what the command
//! says.

use lab_browser::{report, web};
use programs::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|words| {
        match words {
            ["report"] => report::check()?,
            ["web"] => drop(web::build()?),
            ["web", "--serve"] => web::serve(&web::build()?)?,
            ["web", "--check"] => web::check(&web::build()?)?,
            _ => {
                return Err(Failure::arguments(
                    "web takes --serve, --check or nothing; report takes nothing",
                ));
            }
        }
        Ok(())
    })
}
