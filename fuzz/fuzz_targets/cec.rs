//! Arbitrary bytes as tables of a Sinumerik: never a panic. Accepted input becomes a compensation, and its export reads
//! back as the same one.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use trueaxis::{AlignedBlob, Axis, EncodeError, LoadError, Policy};
use trueaxis_export::cec::{
    CecOptions, CecTable, CecTolerance, EncoderValues, FactorTables, LengthUnit, LongProducts,
    NamedAxes, ReadOptions, TableLimits, draft, plan, print, read,
};
use trueaxis_model::validate::Runtime;

/// A linear, a rotary and an endless axis.
static AXES: LazyLock<NamedAxes> = LazyLock::new(|| {
    let axis = |name: u8, travel: [f32; 2], period: f32| Axis {
        name,
        travel,
        period,
        value_bound: 1.0,
        rate_bound: 1.0,
        reversal_threshold: 0.001,
        ramp_rate: 1.0,
        reversal_rate: 1.0,
        reversal_acceleration: 20.0,
    };
    let axes = [
        axis(b'X', [-300.0, 300.0], 0.0),
        axis(b'A', [-120.0, 120.0], 0.0),
        axis(b'C', [-f32::MAX, f32::MAX], 360.0),
    ];
    NamedAxes::new(&axes, "X=AX1,A=AX2,C=C1").expect("a map")
});

/// The blob for tables; `None` if their numbers are too large for one.
fn blob(tables: &[CecTable], factor_tables: FactorTables) -> Option<AlignedBlob> {
    match draft(
        "fuzz",
        Policy::Position,
        &AXES,
        Vec::new(),
        tables,
        factor_tables,
    )
    .encode()
    {
        Ok(blob) => Some(blob),
        Err(EncodeError::Refused(
            LoadError::TableMagnitude { .. }
            | LoadError::TermMagnitude { .. }
            | LoadError::OutputMagnitude { .. },
        )) => None,
        Err(error) => panic!("{error}: {tables:?}"),
    }
}

/// The export of an imported blob, which is known to satisfy the rules.
fn export(blob: &AlignedBlob, factor_tables: FactorTables) -> String {
    let runtime = Runtime::load(blob).expect("it was encoded");
    let options = CecOptions {
        factor_tables,
        limits: TableLimits {
            first: 0,
            tables: 255,
            points: None,
        },
        factor_limit: f64::MAX,
        tolerance: CecTolerance {
            um: 0.05,
            urad: 0.05,
        },
        length: None,
        long: LongProducts::Refuse,
    };
    let made = plan(runtime.compensation(), &AXES, &options).expect("it came from tables");
    assert!(made.is_literal, "{:?}", made.tables);
    print(&made.tables, &AXES, 0, &[])
}

fuzz_target!(|data: &[u8]| {
    let Some((mode, bytes)) = data.split_first() else {
        return;
    };
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let factor_tables = match mode & 1 {
        0 => FactorTables::NotAdded,
        _ => FactorTables::Added,
    };
    let reading = ReadOptions {
        axes: &AXES,
        factor_tables,
        units: [None, Some(LengthUnit::Metric), Some(LengthUnit::Inch)]
            [usize::from(mode >> 1 & 3) % 3],
        encoder: [
            None,
            Some(EncoderValues::Corrections),
            Some(EncoderValues::Opposite),
        ][usize::from(mode >> 3 & 3) % 3],
    };
    let Ok(found) = read(text, &reading) else {
        return;
    };
    let Some(imported) = blob(&found.tables, factor_tables) else {
        return;
    };
    let first = export(&imported, factor_tables);
    let again = read(&first, &reading).unwrap_or_else(|error| panic!("{error}:\n{first}"));
    let imported = blob(&again.tables, factor_tables).expect("no larger than before");
    let second = export(&imported, factor_tables);
    assert_eq!(first, second);
});
