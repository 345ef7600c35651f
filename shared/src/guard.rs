//! The limits: value bound and travel of each axis.
//!
//! Compare-and-select instead of `f32::clamp`, which is a slow call on the Cortex-M4F.

#[inline(always)]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `value` within ±`bound`.
#[inline(always)]
pub(crate) fn bounded(value: f32, bound: f32) -> f32 {
    if value > bound {
        bound
    } else if value < -bound {
        -bound
    } else {
        value
    }
}

/// The correction nearest to `wanted` that keeps q + Δq within the travel if q is within it, and that does not push
/// further outside if q is not. 0 always satisfies this.
#[inline(always)]
pub(crate) fn within_travel(wanted: f32, q: f32, travel: [f32; 2]) -> (f32, bool) {
    within_room(wanted, room(q, travel))
}

/// Lower and upper limit of the corrections that satisfy this condition.
#[inline(always)]
pub(crate) fn room(q: f32, travel: [f32; 2]) -> [f32; 2] {
    [smaller(travel[0] - q, 0.0), larger(travel[1] - q, 0.0)]
}

/// The nearest permitted correction, and whether it differs from `wanted`.
#[inline(always)]
pub(crate) fn within_room(wanted: f32, [down, up]: [f32; 2]) -> (f32, bool) {
    if wanted > up {
        (up, true)
    } else if wanted < down {
        (down, true)
    } else {
        (wanted, false)
    }
}

/// The value nearest to `wanted` whose distance from `last` is at most `most`.
#[inline(always)]
pub(crate) fn within_reach(wanted: f32, last: f32, most: f32) -> f32 {
    let change = wanted - last;
    if change > most {
        last + most
    } else if change < -most {
        last - most
    } else {
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRAVEL: [f32; 2] = [-10.0, 20.0];

    #[test]
    fn a_correction_ends_at_the_end_of_the_travel() {
        let dq = |wanted, q| within_travel(wanted, q, TRAVEL);
        assert_eq!(dq(0.5, 19.0), (0.5, false));
        // A value that just fits is not cut off.
        assert_eq!(dq(0.25, 19.75), (0.25, false));
        assert_eq!(dq(-0.25, -9.75), (-0.25, false));
        assert_eq!(dq(0.5, 19.75), (0.25, true));
        assert_eq!(dq(0.5, 20.0), (0.0, true));
        assert_eq!(dq(-0.5, 20.0), (-0.5, false));
        assert_eq!(dq(-0.5, -9.75), (-0.25, true));
    }

    #[test]
    fn outside_the_travel_only_corrections_towards_it_pass() {
        let dq = |wanted, q| within_travel(wanted, q, TRAVEL).0;
        assert_eq!([dq(0.5, 21.0), dq(-0.5, 21.0)], [0.0, -0.5]);
        assert_eq!([dq(-0.5, -11.0), dq(0.5, -11.0)], [0.0, 0.5]);
    }

    #[test]
    fn a_change_ends_where_it_may_reach() {
        let reached = |wanted| within_reach(wanted, 0.25, 0.5);
        assert_eq!(
            [reached(1.0), reached(0.75), reached(0.5)],
            [0.75, 0.75, 0.5]
        );
        assert_eq!(
            [reached(-1.0), reached(-0.25), reached(0.0)],
            [-0.25, -0.25, 0.0]
        );
        // A value at exactly this distance is reached exactly, although last + most rounds.
        for k in 1..100 {
            let (last, wanted) = (0.1, 0.007 * k as f32);
            let most = (wanted - last).abs();
            assert_eq!(within_reach(wanted, last, most), wanted);
            assert_eq!(within_reach(-wanted, -last, most), -wanted);
        }
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
