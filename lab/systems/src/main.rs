//! Proves that the command writes the same bytes on Windows and on Linux on ARM, and compiles for macOS.

use lab_systems::TestedSystem;
use std::process::ExitCode;

fn main() -> ExitCode {
    programs::main(|words| {
        programs::known(words, &TestedSystem::ALL.map(TestedSystem::name))?;
        let is_chosen = |system: &TestedSystem| words.is_empty() || words.contains(&system.name());
        for system in TestedSystem::ALL.into_iter().filter(is_chosen) {
            system.test()?;
        }
        Ok(())
    })
}
