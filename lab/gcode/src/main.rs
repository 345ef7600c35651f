//! Proves that programs are read, and corrected, as another interpreter reads them, LinuxCNC's `rs274`; measures how
//! fast.

mod corrected;
mod five_axes;
mod own;
mod rs274;
mod speed;

use programs::process::{output, said, target};
use programs::{Failure, files, packages, trueaxis};
use rs274::Rs274Motion;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

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

fn main() -> ExitCode {
    programs::main(|words| {
        match words {
            [] => check(&provided()?)?,
            ["speed"] => speed::measure(&provided()?)?,
            _ => return Err(Failure::arguments("gcode takes nothing, or `speed`")),
        }
        Ok(())
    })
}

/// Installs the other interpreter if it is missing; returns the folder to work in.
///
/// # Errors
/// If it cannot be installed.
fn provided() -> Result<PathBuf, String> {
    // Without a program it complains, but it starts.
    if said(Command::new("rs274").arg("-g")).is_err() {
        packages::install(
            &["linuxcnc-uspace"],
            "the comparison with another interpreter",
        )?;
    }
    files::folder(target("gcode"))
}

/// # Errors
/// If something cannot be built, or differs.
fn check(work: &Path) -> Result<(), String> {
    let trueaxis = trueaxis::build()?;
    compare(work)?;
    own::check(work)?;
    five_axes::check(&trueaxis, work)?;
    corrected::check(&trueaxis, work)
}

/// The compensation of `mill-21`, compiled with this command.
fn compensation(trueaxis: &Path, work: &Path) -> Result<PathBuf, String> {
    let sources = ["machine", "errors-21"].map(|name| format!("examples/mill-21/{name}.toml"));
    let blob = work.join("mill-21.trax");
    trueaxis::compile(trueaxis, &sources, "--random 200", &blob)?;
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

/// The programs of the package, one by one.
fn compare(work: &Path) -> Result<(), String> {
    let programs = programs()?;
    let tools = work.join("tools.tbl");
    let table: String = TOOLS.iter().map(|t| format!("T{t} P{t} Z0\n")).collect();
    files::write(&tools, table)?;
    let said = moves(&programs, &tool_options())?;
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut wrong = Vec::new();
    let mut motions = 0;
    for path in &programs {
        let name = path.display().to_string();
        let found = said.get(&name);
        let found = found.ok_or_else(|| format!("{name}: nothing was said of it"))?;
        let refused = found.iter().find_map(|line| line.strip_prefix("refused "));
        let kind = match (is_flat(path)?, refused) {
            (false, Some(refused)) => {
                wrong
                    .extend(refused_for_another_reason(refused).map(|why| format!("{name} {why}")));
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
            (true, None) if WITHOUT_RIVAL.iter().any(|end| name.ends_with(end)) => {
                "flat, with axes that rs274 does not have"
            }
            (true, None) => {
                match same_as_rival(path, &tools, work)? {
                    Ok(count) => motions += count,
                    Err(cause) => wrong.push(format!("{name}: {cause}")),
                }
                "flat, the same motions as rs274"
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
    let count = programs.len();
    if count != PROGRAMS {
        println!("(the package has {count} programs, not {PROGRAMS}: another version)");
    }
    match wrong.len() {
        0 => Ok(()),
        count => Err(format!("{count} programs differ:\n{}", wrong.join("\n"))),
    }
}

/// The options of `gcode_moves` for [`TOOLS`].
fn tool_options() -> [String; TOOLS.len()] {
    TOOLS.map(|tool| format!("--tool={tool}=0"))
}

/// A program that computes is refused for that.
fn refused_for_another_reason(refused: &str) -> Option<String> {
    let kind = refused.split(' ').next().unwrap_or_default();
    let is_that = ["Parameter", "Expression", "Flow"].contains(&kind);
    (!is_that).then(|| format!("computes, but is refused for another reason: {refused}"))
}

/// Number of equal motions of a program, or what differs.
fn same_as_rival(path: &Path, tools: &Path, work: &Path) -> Result<Result<usize, String>, String> {
    let copy = plain_copy(path, work)?;
    let ours = moves(std::slice::from_ref(&copy), &tool_options())?;
    let ours = &ours[&copy.display().to_string()];
    Ok(same(ours, &rs274::run(&copy, tools, &[])?))
}

/// Our interpreter's result for programs, by name; `options` are those of `gcode_moves`.
fn moves(
    programs: &[PathBuf],
    options: &[impl AsRef<OsStr>],
) -> Result<BTreeMap<String, Vec<String>>, String> {
    let said = said(
        trueaxis::example("gcode_moves")
            .args(options)
            .args(programs),
    )?
    .output;
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
