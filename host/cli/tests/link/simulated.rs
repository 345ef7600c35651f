//! `trueaxis simulate controller`, as a user runs it.

use crate::command::{Files, has, says};
use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};

/// The running command.
struct Simulated {
    child: Child,
    out: BufReader<ChildStdout>,
}

impl Simulated {
    fn start(arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_trueaxis"));
        command
            .args(["simulate", "controller"])
            .args(arguments)
            .stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Self { child, out }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.out.read_line(&mut line).unwrap();
        line
    }

    /// Port, as its first line says it.
    fn port(&mut self) -> String {
        let line = self.line();
        let (port, _) = line.split_once(": a controller waits").unwrap();
        port.to_owned()
    }
}

impl Drop for Simulated {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_error_of_the_machine_behind_it_falls_when_corrections_are_switched_on() {
    let folder = tempfile::tempdir().unwrap();
    let blob = folder.path().join("machine.trax");
    let example = |name: &str| {
        format!(
            "{}/../../examples/kolibri/{name}",
            env!("CARGO_MANIFEST_DIR")
        )
    };
    let (machine, errors) = (example("machine.toml"), example("errors-12.toml"));
    let blob = blob.to_str().unwrap();
    says(0, &format!("compile {machine} {errors} -o {blob}"));
    let mut simulated = Simulated::start(&[
        "--port",
        "tcp:127.0.0.1:0",
        "--machine",
        &machine,
        "--errors",
        &errors,
    ]);
    let port = simulated.port();
    assert!(simulated.line().contains("without corrections"));
    says(0, &format!("flash {blob} --port {port} --activate"));
    says(0, &format!("control --port {port} enable"));
    // The first of its lines that has corrections all the time is the second with them.
    let on = |simulated: &mut Simulated| loop {
        let line = simulated.line();
        if line.trim_end().ends_with("on") {
            return line;
        }
    };
    on(&mut simulated);
    let line = on(&mut simulated);
    let figures: Vec<f64> = line
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    let [_, with, without] = figures[..] else {
        panic!("{line}");
    };
    // What the tables leave (their tolerance), and what the path of 5 s has.
    assert!(with < 10.0 && without > 100.0, "{line}");
}

#[test]
fn ports_that_others_would_reach_or_that_are_files_are_refused() {
    let files = Files::new();
    for (port, why) in [
        ("tcp:0.0.0.0:0", "would be reached from other computers"),
        ("tcp:4444", "give tcp:127.0.0.1:PORT"),
        (&files.at("first"), "there is a file of this name"),
        ("no/such/folder", "No such file or directory"),
    ] {
        let said = says(2, &format!("simulate controller --port {port}"));
        has(&said, why);
    }
    // And the file is still there.
    assert!(std::path::Path::new(&files.at("first")).is_file());
}

#[test]
fn a_name_is_a_serial_line_that_can_be_opened_again() {
    let files = Files::new();
    let name = files.at("board");
    // The second start finds what the first has left.
    for _ in 0..2 {
        let mut simulated = Simulated::start(&["--port", &name]);
        assert_eq!(simulated.port(), name);
        has(
            &files.flash(0, "first", &name, "--activate"),
            "number 1 in use",
        );
        says(0, &format!("control --port {name} reference all"));
        let said = says(0, &format!("control --port {name} enable"));
        has(&said, "-> enabled");
    }
}
