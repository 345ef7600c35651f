//! LinuxCNC's five-axis demonstrations, corrected and checked with the exact machine.

use crate::{correct, programs};
use programs::process::{root, said};
use programs::{files, trueaxis};
use std::path::{Path, PathBuf};

/// Programs of the package, under tool-centre-point control (M428), and the permitted remaining error at the tip (µm):
/// the tolerance of the program plus that of the tables.
const DEMONSTRATIONS: [(&str, f64); 2] = [
    ("demos/boat-xyzac.ngc", 0.5 + 0.1),
    ("demos/impeller-7bl-xyzac.ngc", 0.5 + 0.1),
];
/// Zero of the part: near the axes of the trunnion, so that it stays in the travel at all angles.
const SETUP: &str = "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -20\nA = 0\nC = 0\ntool = 1\n\
travel = { X = \"+\", Y = \"+\", Z = \"+\", A = \"+\", C = \"+\" }\n[offset.G54]\nX = 200\nY = 150\nZ = -160\n\
[tool.1]\nlength = 100\n";

/// The machine with a reversal threshold of 0.0001 mm or degrees. A shorter way back takes up no lost motion, whatever the
/// program says.
fn without_threshold(machine: &Path, work: &Path) -> Result<PathBuf, String> {
    let text = std::fs::read_to_string(machine).map_err(|e| e.to_string())?;
    let path = work.join("machine.toml");
    files::write(
        &path,
        text.replace("[[axis]]", "[[axis]]\nreversal_threshold = 0.0001"),
    )?;
    Ok(path)
}

/// # Errors
/// If a program is refused, fails its check, or leaves a larger error on its path.
pub fn check(trueaxis: &Path, work: &Path) -> Result<(), String> {
    let example = root().join("examples/linuxcnc-xyzac-trt");
    let [machine, errors] = ["machine-endless.toml", "errors-11.toml"].map(|f| example.join(f));
    let machine = without_threshold(&machine, work)?;
    let blob = work.join("xyzac-trt.trax");
    trueaxis::compile(trueaxis, &[&machine, &errors], "--random 200", &blob)?;
    let setup = work.join("five-axes.toml");
    files::write(&setup, SETUP)?;
    for (name, left) in DEMONSTRATIONS {
        let listed = programs()?;
        let path = listed.iter().find(|p| p.ends_with(name));
        let path = path.ok_or_else(|| format!("the package has no {name}"))?;
        let out = work.join("corrected.ngc");
        let mut command = correct(trueaxis, path, &out, &blob, &setup);
        command.arg("--machine").arg(&machine);
        command.arg("--errors").arg(&errors).arg("--check");
        let said = said(&mut command)?.output;
        let last = said.lines().last().unwrap_or("");
        let words: Vec<&str> = last.split([' ', ',']).collect();
        let numbers: Vec<f64> = words.iter().filter_map(|w| w.parse().ok()).collect();
        let [before, after] = numbers.get(..2).unwrap_or_default() else {
            return Err(format!(
                "{name} is refused, or its check does not hold:\n{said}"
            ));
        };
        println!("{name}: {last}");
        if !(*after <= left && before > after) {
            return Err(format!("{name}: more than {left} µm is left:\n{said}"));
        }
    }
    Ok(())
}
