//! `cargo xtask report`: makes the report of every example and opens it in a real browser, which rotates, moves, prints
//! and reads it (`tests/browser`). Pages and pictures stay under `target/report`.

use crate::packages::install;
use crate::process::{output, root, run, said, target, trueaxis, works};
use crate::{blob, files};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// Inputs of a report: name, machine, errors, and the options for tables, if any.
pub struct Case {
    pub name: &'static str,
    pub machine: &'static str,
    pub errors: &'static str,
    pub tables: Option<&'static str>,
    /// Options of the report.
    options: &'static str,
}

const fn case(
    name: &'static str,
    machine: &'static str,
    errors: &'static str,
    tables: &'static str,
    options: &'static str,
) -> Case {
    Case {
        name,
        machine,
        errors,
        tables: Some(tables),
        options,
    }
}

/// Every example with every error file. Where tables to 0.05 µm take long to find, coarser ones are enough: the page is
/// what is tested.
const CASES: [Case; 19] = [
    case(
        "five-axis-30",
        "examples/five-axis-30/machine.toml",
        "examples/five-axis-30/errors-30.toml",
        COARSE,
        COARSE,
    ),
    case(
        "fork-head-13",
        "examples/fork-head/machine.toml",
        "examples/fork-head/errors-13.toml",
        "",
        "",
    ),
    case(
        "hu40-13",
        "examples/hu40/machine.toml",
        "examples/hu40/errors-13.toml",
        "",
        "",
    ),
    case(
        "hu40-84",
        "examples/hu40/machine.toml",
        "examples/hu40/errors-84.toml",
        // All tables that fit the target: the largest page.
        "--policy orientation --best-effort --allow-large",
        "",
    ),
    case(
        "huron-13",
        "examples/huron-k2x8/machine.toml",
        "examples/huron-k2x8/errors-13.toml",
        "",
        "",
    ),
    case(
        "huron-length-13",
        "examples/huron-k2x8/machine-tool-length.toml",
        "examples/huron-k2x8/errors-13.toml",
        "",
        "",
    ),
    case(
        "kolibri-10",
        "examples/kolibri/machine.toml",
        "examples/kolibri/errors-10.toml",
        "",
        "",
    ),
    case(
        "kolibri-12",
        "examples/kolibri/machine.toml",
        "examples/kolibri/errors-12.toml",
        "",
        "",
    ),
    case(
        "kolibri-81",
        "examples/kolibri/machine.toml",
        "examples/kolibri/errors-81.toml",
        "--scheme poly25 --best-effort --allow-large",
        "",
    ),
    case(
        "xyzac-11",
        "examples/linuxcnc-xyzac-trt/machine.toml",
        "examples/linuxcnc-xyzac-trt/errors-11.toml",
        "",
        "",
    ),
    case(
        "xyzac-endless-11",
        "examples/linuxcnc-xyzac-trt/machine-endless.toml",
        "examples/linuxcnc-xyzac-trt/errors-11.toml",
        "",
        "",
    ),
    case(
        "mill-21",
        "examples/mill-21/machine.toml",
        "examples/mill-21/errors-21.toml",
        "",
        "",
    ),
    case(
        "router-10",
        "examples/router/machine.toml",
        "examples/router/errors-10.toml",
        "",
        "",
    ),
    case(
        "table-head-13",
        "examples/table-head/machine.toml",
        "examples/table-head/errors-13.toml",
        "",
        "",
    ),
    case(
        "mill-21-grid",
        "examples/mill-21/machine.toml",
        "examples/mill-21/errors-21.toml",
        "--scheme grid3d",
        "",
    ),
    case(
        "six-axes",
        "tests/browser/machines/six-axes.toml",
        "tests/browser/machines/six-axes-errors.toml",
        "--scheme subset:12 --best-effort",
        "",
    ),
    case(
        "four-axes",
        "tests/browser/machines/four-axes.toml",
        "tests/browser/machines/four-axes-errors.toml",
        "",
        "",
    ),
    Case {
        name: "no-tables",
        machine: "examples/huron-k2x8/machine.toml",
        errors: "examples/huron-k2x8/errors-13.toml",
        tables: None,
        options: "",
    },
    Case {
        name: "no-errors",
        machine: "examples/mill-21/machine.toml",
        errors: "tests/browser/machines/no-errors.toml",
        tables: None,
        options: "",
    },
];
const COARSE: &str = "--tolerance 5";

/// The cases of machines that users find in `examples`.
pub fn examples() -> impl Iterator<Item = &'static Case> {
    CASES
        .iter()
        .filter(|case| case.tables.is_some() && case.machine.starts_with("examples/"))
}

/// Limits of a report's size, and of the time to make it.
const MOST_BYTES: usize = 3_000_000;
const MOST_TIME: Duration = Duration::from_secs(5);
/// How often it is made until it takes less: other steps that run beside this one slow it.
const TRIALS: usize = 3;

/// # Errors
/// If something cannot be installed, built or made, or fails.
pub fn execute() -> Result<(), String> {
    let folder = target("report");
    let browser = provide_browser(&folder)?;
    let trueaxis = trueaxis()?;
    let mut made = Vec::new();
    println!("reports, made by the debug build of trueaxis:");
    for case in &CASES {
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
pub fn provide_browser(folder: &Path) -> Result<PathBuf, String> {
    let missing: Vec<&str> = [
        ("chromium", "chromium"),
        ("pdftotext", "poppler-utils"),
        ("node", "nodejs"),
        ("npm", "npm"),
    ]
    .into_iter()
    .filter(|(program, _)| {
        !works(Command::new("sh").args(["-c", &format!("command -v {program}")]))
    })
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

/// Makes calibration reports: of a usual calibration, of one with as much as there is room for, and without any statement.
/// Returns the data for the browser's test, as JSON.
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
        let of = |file: &str| root().join("examples").join(example).join(file);
        let [machine, artefact] = ["machine.toml", "artefact.toml"].map(of);
        let own = |end: &str| folder.join(format!("{name}{end}"));
        let [probings, errors, found] = [".csv", ".toml", ".json"].map(own);
        let mut simulate = Command::new(trueaxis);
        simulate.args(["simulate", "probings"]);
        simulate.args([&machine, &of(&format!("errors-{model}.toml"))]);
        simulate.args([Path::new("--artefact"), &artefact]);
        simulate.args([Path::new("--plan"), &of("plan.csv")]);
        simulate.args(["--noise", "1", "--outliers", "6", "-o"]);
        output(simulate.arg(&probings))?;
        let mut identify = Command::new(trueaxis);
        identify.arg("identify").args([&machine, &probings]);
        identify.args(["--model", model, "--json", "--artefact"]);
        identify.arg(&artefact).arg("-o").arg(&errors);
        files::write(&found, output(&mut identify)?)?;
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
    /// Makes the tables and the page; returns the data for the browser's test, as JSON.
    fn make(&self, trueaxis: &Path, folder: &Path) -> Result<String, String> {
        let Self {
            name,
            machine,
            errors,
            tables,
            options,
        } = self;
        let (blob, page) = (
            folder.join(format!("{name}.trax")),
            folder.join(format!("{name}.html")),
        );
        let files = [machine, errors].map(|file| root().join(file));
        let start = Instant::now();
        if let Some(tables) = tables {
            let options = format!("--random 500 {tables}");
            blob::compile(trueaxis, &files, &options, &blob)?;
        }
        let compiled = start.elapsed();
        let mut took = Duration::MAX;
        for _ in 0..TRIALS {
            let start = Instant::now();
            let mut report = Command::new(trueaxis);
            report
                .arg("report")
                .args(&files)
                .args(tables.map(|_| &blob))
                .arg("-o")
                .arg(&page)
                .args(options.split_whitespace());
            output(&mut report)?;
            took = start.elapsed();
            if took < MOST_TIME {
                break;
            }
        }
        let bytes = files::read(&page)?.len();
        println!(
            "  {name:<22} {:>5} kB  {:>5.2} s  (tables {:.1} s)",
            bytes / 1000,
            took.as_secs_f64(),
            compiled.as_secs_f64()
        );
        if bytes >= MOST_BYTES || took >= MOST_TIME {
            return Err(format!(
                "{name}: {bytes} bytes in {took:?}, more than {MOST_BYTES} or {MOST_TIME:?}"
            ));
        }
        let mut json = format!("  {{\"name\": {name:?}, \"page\": {page:?}");
        let _ = write!(
            json,
            ", \"machine\": {:?}, \"errors\": {:?}",
            files[0], files[1]
        );
        if tables.is_some() {
            let _ = write!(json, ", \"blob\": {blob:?}");
        }
        Ok(json + "}")
    }
}
