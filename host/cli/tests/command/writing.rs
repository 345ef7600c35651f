//! Files are written completely or not at all.

use crate::program::{Folder, answer, blob, done, example, has, plain, refused, split};
use std::process::{Command, Output, Stdio};

/// `eval` of many positions into the existing `old.csv`, with a limit of 1 block per file.
#[cfg(unix)]
fn limited(folder: &Folder, prelude: &str) -> Output {
    let rows = "50,10,20,30,40\n".repeat(500);
    let positions = folder.file("p.csv", format!("Y,A,C,X,Z\n{rows}"));
    let old = folder.file("old.csv", "old");
    let script =
        format!("{prelude} ulimit -f 1; exec \"$0\" eval \"$1\" --positions \"$2\" -o \"$3\"");
    Command::new("sh")
        .args([
            "-c",
            &script,
            env!("CARGO_BIN_EXE_trueaxis"),
            &blob("kolibri"),
            &positions,
            &old,
        ])
        .output()
        .unwrap()
}

#[test]
#[cfg(unix)]
fn a_write_that_is_interrupted_leaves_the_old_file() {
    let folder = Folder::new();
    // The limit kills the program by a signal in the middle of writing.
    let output = limited(&folder, "ulimit -c 0;");
    assert_eq!(output.status.code(), None, "{}", plain(&output.stderr));
    assert_eq!(std::fs::read(folder.at("old.csv")).unwrap(), b"old");
    // The next run removes the leftover, even one that writes nothing.
    let partial = ".old.csv.trueaxis-partial";
    assert_eq!(folder.names(), [partial, "old.csv", "p.csv"]);
    let (old, bad) = (folder.at("old.csv"), folder.file("bad.csv", "Y,A\n1,2\n"));
    refused(
        &["eval", &blob("kolibri"), "--positions", &bad, "-o", &old],
        &["bad.csv"],
    );
    assert_eq!(folder.names(), ["bad.csv", "old.csv", "p.csv"]);
    assert_eq!(std::fs::read(folder.at("old.csv")).unwrap(), b"old");
}

#[test]
fn a_file_left_behind_is_gone_after_the_next_run() {
    let folder = Folder::new();
    let positions = folder.file("p.csv", "Y,A,C,X,Z\n1,2,3,4,5\n");
    folder.file(".out.csv.trueaxis-partial", "half of it");
    let out = folder.at("out.csv");
    done(&format!(
        "eval {} --positions {positions} -o {out}",
        blob("kolibri")
    ));
    assert_eq!(folder.names(), ["out.csv", "p.csv"]);
}

#[test]
fn runs_at_the_same_time_leave_one_whole_file() {
    let folder = Folder::new();
    let blob = blob("kolibri");
    let out = folder.at("out.csv");
    let mut wholes = Vec::new();
    let mut runs = Vec::new();
    for number in 1..=6 {
        let rows = format!("{number},10,20,30,40\n").repeat(200 * number);
        let positions = folder.file(&format!("p{number}.csv"), format!("Y,A,C,X,Z\n{rows}"));
        wholes.push(answer(0, &["eval", &blob, "--positions", &positions]));
        runs.push(positions);
    }
    let mut running: Vec<std::process::Child> = runs
        .iter()
        .map(|positions| {
            Command::new(env!("CARGO_BIN_EXE_trueaxis"))
                .args(["eval", &blob, "--positions", positions, "-o", &out])
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap()
        })
        .collect();
    for run in &mut running {
        assert!(run.wait().unwrap().success());
    }
    assert!(wholes.contains(&std::fs::read_to_string(&out).unwrap()));
    assert!(folder.names().iter().all(|name| !name.starts_with('.')));
}

#[test]
#[cfg(unix)]
fn a_write_that_fails_leaves_the_old_file_and_nothing_else() {
    let folder = Folder::new();
    // With the signal ignored, the write fails instead, as on a full disk.
    let output = limited(&folder, "trap '' XFSZ;");
    let said = plain(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    has(&said, "old.csv: cannot be written");
    has(&said, "help: give a name in an existing folder");
    assert_eq!(std::fs::read(folder.at("old.csv")).unwrap(), b"old");
    assert_eq!(folder.names(), ["old.csv", "p.csv"]);
}

#[test]
fn a_folder_that_is_not_there_is_an_error() {
    let folder = Folder::new();
    let positions = folder.file("p.csv", "Y,A,C,X,Z\n1,2,3,4,5\n");
    let nowhere = folder.at("nowhere/out.csv");
    refused(
        &split(&format!(
            "eval {} --positions {positions} -o {nowhere}",
            blob("kolibri")
        )),
        &["cannot be written: there is no folder", "make the folder"],
    );
    let itself = folder.path().to_str().unwrap();
    refused(
        &split(&format!(
            "eval {} --positions {positions} -o {itself}",
            blob("kolibri")
        )),
        &["cannot be written"],
    );
}

#[test]
fn an_input_is_never_written_over() {
    let folder = Folder::new();
    let positions = folder.file("p.csv", "Y,A,C,X,Z\n1,2,3,4,5\n");
    let copy = folder.at("k.trax");
    std::fs::copy(blob("kolibri"), &copy).unwrap();
    refused(
        &["eval", &copy, "--positions", &positions, "-o", &positions],
        &["is the input", "another name"],
    );
    refused(
        &["eval", &copy, "--positions", &positions, "-o", &copy],
        &["is the input", "another name"],
    );
    let machine = folder.at("machine.toml");
    std::fs::copy(example("kolibri/machine.toml"), &machine).unwrap();
    let errors = example("kolibri/errors-12.toml");
    refused(
        &["compile", &machine, &errors, "-o", &machine],
        &["is the input", "another name"],
    );
}

#[test]
#[cfg(unix)]
fn a_new_file_can_be_read_by_others() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let positions = folder.file("p.csv", "Y,A,C,X,Z\n1,2,3,4,5\n");
    let out = folder.at("out.csv");
    done(&format!(
        "eval {} --positions {positions} -o {out}",
        blob("kolibri")
    ));
    let mode = |path: &str| std::fs::metadata(path).unwrap().permissions().mode();
    // Like any file that this test creates.
    assert_eq!(mode(&out), mode(&positions));
}

#[test]
fn shells_and_man_know_every_command() {
    let folder = Folder::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = answer(0, &["completions", shell]);
        for word in ["iso230-2", "report", "identification"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let said = answer(0, &["man", &folder.at("")]);
    let names = folder.names();
    assert!(
        said.starts_with(&format!("{} pages in", names.len())),
        "{said}"
    );
    for name in [
        "trueaxis.1",
        "trueaxis-compile.1",
        "trueaxis-iso230-2.1",
        "trueaxis-linuxcnc-start.1",
        "trueaxis-control-tool-length.1",
    ] {
        assert!(names.contains(&name.to_owned()), "{names:?}");
    }
    let page = std::fs::read_to_string(folder.at("trueaxis-report.1")).unwrap();
    has(&page, "identification");
    has(&page, ".TH trueaxis-report 1");
    let nested = std::fs::read_to_string(folder.at("trueaxis-linuxcnc-start.1")).unwrap();
    has(&nested, ".TH trueaxis-linuxcnc-start 1");
    has(&nested, "trueaxis linuxcnc start");
    let parent = std::fs::read_to_string(folder.at("trueaxis-linuxcnc.1")).unwrap();
    has(&parent, "linuxcnc\\-start(1)");
    refused(
        &["man", &folder.at("nowhere")],
        &["there is no such folder"],
    );
}

#[test]
fn a_dash_is_the_screen_where_text_is_written() {
    let folder = Folder::new();
    let positions = folder.file("p.csv", "Y,A,C,X,Z\n50,10,20,30,40\n");
    let blob = blob("kolibri");
    let words = ["eval", &blob, "--positions", &positions];
    let printed = answer(0, &words);
    let plan = example("kolibri/plan.csv");
    let line = format!(
        "simulate probings {} {} --artefact {} --plan {plan}",
        example("kolibri/machine.toml"),
        example("kolibri/errors-10.toml"),
        example("kolibri/artefact.toml")
    );
    let simulated = split(&line);
    for (words, printed) in [
        (&words[..], printed),
        (&simulated[..], answer(0, &simulated)),
    ] {
        let done = Command::new(env!("CARGO_BIN_EXE_trueaxis"))
            .args(words)
            .args(["-o", "-"])
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert_eq!(done.status.code(), Some(0));
        assert_eq!(String::from_utf8(done.stdout).unwrap(), printed);
        // Where the line about the file goes.
        assert!(
            plain(&done.stderr).contains("-:"),
            "{}",
            plain(&done.stderr)
        );
    }
    let [machine, errors] =
        ["machine.toml", "errors-10.toml"].map(|name| example(&format!("kolibri/{name}")));
    refused(&["compile", &machine, &errors, "-o", "-"], &["is not text"]);
    refused(
        &["gcode", &positions, "--compensation", &blob, "-o", "-"],
        &["read back"],
    );
    assert_eq!(folder.names(), ["p.csv"]);
}

#[test]
fn a_message_that_nobody_reads_is_no_panic() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueaxis"));
    let command = command.args(["pose", "no-such-machine.toml"]);
    let mut running = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop((running.stdout.take(), running.stderr.take()));
    assert_eq!(running.wait().unwrap().code(), Some(2));
}
