use std::collections::BTreeSet;
use std::string::{String, ToString};
use std::vec;
use std::vec::Vec;

use proptest::prelude::*;
use serde::Serialize;

use crate::LoadError as E;
use crate::draft::{Samples, Wire, WireBank, assemble};
use crate::header::checksum;
use crate::specimen::{adjustable, bank, bare, everything, term};
use crate::*;

type Small<'a> = Compensation<'a, Holds<3, 8, 8, 16, 2>>;

fn refusal(bytes: &[u8]) -> LoadError {
    Small::from_blob(&AlignedBlob::from_bytes(bytes)).unwrap_err()
}

/// Writes a correct checksum into damaged bytes.
fn seal(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = checksum(&bytes);
    bytes[12..16].copy_from_slice(&sum.to_le_bytes());
    bytes
}

fn good() -> Vec<u8> {
    everything().encode().unwrap().to_vec()
}

/// An error and the expected one.
type Damage = (E, E);

/// A draft that is changed before it is written.
fn drafted(expected: E, change: impl FnOnce(&mut Draft)) -> Damage {
    let mut draft = everything();
    change(&mut draft);
    (refusal(&written(&draft, |_| ())), expected)
}

/// A description that is changed before it is written.
fn rewired(expected: E, rewire: impl FnOnce(&mut Wire<'_>)) -> Damage {
    (refusal(&written(&everything(), rewire)), expected)
}

/// The bytes of a draft, valid or not.
fn written(draft: &Draft, rewire: impl FnOnce(&mut Wire<'_>)) -> Vec<u8> {
    let mut samples = Samples::default();
    let mut wire = draft.wire(&mut samples).unwrap();
    rewire(&mut wire);
    assemble(&bytes(&wire), &samples, &[]).unwrap().to_vec()
}

fn bytes<T: Serialize + ?Sized>(value: &T) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap()
}

/// The description in nine pieces, which postcard writes consecutively.
fn pieces(draft: &Draft) -> (Vec<Vec<u8>>, Samples) {
    let mut samples = Samples::default();
    let w = draft.wire(&mut samples).unwrap();
    let pieces = vec![
        bytes(w.machine),
        bytes(&w.policy),
        bytes(&w.floats),
        bytes(&w.shorts),
        bytes(w.axes),
        bytes(w.auxiliaries),
        bytes(&w.banks),
        bytes(w.terms),
        bytes(&w.grids),
    ];
    (pieces, samples)
}

/// The error if one piece is replaced.
fn replaced(piece: usize, by: &[u8]) -> LoadError {
    let (mut pieces, samples) = pieces(&everything());
    pieces[piece] = by.to_vec();
    refusal(&assemble(&pieces.concat(), &samples, &[]).unwrap())
}

/// Iterations of all loops while these bytes are loaded or refused, as a fraction of the permitted number.
fn rounds(bytes: &[u8]) -> f64 {
    let blob = AlignedBlob::from_bytes(bytes);
    let mut place = std::boxed::Box::new(Largest::empty());
    let _ = crate::work::rounds();
    let _ = place.load(&blob);
    let [each, first] = crate::work::MOST_ROUNDS;
    crate::work::rounds() as f64 / (each * bytes.len() as u64 + first) as f64
}

#[test]
fn loading_takes_as_long_as_the_blob_has_bytes() {
    let all = good();
    assert!(rounds(&all) < 1.0);
    // Banks of f32 claim the maximum number of tables without using a byte for any.
    let mut draft = everything();
    draft.terms.clear();
    let mut samples = Samples::default();
    let mut wire = draft.wire(&mut samples).unwrap();
    let claims = 5000;
    wire.banks = (0..claims)
        .map(|number| WireBank {
            bank: Bank {
                input: 0,
                start: 0.0,
                step: 1.0,
                points: 2,
                modulo: false,
                direction: Direction::Both,
                interpolation: Interpolation::Linear,
                format: SampleFormat::F32,
                tables: u16::MAX,
                first: number * 2 * u32::from(u16::MAX),
            },
            scales: vec![],
        })
        .collect();
    wire.floats = claims * 2 * u32::from(u16::MAX);
    let bytes = assemble(&bytes(&wire), &samples, &[]).unwrap();
    assert!(matches!(
        refusal(&bytes),
        LoadError::TooManyTables {
            found: 327_675_000..
        }
    ));
    assert!(rounds(&bytes) < 1.0, "{}", rounds(&bytes));
    // Everything at full capacity.
    let mut draft = everything();
    draft.grids.clear();
    let column = vec![0.001; 2];
    draft.banks = vec![bank(0, 0.0, 1.0, vec![column.clone(); 250])];
    draft
        .banks
        .extend((0..5).map(|_| bank(1, 0.0, 1.0, vec![column.clone()])));
    draft.terms = (0..4096_u32)
        .map(|k| {
            term(
                (k % 3) as u8,
                if k < 2048 { 1.0 } else { 0.5 },
                &[(k % 255) as u8; 6][..(k % 7) as usize],
            )
        })
        .collect();
    assert!(rounds(&draft.encode().unwrap()) < 1.0);
}

macro_rules! variants {
    ($($name:ident)*) => {
        const ALL: &[&str] = &[$(stringify!($name)),*];
        /// The compiler ensures that no variant is missing.
        fn variant(error: LoadError) -> &'static str {
            match error { $(LoadError::$name { .. } => stringify!($name)),* }
        }
    };
}

variants! {
    NoHeader BadMagic UnknownVersion Notes WrongLength BadChecksum Misaligned Truncated
    Malformed UnknownVariant TooSmall TooManyTables TooManyAuxiliaries TooManyAdjustable NoAxes
    AxisName DuplicateAxis Travel AxisPeriod EndlessTravel ValueBound RateBound ReversalThreshold RampRate Reference Input Start
    Step Points Period PeriodMismatch DirectionOfAuxiliary EmptyBank ScaleCount Scale SamplesMisplaced
    SamplesOutside UnusedSamples TableSample GridSample TableMagnitude TermOutput Weight Limits
    WeightOutsideLimits TooManyFactors Factor TermMagnitude OutputMagnitude GridInputs GridOutputs
    PaddingNotZero SectionLength Damping TooLong LagRate Reversal Sensor
}

fn header_damages() -> Vec<Damage> {
    let length = good().len() as u32;
    let patched = |at: usize, byte: u8| {
        let mut bytes = good();
        bytes[at] = byte;
        refusal(&seal(bytes))
    };
    let longer = [good(), vec![0]].concat();
    let wrong = |stated, held| E::WrongLength { stated, held };
    let shifted = [vec![0; 2], good()].concat();
    let aligned = AlignedBlob::from_bytes(&shifted);
    vec![
        (refusal(&good()[..15]), E::NoHeader),
        (refusal(&[]), E::NoHeader),
        (patched(0, b't'), E::BadMagic),
        (patched(4, 2), E::UnknownVersion { found: 2 }),
        (patched(5, 1), E::UnknownVersion { found: 257 }),
        (
            patched(6, 1),
            E::SectionLength {
                stated: length - 1,
                computed: length,
            },
        ),
        (patched(7, 0xff), E::Notes { stated: 0xff00 }),
        (
            refusal(&good()[..good().len() - 1]),
            wrong(length, length - 1),
        ),
        (refusal(&longer), wrong(length, length + 1)),
        (patched(8, (length + 1) as u8), wrong(length + 1, length)),
        (
            refusal(&[&good()[..8], &[15, 0, 0, 0, 0, 0, 0, 0]].concat()),
            wrong(15, 16),
        ),
        (
            refusal(&{
                let mut bytes = good();
                bytes[12] ^= 1;
                bytes
            }),
            E::BadChecksum,
        ),
        (Small::from_blob(&aligned[2..]).unwrap_err(), E::Misaligned),
    ]
}

fn encoding_damages() -> Vec<Damage> {
    let truncated = |part| E::Truncated { part };
    let malformed = |part| E::Malformed { part };
    let unknown = |part, found| E::UnknownVariant { part, found };
    let short = |draft: &Draft, keep: usize, extra: &[u8]| {
        let (pieces, _) = pieces(draft);
        let description = [&pieces[..keep].concat(), extra].concat();
        // Without padding and samples, so that the end of the description is the end of the blob.
        let mut bytes = [good()[..16].to_vec(), description].concat();
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        refusal(&seal(bytes))
    };
    let all = everything();
    let cases = [
        (0, Part::Machine),
        (1, Part::Policy),
        (2, Part::SampleCounts),
        (3, Part::SampleCounts),
        (4, Part::Axes),
        (5, Part::Auxiliaries),
        (6, Part::Banks),
        (7, Part::Terms),
        (8, Part::Grids),
    ];
    let mut list: Vec<_> = cases
        .into_iter()
        .map(|(keep, part)| (short(&all, keep, &[]), truncated(part)))
        .collect();
    let bank = |modulo: u8, direction: u8, interpolation: u8, format: u8| {
        let fixed = (0_u8, 0.0_f32, 1.0_f32, 2_u32);
        let rest = (
            modulo,
            direction,
            interpolation,
            format,
            1_u16,
            0_u32,
            Vec::<f32>::new(),
        );
        replaced(6, &bytes(&(1_u8, fixed, rest)))
    };
    let auxiliary = |kind: u8, name: &str| replaced(5, &bytes(&(1_u8, kind, name, 0.0_f32)));
    list.extend([
        (short(&all, 4, &[1]), truncated(Part::Axis(0))),
        (short(&all, 5, &[1, 0]), truncated(Part::Auxiliary(0))),
        (short(&all, 6, &[1, 0]), truncated(Part::Bank(0))),
        (short(&all, 7, &[1, 0]), truncated(Part::Term(0))),
        (short(&all, 8, &[1, 1, 0]), truncated(Part::Grid(0))),
        (replaced(0, &[2, 0xff, 0xff]), malformed(Part::Machine)),
        (replaced(2, &[0xff; 5]), malformed(Part::SampleCounts)),
        (short(&all, 1, &[1, 0]), truncated(Part::Policy)),
        (replaced(1, &[3]), unknown(Part::Policy, 3)),
        (auxiliary(2, "t"), unknown(Part::Auxiliary(0), 2)),
        (
            auxiliary(0, "seventeen letters"),
            malformed(Part::Auxiliary(0)),
        ),
        (bank(2, 0, 0, 0), malformed(Part::Bank(0))),
        (bank(0, 4, 0, 0), unknown(Part::Bank(0), 4)),
        (bank(0, 0, 2, 0), unknown(Part::Bank(0), 2)),
        (bank(0, 0, 0, 2), unknown(Part::Bank(0), 2)),
    ]);
    list
}

/// Contents of `everything()`.
const NEEDED: Counts = Counts {
    axes: 3,
    banks: 6,
    tables: 7,
    terms: 10,
    grids: 2,
};

#[test]
fn a_refusal_names_every_capacity_that_is_too_small_and_what_to_raise_them_to() {
    type Small = crate::capacities!(axes: 1, banks: 8, tables: 5, terms: 9, grids: 1);
    type Raised = crate::capacities!(axes: 3, banks: 8, tables: 7, terms: 10, grids: 2);
    type Exact = crate::capacities!(axes: 3, banks: 6, tables: 7, terms: 10, grids: 2);
    let blob = everything().encode().unwrap();
    let error = Compensation::<'_, Small>::from_blob(&blob).unwrap_err();
    assert_eq!(
        error.to_string(),
        "too large for this target: 3 axes, of which it holds 1; 7 tables, of which it holds 5; \
         10 terms, of which it holds 9; 2 grids, of which it holds 1; raise its capacities to \
         trueaxis::capacities!(axes: 3, banks: 8, tables: 7, terms: 10, grids: 2)"
    );
    assert!(Compensation::<'_, Raised>::from_blob(&blob).is_ok());
    assert!(Compensation::<'_, Exact>::from_blob(&blob).is_ok());
}

#[test]
fn what_a_blob_does_not_have_needs_no_room() {
    type Nothing = crate::capacities!(axes: 3, banks: 0, tables: 0, terms: 0, grids: 0);
    type Tables = crate::capacities!(axes: 3, banks: 6, tables: 7, terms: 10, grids: 0);
    let at = Inputs::at([0.5, -0.5, 0.25]);
    let mut draft = everything();
    draft.grids.clear();
    let blob = draft.encode().unwrap();
    let tight = Compensation::<'_, Tables>::from_blob(&blob).unwrap();
    let wide = Compensation::<'_, Holds<3, 8, 8, 16, 2>>::from_blob(&blob).unwrap();
    let moving = Travelling::default();
    assert_eq!(
        tight.evaluate(&at, &moving, &tight.weights()),
        wide.evaluate(&at, &moving, &wide.weights())
    );
    draft.terms.clear();
    draft.banks.clear();
    let blob = draft.encode().unwrap();
    let empty = Compensation::<'_, Nothing>::from_blob(&blob).unwrap();
    assert_eq!(empty.evaluate(&at, &moving, &empty.weights()), [0.0; 3]);
}

/// The error for a blob whose header states another length.
fn stated(length: usize) -> LoadError {
    let mut bytes = good();
    bytes[8..12].copy_from_slice(&(length as u32).to_le_bytes());
    refusal(&bytes)
}

#[test]
fn a_blob_is_at_most_64_mib_for_readers_and_writers() {
    assert_eq!(LARGEST_BLOB, 64 << 20);
    assert!(matches!(stated(LARGEST_BLOB), E::WrongLength { .. }));
    let stated = stated(LARGEST_BLOB + 1);
    assert!(matches!(stated, E::TooLong { .. }));
    let mut draft = bare();
    let mut with = |points: usize| {
        draft.banks = vec![bank(0, 0.0, 1.0, vec![vec![0.0; points]])];
        draft.encode()
    };
    // Header and description take about 100 bytes.
    assert!(with(LARGEST_BLOB / 4 - 100).is_ok());
    assert_eq!(with(LARGEST_BLOB / 4), Err(EncodeError::TooLarge));
}

fn capacity_damages() -> Vec<Damage> {
    fn small<C: Room>(blob: &[u8]) -> Damage {
        let error = Compensation::<'_, C>::from_blob(blob).unwrap_err();
        let (needed, held) = (NEEDED, Counts::of::<C>());
        (error, E::TooSmall { needed, held })
    }
    let blob = everything().encode().unwrap();
    vec![
        small::<Holds<2, 6, 7, 10, 2>>(&blob),
        small::<Holds<3, 5, 7, 10, 2>>(&blob),
        small::<Holds<3, 6, 6, 10, 2>>(&blob),
        small::<Holds<3, 6, 7, 9, 2>>(&blob),
        small::<Holds<3, 6, 7, 10, 1>>(&blob),
        small::<Holds<1, 0, 0, 0, 0>>(&blob),
        (
            stated(LARGEST_BLOB + 1),
            E::TooLong {
                stated: LARGEST_BLOB as u32 + 1,
            },
        ),
        drafted(E::TooManyTables { found: 307 }, |d| {
            d.banks.push(bank(0, 0.0, 1.0, vec![vec![0.0; 2]; 300]))
        }),
        drafted(E::TooManyAuxiliaries { found: 9 }, |d| {
            d.auxiliaries = vec![d.auxiliaries[0].clone(); 9]
        }),
        (
            Compensation::<'_, Holds<3, 8, 8, 32, 2>>::from_blob(&{
                let mut draft = everything();
                draft.terms = vec![adjustable(0, 1.0, [0.0, 1.0], &[]); 17];
                AlignedBlob::from_bytes(&written(&draft, |_| ()))
            })
            .unwrap_err(),
            E::TooManyAdjustable { term: 16 },
        ),
    ]
}

fn axis_damages() -> Vec<Damage> {
    let mut list = vec![
        drafted(E::NoAxes, |d| d.axes.clear()),
        drafted(E::AxisName { axis: 1 }, |d| d.axes[1].name = b'1'),
        drafted(E::AxisName { axis: 1 }, |d| d.axes[1].name = 0xc4),
        drafted(E::DuplicateAxis { axis: 2 }, |d| d.axes[2].name = b'X'),
        drafted(E::Reference { auxiliary: 0 }, |d| {
            d.auxiliaries[0].reference = f32::NAN
        }),
    ];
    for bad in [1.001, 0.99e-7, -0.1, f32::NAN, f32::INFINITY] {
        list.push(drafted(E::LagRate { auxiliary: 0 }, |d| {
            d.auxiliaries[0].kind = AuxiliaryKind::Temperature;
            d.auxiliaries[0].sensor.lag_rate = bad;
        }));
    }
    let sensors = [
        ([0.0099, 5.0, 120.0], 20.0),
        ([10.01, 5.0, 120.0], 20.0),
        ([f32::NAN, 5.0, 120.0], 20.0),
        ([0.1, 5.0, 5.0], 20.0),
        ([0.1, 6.0, 5.0], 20.0),
        ([0.1, f32::NAN, 5.0], 20.0),
        ([0.1, 5.0, f32::NAN], 20.0),
        ([0.1, -1001.0, 5.0], 20.0),
        ([0.1, 5.0, 1001.0], 20.0),
        ([0.1, 5.0, 120.0], 1001.0),
    ];
    for ([rate, low, high], reference) in sensors {
        list.push(drafted(E::Sensor { auxiliary: 0 }, |d| {
            let auxiliary = &mut d.auxiliaries[0];
            auxiliary.kind = AuxiliaryKind::Temperature;
            auxiliary.reference = reference;
            auxiliary.sensor.rate = rate;
            auxiliary.sensor.range = [low, high];
        }));
    }
    let travels = [
        [1.0, 1.0],
        [1.0, -1.0],
        [f32::NAN, 1.0],
        [0.0, f32::NAN],
        [0.0, f32::INFINITY],
        [f32::NEG_INFINITY, 0.0],
    ];
    for travel in travels {
        list.push(drafted(E::Travel { axis: 1 }, |d| {
            d.axes[1].travel = travel
        }));
    }
    for bad in [-360.0, 1e-10, 1e10, f32::NAN, f32::INFINITY, -f32::INFINITY] {
        list.push(drafted(E::AxisPeriod { axis: 2 }, |d| {
            d.axes[2].period = bad
        }));
    }
    for travel in [[-f32::MAX, 360.0], [0.0, f32::MAX], [0.0, 360.0]] {
        list.push(drafted(E::EndlessTravel { axis: 2 }, |d| {
            d.axes[2].travel = travel
        }));
    }
    for bad in [0.0, -1.0, 1e-10, 1e10, f32::NAN, f32::INFINITY] {
        list.extend([
            drafted(E::ValueBound { axis: 0 }, |d| d.axes[0].value_bound = bad),
            drafted(E::RateBound { axis: 1 }, |d| d.axes[1].rate_bound = bad),
            drafted(E::RampRate { axis: 2 }, |d| d.axes[2].ramp_rate = bad),
            drafted(E::Reversal { axis: 1 }, |d| d.axes[1].reversal_rate = bad),
            drafted(E::Reversal { axis: 1 }, |d| {
                d.axes[1].reversal_acceleration = bad
            }),
        ]);
    }
    for bad in [-1.0, 1e10, f32::NAN, f32::INFINITY] {
        list.push(drafted(E::ReversalThreshold { axis: 0 }, |d| {
            d.axes[0].reversal_threshold = bad
        }));
    }
    list
}

fn span_damages() -> Vec<Damage> {
    let (b, c, g) = (Part::Bank(1), Part::Bank(2), Part::Grid(0));
    let step = |part| E::Step { part };
    let start = |part| E::Start { part };
    let mismatch = |part| E::PeriodMismatch { part };
    let count = |part, points| E::Points { part, points };
    let mut list = vec![
        drafted(E::Input { part: b, input: 4 }, |d| d.banks[1].input = 4),
        drafted(E::Input { part: g, input: 9 }, |d| {
            d.grids[0].axes[1].input = 9
        }),
        drafted(E::DirectionOfAuxiliary { bank: 5 }, |d| {
            d.banks[5].direction = Direction::Negative;
        }),
        drafted(E::EmptyBank { bank: 1 }, |d| d.banks[1].columns.clear()),
    ];
    for bad in [0.0, -1.0, 1e-40, f32::NAN, f32::INFINITY] {
        list.push(drafted(step(b), |d| d.banks[1].step = bad));
        list.push(drafted(step(g), |d| d.grids[0].axes[2].step = bad));
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        list.push(drafted(start(b), |d| d.banks[1].start = bad));
        list.push(drafted(start(g), |d| d.grids[0].axes[0].start = bad));
    }
    let far = |d: &mut Draft| (d.banks[1].start, d.banks[1].step) = (3e38, 2e37);
    list.push(drafted(start(b), far));
    // Half a turn too long, twice as long, longer by a thousandth, longer by two units in the last place.
    for wrong in [135.0, 180.0, 90.09, 90.00003] {
        list.push(drafted(mismatch(c), |d| d.banks[2].step = wrong));
        list.push(drafted(mismatch(g), |d| {
            d.grids[0].axes[2].step = 2.0 * wrong
        }));
    }
    let turn = |d: &mut Draft| (d.banks[2].start, d.banks[2].step) = (-3e38, 1e38);
    list.push(drafted(E::Period { part: c }, turn));
    for points in [0, 1, (1 << 24) + 1, u32::MAX] {
        list.push(rewired(count(b, points), |w| {
            w.banks[1].bank.points = points
        }));
        list.push(rewired(count(g, points), |w| {
            w.grids[0].axes[1].points = points
        }));
    }
    // For cubic tables the minimum is the number of samples needed for one interval.
    for (n, points) in [(2, 3), (4, 3), (4, 2)] {
        list.push(rewired(count(Part::Bank(n as u16), points), |w| {
            w.banks[n].bank.points = points
        }));
    }
    list
}

fn sample_damages() -> Vec<Damage> {
    let (bank, grid) = (Part::Bank, Part::Grid);
    let count = |part, found| E::ScaleCount { part, found };
    let misplaced = |part| E::SamplesMisplaced { part };
    let outside = |part| E::SamplesOutside { part };
    let scale = |part| E::Scale { part, index: 0 };
    let mut list = vec![
        rewired(count(bank(1), 1), |w| w.banks[1].scales.push(1.0)),
        rewired(count(bank(3), 0), |w| w.banks[3].scales.clear()),
        rewired(count(grid(0), 1), |w| w.grids[0].scales.push(1.0).unwrap()),
        rewired(count(grid(1), 0), |w| w.grids[1].scales.clear()),
        // Overlaps the previous bank.
        rewired(misplaced(bank(1)), |w| w.banks[1].bank.first -= 1),
        rewired(misplaced(bank(4)), |w| w.banks[4].bank.first += 1),
        rewired(misplaced(grid(1)), |w| w.grids[1].first = 0),
        rewired(outside(grid(1)), |w| w.grids[1].axes[0].points = 4),
        rewired(outside(bank(5)), |w| w.banks[5].bank.points = 1 << 24),
        // The product of the counts is beyond 2⁶⁴ / 3.
        rewired(outside(grid(0)), |w| {
            for a in &mut w.grids[0].axes {
                (a.points, a.step) = (1 << 24, 360.0 / 16_777_216.0);
            }
        }),
        rewired(E::UnusedSamples, |w| w.floats += 1),
        rewired(E::UnusedSamples, |w| w.shorts += 1),
        drafted(E::TableSample { table: 2, point: 3 }, |d| {
            d.banks[1].columns[1][3] = f32::NAN
        }),
        drafted(E::TableSample { table: 1, point: 4 }, |d| {
            d.banks[1].columns[0][4] = f32::INFINITY
        }),
        drafted(E::GridSample { grid: 0, node: 10 }, |d| {
            d.grids[0].values[31] = f32::NEG_INFINITY
        }),
        drafted(E::TableMagnitude { table: 1 }, |d| {
            d.banks[1].columns[0][4] = 1.1e15
        }),
        drafted(E::TableMagnitude { table: 3 }, |d| {
            d.banks[2].columns[0][1] = 1.1e15
        }),
    ];
    for bad in [0.0, -1.0, 1e-31, 1e10, f32::NAN] {
        list.push(rewired(scale(bank(3)), |w| w.banks[3].scales[0] = bad));
        list.push(rewired(scale(grid(1)), |w| w.grids[1].scales[0] = bad));
    }
    list
}

fn term_and_grid_damages() -> Vec<Damage> {
    let (pieces, samples) = pieces(&everything());
    let padded = assemble(&pieces.concat(), &samples, &[]).unwrap();
    let used = 16 + pieces.concat().len();
    assert!(!used.is_multiple_of(32));
    let longer = [&padded[..], &[0; 32]].concat();
    let stated = padded.len() as u32 + 32;
    let many: Vec<u8> = bytes(&(1_u8, 0_u8, 1.0_f32, None::<u8>, vec![0_u8; 7]));
    let grid = |inputs: Vec<GridAxis>| replaced(8, &bytes(&(1_u8, inputs)));
    let axis = everything().grids[0].axes[0];
    let outputs = |list: &[u8]| replaced(8, &bytes(&(1_u8, vec![axis], list)));
    let only_so_many = |outputs: u8| {
        let (mut pieces, _) = self::pieces(&everything());
        pieces[8] = bytes(&(1_u8, vec![axis], outputs));
        let bytes = assemble(&pieces.concat(), &Samples::default(), &[]).unwrap();
        let end = 16 + pieces.concat().len();
        let mut bytes = bytes[..end].to_vec();
        bytes[8..12].copy_from_slice(&(end as u32).to_le_bytes());
        refusal(&seal(bytes))
    };
    let bad_outputs = E::GridOutputs { grid: 0 };
    let mut list = vec![
        drafted(E::TermOutput { term: 4 }, |d| d.terms[4].output = 3),
        drafted(E::WeightOutsideLimits { term: 7 }, |d| {
            d.terms[7].weight = 1.1
        }),
        (replaced(7, &many), E::TooManyFactors { term: 0, found: 7 }),
        (
            replaced(7, &bytes(&(1_u8, 0_u8, 1.0_f32, None::<u8>, 9_u8))),
            E::TooManyFactors { term: 0, found: 9 },
        ),
        drafted(E::Factor { term: 1, table: 7 }, |d| {
            d.terms[1].factors[1] = 7
        }),
        drafted(E::TermMagnitude { term: 1 }, |d| {
            d.banks[1].columns[0][0] = 1e8;
            d.terms[0] = term(0, 1e-20, &[1, 1, 1, 1]);
            d.terms[1] = term(0, 1e-5, &[1, 1, 1]);
        }),
        drafted(E::TermMagnitude { term: 7 }, |d| {
            d.terms[7] = adjustable(2, 0.0, [-2e15, 0.0], &[])
        }),
        drafted(E::OutputMagnitude { axis: 1 }, |d| {
            d.terms[4].weight = 0.6e15;
            d.terms[5] = term(1, -0.6e15, &[]);
        }),
        drafted(E::OutputMagnitude { axis: 2 }, |d| {
            d.grids[0].values[2] = 1.1e15
        }),
        drafted(E::OutputMagnitude { axis: 1 }, |d| {
            d.grids[0].values[1] = 0.99e15;
            d.grids[1].values[2] = -2e13;
        }),
        (grid(vec![]), E::GridInputs { grid: 0, found: 0 }),
        (grid(vec![axis; 4]), E::GridInputs { grid: 0, found: 4 }),
        (outputs(&[]), bad_outputs),
        (outputs(&[3]), bad_outputs),
        (outputs(&[1, 1]), bad_outputs),
        (outputs(&[0; 7]), bad_outputs),
        // The count alone reveals it.
        (only_so_many(0), bad_outputs),
        (only_so_many(7), bad_outputs),
        (
            refusal(&seal({
                let mut bytes = padded.clone();
                bytes[used] = 1;
                bytes
            })),
            E::PaddingNotZero,
        ),
        (
            refusal(&seal({
                let mut bytes = longer;
                bytes[8..12].copy_from_slice(&stated.to_le_bytes());
                bytes
            })),
            E::SectionLength {
                stated,
                computed: stated - 32,
            },
        ),
    ];
    for damping in [f32::NAN, f32::INFINITY, 0.0, -0.1, 0.0099, 1.001] {
        list.push(drafted(E::Damping, |d| {
            d.policy = Policy::Direction { damping }
        }));
    }
    for bad in [f32::NAN, f32::INFINITY] {
        list.push(drafted(E::Weight { term: 2 }, |d| d.terms[2].weight = bad));
        for limits in [[bad, 1.0], [-1.0, bad], [1.0, 0.0]] {
            list.push(drafted(E::Limits { term: 7 }, |d| {
                d.terms[7].limits = Some(limits)
            }));
        }
    }
    list
}

fn damages() -> Vec<Damage> {
    let all = [
        header_damages(),
        encoding_damages(),
        capacity_damages(),
        axis_damages(),
        span_damages(),
        sample_damages(),
        term_and_grid_damages(),
    ];
    all.concat()
}

#[test]
fn every_damage_has_its_own_error_and_every_error_its_damage() {
    let mut reached = BTreeSet::new();
    for (number, (found, expected)) in damages().into_iter().enumerate() {
        assert_eq!(found, expected, "damage {number}");
        reached.insert(variant(found));
    }
    let missing: Vec<_> = ALL.iter().filter(|name| !reached.contains(*name)).collect();
    assert!(missing.is_empty(), "without a damage: {missing:?}");
}

#[test]
fn every_message_is_one_line_that_names_the_place() {
    for (error, _) in damages() {
        let message: String = error.to_string();
        assert!(!message.contains('\n') && message.len() > 6, "{error:?}");
    }
    let error = LoadError::Step {
        part: Part::Bank(1),
    };
    assert_eq!(
        error.to_string(),
        "bank 1: the step must be positive and finite"
    );
}

#[test]
fn every_single_flipped_bit_is_detected() {
    let good = good();
    let mut blob = good.clone();
    for bit in 0..good.len() * 8 {
        blob[bit / 8] ^= 1 << (bit % 8);
        assert!(
            Small::from_blob(&AlignedBlob::from_bytes(&blob)).is_err(),
            "bit {bit} of {}",
            good.len() * 8
        );
        blob[bit / 8] ^= 1 << (bit % 8);
    }
    assert!(Small::from_blob(&AlignedBlob::from_bytes(&blob)).is_ok());
}

#[test]
fn every_truncation_is_detected() {
    let good = good();
    for length in 0..good.len() {
        assert!(Small::from_blob(&AlignedBlob::from_bytes(&good[..length])).is_err());
    }
}

#[test]
fn a_slot_may_be_longer_than_its_blob() {
    let good = good();
    let slot = AlignedBlob::from_bytes(&[good.clone(), vec![0xff; 777]].concat());
    let mut c = Small::empty();
    assert!(matches!(c.load(&slot), Err(LoadError::WrongLength { .. })));
    c.load_slot(&slot).unwrap();
    assert_eq!(c.blob_len(), good.len());
    assert!(c.load_slot(&slot[..good.len() - 4]).is_err());
    assert_eq!(c.blob_len(), 0);
}

#[test]
fn what_is_refused_leaves_nothing_behind() {
    let blob = everything().encode().unwrap();
    let mut damaged = everything();
    damaged.terms[9].weight = f32::NAN;
    let damaged = AlignedBlob::from_bytes(&written(&damaged, |_| ()));
    let mut c = Small::empty();
    c.load(&blob).unwrap();
    assert_eq!(c.load(&damaged), Err(LoadError::Weight { term: 9 }));
    assert!(c.axes().is_empty() && c.terms().len() == 0 && c.samples() == 0);
    assert_eq!(c.weights(), Small::empty().weights());
    let inputs = Inputs::at([1.0, 2.0, 3.0]);
    let found = c.evaluate(&inputs, &Travelling::default(), &c.weights());
    assert_eq!(found, [0.0; 3]);
    // And it can be used again.
    c.load(&blob).unwrap();
    let fresh = Small::from_blob(&blob).unwrap();
    assert_eq!(
        c.evaluate(&inputs, &Travelling::default(), &c.weights()),
        fresh.evaluate(&inputs, &Travelling::default(), &fresh.weights())
    );
}

#[test]
fn inputs_of_inactive_terms_are_not_used() {
    let mut draft = bare();
    draft.banks = vec![
        bank(0, 0.0, 1.0, vec![vec![0.0, 1.0]]),
        bank(1, 0.0, 1.0, vec![vec![0.0, 1.0]]),
        bank(2, 0.0, 1.0, vec![vec![0.0, 1.0]]),
    ];
    draft.terms = vec![term(0, 0.0, &[0]), adjustable(0, 0.0, [0.0, 1.0], &[1])];
    let blob = draft.encode().unwrap();
    assert_eq!(Small::from_blob(&blob).unwrap().inputs_used(), 0b010);
}

/// The bytes of version 1 never change, so existing files stay readable.
#[test]
fn the_smallest_blob_is_written_as_specified() {
    let mut draft = Draft {
        machine: "m".to_string(),
        ..bare()
    };
    draft.axes.truncate(1);
    draft.banks = vec![bank(0, -1.0, 2.0, vec![vec![0.5, -0.5]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    let blob = draft.encode().unwrap();
    let float = |v: f32| v.to_le_bytes().to_vec();
    let description = [
        vec![1, b'm', 0, 2, 0, 1, b'X'],
        float(-1000.0),
        float(1000.0),
        float(0.0),
        float(1.0),
        float(10.0),
        float(0.01),
        float(0.5),
        float(10.0),
        float(10.0),
        vec![0, 1, 0],
        float(-1.0),
        float(2.0),
        vec![2, 0, 0, 0, 0, 1, 0, 0, 1, 0],
        float(1.0),
        vec![0, 1, 0, 0],
    ]
    .concat();
    assert_eq!(&blob[..12], b"TRAX\x01\0\0\0\x68\0\0\0");
    assert_eq!(&blob[16..16 + description.len()], &description[..]);
    assert!(blob[16 + description.len()..96].iter().all(|&b| b == 0));
    assert_eq!(blob[96..], [float(0.5), float(-0.5)].concat());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Debug builds check the invariants of evaluation, so this covers them too.
    #[test]
    fn whatever_the_bytes_they_are_refused_or_give_finite_corrections(
        damage in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![any::<u8>(), 0_u8..8]), 1..6),
        at in prop::array::uniform3(prop_oneof![-200.0_f32..200.0, any::<f32>()]),
    ) {
        let mut bytes = good();
        for (index, byte) in damage {
            let place = 16 + index.index(bytes.len() - 16);
            bytes[place] = byte;
        }
        let blob = AlignedBlob::from_bytes(&seal(bytes));
        if let Ok(c) = Small::from_blob(&blob) {
            for travel in [Travel::Unknown, Travel::Positive, Travel::Negative] {
                let found = c.evaluate(&Inputs::at(at), &Travelling([travel; 3]), &c.weights());
                prop_assert!(found.iter().all(|v| v.is_finite()), "{:?}", found);
            }
        }
    }
}

#[test]
fn a_modulo_table_fits_a_turn_of_its_axis_a_whole_number_of_times() {
    // For any number of points: steps and their multiples are rounded.
    for times in 1..=12_u16 {
        for points in 4..200_u16 {
            let mut draft = everything();
            draft.banks[2].step = 360.0 / f32::from(times) / f32::from(points);
            draft.banks[2].columns = vec![vec![0.01; usize::from(points)]];
            draft.encode().unwrap();
        }
    }
    // A bounded axis may repeat with any period, such as the pitch of its screw.
    let mut draft = everything();
    draft.banks[1].modulo = true;
    draft.encode().unwrap();
}

#[test]
fn a_modulo_table_may_miss_a_turn_by_as_much_as_rounding_takes_from_it() {
    let loaded = |turn: f32| {
        let mut draft = everything();
        draft.grids.clear();
        draft.axes[2].period = turn;
        // One revolution is 1, and four of them make a turn.
        draft.banks[2].step = 0.25;
        let blob = draft.encode();
        blob.map(|_| ()).map_err(|error| match error {
            EncodeError::Refused(error) => error,
            other => panic!("{other}"),
        })
    };
    let part = Part::Bank(2);
    let refused = Err(LoadError::PeriodMismatch { part });
    // 4/4 194 304 is two units in the last place above 4, and four below.
    let rounding = 4.0_f32 / 4_194_304.0;
    for turn in [4.0, 4.0 + rounding, 4.0 - rounding] {
        assert_eq!(loaded(turn), Ok(()), "{turn:e}");
    }
    for turn in [
        (4.0 + rounding).next_up(),
        (4.0 - rounding).next_down(),
        3.75,
        4.25,
        4.5,
    ] {
        assert_eq!(loaded(turn), refused, "{turn:e}");
    }
}

#[test]
fn as_many_auxiliaries_and_grid_outputs_are_read_as_there_can_be() {
    let mut draft = bare();
    draft.axes = b"XYZABC".map(crate::specimen::axis).into();
    draft.auxiliaries = vec![everything().auxiliaries[0].clone(); 8];
    draft.banks = vec![bank(13, 0.0, 1.0, vec![vec![0.0, 1.0]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    let mut grid = everything().grids[1].clone();
    grid.outputs = vec![5, 4, 3, 2, 1, 0];
    grid.values = vec![0.25; 18];
    draft.grids = vec![grid];
    let blob = draft.encode().unwrap();
    let c = Largest::from_blob(&blob).unwrap();
    let mut inputs = Inputs::at([0.0; 16]);
    inputs.auxiliaries[7] = 0.5;
    let found = c.evaluate(&inputs, &Travelling::default(), &c.weights());
    // Integers: rounding of 0.25 to a scale and back.
    for (axis, expected) in [0.75, 0.25, 0.25, 0.25, 0.25, 0.25].into_iter().enumerate() {
        assert!((found[axis] - expected).abs() < 1e-7, "{found:?}");
    }
}

#[test]
fn room_for_more_changes_no_bit_of_a_correction() {
    let blob = everything().encode().unwrap();
    let small = Small::from_blob(&blob).unwrap();
    let large = Largest::from_blob(&blob).unwrap();
    let travel = [Travel::Positive, Travel::Unknown, Travel::Negative];
    let mut many = Travelling([Travel::Unknown; 16]);
    many.0[..3].copy_from_slice(&travel);
    for k in 0..50 {
        let place = [1.7 * k as f32, 30.0 - k as f32, 17.0 * k as f32];
        let mut inputs = Inputs::at(place);
        inputs.auxiliaries[0] = 50.0 + 3.0 * k as f32;
        let mut more = Inputs::at([f32::NAN; 16]);
        more.axes[..3].copy_from_slice(&place);
        more.auxiliaries = inputs.auxiliaries;
        assert_eq!(
            small.evaluate(&inputs, &Travelling(travel), &small.weights()),
            large.evaluate(&more, &many, &large.weights())[..3]
        );
    }
}

#[test]
fn what_a_grid_is_over_is_used() {
    let mut draft = bare();
    draft.auxiliaries = everything().auxiliaries;
    draft.grids = vec![everything().grids[1].clone()];
    let blob = draft.encode().unwrap();
    assert_eq!(Small::from_blob(&blob).unwrap().inputs_used(), 0b1000);
}
