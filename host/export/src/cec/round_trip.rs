//! Tests that convert compensations to files and back, and compare with an independent reader.

use super::specimen::*;
use super::*;
use trueaxis::Draft;

#[track_caller]
pub(crate) fn round_trips(draft: &Draft) {
    let blob = draft.encode().unwrap();
    for factor_tables in BOTH {
        let (_, text) = written(&blob, &options(factor_tables)).unwrap();
        let [told, again] = differences(&blob, &text, factor_tables, 0.0);
        assert!(
            told < ROUNDING && again < ROUNDING,
            "{factor_tables:?}: {told} {again}\n{text}"
        );
        let (plan, twice) =
            written(&imported(&text, factor_tables), &options(factor_tables)).unwrap();
        assert!(plan.is_literal, "{factor_tables:?}: {text}");
        assert_eq!(text, twice);
    }
}

#[test]
fn single_tables_backlash_and_modulo_round_trip_under_both_readings() {
    round_trips(&with(
        tables(),
        vec![
            term(0, 1.0, &[0]),
            term(0, -0.5, &[1]),
            term(1, 0.01, &[2]),
            term(2, 0.003, &[3]),
        ],
    ));
    round_trips(&with(
        tables(),
        vec![term(0, 1.0, &[4]), term(3, 2.0, &[5]), term(0, 1.0, &[6])],
    ));
}

#[test]
fn products_round_trip_under_both_readings() {
    round_trips(&with(
        tables(),
        vec![
            term(0, 1.0, &[0, 2]),
            term(0, 1.0, &[0]),
            term(0, 0.5, &[1, 2]),
            term(1, 1.0, &[1, 3]),
            term(2, 0.3, &[3, 0]),
        ],
    ));
}

#[test]
fn products_with_directions_round_trip_under_both_readings() {
    // One factor that depends on direction, on either side; both; and a signed one.
    round_trips(&with(
        tables(),
        vec![
            term(0, 1.0, &[4, 2]),
            term(0, 1.0, &[1, 4]),
            term(1, 1.0, &[6, 3]),
        ],
    ));
    round_trips(&with(
        tables(),
        vec![term(0, 100.0, &[4, 5]), term(0, 50.0, &[6, 5])],
    ));
}

#[test]
fn a_factor_holds_in_both_directions_where_one_of_two_does() {
    // Whichever is written first, and whichever more products share.
    let terms = vec![
        term(0, 1.0, &[4, 2]),
        term(0, 1.0, &[1, 4]),
        term(0, 1.0, &[3, 4]),
    ];
    let blob = with(tables(), terms).encode().unwrap();
    for factor_tables in BOTH {
        let (plan, _) = written(&blob, &options(factor_tables)).unwrap();
        let factors = plan.tables.iter().filter_map(|t| t.times);
        for factor in factors {
            assert_eq!(plan.tables[factor].travel, TravelDirection::Both);
        }
    }
}

#[test]
fn a_factor_is_copied_for_each_axis_and_shared_by_products_of_one() {
    let draft = with(
        tables(),
        vec![
            term(0, 1.0, &[0, 2]),
            term(0, 1.0, &[0, 3]),
            term(1, 1.0, &[0, 2]),
        ],
    );
    let blob = draft.encode().unwrap();
    for factor_tables in BOTH {
        let (plan, _) = written(&blob, &options(factor_tables)).unwrap();
        let count = |axis| plan.tables.iter().filter(|t| t.output == axis).count();
        assert_eq!([count(0), count(1)], [3, 2]);
    }
    round_trips(&draft);
}

#[test]
fn constants_and_sums_over_the_same_points_are_one_table() {
    let mut draft = with(
        tables(),
        vec![
            term(0, 1.0, &[0]),
            term(0, 2.0, &[0]),
            term(0, 0.01, &[]),
            term(3, 0.2, &[]),
        ],
    );
    draft.banks[0].columns.push(vec![0.001, 0.002]);
    draft.terms.push(term(0, 1.0, &[1]));
    draft.terms.push(term(1, 0.02, &[3]));
    let (plan, _) = written(&draft.encode().unwrap(), &options(FactorTables::NotAdded)).unwrap();
    assert_eq!(plan.tables.len(), 3);
    round_trips(&draft);
}

#[test]
fn numbers_of_tables_begin_where_others_end() {
    let blob = with(tables(), vec![term(0, 1.0, &[0, 2])])
        .encode()
        .unwrap();
    let mut options = options(FactorTables::NotAdded);
    options.limits.first = 7;
    let (_, text) = written(&blob, &options).unwrap();
    assert!(
        text.contains("$AN_CEC[7,0]=") && text.contains("\n$AN_CEC_MULT_BY_TABLE[8]=8\n"),
        "{text}"
    );
    let again = written(&imported(&text, FactorTables::NotAdded), &options)
        .unwrap()
        .1;
    assert_eq!(text, again);
}

#[test]
fn a_file_in_any_order_is_the_same_file_from_its_first_export_on() {
    let draft = with(
        tables(),
        vec![
            term(0, 1.0, &[0, 2]),
            term(1, 0.5, &[1]),
            term(1, 0.5, &[1, 3]),
        ],
    );
    let blob = draft.encode().unwrap();
    for factor_tables in BOTH {
        let (plan, _) = written(&blob, &options(factor_tables)).unwrap();
        let mut tables = plan.tables;
        tables.reverse();
        let last = tables.len() - 1;
        for table in &mut tables {
            table.times = table.times.map(|times| last - times);
        }
        let turned = print(&tables, &axes(), 0, &[]);
        let [told, _] = differences(&blob, &turned, factor_tables, 0.0);
        assert!(told < ROUNDING, "{told}");
        let (plan, first) =
            written(&imported(&turned, factor_tables), &options(factor_tables)).unwrap();
        assert!(plan.is_literal);
        let (_, second) =
            written(&imported(&first, factor_tables), &options(factor_tables)).unwrap();
        assert_eq!(first, second);
    }
}
