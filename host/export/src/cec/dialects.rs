//! Tests of file dialects and of faulty files.

use super::read::*;
use super::reading::*;
use super::{FactorTables, Limited, NamedAxes, TravelDirection};
use crate::refusals::are_refused;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

fn reader(text: &str, change: impl Fn(&mut ReadOptions<'_>)) -> Result<CecContent, FileError> {
    let machine = include_str!("../../../../examples/huron-k2x8/machine.toml");
    let map = "X=AX1,Y=AX2,Z=AX3,A=A_1,C=C1";
    let axes = NamedAxes::of(&Machine::from_toml(machine).unwrap(), map).unwrap();
    let mut reading = ReadOptions {
        axes: &axes,
        factor_tables: FactorTables::NotAdded,
        units: None,
        encoder: None,
    };
    change(&mut reading);
    read(text, &reading)
}

/// A table with values from a list, and additional lines.
fn table(number: usize, values: &[&str], more: &[&str]) -> String {
    let mut text = String::new();
    for (k, value) in values.iter().enumerate() {
        text += &format!("$AN_CEC[{number},{k}]={value}\n");
    }
    for (name, value) in [
        ("INPUT_AXIS", "AX3"),
        ("OUTPUT_AXIS", "AX1"),
        ("STEP", "50"),
        ("MIN", "-100"),
        ("MAX", "0"),
        ("IS_MODULO", "0"),
        ("DIRECTION", "0"),
        ("MULT_BY_TABLE", "0"),
    ] {
        let name = format!("$AN_CEC_{name}[{number}]=");
        match more.iter().find(|line| line.starts_with(&name)) {
            Some(line) => text += line,
            None => text += &(name + value),
        }
        text += "\n";
    }
    text
}

/// A file with these tables, whose weights are 1 unless they have others.
fn file(body: &str) -> String {
    let states = |name: &str, table| body.contains(&format!("${name}[{table}]="));
    let plain = (0..9).filter(|t| states("AN_CEC_STEP", *t) && !states("SN_CEC_TABLE_WEIGHT", *t));
    let weights: String = plain
        .map(|t| format!("$SN_CEC_TABLE_WEIGHT[{t}]=1\n"))
        .collect();
    format!("%_N_NC_CEC_INI\nMETRIC\nCHANDATA(1)\n{body}{weights}M17\n")
}

const VALUES: [&str; 3] = ["0.004", "0.002", "-0.001"];

#[test]
fn the_sample_of_the_document_is_a_product_and_a_table() {
    // As in the document's Figure 7.3: the second table names the number of the first.
    let body = table(0, &VALUES, &[])
        + &table(
            1,
            &VALUES,
            &["$AN_CEC_MULT_BY_TABLE[1]=1", "$AN_CEC_INPUT_AXIS[1]=AX2"],
        )
        + &table(2, &VALUES, &["$AN_CEC_INPUT_AXIS[2]=AX1"]);
    let found = reader(&file(&body), |_| {}).unwrap();
    assert!(found.doubts.is_empty(), "{:?}", found.doubts);
    let [factor, product, single] = &found.tables[..] else {
        panic!("{:?}", found.tables);
    };
    assert_eq!(
        (factor.times, product.times, single.times),
        (None, Some(0), None)
    );
    assert_eq!([factor.input, product.input, single.input], [4, 0, 3]);
    assert_eq!(factor.values, [0.004, 0.002, -0.001]);
    let spacing = factor.spacing;
    assert_eq!(
        (spacing.start, spacing.step, spacing.points),
        (-100.0, 50.0, 3)
    );
}

/// The program of the document's Figure 7.3, as printed.
const FIGURE_7_3: &str = include_str!("figure_7_3.mpf");

/// Like `FIGURE_7_3`, with zeros for the values that the figure leaves out: those between the third and the last two.
fn figure_7_3() -> String {
    let mut text = String::new();
    let mut left_out = [(0, 3..8), (1, 3..13), (2, 3..13)].into_iter();
    for line in FIGURE_7_3.lines() {
        if line == "..." {
            let (table, values) = left_out.next().unwrap();
            for i in values {
                text += &format!("$AN_CEC[{table},{i}]=0\n");
            }
        } else {
            text += &format!("{line}\n");
        }
    }
    text
}

#[test]
fn the_program_of_figure_7_3_has_a_value_beyond_the_end_of_its_third_table() {
    let refused = reader(&figure_7_3(), |_| {}).unwrap_err();
    assert_eq!(refused.message, "value 14 of table 2 is beyond MAX");
    // Without it, it is the product of the first two tables and a third: of 10, 15 and 14 values.
    let read = figure_7_3().replace("$AN_CEC[2,14]=-0.034\n", "");
    let found = reader(&read, |_| {}).unwrap();
    let counts: Vec<_> = found.tables.iter().map(|t| t.values.len()).collect();
    assert_eq!(counts, [10, 15, 14]);
    let times: Vec<_> = found.tables.iter().map(|t| t.times).collect();
    assert_eq!(times, [None, Some(0), None]);
    assert_eq!(found.tables[2].values[13], -0.021);
}

#[test]
fn dialects_are_read_as_the_same_tables() {
    let plain = reader(&file(&table(0, &VALUES, &[])), |_| {})
        .unwrap()
        .tables;
    let text = file(&table(0, &VALUES, &[]));
    for other in [
        text.replace(",", "."),
        text.replace("AX3", "(AX3)").replace("AX1", "\"AX1\""),
        text.replace('\n', " ; a comment\r\n"),
        text.to_lowercase(),
        text.replace("0.004", "4EX-3"),
        text.replace("MULT_BY_TABLE[0]=0", "MULT_BY_TABLE[0]=0.0"),
        text.replace("$AN_CEC_IS_MODULO", "$AA_CEC_COMP_IS_MODULO"),
        text.replace("M17", "M0"),
        text.replace("M17\n", ""),
        text.replace("M17", "$SN_CEC_TABLE_ENABLE[0]=1"),
        text.replace("$SN_CEC_TABLE_WEIGHT[0]=1\n", ""),
    ] {
        let found = reader(&other, |_| {});
        assert_eq!(found.unwrap().tables, plain, "{other}");
    }
    let cut = reader(&text.replace("M17\n", ""), |_| {}).unwrap();
    assert_eq!(cut.doubts[0].message, "the file ends without M17");
    let without = text
        .replace("$AN_CEC_MULT_BY_TABLE[0]=0\n", "")
        .replace("$SN_CEC_TABLE_WEIGHT[0]=1\n", "")
        .replace("IS_MODULO[0]=0", "IS_MODULO[0]=-1");
    let found = reader(&without, |_| {}).unwrap();
    assert_eq!(found.tables, plain);
    let said: Vec<&str> = found.doubts.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(
        said,
        [
            "table 0 has no $SN_CEC_TABLE_WEIGHT: taken as 1",
            "$AN_CEC_IS_MODULO=-1 is taken as 0",
            "table 0 has no $AN_CEC_MULT_BY_TABLE: taken as 0"
        ]
    );
}

#[test]
fn directions_weights_and_inches_are_kept() {
    let mut body = table(0, &VALUES, &["$AN_CEC_DIRECTION[0]=1"])
        + &table(1, &VALUES, &["$AN_CEC_DIRECTION[1]=-1"]);
    body += "$SN_CEC_TABLE_WEIGHT[1]=0.5\n";
    let found = reader(&file(&body).replace("METRIC", "INCH"), |_| {})
        .unwrap()
        .tables;
    assert_eq!(
        [found[0].travel, found[1].travel],
        [TravelDirection::Positive, TravelDirection::Negative]
    );
    assert_eq!([found[0].weight, found[1].weight], [1.0, 0.5]);
    // Lengths are in units of 25.4 mm; degrees are unchanged.
    assert_eq!(
        (found[0].spacing.step, found[0].values[0]),
        (1270.0, 0.1016)
    );
    let body = table(
        0,
        &VALUES,
        &["$AN_CEC_INPUT_AXIS[0]=A_1", "$AN_CEC_OUTPUT_AXIS[0]=C1"],
    );
    for units in ["METRIC", "INCH"] {
        let found = reader(&file(&body).replace("METRIC", units), |_| {})
            .unwrap()
            .tables;
        assert_eq!((found[0].spacing.step, found[0].values[0]), (50.0, 0.004));
    }
}

#[test]
fn a_table_that_repeats_has_both_ends_and_the_blob_one() {
    let more = [
        "$AN_CEC_IS_MODULO[0]=1",
        "$AN_CEC_STEP[0]=90",
        "$AN_CEC_MAX[0]=260",
        "$AN_CEC_INPUT_AXIS[0]=C1",
    ];
    let values = ["0.001", "0.002", "0.003", "0.002", "0.001"];
    let found = reader(&file(&table(0, &values, &more)), |_| {})
        .unwrap()
        .tables;
    assert_eq!(found[0].values, [0.001, 0.002, 0.003, 0.002]);
    let spacing = found[0].spacing;
    assert!(spacing.modulo && spacing.points == 4 && spacing.end() == 260.0);
    for (from, to, cause) in [
        (
            "4]=0.001",
            "4]=0.0011",
            "the first and the last value of table 0 differ",
        ),
        ("STEP[0]=90", "STEP[0]=89.9", "STEP goes 4.00444"),
        (
            "STEP[0]=90",
            "STEP[0]=360",
            "value 2 of table 0 is beyond MAX",
        ),
    ] {
        let text = file(&table(0, &values, &more)).replace(from, to);
        let error = reader(&text, |_| {}).unwrap_err();
        assert!(error.message.contains(cause), "{}", error.message);
    }
}

#[test]
fn a_measuring_system_is_read_once_it_is_said_what_its_values_are() {
    let mut text = "METRIC\n".to_owned();
    for (k, value) in VALUES.iter().enumerate() {
        text += &format!("$AA_ENC_COMP[0,{k},AX2]={value}\n");
    }
    for line in [
        "STEP[0,AX2]=50",
        "MIN[0,AX2]=-100",
        "MAX[0,AX2]=0",
        "IS_MODULO[0,AX2]=0",
    ] {
        text += &format!("$AA_ENC_COMP_{line}\n");
    }
    let error = reader(&text, |_| {}).unwrap_err();
    assert!(error.remedy.contains("--encoder-values"), "{error}");
    for (values, first) in [
        (EncoderValues::Corrections, 0.004),
        (EncoderValues::Opposite, -0.004),
    ] {
        let found = reader(&text, |r| r.encoder = Some(values)).unwrap().tables;
        assert_eq!(
            (found[0].input, found[0].output, found[0].values[0]),
            (0, 0, first)
        );
    }
    let both = text.clone() + &text.replace("[0,", "[1,").replace("METRIC\n", "");
    let error = reader(&both, |r| r.encoder = Some(EncoderValues::Corrections)).unwrap_err();
    assert!(error.message.contains("both encoders"), "{error}");
}

#[test]
fn limits_are_in_the_unit_of_the_file() {
    let tables = table(0, &VALUES, &[]) + "$MA_CEC_MAX_SUM[AX2]=2\n$MA_CEC_MAX_VELO[AX2]=5\n";
    for (unit, sum) in [("METRIC", 2.0), ("INCH", 2.0 * 25.4)] {
        let text = file(&tables).replace("METRIC", unit);
        let found = reader(&text, |_| {}).unwrap().limits;
        let found: Vec<_> = found.iter().map(|l| (l.axis, l.limited, l.value)).collect();
        let expected = [(0, Limited::Sum, sum), (0, Limited::Velocity, 5.0)];
        assert_eq!(found, expected);
    }
}

const NOT_UNDERSTOOD: &str = r"$AN_CEC[0,1]=0.002\n | | 4 | value 1 of table 0 is missing
$AN_CEC[0,2]=-0.001\n | | 4 | value 2 of table 0 is missing
[0,2] | [0,7] | 4 | values 2 to 6 of table 0 are missing
M17 | ... | 16 | values are left out
M17 | $AA_ENC_COMP_DIRECTION[0,AX1]=0 | 16 | not one of the compensation
M17 | $AA_ENC_COMP[0,0]=0 | 16 | are not the indices
M17 | $AA_ENC_COMP_MIN[0,AX99]=0 | 16 | not in the map
M17 | $MA_CEC_MAX_SUM[AX1]=1\n$MA_CEC_MAX_SUM[AX1]=1 | 17 | a second time
M17 | $MA_CEC_MAX_SUM[AX1]=-1 | 16 | is a number from 0
M17 | $MA_CEC_MAX_VELO[AX99]=1 | 16 | not in the map
M17 | $MA_CEC_MAX_SUM[0,AX1]=1 | 16 | are not the indices
M17 | $AN_CEC[0,3]=0 | 16 | value 3 of table 0 is beyond MAX
M17 | $AN_CEC[0,2]=0 | 16 | a second time
M17 | M17\nMETRIC | 17 | after the end
M17 | INCH | 16 | other unit
M17 | $MN_MM_CEC_MAX_POINTS[0]=3 | 16 | not one of the compensation
METRIC\n | | 3 | whether it is metric
=AX3 | =AX4 | 7 | `AX4` is not in the map
0.002 | 0,002 | 5 | not a number
0.002 | 2e-3 | 5 | not a number
0.002 | NAN | 5 | not a number
[0,1] | [0,-1] | 5 | not the indices of $AN_CEC
[0,1] | [0] | 5 | not the indices of $AN_CEC
$AN_CEC_MIN[0]=-100\n | | 4 | has no $AN_CEC_MIN
$AN_CEC_OUTPUT_AXIS[0]=AX1\n | | 4 | has no $AN_CEC_OUTPUT_AXIS
STEP[0]=50 | STEP[0]=0 | 9 | STEP of table 0 is not between
STEP[0]=50 | STEP[0]=500 | 9 | STEP of table 0 is not between
STEP[0]=50 | STEP[0]=1EX-300 | 9 | STEP of table 0 make more than 99999
MAX[0]=0 | MAX[0]=-100 | 11 | not above MIN
MODULO[0]=0 | MODULO[0]=2 | 12 | neither 0 nor 1
DIRECTION[0]=0 | DIRECTION[0]=2 | 13 | none of 0, 1 and -1
TABLE[0]=0 | TABLE[0]=2 | 14 | table 1, which is not in the file
TABLE[0]=0 | TABLE[0]=0.5 | 14 | not a number of a table
M17 | $SN_CEC_TABLE_ENABLE[0]=0 | 16 | switched off";

#[test]
fn what_is_not_understood_is_refused_at_its_line() {
    let text = file(&table(0, &VALUES, &[]));
    are_refused(&text, NOT_UNDERSTOOD, |text| reader(text, |_| {}));
    let error = reader("METRIC\n; nothing\nM17\n", |_| {}).unwrap_err();
    assert!(error.message.contains("no table"));
}

#[test]
fn products_that_nobody_knows_the_meaning_of_are_refused() {
    let body = |more: [&[&str]; 3]| {
        let each = (0..3).map(|t| table(t, &VALUES, more[t]));
        file(&each.collect::<String>())
    };
    let by_0 = "$AN_CEC_MULT_BY_TABLE[1]=1";
    let plain = body([&[], &[by_0], &[]]);
    let weighted = |table| {
        let weight = format!("WEIGHT[{table}]=");
        plain.replace(&format!("{weight}1"), &format!("{weight}2"))
    };
    for (text, added, cause) in [
        (
            body([&[], &[by_0, "$AN_CEC_OUTPUT_AXIS[1]=AX2"], &[]]),
            false,
            "correct different axes",
        ),
        (
            body([&["$AN_CEC_MULT_BY_TABLE[0]=1"], &[], &[]]),
            true,
            "by itself",
        ),
        (
            body([&["$AN_CEC_MULT_BY_TABLE[0]=3"], &[by_0], &[]]),
            false,
            "is itself multiplied",
        ),
        (plain.replace("METRIC", "INCH"), false, "in inches"),
        (weighted(0), false, "has a weight"),
        (weighted(1), false, "has a weight"),
    ] {
        let error = reader(&text, |r| {
            if added {
                r.factor_tables = FactorTables::Added;
            }
        });
        let error = error.unwrap_err();
        assert!(error.message.contains(cause), "{error}");
    }
    // If factors are not added, a square is a product like any other.
    let square = body([&["$AN_CEC_MULT_BY_TABLE[0]=1"], &[], &[]]);
    assert_eq!(reader(&square, |_| {}).unwrap().tables[0].times, Some(0));
}

/// The lines and the messages of what is doubted in a file.
fn said(text: &str) -> Vec<(usize, String)> {
    let doubts = reader(text, |_| {}).unwrap().doubts;
    let said = doubts.iter();
    said.map(|d| (d.line(text).unwrap(), d.message.clone()))
        .collect()
}

#[test]
fn what_is_hardly_meant_is_warned_of_at_its_line() {
    let steep = file(&table(0, &["0", "0.4", "0.5"], &[]));
    let [(5, message)] = &said(&steep)[..] else {
        panic!("{:?}", said(&steep));
    };
    assert!(
        message.contains("X(Z) changes by 8.000 µm/mm from -100 to -50"),
        "{message}"
    );
    let more = ["$AN_CEC_STEP[0]=10", "$AN_CEC_MAX[0]=-30"];
    let outlier = file(&table(
        0,
        &[
            "0", "0.001", "0.002", "-0.03", "0.004", "0.005", "0.006", "0.007",
        ],
        &more,
    ));
    let [(7, message)] = &said(&outlier)[..] else {
        panic!("{:?}", said(&outlier));
    };
    assert!(
        message.contains("stands out at -70: -0.03 mm between 0.002 and 0.004"),
        "{message}"
    );
}

#[test]
fn a_factor_with_a_direction_is_warned_of_at_its_line_and_a_multiplier_is_not() {
    for (index, warned) in [(0, false), (1, true)] {
        let direction = format!("$AN_CEC_DIRECTION[{index}]=1");
        let values = ["0.001", "0.002", "0.003"];
        let mut more = [vec!["$AN_CEC_MULT_BY_TABLE[0]=2"], vec![]];
        more[index].push(&direction);
        let text = file(&(table(0, &values, &more[0]) + &table(1, &values, &more[1])));
        let said = said(&text);
        assert_eq!(said.len(), usize::from(warned), "{said:?}");
        if let [(line, message)] = &said[..] {
            assert!(message.contains("DIRECTION"), "{message}");
            assert!(text.lines().nth(line - 1).unwrap().contains(&direction));
        }
    }
}

#[test]
fn a_rounded_step_is_warned_of_at_its_line() {
    // A third of 100 mm.
    let values = ["0", "0.001", "0.002", "0.003"];
    let rounded = file(&table(0, &values, &["$AN_CEC_STEP[0]=33"]));
    let [(10, message)] = &said(&rounded)[..] else {
        panic!("{:?}", said(&rounded));
    };
    assert!(
        message.contains("the last point of table 0 is at -1, not at MAX = 0"),
        "{message}"
    );
    assert!(
        said(&file(&table(
            0,
            &values,
            &["$AN_CEC_STEP[0]=33.3333333333"]
        )))
        .is_empty()
    );
}
