//! `trueaxis generate`

use super::bad_input::BadInput;
use super::{Outcome, files, output};
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis::Header;
use trueaxis_generate::{Language, Options, generate};
use trueaxis_model::validate::Runtime;

/// Write a compensation as straight-line code in Rust or C
///
/// The code has no dependencies, loops, heap or `unsafe`, and gives the same bits as the general evaluation: both are
/// compared at random inputs before the file is written. In C a header of the same name goes with it.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis generate machine.trax -o corrections.rs\n  \
trueaxis generate machine.trax --servo -o corrections.rs\n  \
trueaxis generate machine.trax --function mill_corrections -o corrections.c"
)]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// Language [default: by the name of the output, .rs or .c]
    #[arg(long, value_enum)]
    lang: Option<Language>,
    /// Where to write the code
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Name of the C function (default: trueaxis_evaluate)
    #[arg(long, value_name = "NAME", value_parser = identifier)]
    function: Option<String>,
    /// Add what a servo has to know: axes, bounds, weights; the code then uses the crate trueaxis, or trueaxis.h in C
    #[arg(long)]
    servo: bool,
    /// Compare at N random inputs
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..))]
    compared: u32,
}

/// Words that look like names, and that C keeps for itself.
const OF_C: [&str; 36] = [
    "auto", "bool", "break", "case", "char", "const", "continue", "default", "do", "double",
    "else", "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long", "main",
    "register", "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch",
    "typedef", "union", "unsigned", "void", "volatile", "while",
];

/// A name that C accepts.
fn identifier(text: &str) -> Result<String, String> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let begins = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    match begins && text.chars().all(is_word) && !OF_C.contains(&text) {
        true => Ok(text.to_owned()),
        false => Err(
            "write a C identifier: letters, digits and _, and no word of the language".to_owned(),
        ),
    }
}

const DEFECT: &str = "report it, with the file: it is a defect of this program";

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let (path, output) = (&arguments.blob, &arguments.output);
    output::prepare(output, &[path])?;
    let language = arguments.language()?;
    let blob = files::read_blob(path)?;
    let in_blob = |error| BadInput::in_blob(error, path);
    let runtime = Runtime::load(&blob).map_err(in_blob)?;
    let header = Header::read(&blob).map_err(in_blob)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let header_path = output.with_extension("h");
    let header_name = header_path.file_name().unwrap_or_default();
    let header_name = header_name.to_string_lossy();
    let function = match (&arguments.function, language) {
        (Some(name), Language::C) => name,
        (None, _) => "trueaxis_evaluate",
        (Some(_), Language::Rust) => {
            return Err(BadInput::new(
                "--function names a function in C, and the language is Rust",
                "leave --function out: the module of the file names what is in it",
            ));
        }
    };
    if language == Language::C {
        output::prepare(&header_path, &[path, output])?;
        includable(&header_name, output)?;
    }
    let options = Options {
        file: &file,
        function,
        header: &header_name,
        servo: arguments.servo,
        compared: arguments.compared as usize,
    };
    let code = generate(&runtime, header.crc, language, options);
    let code = code.map_err(|error| BadInput::new(error.to_string(), DEFECT))?;
    let header = code.header.map(|header| (header_path, header));
    let written: Vec<_> = std::iter::once((output.clone(), code.file))
        .chain(header)
        .collect();
    output::write_all(&written)?;
    let size = runtime.compensation().samples();
    let count = arguments.compared;
    output::print(&format!(
        "{}: {} tables, {size} samples; the same bits as {} at {count} random inputs\n",
        output.display(),
        runtime.compensation().tables(),
        path.display(),
    ))?;
    Ok(Outcome::Done)
}

impl Arguments {
    /// The language that was given, or that the name of the file says.
    fn language(&self) -> Result<Language, BadInput> {
        let extension = self.output.extension().and_then(|e| e.to_str());
        match (self.lang, extension) {
            (Some(language), _) => Ok(language),
            (None, Some("rs")) => Ok(Language::Rust),
            (None, Some("c")) => Ok(Language::C),
            (None, _) => Err(BadInput::new(
                format!(
                    "{}: the name does not say which language to write",
                    self.output.display()
                ),
                "end it with .rs or .c, or add --lang rust or --lang c",
            )),
        }
    }
}

/// Refuses a name that no `#include` can have.
fn includable(header: &str, output: &Path) -> Result<(), BadInput> {
    if output.with_extension("h") == output {
        return Err(BadInput::new(
            format!("{}: the header would have this name, too", output.display()),
            "end the name of the source with .c",
        ));
    }
    match header.contains(|c: char| c.is_control() || "\"\\<>".contains(c)) {
        false => Ok(()),
        true => Err(BadInput::new(
            format!("{}: no #include can name its header", output.display()),
            "choose a name without quotation marks, backslashes and control characters",
        )),
    }
}
