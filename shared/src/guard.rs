//! The guard rails: value bound, travel and rate bound of each axis.
//!
//! Compare-and-select instead of `f32::clamp`, which is a slow call on the Cortex-M4F.

use crate::description::Axis;

/// `value` within ±`bound`, and whether the bound acted.
#[inline(always)]
pub(crate) fn bounded(value: f32, bound: f32) -> (f32, bool) {
    if value > bound {
        (bound, true)
    } else if value < -bound {
        (-bound, true)
    } else {
        (value, false)
    }
}

/// The correction nearest to `wanted` that keeps q + Δq within the travel if q is, and that does
/// not push further outside if q is not. 0 always satisfies it.
#[inline(always)]
pub(crate) fn within_travel(wanted: f32, q: f32, travel: [f32; 2]) -> (f32, bool) {
    let down = travel[0] - q;
    let up = travel[1] - q;
    let down = if down < 0.0 { down } else { 0.0 };
    let up = if up > 0.0 { up } else { 0.0 };
    if wanted > up {
        (up, true)
    } else if wanted < down {
        (down, true)
    } else {
        (wanted, false)
    }
}

/// The value nearest to `wanted` that is at most `most` away from `last`.
#[inline(always)]
fn within_rate(wanted: f32, last: f32, most: f32) -> (f32, bool) {
    let change = wanted - last;
    if change > most {
        (last + most, true)
    } else if change < -most {
        (last - most, true)
    } else {
        (wanted, false)
    }
}

/// What the guard rails let through.
pub(crate) struct Passed {
    pub dq: f32,
    pub rate_limited: bool,
    pub travel_limited: bool,
}

/// Travel, then rate, then travel again: near the end of the travel the correction follows the
/// command, at most as fast as the command itself, and even where the rate bound would not let it.
#[inline(always)]
pub(crate) fn pass(wanted: f32, last: f32, q: f32, axis: &Axis, rate: f32, dt: f32) -> Passed {
    let (inside, limited) = within_travel(wanted, q, axis.travel);
    let (reached, rate_limited) = within_rate(inside, last, rate * dt);
    let (dq, again) = within_travel(reached, q, axis.travel);
    Passed {
        dq,
        rate_limited,
        travel_limited: limited | again,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXIS: Axis = Axis {
        name: b'X',
        travel: [-10.0, 20.0],
        period: 0.0,
        value_bound: 1.0,
        rate_bound: 1.0,
        hysteresis: 0.0,
        ramp_rate: 1.0,
    };

    #[test]
    fn a_correction_ends_at_the_end_of_the_travel() {
        let dq = |wanted, q| within_travel(wanted, q, AXIS.travel);
        assert_eq!(dq(0.5, 19.0), (0.5, false));
        assert_eq!(dq(0.5, 19.75), (0.25, true));
        assert_eq!(dq(0.5, 20.0), (0.0, true));
        assert_eq!(dq(-0.5, 20.0), (-0.5, false));
        assert_eq!(dq(-0.5, -9.75), (-0.25, true));
    }

    #[test]
    fn outside_the_travel_only_corrections_towards_it_pass() {
        let dq = |wanted, q| within_travel(wanted, q, AXIS.travel).0;
        assert_eq!([dq(0.5, 21.0), dq(-0.5, 21.0)], [0.0, -0.5]);
        assert_eq!([dq(-0.5, -11.0), dq(0.5, -11.0)], [0.0, 0.5]);
    }

    #[test]
    fn the_rate_bound_defers_and_the_travel_wins_over_it() {
        let passed = pass(0.5, 0.0, 0.0, &AXIS, 1.0, 0.125);
        assert_eq!((passed.dq, passed.rate_limited), (0.125, true));
        // The command has come 0.25 closer to the end: so much of the correction must go at once.
        let passed = pass(0.5, 0.5, 19.75, &AXIS, 1.0, 0.125);
        assert_eq!((passed.dq, passed.travel_limited), (0.25, true));
    }

    #[test]
    fn an_endless_axis_is_never_limited_by_its_travel() {
        for q in [0.0, 1e6, -1e6, 3e38, -3e38] {
            for wanted in [-1.0, 0.0, 1.0] {
                let found = within_travel(wanted, q, [-f32::MAX, f32::MAX]);
                assert_eq!(found, (wanted, false));
            }
        }
    }
}
