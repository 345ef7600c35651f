//! What `linuxcnc setup` writes, and which machines it refuses.

use super::{loops, plain_mill, set_up, simulated};
use crate::program::{answer, done, example, has, plain, refused, says, trueaxis};
use serde_json::Value;
use std::path::Path;

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
