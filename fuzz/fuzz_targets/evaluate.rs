//! Any loadable blob with arbitrary input bits: the evaluation is finite, and the servo's corrections are finite and
//! within the value bounds through any sequence of events.
//!
//! The first byte selects the source of the blob: a draft made from the bytes, or bytes with a valid header (seeds:
//! real blobs).
#![no_main]

use libfuzzer_sys::fuzz_target;
use trueaxis::{AlignedBlob, Correction, Servo, Travel, Travelling};
use trueaxis_fuzz::{Bytes, Fuzzed, draft, inputs, repaired};

fuzz_target!(|data: &[u8]| {
    let mut b = Bytes(data);
    let (first, second) = if b.flag() {
        // At most the last 256 bytes are events, the others the blob.
        let events = b.0.len().min(256) / 2;
        let (bytes, rest) = b.0.split_at(b.0.len() - events);
        b = Bytes(rest);
        let blob = repaired(bytes);
        (blob.clone(), blob)
    } else {
        let draft = draft(&mut b);
        let Ok(first) = draft.encode() else {
            return;
        };
        // In some cases another compensation to swap to: other bounds, other weights, tables of the first axis only.
        // (Encoding verifies its output and is the slowest part here.)
        let mut second = first.clone();
        if b.below(4) == 0 {
            let mut other = draft;
            for axis in &mut other.axes {
                (axis.value_bound, axis.rate_bound) = (axis.rate_bound, axis.value_bound);
            }
            other.terms.retain(|t| t.output == 0);
            match other.encode() {
                Ok(blob) => second = blob,
                Err(_) => return,
            }
        }
        (first, second)
    };
    run(&mut b, &first, &second);
});

/// Measurement mode, and the evaluation with arbitrary directions of travel.
fn evaluate(c: &Fuzzed<'_>, b: &mut Bytes<'_>) {
    let q = inputs(b);
    let travel = Travelling(std::array::from_fn(|i| {
        [Travel::Unknown, Travel::Positive, Travel::Negative]
            [(i + usize::from(q.axes[0] as u8)) % 3]
    }));
    let dq = c.evaluate(&q, &travel, &c.weights());
    assert!(dq.iter().all(|d| d.is_finite()), "evaluate: {dq:?}");
    let again = c.evaluate(&q, &travel, &c.weights());
    assert_eq!(dq.map(f32::to_bits), again.map(f32::to_bits));
    let measured = c.measured(&q, &travel, &c.weights(), 3);
    assert!(
        measured.iter().all(|d| d.is_finite()),
        "measured: {measured:?}"
    );
}

fn bounded(correction: &Correction<[f32; 8]>, bounds: [f32; 8]) {
    let both = correction.dq.iter().zip(correction.computed).zip(bounds);
    for ((dq, computed), bound) in both {
        // Sums of rounded steps may exceed a bound by their last bits.
        let most = bound * 1.000_001;
        assert!(dq.is_finite() && dq.abs() <= most, "dq {dq} over {bound}");
        assert!(computed.abs() <= most, "computed {computed} over {bound}");
    }
}

fn run(b: &mut Bytes<'_>, first: &AlignedBlob, second: &AlignedBlob) {
    let mut a = Fuzzed::empty();
    let mut z = Fuzzed::empty();
    if a.load(first).is_err() || z.load(second).is_err() {
        return;
    }
    let (a, z) = (&a, &z);
    let mut servo = Servo::new(a);
    servo.enable();
    // Value bounds of all compensations that may still contribute.
    let bounds: [f32; 8] = std::array::from_fn(|i| {
        let bound = |c: &Fuzzed<'_>| c.axes().get(i).map_or(0.0, |axis| axis.value_bound);
        bound(a).max(bound(z))
    });
    let mut referenced = u16::MAX;
    let mut dt = 0.001;
    for _ in 0..24 {
        if b.is_empty() {
            break;
        }
        match b.below(16) {
            0 => servo.enable(),
            1 => servo.disable(),
            2 => servo.dry_run(b.flag()),
            3 => referenced = u16::from(b.byte()) | 0xFF00,
            4 => referenced = u16::MAX,
            5 => dt = b.bits(),
            6 => dt = 0.001,
            7 => {
                let _ = servo.swap(if b.flag() { z } else { a });
            }
            8 => {
                let _ = servo.set_weight(usize::from(b.below(12)), b.number());
            }
            9 => evaluate(servo.compensation(), b),
            _ => {}
        }
        let q = inputs(b);
        let repeat = 1 + b.below(4);
        for _ in 0..repeat {
            bounded(&servo.update(&q, referenced, dt), bounds);
            let s = servo.factor();
            assert!((0.0..=1.0).contains(&s), "fade factor {s}");
        }
    }
}
