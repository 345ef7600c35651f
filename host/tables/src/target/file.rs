//! Targets as text.
//!
//! ```toml
//! name = "my-board"
//! axes = 8
//! banks = 32
//! tables = 96
//! terms = 256
//! grids = 2
//! bytes = 261760        # of a blob in a table slot; without it there is no limit
//! samples = "i16"       # or "f32" (default): how samples are stored best
//! ```

use super::Target;
use serde::Deserialize;
use toml::Spanned;
use trueaxis::SampleFormat;
use trueaxis_model::source::FileError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetFile {
    name: String,
    axes: Spanned<usize>,
    banks: Spanned<usize>,
    tables: Spanned<usize>,
    terms: Spanned<usize>,
    grids: Spanned<usize>,
    bytes: Option<Spanned<usize>>,
    samples: Option<Spanned<String>>,
}

/// A count between its smallest and largest permitted value.
fn count(
    found: &Spanned<usize>,
    what: &str,
    least: usize,
    most: usize,
) -> Result<usize, FileError> {
    let value = *found.get_ref();
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(FileError::at(
        found.span(),
        format!("no controller has {value} {what}"),
        "this many",
        format!("write a number from {least} to {most}"),
    ))
}

impl Target {
    /// Parses a target.
    ///
    /// # Errors
    /// [`FileError`] with place, cause and remedy: syntax, unknown keys, capacities that the runtime cannot be built
    /// with.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let file: TargetFile = toml::from_str(text).map_err(|error| FileError {
            remedy: "write name, axes, banks, tables, terms, grids, and where they apply bytes and samples; `trueaxis flash --dry-run` prints those of a controller".to_owned(),
            ..FileError::syntax(&error, text)
        })?;
        let most = Self::desktop();
        let samples = match &file.samples {
            None => SampleFormat::F32,
            Some(name) => match name.get_ref().as_str() {
                "f32" => SampleFormat::F32,
                "i16" => SampleFormat::I16,
                other => {
                    return Err(FileError::at(
                        name.span(),
                        format!("`{other}` is not a format of samples"),
                        "the format",
                        "write f32 or i16",
                    ));
                }
            },
        };
        Ok(Self {
            name: file.name,
            axes: count(&file.axes, "axes", 1, most.axes)?,
            banks: count(&file.banks, "banks", 0, most.banks)?,
            tables: count(&file.tables, "tables", 0, most.tables)?,
            // The firmware may have larger capacities than this program uses.
            terms: count(&file.terms, "terms", 0, 65_535)?,
            grids: count(&file.grids, "grids", 0, 65_535)?,
            bytes: file
                .bytes
                .as_ref()
                .map(|bytes| count(bytes, "bytes", 0, u32::MAX as usize))
                .transpose()?,
            samples,
        })
    }

    /// Writes a target, to be read by [`Target::from_toml`].
    #[must_use]
    pub fn to_toml(&self) -> String {
        let Self {
            name,
            axes,
            banks,
            tables,
            terms,
            grids,
            bytes,
            samples,
        } = self;
        let name = toml::Value::from(name.as_str());
        let mut text = format!(
            "name = {name}\naxes = {axes}\nbanks = {banks}\ntables = {tables}\nterms = {terms}\ngrids = {grids}\n"
        );
        if let Some(bytes) = bytes {
            text += &format!("bytes = {bytes}\n");
        }
        if *samples == SampleFormat::I16 {
            text += "samples = \"i16\"\n";
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        for name in Target::NAMES {
            let mut target = Target::named(name).unwrap();
            target.name = "a \"board\" of µ".to_owned();
            assert_eq!(Target::from_toml(&target.to_toml()), Ok(target.clone()));
            target.samples = SampleFormat::I16;
            assert_eq!(Target::from_toml(&target.to_toml()), Ok(target));
        }
    }

    #[test]
    fn what_no_controller_can_be_built_with_is_refused_at_its_line() {
        let text = Target::stm32f405().to_toml();
        for (from, to, line, cause) in [
            (
                "tables = 96",
                "tables = 256",
                4,
                "no controller has 256 tables",
            ),
            ("axes = 8", "axes = 0", 2, "no controller has 0 axes"),
            ("terms = 256", "terms = -1", 5, "invalid value"),
            ("grids = 2", "grid = 2", 6, "unknown field `grid`"),
            (
                "bytes = 261760",
                "samples = \"f64\"",
                7,
                "`f64` is not a format",
            ),
        ] {
            let text = text.replacen(from, to, 1);
            let error = Target::from_toml(&text).unwrap_err();
            assert!(error.message.contains(cause), "{error}");
            assert_eq!(error.line(&text), Some(line), "{error}");
        }
    }
}
