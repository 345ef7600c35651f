//! Commands that run while LinuxCNC does, and what a calibration has left.

use crate::bench::LinuxCncBench;
use std::fs;

/// How the tests probe: as fast as servo periods permit; 1 µm in each of the touches that count.
pub const PROBING: &str = "--ball-diameter 20 --stylus-diameter 6 --clearance 2 --search 1.5 --first 1500 --feed 60 \
                           --retreat 0.05 --approach 20000 --home --yes --accept-missing --probings 32 --validate 6";
/// What may be left of a healthy machine, as a part of the coverage interval that was predicted (the goal of the loop).
pub const OF_BAND: f64 = 1.2;
/// Without a compensation LinuxCNC's component has no file.
pub const NO_FILE: &str = "halcmd getp trueaxis.loads | grep -q '^0'";

/// Runs lines inside, in a folder, while LinuxCNC runs a configuration; returns what they printed and their codes.
pub fn operate(
    bench: &LinuxCncBench,
    folder: &str,
    ini: &str,
    lines: &[String],
) -> Result<(String, Vec<i32>), String> {
    bench.copy("firmware/linuxcnc/tests/unattended.py", "unattended.py")?;
    let text: String = (lines.iter())
        .map(|line| format!("cd /tmp/{folder} && {line}\n"))
        .collect();
    bench.write("commands", text)?;
    for name in ["printed", "codes"] {
        let _ = fs::remove_file(bench.file(name));
    }
    bench.open_to_all(folder)?;
    let said = bench.inside(&["linuxcnc", &format!("/tmp/{folder}/{ini}")])?;
    let read = |name: &str| fs::read_to_string(bench.file(name)).unwrap_or_default();
    let codes: Vec<i32> = read("codes").lines().flat_map(str::parse).collect();
    let printed = read("printed");
    if codes.len() != lines.len() {
        return Err(format!(
            "{said}\n{printed}\n{} of {} lines have run",
            codes.len(),
            lines.len()
        ));
    }
    Ok((printed, codes))
}

/// A number of a file that is JSON with one entry in each line.
pub fn number(text: &str, name: &str) -> Result<f64, String> {
    let (_, rest) = text
        .split_once(&format!("\"{name}\":"))
        .ok_or_else(|| format!("no `{name}` in\n{text}"))?;
    let end = rest.find([',', '}', '\n']).unwrap_or(rest.len());
    let value = rest[..end].trim().parse();
    value.map_err(|e| format!("{name}: {e}\n{text}"))
}

/// The mean error of the tip (µm) that a compensation leaves of a machine with known errors, over the whole travel.
pub fn left(bench: &LinuxCncBench, folder: &str) -> Result<[f64; 2], String> {
    let file = |name: &str| format!("{folder}/{name}");
    let (machine, errors, blob) = (
        file("machine.toml"),
        file("errors.toml"),
        file("run/machine.trax"),
    );
    let words = ["verify", &machine, &errors, &blob, "--random", "1000"];
    // It judges whether the tables are those of these errors, which they are not quite.
    let said = bench.trueaxis_said(&words)?;
    let mean = |row: &str| {
        let line = said.lines().find_map(|l| l.trim_start().strip_prefix(row));
        let cell = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
        cell.ok_or_else(|| format!("`verify` says\n{said}"))
    };
    Ok([mean("before")?, mean("tables")?])
}

/// Shell words that wait until a log has more lines than this, or for 400 s: what fills it may have failed.
pub fn until(log: &str, lines: usize) -> String {
    format!(
        "for k in $(seq 2000); do [ $(cat run/{log} 2>/dev/null | wc -l) -gt {lines} ] && break; sleep 0.2; done"
    )
}
