//! The computation: every golden blob is loaded, evaluated, and used in a servo with swaps.
//!
//! The results are the bits of all corrections, then four figures: ticks of 1000 instructions, and of [`CALLS`]
//! evaluations, evaluations by generated code and servo updates of the first blob.

use core::array;
use core::hint::black_box;

use crate::console::put;
use crate::counter::{start, ticks, ticks_of_1000};
use crate::fixed::Fixed;
use crate::{huron_13, moves};
use trueaxis::{Compensation, Correction, Holds, Inputs, Servo, Travelling, include_blob};

/// Capacities for the largest of the golden blobs.
type Tables = Compensation<'static, Holds<5, 16, 32, 32, 2>>;

static BLOBS: [&[u8]; 4] = [
    include_blob!("../../../../tests/golden/v1/huron-13.trax"),
    include_blob!("../../../../tests/golden/v1/everything.trax"),
    include_blob!("../../../../tests/golden/v1/router-10.trax"),
    include_blob!("../../../../tests/golden/v1/table-head-13.trax"),
];

/// Number of evaluations of each blob.
const EVALUATIONS: u32 = 4000;
/// Number of moves of the servo with each blob, of 100 periods each.
const MOVES: u32 = 60;
/// Number of calls that are counted.
const CALLS: u32 = 100;
/// Number of servo periods before those that are counted, in which the corrections ramp in.
const SETTLE: u32 = 3000;

/// Returns `None` if a blob or a change is refused.
pub fn run() -> Option<()> {
    let mut results = Results {
        bytes: [0; 256],
        length: 0,
    };
    let [mut first, mut second] = [const { Tables::empty() }; 2];
    for blob in BLOBS {
        first.load(blob).ok()?;
        second.load(blob).ok()?;
        let axes = first.axes().len();
        moves::evaluations(&first, EVALUATIONS, |dq| results.floats(dq));
        moves::periods([&first, &second], MOVES, |c| results.correction(c, axes))?;
        moves::faults(&first, |c| results.correction(c, axes));
    }
    first.load(BLOBS[0]).ok()?;
    same_bits(&first)?;
    for figure in cost(&first)? {
        results.number(figure);
    }
    results.flush();
    Some(())
}

/// Whether generated code gives the bits of the tables.
fn same_bits(c: &Tables) -> Option<()> {
    let mut random = Fixed::new(4);
    let (travelling, weights) = (Travelling::default(), c.weights());
    (0..EVALUATIONS)
        .all(|_| {
            let q = moves::inputs(&mut random, c);
            let tables = c.evaluate(&q, &travelling, &weights);
            huron_13::evaluate(&q.axes).map(f32::to_bits) == tables.map(f32::to_bits)
        })
        .then_some(())
}

/// Ticks of 1000 instructions, and of [`CALLS`] evaluations, evaluations by generated code, and servo updates with the
/// corrections fully in; `None` if they do not come in.
fn cost(c: &Tables) -> Option<[u32; 4]> {
    start();
    let empty = ticks(|| ());
    let mut random = Fixed::new(3);
    // Within the travel.
    let mut somewhere = || {
        let mut q = moves::inputs(&mut random, c);
        q.axes = q.axes.map(|q| 0.8 * q);
        q
    };
    let (travelling, weights) = (Travelling::default(), c.weights());
    let (mut evaluations, mut generated) = (0, 0);
    for _ in 0..CALLS {
        let q = somewhere();
        evaluations += ticks(|| _ = black_box(c.evaluate(&q, &travelling, &weights))) - empty;
        generated += ticks(|| _ = black_box(huron_13::evaluate(&q.axes))) - empty;
    }
    let (from, to) = (somewhere().axes, somewhere().axes);
    let mut servo = Servo::new(c);
    servo.enable();
    let mut updates = 0;
    for period in 0..SETTLE + CALLS {
        let part = period as f32 / (SETTLE + CALLS) as f32;
        let q = Inputs::at(array::from_fn(|i| from[i] + (to[i] - from[i]) * part));
        let ticks = ticks(|| _ = black_box(servo.advance(&q, u16::MAX, 0.001))) - empty;
        if period >= SETTLE {
            updates += ticks;
        }
    }
    (servo.factor() == 1.0).then_some([ticks_of_1000() - empty, evaluations, generated, updates])
}

/// Results waiting to be written.
struct Results {
    bytes: [u8; 256],
    length: usize,
}

impl Results {
    fn number(&mut self, number: u32) {
        if self.length == self.bytes.len() {
            self.flush();
        }
        if let Some((place, _)) = self.bytes[self.length..].split_first_chunk_mut() {
            *place = number.to_le_bytes();
            self.length += 4;
        }
    }

    fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|value| self.number(value.to_bits()));
    }

    fn correction(&mut self, correction: &Correction<[f32; 5]>, axes: usize) {
        self.floats(&correction.dq[..axes]);
        self.floats(&correction.computed[..axes]);
        let status = &correction.status;
        self.number(u32::from(status.conditions.0) | u32::from(status.saturated) << 16);
        self.number(u32::from(status.rate_limited) | u32::from(status.travel_limited) << 16);
    }

    fn flush(&mut self) {
        put(&self.bytes[..self.length]);
        self.length = 0;
    }
}
