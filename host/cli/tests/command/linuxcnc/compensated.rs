//! What LinuxCNC compensates already.

use super::{loops, plain_mill, set_up};
use crate::program::{Folder, answer, done, example, has, refused, says};
use std::path::Path;

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
