//! What `linuxcnc check` finds in limits, speeds and functions.

use super::{simulated, spoilt};
use crate::program::example;
use serde_json::Value;

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
