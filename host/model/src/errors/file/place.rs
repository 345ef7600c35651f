//! Finds the place of something in an error file.

use super::ErrorsFile;
use crate::errors::{ErrorModel, Parameter};
use std::ops::Range;
use toml::Spanned;

impl ErrorModel {
    /// The place of a parameter (or of its thermal change, if that is its only entry), or of the table of this
    /// motion. `None` if it is not in this text.
    #[must_use]
    pub fn place(text: &str, parameter: Parameter, tabulated: bool) -> Option<Range<usize>> {
        let file: ErrorsFile = toml::from_str(text).ok()?;
        let is = |name: &&Spanned<String>| Parameter::parse(name.get_ref()) == Some(parameter);
        let motion = (parameter.component, parameter.axis);
        let table =
            |name: &&Spanned<String>| Parameter::parse_motion(name.get_ref()) == Some(motion);
        let found = match tabulated {
            true => file.tabulated.keys().find(table),
            false => {
                let cold = file.parameters.keys().find(is);
                cold.or_else(|| file.thermal.keys().find(is))
            }
        };
        found.map(Spanned::span)
    }
}
