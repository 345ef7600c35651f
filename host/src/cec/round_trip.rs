//! From compensations to files and back, beside an independent reading of the text.

use super::oracle::File;
use super::*;
use crate::machine::MAX_AXES;
use crate::validate::{Command, Runtime};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis::{
    AlignedBlob, Auxiliary, AuxiliaryKind, Axis, Direction, Draft, DraftBank, Interpolation,
    Policy, SampleFormat, Term,
};

const NAMES: [&str; 4] = ["AX1", "AX2", "AX5", "C_1"];
const MAP: &str = "X=AX1,Y=AX2,A=AX5,C=C_1";
const BOTH: [FactorTables; 2] = [FactorTables::NotAdded, FactorTables::Added];
/// Rounding of corrections up to 1 (mm, deg) from sums of up to ten f32 products, and of positions up to 720 with
/// slopes below 0.01 per mm or degree.
const ROUNDING: f64 = 3e-6;

fn axes() -> Axes {
    let axis = |name: u8, travel: [f32; 2], period: f32| Axis {
        name,
        travel,
        period,
        value_bound: 1.0,
        rate_bound: 1.0,
        hysteresis: 0.001,
        ramp_rate: 1.0,
    };
    let endless = [-f32::MAX, f32::MAX];
    let all = [
        axis(b'X', [-300.0, 300.0], 0.0),
        axis(b'Y', [0.0, 500.0], 0.0),
        axis(b'A', [-120.0, 120.0], 0.0),
        axis(b'C', endless, 360.0),
    ];
    Axes::new(&all, MAP).unwrap().complete().unwrap()
}

fn bank(input: u8, [from, to]: [f32; 2], direction: Direction, column: &[f32]) -> DraftBank {
    DraftBank {
        input,
        start: from,
        step: (to - from) / (column.len() - 1) as f32,
        modulo: false,
        direction,
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns: vec![column.to_vec()],
    }
}

fn term(output: u8, weight: f32, factors: &[u8]) -> Term {
    Term {
        output,
        weight,
        limits: None,
        factors: factors.iter().copied().collect(),
    }
}

fn with(banks: Vec<DraftBank>, terms: Vec<Term>) -> Draft {
    Draft {
        machine: "specimen".to_owned(),
        policy: Policy::Orientation,
        axes: axes().axes,
        banks,
        terms,
        ..Draft::default()
    }
}

/// Straight lines of X and Y, a curve of A, a modulo table of C, backlash of X and of C.
fn tables() -> Vec<DraftBank> {
    let turn: Vec<f32> = (0..24)
        .map(|k| (k as f32 * 15.0).to_radians().sin())
        .collect();
    let curve: Vec<f32> = (0..41)
        .map(|k| (-120.0 + 6.0 * k as f32).to_radians().cos())
        .collect();
    let mut c = bank(3, [-180.0, 180.0], Direction::Both, &[0.0; 25]);
    c.columns = vec![turn];
    c.modulo = true;
    vec![
        bank(0, [-300.0, 300.0], Direction::Both, &[-0.012, 0.012]),
        bank(1, [0.0, 500.0], Direction::Both, &[0.0, 0.02]),
        bank(2, [-120.0, 120.0], Direction::Both, &curve),
        c,
        bank(0, [-300.0, 300.0], Direction::Signed, &[0.004, 0.003]),
        bank(3, [0.0, 360.0], Direction::Positive, &[0.002, 0.002]),
        bank(
            0,
            [-300.0, 300.0],
            Direction::Negative,
            &[0.006, 0.001, 0.002],
        ),
    ]
}

fn options(factor_tables: FactorTables) -> Options {
    Options {
        factor_tables,
        limits: Limits::SINUMERIK_840D,
        factor_limit: 2.0,
        tolerance: Tolerance {
            um: 0.05,
            urad: 0.05,
        },
        length: None,
        long: LongProducts::Refuse,
    }
}

fn written(blob: &AlignedBlob, options: &Options) -> Result<(Plan, String), PlanError> {
    let runtime = Runtime::load(blob).unwrap();
    let axes = axes();
    let made = plan(runtime.compensation(), &axes, options)?;
    let text = print(&made.tables, &axes, options.limits.first, &[]);
    Ok((made, text))
}

fn imported(text: &str, factor_tables: FactorTables) -> AlignedBlob {
    let axes = axes();
    let reading = Reading {
        axes: &axes,
        factor_tables,
        units: None,
        encoder: None,
    };
    let tables = read(text, &reading).unwrap().tables;
    draft(
        "specimen",
        Policy::Orientation,
        &axes,
        Vec::new(),
        &tables,
        factor_tables,
    )
    .encode()
    .unwrap()
}

/// Largest difference between a compensation and the text, read by the oracle; and between the compensation and the
/// import of the text.
fn differences(
    blob: &AlignedBlob,
    text: &str,
    factor_tables: FactorTables,
    length: f32,
) -> [f64; 2] {
    let again = imported(text, factor_tables);
    let [compiled, again] = [blob, &again].map(|blob| Runtime::load(blob).unwrap());
    let file = File::new(text);
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let mut worst = [0.0_f64; 2];
    for _ in 0..3000 {
        let q = [
            [-330.0, 330.0],
            [-20.0, 520.0],
            [-130.0, 130.0],
            [-720.0, 720.0],
        ]
        .map(|[low, high]| f64::from((low + (high - low) * random.random::<f64>()) as f32));
        let directions: [i8; 4] = std::array::from_fn(|_| random.random_range(-1..=1));
        let mut command = Command {
            axes: [0.0; MAX_AXES],
            travel: [trueaxis::Travel::Unknown; MAX_AXES],
            auxiliaries: [0.0; trueaxis::AUXILIARIES],
        };
        command.auxiliaries[0] = length;
        for i in 0..4 {
            command.axes[i] = q[i] as f32;
            command.travel[i] = match directions[i] {
                1 => trueaxis::Travel::Positive,
                -1 => trueaxis::Travel::Negative,
                _ => trueaxis::Travel::Unknown,
            };
        }
        let (before, after) = (compiled.evaluate(&command), again.evaluate(&command));
        for (i, name) in NAMES.iter().enumerate() {
            let added = factor_tables == FactorTables::Added;
            let told = file.correction(name, &NAMES, &q, &directions, added);
            worst[0] = worst[0].max((f64::from(before[i]) - told).abs());
            worst[1] = worst[1].max(f64::from(before[i] - after[i]).abs());
        }
    }
    worst
}

#[track_caller]
fn round_trips(draft: &Draft) {
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
    // One factor with a direction, on either side; both; and a signed one.
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
    let PlanError::Long(long) = &refused else {
        panic!("{refused}");
    };
    // 0.1 · 20 µm · 1 · 1. The table of Y, from 0 to 20 µm, costs half of it if it is held at 10; cos A, from −0.5
    // to 1, would cost three quarters, and sin C all.
    assert!((long[0].dropped - 2.0).abs() < 1e-3, "{refused}");
    assert_eq!(long[0].held_inputs, ['Y']);
    assert!((long[0].held - 1.0).abs() < 1e-3, "{refused}");
    for (way, cost) in [
        (LongProducts::Drop, long[0].dropped),
        (LongProducts::Hold, long[0].held),
    ] {
        let mut options = options(FactorTables::NotAdded);
        options.long = way;
        let (_, text) = written(&blob, &options).unwrap();
        let [told, _] = differences(&blob, &text, FactorTables::NotAdded, 0.0);
        let told = 1e3 * told;
        assert!(told <= cost + 1e-3 && told > 0.9 * cost, "{told} of {cost}");
    }
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
    options.length = Some(1.0);
    let without = with(tables(), vec![term(0, 1.0, &[0])]).encode().unwrap();
    assert_eq!(
        written(&without, &options).unwrap_err(),
        PlanError::NoLength
    );
    let nothing = with(tables(), vec![term(0, 0.0, &[0])]).encode().unwrap();
    let error = written(&nothing, &self::options(FactorTables::Added));
    assert_eq!(error.map(|(plan, _)| plan.tables.len()), Ok(1));
}

#[test]
fn weights_of_single_tables_stay_weights_and_others_are_told() {
    let mut draft = with(tables(), vec![term(0, 0.75, &[0]), term(1, 0.5, &[1, 2])]);
    for term in &mut draft.terms {
        term.limits = Some([0.0, 1.0]);
    }
    let (plan, text) = written(&draft.encode().unwrap(), &options(FactorTables::NotAdded)).unwrap();
    assert!(text.contains("\n$SN_CEC_TABLE_WEIGHT[0]=0.75\n"), "{text}");
    assert_eq!(
        plan.notes,
        [Note::Fixed {
            output: 'Y',
            weight: 0.5
        }]
    );
    round_trips(&draft);
}

#[test]
fn what_the_controller_does_not_hold_is_refused() {
    let blob = with(tables(), vec![term(0, 1.0, &[0, 2]), term(1, 0.5, &[1])])
        .encode()
        .unwrap();
    let with = |change: &dyn Fn(&mut Options)| {
        let mut options = options(FactorTables::Added);
        change(&mut options);
        written(&blob, &options)
    };
    let few = with(&|o| o.limits.first = 60).unwrap_err();
    assert_eq!(
        few,
        PlanError::Tables {
            needed: 3,
            room: 2,
            first: 60
        }
    );
    assert_eq!(
        with(&|o| o.factor_limit = 1.0).unwrap_err(),
        PlanError::Limit(1.0)
    );
    let small = with(&|o| {
        o.factor_limit = 0.001;
        o.factor_tables = FactorTables::NotAdded;
    });
    assert!(matches!(
        small.unwrap_err(),
        PlanError::Factor { axis: 'X', .. }
    ));
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
fn the_probe_tells_both_readings_apart() {
    let text = probe("AX1", 0);
    let file = File::new(&text);
    for (added, shown) in [(false, 0.005), (true, 0.010)] {
        for x in [-2000.0, 0.0, 123.4, 2000.0] {
            let q = [x, 0.0, 0.0, 0.0];
            let sum = file.correction("AX1", &NAMES, &q, &[0; 4], added);
            assert!((sum - shown).abs() < 1e-9, "{sum}");
        }
    }
    // And the import reads it the same way.
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
    let proof = prove(
        &text,
        &runtime,
        &axes,
        &plan,
        FactorTables::NotAdded,
        5000,
        1,
    )
    .unwrap();
    assert!(proof.meets(options.tolerance) && proof.depends_on_reading());
    // The factor of 12 µm would be added.
    let [x, y, ..] = proof.axes[..] else {
        panic!("{proof:?}");
    };
    assert!(
        x.difference < 1e-3 && (x.other_reading - 12.0).abs() < 0.1,
        "{x:?}"
    );
    assert!(y.difference < 1e-3 && y.other_reading < 1e-3, "{y:?}");
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
