//! `trueaxis linuxcnc start`: from a configuration and a few readings to a checked compensation.

use crate::program::{Folder, answer, done, has, plain, refused, trueaxis};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The simulated mill as it was before the component, with lines for its joint X.
fn mill(joint: &str) -> Folder {
    let folder = Folder::new();
    let from = format!(
        "{}/../../firmware/linuxcnc/configs/mill-21",
        env!("CARGO_MANIFEST_DIR")
    );
    let from = Path::new(&from);
    std::fs::copy(from.join("machine.hal"), folder.at("machine.hal")).unwrap();
    let ini = std::fs::read_to_string(from.join("mill-21.ini")).unwrap();
    let ours = ["trueaxis", "model.hal", "EMBED", "PYVCP", "POSTGUI"];
    let before: Vec<&str> = ini
        .lines()
        .filter(|line| ours.iter().all(|word| !line.contains(word)))
        .collect();
    let before = before.join("\n") + "\n";
    let before = before.replace("[JOINT_0]\n", &format!("[JOINT_0]\n{joint}"));
    folder.file("mill.ini", before);
    folder
}

/// The options of the manual.
const READINGS: &str =
    "--table XY --scale X=2/100 --square XY=3/100 --dial X=-4 --install --scale=Z=-1/50";

/// Runs `start` with the configuration of a folder, without questions; what it says. Checks that it exits with `code`.
#[track_caller]
fn start(code: i32, folder: &Folder, options: &str) -> String {
    let words = format!("linuxcnc start {} --yes {options}", folder.at("mill.ini"));
    let output = trueaxis(&words.split_whitespace().collect::<Vec<_>>());
    let said = String::from_utf8(output.stdout).unwrap() + &plain(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert_eq!(said.contains("help:"), code == 2, "{said}");
    said
}

fn read(folder: &Folder, name: &str) -> String {
    std::fs::read_to_string(folder.at(name)).unwrap()
}

/// Runs `start` in a folder, with answers.
fn asked(folder: &Folder, arguments: &[&str], answers: &str) -> Output {
    let mut running = Command::new(env!("CARGO_BIN_EXE_trueaxis"))
        .args(["linuxcnc", "start"])
        .args(arguments)
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut to = running.stdin.take().unwrap();
    to.write_all(answers.as_bytes()).unwrap();
    drop(to);
    running.wait_with_output().unwrap()
}

#[test]
fn what_is_not_installed_is_the_next_step() {
    let folder = mill("");
    let said = start(0, &folder, "--table XY --scale X=2/100");
    has(
        &said,
        "mill.ini: is as it was; what to write into it is at the head of ",
    );
    has(&said, "next: write that into ");
}

#[test]
fn a_scale_and_a_square_become_a_checked_compensation() {
    let folder = mill("");
    let before = read(&folder, "mill.ini");
    let said = start(0, &folder, READINGS);
    assert!(said.lines().count() <= 5, "{said}");
    has(&said, "press Enable in the tab Compensation");
    // `explain` derives the readings from the written parameters, on the written machine.
    let explained = done(&format!(
        "explain {} {}",
        folder.at("machine.toml"),
        folder.at("errors.toml")
    ));
    for part in [
        "a laser along X reads +2.0 µm at +100 mm",
        "a laser along Z reads +2.0 µm at −100 mm",
        "a square on the table, dial moved along Y, reads +3.0 µm per 100 mm in X",
        "reads −4.0 µm after positive less after negative travel of X",
    ] {
        has(&explained, part);
    }
    assert_eq!(read(&folder, "mill.ini.before-trueaxis"), before);
    let now = read(&folder, "mill.ini");
    let added: Vec<&str> = now.lines().filter(|line| !before.contains(line)).collect();
    assert_eq!(added.len(), 3, "{now}");
    has(&now, "HALFILE = machine.hal\nHALFILE = trueaxis.hal\n");
    assert!(!read(&folder, "machine.toml").contains("does it move"));

    // Again: nothing is replaced unless it is wanted.
    let files = [
        "mill.ini",
        "machine.toml",
        "errors.toml",
        "machine.trax",
        "trueaxis.hal",
    ];
    let contents = files.map(|name| std::fs::read(folder.at(name)).unwrap());
    let said = start(2, &folder, READINGS);
    has(&said, "machine.trax exists");
    has(&said, "--overwrite");
    assert_eq!(
        files.map(|name| std::fs::read(folder.at(name)).unwrap()),
        contents
    );
    let more = format!("{READINGS} --overwrite --scale Y=1/100");
    let said = start(0, &folder, &more);
    assert!(
        said.contains("4 readings") || said.contains("5 readings"),
        "{said}"
    );
    assert!(read(&folder, "errors.toml").contains("EYY1 = "));
    assert_eq!(read(&folder, "mill.ini"), now);
}

#[test]
fn answers_do_what_options_do_and_are_asked_again_if_they_cannot_be_read() {
    let by_options = mill("");
    start(0, &by_options, READINGS);
    let by_answers = mill("");
    // INI file, table, lines; scales of Y, X and Z; squares YX, YZ, XZ; dials.
    let answers = "\nXY\ny\n\n2\n2/100\n-1/50\n3/100\n\n\n\n-4\n\n";
    let output = asked(&by_answers, &[], answers);
    let said = plain(&output.stdout) + &plain(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    has(&said, "`X=2` is not of the form X=2/100");
    for name in ["machine.toml", "trueaxis.hal", "mill.ini", "machine.trax"] {
        let [a, b] = [&by_options, &by_answers].map(|f| std::fs::read(f.at(name)).unwrap());
        assert_eq!(a, b, "{name}");
    }
}

#[test]
fn without_readings_it_says_what_comes_next() {
    let folder = mill("");
    let output = asked(&folder, &["mill.ini"], "");
    let said = plain(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.ends_with("next: measure, then trueaxis linuxcnc start mill.ini"),
        "{said}"
    );
    assert_eq!(
        folder.names(),
        ["machine.hal", "machine.toml", "mill.ini", "trueaxis.hal"]
    );
    let folder = mill("");
    let said = start(0, &folder, "--balls artefact.toml");
    has(&said, "trueaxis linuxcnc calibrate");
    has(&said, "--artefact artefact.toml");
}

#[test]
fn what_linuxcnc_compensates_is_kept_and_not_measured_twice() {
    let folder = mill("BACKLASH = 0.01\n");
    let run = |code, more: &str| {
        start(
            code,
            &folder,
            &format!("--table XY --overwrite --install {more}"),
        )
    };
    let before = [folder.names().join(" "), read(&folder, "mill.ini")];
    for reading in ["--dial X=4", "--scale X=2/100"] {
        has(
            &run(2, reading),
            "the INI file already compensates X (BACKLASH = 0.01 in ",
        );
        assert_eq!(
            [folder.names().join(" "), read(&folder, "mill.ini")],
            before
        );
    }
    // It is taken out of the INI file.
    run(0, "--scale Y=1/100");
    let ini = read(&folder, "mill.ini");
    has(&ini, "\n# trueaxis has in errors.toml: BACKLASH = 0.01\n");
    let errors = read(&folder, "errors.toml");
    let parameters: Vec<&str> = errors
        .lines()
        .filter(|line| line.starts_with('E'))
        .collect();
    let starts = ["EYY1 = -1e-5", "EXXb = 0.005"];
    assert_eq!(parameters.len(), 2, "{errors}");
    assert!(
        { starts }
            .iter()
            .zip(&parameters)
            .all(|(s, p)| p.starts_with(s)),
        "{errors}"
    );
}

#[test]
fn no_axis_moves_the_table_of_a_portal() {
    let folder = mill("");
    let words = format!(
        "linuxcnc start {} --yes --scale X=2/100 --table",
        folder.at("mill.ini")
    );
    let words: Vec<&str> = words.split_whitespace().chain([""]).collect();
    answer(0, &words);
    let machine = read(&folder, "machine.toml");
    assert!(!machine.contains("\"workpiece\""), "{machine}");
}

#[test]
fn wrong_readings_are_refused() {
    let folder = mill("");
    for (options, expected) in [
        ("--scale X=2", "--scale: `X=2` is not of the form X=2/100"),
        ("--scale X=2,5/100", "write a decimal point: X=2.5/100"),
        ("--square X=2/100", "--square: `X=2/100` is not"),
        ("--dial XY=2", "--dial: `XY=2` is not like X=-4"),
        ("--growth room=1/1", "--growth: `room=1/1` is not"),
        (
            "--square XY=2/100 --square YX=2/100",
            "EC0X has been measured twice",
        ),
    ] {
        let options = format!("--overwrite {options}");
        has(&start(2, &folder, &options), expected);
        assert!(!Path::new(&folder.at("errors.toml")).exists());
    }
    let said = start(0, &mill(""), "--table XY --overwrite --dial X=20");
    has(&said, "the opposite of lost motion");
    has(&said, "lost motion of 20 µm is X=-20");
    let said = start(2, &mill(""), "--table XA");
    has(&said, "--table: the machine has no linear axis A");
    refused(
        &["linuxcnc", "start", &folder.at("none.ini"), "--yes"],
        &["none.ini"],
    );
}

#[test]
fn a_second_run_replaces_the_readings_of_the_first() {
    let folder = mill("");
    // Without --install, `check` says what is missing in the INI file.
    let run = |more: &str| {
        let words = format!(
            "linuxcnc start {} --table XY --yes {more}",
            folder.at("mill.ini")
        );
        trueaxis(&words.split(' ').collect::<Vec<_>>())
    };
    run("--scale X=2/100");
    assert!(read(&folder, "errors.toml").contains("EXX1"));
    let done = run("--square XY=-3/100 --overwrite");
    let errors = read(&folder, "errors.toml");
    assert!(
        !errors.contains("EXX1") && errors.contains("EC0"),
        "{errors}"
    );
    assert!(read(&folder, "errors.toml.before-trueaxis").contains("EXX1"));
    let said = String::from_utf8(done.stdout).unwrap();
    has(&said, "errors.toml: 1 reading;");
}

#[test]
fn readings_that_are_not_understood_change_nothing() {
    let folder = mill("");
    let before = folder.names();
    for wrong in ["X=2:100", "W=2/100"] {
        let options = format!("--table XY --install --scale {wrong}");
        let said = start(2, &folder, &options);
        for part in ["--scale", wrong, "X=2/100"] {
            has(&said, part);
        }
        assert_eq!(folder.names(), before);
    }
}

#[test]
fn a_travel_that_is_not_known_is_not_invented() {
    let folder = mill("");
    let ini = read(&folder, "mill.ini");
    for key in ["MAX_LIMIT", "MIN_LIMIT"] {
        // Of the joint and of its axis, which counts as well.
        let (mut is_of_y, mut text) = (false, String::new());
        for line in ini.lines() {
            if line.starts_with('[') {
                is_of_y = ["[JOINT_1]", "[AXIS_Y]"].contains(&line);
            }
            if !(is_of_y && line.starts_with(key)) {
                text += &format!("{line}\n");
            }
        }
        assert_ne!(text, ini);
        folder.file("mill.ini", &text);
        let before = folder.names();
        let said = start(1, &folder, READINGS);
        has(&said, &format!("{key} of joint 1 is missing"));
        assert_eq!(folder.names(), before);
        assert_eq!(read(&folder, "mill.ini"), text);
    }
}

/// What the errors of a compensation are, by name.
fn parameters(folder: &Folder) -> Vec<String> {
    let errors = read(folder, "errors.toml");
    let lines = errors.lines().filter(|line| line.starts_with('E'));
    lines
        .filter_map(|line| Some(line.split_once(" = ")?.0.to_owned()))
        .collect()
}

#[test]
fn lines_are_taken_out_only_if_the_errors_have_what_they_compensated() {
    let backlash = "BACKLASH = 0.02\n";
    let set_up = |folder: &Folder| {
        let to = folder.path().display().to_string();
        let ini = folder.at("mill.ini");
        done(&format!("linuxcnc setup {ini} -o {to}"));
    };
    // Files of `setup` stay, and the reading is added to what they have.
    let folder = mill(backlash);
    set_up(&folder);
    let output = asked(
        &folder,
        &["mill.ini", "--scale", "Y=2/100", "--install"],
        "n\ny\n",
    );
    let said = plain(&output.stdout) + &plain(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert_eq!(parameters(&folder), ["EYY1", "EXXb"]);
    assert!(read(&folder, "mill.ini").contains(": BACKLASH = 0.02\n"));
    // Nothing is to be added: they are used as they are.
    let folder = mill(backlash);
    set_up(&folder);
    start(0, &folder, "--install");
    assert_eq!(parameters(&folder), ["EXXb"]);
    // They do not have it, or another one.
    for change in [None, Some("BACKLASH = 0.05")] {
        let folder = mill(backlash);
        set_up(&folder);
        match change {
            None => std::fs::remove_file(folder.at("errors.toml")).unwrap(),
            Some(other) => {
                let ini = read(&folder, "mill.ini");
                folder.file("mill.ini", ini.replace("BACKLASH = 0.02", other));
            }
        }
        let before = [folder.names().join(" "), read(&folder, "mill.ini")];
        has(
            &start(2, &folder, "--install --scale Y=2/100"),
            "it does not have what LinuxCNC compensates: BACKLASH = 0.0",
        );
        assert_eq!(
            [folder.names().join(" "), read(&folder, "mill.ini")],
            before
        );
        start(0, &folder, "--install --scale Y=2/100 --overwrite");
        assert_eq!(parameters(&folder), ["EYY1", "EXXb"]);
    }
}

#[test]
fn later_readings_are_added_to_what_linuxcnc_compensated() {
    let folder = mill("BACKLASH = 0.02\n");
    start(0, &folder, "--install");
    let with =
        |code, reading: &str| start(code, &folder, &format!("--overwrite --scale {reading}"));
    for (reading, parameter) in [("Y=2/100", "EYY1"), ("Z=2/100", "EZZ1")] {
        with(0, reading);
        assert_eq!(parameters(&folder), [parameter, "EXXb"]);
    }
    let before = read(&folder, "errors.toml");
    has(
        &with(2, "X=2/100"),
        "errors.toml already has what LinuxCNC compensated along X",
    );
    assert_eq!(read(&folder, "errors.toml"), before);
    // Without the component, and without BACKLASH, a new start would lose it.
    let now = read(&folder, "mill.ini").replace("HALFILE = trueaxis.hal\n", "");
    folder.file("mill.ini", now);
    has(&with(2, "Y=2/100"), "replacing it would lose that");
    assert_eq!(read(&folder, "errors.toml"), before);
}

#[test]
fn copies_of_earlier_runs_are_never_replaced() {
    let folder = mill("");
    let ini = folder.at("mill.ini");
    let original = read(&folder, "mill.ini");
    for (k, reading) in ["X=1/100", "X=2/100", "X=3/100"].into_iter().enumerate() {
        let options = format!("--install --overwrite --scale {reading}");
        start(0, &folder, &options);
        // The component is taken out by hand.
        let now = read(&folder, "mill.ini").replace("HALFILE = trueaxis.hal\n", "");
        folder.file("mill.ini", format!("# {k}\n{now}"));
    }
    assert_eq!(read(&folder, "mill.ini.before-trueaxis"), original);
    assert!(read(&folder, "mill.ini.before-trueaxis-2").starts_with("# 0\n"));
    assert!(read(&folder, "mill.ini.before-trueaxis-3").starts_with("# 1\n# 0\n"));
    assert!(read(&folder, "errors.toml.before-trueaxis").contains("+1.0 µm"));
    assert!(read(&folder, "errors.toml.before-trueaxis-2").contains("+2.0 µm"));
    // `setup` says where.
    let to = folder.at("to");
    let said = done(&format!("linuxcnc setup {ini} -o {to} --install"));
    has(&said, "mill.ini.before-trueaxis-4");
}

#[test]
fn nothing_is_written_while_it_asks() {
    let folder = mill("BACKLASH = 0.02\n");
    folder.file("errors.toml", "# mine\n");
    let before = folder.names();
    let mut running = Command::new(env!("CARGO_BIN_EXE_trueaxis"))
        .args(["linuxcnc", "start", "mill.ini", "--install"])
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut to = running.stdin.take().unwrap();
    to.write_all(b"y\nXY\n").unwrap();
    let (mut from, mut said) = (running.stdout.take().unwrap(), Vec::new());
    while !String::from_utf8_lossy(&said).contains("Scale along Y") {
        let mut byte = [0];
        assert_eq!(from.read(&mut byte).unwrap(), 1, "{}", plain(&said));
        said.extend(byte);
    }
    running.kill().unwrap();
    running.wait().unwrap();
    assert_eq!(folder.names(), before);
    assert_eq!(read(&folder, "errors.toml"), "# mine\n");
}

#[test]
fn what_install_wrote_is_taken_out_again() {
    let folder = mill("BACKLASH = 0.02\n");
    let original = read(&folder, "mill.ini");
    let remove = format!("linuxcnc start {} --remove", folder.at("mill.ini"));
    refused(
        &remove.split_whitespace().collect::<Vec<_>>(),
        &["it does not have what --install writes"],
    );
    start(0, &folder, "--install");
    let installed = read(&folder, "mill.ini");
    assert_ne!(installed, original);
    let names = folder.names();
    done(&remove);
    assert_eq!(read(&folder, "mill.ini"), original);
    assert_eq!(folder.names(), names);
    // With what was changed since.
    folder.file("mill.ini", format!("{installed}[OWN]\n"));
    done(&remove);
    assert_eq!(read(&folder, "mill.ini"), format!("{original}[OWN]\n"));
    // And it can be brought in again.
    start(0, &folder, "--install --overwrite");
    assert_eq!(read(&folder, "mill.ini"), format!("{installed}[OWN]\n"));
    let both = format!("{remove} --install");
    let output = trueaxis(&both.split_whitespace().collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(2));
    has(
        &plain(&output.stderr),
        "'--remove' cannot be used with '--install'",
    );
}

#[test]
fn a_compensation_from_elsewhere_is_never_lost() {
    for is_installed in [false, true] {
        let folder = mill("");
        if is_installed {
            start(0, &folder, "--install");
        }
        folder.file("machine.trax", "calibrated");
        let before = folder.names();
        let said = start(2, &folder, "--install --scale X=2/100");
        has(&said, "machine.trax exists: ");
        assert_eq!(folder.names(), before);
        assert_eq!(read(&folder, "machine.trax"), "calibrated");
        let said = start(0, &folder, "--install --scale X=2/100 --overwrite");
        has(&said, "machine.trax.before-trueaxis");
        assert_eq!(read(&folder, "machine.trax.before-trueaxis"), "calibrated");
    }
}

#[test]
fn a_spindle_that_grows_is_connected_and_compensated() {
    let folder = mill("");
    let with = |code, growth: &str| {
        let sensors = "--temperature room=ain.1 --temperature bearing=ain.0";
        let options = format!("--table XY --install {sensors} --growth {growth}");
        start(code, &folder, &options)
    };
    for (growth, expected) in [
        ("spindle=12/15", "`spindle=12/15` is not"),
        ("bearing=12", "`bearing=12` is not"),
        ("bearing=12/0", "`bearing=12/0` is not"),
    ] {
        let before = folder.names();
        has(&with(2, growth), expected);
        assert_eq!(folder.names(), before);
    }
    with(0, "bearing=12/15");
    let hal = read(&folder, "trueaxis.hal");
    // The compensation has the sensor of the growth only.
    for line in [
        "loadrt trueaxis file=machine.trax axes=XYZ units=[TRAJ]LINEAR_UNITS temperatures=2",
        "net trueaxis-temperature-0 ain.0 => trueaxis.temperature-0",
        "net trueaxis-temperature-1 ain.1 => trueaxis.temperature-1",
    ] {
        has(&hal, line);
    }
    // 10 K above the reference, Z goes 8 µm away from the table.
    let path = folder.file("path.csv", "X,Y,Z,bearing\n100,100,-50,0\n100,100,-50,10\n");
    let said = done(&format!(
        "eval {} --positions {path}",
        folder.at("machine.trax")
    ));
    let rows: Vec<&str> = said.lines().skip(1).collect();
    let z = |row: &str| {
        row.split(',')
            .nth(2)
            .unwrap()
            .trim()
            .parse::<f64>()
            .unwrap()
    };
    assert!((z(rows[1]) - z(rows[0]) - 8e-3).abs() < 1e-5, "{said}");
    // What is installed keeps its lines.
    let said = with(2, "bearing=12/15");
    has(&said, "it stays, and has no --temperature");
}
