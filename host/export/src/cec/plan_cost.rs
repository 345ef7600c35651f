//! Tests of the cost of a plan, and of its limits.

use super::oracle::AssignedValues;
use super::round_trip::round_trips;
use super::specimen::*;
use super::*;
use trueaxis::{Auxiliary, AuxiliaryKind, Direction, Interpolation};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::validate::{Command, Runtime};

#[test]
fn three_tables_of_two_axes_are_two_after_resampling() {
    let mut draft = with(
        tables(),
        vec![term(0, 0.5, &[2, 2, 1]), term(1, 0.01, &[2, 2])],
    );
    draft.banks[2].interpolation = Interpolation::Cubic;
    let blob = draft.encode().unwrap();
    for factor_tables in BOTH {
        let (plan, text) = written(&blob, &options(factor_tables)).unwrap();
        assert!(matches!(
            plan.notes[0],
            Note::Resampled {
                output: 'X',
                input: 'A',
                ..
            }
        ));
        // A quarter of the tolerance, which is 0.05 µm.
        let [told, again] = differences(&blob, &text, factor_tables, 0.0);
        let most = 0.25 * 0.05e-3 + ROUNDING;
        assert!(told < most && again < most, "{told} {again}");
    }
}

#[test]
fn products_of_three_axes_cost_what_is_said() {
    let terms = vec![term(0, 0.1, &[1, 2, 3]), term(1, 1.0, &[1])];
    let blob = with(tables(), terms).encode().unwrap();
    let refused = written(&blob, &options(FactorTables::NotAdded)).unwrap_err();
    let CecError::Long(long) = &refused else {
        panic!("{refused}");
    };
    // 0.1 · 20 µm · 1 · 1.
    let cost = long[0].dropped;
    assert!((cost - 2.0).abs() < 1e-3, "{refused}");
    let mut options = options(FactorTables::NotAdded);
    options.long = LongProducts::Drop;
    let (_, text) = written(&blob, &options).unwrap();
    let [told, _] = differences(&blob, &text, FactorTables::NotAdded, 0.0);
    let told = 1e3 * told;
    assert!(told <= cost + 1e-3 && told > 0.9 * cost, "{told} of {cost}");
}

#[test]
fn a_function_of_one_direction_is_not_constant_however_flat_it_is() {
    // Backlash of C multiplied by functions of X and A.
    let terms = vec![term(0, 100.0, &[0, 2, 5]), term(1, 1.0, &[1])];
    let blob = with(tables(), terms).encode().unwrap();
    let error = written(&blob, &options(FactorTables::Added)).unwrap_err();
    let CecError::Long(long) = &error else {
        panic!("{error}");
    };
    // 100 · 12 µm · 1 · 0.002
    assert!((long[0].dropped - 2.4).abs() < 1e-3, "{error}");
}

#[test]
fn tables_hold_for_one_tool_length() {
    let mut draft = with(
        tables(),
        vec![
            term(0, 0.01, &[7, 2]),
            term(0, 1.0, &[0, 2]),
            term(1, 1.0, &[7]),
        ],
    );
    draft.auxiliaries.push(Auxiliary {
        kind: AuxiliaryKind::ToolLength,
        name: "tool length".try_into().unwrap(),
        reference: 120.0,
        sensor: trueaxis::Sensor::USUAL,
    });
    draft
        .banks
        .push(bank(4, [0.0, 200.0], Direction::Both, &[0.0, 0.2]));
    let blob = draft.encode().unwrap();
    for (asked, length) in [(None, 120.0), (Some(60.0), 60.0)] {
        for factor_tables in BOTH {
            let mut options = options(factor_tables);
            options.length = asked;
            let (plan, text) = written(&blob, &options).unwrap();
            assert_eq!(plan.length, Some(f64::from(length)));
            let [told, again] = differences(&blob, &text, factor_tables, length);
            assert!(told < ROUNDING && again < ROUNDING, "{told} {again}");
        }
    }
    let mut options = options(FactorTables::Added);
    options.length = Some(201.0);
    let outside = CecError::Length {
        length: 201.0,
        range: [0.0, 200.0],
    };
    assert_eq!(written(&blob, &options).unwrap_err(), outside);
    options.length = Some(1.0);
    let without = with(tables(), vec![term(0, 1.0, &[0])]).encode().unwrap();
    assert_eq!(written(&without, &options).unwrap_err(), CecError::NoLength);
    let nothing = with(tables(), vec![term(0, 0.0, &[0])]).encode().unwrap();
    let error = written(&nothing, &self::options(FactorTables::Added));
    assert_eq!(error.unwrap_err(), CecError::Nothing);
}

#[test]
fn adjustable_tables_have_their_weight_in_their_values_and_others_are_told() {
    let terms = [
        term(0, 0.75, &[0]),
        term(1, 0.5, &[1, 2]),
        term(2, 0.0, &[3]),
    ];
    let mut draft = with(tables(), terms.to_vec());
    for term in &mut draft.terms {
        term.limits = Some([0.0, 1.0]);
    }
    let (plan, text) = written(&draft.encode().unwrap(), &options(FactorTables::NotAdded)).unwrap();
    // A lost weight, and the one that a controller begins with, are 1: it is stated for each table.
    for table in 0..3 {
        assert!(text.contains(&format!("\n$SN_CEC_TABLE_WEIGHT[{table}]=1\n")));
    }
    assert_eq!(plan.tables[0].values, [-0.009, 0.009]);
    let fixed = [('Y', 0.5), ('A', 0.0)];
    assert_eq!(
        plan.notes,
        fixed.map(|(output, weight)| Note::Fixed { output, weight })
    );
    round_trips(&draft);
}

#[test]
fn what_the_controller_does_not_hold_is_refused() {
    let blob = with(tables(), vec![term(0, 1.0, &[0, 2]), term(1, 0.5, &[1])])
        .encode()
        .unwrap();
    let with = |change: &dyn Fn(&mut CecOptions)| {
        let mut options = options(FactorTables::Added);
        change(&mut options);
        written(&blob, &options)
    };
    let few = with(&|o| o.limits.first = 60).unwrap_err();
    assert!(matches!(
        few,
        CecError::Tables {
            needed: 3,
            room: 2,
            first: 60
        }
    ));
    // Peaks of 12 µm and 1: √0.012, and L·(L − 1) = 0.012.
    for (tables, limit, least) in [
        (FactorTables::NotAdded, 0.001, 0.1096),
        (FactorTables::Added, 1.0, 1.0119),
    ] {
        let at = |limit: f64| {
            with(&|o| {
                o.factor_limit = limit;
                o.factor_tables = tables;
            })
        };
        let error = at(limit).unwrap_err();
        let axis = 'X';
        assert_eq!(error, CecError::Factor { axis, limit, least });
        let named = format!("--factor-limit {least:.4} or more");
        assert!(error.remedy().contains(&named), "{}", error.remedy());
        assert!(at(least).is_ok() && at(least - 1e-4).is_err());
    }
    // 41 values of A do not fit into 20.
    let (plan, _) = with(&|o| o.limits.points = Some(20)).unwrap();
    assert!(plan.tables.iter().all(|t| t.stored() <= 20));
    assert!(
        matches!(plan.notes[..], [Note::Resampled { points: 20, .. }]),
        "{:?}",
        plan.notes
    );
}

#[test]
fn no_factor_exceeds_the_limit() {
    let blob = with(
        tables(),
        vec![
            term(0, 1.0, &[0, 2]),
            term(1, 40.0, &[1, 3]),
            term(2, 1e-4, &[2, 3]),
        ],
    );
    let blob = blob.encode().unwrap();
    for (factor_tables, limit) in [
        (BOTH[0], 1.0),
        (BOTH[0], 2.0),
        (BOTH[1], 1.9),
        (BOTH[1], 2.0),
    ] {
        let mut options = options(factor_tables);
        options.factor_limit = limit;
        let (plan, text) = written(&blob, &options).unwrap();
        let largest = plan
            .tables
            .iter()
            .map(|t| f64::from(t.peak()))
            .fold(0.0, f64::max);
        assert!(largest <= limit, "{largest} {limit}");
        let [told, _] = differences(&blob, &text, factor_tables, 0.0);
        assert!(told < ROUNDING, "{told}");
    }
}

#[test]
fn the_probe_tells_both_readings_apart() {
    let text = probe("AX1", 0);
    let file = AssignedValues::new(&text);
    for (added, shown) in [(false, 0.005), (true, 0.010)] {
        for x in [-2000.0, 0.0, 123.4, 2000.0] {
            let q = [x, 0.0, 0.0, 0.0];
            let sum = file.correction("AX1", &NAMES, &q, &[0; 4], added);
            assert!((sum - shown).abs() < 1e-9, "{sum}");
        }
    }
    // The import reads it in the same way.
    for (factor_tables, shown) in [(BOTH[0], 0.005), (BOTH[1], 0.010)] {
        let blob = imported(&text, factor_tables);
        let runtime = Runtime::load(&blob).unwrap();
        let command = Command {
            axes: [0.0; MAX_AXES],
            travel: [trueaxis::Travel::Unknown; MAX_AXES],
            auxiliaries: [0.0; trueaxis::AUXILIARIES],
        };
        assert!((runtime.evaluate(&command)[0] - shown).abs() < 1e-7);
    }
}

#[test]
fn a_proof_tells_what_the_other_kind_of_controller_would_do() {
    let blob = with(tables(), vec![term(0, 1.0, &[0, 2]), term(1, 0.5, &[1])])
        .encode()
        .unwrap();
    let runtime = Runtime::load(&blob).unwrap();
    let (axes, options) = (axes(), options(FactorTables::NotAdded));
    let (plan, text) = written(&blob, &options).unwrap();
    let verification = prove(
        &text,
        &runtime,
        &axes,
        &plan,
        FactorTables::NotAdded,
        5000,
        1,
    )
    .unwrap();
    assert!(verification.meets(options.tolerance));
    let mut axes = verification.axes.iter();
    assert!(axes.any(|a| a.other_reading != a.own.difference));
    // The factor of 12 µm would be added.
    let [x, y, ..] = verification.axes[..] else {
        panic!("{verification:?}");
    };
    assert!(
        x.own.difference < 1e-3 && (x.other_reading - 12.0).abs() < 0.1,
        "{x:?}"
    );
    assert!(y.own.difference < 1e-3 && y.other_reading < 1e-3, "{y:?}");
}
