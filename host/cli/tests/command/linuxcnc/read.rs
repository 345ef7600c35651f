//! INI and HAL files as LinuxCNC reads them.

use super::{loops, plain_mill, set_up};
use crate::program::{has, refused};
use std::path::Path;

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
