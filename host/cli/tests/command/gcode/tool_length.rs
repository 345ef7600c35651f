//! Tools other than the one that a compensation without length input was made for.

use super::{SETUP, refuses_with, with_files};
use crate::program::{Folder, answer, blob, example, plain, trueaxis};

#[test]
fn another_tool_length_is_warned_of_with_its_micrometres() {
    let folder = Folder::new();
    let program = "G21 G90\nT1 M6\nG43 H1\nG0 X0 Y0 Z150\nG1 X50 F500\nM30\n";
    let part = folder.file("part.ngc", program);
    let (out, compensation) = (folder.at("out.ngc"), blob("mill-21"));
    let machine = example("mill-21/machine.toml");
    let errors = example("mill-21/errors-21.toml");
    let said = |length: f64, options: &[&str]| {
        let setup = SETUP.replace("length = 100", &format!("length = {length}"));
        let setup = folder.file("setup.toml", setup.replace("Z = -350", "Z = -380"));
        let mut arguments = vec!["gcode", &part, "-o", &out, "--setup", &setup];
        arguments.extend(["--compensation", &compensation]);
        arguments.extend(options);
        let output = trueaxis(&arguments);
        assert!(output.status.success(), "{}", plain(&output.stderr));
        (plain(&output.stdout), plain(&output.stderr))
    };
    let exact = ["--machine", &machine, "--errors", &errors, "--check"];
    // The machine's own.
    let (_, warned) = said(100.0, &exact);
    assert_eq!(warned, "");
    let (printed, warned) = said(150.0, &[]);
    assert!(printed.contains("tool length 150.000 mm") && printed.contains("--machine"));
    assert_eq!(warned, "");
    let (_, warned) = said(150.0, &["--machine", &machine]);
    assert!(
        warned.contains("150.000 mm") && warned.contains("100.000 mm"),
        "{warned}"
    );
    assert!(warned.contains("--check with --errors"), "{warned}");
    let (_, warned) = said(150.0, &exact);
    // µm per mm, as `compile` prints it: no position is worse, and 50 mm are some of it.
    let again = folder.at("again.trax");
    let compiled = answer(
        0,
        &[
            "compile", &machine, &errors, "-o", &again, "--random", "200",
        ],
    );
    let number = |text: &str, behind: &str| -> f64 {
        let at = text.find(behind).unwrap() + behind.len();
        let rest = text[at..].trim_start();
        let end = rest
            .find(|c: char| !c.is_ascii_digit() && c != '.')
            .unwrap();
        rest[..end].parse().unwrap()
    };
    let per_mm = compiled
        .lines()
        .find_map(|l| l.split_once(" µm of error; length_range_mm"))
        .unwrap();
    let per_mm: f64 = per_mm.0.rsplit(" ").next().unwrap().parse().unwrap();
    let um = number(&warned, "up to");
    assert!(
        um > 0.5 && um <= 50.0 * per_mm * 1.02,
        "{um} µm, {per_mm} µm/mm: {warned}"
    );
}

#[test]
fn a_tool_that_the_tables_do_not_reach_is_refused() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 G43 H1 Z100\nG0 X0 Y0 A0 C0\nM30\n";
    let with = |length: f64| {
        format!(
            "units = \"mm\"\n[start]\nX = 0\nY = 0\nZ = 0\nA = 0\nC = 0\n[offset.G54]\n[tool.1]\nlength = {length}\n"
        )
    };
    let compensation = blob("length");
    let parts = ["line 2", "400.000 mm", "length_range_mm"];
    refuses_with(program, [&compensation, &with(400.0)], &[], &parts);
    let files = [&*compensation, &with(150.0)];
    with_files(&folder, program, files, &[], |words| answer(0, words));
}
