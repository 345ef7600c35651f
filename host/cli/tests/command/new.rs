//! `new`: the files that it begins with, and what it refuses.

use crate::program::{Folder, answer, has, plain, refused, trueaxis};

const TRAVEL: &str = "X=500,Y=0:400,Z=300";

fn layouts() -> Vec<[String; 2]> {
    let listed = answer(0, &["new", "--list"]);
    let words = |line: &str| {
        let mut words = line.split_whitespace().map(str::to_owned);
        [(); 2].map(|()| words.next().unwrap())
    };
    listed.lines().map(words).collect()
}

#[test]
fn every_kind_begins_with_files_that_the_other_commands_take() {
    let kinds = layouts();
    assert_eq!(kinds.len(), 7);
    for [kind, layout] in kinds {
        let folder = Folder::new();
        let at = folder.at("new");
        let said = answer(0, &["new", &at, "--kind", &kind, "--travel", TRAVEL]);
        has(&said, &layout);
        let [machine, errors] = ["machine.toml", "errors.toml"].map(|name| format!("{at}/{name}"));
        answer(0, &["pose", &machine, "--at", "X=10"]);
        let text = std::fs::read_to_string(&errors).unwrap();
        assert_eq!(text.matches("e-6").count(), 6, "{text}");
        // What the comments say is what may be written.
        let measured = text.replace("# E", "E").replace("\nErrors", "\n# Errors");
        std::fs::write(&errors, measured).unwrap();
        let read = answer(0, &["explain", &machine, &errors]);
        assert_eq!(
            read.matches("e-6,").count() + read.matches("e-6:").count(),
            6,
            "{read}"
        );
    }
}

#[test]
fn answers_become_the_machine_in_mm() {
    let folder = Folder::new();
    let at = folder.at("");
    let travel = "X=-10:10,Y=20,Z=0:10,A=-30:120";
    let options = ["--unit", "inch", "--tool", "4", "--name", "Say \"cheese\""];
    let words = [
        "new", &at, "--kind", "trunnion", "--travel", travel, "--rotary", "C=0,0,-2",
    ];
    answer(0, &[&words[..], &options].concat());
    let text = std::fs::read_to_string(folder.at("machine.toml")).unwrap();
    for line in [
        "name = \"Say \\\"cheese\\\"\"",
        "range = [-254.0, 254.0]",
        "range = [0.0, 254.0]",
        "range = [-30.0, 120.0]",
        "origin_mm = [0.0, 0.0, -50.8]",
        "tip_mm = [0.0, 0.0, -101.6]",
    ] {
        has(&text, line);
    }
}

#[test]
fn nothing_is_overwritten_and_wrong_answers_write_nothing() {
    let folder = Folder::new();
    let at = folder.at("");
    let wrong: [(&[&str], &str); 8] = [
        (&[], "--kind and --travel missing"),
        (&["--kind", "mill"], "--travel missing"),
        (&["--travel", TRAVEL], "--kind missing"),
        (
            &["--kind", "mill", "--travel", "X=500"],
            "travels are missing",
        ),
        (
            &["--kind", "mill", "--travel", "X=1,Y=2,Z=3,C=9"],
            "no axis C",
        ),
        (
            &["--kind", "mill", "--travel", "X=5:1,Y=2,Z=3"],
            "has no length",
        ),
        (&["--layout", "wXXFZt", "--travel", TRAVEL], "twice"),
        (
            &["--kind", "mill", "--travel", TRAVEL, "--rotary", "X=0,0,0"],
            "not a rotary axis",
        ),
    ];
    for (words, cause) in wrong {
        refused(&[&["new", at.as_str()], words].concat(), &[cause]);
        assert!(folder.names().is_empty());
    }
    folder.file("errors.toml", "mine");
    let done = trueaxis(&["new", &at, "--kind", "mill", "--travel", TRAVEL]);
    assert_eq!(done.status.code(), Some(2));
    assert!(plain(&done.stderr).contains("is there already"));
    assert_eq!(folder.names(), ["errors.toml"]);
}

#[test]
fn the_next_command_is_within_the_travel() {
    let folder = Folder::new();
    for (number, travel) in [
        "X=-4:0,Y=-4:0,Z=-4:0",
        "X=-40:0,Y=-40:0,Z=-40:0",
        "X=3,Y=3,Z=3",
    ]
    .iter()
    .enumerate()
    {
        let at = folder.at(&format!("{number}"));
        let said = answer(0, &["new", &at, "--kind", "mill", "--travel", travel]);
        let next = said.split_once("trueaxis pose ").unwrap().1;
        let words: Vec<&str> = next.lines().next().unwrap().split_whitespace().collect();
        let shown = trueaxis(&[&["pose"], &words[..]].concat());
        assert_eq!(plain(&shown.stderr), "", "{said}");
        assert!(!words.last().unwrap().ends_with("=0"), "{said}");
    }
}

#[test]
fn without_a_tool_the_tip_is_100_mm_away_in_any_unit() {
    for unit in ["mm", "inch"] {
        let folder = Folder::new();
        let at = folder.at("");
        let words = [
            "new", &at, "--kind", "mill", "--unit", unit, "--travel", TRAVEL,
        ];
        answer(0, &words);
        let text = std::fs::read_to_string(folder.at("machine.toml")).unwrap();
        has(&text, "tip_mm = [0.0, 0.0, -100.0]");
    }
}
