//! Arbitrary bytes are loaded or refused: no panic, no read outside the blob. Loaded content can be read at every index
//! that it declares, and evaluated.
//!
//! The first byte selects: the bytes as they are, or with a valid header, so that the description is reached.
#![no_main]

use libfuzzer_sys::fuzz_target;
use trueaxis::{
    AlignedBlob, Compensation, Holds, Inputs, LoadError, MOST_ROUNDS, Travel, Travelling, rounds,
};
use trueaxis_fuzz::{Fuzzed, repaired};

fuzz_target!(|data: &[u8]| {
    let Some((&mode, bytes)) = data.split_first() else {
        return;
    };
    let blob = if mode & 1 == 0 {
        AlignedBlob::from_bytes(bytes)
    } else {
        repaired(bytes)
    };
    let mut c = Fuzzed::empty();
    let _ = rounds();
    let loaded = c.load(&blob);
    let [each, first] = MOST_ROUNDS;
    assert!(
        rounds() <= each * blob.len() as u64 + first,
        "loading takes as long as the blob is"
    );
    match loaded {
        Ok(()) => {
            walk(&c);
            // A slot may be longer than the blob in it.
            let mut longer = blob.to_vec();
            longer.push(0xFF);
            let longer = AlignedBlob::from_bytes(&longer);
            let mut slot = Fuzzed::empty();
            slot.load_slot(&longer)
                .expect("a slot holds what a file holds");
            assert!(matches!(
                slot.load(&longer),
                Err(LoadError::WrongLength { .. })
            ));
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            assert_eq!(
                c.tables() + c.axes().len() + c.terms().len(),
                0,
                "emptied on error"
            );
        }
    }
    // A target with small capacities also refuses or loads it.
    let mut small = Compensation::<'_, Holds<2, 3, 3, 4, 1>>::empty();
    if small.load(&blob).is_ok() {
        assert!(small.axes().len() <= 2 && small.tables() <= 3);
    }
});

fn walk(c: &Fuzzed<'_>) {
    assert!(
        c.axes()
            .iter()
            .all(|a| a.value_bound.is_finite() && a.rate_bound.is_finite())
    );
    let _ = (
        c.machine(),
        c.policy(),
        c.auxiliaries(),
        c.blob_len(),
        c.inputs_used(),
    );
    samples(c);
    for term in c.terms() {
        assert!(usize::from(term.output) < c.axes().len());
        assert!(term.factors.iter().all(|f| usize::from(*f) < c.tables()));
    }
    for travel in [Travel::Unknown, Travel::Positive, Travel::Negative] {
        for x in [0.0, -1.0, 1e30, f32::NEG_INFINITY, f32::NAN] {
            let mut inputs = Inputs::at([x; 8]);
            inputs.auxiliaries = [x; trueaxis::AUXILIARIES];
            let dq = c.evaluate(&inputs, &Travelling([travel; 8]), &c.weights());
            assert!(dq.iter().all(|d| d.is_finite()), "{dq:?} at {x}");
        }
    }
}

/// Every sample of tables and grids.
fn samples(c: &Fuzzed<'_>) {
    let mut table = 0;
    for bank in c.banks() {
        for column in 0..usize::from(bank.tables) {
            let peak = c.peak(table + column).expect("every table has a peak");
            for point in 0..bank.points as usize {
                let value = c
                    .sample(table + column, point)
                    .expect("every point has a sample");
                assert!(value.is_finite() && value.abs() <= peak * 1.0001);
            }
        }
        table += usize::from(bank.tables);
    }
    assert_eq!(table, c.tables());
    for (number, grid) in c.grids().iter().enumerate() {
        for node in 0..grid.nodes() as usize {
            for output in 0..grid.outputs.len() {
                let value = c
                    .grid_sample(number, node, output)
                    .expect("every node has a sample");
                assert!(value.is_finite());
            }
        }
    }
}
