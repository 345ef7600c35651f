//! Values that a shell offers although others are accepted, too.

use clap::builder::{PossibleValue, TypedValueParser};
use clap::{Arg, Command, Error};
use std::ffi::OsStr;
use std::str::FromStr;
use std::sync::LazyLock;
use trueaxis_tables::schemes::{Scheme, UnknownScheme};
use trueaxis_tables::target::Target;

/// The schemes.
pub fn schemes() -> impl TypedValueParser<Value = Scheme> {
    static NAMES: LazyLock<Vec<String>> =
        LazyLock::new(|| Scheme::every().iter().map(Scheme::name).collect());
    Offered {
        names: || NAMES.iter().map(String::as_str).collect(),
        parse: |text: &str| -> Result<Scheme, UnknownScheme> { Scheme::from_str(text) },
    }
}

/// The targets that have names.
pub fn targets() -> impl TypedValueParser<Value = String> {
    Offered {
        names: || Target::NAMES.to_vec(),
        parse: |text: &str| -> Result<String, std::convert::Infallible> { Ok(text.to_owned()) },
    }
}

#[derive(Clone)]
struct Offered<P> {
    names: fn() -> Vec<&'static str>,
    parse: P,
}

impl<P: TypedValueParser> TypedValueParser for Offered<P> {
    type Value = P::Value;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &OsStr,
    ) -> Result<P::Value, Error> {
        self.parse.parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = (self.names)().into_iter();
        Some(Box::new(names.map(PossibleValue::new)))
    }
}

#[cfg(all(test, not(target_family = "wasm")))]
mod tests {
    use crate::commands::Cli;
    use clap::CommandFactory;
    use clap_complete::Shell;

    #[test]
    fn a_shell_offers_schemes_and_targets_and_not_files() {
        let mut script = Vec::new();
        clap_complete::generate(Shell::Bash, &mut Cli::command(), "trueaxis", &mut script);
        let script = String::from_utf8(script).unwrap();
        let after = |option: &str| {
            let mut lines = script.lines().skip_while(|line| line.trim() != option);
            lines.nth(1).unwrap_or_default().to_owned()
        };
        assert!(
            after("--scheme)").contains("exact grid3d poly25"),
            "{}",
            after("--scheme)")
        );
        assert!(
            after("--target)").contains("stm32f405 desktop"),
            "{}",
            after("--target)")
        );
    }
}
