//! Finds and reads the files of a LinuxCNC configuration.

use crate::commands::bad_input::BadInput;
use crate::commands::files::{self, Text};
use std::path::{Path, PathBuf};
use trueaxis_linuxcnc::{Configuration, Import};
use trueaxis_model::source::{FileError, Named};

/// Folder of LinuxCNC's own HAL files in the Debian package.
const LIBRARY: &str = "/usr/share/linuxcnc/hallib";

/// Reads the INI file and all files that it names.
pub fn read(ini: &Path) -> Result<Configuration, BadInput> {
    read_as(Text::read(ini)?, ini, None)
}

/// Reads the INI file and all files that it names, or what HAL has now that LinuxCNC runs with this INI file.
pub fn read_running(ini: &Path, is_running: bool) -> Result<Configuration, BadInput> {
    let hal = match is_running {
        true => Some(running()?),
        false => None,
    };
    read_as(Text::read(ini)?, ini, hal)
}

/// What LinuxCNC would read if `text` were the INI file. With `is_running`, the HAL that runs and then `trueaxis.hal`
/// beside it, which is what the text adds.
pub fn read_future(text: Text, ini: &Path, is_running: bool) -> Result<Configuration, BadInput> {
    let hal = match is_running {
        true => {
            let mut running = running()?;
            let added = ini.with_file_name("trueaxis.hal");
            running.text += "\n";
            running.text += &Text::read(&added)?.text;
            Some(running)
        }
        false => None,
    };
    read_as(text, ini, hal)
}

fn read_as(text: Text, ini: &Path, hal: Option<Named>) -> Result<Configuration, BadInput> {
    let folder = folder(ini);
    let open = |name: &str| open(&folder, name);
    let source = Named {
        name: text.name.clone(),
        text: text.text.clone(),
    };
    Configuration::read(source, &open, hal).map_err(|error| bad(&text, error))
}

/// The commands that make the HAL that runs.
fn running() -> Result<Named, BadInput> {
    let bad = |what: String| {
        BadInput::new(
            format!("--running: `halcmd save all` {what}"),
            "start LinuxCNC with this INI file on this computer, and try again while it runs",
        )
    };
    let done = std::process::Command::new("halcmd")
        .args(["save", "all"])
        .output();
    let done = done.map_err(|error| bad(format!("does not start: {error}")))?;
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    if !done.status.success() || !text.contains("motion-controller") {
        return Err(bad("shows no motion controller".to_owned()));
    }
    Ok(Named {
        name: "HAL as it runs".to_owned(),
        text,
    })
}

/// The version of LinuxCNC as which an INI file was read, for the output.
pub fn version() -> String {
    let found = std::process::Command::new("linuxcnc_var")
        .arg("LINUXCNCVERSION")
        .output();
    let found = found.ok().filter(|done| done.status.success());
    let found = found.map(|done| String::from_utf8_lossy(&done.stdout).trim().to_owned());
    match found.filter(|version| !version.is_empty()) {
        Some(version) => format!("LinuxCNC {version} is installed"),
        None => "LinuxCNC is not installed here: read as 2.10 does".to_owned(),
    }
}

/// Reads what the INI file compensates.
pub fn imported(ini: &Path, configuration: &Configuration) -> Result<Vec<Import>, BadInput> {
    let folder = folder(ini);
    let open = |name: &str| open(&folder, name);
    let found = trueaxis_linuxcnc::imported(configuration, &open);
    found.map_err(|error| match Text::read(ini) {
        Ok(text) => bad(&text, error),
        Err(bad) => bad,
    })
}

/// An error in the INI file, or in another one that is already relative to the current folder.
fn bad(ini: &Text, error: FileError) -> BadInput {
    match &error.within {
        Some(within) => {
            let text = Text {
                name: within.name.clone(),
                text: within.text.clone(),
            };
            let error = FileError {
                within: None,
                ..error
            };
            text.bad(error)
        }
        None => ini.bad(error),
    }
}

/// The folder of a file; LinuxCNC resolves other names from there.
pub fn folder(file: &Path) -> PathBuf {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Opens a file as LinuxCNC does: beside the INI file, else in its library.
fn open(folder: &Path, name: &str) -> Result<Named, String> {
    let paths = match (name.strip_prefix("LIB:"), name.strip_prefix("~/")) {
        (Some(of_library), _) => vec![Path::new(LIBRARY).join(of_library)],
        (_, Some(of_home)) => std::env::home_dir()
            .into_iter()
            .map(|h| h.join(of_home))
            .collect(),
        _ => vec![folder.join(name), Path::new(LIBRARY).join(name)],
    };
    let found = paths.iter().find(|p| p.is_file()).or(paths.first());
    let path = found.ok_or("there is no home folder")?;
    let bytes = files::read_bytes(path).map_err(|bad| bad.to_string())?;
    let text = String::from_utf8(bytes).map_err(|_| "it is not UTF-8 text".to_owned())?;
    Ok(Named {
        name: path.display().to_string(),
        text,
    })
}
