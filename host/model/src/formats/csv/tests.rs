use super::*;
use serde::Deserialize;
use toml::Spanned;

/// Reads columns A and B.
fn read(text: &str) -> Result<Vec<[f64; 2]>, FileError> {
    let table = CsvTable::open(text, 0, "write A,B", "write numbers")?;
    let columns = table.columns(0, |name| ["A", "B"].iter().position(|n| *n == name))?;
    if columns.len() < 2 {
        return Err(table.missing("B"));
    }
    let numbers = |row: CsvRow<'_>| Ok([row.number(0)?, row.number(1)?]);
    table.map(|row| numbers(row?)).collect()
}

#[test]
fn quotes_blank_lines_and_line_ends_do_not_matter() {
    let text = "\u{feff}\r\n \"A\" , B\r\n\r\n1, \"-2.5\"\r\n  \n3e1,4";
    assert_eq!(read(text).unwrap(), [[1.0, -2.5], [30.0, 4.0]]);
    assert_eq!(line_of(text, 1), Some(4));
    assert_eq!(line_of(text, 2), Some(6));
    assert_eq!(line_of(text, 3), None);
    assert_eq!(&text[place(text, 4, "B")], "\"-2.5\"");
    assert_eq!(place(text, 5, "B"), 0..0);
    let spaced = CsvTable::without_header("\u{feff} 1\t2 \n", 0, &[], "").spaced();
    let row = spaced.last().unwrap().unwrap();
    assert_eq!((row.cells[1].text, row.cells[1].span.clone()), ("2", 6..7));
}

#[test]
fn every_mistake_is_reported_with_line_and_place() {
    for (text, line, marked, message, remedy) in [
        (
            "A;B\n",
            1,
            ";",
            "the columns are separated by semicolons",
            "separate the columns with commas, and write numbers with a decimal point: 12.5,-3",
        ),
        (
            "A,B\n1\t2\n",
            2,
            "\t",
            "the columns are separated by tabs",
            "separate the columns with commas, and write numbers with a decimal point: 12.5,-3",
        ),
        (
            "A,Q\n",
            1,
            "Q",
            "column 2: `Q` is not a known column",
            "write A,B",
        ),
        (
            "A,b\n",
            1,
            "b",
            "column 2: `b` is not a known column",
            "write B: upper and lower case matter",
        ),
        ("A,,B\n", 1, "A,,B", "column 2 has no name", "write A,B"),
        (
            "A,B,\"A\"\n",
            1,
            "\"A\"",
            "column 3: `A` is listed twice",
            "keep one of the two columns",
        ),
        ("\nA\n1\n", 2, "A", "the column `B` is missing", "write A,B"),
        (
            "A,B\n\n",
            1,
            "A,B",
            "there are no rows below the header",
            "write A,B",
        ),
        (
            "A,B\n1\n",
            2,
            "1",
            "the row has 1 columns, the header has 2",
            "write numbers",
        ),
        (
            "A,B\n1,2\n1,2,3,4\n",
            3,
            "3,4",
            "the row has 4 columns, the header has 2",
            "write numbers",
        ),
        (
            "A,B\n1,\n",
            2,
            "1,",
            "column 2 (B): the value is missing",
            "write numbers",
        ),
        (
            "A,B\n1, two\n",
            2,
            "two",
            "column 2 (B): `two` is not a finite number",
            "write numbers",
        ),
        (
            "A,B\n1,1e999\n",
            2,
            "1e999",
            "column 2 (B): `1e999` is not a finite number",
            "write numbers",
        ),
    ] {
        let error = read(text).unwrap_err();
        assert_eq!(error.message, message);
        assert_eq!(error.remedy, remedy, "{text}");
        assert_eq!(error.line(text), Some(line), "{text}");
        assert_eq!(&text[error.span.unwrap()], marked, "{text}");
    }
    assert_eq!(read("\u{feff}\n").unwrap_err().message, "the file is empty");
}

#[test]
fn a_heading_keeps_its_places() {
    #[derive(Deserialize)]
    struct Heading {
        unit: Spanned<String>,
    }
    let text = "\u{feff}# unit = \"µm\"\r\n\r\n  # # a comment\r\nA,B\r\n1,2\r\n#3,4\r\n";
    let (heading, end) = heading::<Heading>(text, "").unwrap();
    assert_eq!(&text[heading.unit.span()], "\"µm\"");
    let mut table = CsvTable::open(text, end, "", "").unwrap();
    assert_eq!(&text[table.header.span.clone()], "A,B");
    assert_eq!(table.next().unwrap().unwrap().line, 5);
    let error = table.next().unwrap().unwrap_err();
    assert_eq!(error.message, "there is a line with # below the header");
    assert_eq!(error.line(text), Some(6));
    let error = super::heading::<Heading>("# unit = 1\nA,B\n", "write it").err();
    let error = error.unwrap();
    assert_eq!(
        (error.remedy.as_str(), error.span),
        ("write it", Some(9..10))
    );
}

#[test]
fn numbers_that_do_not_increase_are_refused() {
    let mut table = CsvTable::without_header("5\n5\n", 0, &["target"], "");
    let first = table.next().unwrap().unwrap();
    assert_eq!(first.increasing(0, None, ""), Ok(5.0));
    let second = table.next().unwrap().unwrap();
    assert_eq!(
        second.increasing(0, Some(5.0), "").unwrap_err().message,
        "column 1 (target): the values must increase, but 5 follows 5"
    );
}
