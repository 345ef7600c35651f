//! `export linuxcnc`: its files, and what they leave.

use crate::program::{Folder, answer, blob, has, plain, refused, split, trueaxis};

/// An INI file for the joints X, Y and Z.
fn ini(folder: &Folder, more: &str) -> String {
    folder.file("loops.hal", crate::linuxcnc::loops(3));
    let text = format!(
        "[EMC]\nVERSION = 1.1\n[KINS]\nKINEMATICS = trivkins coordinates=XYZ\nJOINTS = 3\n[TRAJ]\nLINEAR_UNITS = mm\n[HAL]\nHALFILE = loops.hal\n{more}"
    );
    folder.file("mill.ini", text)
}

#[test]
fn what_joints_do_along_themselves_is_written_and_imported_again() {
    let folder = Folder::new();
    let machine = crate::program::example("router/machine.toml");
    let text = "machine = \"Router\"\n[parameters]\nEXX1 = 120e-6\nEXX2 = -1e-7\nEYYb = -0.012\n";
    let (errors, trax) = (folder.file("errors.toml", text), folder.at("router.trax"));
    answer(
        0,
        &["compile", &machine, &errors, "-o", &trax, "--random", "500"],
    );
    let to = folder.path().to_str().unwrap();
    let words = [
        "export",
        "linuxcnc",
        &trax,
        "--ini",
        &ini(&folder, ""),
        "-o",
        to,
        "--random",
        "2000",
    ];
    let said = answer(0, &words);
    has(
        &said,
        "[JOINT_0]\n  COMP_FILE = joint0.comp\n  COMP_FILE_TYPE = 0",
    );
    assert!(!said.contains("JOINT_2"), "{said}");
    // As the manual tells to write it, the setup reads it as the same errors.
    let lines = "\
        [JOINT_0]\nMIN_LIMIT = 0\nMAX_LIMIT = 800\nCOMP_FILE = joint0.comp\nCOMP_FILE_TYPE = 0\n\
        [JOINT_1]\nMIN_LIMIT = 0\nMAX_LIMIT = 1200\nCOMP_FILE = joint1.comp\nCOMP_FILE_TYPE = 0\n\
        [JOINT_2]\nMIN_LIMIT = -150\nMAX_LIMIT = 0\n";
    let here = folder.at("here");
    answer(
        0,
        &[
            "linuxcnc",
            "setup",
            &ini(&folder, lines),
            "-o",
            &here,
            "--table",
            "",
        ],
    );
    let imported = std::fs::read_to_string(folder.at("here/errors.toml")).unwrap();
    has(&imported, "[tabulated.EXX]");
    // Half of the reversal, −12 µm after positive travel.
    has(
        &imported,
        "positive = [-0.012, -0.012]\nnegative = [0.012, 0.012]",
    );
}

#[test]
fn squareness_is_left_and_said() {
    let folder = Folder::new();
    let to = folder.path().to_str().unwrap();
    let ini = ini(&folder, "");
    let line = format!(
        "export linuxcnc {} --ini {ini} -o {to} --random 2000",
        blob("mill-21")
    );
    let words = split(&line);
    let done = trueaxis(&words);
    assert_eq!(done.status.code(), Some(1));
    let said = plain(&done.stderr);
    has(&said, "more than 1 µm remains, and nothing is written");
    assert_eq!(folder.names(), ["loops.hal", "mill.ini"]);
    let done = trueaxis(&[&words[..], &["--best-effort", "--type", "1"]].concat());
    assert_eq!(done.status.code(), Some(1));
    assert!(folder.names().contains(&"joint2.comp".to_owned()));
    refused(
        &split(&format!(
            "export linuxcnc {} --ini {ini} -o {to}",
            blob("kolibri")
        )),
        &["no joint of the INI file moves it"],
    );
}
