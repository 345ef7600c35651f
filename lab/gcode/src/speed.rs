//! Speed of correcting programs compared with `rs274` in one run, and the memory needed for a long one.

use crate::{compensation, correct};
use programs::{files, trueaxis};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Number of runs of each; the fastest counts.
const RUNS: usize = 5;
/// Correcting a program may take at most a quarter of the time that `rs274` needs to interpret the original.
const LEAST: f64 = 4.0;
/// Permitted memory difference between a long and a short program: pages kept by the allocator (kB).
const PAGES: u64 = 1024;

/// A program of short moves of three axes, none of which needs to be cut.
fn program(path: &Path, megabytes: u64) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("{}: {e}", path.display());
    let mut file = BufWriter::new(File::create(path).map_err(failed)?);
    writeln!(file, "G21 G90 G17 G54\nG0 X0 Y0 Z0\nF1200\nG1 X0").map_err(failed)?;
    let (mut written, mut k) = (0, 0_u64);
    while written < megabytes * 1_000_000 {
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

/// Cost of a run.
#[derive(Clone, Copy)]
struct Took {
    time: Duration,
    /// Maximum memory (kB), if the system reports it.
    memory: u64,
}

fn timed(command: &mut Command) -> Result<Took, String> {
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .map_err(|e| format!("{command:?} does not start: {e}"))?;
    let status = format!("/proc/{}/status", child.id());
    let mut memory = 0;
    loop {
        if let Ok(text) = fs::read_to_string(&status) {
            let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
            let kb = line.and_then(|l| l.trim().split(' ').next()?.parse::<u64>().ok());
            memory = memory.max(kb.unwrap_or_default());
        }
        match child.try_wait() {
            Ok(Some(status)) if status.success() => {
                let time = start.elapsed();
                return Ok(Took { time, memory });
            }
            Ok(Some(status)) => return Err(format!("{command:?}: {status}")),
            Ok(None) => std::thread::sleep(Duration::from_millis(2)),
            Err(error) => return Err(error.to_string()),
        }
    }
}

/// Files and the command.
struct SpeedBench<'w> {
    work: &'w Path,
    trueaxis: PathBuf,
    blob: PathBuf,
    setup: PathBuf,
    long: PathBuf,
    out: PathBuf,
}

impl<'w> SpeedBench<'w> {
    fn new(work: &'w Path) -> Result<Self, String> {
        let trueaxis = trueaxis::shipped()?;
        let bench = Self {
            work,
            blob: compensation(&trueaxis, work)?,
            trueaxis,
            setup: work.join("setup.toml"),
            long: work.join("long.ngc"),
            out: work.join("long-corrected.ngc"),
        };
        let text = "units = \"mm\"\n[start]\nX = 250\nY = 150\nZ = -200\n[offset.G54]\nX = 250\nY = 150\nZ = -200\n";
        files::write(&bench.setup, text)?;
        Ok(bench)
    }

    fn corrected(&self, options: &[&str]) -> Result<Took, String> {
        let [program, out] = [&self.long, &self.out];
        let mut command = correct(&self.trueaxis, program, out, &self.blob, &self.setup);
        timed(command.args(options))
    }

    fn interpreted(&self) -> Result<Took, String> {
        timed(
            Command::new("rs274")
                .arg("-g")
                .arg(&self.long)
                .current_dir(self.work),
        )
    }

    /// Runs both alternately, so that other activity slows both; takes the fastest of each.
    fn race(&self) -> Result<(), String> {
        program(&self.long, 6)?;
        let (mut ours, mut rival) = (Duration::MAX, Duration::MAX);
        for _ in 0..RUNS {
            ours = ours.min(self.corrected(&[])?.time);
            rival = rival.min(self.interpreted()?.time);
        }
        let ratio = rival.as_secs_f64() / ours.as_secs_f64();
        println!(
            "6 MB of G1 lines: corrected in {:.3} s; rs274 -g interprets them in {:.3} s, {ratio:.1} times as long",
            ours.as_secs_f64(),
            rival.as_secs_f64()
        );
        match ratio >= LEAST {
            true => Ok(()),
            false => Err(format!("less than {LEAST} times as fast as rs274")),
        }
    }

    /// A short and a long program must need the same memory.
    fn memory(&self, what: &str, sizes: [u64; 2], options: &[&str]) -> Result<(), String> {
        let mut most = Vec::new();
        for megabytes in sizes {
            program(&self.long, megabytes)?;
            let took = self.corrected(options)?;
            println!(
                "{megabytes:>4} MB {what} in {:.2} s, with at most {} kB of memory",
                took.time.as_secs_f64(),
                took.memory
            );
            most.push(took.memory);
        }
        match most[1] <= most[0] + PAGES {
            true => Ok(()),
            false => Err(format!("{what}: memory grows with the program")),
        }
    }
}

/// Prints times, the ratio, and memory.
///
/// # Errors
/// If something cannot be built or run, is too slow, or needs more and more memory.
pub fn measure(work: &Path) -> Result<(), String> {
    let bench = SpeedBench::new(work)?;
    let done = bench
        .memory("corrected", [6, 100], &[])
        .and_then(|()| bench.memory("corrected and checked", [6, 100], &["--check"]))
        .and_then(|()| bench.race());
    for path in [&bench.long, &bench.out] {
        let _ = fs::remove_file(path);
    }
    done
}
