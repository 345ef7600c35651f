//! The component in a running machine, and backlash.

use super::{loops, simulated};
use crate::program::{Folder, done, example, has, plain, trueaxis};
use serde_json::Value;

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
