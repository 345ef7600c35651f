//! `--expand`: what is written out flat, read with our interpreter, beside `rs274` on the original.

use super::{moves, own, programs, rs274, same};
use crate::files;
use crate::process::said;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Offsets of the work coordinate systems G54, G55 and G56: X Y Z A and R, in the unit of the machine. More decimals than
/// the interpreter prints.
const SYSTEMS: [[f64; 5]; 3] = [
    [12.345_678_9, -7.654_321_1, 3.1, 0.0, 0.0],
    [100.5, 50.25, -20.0, 15.0, 30.0],
    [-3.0, 4.000_04, 5.0, -10.5, -12.5],
];
/// Where G28 goes.
const HOME: [f64; 4] = [1.5, 2.25, 30.0, 5.0];
/// Lengths of the tools 1 and 2.
const LENGTHS: [f64; 2] = [51.234_567, 76.2];

/// Our own programs. `{mm}` is G21 or G20 of the machine's unit.
const OWN: [(&str, &str); 9] = [
    (
        "loops",
        "{mm} G90 G17\nG53 G0 X1 Y2 Z3 A4\n#1=0\no100 sub\n#4=[#1*2]\nG1 X[#1] Y[SIN[#2]*20] Z[-#1/10] F[300+#3]\no100 endsub\n\
         o101 while [#1 LT 50]\no100 call [#1] [#1*7] [#1]\n#1=[#1+7.3]\no101 endwhile\n\
         o102 if [#1 GT 40]\nG0 Z5\no102 else\nG0 Z6\no102 endif\no103 repeat [3]\nG91 G0 X1.23456 Y-[1/3]\nG90\no103 endrepeat\nM2\n",
    ),
    (
        "arcs in three planes, helices",
        "{mm} G90 F200\nG53 G0 X1 Y2 Z3 A4\n#<r>=12.3456\nG0 X0 Y0 Z0\nG17 G2 X[#<r>] Y[#<r>] I[#<r>] J0\nG3 X[#<r>] Y[#<r>] Z-3 I[-#<r>] J0 P3\n\
         G18 G2 X[2*#<r>] Z[#<r>-3] R[#<r>]\nG3 I[#<r>/2] K0 Y2\nG19 G2 Y[2+#<r>] Z[-3] J0 K[-#<r>]\nG3 J3 K4 P2 X1\n\
         G17 G90.1 G2 I[#<r>/2] J10\nG91.1 G1 X1\nM2\n",
    ),
    (
        "offsets, rotation",
        "{mm} G90 F100\nG53 G0 X1 Y2 Z3 A4\n#9=2.5\nG54 G0 X[#9] Y1 Z1\nG55 G1 X[#9*3] Y[#9]\nY[#9*4]\nG2 X[#9*4] Y[#9*5] R[#9*2]\nG56 G1 X0\nG1 A[#9*10]\n\
         G10 L2 P3 X[#9] Y3.00004 Z-1 R[#9*8]\nG1 X[#9] Y7\nG3 X[#9+4] Y7 I2 J0\nG10 L20 P1 X[#9] Y1\nG54 G1 X0 Y0 Z0\nG55\nG1 Z[#9]\nG53 G0 Z[#9]\n\
         G10 L2 P2 X5 R0\nG0 X1\nG59.3 G0 X1 Y1 Z1\nG54\nM30\n",
    ),
    (
        "F beside another unit",
        "{mm} G90 F100\nG53 G0 X1 Y2 Z3 A4\n#9=2.5\nG20 F[#9] G1 X[#9]\nY1\nG21 F[#9*40] G1 X3\nG20\nF[#9] G1 X2\nM2\n",
    ),
    (
        "G92, G52",
        "{mm} G90 F100\nG53 G0 X1 Y2 Z3 A4\n#9=1.23456\nG92 X[#9] Y5\nG1 X[#9*2] Y0\nG92.2\nG1 X0\nG92.3\nG1 X0 Y1\nG52 X[#9] Z[2*#9]\nG1 X0 Z0\nG55 G1 X1 Y1\n\
         G92 Z0 A0\nG1 Z2 A5\nG92.1\nG1 X0 Y0 Z0 A0\nG52 X0\nG1 X3\nM2\n",
    ),
    (
        "tools",
        "{mm} G90 F100\nG53 G0 X1 Y2 Z3 A4\n#9=1\nT#9 M6\nG43\nG1 Z[#9*5]\nG43 H2\nG0 Z1\nX[#9]\nG43.1 Z[#9*10.5] X[#9/3]\nG1 X0 Z0\nG49\nG1 Z20\nT2 M6 G43 H[#9+1]\n\
         G0 Z[#9+#5400]\nG43.2 H1\nG0 Z3\nG49\nG0 Z[#5422+1]\nM2\n",
    ),
    (
        "both units",
        "G21 G90 F254\nG53 G0 X1 Y2 Z3 A4\n#9=25.4\nG0 X[#9] Y[#9] Z0\nG20\nF10\nG1 X2.34567 Y[#9/10]\nG2 X3 Y3 R[#9/25.4]\nG55 G0 X1 Y1\nG21\nF300\nG1 X[#9/3]\n\
         G43 H1\nG0 Z[#9]\nG20\nG92 X0 Y[1/3]\nF20\nG1 X1 Y1\nG21\nF500\nG1 X0 Y0 Z0\nG20\nM2\n",
    ),
    (
        "feeds, cycles",
        "{mm} G90 F100\nG53 G0 X1 Y2 Z10 A4\n#9=3\nG93\nG1 X[#9] F[#9]\nG1 X0 A[#9*10] F2\nG2 X[#9] Y0 R[#9*2] F4\nG94\nF[#9*100]\nG98 G81 X[#9] Y1 Z-[#9] R2\nG91 X1 L[#9]\nG90\n\
         G99 G83 X0 Y0 Z-4 R2 Q[#9/2]\nG80\nS1000 M3\nG95 F0.1\nG1 X1\nG94 F[#9*30]\nG1 X2\nG4 P0.5\nM5\nG28\nG30.1\nM2\n",
    ),
    (
        "ends",
        "%\n(a comment)\nN7 {mm} G90 F100\nG53 G0 X1 Y2 Z3 A4\n#1=1 (set)\n/ G0 X9\nM98 P200 L2\nG0 X[#1]\nM8\nM9\nM30\nO200\nG91 G1 X#1 (inside)\nG90\nM99\n%\nafter the end\n",
    ),
];

/// # Errors
/// If a motion differs, a program is refused for a reason that is not listed, or is accepted and should not be.
pub fn check(trueaxis: &Path, work: &Path) -> Result<(), String> {
    let work = files::folder(work.join("expanded"))?;
    own(&work)?;
    random(&work)?;
    parameters(&work)?;
    package(trueaxis, &work)
}

/// The setup of our programs; returns the setup, and the interpreter's parameters and tools, which are in inches.
fn given(work: &Path, inch: bool) -> Result<[PathBuf; 3], String> {
    let unit = if inch { 1.0 } else { 25.4 };
    let letters = ["X", "Y", "Z", "A"];
    let inches = |axis: usize, value: f64| if axis == 3 { value } else { value / unit };
    let mut setup = format!("units = \"{}\"\n", if inch { "inch" } else { "mm" });
    setup += "[start]\nX = 0\nY = 0\nZ = 0\nA = 0\nB = 0\nC = 0\ntool = 0\nretract = \"G98\"\n";
    let mut parameters: BTreeMap<usize, f64> = BTreeMap::new();
    for first in [
        5161, 5181, 5211, 5221, 5241, 5261, 5281, 5301, 5321, 5341, 5361, 5381,
    ] {
        parameters.extend((first..first + 10).map(|number| (number, 0.0)));
    }
    parameters.extend([(5210, 0.0), (5220, 1.0)]);
    for place in 0..9 {
        let values = SYSTEMS.get(place).copied().unwrap_or_default();
        let name = if place < 6 {
            format!("G{}", 54 + place)
        } else {
            format!("G59.{}", place - 5)
        };
        let _ = writeln!(setup, "[offset.\"{name}\"]");
        for (axis, letter) in letters.iter().enumerate() {
            let _ = writeln!(setup, "{letter} = {:?}", values[axis]);
            parameters.insert(5221 + 20 * place + axis, inches(axis, values[axis]));
        }
        let _ = writeln!(setup, "R = {:?}", values[4]);
        parameters.insert(5230 + 20 * place, values[4]);
    }
    for (name, first) in [("G28", 5161), ("G30", 5181)] {
        let _ = writeln!(setup, "[home.{name}]\nB = 0\nC = 0");
        for (axis, letter) in letters.iter().enumerate() {
            let _ = writeln!(setup, "{letter} = {:?}", HOME[axis]);
            parameters.insert(first + axis, inches(axis, HOME[axis]));
        }
    }
    let mut tools = String::new();
    for (place, length) in LENGTHS.iter().enumerate() {
        let number = place + 1;
        let _ = writeln!(setup, "[tool.{number}]\nlength = {length:?}");
        let _ = writeln!(tools, "T{number} P{number} Z{}", inches(2, *length));
    }
    let mut var = String::new();
    for (number, value) in parameters {
        let _ = writeln!(var, "{number}\t{value}");
    }
    let paths = ["setup.toml", "given.var", "given.tbl"].map(|name| work.join(name));
    for (path, text) in paths.iter().zip([setup, var, tools]) {
        files::write(path, text)?;
    }
    Ok(paths)
}

/// Motions of `rs274`. An axis that an arc leaves where it is keeps the digits of the motion before, which may have been
/// printed in inches.
fn rivals(
    program: &Path,
    tools: &Path,
    options: &[(&str, &Path)],
) -> Result<Vec<rs274::Motion>, String> {
    let mut motions = rs274::run(program, tools, options)?;
    let mut before = 0.0;
    for motion in &mut motions {
        let own = motion.digits;
        if motion.is_arc() {
            motion.digits = own.max(before);
        }
        before = own;
    }
    Ok(motions)
}

/// Our interpreter on what a program is written out to.
fn flat(program: &Path, work: &Path, options: &[String]) -> Result<Vec<String>, String> {
    let mut all = vec![format!("--expand={}", work.join("flat.ngc").display())];
    all.extend(options.iter().cloned());
    let mut found = moves(&[program.to_path_buf()], &all)?;
    found
        .remove(&program.display().to_string())
        .ok_or_else(|| format!("{}: nothing was said of it", program.display()))
}

fn own(work: &Path) -> Result<(), String> {
    let mut count = 0;
    for inch in [false, true] {
        let [setup, var, tools] = given(work, inch)?;
        for (name, text) in OWN {
            let unit = if inch { "G20" } else { "G21" };
            // The stand-alone interpreter begins with G21, in which an F in the same line would count; a machine in inches
            // begins with G20.
            let unit_line = format!("{unit}\n");
            let text = text.replace("{mm}", &unit_line).replace("G30.1\n", "");
            let program = work.join("own.ngc");
            files::write(&program, text)?;
            let ours = flat(&program, work, &[format!("--setup={}", setup.display())])?;
            let copy = work.join("own.var");
            files::copy(&var, &copy)?;
            let rivals = rivals(&program, &tools, &[("-v", copy.as_path())])?;
            count += same(&ours, &rivals).map_err(|cause| format!("{name}, {unit}: {cause}"))?;
        }
    }
    println!(
        "{count:>4} motions of {} expanded programs under offsets, rotation, G92, tools, in mm and inches, the same as rs274's",
        2 * OWN.len()
    );
    Ok(())
}

/// The programs with all modes that our own interpreter is compared on.
fn random(work: &Path) -> Result<(), String> {
    let (programs, tools) = own::random_programs(work)?;
    let (mut count, mut refused) = (0, 0);
    for program in &programs {
        let ours = flat(program, work, &["--tool=1=0".to_owned()])?;
        if let Some(cause) = ours.iter().find_map(|l| l.strip_prefix("refused ")) {
            let text = files::read_text(program)?;
            let may = cause.contains("cutter compensation") && text.contains("G4")
                || cause.contains("motion with the spindle") && text.contains("G33")
                || cause.contains("G28.1")
                || cause.contains("G30.1");
            if !may {
                return Err(format!("{}: {cause}", program.display()));
            }
            refused += 1;
            continue;
        }
        let rivals = rivals(program, &tools, &[])?;
        count += same(&ours, &rivals).map_err(|cause| format!("{}: {cause}", program.display()))?;
    }
    println!(
        "{count:>4} motions of {} random programs, expanded, the same as rs274's; {refused} refused for a word that canonical \
         motions cannot say",
        programs.len() - refused
    );
    Ok(())
}

/// Parameters that the stand-alone interpreter has in inches mean what they mean on the machine.
fn parameters(work: &Path) -> Result<(), String> {
    let program = work.join("read.ngc");
    let text = "G53 G0 X[#5221] Y[#5222*2] Z[#5163+1] A[#5244+#5164]\nT1 M6\nG53 G0 Z[#5403/2] X[#5242/#5241] A#5220\nM2\n";
    files::write(&program, text)?;
    for inch in [false, true] {
        let [setup, ..] = given(work, inch)?;
        let ours = flat(&program, work, &[format!("--setup={}", setup.display())])?;
        let unit = if inch { 25.4 } else { 1.0 };
        let [g54, g55, _] = SYSTEMS;
        let expected = [
            [
                g54[0] * unit,
                2.0 * g54[1] * unit,
                (HOME[2] + 1.0) * unit,
                g55[3] + HOME[3],
            ],
            [
                g55[1] / g55[0] * unit,
                2.0 * g54[1] * unit,
                LENGTHS[0] / 2.0 * unit,
                1.0,
            ],
        ];
        let motions: Vec<_> = ours
            .iter()
            .filter_map(|line| rs274::Motion::read(line))
            .collect();
        for (motion, expected) in motions.iter().zip(&expected) {
            // Half of the digit of its word, and our fifth decimal.
            let near = (0..4).all(|i| (motion.to[i] - expected[i]).abs() < 0.6e-4 * unit);
            if !near {
                return Err(format!(
                    "parameters in {unit} mm: {motion:?}, expected {expected:?}"
                ));
            }
        }
        if motions.len() != expected.len() {
            return Err(format!("parameters: {ours:?}"));
        }
    }
    println!("   4 motions from parameters of offsets, places and tools, in mm and inches");
    Ok(())
}

/// Why programs of the package are refused: what the message contains, and in short. Each must occur.
const REASONS: [(&str, &str); 23] = [
    (
        "no percent sign",
        "a file of subroutines, which does not run alone",
    ),
    ("a pin of the machine", "reads a HAL pin"),
    ("the result of probing", "reads a result of probing"),
    ("(G38)", "probes"),
    ("M66 waits", "waits for an input"),
    ("INI file", "reads an entry of the INI file"),
    ("cutter compensation", "cutter compensation"),
    (
        "does not know the units of the machine",
        "asks for the units of the machine",
    ),
    ("a message with a length", "shows an offset in a message"),
    ("nknown m code", "M words of a configuration"),
    ("M-code greater", "M words of a configuration, beyond M199"),
    ("a spline", "splines"),
    (
        "not found in the tool table",
        "a tool that the setup does not have",
    ),
    (
        "the length of tool",
        "the length of a tool that the setup does not have",
    ),
    ("motion with the spindle", "motion with the spindle"),
    ("no axis A", "moves an axis that mill-21 does not have"),
    ("outside its travel", "leaves the travel of mill-21"),
    ("a pocket of the tool changer", "reads a pocket"),
    ("is set by its number", "sets a parameter of the machine"),
    ("M61: ", "M61"),
    (
        "Unexpected character after O-word",
        "an error, which LinuxCNC refuses too",
    ),
    (
        "a subroutine that is not found",
        "a subroutine that the package does not have",
    ),
    ("Bad character 'w'", "moves W"),
];

/// Folders of subroutines in the package.
const SUBROUTINES: [&str; 6] = [
    "",
    "ngcgui_lib",
    "ngcgui_lib/utilitysubs",
    "macros/mill",
    "macros/lathe",
    "gladevcp_lib",
];

/// Programs of the package that compute: corrected with the command, and what they are written out to compared.
fn package(trueaxis: &Path, work: &Path) -> Result<(), String> {
    let blob = super::compensation(trueaxis, work)?;
    let mut text = "units = \"mm\"\n".to_owned();
    let place = "X = 200\nY = 100\nZ = -200\n";
    let _ = write!(
        text,
        "[start]\n{place}tool = 0\nretract = \"G98\"\n[home.G28]\n{place}[home.G30]\n{place}"
    );
    let mut var = "5161\t0\n5181\t0\n5211\t0\n5220\t1\n".to_owned();
    for system in 0..9 {
        let _ = writeln!(var, "{}\t0", 5221 + 20 * system);
        let name = if system < 6 {
            format!("G{}", 54 + system)
        } else {
            format!("G59.{}", system - 5)
        };
        let _ = write!(text, "[offset.\"{name}\"]\n{place}");
    }
    let setup = work.join("package.toml");
    files::write(&setup, text)?;
    // Diameters, in mm on the machine.
    let tools = work.join("package.tbl");
    let table: String = super::TOOLS
        .iter()
        .map(|t| format!("T{t} P{t} Z0 D6\n"))
        .collect();
    files::write(&tools, table)?;
    let root = Path::new("/usr/share/linuxcnc/ncfiles");
    let folders: Vec<PathBuf> = SUBROUTINES.iter().map(|f| root.join(f)).collect();
    let names = |options: &[PathBuf]| -> Vec<String> {
        options
            .iter()
            .map(|f| format!("--subroutines={}", f.display()))
            .collect()
    };
    let zero = work.join("zero.toml");
    let at_zero = fs::read_to_string(&setup).map_err(|e| e.to_string())?;
    let at_zero = at_zero
        .replace(" = 200", " = 0")
        .replace(" = 100", " = 0")
        .replace(" = -200", " = 0")
        .replace("[start]\n", "[start]\nA = 0\nB = 0\nC = 0\n");
    let lengths = super::TOOLS.map(|tool| format!("[tool.{tool}]\nlength = 0\n"));
    files::write(&zero, at_zero + &lengths.concat())?;
    let (mut counts, mut wrong) = (BTreeMap::<String, Vec<String>>::new(), Vec::new());
    let (mut corrected, mut compared, mut moving, mut motions) = (0, 0, 0, 0);
    for path in programs()? {
        if super::is_flat(&path)? {
            continue;
        }
        let name = path.display().to_string();
        let out = work.join("corrected.ngc");
        let _ = fs::remove_file(&out);
        let mut command = super::correct(trueaxis, &path, &out, &blob, &setup);
        command
            .args(["--expand", "--check", "--block-delete", "off", "--tools"])
            .arg(&tools);
        let answer = said(command.args(names(&folders)))?;
        // Without the frames and line breaks of a message.
        let words = answer
            .errors
            .split_whitespace()
            .filter(|w| !["│", "·", "×"].contains(w));
        let said_of = words.collect::<Vec<_>>().join(" ");
        match (answer.status.code(), out.exists()) {
            (Some(0), true) => corrected += 1,
            (Some(2), false) => {
                let reason = REASONS.iter().find(|(part, _)| said_of.contains(part));
                match reason {
                    Some((_, reason)) => counts
                        .entry((*reason).to_owned())
                        .or_default()
                        .push(name.clone()),
                    None => wrong.push(format!("{name}: {said_of}")),
                }
            }
            other => wrong.push(format!("{name}: {other:?}: {said_of}")),
        }
        // What is written out, also of programs for other axes and larger machines.
        let mut options = names(&folders);
        options.push(format!("--setup={}", zero.display()));
        let ours = flat(&path, work, &options)?;
        if let Some(cause) = ours.iter().find(|line| line.starts_with("refused ")) {
            if answer.status.success() {
                wrong.push(format!("{name}: corrected, and not compared: {cause}"));
            }
            continue;
        }
        let copy = work.join("original.ngc");
        files::copy(&path, &copy)?;
        let parameters = work.join("original.var");
        files::write(&parameters, &var)?;
        let ini = work.join("original.ini");
        let mut paths = vec![path.parent().unwrap_or(root).display().to_string()];
        paths.extend(folders.iter().map(|f| f.display().to_string()));
        files::write(
            &ini,
            format!("[RS274NGC]\nSUBROUTINE_PATH = {}\n", paths.join(":")),
        )?;
        let rivals = rivals(&copy, &tools, &[("-v", &parameters), ("-i", &ini)]);
        match rivals.and_then(|rivals| same(&ours, &rivals)) {
            Ok(count) => {
                compared += 1;
                moving += usize::from(count > 0);
                motions += count;
            }
            Err(cause) => wrong.push(format!("{name}: {cause}")),
        }
    }
    println!(
        "{motions:>4} motions of {compared} programs of the package that compute, the same as rs274's; {moving} of the \
         programs move, others define subroutines or show messages"
    );
    println!(
        "{corrected:>4} programs that compute are corrected for mill-21 and checked; refused:"
    );
    for (reason, names) in &counts {
        println!("{:>4} {reason}", names.len());
    }
    for (_, reason) in REASONS
        .iter()
        .filter(|(_, reason)| !counts.contains_key(*reason))
    {
        wrong.push(format!("no program is refused because of: {reason}"));
    }
    match wrong.is_empty() {
        true => Ok(()),
        false => Err(format!("{} programs:\n{}", wrong.len(), wrong.join("\n"))),
    }
}
