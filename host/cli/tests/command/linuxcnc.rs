//! The commands of `trueaxis linuxcnc` on the simulated machines, intact and with faults.

use crate::program::{Folder, answer, blob, done, example, has, plain, refused, says, trueaxis};
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

#[test]
fn both_simulated_machines_pass() {
    for (name, machine) in [
        ("mill-21", "mill-21/machine.toml"),
        ("xyzac-trt", "linuxcnc-xyzac-trt/machine.toml"),
    ] {
        let found = simulated(name).findings(&["--machine", &example(machine)]);
        assert!(found.is_empty(), "{found:#?}");
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

#[test]
fn joints_that_are_compensated_twice_are_found() {
    let first = "[JOINT_0]\n";
    spoilt(
        "mill-21",
        ["machine.ini", first, "[JOINT_0]\nCOMP_FILE = x.comp\n"],
        "refused | COMP_FILE | compensated twice: by COMP_FILE | # COMP_FILE = x.comp",
    );
    // X of the five-axis machine has tables for each direction of travel, X of the mill has not.
    spoilt(
        "xyzac-trt",
        ["machine.ini", first, "[JOINT_0]\nBACKLASH = 0.01\n"],
        "refused | BACKLASH | compensated twice: by BACKLASH | BACKLASH = 0",
    );
    spoilt(
        "mill-21",
        ["machine.ini", first, "[JOINT_0]\nBACKLASH = 0.01\n"],
        "warning | BACKLASH | stays with LinuxCNC | EXXb in the error file",
    );
    let machine = simulated("xyzac-trt");
    machine.change(
        "machine.ini",
        first,
        "[JOINT_0]\nBACKLASH = 0.0\nCOMP_FILE =\n",
    );
    assert!(machine.findings(&[]).is_empty());
}

#[test]
fn limits_outside_the_compensation_or_too_close_to_its_ends_are_found() {
    // Limits of the axes, which come before, count as well: here there are none.
    let of_joints = |text: &str| {
        let (before, joints) = text.split_once("[JOINT_0]").unwrap();
        let before = before.lines().filter(|line| !line.contains("_LIMIT = "));
        let before: String = before.map(|line| format!("{line}\n")).collect();
        format!("{before}[JOINT_0]{joints}")
    };
    for (joint, from, to, finding) in [
        (
            "[JOINT_0]",
            "MIN_LIMIT = 0.5",
            "MIN_LIMIT = -1",
            "refused | MIN_LIMIT | outside the travel | MIN_LIMIT = 0.05",
        ),
        (
            "[JOINT_0]",
            "MAX_LIMIT = 499.5",
            "MAX_LIMIT = 501",
            "refused | MAX_LIMIT | which ends at 500 | MAX_LIMIT = 499.94",
        ),
        (
            "[JOINT_2]",
            "MAX_LIMIT = -0.5",
            "MAX_LIMIT = -0.01",
            "warning | MAX_LIMIT | less than the largest correction | MAX_LIMIT = -0.03",
        ),
        (
            "[JOINT_1]",
            "MIN_LIMIT = 0.5\n",
            "",
            "refused | [JOINT_1] | MIN_LIMIT of joint 1 is missing | MIN_LIMIT = 0.05",
        ),
        (
            "[JOINT_1]",
            "TYPE = LINEAR",
            "TYPE = ANGULAR",
            "refused | TYPE | which is not ANGULAR | TYPE = LINEAR",
        ),
    ] {
        let machine = simulated("mill-21");
        let text = of_joints(&machine.text("machine.ini"));
        let (before, after) = text.split_once(joint).unwrap();
        assert!(after.contains(from));
        machine.folder.file(
            "machine.ini",
            [before, joint, &after.replacen(from, to, 1)].concat(),
        );
        machine.finds(&[], finding);
        // The proposed value passes.
        let write = machine.findings(&[])[0]["write"]
            .as_str()
            .unwrap()
            .to_owned();
        if !to.is_empty() {
            machine.folder.file(
                "machine.ini",
                [before, joint, &after.replacen(from, &write, 1)].concat(),
            );
            assert!(machine.findings(&[]).is_empty(), "{write}");
        }
    }
}

#[test]
fn a_limit_that_is_no_number_is_found() {
    spoilt(
        "mill-21",
        ["machine.ini", "MIN_LIMIT = -399.5", "MIN_LIMIT = none"],
        "refused | MIN_LIMIT | MIN_LIMIT is `none`, no number | MIN_LIMIT = a number",
    );
}

#[test]
fn limits_in_inches_are_inches() {
    let machine = simulated("mill-21");
    machine.change("machine.ini", "LINEAR_UNITS = mm", "LINEAR_UNITS = inch");
    machine.finds(
        &[],
        "refused | MAX_LIMIT | ends at 19.685 | MAX_LIMIT = 19.68",
    );
}

#[test]
fn step_generators_without_headroom_are_found() {
    for (line, finding) in [
        (
            "STEPGEN_MAXVEL = 100",
            "need 100.6 | STEPGEN_MAXVEL = 100.6",
        ),
        (
            "STEPGEN_MAXACCEL = 1000",
            "need 1006 | STEPGEN_MAXACCEL = 1006",
        ),
        (
            "STEPGEN_MAXVEL = fast",
            "no number | STEPGEN_MAXVEL = a number",
        ),
    ] {
        let joint = format!("[JOINT_0]\n{line}\n");
        spoilt(
            "mill-21",
            ["machine.ini", "[JOINT_0]\n", &joint],
            &format!("refused | {line} | {finding}"),
        );
    }
    let machine = simulated("mill-21");
    machine.change(
        "machine.ini",
        "[JOINT_0]\n",
        "[JOINT_0]\nSTEPGEN_MAXVEL = 101\nSTEPGEN_MAXACCEL = 1010\n",
    );
    assert!(machine.findings(&[]).is_empty());
    let machine = simulated("mill-21");
    let text = machine
        .text("machine.ini")
        .replace("MAX_VELOCITY = 100", "MAX_VELOCITY = 600");
    machine.folder.file("machine.ini", text);
    machine.finds(
        &["--machine", &example("mill-21/machine.toml")],
        "warning | MAX_VELOCITY = 600 | was made for 500 | max_speed = 600.0",
    );
}

#[test]
fn functions_in_the_wrong_order_are_found() {
    for (from, to, finding) in [
        (
            "addf trueaxis.read  servo-thread 1",
            "addf trueaxis.read servo-thread -1",
            "refused | addf trueaxis.read | before motion-controller | addf trueaxis.read servo-thread 1",
        ),
        (
            "addf trueaxis.write servo-thread 4",
            "addf trueaxis.write servo-thread 1",
            "refused | addf trueaxis.write | after motion-controller | addf trueaxis.write servo-thread 4",
        ),
        (
            "addf trueaxis.write servo-thread 4",
            "",
            "refused | loadrt trueaxis | is not in servo-thread | addf trueaxis.write servo-thread 4",
        ),
        (
            "addf trueaxis.read  servo-thread 1",
            "addf trueaxis.read base-thread",
            "refused | base-thread | is not in servo-thread | addf trueaxis.read servo-thread 1",
        ),
        (
            "addf trueaxis.read  servo-thread 1",
            "addf trueaxis.read servo-thread 1\naddf hm2.0.read servo-thread 2",
            "warning | hm2.0.read | feedback of the last period | addf hm2.0.read servo-thread 1",
        ),
        (
            "addf trueaxis.read  servo-thread 1",
            "addf trueaxis.read servo-thread 1\naddf stepgen.update-freq servo-thread 2",
            "warning | stepgen.update-freq | commands of the last period | addf stepgen.update-freq servo-thread -1",
        ),
    ] {
        // The second position changes if a line is added or removed.
        let machine = simulated("mill-21");
        machine.change("trueaxis.hal", from, to);
        let text = machine.text("trueaxis.hal");
        machine.folder.file(
            "trueaxis.hal",
            text.replace(
                "trueaxis.write servo-thread 4",
                "trueaxis.write servo-thread -1",
            ),
        );
        machine.finds(&[], finding);
    }
}

#[test]
fn joints_and_axes_that_do_not_match_are_found() {
    let load = "axes=XYZ units=[TRAJ]LINEAR_UNITS";
    for (to, finding) in [
        ("axes=XY units=mm", "no joint for the axis Z | axes=XYZ"),
        (
            "axes=YXZ units=mm",
            "joint 0 has the axis Y in axes=YXZ, but X in trivkins | axes=XYZ",
        ),
        (
            "axes=XYZA units=mm",
            "joint 3 has the axis A in axes=XYZA, which the compensation does not have | with - for this joint",
        ),
        (
            "axes=XYZZ units=mm",
            "names more joints than [KINS]JOINTS, 3 | axes=XYZ",
        ),
        (
            "axes=XYZ units=inch",
            "units= is not what [TRAJ]LINEAR_UNITS says | units=[TRAJ]LINEAR_UNITS",
        ),
        ("axes=XYZ", "units= is not what | units=[TRAJ]LINEAR_UNITS"),
    ] {
        let finding = format!("refused | loadrt trueaxis | {finding}");
        spoilt("mill-21", ["trueaxis.hal", load, to], &finding);
    }
    spoilt(
        "mill-21",
        ["trueaxis.hal", "file=mill-21.trax", "file=machine.ini"],
        "warning | loadrt | another file than the one that is checked | file=",
    );
    spoilt(
        "xyzac-trt",
        [
            "machine.ini",
            "ANGULAR_UNITS = degree",
            "ANGULAR_UNITS = radian",
        ],
        "refused | ANGULAR_UNITS | rotary joints are in radian | ANGULAR_UNITS = degree",
    );
}

#[test]
fn letters_of_joints_are_those_that_hal_loads() {
    let machine = simulated("mill-21");
    let load = "loadrt [KINS]KINEMATICS";
    machine.change("machine.hal", load, "loadrt trivkins coordinates=xyz");
    assert_eq!(machine.findings(&[]), [] as [Value; 0]);
    // A gantry of which the component knows one joint.
    machine.change("machine.hal", "coordinates=xyz", "coordinates=XYYZ");
    machine.change("machine.ini", "JOINTS = 3", "JOINTS = 4");
    let expected = "joint 2 has the axis Z in axes=XYZ, but Y in trivkins";
    machine.finds(&[], &format!("refused | loadrt | {expected} | axes=XYYZ"));
    // The module differs from the one in the INI file.
    machine.change("machine.hal", "trivkins coordinates=XYYZ", "xyzac-trt-kins");
    let expected = "xyzac-trt-kins is for rotary axes AC";
    machine.finds(
        &[],
        &format!("refused | xyzac-trt-kins | {expected} | KINEMATICS ="),
    );
}

#[test]
fn pins_that_are_linked_one_to_one_are_connected() {
    let machine = simulated("mill-21");
    for (pin, of) in [
        ("homed", "homed"),
        ("homing", "homing"),
        ("pos-in", "pos-cmd"),
    ] {
        let net = format!("net trueaxis-0-{of} joint.0.{of} => trueaxis.joint.0.{pin}\n");
        let link = format!("linkpp joint.0.{of} trueaxis.joint.0.{pin}\n");
        machine.change("trueaxis.hal", &net, &link);
    }
    // The model also reads the position.
    machine.change("model.hal", "net trueaxis-0-pos-cmd", "net joint.0.pos-cmd");
    assert_eq!(machine.findings(&[]), [] as [Value; 0]);
}

#[test]
fn weights_without_pins_and_pins_without_weights_are_found() {
    let load = "axes=XYZ units=[TRAJ]LINEAR_UNITS";
    spoilt(
        "mill-21",
        ["trueaxis.hal", load, &format!("{load} weights=2")],
        "warning | loadrt | weights=2 makes pins without effect: the compensation has 0 adjustable terms | weights=0",
    );
    // A compensation with two adjustable terms, for another machine; other findings do not matter here.
    let machine = simulated("mill-21");
    let golden = format!(
        "{}/../../tests/golden/v1/everything.trax",
        env!("CARGO_MANIFEST_DIR")
    );
    std::fs::copy(golden, machine.at("mill-21.trax")).unwrap();
    machine.finds(
        &[],
        "warning | loadrt | has 2 adjustable terms, and weights= is not given: they keep the weights of the file | weights=2",
    );
    machine.change("trueaxis.hal", load, &format!("{load} weights=1"));
    machine.finds(
        &[],
        "warning | loadrt | 2 adjustable terms, the component 1 pins | weights=2",
    );
    machine.change("trueaxis.hal", "weights=1", "weights=few");
    machine.finds(
        &[],
        "refused | loadrt | weights= is not a number | weights=2",
    );
    machine.change("trueaxis.hal", "weights=few", "weights=2");
    let found = machine.findings(&[]);
    let of_weights = |f: &&Value| f["reason"].as_str().unwrap().contains("weights");
    assert_eq!(found.iter().find(of_weights), None);
}

#[test]
fn a_machine_without_the_component_is_told_how_to_load_it() {
    let machine = simulated("mill-21");
    machine.change("machine.ini", "HALFILE = trueaxis.hal\n", "");
    machine.change("machine.ini", "HALFILE = model.hal\n", "");
    machine.finds(
        &[],
        "refused | [HAL] | is not loaded | loadrt trueaxis file=FILE.trax axes=XYZ units=[TRAJ]LINEAR_UNITS",
    );
    // A program may do all of this.
    machine.change(
        "machine.ini",
        "HALFILE = machine.hal",
        "HALFILE = machine.hal\nHALFILE = LIB:basic_sim.tcl",
    );
    machine.finds(
        &[],
        "refused | basic_sim.tcl | is a program | machine_cmds.hal",
    );
}

#[test]
fn kinematics_that_are_not_those_of_the_machine_are_found() {
    let trt = example("linuxcnc-xyzac-trt/machine.toml");
    for (file, from, to, finding) in [
        (
            "machine.hal",
            "y-rot-point 150",
            "y-rot-point 149",
            "refused | y-rot-point | puts the axis C at y = 149 mm, the machine file at 150 mm | setp xyzac-trt-kins.y-rot-point 150",
        ),
        (
            "machine.hal",
            "z-offset 40",
            "z-offset 41",
            "refused | z-offset | puts the axis A at z = -279 mm | setp xyzac-trt-kins.z-offset 40",
        ),
        (
            "machine.ini",
            "KINEMATICS = xyzac-trt-kins",
            "KINEMATICS = xyzbc-trt-kins",
            "refused | KINEMATICS | is for rotary axes BC, the compensation has AC | KINEMATICS",
        ),
        (
            "machine.ini",
            "KINEMATICS = xyzac-trt-kins",
            "KINEMATICS = 5axiskins",
            "refused | KINEMATICS | is for rotary axes BC | KINEMATICS",
        ),
    ] {
        let machine = simulated("xyzac-trt");
        machine.change(file, from, to);
        machine.finds(&["--machine", &trt], finding);
    }
    // A pin that is connected elsewhere is not a mistake.
    let machine = simulated("xyzac-trt");
    machine.change(
        "machine.hal",
        "setp xyzac-trt-kins.y-offset -5",
        "net pivot probe.y => xyzac-trt-kins.y-offset",
    );
    assert!(machine.findings(&["--machine", &trt]).is_empty());
    // A machine file that does not belong to the compensation.
    let machine = simulated("xyzac-trt");
    let text = std::fs::read_to_string(&trt).unwrap();
    let swap = text
        .replace("topology", "#")
        .replace("name = \"A\"", "name = \"?\"")
        .replace("name = \"C\"", "name = \"A\"")
        .replace("name = \"?\"", "name = \"C\"");
    let path = machine.folder.file("other.toml", swap);
    machine.finds(
        &["--machine", &path],
        "refused | KINEMATICS | the machine file describes `xyzac-trt` with axes YXCAZ | --machine",
    );
    spoilt(
        "mill-21",
        [
            "machine.ini",
            "KINEMATICS = trivkins",
            "KINEMATICS = corexykins",
        ],
        "refused | KINEMATICS | under corexykins joints need not be axes | trueaxis gcode",
    );
    let mill = example("mill-21/machine.toml");
    simulated("xyzac-trt").finds(
        &["--machine", &mill],
        "refused | KINEMATICS | made for the machine `xyzac-trt` | --machine",
    );
}

#[test]
fn a_head_under_kinematics_for_a_table_is_found() {
    // The same letters, with C and A at the tool.
    let machine = simulated("xyzac-trt");
    let toml = std::fs::read_to_string(example("linuxcnc-xyzac-trt/machine.toml")).unwrap();
    // After the comments: Y, X, A, C, then Z with spindle and tool.
    let parts: Vec<&str> = toml.split("[[axis]]\n").collect();
    let (z, rest) = parts[5].split_once("\n\n").unwrap();
    let [a, c] = [3, 4].map(|k| parts[k].replace("\"workpiece\"", "\"tool\""));
    let axes = [parts[1], parts[2], z, &a, &c].join("\n[[axis]]\n");
    let toml = format!("name = \"xyzac-trt\"\n[[axis]]\n{axes}\n{rest}");
    let path = machine.folder.file("head.toml", toml);
    let errors = machine.folder.file(
        "errors.toml",
        "machine = \"xyzac-trt\"\n[parameters]\nEXX1 = 1e-5\n",
    );
    let out = machine.at("xyzac-trt.trax");
    done(&format!("compile {path} {errors} -o {out} --random 100"));
    machine.finds(
        &["--machine", &path],
        "refused | KINEMATICS | is for a table with A carrying C, and no rotary axis at the tool, but the machine is wXYFZACSt | KINEMATICS",
    );
}

#[test]
fn connections_that_are_missing_or_wrong_are_found() {
    for (from, to, finding) in [
        (
            "net trueaxis-0-pos-cmd joint.0.pos-cmd => trueaxis.joint.0.pos-in\n",
            "",
            "refused | loadrt trueaxis | trueaxis.joint.0.pos-in is not connected to joint.0.pos-cmd | net trueaxis-0-pos-cmd joint.0.pos-cmd => trueaxis.joint.0.pos-in",
        ),
        (
            "joint.0.motor-pos-cmd => trueaxis.joint.0.motor-cmd-in",
            "joint.0.motor-pos-cmd => trueaxis.joint.0.motor-cmd-in\nunlinkp trueaxis.joint.0.pos-in\nnet trueaxis-0-cmd trueaxis.joint.0.pos-in",
            "refused | trueaxis-0-cmd | which contains backlash and homing offset | unlinkp trueaxis.joint.0.pos-in",
        ),
        (
            "net trueaxis-1-homed joint.1.homed => trueaxis.joint.1.homed\n",
            "",
            "refused | loadrt trueaxis | trueaxis.joint.1.homed is not connected | net trueaxis-1-homed joint.1.homed => trueaxis.joint.1.homed",
        ),
        (
            "net trueaxis-2-fb trueaxis.joint.2.motor-fb-out => joint.2.motor-pos-fb\n",
            "",
            "refused | loadrt trueaxis | motor-fb-out is not connected | net trueaxis-2-fb trueaxis.joint.2.motor-fb-out => joint.2.motor-pos-fb",
        ),
        (
            "joint.0.motor-pos-cmd => trueaxis.joint.0.motor-cmd-in",
            "joint.0.motor-pos-cmd => trueaxis.joint.0.motor-cmd-in stepgen.0.position-cmd",
            "warning | stepgen.0 | without its correction | trueaxis.joint.0.motor-cmd-out => stepgen.0.position-cmd",
        ),
        (
            "setp trueaxis.enable 0",
            "",
            "warning | loadrt trueaxis | nothing ever enables | from a switch",
        ),
    ] {
        spoilt("mill-21", ["trueaxis.hal", from, to], finding);
    }
    // Only the component on the drive's signal.
    let machine = simulated("mill-21");
    for line in [
        "net x-drive => trueaxis.joint.0.motor-fb-in\n",
        "net x-drive <= trueaxis.joint.0.motor-cmd-out\n",
    ] {
        machine.change("trueaxis.hal", line, "");
    }
    machine.change("model.hal", "net x-drive", "net other");
    machine.finds(
        &[],
        "refused | loadrt | motor-cmd-out is not connected to the drive | (the drive)",
    );
    machine.finds(
        &[],
        "refused | loadrt | motor-fb-in is not connected | (the drive)",
    );
}

#[test]
fn inputs_that_a_correction_depends_on_are_asked_for() {
    let machine = simulated("mill-21");
    let toml = std::fs::read_to_string(example("mill-21/machine.toml")).unwrap()
        + "length_range_mm = [50.0, 150.0]\n";
    let toml = machine.folder.file("machine.toml", toml);
    let errors = "machine = \"Mill with 21 errors\"\n[parameters]\nEXX1 = 1e-5\nEB0Z = 5e-5\n\n[thermal]\nEXX1 = { per_kelvin = 1e-6, sensor = \"bed\", reference_celsius = 20.0 }\n";
    let errors = machine.folder.file("errors.toml", errors);
    let out = machine.at("mill-21.trax");
    done(&format!("compile {toml} {errors} -o {out} --random 100"));
    machine.change(
        "trueaxis.hal",
        "net trueaxis-tool-length motion.tooloffset.z => trueaxis.tool-length\n",
        "",
    );
    machine.finds(
        &[],
        "refused | loadrt | `tool length`, and trueaxis.tool-length is not connected | motion.tooloffset.z",
    );
    machine.finds(
        &[],
        "refused | loadrt | `bed`, and trueaxis.temperature-0 | trueaxis.temperature-0",
    );
    machine.finds(
        &[],
        "refused | loadrt | 1 temperatures, the component fewer pins | temperatures=1",
    );
}

#[test]
fn what_cannot_be_read_is_named_with_its_line() {
    for (file, from, to, parts) in [
        (
            "machine.ini",
            "HALFILE = machine.hal",
            "HALFILE = other.hal",
            ["machine.ini, line", "`other.hal` cannot be read"],
        ),
        (
            "machine.ini",
            "JOINTS = 3",
            "JOINTS = many",
            ["machine.ini, line", "`many` is not a number of joints"],
        ),
        (
            "machine.ini",
            "JOINTS = 3",
            "",
            ["machine.ini, line", "no [KINS]JOINTS"],
        ),
        (
            "machine.ini",
            "LINEAR_UNITS = mm",
            "",
            [
                "trueaxis.hal, line",
                "the INI file has no [TRAJ]LINEAR_UNITS",
            ],
        ),
        (
            "machine.ini",
            "[KINS]",
            "#INCLUDE machine.ini\n[KINS]",
            ["machine.ini, line", "include each other"],
        ),
        (
            "machine.ini",
            "[KINS]",
            "[KINS",
            ["machine.ini, line", "without its closing bracket"],
        ),
        (
            "machine.hal",
            "loadrt",
            "source machine.hal\nloadrt",
            ["machine.hal, line 2", "source each other"],
        ),
        (
            "trueaxis.hal",
            "servo-thread 1",
            "servo-thread 7",
            ["trueaxis.hal, line", "`7` is not a place in servo-thread"],
        ),
    ] {
        let machine = simulated("mill-21");
        machine.change(file, from, to);
        let arguments = machine.arguments();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        refused(&arguments, &parts);
        refused(
            &[
                "linuxcnc",
                "setup",
                arguments[2],
                "-o",
                machine.folder.path().to_str().unwrap(),
                "--overwrite",
            ],
            &parts,
        );
    }
}

#[test]
fn no_cut_and_no_rubbish_makes_it_panic() {
    let machine = simulated("mill-21");
    let arguments = machine.arguments();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    for file in ["machine.ini", "trueaxis.hal", "mill-21.trax"] {
        let whole = std::fs::read(machine.at(file)).unwrap();
        let mut rubbish = vec![
            whole.iter().map(|b| b ^ 0x80).collect(),
            vec![0; 5000],
            b"[[[]]=]\n[=\n\\\n\\".to_vec(),
        ];
        let cuts = (0..whole.len()).step_by(whole.len() / 12);
        rubbish.extend(cuts.map(|cut| whole[..cut].to_vec()));
        for bytes in rubbish {
            machine.folder.file(file, &bytes);
            let output = trueaxis(&arguments);
            let said = plain(&output.stderr);
            assert!(matches!(output.status.code(), Some(0..=2)), "{said}");
            assert!(!said.contains("panicked"), "{said}");
        }
        machine.folder.file(file, &whole);
    }
    assert!(machine.findings(&[]).is_empty());
}

#[test]
fn setup_writes_the_lines_of_the_simulated_machines() {
    for name in ["mill-21", "xyzac-trt"] {
        let machine = simulated(name);
        let lines = machine.text("trueaxis.hal");
        // Not into the machine's own folder, where these lines are already in effect.
        refused(
            &[
                "linuxcnc",
                "setup",
                &machine.at("machine.ini"),
                "-o",
                &machine.at("."),
            ],
            &[
                "load the component trueaxis already",
                "remove HALFILE = trueaxis.hal",
            ],
        );
        machine.change(
            "machine.ini",
            "HALFILE = trueaxis.hal\nHALFILE = model.hal\n",
            "",
        );
        let (ini, trax) = (machine.at("machine.ini"), format!("{name}.trax"));
        // A folder that does not exist is made.
        let to = machine.at("new");
        let setup = ["linuxcnc", "setup", &ini, "-o", &to, "--file", &trax];
        let said = answer(0, &setup);
        has(&said, "to be completed where it says CHECK");
        assert_eq!(machine.text("new/trueaxis.hal"), lines);
        // The description is valid, and equals the example in its kinematics.
        let described = machine.at("new/machine.toml");
        let example = match name {
            "mill-21" => example("mill-21/machine.toml"),
            _ => example("linuxcnc-xyzac-trt/machine.toml"),
        };
        let at = "X=123,Y=45,Z=-67,A=30,C=40";
        let at = if name == "mill-21" { &at[..16] } else { at };
        let pose = |path: &str| -> Value {
            let text = done(&format!("pose {path} --at {at} --json"));
            let pose: Value = serde_json::from_str(&text).unwrap();
            pose["poses"][0]["nominal"].clone()
        };
        assert_eq!(pose(&described), pose(&example));
        // Existing files are kept.
        std::fs::write(&described, "mine").unwrap();
        refused(
            &setup,
            &[
                "trueaxis.hal already exists: nothing was written",
                "--overwrite",
            ],
        );
        std::fs::remove_file(machine.at("new/trueaxis.hal")).unwrap();
        refused(&setup, &["machine.toml already exists"]);
        assert!(!Path::new(&machine.at("new/trueaxis.hal")).exists());
        assert_eq!(machine.text("new/machine.toml"), "mine");
        answer(0, &[&setup[..], &["--overwrite"]].concat());
        assert_ne!(machine.text("new/machine.toml"), "mine");
    }
}

#[test]
fn setup_knows_the_kinematics_and_says_what_it_does_not_know() {
    let machine = simulated("mill-21");
    let ini = |kinematics: &str, joints: usize| {
        let mut text = format!(
            "[EMC]\nVERSION = 1.1\n[HAL]\nHALFILE = empty.hal\n[TRAJ]\nLINEAR_UNITS = inch\n[KINS]\nKINEMATICS = {kinematics}\nJOINTS = {joints}\n"
        );
        for n in 0..joints {
            text += &format!("[JOINT_{n}]\nMIN_LIMIT = -10\nMAX_LIMIT = 10\nMAX_VELOCITY = 2\n");
        }
        machine.folder.file("other.ini", text)
    };
    machine.folder.file("empty.hal", loops(6));
    let to = machine.folder.path().to_str().unwrap();
    for (kinematics, joints, axes, parts) in [
        (
            "xyzac-trt-kins",
            5,
            "axes=XYZAC",
            &["name = \"A\"", "max_speed = 50.8"][..],
        ),
        (
            "xyzbc-trt-kins",
            5,
            "axes=XYZBC",
            &["name = \"B\"", "range = [-254.5, 254.5]"],
        ),
        (
            "5axiskins",
            6,
            "axes=XYZBC-",
            &["reversed = true", "branch = \"tool\""],
        ),
        (
            "trivkins coordinates=xyyz",
            4,
            "axes=XYYZ",
            &["CHECK: does it move the table"],
        ),
    ] {
        let ini = ini(kinematics, joints);
        let output = trueaxis(&["linuxcnc", "setup", &ini, "-o", to, "--overwrite"]);
        assert!(output.status.success(), "{}", plain(&output.stderr));
        let hal = machine.text("trueaxis.hal");
        has(&hal, axes);
        assert!(hal.contains("CHECK: trueaxis.read must come before"));
        let toml = machine.text("machine.toml");
        for part in parts {
            has(&toml, part);
        }
        done(&format!("pose {}", machine.at("machine.toml")));
    }
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

#[test]
fn machines_whose_joints_are_not_axes_are_refused_by_name() {
    let golden = format!("{}/../../tests/golden/v1", env!("CARGO_MANIFEST_DIR"));
    let trax = format!("{golden}/table-head-13.trax");
    for (change, name) in [
        (["trivkins coordinates=XYZ", "corexykins"], "corexykins"),
        (
            ["trivkins coordinates=XYZ", "lineardeltakins"],
            "lineardeltakins",
        ),
        (["trivkins coordinates=XYZ", "scarakins"], "scarakins"),
        (["trivkins coordinates=XYZ", "rotatekins"], "rotatekins"),
        (
            ["trivkins coordinates=XYZ", "mykins_of_mine"],
            "mykins_of_mine",
        ),
        (
            ["DISPLAY = axis", "DISPLAY = axis\nLATHE = 1"],
            "this is a lathe",
        ),
        (
            ["coordinates=XYZ", "coordinates=XZZ"],
            "XZZ do not move along X, Y and Z",
        ),
    ] {
        let folder = plain_mill("XYZ", &[change, ["MAX_LIMIT = 150", "MAX_LIMIT = 1e99"]]);
        let (code, said) = set_up(&folder, &["--install"]);
        assert_eq!(code, Some(1), "{said}");
        has(&said, "refused: ");
        has(&said, name);
        // The machine is not to be changed to suit us.
        assert!(
            said.contains("write: nothing") && !said.contains("LIMIT ="),
            "{said}"
        );
        assert_eq!(folder.names(), ["mill.hal", "mill.ini"]);
        let ini = folder.at("mill.ini");
        let done = trueaxis(&[
            "linuxcnc",
            "start",
            &ini,
            "--yes",
            "--install",
            "--scale",
            "X=2/100",
        ]);
        assert_eq!(done.status.code(), Some(1), "{}", plain(&done.stdout));
        assert_eq!(folder.names(), ["mill.hal", "mill.ini"]);
        // Neither is anything to be set up.
        let said = says(1, &format!("linuxcnc check {ini} {trax}"));
        let (_, next) = said.split_once("\nnext: ").unwrap();
        assert!(next.starts_with("nothing"), "{said}");
    }
}

#[test]
fn what_linuxcnc_reads_is_read_and_its_versions_are_named() {
    for (change, warning) in [
        (
            ["MAX_VELOCITY = 50", "MAX_VELOCITY = 50 # slow"],
            "LinuxCNC 2.9 refuses",
        ),
        (["JOINTS = 3", "JOINTS = 3 # X Y Z"], "LinuxCNC 2.9 refuses"),
        (
            ["MIN_LIMIT = -150", "MIN_LIMIT = -150 (mm)"],
            "is read as -150, as LinuxCNC 2.10 does, which ignores `(mm)`; LinuxCNC 2.9 refuses the line",
        ),
        (
            ["[TRAJ]", "[TRAJ]\nno value here"],
            "LinuxCNC 2.9 reads past it, 2.10 rejects the file",
        ),
        (
            ["[AXIS_Y]", "[JOINT_0]\nHOME = 0\n[AXIS_Y]"],
            "a second [JOINT_0]: LinuxCNC 2.10 adds its lines to the first, 2.9 ignores them",
        ),
        (["HALFILE = mill.hal", "HALFILE =\nHALFILE = mill.hal"], ""),
        (["LINEAR_UNITS = mm", "LINEAR_UNITS = 1.0"], ""),
        (["ANGULAR_UNITS = degree", "ANGULAR_UNITS = 1.0"], ""),
        (["[TRAJ]", "#INCLUDE a.inc\n[TRAJ]"], "2.9 ignores the line"),
        (
            ["[TRAJ]", "#INCLUDE none.inc\n[TRAJ]"],
            "LinuxCNC 2.9 reads past the line",
        ),
    ] {
        let folder = plain_mill("XYZ", &[change]);
        folder.file("a.inc", "[FILTER]\n#INCLUDE b.inc\n");
        folder.file("b.inc", "png = x\n");
        let (code, said) = set_up(&folder, &[]);
        assert_eq!(code, Some(0), "{change:?}: {said}");
        has(&said, warning);
        assert_eq!(said.contains("warning: "), !warning.is_empty(), "{said}");
    }
    let folder = plain_mill(
        "XYZ",
        &[["LINEAR_UNITS = mm", "LINEAR_UNITS = 0.03937007874"]],
    );
    set_up(&folder, &[]);
    let hal = std::fs::read_to_string(folder.at("to/trueaxis.hal")).unwrap();
    has(&hal, " units=inch\n");
    let folder = plain_mill("XYZ", &[["MAX_VELOCITY = 50", "MAX_VELOCITY = fast"]]);
    let (code, said) = set_up(&folder, &[]);
    assert_eq!(code, Some(1), "{said}");
    has(&said, "MAX_VELOCITY is `fast`, no number");
}

#[test]
fn what_follows_a_number_is_a_comment_or_the_number_is_wrong() {
    for (value, code) in [
        ("6O", 1),
        ("60,5", 1),
        ("60 # slow", 0),
        ("60 ; slow", 0),
        ("60 mm/s²", 0),
    ] {
        let line = format!("MAX_ACCELERATION = {value}");
        let folder = plain_mill("XYZ", &[["MAX_ACCELERATION = 400", &line]]);
        let (found, said) = set_up(&folder, &[]);
        assert_eq!(found, Some(code), "{value}: {said}");
        let expected = match code {
            0 => "LinuxCNC 2.9 refuses the line".to_owned(),
            _ => format!("MAX_ACCELERATION is `{value}`, no number"),
        };
        has(&said, &expected);
    }
}

/// A number with text right after it is refused once: nothing is computed with a part of it.
#[test]
fn a_number_that_is_refused_is_not_computed_with() {
    let sum = ["STEPGEN_MAXVEL = 65", "STEPGEN_MAXVEL = 40+35"];
    let (code, said) = set_up(&plain_mill("XYZ", &[sum]), &[]);
    assert_eq!(code, Some(1), "{said}");
    has(&said, "[JOINT_0]STEPGEN_MAXVEL is `40+35`, no number");
    assert_eq!(said.matches("refused: ").count(), 1, "{said}");
}

#[test]
fn text_after_a_word_is_part_of_the_word() {
    for (from, to, refusal) in [
        (
            "TYPE = LINEAR",
            "TYPE = LINEAR # ballscrew",
            "[JOINT_0]TYPE is `LINEAR # ballscrew`: LinuxCNC takes `# ballscrew`",
        ),
        (
            "LINEAR_UNITS = mm",
            "LINEAR_UNITS = mm # metric",
            "[TRAJ]LINEAR_UNITS is `mm # metric`: LinuxCNC takes `# metric`",
        ),
        (
            "ANGULAR_UNITS = degree",
            "ANGULAR_UNITS = degree # of arc",
            "[TRAJ]ANGULAR_UNITS is `degree # of arc`: LinuxCNC takes `# of arc`",
        ),
    ] {
        let folder = plain_mill("XYZC", &[[from, to]]);
        let (code, said) = set_up(&folder, &[]);
        assert_eq!(code, Some(1), "{said}");
        has(&said, refusal);
        has(&said, "as part of the value");
    }
}

#[test]
fn text_after_a_value_that_hal_takes_is_named_with_its_line() {
    let kinematics = ["coordinates=XYZBC", "coordinates=xyzbc # simple"];
    let head = ["trivkins", "5axiskins"];
    let pivot = ["[KINS]", "[TOOLHEAD]\nPIVOT = 182.5 # mm\n[KINS]"];
    let folder = plain_mill("XYZBC", &[kinematics, head, pivot]);
    let hal = "loadrt [KINS]KINEMATICS\nsetp 5axiskins.pivot-length [TOOLHEAD]PIVOT\n";
    folder.file("mill.hal", hal.to_owned() + &loops(5));
    let (code, said) = set_up(&folder, &[]);
    assert_eq!(code, Some(0), "{said}");
    has(
        &said,
        "mill.hal, line 1: halcmd takes `# simple` as arguments of loadrt",
    );
    has(
        &said,
        "mill.hal, line 2: halcmd takes `# mm` as arguments of setp",
    );
    let machine = std::fs::read_to_string(folder.at("to/machine.toml")).unwrap();
    has(&machine, "tip_mm = [0.0, 0.0, -182.5]");
}

#[test]
fn joints_of_one_axis_are_as_fast_as_the_slowest() {
    let folder = plain_mill("XYYZ", &[]);
    let ini = std::fs::read_to_string(folder.at("mill.ini")).unwrap();
    let (before, second) = ini.split_once("[JOINT_2]").unwrap();
    let second = second
        .replacen("MAX_VELOCITY = 50", "MAX_VELOCITY = 40", 1)
        .replacen("MAX_ACCELERATION = 400", "MAX_ACCELERATION = 300", 1);
    folder.file("mill.ini", format!("{before}[JOINT_2]{second}"));
    let (code, said) = set_up(&folder, &[]);
    assert_eq!(code, Some(0), "{said}");
    let machine = std::fs::read_to_string(folder.at("to/machine.toml")).unwrap();
    let of_y = machine.split_once("name = \"Y\"").unwrap().1;
    let of_y = of_y.split("[[axis]]").next().unwrap();
    assert!(of_y.contains("max_speed = 40.0"), "{machine}");
    assert!(of_y.contains("max_acceleration = 300.0"), "{machine}");
}

#[test]
fn a_file_that_linuxcnc_would_convert_is_converted_by_linuxcnc_itself() {
    for version in [
        "",
        "VERSION = 1.0",
        "VERSION = $Revision$",
        "VERSION = 1.1 # text",
    ] {
        let folder = plain_mill("XYZ", &[["VERSION = 1.1", version]]);
        let (code, said) = set_up(&folder, &[]);
        assert_eq!(code, Some(2), "{said}");
        has(&said, "before LinuxCNC 2.8");
        has(&said, "start LinuxCNC once");
    }
    // Joints as before 2.8, with the version of today.
    let folder = plain_mill("XYZ", &[["JOINTS = 3\n", ""], ["[AXIS_X]", "[AXIS_0]"]]);
    let (code, said) = set_up(&folder, &[]);
    assert_eq!(code, Some(2), "{said}");
    has(&said, "before LinuxCNC 2.8");
    has(&said, "start LinuxCNC once");
    // LinuxCNC does not convert this one, and does not start with it.
    let folder = plain_mill("XYZ", &[["JOINTS = 3\n", ""]]);
    let (code, said) = set_up(&folder, &[]);
    assert_eq!(code, Some(2), "{said}");
    has(&said, "no [KINS]JOINTS");
}

#[test]
fn headroom_is_read_beside_text_and_from_pins_with_aliases() {
    // The step generator has as much as the planner: nothing is left for the correction.
    let none = ["STEPGEN_MAXVEL = 65", "STEPGEN_MAXVEL = 50"];
    for velocity in ["MAX_VELOCITY = 50", "MAX_VELOCITY = 50 # mm per s"] {
        let folder = plain_mill("XYZ", &[["MAX_VELOCITY = 50", velocity], none]);
        let (code, said) = set_up(&folder, &[]);
        assert_eq!(code, Some(1), "{said}");
        has(&said, "STEPGEN_MAXVEL of joint 0 leaves nothing");
    }
    let folder = plain_mill("XYZ", &[]);
    let aliased =
        "alias pin joint.0.motor-pos-cmd a\nalias pin joint.0.motor-pos-fb b\nnet j0 a => b\n";
    folder.file(
        "mill.hal",
        loops(3).replacen(
            "net j0 joint.0.motor-pos-cmd => joint.0.motor-pos-fb\n",
            aliased,
            1,
        ),
    );
    let (code, said) = set_up(&folder, &[]);
    assert_eq!(code, Some(0), "{said}");
    let hal = std::fs::read_to_string(folder.at("to/trueaxis.hal")).unwrap();
    has(&hal, "net j0 <= trueaxis.joint.0.motor-cmd-out");
    // A drive that is not found is not guessed.
    folder.file("mill.hal", loops(2));
    let (code, said) = set_up(&folder, &["--overwrite"]);
    assert_eq!(code, Some(1), "{said}");
    has(&said, "joint.2.motor-pos-cmd is not connected");
}

#[test]
fn rotary_axes_without_limits_or_wrapped_are_endless_and_limits_of_axes_count() {
    for (from, to) in [
        (
            "MIN_LIMIT = -150\nMAX_LIMIT = 150\n[JOINT_3]\nTYPE = ANGULAR\nMIN_LIMIT = -150\nMAX_LIMIT = 150\n",
            "[JOINT_3]\nTYPE = ANGULAR\n",
        ),
        (
            "MIN_LIMIT = -150\nMAX_LIMIT = 150\n[JOINT_3]\nTYPE = ANGULAR\nMIN_LIMIT = -150\nMAX_LIMIT = 150\n",
            "[JOINT_3]\nTYPE = ANGULAR\nMIN_LIMIT = -999999\nMAX_LIMIT = 1e6\n",
        ),
        (
            "MIN_LIMIT = -150\nMAX_LIMIT = 150\n[JOINT_3]\nTYPE = ANGULAR\nMIN_LIMIT = -150\nMAX_LIMIT = 150\n",
            "WRAPPED_ROTARY = 1\nMIN_LIMIT = -360\nMAX_LIMIT = 360\n[JOINT_3]\nTYPE = ANGULAR\n",
        ),
    ] {
        let folder = plain_mill("XYZC", &[[from, to]]);
        let (code, said) = set_up(&folder, &[]);
        assert_eq!(code, Some(0), "{said}");
        let machine = std::fs::read_to_string(folder.at("to/machine.toml")).unwrap();
        has(&machine, "modulo = true");
        assert!(!machine.contains("360"), "{machine}");
    }
    let folder = plain_mill("XYZ", &[["MAX_LIMIT = 150", "MAX_LIMIT = 120"]]);
    set_up(&folder, &[]);
    let machine = std::fs::read_to_string(folder.at("to/machine.toml")).unwrap();
    has(&machine, "range = [-150.5, 120.5]");
}

/// `rs274` of 2.9 goes from C10 with C-20 to C-340 under `1` and `2`, and to C-20 under all others.
#[test]
fn limits_of_less_than_a_turn_hold_for_a_wrapped_axis_and_its_value_is_read_as_by_each_version() {
    for (value, versions) in [
        ("1", None),
        ("0", None),
        ("no", None),
        ("YES", Some("false, 2.10 as true")),
        ("2", Some("true, 2.10 as false")),
        ("1 # endless", Some("false, 2.10 as false")),
    ] {
        let line = format!("[AXIS_C]\nWRAPPED_ROTARY = {value}\n");
        let folder = plain_mill("XYZC", &[["[AXIS_C]\n", &line]]);
        let (code, said) = set_up(&folder, &[]);
        assert_eq!(code, Some(0), "{said}");
        let warning = versions.map_or(String::new(), |versions| {
            format!("[AXIS_C]WRAPPED_ROTARY is `{value}`: LinuxCNC 2.9 reads it as {versions}")
        });
        has(&said, &warning);
        assert_eq!(said.contains("warning: "), versions.is_some(), "{said}");
        let machine = std::fs::read_to_string(folder.at("to/machine.toml")).unwrap();
        has(&machine, "range = [-150.1, 150.1]");
        assert!(!machine.contains("modulo"), "{machine}");
    }
}

#[test]
fn a_pivot_that_is_not_visible_is_asked_for() {
    let head = ["trivkins coordinates=XYZBC", "5axiskins coordinates=xyzbc"];
    let folder = plain_mill("XYZBC", &[head]);
    let driven = "loadrt sum2 names=pivot\nsetp pivot.in0 180\nnet piv pivot.out => 5axiskins.pivot-length\n";
    folder.file("mill.hal", loops(5) + driven);
    let (code, said) = set_up(&folder, &[]);
    assert_eq!(code, Some(0), "{said}");
    has(&said, "only the module's default");
    has(&said, "--pivot");
    let ini = folder.at("mill.ini");
    let start = [
        "linuxcnc",
        "start",
        &ini,
        "--yes",
        "--install",
        "--scale",
        "X=2/100",
    ];
    refused(&start, &["only the module's default", "--pivot"]);
    assert!(!Path::new(&folder.at("machine.toml")).exists());
    let (code, _) = set_up(&folder, &["--pivot", "212.5", "--overwrite"]);
    assert_eq!(code, Some(0));
    let machine = std::fs::read_to_string(folder.at("to/machine.toml")).unwrap();
    has(&machine, "tip_mm = [0.0, 0.0, -212.5]");
}

/// An axis with two joints has one correction in a compensation, so LinuxCNC keeps what differs.
#[test]
fn joints_of_one_axis_that_differ_keep_what_linuxcnc_compensates() {
    for (second, stay) in [
        ("", &["BACKLASH of joint 1"][..]),
        (
            "BACKLASH = 0.02\n",
            &["BACKLASH of joint 1", "BACKLASH of joint 3"],
        ),
        (
            "BACKLASH = 0.03\nCOMP_FILE = y.comp\n",
            &["BACKLASH of joint 1", "COMP_FILE of joint 3"],
        ),
        ("BACKLASH = 0.030\n", &[]),
    ] {
        let second = format!("[JOINT_3]\n{second}");
        let folder = plain_mill(
            "XYZY",
            &[
                ["[JOINT_0]\n", "[JOINT_0]\nBACKLASH = 0.01\n"],
                ["[JOINT_1]\n", "[JOINT_1]\nBACKLASH = 0.03\n"],
                ["[JOINT_3]\n", &second],
            ],
        );
        folder.file("y.comp", "-100 -100.01 -100.01\n100 100.02 100.02\n");
        let (code, said) = set_up(&folder, &[]);
        assert_eq!(code, Some(0), "{said}");
        for line in stay {
            let line = format!("{line} stays with LinuxCNC: the joints of Y differ");
            has(&said, &line);
        }
        assert_eq!(said.matches("stays with LinuxCNC").count(), stay.len());
        let errors = std::fs::read_to_string(folder.at("to/errors.toml")).unwrap();
        has(&errors, "EXXb");
        assert_eq!(errors.contains("EYY"), stay.is_empty(), "{errors}");
    }
}

#[test]
fn a_compensation_beside_joints_that_differ_corrects_nothing_twice() {
    let folder = plain_mill(
        "XYZY",
        &[
            ["[JOINT_0]\n", "[JOINT_0]\nBACKLASH = 0.01\n"],
            ["[JOINT_1]\n", "[JOINT_1]\nCOMP_FILE = y.comp\n"],
            ["[JOINT_3]\n", "[JOINT_3]\nBACKLASH = 0.02\n"],
        ],
    );
    folder.file("y.comp", "-100 -100.01 -100.01\n100 100.02 100.02\n");
    let threads = "addf motion-command-handler servo-thread\naddf motion-controller servo-thread\n";
    folder.file("mill.hal", threads.to_owned() + &loops(4));
    let ini = folder.at("mill.ini");
    let words = ["linuxcnc", "start", &ini, "--table=X", "--install", "--yes"];
    for reading in ["--scale=Y=2/100", "--dial=Y=20"] {
        let expected = [
            "a reading along Y",
            "COMP_FILE of joint 1 stays with LinuxCNC",
        ];
        refused(&[&words[..], &[reading]].concat(), &expected);
    }
    let said = answer(0, &words);
    for line in [
        "COMP_FILE = y.comp of joint 1 stays in the INI file: the joints of Y differ",
        "BACKLASH = 0.02 of joint 3 stays in the INI file: the joints of Y differ",
    ] {
        has(&said, line);
    }
    let now = std::fs::read_to_string(&ini).unwrap();
    let has = |line: &str| now.lines().any(|l| l == line);
    assert!(has("COMP_FILE = y.comp") && has("BACKLASH = 0.02"), "{now}");
    assert!(!has("BACKLASH = 0.01"), "{now}");

    // What depends on X comes on top of it; with tables for each direction of travel of Y, each reversal would be made
    // up twice.
    let (machine, trax) = (folder.at("machine.toml"), folder.at("machine.trax"));
    for (parameter, code, expected) in [
        (
            "EYX2 = 2e-7",
            0,
            "stays with LinuxCNC, because the joints of Y differ",
        ),
        (
            "EYYb = 0.01",
            1,
            "which stays because the joints of Y differ",
        ),
    ] {
        let text = format!("machine = \"machine\"\n[parameters]\n{parameter}\n");
        let errors = folder.file("more.toml", text);
        let words = ["compile", &machine, &errors, "-o", &trax, "--random", "100"];
        answer(0, &words);
        let said = says(code, &format!("linuxcnc check {ini} {trax}"));
        assert_eq!(said.matches(expected).count(), 2, "{said}");
    }
}

/// A machine with X on the table, Z, A and Y: what LinuxCNC compensates on its joints.
fn compensated(folder: &Folder, units: &str, joints: [&str; 3]) -> String {
    let mut text = format!(
        "[EMC]\nVERSION = 1.1\n[HAL]\nHALFILE = empty.hal\n[TRAJ]\nLINEAR_UNITS = {units}\n[KINS]\nKINEMATICS = trivkins coordinates=XZAY\nJOINTS = 4\n"
    );
    for (n, lines) in joints.iter().chain([&""]).enumerate() {
        text += &format!("[JOINT_{n}]\nMIN_LIMIT = -10\nMAX_LIMIT = 10\n{lines}");
    }
    folder.file("empty.hal", loops(4));
    folder.file("mill.ini", text)
}

#[test]
fn setup_imports_what_linuxcnc_compensates_with_its_sign_and_unit() {
    let folder = Folder::new();
    folder.file("x.comp", "-5 -5.001 -5.002\n\t5 5.003 5\n\n");
    folder.file("a.comp", "-9 0.01 0.01\n9 -0.02 -0.02\n");
    let ini = compensated(
        &folder,
        "inch",
        [
            "COMP_FILE = x.comp\n",
            "BACKLASH = 0.002\n",
            "COMP_FILE = a.comp\nCOMP_FILE_TYPE = 1\nSTEPGEN_MAXVEL = 6.25\nMAX_VELOCITY = 5\n",
        ],
    );
    let to = folder.at("to/here");
    let said = done(&format!("linuxcnc setup {ini} -o {to}"));
    let read = |name: &str| std::fs::read_to_string(folder.at(name)).unwrap();
    let errors = read("to/here/errors.toml");
    for part in [
        // X moves the table, so it is reversed: the error is what LinuxCNC adds.
        "[tabulated.EXX]\nat = [-127.0, 127.0]\npositive = [0.0254, -0.0762]\nnegative = [0.0508, 0.0]\nunit = \"mm\"",
        "EZZb = -0.0254  # mm",
        "[tabulated.EAA]\nat = [-9.0, 9.0]\nvalue = [-0.01, 0.02]\nunit = \"deg\"",
        "X is reversed in machine.toml",
        "COMP_FILE = x.comp in",
    ] {
        has(&errors, part);
    }
    // What is wrong is reported at once, with file and line; the HAL file says it, too.
    let hal = read("to/here/trueaxis.hal");
    for (line, write) in [
        (13, "# COMP_FILE = x.comp"),
        (17, "BACKLASH = 0"),
        (21, "# COMP_FILE = a.comp"),
    ] {
        has(&said, &format!("mill.ini, line {line}: "));
        has(&said, &format!("  write: {write}\n"));
        has(&hal, &format!("mill.ini, line {line}: {write}\n"));
    }
    has(&hal, "setp trueaxis.enable 0");
    let [machine, errors] =
        ["machine.toml", "errors.toml"].map(|f| folder.at(&format!("to/here/{f}")));
    let trax = folder.at("mill.trax");
    done(&format!(
        "compile {machine} {errors} -o {trax} --random 100"
    ));
}

#[test]
fn what_linuxcnc_would_not_read_is_not_imported() {
    for (lines, file, expected) in [
        (
            "COMP_FILE = none.comp\n",
            "",
            ["none.comp cannot be read", "folder of the INI"],
        ),
        (
            "COMP_FILE = x.comp\n",
            "# a comment\n1 2 3\n",
            ["not three numbers", "no comments"],
        ),
        (
            "COMP_FILE = x.comp\n",
            "1 2 3\n1 2 3\n",
            ["positions must increase", "sort"],
        ),
        ("COMP_FILE = x.comp\n", "\n", ["has no lines", "remove"]),
        (
            "COMP_FILE = x.comp\nCOMP_FILE_TYPE = 2\n",
            "1 2 3\n",
            ["COMP_FILE_TYPE is `2`", "write 0"],
        ),
        (
            "COMP_FILE = x.comp # screw\n",
            "1 2 3\n",
            [
                "x.comp # screw cannot be read",
                "`# screw` on a line of its own",
            ],
        ),
    ] {
        let folder = Folder::new();
        folder.file("x.comp", file);
        let ini = compensated(&folder, "mm", [lines, "", ""]);
        refused(
            &["linuxcnc", "setup", &ini, "-o", &folder.at("to")],
            &expected,
        );
        assert!(!Path::new(&folder.at("to")).exists());
    }
    let folder = Folder::new();
    folder.file("x.comp", "-5 0.1 0.1\n5 0.2 0.2\n");
    let lines = "COMP_FILE = x.comp\nCOMP_FILE_TYPE = 1 # differences\n";
    let ini = compensated(&folder, "mm", [lines, "", ""]);
    let said = done(&format!("linuxcnc setup {ini} -o {}", folder.at("to")));
    has(&said, "COMP_FILE_TYPE is read as 1, as LinuxCNC 2.10 does");
    let errors = std::fs::read_to_string(folder.at("to/errors.toml")).unwrap();
    has(&errors, "value = [0.1, 0.2]");
    let folder = Folder::new();
    let ini = compensated(&folder, "mm", ["BACKLASH = much\n", "", ""]);
    let said = says(1, &format!("linuxcnc setup {ini} -o {}", folder.at("to")));
    has(&said, "BACKLASH is `much`, no number");
    assert!(!Path::new(&folder.at("to")).exists());
}

#[test]
fn a_model_is_written_whole_and_never_over_an_input() {
    let folder = Folder::new();
    let (machine, errors) = (folder.at("machine.toml"), folder.at("errors.toml"));
    std::fs::copy(example("mill-21/machine.toml"), &machine).unwrap();
    std::fs::copy(example("mill-21/errors-21.toml"), &errors).unwrap();
    let out = folder.at("mill.model");
    let said = done(&format!("linuxcnc model {machine} {errors} -o {out}"));
    has(&said, "Mill with 21 errors with axes YXZ, 19360 bytes");
    let bytes = std::fs::read(&out).unwrap();
    assert_eq!((&bytes[..4], bytes.len()), (&b"TRAM"[..], 19360));
    for input in [&machine, &errors] {
        refused(
            &["linuxcnc", "model", &machine, &errors, "-o", input],
            &["is the input", "another name"],
        );
    }
    let kolibri = example("kolibri/errors-12.toml");
    refused(
        &["linuxcnc", "model", &machine, &kolibri, "-o", &out],
        &["Kolibri"],
    );
    assert_eq!(std::fs::read(&out).unwrap(), bytes);
}

/// Runs the command with a `halcmd` that keeps the pins `state` and `enable` in a file, and prints them.
#[cfg(unix)]
fn with_halcmd(folder: &Folder, words: &[&str]) -> (Option<i32>, String) {
    use std::os::unix::fs::PermissionsExt;
    let script = r#"#!/bin/sh
here=$(dirname "$0")
case "$1 $2" in
"-s show") cat "$here/pins" ;;
"setp trueaxis.reload") sed -i "s/u32 OUT . trueaxis.reloads/u32 OUT 7 trueaxis.reloads/" "$here/pins" ;;
"setp trueaxis.enable") sed -i "s/bit IN FALSE trueaxis.enable/bit IN TRUE trueaxis.enable/;s/OUT 1 trueaxis.state/OUT 3 trueaxis.state/" "$here/pins" ;;
*) echo "signal '$2' already has writer" >&2; exit 1 ;;
esac
"#;
    let halcmd = folder.file("halcmd", script);
    std::fs::set_permissions(halcmd, std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:/usr/bin:/bin", folder.path().display());
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_trueaxis"))
        .args(words)
        .env("PATH", path)
        .output()
        .unwrap();
    let said = match output.stderr.is_empty() {
        true => String::from_utf8(output.stdout).unwrap(),
        false => plain(&output.stderr),
    };
    (output.status.code(), said)
}

#[cfg(unix)]
#[test]
fn the_component_is_watched_and_switched_through_its_pins() {
    let folder = Folder::new();
    let pins = "9 float IN 12.5 trueaxis.joint.0.pos-in <== x-pos
9 bit IN FALSE trueaxis.joint.0.homed <== x-homed
9 float OUT 0 trueaxis.joint.0.correction
9 float OUT 0.0125 trueaxis.joint.0.computed
9 float OUT 0.5 trueaxis.joint.0.bound-used
9 bit IN FALSE trueaxis.enable
9 bit IN FALSE trueaxis.dry-run <== panel-dry
9 bit OUT FALSE trueaxis.loading
9 bit OUT FALSE trueaxis.saturated
9 bit OUT TRUE trueaxis.beyond-range
9 float OUT 0 trueaxis.factor
9 u32 OUT 1 trueaxis.state
9 s32 OUT 0 trueaxis.waiting-for
9 bit IN FALSE trueaxis.reload
9 u32 OUT 0 trueaxis.reloads
9 u32 OUT 8 trueaxis.fault-code
9 u32 OUT 2 trueaxis.load-fault
9 u32 OUT 2 trueaxis.loads
9 u32 OUT 42 trueaxis.checksum
9 float IN nan trueaxis.tool-length
9 float IN 1 trueaxis-model.tool-length
";
    folder.file("pins", pins);
    let run = |words: &[&str]| with_halcmd(&folder, words);
    let (code, said) = run(&["control", "--hal", "enable"]);
    assert_eq!(code, Some(0), "{said}");
    has(&said, "corrections  enable is off, factor 0.000\n");
    has(&said, "-> joint 0 is not homed, factor 0.000\n");
    has(&said, "file         0000002a, number 2");
    let (code, said) = run(&["monitor", "--hal", "--count", "1"]);
    assert_eq!(code, Some(0), "{said}");
    let row = "0            12.5000      0.00000      0.01250      50 % |##########          |  not homed";
    has(&said, row);
    has(&said, "\nbeyond range a temperature");
    let (_, said) = run(&[
        "monitor",
        "--hal",
        "--csv",
        "--count",
        "2",
        "--interval",
        "1",
    ]);
    assert!(
        said.starts_with("time,0,d0,computed 0,factor,state,"),
        "{said}"
    );
    has(&said, ",12.5,0,0.0125,0,3,0,8,0,1\n");
    let (_, said) = run(&["monitor", "--hal", "--json", "--count", "1"]);
    let object: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(object["reason"], "joint 0 is not homed");
    assert_eq!(object["inputs"]["tool-length"], Value::Null);
    // A file that is not accepted, whatever else is wrong.
    let (code, said) = run(&["control", "--hal", "reload"]);
    assert_eq!(code, Some(1), "{said}");
    has(&said, "the file is not accepted: the file is damaged");
    // A pin that a panel drives, and what only boards have.
    let (code, said) = run(&["control", "--hal", "dry-run", "on"]);
    assert_eq!(code, Some(2), "{said}");
    has(&said, "signal 'panel-dry' already has writer");
    let (_, said) = run(&["control", "--hal", "rollback"]);
    has(&said, "this is for a board");
    folder.file("pins", "");
    let (_, said) = run(&["monitor", "--hal"]);
    has(&said, "the component trueaxis is not loaded");
}

#[test]
fn an_axis_of_the_wrong_sign_is_named() {
    let machine = simulated("xyzac-trt");
    let text = std::fs::read_to_string(example("linuxcnc-xyzac-trt/machine.toml")).unwrap();
    let kinematics = "KINEMATICS = xyzac-trt-kins";
    for letter in ["A", "C"] {
        let name = format!("name = \"{letter}\"\n");
        let other = text.replace(&name, &format!("{name}reversed = true\n"));
        assert_ne!(other, text);
        let other = machine.folder.file("other.toml", other);
        machine.finds(
            &["--machine", &other],
            &format!("refused | {kinematics} | {letter} has the wrong sign in the machine file | reversed = false for {letter}"),
        );
    }
    // X moves the table, and counts what the tool does.
    let other = text.replacen("reversed = true\n", "", 1);
    let other = machine.folder.file("other.toml", other);
    machine.finds(
        &["--machine", &other],
        &format!("warning | {kinematics} | a positive command of Y moves the tool in −Y | reversed = true for Y"),
    );
    // The pin that turns both axes the other way, and the machine for it.
    let pin = "setp xyzac-trt-kins.tool-offset 100\n";
    machine.change(
        "machine.hal",
        pin,
        &format!("{pin}setp xyzac-trt-kins.conventional-directions TRUE\n"),
    );
    let both = text.replace("name = \"A\"\n", "name = \"A\"\nreversed = true\n");
    let both = both.replace("name = \"C\"\n", "name = \"C\"\nreversed = true\n");
    let both = machine.folder.file("both.toml", both);
    assert!(machine.findings(&["--machine", &both]).is_empty());
    machine.finds(
        &["--machine", &example("linuxcnc-xyzac-trt/machine.toml")],
        &format!("refused | {kinematics} | A has the wrong sign | reversed = true"),
    );
}

#[test]
fn the_last_line_is_what_to_do_next() {
    let machine = simulated("mill-21");
    let next = || -> String {
        let arguments = machine.arguments();
        let arguments: Vec<&str> = arguments[..4].iter().map(String::as_str).collect();
        let said = plain(&trueaxis(&arguments).stdout);
        said.split_once("next: ").unwrap().1.to_owned()
    };
    assert!(next().ends_with("then press Enable in the tab Compensation"));
    machine.change("machine.ini", "trueaxis-panel -x", "another -x");
    machine.change("machine.ini", "trueaxis-panel.ui", "another.ui");
    assert!(next().ends_with("then trueaxis control --hal enable"));
    // A machine file in the same folder is named in the next command.
    machine.folder.file("machine.toml", "");
    assert!(next().ends_with(&format!("--machine {}", machine.at("machine.toml"))));
    machine.change("machine.ini", "[JOINT_0]\n", "[JOINT_0]\nCOMP_FILE = x\n");
    assert!(next().starts_with("correct the errors above, then trueaxis linuxcnc check"));
    machine.change("machine.ini", "HALFILE = trueaxis.hal\n", "");
    assert!(next().starts_with("write HALFILE = trueaxis.hal below [HAL]"));
    std::fs::remove_file(machine.at("trueaxis.hal")).unwrap();
    assert!(next().starts_with("trueaxis linuxcnc setup"));
}

/// A mill with backlash on X, as `setup` and `compile` make it; the lines are of its joint.
fn with_backlash(joint: &str) -> (Folder, String) {
    let folder = Folder::new();
    folder.file("machine.hal", loops(3));
    let mut ini = String::from(
        "[EMC]\nVERSION = 1.1\n[HAL]\nHALFILE = machine.hal\n[TRAJ]\nLINEAR_UNITS = mm\n[KINS]\nKINEMATICS = trivkins coordinates=XYZ\nJOINTS = 3\n",
    );
    for (number, more) in [joint, "", ""].iter().enumerate() {
        ini += &format!(
            "[JOINT_{number}]\nTYPE = LINEAR\nMIN_LIMIT = 0\nMAX_LIMIT = 200\nMAX_VELOCITY = 100\nMAX_ACCELERATION = 1000\n{more}"
        );
    }
    let ini = folder.file("machine.ini", ini);
    let to = folder.at("new");
    trueaxis(&["linuxcnc", "setup", &ini, "-o", &to]);
    let [machine, errors, trax] = ["machine.toml", "errors.toml", "machine.trax"]
        .map(|name| folder.at(&format!("new/{name}")));
    let said = done(&format!(
        "compile {machine} {errors} -o {trax} --random 200"
    ));
    (folder, said)
}

/// What `check` says of its reversals.
fn of_reversals(folder: &Folder) -> Vec<[String; 2]> {
    let output = trueaxis(&[
        "linuxcnc",
        "check",
        &folder.at("machine.ini"),
        &folder.at("new/machine.trax"),
        "--json",
    ]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let findings = found["findings"].as_array().unwrap().iter();
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_owned();
    findings
        .map(|finding| [text(finding, "reason"), text(finding, "write")])
        .filter(|[reason, _]| reason.contains("revers"))
        .collect()
}

#[test]
fn backlash_is_made_up_as_fast_as_the_joint_can() {
    let (folder, said) = with_backlash("BACKLASH = 0.03\n");
    let machine = std::fs::read_to_string(folder.at("new/machine.toml")).unwrap();
    has(&machine, "max_acceleration = 1000.0");
    assert!(!machine.contains("max_reversal_acceleration"), "{machine}");
    // The rounding of f32 at 200 mm is 1.5e-5.
    has(&machine, "reversal_threshold = 3e-5");
    // 2 √(0.03 / 667) s
    has(
        &said,
        "X reverses by 0.03000 mm in 13 ms: beside a circle of R30 mm",
    );
    assert!(of_reversals(&folder).is_empty());
    // Another INI file than the one that the compensation was made for.
    let ini = std::fs::read_to_string(folder.at("machine.ini")).unwrap();
    folder.file(
        "machine.ini",
        ini.replace("[JOINT_0]\n", "[JOINT_0]\nSTEPGEN_MAXACCEL = 1250\n"),
    );
    let found = of_reversals(&folder);
    assert!(
        found.len() == 1
            && found[0][0].contains("leaves 250 per s², and a reversal of X takes 666.6"),
        "{found:?}"
    );
    assert_eq!(found[0][1], "STEPGEN_MAXACCEL = 2000");
}

#[test]
fn what_a_step_generator_without_headroom_leaves_of_a_circle_is_said() {
    // A tenth of headroom, less two hundredths for slopes: 80 mm/s², 2 √(0.03 / 80) s = 39 ms.
    let (folder, said) = with_backlash("BACKLASH = 0.03\nSTEPGEN_MAXACCEL = 1100\n");
    let machine = std::fs::read_to_string(folder.at("new/machine.toml")).unwrap();
    has(&machine, "max_reversal_acceleration = 80.0");
    has(&said, "X reverses by 0.03000 mm in 39 ms");
}

#[test]
fn corrections_come_in_after_homing_if_that_is_asked_for() {
    let (folder, _) = with_backlash("BACKLASH = 0.03\n");
    let hal = |name: &str, more: &[&str]| {
        let (ini, to) = (folder.at("machine.ini"), folder.at(name));
        trueaxis(&[&["linuxcnc", "setup", &ini, "-o", &to], more].concat());
        std::fs::read_to_string(folder.at(&format!("{name}/trueaxis.hal"))).unwrap()
    };
    assert!(hal("asked", &["--enable-when-homed"]).ends_with("\nsetp trueaxis.enable 1\n"));
    assert!(hal("usual", &[]).ends_with("\nsetp trueaxis.enable 0\n"));
}
