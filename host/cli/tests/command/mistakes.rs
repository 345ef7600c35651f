//! Deliberate versions of the most common mistakes in probings, and the messages about them.

use crate::program::{Folder, done, example, plain, trueaxis};

/// Probings of the Kolibri as a table that can be modified.
struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(text: &str) -> Self {
        let mut rows = text
            .lines()
            .map(|line| line.split(',').map(str::to_owned).collect());
        Self {
            header: rows.next().unwrap(),
            rows: rows.collect(),
        }
    }

    fn text(&self) -> String {
        let all = std::iter::once(&self.header).chain(&self.rows);
        all.map(|row| row.join(",") + "\n").collect()
    }

    fn column(&self, name: &str) -> usize {
        self.header
            .iter()
            .position(|column| column == name)
            .unwrap()
    }

    fn get(&self, row: usize, name: &str) -> f64 {
        self.rows[row][self.column(name)].parse().unwrap()
    }

    fn change(&mut self, row: usize, name: &str, change: impl Fn(f64) -> f64) {
        let column = self.column(name);
        self.rows[row][column] = format!("{:.9}", change(self.get(row, name)));
    }

    fn change_all(&mut self, names: &[&str], change: impl Fn(f64) -> f64) {
        for row in 0..self.rows.len() {
            for name in names {
                self.change(row, name, &change);
            }
        }
    }

    fn rows_of(&self, ball: &str) -> Vec<usize> {
        (0..self.rows.len())
            .filter(|row| self.rows[*row][0] == ball)
            .collect()
    }
}

const MACHINE: &str = "kolibri/machine.toml";

/// Simulates with a modified artefact, machine or plan.
fn simulated(folder: &Folder, changed: &[(&str, &str, &str)]) -> Table {
    let file = |name: &str| {
        let mut text = std::fs::read_to_string(example(&format!("kolibri/{name}"))).unwrap();
        for (_, from, to) in changed.iter().filter(|(of, _, _)| *of == name) {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        folder.file(name, text)
    };
    let [machine, artefact, plan] = ["machine.toml", "artefact.toml", "plan.csv"].map(file);
    let errors = example("kolibri/errors-10.toml");
    Table::read(&done(&format!(
        "simulate probings {machine} {errors} --artefact {artefact} --plan {plan} \
            --noise 1"
    )))
}

/// Replaces some rows by those of another table.
fn mixed(mut table: Table, other: &Table, rows: &[usize]) -> Table {
    for row in rows {
        table.rows[*row].clone_from(&other.rows[*row]);
    }
    table
}

/// Probings of which ball 2 has moved half way, and the line of the first row after that.
fn moved(folder: &Folder, to: &str) -> (Table, usize) {
    let good = simulated(folder, &[]);
    let moved = simulated(folder, &[("artefact.toml", "[-20.0, 75.0, 37.5]", to)]);
    let of_ball = good.rows_of("2");
    let from = of_ball.len() / 2;
    let line = of_ball[from] + 2;
    (mixed(good, &moved, &of_ball[from..]), line)
}

/// Exit code and standard error of `identify`.
fn said(folder: &Folder, table: &Table, more: &[&str]) -> (i32, String) {
    let probings = folder.file("spoilt.csv", table.text());
    let (machine, artefact) = (example(MACHINE), example("kolibri/artefact.toml"));
    let mut arguments = vec!["identify", &machine, &probings, "--model", "10"];
    if !more.contains(&"--artefact") {
        arguments.extend(["--artefact", &artefact]);
    }
    arguments.extend(more);
    let output = trueaxis(&arguments);
    (output.status.code().unwrap(), plain(&output.stderr))
}

/// Modifies good probings and checks the messages.
fn spoilt(code: i32, parts: &[&str], spoil: impl Fn(&mut Table)) {
    let folder = Folder::new();
    let mut table = simulated(&folder, &[]);
    spoil(&mut table);
    assert_said(said(&folder, &table, &[]), code, parts);
}

fn assert_said((code, said): (i32, String), expected: i32, parts: &[&str]) {
    assert_eq!(code, expected, "{said}");
    for part in parts {
        assert!(said.contains(part), "`{part}` is not in:\n{said}");
    }
}

const LINEAR: [&str; 3] = ["X", "Y", "Z"];

#[test]
fn good_probings_are_no_outliers() {
    let folder = Folder::new();
    let (code, said) = said(&folder, &simulated(&folder, &[]), &[]);
    assert_eq!((code, said.as_str()), (0, ""));
}

#[test]
fn axes_that_count_the_other_way_are_named() {
    for axis in ["X", "Y", "A", "C"] {
        let what = format!("the rows fit if {axis} counts the other way");
        spoilt(
            2,
            &[&what, &format!("correct the sign of the column {axis}")],
            |table| {
                table.change_all(&[axis], |v| -v);
            },
        );
    }
}

#[test]
fn a_mirrored_machine_is_told_by_its_places() {
    let parts = [
        "ball 1 was found at [-70.0, 20.0, 37.5] mm, 140.0 mm from the stated [70.0, 20.0, 37.5]",
        "the places fit if C and X count the other way",
    ];
    spoilt(2, &parts, |table| table.change_all(&["X", "C"], |v| -v));
}

#[test]
fn exchanged_columns_are_named() {
    spoilt(
        2,
        &["the rows fit if the columns Y and X are exchanged"],
        |table| {
            for row in &mut table.rows {
                row.swap(1, 4);
            }
        },
    );
    // A only reaches 120°.
    spoilt(2, &["outside the travel of -120 to 120"], |table| {
        for row in &mut table.rows {
            row.swap(2, 3);
        }
    });
}

#[test]
fn rotary_positions_of_another_row_are_told() {
    for (word, late) in [("after", true), ("before", false)] {
        let what = format!("each has the rotary positions of the row {word} it");
        spoilt(2, &[&what], |table| {
            let rows = table.rows.clone();
            for (row, cells) in table.rows.iter_mut().enumerate() {
                let from = if late {
                    row.saturating_sub(1)
                } else {
                    (row + 1).min(rows.len() - 1)
                };
                cells[2..4].clone_from_slice(&rows[from][2..4]);
            }
        });
    }
}

#[test]
fn units_are_told() {
    for (mm, what) in [(25.4, "inches"), (1000.0, "metres")] {
        spoilt(
            2,
            &[&format!("their linear positions look like {what}")],
            |table| {
                table.change_all(&LINEAR, |v| v / mm);
            },
        );
    }
    spoilt(2, &["look like radians"], |table| {
        table.change_all(&["A", "C"], f64::to_radians)
    });
    // Without stated positions of balls, the machine itself provides lengths.
    let folder = Folder::new();
    let mut table = simulated(&folder, &[]);
    table.change_all(&LINEAR, |v| v / 25.4);
    let empty = folder.file("empty.toml", "");
    let said = said(&folder, &table, &["--artefact", &empty]);
    assert_said(
        said,
        2,
        &["the stylus is 74.000 mm, but 2.9", "look like inches"],
    );
}

#[test]
fn a_zero_of_a_rotary_axis_that_is_elsewhere_is_told() {
    let parts = ["the rows fit if zero of A is -5.", "orientation_deg of A"];
    spoilt(2, &parts, |table| table.change_all(&["A"], |v| v + 5.0));
}

#[test]
fn positions_against_the_workpiece_are_told() {
    let what = "positions of the tool against the workpiece (tool centre point control was on)";
    spoilt(
        2,
        &[what, "write the positions of the machine's axes"],
        |table| {
            for ball in ["1", "2", "3", "4"] {
                let rows = table.rows_of(ball);
                let first = table.rows[rows[0]].clone();
                for row in rows {
                    for name in LINEAR {
                        let column = table.column(name);
                        table.rows[row][column].clone_from(&first[column]);
                    }
                }
            }
        },
    );
}

#[test]
fn a_row_under_the_name_of_another_ball_is_named() {
    spoilt(
        2,
        &[
            "line 132 looks like a probing of ball 4",
            "--without \"line 132\"",
        ],
        |table| {
            table.rows[130][0] = "2".to_owned();
        },
    );
}

#[test]
fn a_digit_too_many_is_named() {
    spoilt(
        2,
        &[
            "line 12: the tip is",
            "mm (k = 2) from where the other rows put it",
        ],
        |table| {
            table.change(10, "X", |v| v - 100.0);
        },
    );
}

#[test]
fn balls_under_each_other_s_names_are_told_by_their_places() {
    let parts = ["balls 1 and 2 are exchanged", "say --accept-places"];
    let spoil = |table: &mut Table| {
        for row in &mut table.rows {
            row[0] = match row[0].as_str() {
                "1" => "2".to_owned(),
                "2" => "1".to_owned(),
                other => other.to_owned(),
            };
        }
    };
    spoilt(2, &parts, spoil);
    let folder = Folder::new();
    let mut table = simulated(&folder, &[]);
    spoil(&mut table);
    assert_said(said(&folder, &table, &["--accept-places"]), 0, &[]);
}

#[test]
fn outliers_are_named_and_can_be_left_out() {
    let lines = [18, 36, 147];
    let folder = Folder::new();
    let mut table = simulated(&folder, &[]);
    for line in lines {
        table.change(line - 2, "X", |v| v + 0.05);
    }
    let parts = lines.map(|line| format!("line {line}: the tip is"));
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    let (code, text) = said(&folder, &table, &[]);
    assert_said((code, text.clone()), 0, &parts);
    assert_eq!(
        text.matches("from where the other rows put it").count(),
        3,
        "{text}"
    );
    let without: Vec<String> = lines
        .iter()
        .map(|line| format!("--without=line {line}"))
        .collect();
    let without: Vec<&str> = without.iter().map(String::as_str).collect();
    assert_eq!(said(&folder, &table, &without), (0, String::new()));
}

#[test]
fn more_than_a_tenth_of_outliers_is_no_result() {
    spoilt(1, &["21 of 168 rows fit badly (lines 2, 10, 18"], |table| {
        for row in (0..168).step_by(8) {
            table.change(row, "X", |v| v + 0.05);
        }
    });
}

#[test]
fn a_ball_that_has_moved_is_named_with_its_row() {
    let folder = Folder::new();
    let (table, line) = moved(&folder, "[-20.0, 75.03, 37.54]");
    let what = format!("before line {line}: look whether it is loose");
    let parts = ["ball 2 has moved by", what.as_str(), "--without \"ball 2\""];
    assert_said(said(&folder, &table, &[]), 1, &parts);
    // Robust or not, it is a ball and not single rows.
    assert_said(said(&folder, &table, &["--robust"]), 1, &parts);
    assert_eq!(
        said(&folder, &table, &["--without", "ball 2"]),
        (0, String::new())
    );
}

#[test]
fn a_ball_that_has_moved_is_named_before_the_bar_that_it_ends() {
    let folder = Folder::new();
    let (table, line) = moved(&folder, "[-20.1, 75.0, 37.5]");
    let artefact = std::fs::read_to_string(example("kolibri/artefact.toml")).unwrap();
    // As long as the balls are apart: (90, 55, 0).
    let bar = "\n[[bar]]\nballs = [\"1\", \"2\"]\nlength_mm = 105.4751\nstandard_uncertainty_mm = 0.0005\n";
    let artefact = folder.file("bar.toml", artefact + bar);
    let (code, said) = said(&folder, &table, &["--artefact", &artefact]);
    assert_ne!(code, 0);
    let place = said.find(&format!("before line {line}")).expect(&said);
    let ball = said.find("ball 2 has moved by").expect(&said);
    assert!(ball < place, "{said}");
    let bar = said.find("bar from").unwrap_or(said.len());
    assert!(ball < bar && !said.contains("correct the length"), "{said}");
}

#[test]
fn a_stylus_that_has_bent_is_named_with_its_row() {
    let folder = Folder::new();
    let good = simulated(&folder, &[]);
    let bent = simulated(
        &folder,
        &[("machine.toml", "[0.0, 0.0, -74.0]", "[0.03, 0.0, -74.0]")],
    );
    let table = mixed(good, &bent, &(90..168).collect::<Vec<_>>());
    let parts = [
        "the stylus has moved by",
        "before line 92: look whether it is bent",
    ];
    assert_said(said(&folder, &table, &[]), 1, &parts);
}

#[test]
fn an_index_that_was_missed_is_named() {
    let folder = Folder::new();
    let good = simulated(&folder, &[]);
    let missed = simulated(&folder, &[("plan.csv", "15,60", "15,60.01")]);
    let at: Vec<usize> = (0..good.rows.len())
        .filter(|row| good.get(*row, "C") == 60.0)
        .collect();
    let mut table = mixed(good, &missed, &at);
    for row in at {
        table.change(row, "C", |_| 60.0);
    }
    let parts = ["at C = 60, C was off by 1", "--without \"C = 60\""];
    assert_said(said(&folder, &table, &[]), 1, &parts);
}

#[test]
fn a_stated_stylus_that_is_wrong_is_named() {
    let folder = Folder::new();
    let table = simulated(&folder, &[]);
    let own = std::fs::read_to_string(example("kolibri/artefact.toml")).unwrap();
    let stylus = "\n[stylus]\ntip_mm = [0.0, 0.0, -75.0]\nlength_standard_uncertainty_mm = 0.002\n";
    let artefact = folder.file("wrong.toml", own + stylus);
    let parts = ["the stated stylus, which is -75.000 ± 0.002 mm in z but -74.0"];
    assert_said(said(&folder, &table, &["--artefact", &artefact]), 2, &parts);
}

#[test]
fn places_and_a_tip_that_are_wrong_are_refused() {
    let folder = Folder::new();
    let table = simulated(&folder, &[]);
    let own = std::fs::read_to_string(example("kolibri/artefact.toml")).unwrap();
    let other = own.replace("[70.0, 20.0, 37.5]", "[170.0, 20.0, 37.5]");
    let artefact = folder.file("wrong.toml", other);
    let parts = [
        "ball 1 was found at [70.0, 20.0, 37.5] mm, 100.0 mm from the stated",
        "say --accept-places",
    ];
    assert_said(said(&folder, &table, &["--artefact", &artefact]), 2, &parts);
    // The tip in the machine file belongs to another tool.
    let far = simulated(
        &folder,
        &[("machine.toml", "[0.0, 0.0, -74.0]", "[0.0, 0.0, -104.0]")],
    );
    let parts = [
        "stylus was found at [0.0, 0.0, -104.0] mm, 30.0 mm from the stated",
        "correct tip_mm",
    ];
    assert_said(said(&folder, &far, &[]), 2, &parts);
}

#[test]
fn what_is_named_wrong_to_be_left_out_is_refused() {
    let folder = Folder::new();
    let table = simulated(&folder, &[]);
    for (rows, what) in [
        ("line 4000", "no row is line 4000"),
        ("ball 9", "no row is ball 9"),
        (
            "Q = 3",
            "is neither a line, nor a ball, nor a position of an axis",
        ),
        ("", "is neither a line"),
    ] {
        assert_said(said(&folder, &table, &["--without", rows]), 2, &[what]);
    }
}

#[test]
fn what_is_outlier_is_on_the_page_too() {
    let folder = Folder::new();
    let mut table = simulated(&folder, &[]);
    table.change(20, "X", |v| v + 0.05);
    let page = folder.at("page.html");
    let (code, _) = said(&folder, &table, &["--report", &page]);
    assert_eq!(code, 0);
    let page = std::fs::read_to_string(page).unwrap();
    for part in [
        "What does not go with the other rows",
        "line 22: the tip is",
        "outliers",
    ] {
        assert!(page.contains(part), "{part}");
    }
}
