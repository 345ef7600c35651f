//! A machine with four axes, tables of every kind, and the effect of a file with them according to the oracle.

use super::oracle::AssignedValues;
use super::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis::{
    AlignedBlob, Axis, Direction, Draft, DraftBank, Interpolation, Policy, SampleFormat, Term,
};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::validate::{Command, Runtime};

pub const NAMES: [&str; 4] = ["AX1", "AX2", "AX5", "C_1"];
pub(crate) const MAP: &str = "X=AX1,Y=AX2,A=AX5,C=C_1";
pub const BOTH: [FactorTables; 2] = [FactorTables::NotAdded, FactorTables::Added];
/// Rounding of corrections up to 1 (mm, deg) from sums of up to ten f32 products, and of positions up to 720 with
/// slopes below 0.01 per mm or degree.
pub const ROUNDING: f64 = 3e-6;

pub fn axes() -> NamedAxes {
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
    let endless = [-f32::MAX, f32::MAX];
    let all = [
        axis(b'X', [-300.0, 300.0], 0.0),
        axis(b'Y', [0.0, 500.0], 0.0),
        axis(b'A', [-120.0, 120.0], 0.0),
        axis(b'C', endless, 360.0),
    ];
    NamedAxes::new(&all, MAP).unwrap().complete().unwrap()
}

pub fn bank(input: u8, [from, to]: [f32; 2], direction: Direction, column: &[f32]) -> DraftBank {
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

pub fn term(output: u8, weight: f32, factors: &[u8]) -> Term {
    Term {
        output,
        weight,
        limits: None,
        factors: factors.iter().copied().collect(),
    }
}

pub fn with(banks: Vec<DraftBank>, terms: Vec<Term>) -> Draft {
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
pub fn tables() -> Vec<DraftBank> {
    let turn: Vec<f32> = (0..24)
        .map(|k| libm::sinf((k as f32 * 15.0).to_radians()))
        .collect();
    let curve: Vec<f32> = (0..41)
        .map(|k| libm::cosf((-120.0 + 6.0 * k as f32).to_radians()))
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

pub fn options(factor_tables: FactorTables) -> CecOptions {
    CecOptions {
        factor_tables,
        limits: TableLimits::SINUMERIK_840D,
        factor_limit: 2.0,
        tolerance: CecTolerance {
            um: 0.05,
            urad: 0.05,
        },
        length: None,
        long: LongProducts::Refuse,
    }
}

pub fn written(blob: &AlignedBlob, options: &CecOptions) -> Result<(CecPlan, String), CecError> {
    let runtime = Runtime::load(blob).unwrap();
    let axes = axes();
    let made = plan(runtime.compensation(), &axes, options)?;
    let text = print(&made.tables, &axes, options.limits.first, &[]);
    Ok((made, text))
}

pub fn imported(text: &str, factor_tables: FactorTables) -> AlignedBlob {
    let axes = axes();
    let reading = ReadOptions {
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

/// Largest difference between a compensation and the text as evaluated by the oracle, and between the compensation
/// and the imported text.
pub fn differences(
    blob: &AlignedBlob,
    text: &str,
    factor_tables: FactorTables,
    length: f32,
) -> [f64; 2] {
    let again = imported(text, factor_tables);
    let [compiled, again] = [blob, &again].map(|blob| Runtime::load(blob).unwrap());
    let file = AssignedValues::new(text);
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
        let command = command(q, directions, length);
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

fn command(q: [f64; 4], directions: [i8; 4], length: f32) -> Command {
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
    command
}
