//! Checks with every f32 there is, infinities, NaN and subnormals included, of what the unsafe code rests on
//! (`cargo xtask prove`): some 4 billion calls for each span.

use super::{any_interval, floor, interval, steps};
use crate::description::Interpolation;
use crate::load_error::Part;
use crate::plan::Span;
use std::thread;
use std::vec::Vec;

/// Calls a check with every f32 on all processors; the first for which it fails.
fn first_failure(holds: impl Fn(f32) -> bool + Sync) -> Option<f32> {
    const PARTS: u32 = 64;
    let part = |k: u32| {
        let length = u32::MAX / PARTS + 1;
        let mut bits = k * length..=k * length + (length - 1);
        bits.find(|bits| !holds(f32::from_bits(*bits)))
    };
    let workers = thread::available_parallelism().map_or(1, usize::from) as u32;
    let found: Vec<Option<u32>> = thread::scope(|scope| {
        let work = |worker| move || (worker..PARTS).step_by(workers as usize).find_map(part);
        let running: Vec<_> = (0..workers).map(|w| scope.spawn(work(w))).collect();
        running.into_iter().map(|w| w.join().unwrap()).collect()
    });
    found.into_iter().flatten().min().map(f32::from_bits)
}

fn span(start: f32, step: f32, points: u32, modulo: bool, interpolation: Interpolation) -> Span {
    Span::new(Part::Bank(0), 0, start, step, points, modulo, interpolation).unwrap()
}

/// Spans as long, short, fine and far out as [`Span::new`] accepts.
fn spans() -> Vec<Span> {
    use Interpolation::{Cubic, Linear};
    [
        span(-350.0, 700.0, 2, false, Linear),
        span(-120.0, 2.5, 97, false, Linear),
        span(0.0, f32::MIN_POSITIVE, 1 << 24, false, Linear),
        span(-1e30, 1e23, 1 << 24, false, Linear),
        span(1e-40, 1e-38, 3, false, Linear),
        span(-300.0, 300.0, 5, false, Cubic),
        span(5.0, 0.1, 1 << 24, false, Cubic),
        span(-180.0, 45.0, 8, true, Cubic),
        span(0.0, 1.0, 360, true, Linear),
        span(1e6, 1e-3, 1 << 24, true, Linear),
        span(-1.0, 1e-30, 2, true, Linear),
        span(0.0, 1e31, 1 << 20, true, Cubic),
    ]
    .into()
}

/// Both points are points of the span, and the fraction is between them.
fn ends_in_an_interval(span: &Span, x: f32) -> bool {
    let (i, next, t) = any_interval(span, x);
    i <= span.last && next <= span.last && (0.0..=1.0).contains(&t)
}

/// What is read directly has a row after it.
fn is_read_directly_only_inside(span: &Span, x: f32) -> bool {
    let Some(found) = steps(span, x) else {
        return true;
    };
    // SAFETY: from `steps`.
    let (i, t) = unsafe { interval(found) };
    i < span.last as usize && (0.0..1.0).contains(&t)
}

#[test]
fn every_position_ends_in_an_interval_of_every_span() {
    for span in spans() {
        assert_eq!(
            first_failure(|x| ends_in_an_interval(&span, x)),
            None,
            "{span:?}"
        );
    }
}

#[test]
fn what_is_read_directly_has_a_row_after_it() {
    for span in spans() {
        assert_eq!(
            first_failure(|x| is_read_directly_only_inside(&span, x)),
            None,
            "{span:?}"
        );
    }
}

#[test]
fn floor_is_the_integer_below_every_number_it_takes() {
    const END: f64 = 4_194_304.0;
    let holds = |p: f32| {
        let exact = if p.is_nan() {
            END
        } else {
            f64::from(p).clamp(-END, END).floor()
        };
        f64::from(floor(p)) == exact
    };
    assert_eq!(first_failure(holds), None);
}

/// Spans that `Span::new` never makes are noticed: the checks can fail.
#[test]
fn a_span_with_a_bound_that_is_broken_is_noticed() {
    let good = span(-120.0, 2.5, 97, false, Interpolation::Linear);
    let too_far = Span {
        limit: 98.0,
        beyond: 98.0,
        ..good
    };
    let no_last = Span { after: 97, ..good };
    for broken in [too_far, no_last] {
        assert!(first_failure(|x| ends_in_an_interval(&broken, x)).is_some());
    }
    let direct = Span {
        direct: 97.0,
        ..good
    };
    assert!(first_failure(|x| is_read_directly_only_inside(&direct, x)).is_some());
}
