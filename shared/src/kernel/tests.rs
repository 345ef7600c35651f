use std::vec;
use std::vec::Vec;

use proptest::prelude::*;

use crate::specimen::{adjustable, bank, bare, everything, term};
use crate::*;

type Small<'a> = Compensation<'a, Holds<3, 32, 32, 64, 2>>;

fn at(c: &Small<'_>, x: f32, y: f32, z: f32) -> [f32; 3] {
    c.evaluate(&Inputs::at([x, y, z]), &Travelling::default(), &c.weights())
}

/// One bank on X whose tables are the corrections of X, Y, C.
fn only(bank: DraftBank) -> Draft {
    let mut draft = bare();
    draft.terms = (0..bank.columns.len() as u8)
        .map(|k| term(k, 1.0, &[k]))
        .collect();
    draft.banks = vec![bank];
    draft
}

#[test]
fn a_straight_line_is_reproduced_exactly() {
    // All numbers are multiples of 1/64 below 2¹⁸: no operation rounds.
    for points in [2_u16, 3, 9] {
        let step = 512.0 / f32::from(points - 1);
        let line = |x: f32| 3.0 * x - 7.0;
        let column = (0..points)
            .map(|i| line(-256.0 + f32::from(i) * step))
            .collect();
        let blob = only(bank(0, -256.0, step, vec![column])).encode().unwrap();
        let c = Small::from_blob(&blob).unwrap();
        for k in -16_384_i16..=16_384 {
            let x = f32::from(k) / 64.0;
            assert_eq!(at(&c, x, 0.0, 0.0)[0], line(x));
        }
    }
}

#[test]
fn before_the_first_and_after_the_last_point_the_end_value_holds() {
    // Values whose difference rounds, so that a + (b − a) is not b.
    for column in [vec![0.1_f32, 1.7e7], vec![0.1_f32, 3.0, 1.7e7]] {
        let (first, last) = (column[0], column[column.len() - 1]);
        let end = 10.0 + column.len() as f32;
        let blob = only(bank(0, 11.0, 1.0, vec![column])).encode().unwrap();
        let c = Small::from_blob(&blob).unwrap();
        for x in [11.0, 10.9, -1e30, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(at(&c, x, 0.0, 0.0)[0], first);
        }
        for x in [end, end + 0.1, 1e30, f32::INFINITY] {
            assert_eq!(at(&c, x, 0.0, 0.0)[0], last);
        }
    }
}

#[test]
fn a_modulo_table_repeats_exactly_over_8192_periods() {
    // Multiples of 1/4 up to 2²² and a power of two as step: nothing rounds in the position.
    let column = vec![1.0, 5.0, -3.0, 8.0, 2.0];
    for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
        let draft = only(DraftBank {
            modulo: true,
            interpolation,
            ..bank(0, -32.0, 64.0, vec![column.clone()])
        });
        let blob = draft.encode().unwrap();
        let c = Small::from_blob(&blob).unwrap();
        for quarter in 0..1280_u16 {
            let x = f32::from(quarter) * 0.25 - 32.0;
            let expected = at(&c, x, 0.0, 0.0)[0];
            for turns in [-8191.0, -100.0, -1.0, 1.0, 2.0, 8191.0] {
                assert_eq!(
                    at(&c, x + turns * 320.0, 0.0, 0.0)[0],
                    expected,
                    "{x} {turns}"
                );
            }
        }
        // At its start an interval equals a point or, for a cubic, four sixths of the second sample and a sixth of each
        // neighbour; the first sample follows the last.
        for k in 0..5 {
            let [a, b, d] = [0, 1, 2].map(|n| column[(k + n) % 5]);
            let expected = match interpolation {
                Interpolation::Linear => a,
                Interpolation::Cubic => (a + 4.0 * b + d) / 6.0,
            };
            let found = at(&c, -32.0 + 64.0 * k as f32, 0.0, 0.0)[0];
            // Six operations on numbers up to 11.
            assert!((found - expected).abs() < 6.0 * 11.0 * f32::EPSILON);
        }
    }
    let draft = only(DraftBank {
        modulo: true,
        ..bank(0, 0.0, 90.0, vec![vec![0.0, 1.0, 2.0, 3.0]])
    });
    let blob = draft.encode().unwrap();
    let c = Small::from_blob(&blob).unwrap();
    assert_eq!(at(&c, 315.0, 0.0, 0.0)[0], 1.5);
    for x in [-1e-30, -f32::MIN_POSITIVE, 360.0 - 3e-5, 359.99997] {
        // Just below a whole turn: the first point, to 1 part in 2²³ of a turn, whichever way it rounds.
        assert!(
            at(&c, x, 0.0, 0.0)[0].abs() < 3.0 * 360.0 / 90.0 * 1.2e-7 * 8.0,
            "{x}"
        );
    }
}

/// Cubic tables with intervals of 1 starting at 0.
fn cubics(columns: &[&[f32]], modulo: bool) -> AlignedBlob {
    let columns = columns.iter().map(|c| c.to_vec()).collect();
    let draft = only(DraftBank {
        modulo,
        interpolation: Interpolation::Cubic,
        ..bank(0, 0.0, 1.0, columns)
    });
    draft.encode().unwrap()
}

#[test]
fn a_cubic_reproduces_cubic_polynomials_and_constants_exactly() {
    // The coefficients of 1, x, x², x³ at point k are 1, k, k² − 1/3, k³ − k.
    let polynomial = |[p0, p1, p2, p3]: [f32; 4]| {
        let column: Vec<f32> = (-1_i8..=9)
            .map(f32::from)
            .map(|k| p0 + p1 * k + p2 * (k * k - 1.0 / 3.0) + p3 * (k * k * k - k))
            .collect();
        column
    };
    let parts = [3.0, -2.0, 0.75, -0.125];
    let blob = cubics(&[&polynomial(parts), &[0.3; 11], &[-1.7e7; 11]], false);
    let c = Small::from_blob(&blob).unwrap();
    for k in 0..=1024_u16 {
        let x = f32::from(k) / 128.0;
        let [found, small, large] = at(&c, x, 0.0, 0.0);
        assert_eq!([small, large], [0.3, -1.7e7]);
        let [p0, p1, p2, p3] = parts;
        let expected = ((p3 * x + p2) * x + p1) * x + p0;
        // Samples up to 45, each rounded; the weights and the sum of their products take ten operations.
        assert!((found - expected).abs() < 12.0 * 45.0 * f32::EPSILON, "{x}");
    }
}

#[test]
fn a_cubic_holds_the_ends_of_its_intervals() {
    let column = [7.0, 1.0, 4.0, -2.0, 3.0, 6.0];
    let blob = cubics(&[&column], false);
    let c = Small::from_blob(&blob).unwrap();
    // Six samples make three intervals, whose ends are averages of three samples. Differences are up to 6, and six
    // operations round.
    let near = |found: f32, expected: f32| (found - expected).abs() < 36.0 * f32::EPSILON;
    for x in [0.0, -0.1, -1e30, f32::NEG_INFINITY, f32::NAN] {
        let found = at(&c, x, 0.0, 0.0)[0];
        assert!(near(found, (7.0 + 4.0 + 4.0) / 6.0), "{x}");
        assert_eq!(found, at(&c, 0.0, 0.0, 0.0)[0]);
    }
    for x in [3.0, 3.1, 1e30, f32::INFINITY] {
        let found = at(&c, x, 0.0, 0.0)[0];
        assert!(near(found, (-2.0 + 12.0 + 6.0) / 6.0), "{x}");
        assert_eq!(found, at(&c, 3.0, 0.0, 0.0)[0]);
    }
    assert_eq!(c.banks()[0].end(), 3.0);
    // One interval: the minimum number of samples.
    let blob = cubics(&[&column[..4]], false);
    let c = Small::from_blob(&blob).unwrap();
    assert!(near(
        at(&c, 0.5, 0.0, 0.0)[0],
        (7.0 + 23.0 + 92.0 - 2.0) / 48.0
    ));
    assert!(near(at(&c, 2.0, 0.0, 0.0)[0], (1.0 + 16.0 - 2.0) / 6.0));
}

#[test]
fn a_cubic_is_smooth_to_its_second_derivative() {
    let column = [1.0, 0.0, 0.0, 2.0, -1.0, 0.5, 0.0, 0.0, 1.0];
    for modulo in [false, true] {
        let blob = cubics(&[&column], modulo);
        let c = Small::from_blob(&blob).unwrap();
        let at = |x: f32| f64::from(at(&c, x, 0.0, 0.0)[0]);
        let (h, rounding) = (1.0 / 32.0, 12.0 * 2.0 * f64::from(f32::EPSILON));
        for point in 1..if modulo { 20_u8 } else { 6 } {
            let x = f32::from(point);
            // A third difference is at most the third derivative, 8 · 2 here, times h³, plus rounding; a step of the
            // second derivative would appear as that step times h²/4 or more.
            let [a, b, c, d] = [-1.5, -0.5, 0.5, 1.5].map(|k| at(x + k * h));
            let third = (d - c) - 2.0 * (c - b) + (b - a);
            let most = 16.0 * f64::from(h).powi(3) + 8.0 * rounding;
            assert!(third.abs() < most, "{x} {third}");
            // The two sides of a point are adjacent floats.
            let sides = at(x.next_down()) - at(x.next_up());
            assert!(sides.abs() < rounding + 4.0 * 20.0 * f64::from(f32::EPSILON));
        }
    }
}

#[test]
fn a_cubic_never_exceeds_its_samples() {
    let alternating = [-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0];
    let ends = [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0];
    for modulo in [false, true] {
        let blob = cubics(&[&alternating, &ends], modulo);
        let c = Small::from_blob(&blob).unwrap();
        assert_eq!(c.peak(0), Some(1.0));
        let mut largest = [0.0_f32; 2];
        for k in 0..8192_u16 {
            let found = at(&c, f32::from(k) / 1024.0, 0.0, 0.0);
            for (largest, value) in largest.iter_mut().zip(found) {
                *largest = largest.max(value.abs());
            }
        }
        // Two samples of the same sign in the middle come closest: 23/24 − 1/24.
        assert!((largest[0] - 22.0 / 24.0).abs() < 4.0 * f32::EPSILON);
        assert_eq!(largest[1], 1.0);
    }
}

#[test]
fn grids_reproduce_multilinear_functions_exactly() {
    // Small integers and quarters: no operation rounds.
    let f = [
        |x: f32, y: f32, z: f32| 1.0 + x + 2.0 * y + 4.0 * z,
        |x: f32, y: f32, z: f32| x * y * z,
        |x: f32, y: f32, z: f32| x * y - y * z + x,
    ];
    for width in 1..=3_usize {
        for inputs in 1..=3_usize {
            let counts = [3, 4, 5];
            let used = &counts[3 - inputs..];
            let mut values = vec![];
            let mut node = [0_u8; 3];
            let total: u32 = used.iter().product();
            for number in 0..total {
                let mut rest = number;
                for k in (0..inputs).rev() {
                    node[k] = (rest % used[k]) as u8;
                    rest /= used[k];
                }
                let p = node.map(|n| f32::from(n) * 2.0 - 2.0);
                let p = [0, 1, 2].map(|k| if k < inputs { p[k] } else { 0.0 });
                values.extend(f[..width].iter().map(|f| f(p[0], p[1], p[2])));
            }
            let mut draft = bare();
            draft.grids = vec![DraftGrid {
                axes: (0..inputs)
                    .map(|k| GridAxis {
                        input: k as u8,
                        start: -2.0,
                        step: 2.0,
                        points: used[k],
                        modulo: false,
                    })
                    .collect(),
                outputs: (0..width as u8).collect(),
                format: SampleFormat::F32,
                values,
            }];
            let blob = draft.encode().unwrap();
            let c = Small::from_blob(&blob).unwrap();
            let end = |k: usize| if k < inputs { f64::from(used[k] - 1) * 2.0 - 2.0 } else { 0.0 } as f32;
            for i in 0..1000_u32 {
                let p = [i % 10, i / 10 % 10, i / 100].map(|n| (n * 3) as f32 * 0.25 - 2.0);
                let inside = [0, 1, 2].map(|k| if p[k] < end(k) { p[k] } else { end(k) });
                let inside = [0, 1, 2].map(|k| if k < inputs { inside[k] } else { 0.0 });
                let found = at(&c, p[0], p[1], p[2]);
                for k in 0..width {
                    assert_eq!(found[k], f[k](inside[0], inside[1], inside[2]));
                }
            }
        }
    }
}

#[test]
fn directional_tables_are_zero_unless_the_axis_last_moved_their_way() {
    let mut draft = only(DraftBank {
        direction: Direction::Positive,
        ..bank(0, 0.0, 1.0, vec![vec![1.0, 1.0]])
    });
    draft.banks.push(DraftBank {
        direction: Direction::Negative,
        ..bank(0, 0.0, 1.0, vec![vec![2.0, 2.0]])
    });
    draft.terms.push(term(0, 1.0, &[1]));
    let blob = draft.encode().unwrap();
    let c = Small::from_blob(&blob).unwrap();
    for (travel, expected) in [
        (Travel::Unknown, 0.0),
        (Travel::Positive, 1.0),
        (Travel::Negative, 2.0),
    ] {
        let travelling = Travelling([travel, Travel::Unknown, Travel::Positive]);
        let found = c.evaluate(&Inputs::default(), &travelling, &c.weights());
        assert_eq!(found, [expected, 0.0, 0.0]);
    }
}

#[test]
fn adjustable_terms_take_weights_within_their_limits_and_others_none() {
    let mut draft = only(bank(0, 0.0, 1.0, vec![vec![1.0, 1.0]]));
    draft.terms.push(adjustable(0, 2.0, [-4.0, 4.0], &[0]));
    draft.terms.push(adjustable(0, 8.0, [0.0, 8.0], &[]));
    draft.terms.push(adjustable(1, 16.0, [0.0, 16.0], &[0, 0]));
    let blob = draft.encode().unwrap();
    let c = Small::from_blob(&blob).unwrap();
    let mut weights = c.weights();
    assert_eq!(at(&c, 0.0, 0.0, 0.0), [11.0, 16.0, 0.0]);
    assert_eq!(weights.set(0, 1.0), Err(WeightError::NotAdjustable));
    assert_eq!(weights.set(4, 1.0), Err(WeightError::NotAdjustable));
    for wrong in [4.1, -4.1, f32::NAN, f32::INFINITY] {
        let refused = WeightError::OutsideLimits {
            low: -4.0,
            high: 4.0,
        };
        assert_eq!(weights.set(1, wrong), Err(refused));
    }
    assert_eq!(weights, c.weights());
    weights.set(1, -4.0).unwrap();
    weights.set(3, 0.0).unwrap();
    assert_eq!(weights.get(1), Some(-4.0));
    assert_eq!(
        weights.iter().collect::<Vec<_>>(),
        [(1, -4.0), (2, 8.0), (3, 0.0)]
    );
    let found = c.evaluate(&Inputs::default(), &Travelling::default(), &weights);
    assert_eq!(found, [5.0, 0.0, 0.0]);
}

#[test]
fn inputs_that_are_not_numbers_give_finite_corrections() {
    let blob = everything().encode().unwrap();
    let c = Small::from_blob(&blob).unwrap();
    let odd = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        1e-45,
        -0.0,
        3e9,
    ];
    let travels = [Travel::Unknown, Travel::Positive, Travel::Negative];
    for number in 0..odd.len().pow(4) {
        let pick = |k: u32| odd[number / odd.len().pow(k) % odd.len()];
        for travel in travels {
            let mut inputs = Inputs::at([pick(0), pick(1), pick(2)]);
            inputs.auxiliaries[0] = pick(3);
            let found = c.evaluate(&inputs, &Travelling([travel; 3]), &c.weights());
            assert!(found.iter().all(|v| v.is_finite()), "{inputs:?}: {found:?}");
        }
    }
}

#[test]
fn an_empty_compensation_corrects_nothing() {
    assert_eq!(at(&Small::empty(), 1.0, f32::NAN, 2.0), [0.0; 3]);
}

#[test]
fn many_positions_are_evaluated_as_each_of_them_is() {
    let blob = everything().encode().unwrap();
    let c = Small::from_blob(&blob).unwrap();
    let positions: Vec<Inputs<[f32; 3]>> = (0..100_u8)
        .map(|k| f32::from(k) * 13.7 - 600.0)
        .map(|x| Inputs::at([x, 0.3 * x, -0.1 * x]))
        .collect();
    let travel = Travelling([Travel::Positive, Travel::Negative, Travel::Unknown]);
    let untouched = [7.0; 3];
    let mut corrections = vec![untouched; 120];
    let count = c.evaluate_each(&positions, &travel, &c.weights(), &mut corrections);
    assert_eq!(count, positions.len());
    for (inputs, found) in positions.iter().zip(&corrections) {
        assert_eq!(*found, c.evaluate(inputs, &travel, &c.weights()));
    }
    assert!(corrections[..count].iter().any(|found| *found != [0.0; 3]));
    assert!(corrections[count..].iter().all(|found| *found == untouched));
    let few = &mut corrections[..7];
    assert_eq!(c.evaluate_each(&positions, &travel, &c.weights(), few), 7);
}

#[test]
fn integers_are_interpolated_before_they_are_scaled() {
    let mut draft = only(DraftBank {
        format: SampleFormat::I16,
        ..bank(0, 0.0, 4.0, vec![vec![0.0, 32767.0], vec![0.0, -65534.0]])
    });
    draft.grids.push(DraftGrid {
        axes: vec![GridAxis {
            input: 0,
            start: 0.0,
            step: 4.0,
            points: 2,
            modulo: false,
        }],
        outputs: vec![2],
        format: SampleFormat::I16,
        values: vec![0.0, 32767.0 * 4.0],
    });
    let blob = draft.encode().unwrap();
    let c = Small::from_blob(&blob).unwrap();
    // Scales are 1, 2 and 4: exact.
    assert_eq!(at(&c, 1.0, 0.0, 0.0), [8191.75, -16383.5, 32767.0]);
}

/// Banks of every kind with f32 samples, terms of 0 to 6 factors, grids of 1 to 3 inputs.
fn drafts() -> impl Strategy<Value = Draft> {
    let column = |points| prop::collection::vec(-10.0_f32..10.0, points);
    let one_bank = (
        0_u8..4,
        -500.0_f32..500.0,
        0.015_625_f32..100.0,
        any::<bool>(),
        0..4_usize,
        any::<bool>(),
        (2_usize..9, 1_usize..4),
    )
        .prop_flat_map(
            move |(input, start, step, modulo, direction, cubic, (points, tables))| {
                prop::collection::vec(column(points), tables).prop_map(move |columns| DraftBank {
                    modulo,
                    direction: [
                        Direction::Both,
                        Direction::Positive,
                        Direction::Negative,
                        Direction::Signed,
                    ][if input == 3 { 0 } else { direction }],
                    interpolation: if cubic && columns[0].len() >= 4 {
                        Interpolation::Cubic
                    } else {
                        Interpolation::Linear
                    },
                    ..bank(input, start, step, columns)
                })
            },
        );
    let one_grid = (
        prop::collection::vec(
            (
                0_u8..4,
                -500.0_f32..500.0,
                0.015_625_f32..300.0,
                2_u32..4,
                any::<bool>(),
            ),
            1..4,
        ),
        1_usize..4,
    )
        .prop_flat_map(|(axes, width)| {
            let nodes: u32 = axes.iter().map(|a| a.3).product();
            prop::collection::vec(-1.0_f32..1.0, nodes as usize * width).prop_map(move |values| {
                DraftGrid {
                    axes: axes
                        .iter()
                        .map(|&(input, start, step, points, modulo)| GridAxis {
                            input,
                            start,
                            step,
                            points,
                            modulo,
                        })
                        .collect(),
                    outputs: (0..width as u8).collect(),
                    format: SampleFormat::F32,
                    values,
                }
            })
        });
    (
        prop::collection::vec(one_bank, 1..5),
        prop::collection::vec(one_grid, 0..3),
    )
        .prop_flat_map(|(banks, grids)| {
            let tables: usize = banks.iter().map(|b| b.columns.len()).sum();
            let one_term = (
                0_u8..3,
                prop_oneof![Just(1.0_f32), -2.0_f32..2.0],
                prop::bool::weighted(0.2),
                prop_oneof![
                    8 => prop::collection::vec(0..tables as u8, 0..3),
                    1 => prop::collection::vec(0..tables as u8, 0..7),
                ],
            )
                .prop_map(|(output, weight, free, factors)| Term {
                    limits: free.then_some([-2.0, 2.0]),
                    ..term(output, weight, &factors)
                });
            prop::collection::vec(one_term, 0..16).prop_map(move |mut terms| {
                // Neighbouring terms often share an output; sorting some of them makes long runs.
                if terms.len() % 2 == 0 {
                    terms.sort_by_key(|t| t.output);
                }
                let mut draft = bare();
                draft.auxiliaries = everything().auxiliaries;
                draft.banks = banks.clone();
                draft.grids = grids.clone();
                draft.terms = terms;
                draft
            })
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: if cfg!(miri) { 4 } else { 2000 }, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_bit_is_as_specified_and_close_to_the_truth(
        draft in drafts(),
        positions in prop::collection::vec((prop::array::uniform4(-1000.0_f32..1000.0), prop::array::uniform3(0..3_usize)), 20),
        fresh in prop::collection::vec(-2.0_f32..2.0, 16),
    ) {
        let blob = draft.encode().unwrap();
        let c = Small::from_blob(&blob).unwrap();
        let mut weights = c.weights();
        let mut list: Vec<f32> = draft.terms.iter().map(|t| t.weight).collect();
        for (k, term) in draft.terms.iter().enumerate() {
            if term.limits.is_some() {
                list[k] = fresh[k];
                weights.set(k, fresh[k]).unwrap();
            }
        }
        for (x, direction) in positions {
            let travel = direction.map(|d| [Travel::Unknown, Travel::Positive, Travel::Negative][d]);
            let mut inputs = Inputs::at([x[0], x[1], x[2]]);
            inputs.auxiliaries[0] = x[3];
            let found = c.evaluate(&inputs, &Travelling(travel), &weights);
            prop_assert_eq!(&found[..], &crate::oracle::to_the_letter(&draft, &x, &travel, &list)[..]);
            if draft.grids.is_empty() {
                let truth = crate::oracle::in_f64(&draft, &x, &travel, &list);
                for (found, (truth, bound)) in found.iter().zip(truth) {
                    prop_assert!((f64::from(*found) - truth).abs() <= bound, "{} {} {}", found, truth, bound);
                }
            }
        }
    }
}
