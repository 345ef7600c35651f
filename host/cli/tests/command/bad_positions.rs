//! Positions that are refused, with line, column, cause and remedy.

use crate::program::{Folder, blob, example, refused};

/// Checks that both `eval` and `correct` refuse the positions at `line`.
fn refuses(text: &str, line: usize, cause: &str, remedy: &str) {
    let folder = Folder::new();
    let positions = folder.file("p.csv", text);
    let out = folder.at("out.csv");
    let place = format!("p.csv, line {line}:");
    let parts = [place.as_str(), cause, remedy];
    refused(
        &[
            "eval",
            &blob("kolibri"),
            "--positions",
            &positions,
            "-o",
            &out,
        ],
        &parts,
    );
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    refused(
        &[
            "correct",
            &machine,
            &errors,
            "--positions",
            &positions,
            "-o",
            &out,
        ],
        &parts,
    );
    assert_eq!(folder.names(), ["p.csv"]);
}

#[test]
fn a_wrong_header_is_refused() {
    refuses(
        "X,Y,Z,A,B\n1,2,3,4,5\n",
        1,
        "column 5: `B` is not a known column",
        "Y,A,C,X,Z",
    );
    refuses(
        "X,Y,Z,A\n1,2,3,4\n",
        1,
        "the column `C` is missing",
        "add axis C",
    );
    refuses(
        "X,Y,Z,A,C,X\n1,2,3,4,5,6\n",
        1,
        "column 6: `X` is listed twice",
        "keep one",
    );
    refuses(
        "X;Y;Z;A;C\n1;2;3;4;5\n",
        1,
        "the columns are separated by semicolons",
        "separate the columns with commas",
    );
    refuses(
        "X,Y,Z,A,C\n1;2;3;4;5\n",
        2,
        "the columns are separated by semicolons",
        "a decimal point",
    );
    refuses(
        "X,Y,Z,a,C\n1,2,3,4,5\n",
        1,
        "column 4: `a` is not a known column",
        "write A: upper and lower case matter",
    );
}

#[test]
fn an_extra_column_is_refused() {
    refuses(
        "X,Y,Z,A,C,feed\n1,2,3,4,5,6\n",
        1,
        "column 6: `feed` is not a known column",
        "exactly the inputs",
    );
    refuses(
        "X,Y,Z,A,C\n1,2,3,4,5\n1,2,3,4,5,6\n",
        3,
        "the row has 6 columns, the header has 5",
        "not a comma",
    );
    refuses(
        "X,Y,Z,A,C\n1,5,2,5,3,5,4,5,5,5\n",
        2,
        "the row has 10 columns, the header has 5",
        "with a decimal point, not a comma",
    );
}

#[test]
fn missing_values_are_refused() {
    refuses(
        "X,Y,Z,A,C\n1,2,3,4\n",
        2,
        "`C` is missing",
        "a value in each column",
    );
    refuses(
        "X,Y,Z,A,C\n1,2,,4,5\n",
        2,
        "column 3 (Z): the value is missing",
        "a value in each column",
    );
    refuses(
        "X,Y,Z,A,C\n",
        1,
        "no rows below the header",
        "one position per line",
    );
}

#[test]
fn what_is_no_finite_number_is_refused() {
    refuses(
        "X,Y,Z,A,C\n1,2,3,4,5\n1,2,3,4,nan\n",
        3,
        "column 5 (C): `nan` is not a finite number",
        "plain number",
    );
    refuses(
        "X,Y,Z,A,C\n1,-inf,3,4,5\n",
        2,
        "column 2 (Y): `-inf` is not a finite number",
        "plain number",
    );
    refuses(
        "X,Y,Z,A,C\n1,2,1e99,4,5\n",
        2,
        "column 3 (Z): 1e99 is too large for a position",
        "plain number",
    );
    refuses(
        "X,Y,Z,A,C\n1,2,3,4,five\n",
        2,
        "column 5 (C): `five` is not a finite number",
        "plain number",
    );
}

#[test]
fn a_missing_tool_length_is_refused() {
    let folder = Folder::new();
    let positions = folder.file("p.csv", "X,Y,Z,A,C\n1,2,3,4,5\n");
    refused(
        &["eval", &blob("length"), "--positions", &positions],
        &[
            "line 1:",
            "the column `tool length` is missing",
            "add the tool length in mm",
        ],
    );
}
