//! `--target`

use super::bad_input::BadInput;
use super::files::Text;
use std::path::Path;
use trueaxis_tables::target::Target;

/// Finds a target by its name, or reads it from a file.
pub fn read(name_or_file: &str) -> Result<Target, BadInput> {
    if let Some(target) = Target::named(name_or_file) {
        return Ok(target);
    }
    let path = Path::new(name_or_file);
    if !path.exists() {
        let names = Target::NAMES.join(", ");
        return Err(BadInput::new(
            format!("--target: `{name_or_file}` is neither a target nor a file"),
            format!(
                "write one of {names}, or a file as `trueaxis flash --dry-run --port PORT` prints it"
            ),
        ));
    }
    let text = Text::read(path)?;
    Target::from_toml(&text.text).map_err(|error| text.bad(error))
}
