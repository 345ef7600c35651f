//! What `linuxcnc check` finds in kinematics and connections, and in files that it cannot read.

use super::{simulated, spoilt};
use crate::program::{done, example, plain, refused, trueaxis};

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
