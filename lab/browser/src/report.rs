//! Makes the report of every example and opens it in a real browser, which rotates, moves, prints
//! and reads it (`tests/browser`). Pages and pictures stay under `target/report`.

use programs::packages::install;
use programs::process::{is_there, output, root, run, said, target};
use programs::{files, trueaxis};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// Inputs of a report.
pub struct Case {
    /// Name of its files.
    pub name: &'static str,
    /// Machine and errors: paths without their ending.
    files: [&'static str; 2],
    /// Options for tables, if any.
    pub tables: Option<&'static str>,
}

/// Name, machine, errors, and options for tables or `none`: every example with every error file. Where tables to 0.05 µm take
/// long to find, coarser ones are enough: the page is what is tested. Of the HU40 with 84 all tables that fit the target:
/// the largest page.
const CASES: &str = "\
five-axis-30     | examples/five-axis-30/machine          | examples/five-axis-30/errors-30       | --tolerance 5
fork-head-13     | examples/fork-head/machine             | examples/fork-head/errors-13          |
hu40-13          | examples/hu40/machine                  | examples/hu40/errors-13               |
hu40-84          | examples/hu40/machine                  | examples/hu40/errors-84               | --policy orientation --best-effort --allow-large
huron-13         | examples/huron-k2x8/machine            | examples/huron-k2x8/errors-13         |
huron-length-13  | examples/huron-k2x8/machine-tool-length | examples/huron-k2x8/errors-13        |
kolibri-10       | examples/kolibri/machine               | examples/kolibri/errors-10            |
kolibri-12       | examples/kolibri/machine               | examples/kolibri/errors-12            |
kolibri-81       | examples/kolibri/machine               | examples/kolibri/errors-81            | --scheme poly25 --best-effort --allow-large
xyzac-11         | examples/linuxcnc-xyzac-trt/machine    | examples/linuxcnc-xyzac-trt/errors-11 |
xyzac-endless-11 | examples/linuxcnc-xyzac-trt/machine-endless | examples/linuxcnc-xyzac-trt/errors-11 |
mill-21          | examples/mill-21/machine               | examples/mill-21/errors-21            |
router-10        | examples/router/machine                | examples/router/errors-10             |
table-head-13    | examples/table-head/machine            | examples/table-head/errors-13         |
mill-21-grid     | examples/mill-21/machine               | examples/mill-21/errors-21            | --scheme grid3d
six-axes         | tests/browser/machines/six-axes        | tests/browser/machines/six-axes-errors | --scheme subset:12 --best-effort
four-axes        | tests/browser/machines/four-axes       | tests/browser/machines/four-axes-errors |
no-tables        | examples/huron-k2x8/machine            | examples/huron-k2x8/errors-13         | none
no-errors        | examples/mill-21/machine               | tests/browser/machines/no-errors      | none";

fn cases() -> impl Iterator<Item = Case> {
    CASES.lines().map(|line| {
        let mut cells = line.split('|').map(str::trim);
        let [name, machine, errors, tables] = [(); 4].map(|()| cells.next().unwrap_or_default());
        Case {
            name,
            files: [machine, errors],
            tables: Some(tables).filter(|tables| *tables != "none"),
        }
    })
}

/// Options of tables and of the report.
const COARSE: &str = "--tolerance 5";

/// The cases of machines that users find in `examples`.
pub fn examples() -> impl Iterator<Item = Case> {
    cases().filter(|case| case.tables.is_some() && case.files[0].starts_with("examples/"))
}

/// Limit of a report's size.
const MOST_BYTES: usize = 3_000_000;
/// Limit of the time to make it. The dearest takes 3 s on an idle computer, and 6 s beside other steps on a slow one:
/// only work that has multiplied exceeds this.
const MOST_TIME: Duration = Duration::from_secs(15);

/// Makes reports and calibration reports, and reads them in a browser.
///
/// # Errors
/// If something cannot be installed, built or made, or fails.
pub fn check() -> Result<(), String> {
    let folder = target("report");
    let browser = provide_browser(&folder)?;
    let trueaxis = trueaxis::build()?;
    let mut made = Vec::new();
    println!("reports, made by the debug build of trueaxis:");
    for case in cases() {
        made.push(case.make(&trueaxis, &folder)?);
    }
    let list = folder.join("reports.json");
    let text = format!("[\n{}\n]\n", made.join(",\n"));
    files::write(&list, text)?;
    let made = certificates(&trueaxis, &folder)?;
    let text = format!("[\n{}\n]\n", made.join(",\n"));
    files::write(&folder.join("certificates.json"), text)?;
    run(Command::new("node")
        .arg(root().join("tests/browser/report.mjs"))
        .args([&folder, &browser, &trueaxis]))
}

/// Installs the browser, the reader for printed pages, and the browser driver; returns the driver's path.
///
/// # Errors
/// If something cannot be installed.
pub fn provide_browser(folder: &Path) -> Result<PathBuf, String> {
    let missing: Vec<&str> = [
        ("chromium", "chromium"),
        ("pdftotext", "poppler-utils"),
        ("node", "nodejs"),
        ("npm", "npm"),
    ]
    .into_iter()
    .filter(|(program, _)| !is_there(program))
    .map(|(_, package)| package)
    .collect();
    if !missing.is_empty() {
        // Without an installed font a browser draws no letters.
        install(&[&missing[..], &["fonts-dejavu-core"]].concat(), "`report`")?;
    }
    let place = files::folder(folder.join("browser"))?;
    let mut current = place.join("node_modules").is_dir();
    for name in ["package.json", "package-lock.json"] {
        let (from, to) = (root().join("tests/browser").join(name), place.join(name));
        let wanted = files::read(&from)?;
        if std::fs::read(&to).ok().as_ref() != Some(&wanted) {
            current = false;
            files::write(&to, wanted)?;
        }
    }
    if !current {
        run(Command::new("npm")
            .args(["ci", "--no-audit", "--no-fund"])
            .current_dir(&place))?;
    }
    Ok(place)
}

/// Makes calibration reports: of a usual calibration, of one with as much as there is room for, and without any
/// statement. Returns the data for the browser's test, as JSON.
fn certificates(trueaxis: &Path, folder: &Path) -> Result<Vec<String>, String> {
    let machines = root().join("tests/browser/machines");
    let mut made = Vec::new();
    for (name, example, model, calibration) in [
        (
            "certificate",
            "kolibri",
            "10",
            root().join("examples/kolibri/calibration.toml"),
        ),
        (
            "certificate-full",
            "hu40",
            "84",
            machines.join("full-calibration.toml"),
        ),
    ] {
        let own = |end: &str| folder.join(format!("{name}{end}"));
        let example = root().join("examples").join(example);
        let (errors, found) = (own(".toml"), own(".json"));
        identified(trueaxis, &example, model, &own(".csv"), [&errors, &found])?;
        let machine = example.join("machine.toml");
        let mut report = certificate(trueaxis, &[&machine, &errors], &own(".html"));
        report.arg("--calibration").arg(calibration);
        report.arg("--identification").arg(&found);
        report
            .arg("--validation")
            .arg(machines.join("validation.json"));
        made.push(certified(&mut report, name, &own(".html"))?);
    }
    let files = ["machine.toml", "errors-13.toml"];
    let [machine, errors] = files.map(|file| root().join("examples/huron-k2x8").join(file));
    let page = folder.join("certificate-bare.html");
    let mut report = certificate(trueaxis, &[&machine, &errors], &page);
    made.push(certified(&mut report, "certificate-bare", &page)?);
    Ok(made)
}

/// Identifies errors from simulated probings of an example: the errors, and what the command says.
fn identified(
    trueaxis: &Path,
    example: &Path,
    model: &str,
    probings: &Path,
    [errors, said]: [&Path; 2],
) -> Result<(), String> {
    let [machine, artefact] = ["machine.toml", "artefact.toml"].map(|file| example.join(file));
    let mut simulate = Command::new(trueaxis);
    simulate.args(["simulate", "probings"]);
    simulate.args([&machine, &example.join(format!("errors-{model}.toml"))]);
    simulate.arg("--artefact").arg(&artefact);
    simulate.arg("--plan").arg(example.join("plan.csv"));
    simulate.args(["--noise", "1", "--outliers", "6", "-o"]);
    output(simulate.arg(probings))?;
    let mut identify = Command::new(trueaxis);
    identify.arg("identify").args([&*machine, probings]);
    identify.args(["--model", model, "--json", "--artefact"]);
    identify.arg(&artefact).arg("-o").arg(errors);
    files::write(said, output(&mut identify)?)
}

/// The command that writes a calibration report.
fn certificate(trueaxis: &Path, files: &[&Path; 2], page: &Path) -> Command {
    let mut report = Command::new(trueaxis);
    report.arg("report").args(files).arg("--calibration-report");
    report.arg("-o").arg(page);
    report
}

/// Writes it; a limit that is not proven to be kept is as good here.
fn certified(report: &mut Command, name: &str, page: &Path) -> Result<String, String> {
    let said = said(report)?;
    match said.status.code() {
        Some(0 | 1) => Ok(format!("  {{\"name\": {name:?}, \"page\": {page:?}}}")),
        _ => Err(format!("{name}: {}", said.errors)),
    }
}

impl Case {
    /// Paths of machine and errors, from the root of the workspace.
    pub fn files(&self) -> [String; 2] {
        self.files.map(|file| format!("{file}.toml"))
    }

    /// Makes the tables and the page; returns the data for the browser's test, as JSON.
    fn make(&self, trueaxis: &Path, folder: &Path) -> Result<String, String> {
        let name = self.name;
        let [blob, page] = ["trax", "html"].map(|kind| folder.join(format!("{name}.{kind}")));
        let files = self.files().map(|file| root().join(file));
        let start = Instant::now();
        if let Some(tables) = self.tables {
            let options = format!("--random 500 {tables}");
            trueaxis::compile(trueaxis, &files, &options, &blob)?;
        }
        let compiled = start.elapsed().as_secs_f64();
        let options = self.tables.filter(|tables| *tables == COARSE).unwrap_or("");
        let mut report = Command::new(trueaxis);
        report
            .arg("report")
            .args(&files)
            .args(self.tables.map(|_| &blob))
            .arg("-o")
            .arg(&page)
            .args(options.split_whitespace());
        let start = Instant::now();
        output(&mut report)?;
        let took = start.elapsed();
        let bytes = files::read(&page)?.len();
        println!(
            "  {name:<22} {:>5} kB  {:>5.2} s  (tables {compiled:.1} s)",
            bytes / 1000,
            took.as_secs_f64(),
        );
        if bytes >= MOST_BYTES || took >= MOST_TIME {
            return Err(format!(
                "{name}: {bytes} bytes in {took:?}, more than {MOST_BYTES} or {MOST_TIME:?}"
            ));
        }
        let [machine, errors] = files;
        let blob = match self.tables {
            Some(_) => format!(", \"blob\": {blob:?}"),
            None => String::new(),
        };
        Ok(format!(
            "  {{\"name\": {name:?}, \"page\": {page:?}, \"machine\": {machine:?}, \"errors\": {errors:?}{blob}}}"
        ))
    }
}
