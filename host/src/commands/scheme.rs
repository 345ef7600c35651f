//! `--scheme`, and the options that only one scheme has.

use super::bad_input::BadInput;
use clap::{Args, ValueEnum};
use std::str::FromStr;
use trueaxis_host::errors::Parameter;
use trueaxis_host::schemes::{Scheme, exact};

/// How tables are found.
#[derive(Args)]
pub struct SchemeArguments {
    /// How tables are found: exact (finds the factors itself, for any machine and any errors),
    /// fik (a chain of tables for each closed-form term of each error) or subset:N (the N tables that remove most)
    #[arg(long, value_name = "NAME", default_value = "exact", value_parser = Scheme::from_str)]
    scheme: Scheme,
    #[command(flatten)]
    own: OwnArguments,
}

/// What only one scheme is asked.
#[derive(Args)]
pub struct OwnArguments {
    /// exact: what is to be least: instructions per evaluation (cost, the default), or the number of
    /// tables
    #[arg(long, value_enum, value_name = "WHAT")]
    minimize: Option<Minimize>,
    /// fik: errors whose weights can be set on the controller, EZ0S,EXX1 for example; those that have tables of
    /// their own, if not given
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parameter)]
    adjust: Option<Vec<Parameter>>,
}

fn parameter(name: &str) -> Result<Parameter, String> {
    Parameter::parse(name).ok_or_else(|| format!("`{name}` is no error parameter: write EB0A or EXX1"))
}

#[derive(Clone, Copy, ValueEnum)]
enum Minimize {
    /// Instructions per evaluation
    Cost,
    /// The number of tables
    Tables,
}

impl SchemeArguments {
    /// The scheme with its options.
    pub fn scheme(&self) -> Result<Scheme, BadInput> {
        let scheme = self.own.with(&self.scheme);
        let name = scheme.name();
        let chosen = name.split(':').next().unwrap_or_default();
        let given = self.own.given();
        match given.into_iter().find(|(_, owner)| *owner != chosen) {
            None => Ok(scheme),
            Some((option, owner)) => Err(BadInput::new(
                format!("{option} is given, but --scheme {name} knows nothing of it"),
                format!("leave out {option}, or use --scheme {owner}"),
            )),
        }
    }
}

impl OwnArguments {
    /// The options that are given, each with the scheme that has it.
    fn given(&self) -> Vec<(&'static str, &'static str)> {
        let all = [
            ("--minimize", "exact", self.minimize.is_some()),
            ("--adjust", "fik", self.adjust.is_some()),
        ];
        let given = all.into_iter().filter(|(_, _, is_given)| *is_given);
        given.map(|(option, owner, _)| (option, owner)).collect()
    }

    /// A scheme with what is given of its own options.
    pub fn with(&self, scheme: &Scheme) -> Scheme {
        let mut scheme = scheme.clone();
        match &mut scheme {
            Scheme::Exact { minimize } => {
                if let Some(given) = self.minimize {
                    *minimize = match given {
                        Minimize::Cost => exact::Minimize::Cost,
                        Minimize::Tables => exact::Minimize::Tables,
                    };
                }
            }
            Scheme::Fik { adjustable } => {
                if let Some(given) = &self.adjust {
                    adjustable.clone_from(given);
                }
            }
            Scheme::Subset { .. } => {}
        }
        scheme
    }
}
