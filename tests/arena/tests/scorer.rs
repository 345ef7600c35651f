//! The scorer: what is exact is exact, what is right is scored as it is, what is wrong is refused.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use trueaxis_arena::{
    Answer, Baseline, Class, Hidden, ROUND, Score, Stated, answers, export, folder, mark,
    of_the_truth, score, scored,
};

/// Of the class `three axes`, which takes least time.
const QUICK: usize = 0;

#[test]
fn the_kinematic_correction_of_the_true_errors_leaves_nothing_at_the_tip() {
    for number in [0, 1, 2, 5] {
        let hidden = Hidden::new(ROUND, number);
        let score = Score::of(&hidden, &of_the_truth(&hidden).unwrap());
        // The correction is iterated until it changes by less than 1e-9 mm and rad, on levers of up to 1 m.
        assert!(score.tip < 1e-3, "{} µm", score.tip);
        assert_eq!(score.parameters, Some(0.0));
        assert_eq!(score.parameter_interval, Some(0.0));
        assert!(!score.is_worse);
    }
}

#[test]
fn no_correction_leaves_everything_and_is_not_worse_than_itself() {
    let hidden = Hidden::new(ROUND, QUICK);
    let score = Score::of(&hidden, &Answer::none(hidden.task.positions.len()));
    assert!(score.tip > 1.0);
    assert_eq!((score.parameters, score.within), (Some(1.0), [0.0; 2]));
    assert!(!score.is_worse);
}

#[test]
fn a_failure_counts_as_no_correction_and_is_kept() {
    let hidden = Hidden::new(ROUND, QUICK);
    let none = Score::of(&hidden, &Answer::none(hidden.task.positions.len()));
    let failed = scored(
        &hidden,
        "any".to_owned(),
        Err("it does not converge".to_owned()),
    );
    assert_eq!(failed.score, none);
    assert_eq!(failed.failure.as_deref(), Some("it does not converge"));
}

#[test]
fn corrections_with_the_wrong_sign_are_worse_than_nothing() {
    let hidden = Hidden::new(ROUND, QUICK);
    let mut answer = of_the_truth(&hidden).unwrap();
    for q in answer.corrections.iter_mut().flatten() {
        *q = -*q;
    }
    assert!(Score::of(&hidden, &answer).is_worse);
}

#[test]
fn a_round_repeats_and_another_seed_is_another_round() {
    let [one, same, other] = [3, 3, 4].map(|round| Hidden::new(round, QUICK));
    assert_eq!(one.task.measured, same.task.measured);
    assert_eq!(one.truth, same.truth);
    assert_ne!(mark(&one.task), mark(&other.task));
    assert_ne!(one.truth, other.truth);
}

#[test]
fn machines_take_the_classes_in_turn() {
    for number in 0..12 {
        assert_eq!(Class::of(number), Class::ALL[number % 6]);
    }
    let hidden = Hidden::new(ROUND, 5);
    assert_eq!(hidden.task.machine.axes.len(), 6);
}

/// A submission with the answer of a baseline for the first machine.
fn submission(hidden: &Hidden, answer: &Answer) -> TempDir {
    let at = TempDir::new().unwrap();
    let heading = format!("name = \"mine\"\nround = \"{}\"\n", mark(&hidden.task));
    fs::write(at.path().join("submission.toml"), heading).unwrap();
    let own = at.path().join(folder(QUICK));
    fs::create_dir(&own).unwrap();
    let machine = &hidden.task.machine;
    let letters: Vec<String> = machine.axes.iter().map(|a| a.letter.to_string()).collect();
    let mut corrections = letters.join(",") + "\n";
    for dq in &answer.corrections {
        let dq = machine.to_command(dq);
        let cells: Vec<String> = dq[..letters.len()].iter().map(f64::to_string).collect();
        let _ = writeln!(corrections, "{}", cells.join(","));
    }
    fs::write(own.join("corrections.csv"), corrections).unwrap();
    let mut bands = "band_um,band_urad\n".to_owned();
    for [tip, direction] in &answer.bands {
        let _ = writeln!(bands, "{},{}", tip * 1e3, direction * 1e6);
    }
    fs::write(own.join("bands.csv"), bands).unwrap();
    let mut parameters = "parameter,value,band\n".to_owned();
    for (parameter, stated) in &answer.parameters {
        let _ = writeln!(parameters, "{parameter},{},{}", stated.value, stated.band);
    }
    fs::write(own.join("parameters.csv"), parameters).unwrap();
    at
}

#[test]
fn a_submission_gets_the_scores_of_the_answer_that_it_was_written_from() {
    let hidden = Hidden::new(ROUND, QUICK);
    let (_, answer) = answers(&hidden.task)
        .into_iter()
        .find(|(baseline, _)| *baseline == Baseline::Kinematics)
        .unwrap();
    let answer = answer.unwrap();
    let at = submission(&hidden, &answer);
    // The second machine has no folder.
    let scores = score(at.path(), ROUND, 2).unwrap();
    let mine: Vec<_> = scores.iter().filter(|s| s.name == "mine").collect();
    let (found, wanted) = (mine[0].score, Score::of(&hidden, &answer));
    // Degrees and µm there and back: the last digit of f64.
    for (a, b) in [
        (found.tip, wanted.tip),
        (found.direction, wanted.direction),
        (found.interval[0], wanted.interval[0]),
        (found.interval[1], wanted.interval[1]),
        (found.parameters.unwrap(), wanted.parameters.unwrap()),
        (
            found.parameter_interval.unwrap(),
            wanted.parameter_interval.unwrap(),
        ),
    ] {
        assert!((a - b).abs() < 1e-9 * b, "{a} {b}");
    }
    assert_eq!(mine[0].failure, None);
    assert_eq!(mine[1].failure.as_deref(), Some("there is no answer"));
    let mut none = scores.iter().filter(|s| s.name == "none");
    assert_eq!(none.next_back().unwrap().score, mine[1].score);
}

#[test]
fn a_wrong_submission_is_refused_with_its_place_and_a_remedy() {
    let hidden = Hidden::new(ROUND, QUICK);
    let asked = hidden.task.asked[0];
    let answer = Answer {
        parameters: [(asked, Stated::default())].into(),
        ..Answer::none(hidden.task.positions.len())
    };
    let refused = |file: &str, change: &dyn Fn(&Path)| {
        let at = submission(&hidden, &answer);
        change(&at.path().join(file));
        score(at.path(), ROUND, 1).unwrap_err().to_string()
    };
    let edited = |file: &str, from: &str, to: &str| {
        refused(file, &|path| {
            let text = fs::read_to_string(path).unwrap();
            assert!(text.contains(from), "{text}");
            fs::write(path, text.replacen(from, to, 1)).unwrap();
        })
    };
    let letters = hidden.task.machine.axes.iter();
    let letters: Vec<String> = letters.map(|a| a.letter.to_string()).collect();
    let header = letters.join(",");
    let cases = [
        (
            edited("submission.toml", "round = \"", "round = \"0"),
            "submission.toml line 2: round 0",
            "--seed",
        ),
        (
            edited("submission.toml", "mine", "none"),
            "submission.toml line 1: the name `none`",
            "another name",
        ),
        (
            refused("submission.toml", &|path| fs::remove_file(path).unwrap()),
            "it is missing",
            "the round of arena.toml",
        ),
        (
            edited("000/corrections.csv", &header, "X,Y,Q"),
            "corrections.csv line 1",
            "write the header",
        ),
        (
            edited("000/corrections.csv", "\n0,0,0", "\n0,0,nothing"),
            "corrections.csv line 2",
            "write a number",
        ),
        (
            edited("000/corrections.csv", "\n0,0,0", "\n0,0,500"),
            "a correction of 500",
            "write a number",
        ),
        (
            edited("000/corrections.csv", "\n0,0,0", ""),
            "there are 499 rows for 500 positions",
            "in the same order",
        ),
        (
            edited("000/bands.csv", "\n0,0", "\n-1,0"),
            "bands.csv line 2: column 1 (band_um)",
            "not negative",
        ),
        (
            edited("000/parameters.csv", "band\n", "band\nEXX9,0,0\n"),
            "parameters.csv line 2: column 1 (parameter): `EXX9` is not asked for",
            "asked.csv",
        ),
        (
            edited(
                "000/parameters.csv",
                "band\n",
                &format!("band\n{asked},0,0\n"),
            ),
            "is there twice",
            "each parameter once",
        ),
        (
            refused("000/corrections.csv", &|path| {
                fs::remove_file(path).unwrap();
            }),
            "neither compensation.trax nor corrections.csv",
            "leave out the folder",
        ),
        (
            refused("000/compensation.trax", &|path| {
                fs::write(path, "text").unwrap();
            }),
            "are both there",
            "leave out one",
        ),
    ];
    for (found, place, remedy) in cases {
        assert!(found.contains(place), "{found}\nhas not: {place}");
        assert!(found.contains(remedy), "{found}\nhas not: {remedy}");
    }
}

#[test]
fn what_is_exported_is_public_and_nothing_else() {
    let at = TempDir::new().unwrap();
    let round = at.path().join("round");
    export(&round, ROUND, 1).unwrap();
    let names = |path: &Path| {
        let entries = fs::read_dir(path).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    };
    assert_eq!(names(&round), ["000", "CITATION.cff", "arena.toml"]);
    let own = round.join("000");
    let public = ["asked.csv", "machine.toml", "points.csv", "positions.csv"];
    assert_eq!(names(&own), public);
    // Names of parameters, no values.
    let asked = fs::read_to_string(own.join("asked.csv")).unwrap();
    assert!(!asked.contains([',', '=']));
    // An existing folder is left alone.
    assert!(export(&round, ROUND, 1).is_err());
}
