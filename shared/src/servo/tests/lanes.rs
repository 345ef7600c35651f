//! The fast checks of an axis that moves on: they pass exactly where nothing else can happen.

use super::*;
use crate::servo::lane::{Common, Followed, Lane};

const VALUE_BOUND: f32 = 1.0;
const RATE_BOUND: f32 = 2.0;

fn axis(travel: [f32; 2]) -> Axis {
    Axis {
        travel,
        value_bound: VALUE_BOUND,
        rate_bound: RATE_BOUND,
        ramp_rate: RATE_BOUND,
        reversal_rate: RATE_BOUND,
        reversal_acceleration: 20.0 * (RATE_BOUND),
        reversal_threshold: 0.5,
        ..bare().axes[0]
    }
}

/// A referenced axis at the last of these positions.
fn lane(axis: &Axis, farthest: f32, positions: &[f32]) -> Lane {
    let mut lane = Lane::new(0);
    lane.take(axis, axis, farthest, DT);
    lane.set_referenced(true);
    for &q in positions {
        assert!(lane.follow(q) != Followed::Unusable);
    }
    lane
}

/// It takes the fast path up to the value bound, and up to a millionth of the size of the ends before an end.
fn moves_on_up_to(mut lane: Lane, end: f32) {
    let inwards = -end.signum();
    let margin = VALUE_BOUND + 1e-6 * end.abs();
    assert!(lane.moves_on(end + 1.1 * margin * inwards));
    assert!(lane.passes(VALUE_BOUND, 0.0, 0.0));
    let beyond = end + (VALUE_BOUND + 0.5e-6 * end.abs()) * inwards;
    assert!(!lane.moves_on(beyond));
    assert!(!lane.moves_on(end));
    lane.follow(beyond);
    assert!(!lane.passes(0.0, 0.0, 0.0));
}

#[test]
fn an_axis_moves_on_up_to_its_value_bound_before_either_end_wherever_the_travel_is() {
    for [low, high] in [[-300.0, 300.0], [-300.0, -100.0], [-300.0, 0.0]] {
        let middle = 0.5 * (low + high);
        moves_on_up_to(lane(&axis([low, high]), 1e9, &[middle, middle - 1.0]), low);
        moves_on_up_to(
            lane(&axis([-high, -low]), 1e9, &[-middle, 1.0 - middle]),
            -low,
        );
        // At the end nearer to 0, the rounding of the farther end matters.
        let mut towards = lane(&axis([low, high]), 1e9, &[middle, middle + 1.0]);
        assert!(
            towards.moves_on(high - VALUE_BOUND - 4e-4)
                && !towards.moves_on(high - VALUE_BOUND - 1e-4)
        );
        let mut towards = lane(&axis([-high, -low]), 1e9, &[-middle, -middle - 1.0]);
        assert!(
            towards.moves_on(VALUE_BOUND + 4e-4 - high)
                && !towards.moves_on(VALUE_BOUND + 1e-4 - high)
        );
    }
    // Tables that reach less far than the travel limit it.
    let endless = axis([-f32::MAX, f32::MAX]);
    moves_on_up_to(lane(&endless, 300.0, &[0.0, 1.0]), 300.0);
    moves_on_up_to(lane(&endless, 300.0, &[0.0, -1.0]), -300.0);
}

#[test]
fn an_axis_behind_its_extreme_takes_the_long_way() {
    let mut lane = lane(&axis([-100.0, 100.0]), 1e9, &[10.0, 20.0, 19.75]);
    assert!(lane.moves_on(19.75));
    assert!(!lane.moves_on(19.875));
    assert!(!lane.moves_on(19.5));
}

#[test]
fn an_endless_axis_moves_on_by_a_quarter_of_a_turn_at_most() {
    let endless = Axis {
        period: 360.0,
        ..axis([-f32::MAX, f32::MAX])
    };
    for sense in [1.0, -1.0] {
        let new = || lane(&endless, 1e9, &[5.0 * sense, 10.0 * sense]);
        assert!(new().moves_on(99.0 * sense));
        assert!(!new().moves_on(101.0 * sense));
        // It has gone back over 0.
        assert!(!new().moves_on(350.0 * sense));
        assert!(new().follow(350.0 * sense) == Followed::Turned);
    }
}

#[test]
fn a_correction_passes_by_what_the_rate_bound_allows_in_this_period() {
    let mut lane = lane(&axis([-100.0, 100.0]), 1e9, &[10.0, 20.0]);
    for dt in [DT, 0.1 * DT, 10.0 * DT] {
        lane.take_period(dt);
        let most = RATE_BOUND * dt;
        for sense in [1.0, -1.0] {
            assert!(lane.passes(0.5, 0.99 * most * sense, 0.0));
            assert!(!lane.passes(0.5, 1.01 * most * sense, 0.0));
        }
        assert!(!lane.passes(0.0, 0.0, 1.0));
    }
}

#[test]
fn a_direction_is_forgotten_with_the_reference() {
    let mut lane = lane(&axis([-100.0, 100.0]), 1e9, &[10.0, 20.0]);
    lane.set_referenced(false);
    assert!(lane.follow(30.0) == Followed::Turned);
    assert!(lane.follow(31.0) == Followed::Along);
    lane.set_travel(Travel::Negative);
    assert!(lane.follow(32.0) == Followed::Turned);
}

#[test]
fn a_correction_beyond_the_travel_comes_back_no_faster_than_the_command_moves() {
    // In both directions, towards the end and away from it.
    for (from, to) in [(99.875, 99.9375), (99.9375, 99.875)] {
        let mut lane = lane(&axis([-100.0, 100.0]), 1e9, &[98.0, from, to]);
        let common = Common {
            s: 1.0,
            dt: DT,
            frequency: 1.0 / DT,
            last_frequency: 1.0 / DT,
            ..Common::STILL
        };
        let mut computed = 0.5;
        let dq = lane.guard(&common, &mut computed, [0.5, 0.5], &mut Status::default());
        assert_eq!(dq, 0.5 - 0.0625);
    }
}
