//! How fast: beside `rs274`, in one run, and how much memory a long program takes.

use crate::process::{cargo, run, target};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A program of short moves of three axes, none of which needs a cut.
fn program(path: &Path, bytes: u64) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("{}: {e}", path.display());
    let mut file = BufWriter::new(File::create(path).map_err(failed)?);
    writeln!(file, "G21 G90 G17 G54\nG0 X0 Y0 Z0\nF1200\nG1 X0").map_err(failed)?;
    let (mut written, mut k) = (0, 0_u64);
    while written < bytes {
        let t = k as f64 * 0.002;
        let line = format!(
            "X{:.4} Y{:.4} Z{:.4}\n",
            80.0 * t.sin(),
            60.0 * (1.3 * t).cos(),
            -20.0 + 15.0 * (0.7 * t).sin()
        );
        file.write_all(line.as_bytes()).map_err(failed)?;
        written += line.len() as u64;
        k += 1;
    }
    writeln!(file, "M2").map_err(failed)?;
    file.flush().map_err(failed)
}

/// Time, and the most memory (kB) where the system tells.
fn timed(command: &mut Command) -> Result<(Duration, u64), String> {
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .map_err(|e| format!("{command:?} does not start: {e}"))?;
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0;
    loop {
        if let Ok(text) = fs::read_to_string(&status) {
            let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
            let kb = line.and_then(|l| l.trim().split(' ').next()?.parse::<u64>().ok());
            most = most.max(kb.unwrap_or_default());
        }
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ok((start.elapsed(), most)),
            Ok(Some(status)) => return Err(format!("{command:?}: {status}")),
            Ok(None) => std::thread::sleep(Duration::from_millis(2)),
            Err(error) => return Err(error.to_string()),
        }
    }
}

/// Prints times, the ratio, and memory.
///
/// # Errors
/// What cannot be built or run.
pub fn measure(work: &Path) -> Result<(), String> {
    run(cargo().args([
        "build",
        "-q",
        "--release",
        "-p",
        "trueaxis-host",
        "--bin",
        "trueaxis",
    ]))?;
    let trueaxis = target("release").join("trueaxis");
    let blob = super::compensation(&trueaxis, work)?;
    let setup = work.join("setup.toml");
    let text = "units = \"mm\"\n[start]\nX = 250\nY = 150\nZ = -200\n[offset.G54]\nX = 250\nY = 150\nZ = -200\n";
    fs::write(&setup, text).map_err(|e| format!("{}: {e}", setup.display()))?;
    let out = work.join("long-corrected.ngc");
    for megabytes in [6, 100] {
        let long = work.join("long.ngc");
        program(&long, megabytes * 1_000_000)?;
        let ours = || {
            timed(
                Command::new(&trueaxis)
                    .arg("gcode")
                    .arg(&long)
                    .arg("-o")
                    .arg(&out)
                    .arg("--compensation")
                    .arg(&blob)
                    .arg("--setup")
                    .arg(&setup),
            )
        };
        let (ours, memory) = (0..3)
            .map(|_| ours())
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .min()
            .unwrap_or_default();
        print!(
            "{megabytes:>4} MB of G1 lines: corrected in {:.2} s, {} MB of memory",
            ours.as_secs_f64(),
            memory / 1000
        );
        if megabytes < 50 {
            let rival = || timed(Command::new("rs274").arg("-g").arg(&long).current_dir(work));
            let rivals = (0..3).map(|_| rival()).collect::<Result<Vec<_>, _>>()?;
            let rival = rivals.into_iter().min().unwrap_or_default().0;
            let ratio = rival.as_secs_f64() / ours.as_secs_f64();
            print!(
                "; rs274 -g interprets them in {:.2} s, {ratio:.1} times as long",
                rival.as_secs_f64()
            );
        }
        println!();
        for path in [&long, &out] {
            let _ = fs::remove_file(path);
        }
    }
    Ok(())
}
