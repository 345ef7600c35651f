//! What the readme and the manual show is what the command says today.

use trueaxis_host::compile::{self, Options};
use trueaxis_host::schemes::exact::Minimize;
use trueaxis_tests::{errors, machine, read};

/// The line of the command that counts tables, terms and bytes.
fn counts(machine_file: &str, minimize: Minimize) -> String {
    let machine = machine(&format!("examples/huron-k2x8/{machine_file}"));
    let errors = errors("examples/huron-k2x8/errors-13.toml", &machine);
    let mut options = Options::default();
    options.scheme.minimize = minimize;
    let size = compile::build(&machine, &errors, &options, &())
        .unwrap()
        .size;
    format!(
        "{} tables in {} banks, {} terms, {} samples, {} bytes",
        size.tables, size.banks, size.terms, size.samples, size.bytes
    )
}

#[track_caller]
fn shows(file: &str, line: &str) {
    let text = read(file);
    assert!(
        text.lines().any(|l| l == line),
        "{file} does not show `{line}`: run the commands it shows again"
    );
}

#[test]
fn the_readme_and_the_tutorial_show_what_compile_prints() {
    let line = counts("machine.toml", Minimize::Cost);
    shows("README.md", &line);
    shows("docs/src/first-compensation.md", &line);
    shows(
        "docs/src/first-compensation.md",
        &counts("machine.toml", Minimize::Tables),
    );
    shows(
        "docs/src/first-compensation.md",
        &counts("machine-tool-length.toml", Minimize::Cost),
    );
}
