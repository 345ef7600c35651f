//! Programs of five axes, for the machine of LinuxCNC's `xyzac-trt-kins`.

use super::{with_files, written};
use crate::program::{Folder, answer, blob, example};
use trueaxis::AlignedBlob;
use trueaxis_gcode::program::{Event, Program};
use trueaxis_gcode::{Rules, Setup, Tables, Tip};
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;

/// Where the machine stands, and which way its axes came.
pub const START: &str = "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -20\nA = 0\nC = 0\n\
travel = { X = \"+\", Y = \"+\", Z = \"+\", A = \"+\", C = \"+\" }\n";

/// Corrects and checks a program: what is written, and what is said of it.
pub fn run(program: &str, setup: &str, options: &[&str]) -> (String, serde_json::Value) {
    let folder = Folder::new();
    let options = [options, &["--check", "--json"]].concat();
    let files = [&blob("xyzac-trt"), &*format!("{START}{setup}")];
    let said = with_files(&folder, program, files, &options, |words| answer(0, words));
    (written(&folder), serde_json::from_str(&said).unwrap())
}

#[test]
fn tool_centre_point_programs_stay_what_they_are() {
    let program = "G21 G90\nM428\nG0 X30 Y0 Z20 A0 C0\nG93\nG1 A-30 C40 F20\nG1 X20 Y10 A-60 C90 F6\nG94\nG1 X10 F500\nM429\nM30\n";
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    let errors = example("linuxcnc-xyzac-trt/errors-11.toml");
    let (text, said) = run(
        program,
        "[offset.G54]\nX = 200\nY = 150\nZ = -180\n",
        &["--machine", &machine, "--errors", &errors],
    );
    let path = &said["check"]["tool_path"];
    assert!(path["before_um"]["max"].as_f64().unwrap() > 20.0, "{said}");
    assert!(path["after_um"]["max"].as_f64().unwrap() < 0.7, "{said}");
    assert_eq!(said["check"]["times_differ"], 0, "{said}");
    assert!(text.contains("\nM428\n") && text.contains("\nM429\n"));
}

#[test]
fn traori_is_m428() {
    let program = "G21 G90 G17\nG0 X230 Y150 Z-160 A0 C0\nTRAORI\nG1 X235 A-3 C4 F20\ntrafoof\nG0 Z-100\nM30\n";
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    // Their first lines name different originals.
    let with = |program: &str| {
        let (text, _) = run(program, "[offset.G54]\n", &["--machine", &machine]);
        text.split_once('\n').unwrap().1.to_owned()
    };
    let (text, other) = (
        with(program),
        with(&program.replace("TRAORI", "M428").replace("trafoof", "M429")),
    );
    assert!(
        text.contains("\nTRAORI\n") && text.contains("\ntrafoof\n"),
        "{text}"
    );
    assert_eq!(
        text.replace("TRAORI", "M428").replace("trafoof", "M429"),
        other
    );
}

#[test]
fn a_purely_rotary_move_does_not_rush() {
    let program = "G21 G90\nG0 X200 Y150 Z-21 A1 C1\nG1 A2 C1.5 F360\nG1 X201 F360\nM30\n";
    let (text, said) = run(program, "[offset.G54]\n", &[]);
    assert_eq!(said["check"]["times_differ"], 0, "{said}");
    let feed = |line: &str| -> Option<f64> {
        let word = line.split_whitespace().find(|w| w.starts_with('F'))?;
        word[1..].parse().ok()
    };
    let moves: Vec<&str> = text.lines().skip_while(|l| !l.starts_with("G1 ")).collect();
    // The correction has moved X back by more than its reversal threshold: a step takes its lost motion up before the last.
    let (turning, last) = moves.split_at(moves.len() - 3);
    // A few µm in the time of 1.1 degrees at 360 degrees per minute; where no linear axis moves, degrees count.
    let along = turning.iter().filter(|line| line.contains(['X', 'Y', 'Z']));
    let feeds: Vec<f64> = along.filter_map(|line| feed(line)).collect();
    assert!(
        !feeds.is_empty() && feeds.iter().all(|feed| *feed < 5.0),
        "{text}"
    );
    assert_eq!(feed(last[0]), Some(360.0));
}

#[test]
fn the_length_of_g43_moves_the_axes_that_turn_the_part_about_the_tip() {
    let bytes = std::fs::read(blob("xyzac-trt")).unwrap();
    let blob = AlignedBlob::from_bytes(&bytes);
    let runtime = Runtime::load(&blob).unwrap();
    let tables = Tables::new(runtime.compensation()).unwrap();
    let text = std::fs::read_to_string(example("linuxcnc-xyzac-trt/machine.toml")).unwrap();
    let machine = Machine::from_toml(&text).unwrap();
    let tip = Tip::new(&machine).unwrap();
    // Axis positions with the tip at the same place of the part.
    let axes = |length: f64| {
        let setup = format!(
            "{START}[offset.G54]\nX = 200\nY = 150\nZ = -280\n[tool.1]\nlength = {length}\n"
        );
        let rules = Rules {
            axes: tables.axes,
            setup: Setup::from_toml(&setup).unwrap(),
            has_machine: true,
            ..Rules::default()
        };
        let program = "G21 G90\nG43 H1\nM428\nG0 X30 Y5 Z20 A-60 C40\nM429\n";
        let mut program = Program::new(program.as_bytes(), &rules, &tables, Some(&tip));
        let mut last = None;
        while let Some(event) = program.next_event().unwrap() {
            if let Event::Jumped(position) = event {
                last = Some(position.at);
            }
        }
        last.unwrap()
    };
    let (own, longer) = (axes(100.0), axes(140.0));
    for (axis, (own, longer)) in own.iter().zip(longer).enumerate() {
        // The spindle does not turn: a longer tool is farther along Z, and nothing else.
        let by = if axis == 2 { 40.0 } else { 0.0 };
        assert!((longer - own - by).abs() < 1e-9, "{axis}: {own} {longer}");
    }
}
