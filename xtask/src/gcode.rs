//! `cargo xtask gcode`: programs compared with another interpreter, LinuxCNC's `rs274`.

mod corrected;
mod five_axes;
mod own;
mod rs274;
mod speed;

use crate::process::{example, output, said, target, trueaxis};
use crate::{blob, files, packages};
use rs274::Rs274Motion;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Number of programs in the package.
const PROGRAMS: usize = 332;
/// Tools requested by programs, which a table gives to both interpreters. Their lengths are 0, because the stand-alone
/// program reports offsets differently.
const TOOLS: [u32; 8] = [1, 2, 3, 4, 5, 7, 9, 30];
/// Flat programs that are refused, each because of a word listed here.
const REFUSED: [(&str, &str); 7] = [
    // Words defined by a custom configuration.
    ("remap/cycle/nc_files/examples.ngc", "g84.2"),
    ("remap/getting-started/nc_files/examples.ngc", "m400"),
    ("remap/stop-lookahead/nc_files/examples.ngc", "G70"),
    // Lathes.
    ("millturn/example.ngc", "G8"),
    ("lathe_pawn.ngc", "G8"),
    // Modes that are stored and restored.
    ("toplevel.ngc", "M70"),
    // Polar coordinates.
    ("hole-circle.ngc", "^60 L6 F10"),
];
/// Flat programs for axes that `rs274` alone does not have.
const WITHOUT_RIVAL: [&str; 1] = ["foam.ngc"];

/// `chosen`: `speed` measures, nothing compares.
///
/// # Errors
/// If something cannot be installed or built, or differs.
pub fn execute(chosen: &[&str]) -> Result<(), String> {
    // Without a program it complains, but it starts.
    if said(Command::new("rs274").arg("-g")).is_err() {
        packages::install(
            &["linuxcnc-uspace"],
            "the comparison with another interpreter",
        )?;
    }
    let work = files::folder(target("gcode"))?;
    match chosen {
        [] => {
            let trueaxis = trueaxis()?;
            compare(&work)?;
            own::check(&work)?;
            five_axes::check(&trueaxis, &work)?;
            corrected::check(&trueaxis, &work)
        }
        ["speed"] => speed::measure(&work),
        _ => Err("gcode takes nothing, or `speed`".to_owned()),
    }
}

/// The compensation of `mill-21`, compiled with this command.
fn compensation(trueaxis: &Path, work: &Path) -> Result<PathBuf, String> {
    let sources = ["machine", "errors-21"].map(|name| format!("examples/mill-21/{name}.toml"));
    let blob = work.join("mill-21.trax");
    blob::compile(trueaxis, &sources, "--random 200", &blob)?;
    Ok(blob)
}

/// `trueaxis gcode`: writes a program corrected with a compensation.
fn correct(trueaxis: &Path, program: &Path, out: &Path, blob: &Path, setup: &Path) -> Command {
    let mut command = Command::new(trueaxis);
    command.arg("gcode").arg(program).arg("-o").arg(out);
    command.arg("--compensation").arg(blob);
    command.arg("--setup").arg(setup);
    command
}

/// The programs of the package.
fn programs() -> Result<Vec<PathBuf>, String> {
    let listed = output(Command::new("dpkg").args(["-L", "linuxcnc-uspace"]))?;
    let is_program = |name: &&str| {
        let end = name.rsplit('.').next().unwrap_or_default();
        ["ngc", "nc", "gcode", "tap"].contains(&end)
    };
    Ok(listed
        .lines()
        .filter(is_program)
        .map(PathBuf::from)
        .collect())
}

/// Whether a program has no parameters, expressions or flow control.
fn is_flat(path: &Path) -> Result<bool, String> {
    Ok(!bare(path)?.contains(['#', '[', 'o', 'O']))
}

/// A program without its comments, with one character for each byte.
fn bare(path: &Path) -> Result<String, String> {
    let bytes = files::read(path)?;
    let mut text = String::new();
    let mut inside = false;
    let mut rest = false;
    for byte in bytes {
        match byte {
            b'\n' => (inside, rest) = (false, false),
            b';' if !inside => rest = true,
            b'(' if !rest => inside = true,
            b')' if inside => {
                inside = false;
                continue;
            }
            _ => {}
        }
        if !inside && !rest {
            text.push(char::from(byte));
        }
    }
    Ok(text)
}

/// A copy without features that `rs274` alone does not know or handles differently: other kinematics, and the offset
/// path of cutter compensation, for which the programmed path is compared instead.
fn plain_copy(path: &Path, work: &Path) -> Result<PathBuf, String> {
    let mut text = bare(path)?.to_uppercase();
    for word in ["M428", "M429", "G41", "G42"] {
        text = text.replace(word, " ");
    }
    // The corresponding radius.
    let mut inside = false;
    text.retain(|c| {
        inside = c == 'D' || (inside && (c.is_ascii_digit() || c == '.'));
        !inside
    });
    let copy = work.join("plain.ngc");
    files::write(&copy, text)?;
    Ok(copy)
}

fn compare(work: &Path) -> Result<(), String> {
    let programs = programs()?;
    let tools = work.join("tools.tbl");
    let table: String = TOOLS.iter().map(|t| format!("T{t} P{t} Z0\n")).collect();
    files::write(&tools, table)?;
    let options = TOOLS.map(|tool| format!("--tool={tool}=0"));
    let said = moves(&programs, &options)?;
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut wrong = Vec::new();
    let mut motions = 0;
    for path in &programs {
        let name = path.display().to_string();
        let flat = is_flat(path)?;
        let found = said
            .get(&name)
            .ok_or_else(|| format!("{name}: nothing was said of it"))?;
        let refused = found.iter().find_map(|line| line.strip_prefix("refused "));
        let kind = match (flat, refused) {
            (false, Some(refused)) => {
                let kind = refused.split(' ').next().unwrap_or_default();
                if !["Parameter", "Expression", "Flow"].contains(&kind) {
                    wrong.push(format!(
                        "{name} computes, but is refused for another reason: {refused}"
                    ));
                }
                "that compute, refused for that"
            }
            (false, None) => {
                wrong.push(format!("{name} computes, and is not refused"));
                continue;
            }
            (true, Some(refused)) => {
                let listed = REFUSED.iter().find(|(end, _)| name.ends_with(end));
                if listed.is_none_or(|(_, word)| !refused.contains(&format!("`{word}`"))) {
                    wrong.push(format!("{name}: refused: {refused}"));
                }
                "flat, refused for a named word"
            }
            (true, None) => {
                if WITHOUT_RIVAL.iter().any(|end| name.ends_with(end)) {
                    "flat, with axes that rs274 does not have"
                } else {
                    let copy = plain_copy(path, work)?;
                    let ours = moves(std::slice::from_ref(&copy), &options)?;
                    let ours = &ours[&copy.display().to_string()];
                    let rivals = rs274::run(&copy, &tools, &[])?;
                    match same(ours, &rivals) {
                        Ok(count) => motions += count,
                        Err(cause) => wrong.push(format!("{name}: {cause}")),
                    }
                    "flat, the same motions as rs274"
                }
            }
        };
        *counts.entry(kind).or_default() += 1;
    }
    for (kind, count) in &counts {
        println!("{count:>4} programs {kind}");
    }
    println!(
        "{motions} motions: end points, centres, turns and feeds are the same to the digits that are printed"
    );
    if programs.len() != PROGRAMS {
        println!(
            "(the package has {} programs, not {PROGRAMS}: another version)",
            programs.len()
        );
    }
    if wrong.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{} programs differ:\n{}",
        wrong.len(),
        wrong.join("\n")
    ))
}

/// Our interpreter's result for programs, by name; `options` are those of `gcode_moves`.
fn moves(
    programs: &[PathBuf],
    options: &[impl AsRef<OsStr>],
) -> Result<BTreeMap<String, Vec<String>>, String> {
    let said = said(example("gcode_moves").args(options).args(programs))?.output;
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut name = String::new();
    for line in said.lines() {
        match line.strip_prefix("file ") {
            Some(file) => {
                name = file.to_owned();
                found.insert(name.clone(), Vec::new());
            }
            None => found.entry(name.clone()).or_default().push(line.to_owned()),
        }
    }
    Ok(found)
}

/// Motions with a distance. A rapid to the current position is one for rs274 (G0 alone) but not for us.
fn moving(motions: impl IntoIterator<Item = Rs274Motion>) -> Vec<Rs274Motion> {
    let mut at = [0.0; 9];
    let moves = |motion: &Rs274Motion| {
        let stands = !motion.is_arc() && (0..6).all(|i| (motion.to[i] - at[i]).abs() < 1e-9);
        at = motion.to;
        !stands
    };
    motions.into_iter().filter(moves).collect()
}

/// Number of equal motions; fails at the first difference.
fn same(ours: &[String], rivals: &[Rs274Motion]) -> Result<usize, String> {
    if let Some(refused) = ours.iter().find(|l| l.starts_with("refused")) {
        return Err(refused.clone());
    }
    let ours = moving(ours.iter().filter_map(|line| Rs274Motion::read(line)));
    let rivals = moving(rivals.iter().cloned());
    for (number, (a, b)) in ours.iter().zip(&rivals).enumerate() {
        a.same(b).map_err(|cause| {
            format!(
                "motion {}: {cause}\n  ours  {a:?}\n  rs274 {b:?}",
                number + 1
            )
        })?;
    }
    match ours.len() == rivals.len() {
        true => Ok(ours.len()),
        false => Err(format!(
            "{} motions, rs274 has {}",
            ours.len(),
            rivals.len()
        )),
    }
}
