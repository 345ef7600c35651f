//! Grids compared with `interpn`, an independent implementation of multilinear interpolation, in f64.

use interpn::MultilinearRegular;
use trueaxis::{Draft, DraftGrid, GridAxis, Inputs, SampleFormat, Travelling};
use trueaxis_tests::Fixed;
use trueaxis_tests::golden::{load, plain_axis};

/// Largest relative change due to one rounding to f32.
const ROUND: f64 = 1.0 / 16_777_216.0;
/// Steps that are powers of two, so that division by them is exact.
const STEP: [f32; 3] = [32.0, 16.0, 8.0];
const START: [f32; 3] = [-100.0, 37.5, -12.25];
const LARGEST: f64 = 0.05;

fn compare<const N: usize>(counts: [usize; N], seed: u64) {
    let mut random = Fixed::new(seed);
    let nodes: usize = counts.iter().product();
    let values: Vec<f32> = (0..3 * nodes)
        .map(|_| random.within(-LARGEST, LARGEST) as f32)
        .collect();
    let inputs = 0..N as u8;
    let blob = Draft {
        machine: "oracle".to_owned(),
        axes: b"XYZ".map(|name| plain_axis(name, [-1e4, 1e4])).into(),
        grids: vec![DraftGrid {
            axes: inputs
                .map(|i| GridAxis {
                    input: i,
                    start: START[usize::from(i)],
                    step: STEP[usize::from(i)],
                    points: counts[usize::from(i)] as u32,
                    modulo: false,
                })
                .collect(),
            outputs: vec![0, 1, 2],
            format: SampleFormat::F32,
            values: values.clone(),
        }],
        ..Draft::default()
    }
    .encode()
    .unwrap();
    let c = load(&blob);

    let starts: [f64; N] = std::array::from_fn(|i| f64::from(START[i]));
    let steps: [f64; N] = std::array::from_fn(|i| f64::from(STEP[i]));
    let columns: [Vec<f64>; 3] = std::array::from_fn(|k| {
        values[k..]
            .iter()
            .step_by(3)
            .map(|v| f64::from(*v))
            .collect()
    });
    let oracles = columns
        .each_ref()
        .map(|column| MultilinearRegular::<f64, N>::new(counts, starts, steps, column).unwrap());

    // Each input's fraction is off by one rounding of up to `count` steps, and a step changes the value by up to
    // 2·LARGEST; followed by seven interpolations of three operations each.
    let steps_off: f64 = counts.iter().map(|n| *n as f64).sum();
    let allowed = ROUND * 2.0 * LARGEST * (steps_off + 21.0);
    let mut worst = 0.0_f64;
    for _ in 0..20_000 {
        let mut q = Inputs::at([0.0; 16]);
        let at: [f64; N] = std::array::from_fn(|i| {
            let end = starts[i] + steps[i] * (counts[i] - 1) as f64;
            let x = random.within(starts[i], end) as f32;
            q.axes[i] = x;
            f64::from(x)
        });
        let found = c.evaluate(&q, &Travelling::default(), &c.weights());
        for (oracle, found) in oracles.iter().zip(found) {
            let expected = oracle.interp_one(at).unwrap();
            worst = worst.max((f64::from(found) - expected).abs());
        }
    }
    println!("{counts:?}: {worst:.1e} of {allowed:.1e}");
    assert!(
        worst <= allowed,
        "{counts:?}: differs by {worst:e}, rounding explains {allowed:e}"
    );
}

#[test]
fn grids_of_one_to_three_inputs_agree_with_interpn() {
    compare([2], 1);
    compare([57], 2);
    compare([9, 14], 3);
    compare([2, 2, 2], 4);
    compare([25, 25, 25], 5);
    compare([3, 18, 7], 6);
}
