//! Words that occur in no program of the package, also compared with `rs274`.

use crate::{moves, rs274, same};
use programs::process::said;
use programs::{files, trueaxis};
use std::fs;
use std::path::{Path, PathBuf};

/// Number of random programs with all modes, offsets, arcs, cycles and rotary moves.
const RANDOM: usize = 300;

/// Offsets that share storage (G52, G92), and a tool set by the program.
const OFFSETS: &str = "G21 G90 F100\nG0 X1 Y2 Z3\nG52 X10 Z1\nG0 X1 Z1\nG92 Y5\nG0 X0 Y0\nG92.2\nG0 X0 Y0\nG92.3\n\
                       G0 X0 Y1\n\
G52 X0 Y0 Z0\nG0 X1 Y1 Z1\nG92 X7\nG92.2\nG92.2\nG92.3\nG0 X8\nG1 X9\nG10 L1 P1 Z5\nG43 H1\nG0 Z0\nG10 L1 P1 X0.5\n\
G43 H1\n\
G1 X0 Y3\nG49\nG1 X2 Z2\nG20\nG52 X1 Y-1\nF10\nG1 X0.5 Y0.25\nM2\n";

/// An endless axis.
const WRAPPED: &str = "G21 G90 F100\nG1 C90\nC-90\nG0 C10\nG92 C20\nC30\nC-350\nG91 C5\nG90 C-0\nC0\nC350\nC-10 X1\n\
                       G91\nC-400\n\
G90\nG1 C20 X2\nM2\n";

/// # Errors
/// If a motion differs.
pub fn check(work: &Path) -> Result<(), String> {
    let write = |name: &str, text: &str| {
        let path = work.join(name);
        files::write(&path, text).map(|()| path)
    };
    let tools = write("own.tbl", "T1 P1 Z3\n")?;
    let parameters = work.join("own.var");
    let ini = format!(
        "[AXIS_C]\nWRAPPED_ROTARY = 1\n[RS274NGC]\nPARAMETER_FILE = {}\n",
        parameters.display()
    );
    let ini = write("own.ini", &ini)?;
    let mut count = 0;
    for (name, text, ini, options) in [
        ("offsets.ngc", OFFSETS, None, &["--tool=1=3"][..]),
        (
            "wrapped.ngc",
            WRAPPED,
            Some(ini.as_path()),
            &["--wrapped=C"],
        ),
    ] {
        // Stored by the last run.
        let _ = fs::remove_file(&parameters);
        let program = write(name, text)?;
        let ours = moves(std::slice::from_ref(&program), options)?;
        let options: Vec<_> = ini.map(|ini| ("-i", ini)).into_iter().collect();
        let rivals = rs274::run(&program, &tools, &options)?;
        let ours = &ours[&program.display().to_string()];
        count += same(ours, &rivals).map_err(|cause| format!("{name}: {cause}"))?;
    }
    println!("{count:>4} motions under G52, G92, G10 L1 and with a wrapped axis, the same");
    random(work)
}

/// Programs that nobody wrote, and their tool table.
pub fn random_programs(work: &Path) -> Result<(Vec<PathBuf>, PathBuf), String> {
    let folder = files::folder(work.join("random"))?;
    let mut writing = trueaxis::example("gcode_moves");
    writing.arg(format!("--random={RANDOM}")).arg(&folder);
    let written = said(&mut writing)?.output;
    if !written.is_empty() {
        return Err(written);
    }
    // The stand-alone program reports tool offsets differently.
    let tools = folder.join("random.tbl");
    files::write(&tools, "T1 P1 Z0\n")?;
    let paths = (0..RANDOM).map(|seed| folder.join(format!("{seed}.ngc")));
    Ok((paths.collect(), tools))
}

fn random(work: &Path) -> Result<(), String> {
    let (paths, tools) = random_programs(work)?;
    let ours = moves(&paths, &["--tool=1=0"])?;
    let mut count = 0;
    for path in &paths {
        let name = path.display().to_string();
        let rivals = rs274::run(path, &tools, &[]).map_err(|cause| format!("{name}: {cause}"))?;
        let ours = ours
            .get(&name)
            .ok_or_else(|| format!("{name}: nothing was said of it"))?;
        count += same(ours, &rivals).map_err(|cause| format!("{name}: {cause}"))?;
    }
    println!("{count:>4} motions of {RANDOM} programs that nobody wrote, the same");
    Ok(())
}
