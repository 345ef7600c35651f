//! Makes a release, and proves that each part of it does its job where there is nothing else; and that the crates can
//! be published.

mod alone;
mod contents;
mod debian;
mod publish;

use programs::process::target;
use programs::{Failure, VERSION};
use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|words| {
        let folder = target(&format!("release-{VERSION}"));
        match words {
            ["dist"] => contents::make(folder)?,
            ["dist", "--check"] => alone::check(&folder)?,
            ["publish"] => publish::check()?,
            _ => {
                return Err(Failure::arguments(
                    "dist takes --check or nothing; publish takes nothing",
                ));
            }
        }
        Ok(())
    })
}
