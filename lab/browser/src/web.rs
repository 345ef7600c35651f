//! The command for browsers, and the page around it, in one file: `target/web/index.html`.

use crate::report;
use lab_processors::{hil, qemu};
use programs::packages::provide;
use programs::process::{cargo, root, run, target};
use programs::{files, trueaxis};
use std::fmt::Write;
use std::io::{Read, Write as _};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const TRIPLE: &str = "wasm32-wasip1";
/// Largest page, compressed.
const MOST_BYTES: usize = 2_000_000;
/// Scripts of the report that the page uses, in their order; the last one draws a report.
const REPORT: &str = "host/report/src/page";
const DRAWING: [&str; 6] = [
    "engine.js",
    "scene.js",
    "layout.js",
    "machine.js",
    "field.js",
    "sliders.js",
];
/// Scripts of the page, in their order.
const OWN: [&str; 6] = [
    "files.js",
    "runner.js",
    "errors.js",
    "builder.js",
    "stage.js",
    "page.js",
];

/// Builds the page; returns its path.
///
/// # Errors
/// If something cannot be installed or built, or the page is too large.
pub fn build() -> Result<PathBuf, String> {
    let folder = files::folder(target("web"))?;
    let page = folder.join("index.html");
    let text = page_text(&command(&folder)?)?;
    files::write(&page, &text)?;
    let compressed = piped(
        Command::new("gzip").args(["-9", "-n", "-c"]),
        text.as_bytes(),
    )?;
    println!(
        "{}: {} kB, {} kB compressed",
        page.display(),
        text.len() / 1000,
        compressed.len() / 1000
    );
    if compressed.len() > MOST_BYTES {
        return Err(format!("more than {MOST_BYTES} bytes compressed"));
    }
    Ok(page)
}

/// The command as WebAssembly, as small as it gets, compressed.
fn command(folder: &Path) -> Result<Vec<u8>, String> {
    if Command::new("rustup")
        .args(["target", "add", TRIPLE])
        .output()
        .is_err()
    {
        eprintln!("there is no rustup: the target {TRIPLE} must be installed");
    }
    provide("wasm-opt", &["binaryen"], "`web`")?;
    let words = "rustc -q --profile web -p trueaxis-cli --bin trueaxis --target";
    // Identification needs more stack than the usual 1 MB.
    let stack = "-Clink-arg=-zstack-size=8388608";
    // Panics say their lines in builds that are debugged.
    let mut build = cargo();
    build.env("RUSTC_BOOTSTRAP", "1");
    build.env("RUSTFLAGS", "-Zlocation-detail=none");
    run(build.args(words.split(' ')).args([TRIPLE, "--", stack]))?;
    let built = target(TRIPLE).join("web/trueaxis.wasm");
    let small = folder.join("trueaxis.wasm");
    if !is_newer(&small, &built) {
        run(Command::new("wasm-opt")
            .args(OPTIMISED.split(' '))
            .arg("-o")
            .args([&small, &built]))?;
    }
    // What every browser unpacks, 4 % smaller than by gzip.
    provide("zopfli", &["zopfli"], "`web`")?;
    piped(Command::new("zopfli").arg("-c").arg(small), &[])
}

/// Options of `wasm-opt`.
const OPTIMISED: &str = "-Oz --enable-bulk-memory --enable-sign-ext --enable-mutable-globals \
                         --enable-nontrapping-float-to-int --strip-producers";

/// Whether a file was made after another.
fn is_newer(made: &Path, of: &Path) -> bool {
    let age = |path: &Path| std::fs::metadata(path).and_then(|found| found.modified());
    matches!((age(made), age(of)), (Ok(made), Ok(of)) if made > of)
}

/// The page: templates, scripts, examples and the command.
fn page_text(command: &[u8]) -> Result<String, String> {
    let own = |name: &str| files::read_text(&root().join("web").join(name));
    let shared = |name: &str| files::read_text(&root().join(REPORT).join(name));
    let mut script = String::new();
    for name in DRAWING {
        script += &shared(name)?;
    }
    // The report's last script, run once for each report.
    let _ = write!(
        script,
        "const drawReport = (window) => {{\n{}\n}};\n",
        shared("view.js")?
    );
    for name in OWN {
        script += &own(name)?;
    }
    let hash = hash(&script)?;
    // The styles are the report's and the page's own; user content sets none.
    let policy = format!(
        "default-src 'none'; script-src 'sha256-{hash}' 'wasm-unsafe-eval'; worker-src blob:; \
         style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
    );
    let style = [shared("style.css")?, shared("view.css")?, own("page.css")?].concat();
    let parts = [
        ("policy", policy),
        ("style", style),
        ("examples", examples()?),
        ("first", first()?),
        ("worker", own("system.js")? + &own("worker.js")?),
        ("script", script),
        ("wasm", base64(command)),
    ];
    let mut page = own("page.html")?;
    for (name, text) in parts {
        if name != "policy" && text.contains("</script") {
            return Err(format!("{name} would end its element"));
        }
        page = page.replace(&format!("{{{{{name}}}}}"), &text);
    }
    Ok(page)
}

/// The machine that the page opens with, as JSON: its files, and what the command answers to them (`--check` compares),
/// so that it is drawn at once.
fn first() -> Result<String, String> {
    let own = |name: &str| files::read_text(&root().join("web/first").join(name));
    Ok(format!(
        "{{\"files\": {{\"machine.toml\": {}, \"errors.toml\": {}}}, \"answer\": {}}}",
        json(&own("machine.toml")?),
        json(&own("errors.toml")?),
        own("model.json")?
    ))
}

/// The examples as JSON: their files, and the options that they are compiled with.
fn examples() -> Result<String, String> {
    let mut all = Vec::new();
    for case in report::examples() {
        let mut texts = Vec::new();
        for file in case.files() {
            let name = file.rsplit('/').next().unwrap_or(&file);
            let text = files::read_text(&root().join(&file))?;
            texts.push(format!("{}: {}", json(name), json(&text)));
        }
        let options = case.tables.unwrap_or_default();
        let (name, files) = (json(case.name), texts.join(","));
        all.push(format!(
            "{name}: {{\"options\": {}, \"files\": {{{files}}}}}",
            json(options)
        ));
    }
    Ok(format!("{{{}}}", all.join(",\n")))
}

/// A text as JSON that cannot end its element.
fn json(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '<' | '\0'..='\x1f' => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, k| {
            bits << 8 | usize::from(three.get(k).copied().unwrap_or(0))
        });
        for k in 0..4 {
            let letter = LETTERS[bits >> (18 - 6 * k) & 63];
            text.push(if k > three.len() {
                '='
            } else {
                char::from(letter)
            });
        }
    }
    text
}

/// SHA-256 as a content security policy has it.
fn hash(text: &str) -> Result<String, String> {
    let printed = piped(&mut Command::new("sha256sum"), text.as_bytes())?;
    let digits = printed.get(..64).ok_or("sha256sum prints no sum")?;
    let digits: Option<Vec<u32>> = digits.iter().map(|&c| char::from(c).to_digit(16)).collect();
    let digits = digits.ok_or("sha256sum prints no sum")?;
    let bytes: Vec<u8> = digits
        .chunks(2)
        .map(|two| (two[0] << 4 | two[1]) as u8)
        .collect();
    Ok(base64(&bytes))
}

/// What a program makes of its standard input.
fn piped(command: &mut Command, input: &[u8]) -> Result<Vec<u8>, String> {
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| format!("a program is missing: {error}"))?;
    let stdin = child.stdin.take();
    let output = std::thread::scope(|scope| {
        scope.spawn(move || stdin.map(|mut stdin| stdin.write_all(input)));
        child.wait_with_output()
    });
    match output {
        Ok(output) if output.status.success() => Ok(output.stdout),
        Ok(output) => Err(format!("{command:?}: {}", output.status)),
        Err(error) => Err(format!("{command:?}: {error}")),
    }
}

/// Serves the page on the loopback address until interrupted.
///
/// # Errors
/// If there is no address, or the page cannot be read.
pub fn serve(page: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("the page cannot be served: {error}");
    let listener = TcpListener::bind("127.0.0.1:8000")
        .or_else(|_| TcpListener::bind("127.0.0.1:0"))
        .map_err(failed)?;
    println!("http://{}/", listener.local_addr().map_err(failed)?);
    for stream in listener.incoming() {
        let text = files::read(page)?;
        let Ok(mut stream) = stream else { continue };
        // Whatever is asked for, there is one page. A client that goes away is not an error.
        let _ = stream.read(&mut [0; 4096]);
        let head = "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\nConnection: close";
        let _ = write!(stream, "{head}\r\nContent-Length: {}\r\n\r\n", text.len());
        let _ = stream.write_all(&text);
    }
    Ok(())
}

/// Drives the page in real browsers and compares what it makes with the command's.
///
/// # Errors
/// If something cannot be installed or built, or a check fails.
pub fn check(page: &Path) -> Result<(), String> {
    let folder = files::folder(target("web").join("check"))?;
    let driver = report::provide_browser(&target("report"))?;
    provide("firefox-esr", &["firefox-esr"], "`web --check`")?;
    qemu::provide()?;
    let firmware = hil::emulated("stm32f405")?;
    let trueaxis = trueaxis::build()?;
    for case in report::examples() {
        let output = folder.join(format!("{}.trax", case.name));
        trueaxis::compile(
            &trueaxis,
            &case.files(),
            case.tables.unwrap_or_default(),
            &output,
        )?;
    }
    run(Command::new("node")
        .arg(root().join("tests/browser/web.mjs"))
        .args([page, &folder, &driver, &trueaxis, &firmware]))
}
