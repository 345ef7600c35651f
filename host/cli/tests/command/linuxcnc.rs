//! The commands of `trueaxis linuxcnc` on the simulated machines, intact and with faults.

mod check;
mod compensated;
mod component;
mod connected;
mod read;
mod setup;

use crate::program::{Folder, blob, has, plain, trueaxis};
use serde_json::Value;
use std::path::Path;

const FILES: [&str; 4] = ["machine.hal", "trueaxis.hal", "model.hal", "demo.ngc"];

/// A simulated machine in its own folder.
struct Simulated {
    folder: Folder,
    name: &'static str,
}

fn configs() -> String {
    format!(
        "{}/../../firmware/linuxcnc/configs",
        env!("CARGO_MANIFEST_DIR")
    )
}

/// Without the panel, whose pins belong to a screen.
fn simulated(name: &'static str) -> Simulated {
    let folder = Folder::new();
    let from = Path::new(&configs()).join(name);
    for file in FILES {
        std::fs::copy(from.join(file), folder.at(file)).unwrap();
    }
    let ini = std::fs::read_to_string(from.join(format!("{name}.ini"))).unwrap();
    let without = ini.replace("POSTGUI_HALFILE = ../panel.hal\n", "");
    assert_ne!(ini, without);
    folder.file("machine.ini", without);
    std::fs::copy(blob(name), folder.at(&format!("{name}.trax"))).unwrap();
    Simulated { folder, name }
}

impl Simulated {
    fn at(&self, file: &str) -> String {
        self.folder.at(file)
    }
    fn text(&self, file: &str) -> String {
        std::fs::read_to_string(self.at(file)).unwrap()
    }
    /// Replaces the first `from` in a file by `to`.
    fn change(&self, file: &str, from: &str, to: &str) {
        let text = self.text(file);
        assert!(text.contains(from), "{file} has no {from}");
        self.folder.file(file, text.replacen(from, to, 1));
    }
    fn arguments(&self) -> [String; 5] {
        let trax = format!("{}.trax", self.name);
        let ini = self.at("machine.ini");
        [
            "linuxcnc".into(),
            "check".into(),
            ini,
            self.at(&trax),
            "--json".into(),
        ]
    }
    /// The findings of `check`. Checks that it exits with 1 if something is refused, otherwise with 0.
    fn findings(&self, more: &[&str]) -> Vec<Value> {
        let arguments = self.arguments();
        let mut arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        arguments.extend(more);
        let output = trueaxis(&arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let found: Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{said}"));
        let code = i32::from(found["refused"] != 0);
        assert_eq!(output.status.code(), Some(code), "{said}");
        found["findings"].as_array().unwrap().clone()
    }
    /// The line of a finding.
    fn line(&self, finding: &Value) -> String {
        let text = std::fs::read_to_string(finding["file"].as_str().unwrap()).unwrap();
        let line = usize::try_from(finding["line"].as_u64().unwrap()).unwrap();
        text.lines().nth(line - 1).unwrap_or("").to_owned()
    }
    /// Checks that there is this finding: `severity | part of the line | part of the reason | part of the proposal`.
    #[track_caller]
    fn finds(&self, more: &[&str], finding: &str) {
        let parts: Vec<&str> = finding.split(" | ").collect();
        let [severity, line, reason, write] = parts[..] else {
            panic!("{finding}");
        };
        let found = self.findings(more);
        let is = |f: &Value| {
            let text = |key: &str| f[key].as_str().unwrap().to_owned();
            text("severity") == severity
                && text("reason").contains(reason)
                && text("write").contains(write)
                && self.line(f).contains(line)
        };
        assert!(found.iter().any(is), "{finding} is not among\n{found:#?}");
    }
}

/// Changes one thing, and checks the finding.
#[track_caller]
fn spoilt(name: &'static str, change: [&str; 3], finding: &str) {
    let machine = simulated(name);
    let [file, from, to] = change;
    machine.change(file, from, to);
    machine.finds(&[], finding);
}

/// Drives that are where they are sent.
pub fn loops(joints: usize) -> String {
    let lines = (0..joints)
        .map(|n| format!("net j{n} joint.{n}.motor-pos-cmd => joint.{n}.motor-pos-fb\n"));
    lines.collect()
}

/// A mill with the axes of `coordinates`; `change` replaces text of its INI file.
fn plain_mill(coordinates: &str, change: &[[&str; 2]]) -> Folder {
    let folder = Folder::new();
    folder.file("mill.hal", loops(coordinates.len()));
    let joints = coordinates.len();
    let mut text = format!(
        "[EMC]\nVERSION = 1.1\n[DISPLAY]\nDISPLAY = axis\n[HAL]\nHALFILE = mill.hal\n[TRAJ]\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\n\
         [KINS]\nKINEMATICS = trivkins coordinates={coordinates}\nJOINTS = {joints}\n"
    );
    for (n, letter) in coordinates.chars().enumerate() {
        let kind = if "ABC".contains(letter) {
            "ANGULAR"
        } else {
            "LINEAR"
        };
        text += &format!(
            "[AXIS_{letter}]\nMIN_LIMIT = -150\nMAX_LIMIT = 150\n[JOINT_{n}]\nTYPE = {kind}\nMIN_LIMIT = -150\nMAX_LIMIT = 150\n\
             MAX_VELOCITY = 50\nMAX_ACCELERATION = 400\nSTEPGEN_MAXVEL = 65\nSTEPGEN_MAXACCEL = 600\n"
        );
    }
    for [from, to] in change {
        has(&text, from);
        text = text.replacen(from, to, 1);
    }
    folder.file("mill.ini", text);
    folder
}

/// Runs `setup`; returns its exit code and what it says.
fn set_up(folder: &Folder, more: &[&str]) -> (Option<i32>, String) {
    let (ini, to) = (folder.at("mill.ini"), folder.at("to"));
    let done = trueaxis(&[&["linuxcnc", "setup", &ini, "-o", &to], more].concat());
    let said = plain(&done.stdout) + &plain(&done.stderr);
    (done.status.code(), said)
}
