//! What `trueaxis linuxcnc probe` and `calibrate` refuse before LinuxCNC is asked; `cargo xtask linuxcnc` probes with it.

use crate::program::{Folder, example, has, plain};
use std::process::{Command, Output};

/// Two balls, the second at `x`.
fn artefact(x: f64) -> String {
    format!(
        "[[ball]]\nname = \"low\"\nnominal_mm = [250.0, 160.0, -250.0]\n[[ball]]\nname = \"high\"\nnominal_mm = [{x}, 190.0, -235.0]\n"
    )
}

const STRATEGY: &str = "ball,A,C\nlow,0,0\nhigh,20,30\n";

/// Runs `linuxcnc probe` where there is no Python.
fn probe(folder: &Folder, artefact: &str) -> Output {
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    let artefact = folder.file("artefact.toml", artefact);
    let plan = folder.file("plan.csv", STRATEGY);
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueaxis"));
    command.args(["linuxcnc", "probe", &machine, "--artefact", &artefact]);
    command.args(["--plan", &plan, "-o", &folder.at("touches.csv"), "--yes"]);
    command.args(["--ball-diameter", "20", "--stylus-diameter", "6"]);
    command.env("PATH", "").output().unwrap()
}

fn said(output: &Output) -> String {
    plain(&output.stderr)
}

#[test]
fn without_python_it_says_what_to_install() {
    let folder = Folder::new();
    let output = probe(&folder, &artefact(160.0));
    assert_eq!(output.status.code(), Some(2));
    let said = said(&output);
    has(&said, "python3: ");
    has(&said, "help: install");
    // The log was begun, and has no touch.
    let log = std::fs::read_to_string(folder.at("touches.csv")).unwrap();
    assert_eq!(log, "row,ball,touch,Y,X,A,C,Z,time_s\n");
}

#[test]
fn a_log_of_something_else_is_left_alone() {
    let folder = Folder::new();
    let log = "X,Y,Z\n1,2,3\n";
    folder.file("touches.csv", log);
    let output = probe(&folder, &artefact(160.0));
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("is no log of this plan"),
        "{}",
        said(&output)
    );
    assert_eq!(
        std::fs::read_to_string(folder.at("touches.csv")).unwrap(),
        log
    );
}

#[test]
fn balls_in_each_others_way_are_named_before_anything_moves() {
    let folder = Folder::new();
    let output = probe(&folder, &artefact(240.0));
    assert_eq!(output.status.code(), Some(2));
    let said = said(&output);
    has(&said, "would pass ball");
    assert!(!std::path::Path::new(&folder.at("touches.csv")).exists());
}
