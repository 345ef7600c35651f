mod two_clocks;

use std::vec::Vec;

use proptest::prelude::*;
use trueaxis::Conditions;

use super::*;
use crate::spi::{MOST, length};

const BOUNDS: Bounds<2> = Bounds {
    value: [0.5, 0.25],
    step: [0.001, 0.0005],
    hold: 20,
};
const LENGTH: usize = length(2);
/// Rounding of corrections up to 0.5: half a unit in the last place of each end.
const ROUNDING: f32 = 3e-8 * 2.0;

type Two = MotionSide<2>;

fn answer(count: u8, dq: [f32; 2]) -> Vec<u8> {
    let answer = Answer {
        count: Some(count),
        healthy: true,
        conditions: Conditions::default(),
        irregular: 0,
        dq,
    };
    answer.put(&mut [0; MOST]).unwrap().to_vec()
}

/// One period: the answer is for the previous command, `late` periods late.
fn command(side: &mut Two) {
    let command = Command::new([0.0; 2], 0);
    assert!(side.command(command, &mut [0; MOST]).is_some());
}

fn period(side: &mut Two, late: u8, dq: [f32; 2]) -> Applied<2> {
    command(side);
    let count = side.count.wrapping_sub(1).wrapping_sub(late);
    side.answer(&answer(count, dq), true)
}

fn silence(side: &mut Two) -> Applied<2> {
    command(side);
    side.answer(&[], true)
}

/// Follows `dq`.
fn following(dq: [f32; 2]) -> Two {
    let mut side = Two::new(BOUNDS);
    for _ in 0..1000 {
        period(&mut side, 0, dq);
    }
    assert_eq!(side.dq, dq);
    side
}

#[test]
fn within_a_step_what_is_added_is_exactly_what_is_wanted() {
    // The difference between these two is rounded, so adding it up would miss the target.
    let mut side = following([1e-3, 0.0]);
    let wanted = [1e-11, 0.0];
    assert_ne!(side.dq[0] + (wanted[0] - side.dq[0]), wanted[0]);
    assert_eq!(period(&mut side, 0, wanted).dq, wanted);
}

#[test]
fn every_command_has_the_next_count() {
    let mut side = Two::new(BOUNDS);
    for count in 1..=600_u32 {
        let mut out = [0; MOST];
        let bytes = side.command(Command::new([1.0, 2.0], 3), &mut out).unwrap();
        let said = CommandFrame::<[f32; 2]>::get(bytes).unwrap();
        assert_eq!(said.count, count as u8);
        assert_eq!(said.command, Command::new([1.0, 2.0], 3));
    }
    assert!(
        side.command(Command::new([0.0; 2], 0), &mut [0; 4])
            .is_none()
    );
}

#[test]
fn at_start_so_many_answers_in_a_row_are_wanted_and_then_followed() {
    let mut side = Two::new(BOUNDS);
    for _ in 1..Two::STEADY {
        let applied = period(&mut side, 0, [0.0001, 0.0]);
        assert_eq!((applied.state, applied.dq), (State::Leaving, [0.0; 2]));
        assert!(applied.alarm);
    }
    let applied = period(&mut side, 0, [0.0001, 0.0]);
    assert_eq!(
        (applied.state, applied.dq),
        (State::Following, [0.0001, 0.0])
    );
    assert!(!applied.alarm);
    // A missing one restarts it.
    let mut side = Two::new(BOUNDS);
    for number in 0..3 * Two::STEADY {
        let applied = if number % (Two::STEADY - 1) == 0 {
            silence(&mut side)
        } else {
            period(&mut side, 0, [0.0001, 0.0])
        };
        assert_eq!(applied.state, State::Leaving);
    }
}

#[test]
fn without_news_the_corrections_hold_and_then_go_to_zero_together() {
    let start = [0.1, -0.02];
    let mut side = following(start);
    for number in 1..=BOUNDS.hold {
        let applied = silence(&mut side);
        assert_eq!((applied.state, applied.dq), (State::Holding, start));
        assert_eq!(applied.alarm, number > u32::from(Two::LATE), "{number}");
    }
    // X has the longest distance in steps: 100 of them; Y moves along with it.
    for number in 1..=100 {
        let applied = silence(&mut side);
        assert_eq!(applied.state, State::Leaving);
        let left = (100 - number) as f32 / 100.0;
        // 100 steps with the rounding of each.
        let near = |dq: f32, from: f32| (dq - from * left).abs() < 100.0 * 1e-8;
        assert!(near(applied.dq[0], start[0]) && near(applied.dq[1], start[1]));
    }
    // The remainder due to rounding goes in the next period.
    assert_eq!(silence(&mut side).dq, [0.0; 2]);
}

#[test]
fn answers_may_be_late_by_four_periods_but_not_by_five_or_early() {
    for (late, state) in [
        (0, State::Following),
        (4, State::Following),
        (5, State::Holding),
        (255, State::Holding),
    ] {
        let mut side = following([0.1, 0.1]);
        // Another counter than the last one.
        for _ in 0..8 {
            silence(&mut side);
        }
        assert_eq!(period(&mut side, late, [0.1, 0.1]).state, state, "{late}");
    }
}

#[test]
fn the_limits_are_those_of_the_manual() {
    assert_eq!((Two::LATE, Two::STEADY), (4, 10));
}

#[test]
fn the_same_answer_for_ever_is_no_news_nor_are_two_in_turn() {
    for stuck in [1, 2] {
        let mut side = following([0.1, 0.1]);
        let last = side.count;
        let bytes: Vec<_> = (0..stuck)
            .map(|k| answer(last.wrapping_sub(k), [0.1, 0.1]))
            .collect();
        for number in 0..2000 {
            command(&mut side);
            let applied = side.answer(&bytes[number % bytes.len()], true);
            // The first may be for the last command, and no more than two can occur.
            if number > usize::from(Two::LATE) + BOUNDS.hold as usize {
                assert_eq!(applied.state, State::Leaving, "{number}");
                assert!(applied.alarm);
            }
        }
        assert_eq!(side.dq, [0.0; 2]);
    }
}

#[test]
fn what_is_not_a_number_or_beyond_the_bounds_is_no_news() {
    for dq in [
        [f32::NAN, 0.0],
        [0.0, f32::INFINITY],
        [0.51, 0.0],
        [0.0, -0.26],
    ] {
        let mut side = following([0.1, 0.1]);
        let applied = period(&mut side, 0, dq);
        assert_eq!((applied.state, applied.dq), (State::Holding, [0.1, 0.1]));
        assert_eq!(side.refused(), 1);
    }
    // Exactly the bound is still accepted.
    let mut side = following([0.1, 0.1]);
    assert_eq!(period(&mut side, 0, [0.5, -0.25]).state, State::Following);
    assert_eq!(side.refused(), 0);
}

#[test]
fn a_fault_of_the_controller_is_an_alarm_while_its_answers_are_followed() {
    let mut side = following([0.1, 0.1]);
    command(&mut side);
    let bytes = answer(side.count.wrapping_sub(1), [0.1, 0.1]);
    let low = side.answer(&bytes, false);
    assert_eq!((low.state, low.alarm), (State::Following, true));
    command(&mut side);
    let sick = Answer {
        count: Some(side.count.wrapping_sub(1)),
        healthy: false,
        conditions: Conditions::HELD,
        irregular: 0,
        dq: [0.1, 0.1],
    };
    let applied = side.answer(sick.put(&mut [0; MOST]).unwrap(), true);
    assert_eq!((applied.state, applied.alarm), (State::Following, true));
    assert!(!period(&mut side, 0, [0.1, 0.1]).alarm);
}

#[test]
fn a_jump_of_the_answers_is_a_way_in_steps_with_both_axes_in_proportion() {
    let mut side = following([0.1, 0.1]);
    // 300 steps of X; Y needs 100 of its own but takes as long.
    let mut last = [0.1, 0.1];
    for number in 1..=301 {
        let applied = period(&mut side, 0, [0.4, 0.15]);
        let change = [applied.dq[0] - last[0], applied.dq[1] - last[1]];
        if number <= 299 {
            assert!((change[0] - 0.001).abs() < ROUNDING, "{number}: {change:?}");
            assert!(
                (change[1] - 0.05 / 300.0).abs() < ROUNDING,
                "{number}: {change:?}"
            );
        }
        last = applied.dq;
    }
    assert_eq!(last, [0.4, 0.15]);
}

/// What happens to one answer.
#[derive(Clone, Debug)]
enum Fate {
    Comes,
    Lost,
    /// One bit flips.
    Damaged(usize),
    /// The previous answer again.
    Repeated,
    /// Late by this many periods.
    Delayed(u8),
    /// Noise.
    Noise(Vec<u8>),
    /// Complete, with these arbitrary corrections.
    Wild([f32; 2], u8),
    /// The controller restarts: it answers nothing, then from zero.
    Restart,
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        12 => Just(Fate::Comes),
        2 => Just(Fate::Lost),
        1 => (0..LENGTH * 8).prop_map(Fate::Damaged),
        1 => Just(Fate::Repeated),
        1 => (1_u8..9).prop_map(Fate::Delayed),
        1 => prop::collection::vec(any::<u8>(), 0..2 * LENGTH).prop_map(Fate::Noise),
        1 => (any::<[f32; 2]>(), any::<u8>()).prop_map(|(dq, count)| Fate::Wild(dq, count)),
        1 => Just(Fate::Restart),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_within_a_step_is_reached_to_the_bit(
        from in -0.5_f32..0.5,
        way in -0.00099_f32..0.00099,
    ) {
        let mut side = following([from, 0.0]);
        let to = from + way;
        prop_assume!(to.abs() <= 0.5);
        prop_assert_eq!(period(&mut side, 0, [to, 0.0]).dq[0].to_bits(), to.to_bits());
        // Starting near zero, the difference is not exact.
        let mut side = following([1e-6, 0.0]);
        prop_assert_eq!(period(&mut side, 0, [way, 0.0]).dq[0].to_bits(), way.to_bits());
    }

    #[test]
    fn no_step_whatever_happens_to_the_answers(
        // Each fate lasts for some periods, so that losses of every length occur.
        fates in prop::collection::vec((fate(), 1_usize..60), 1..60),
        pace in -1.0_f32..1.0,
    ) {
        let mut side = Two::new(BOUNDS);
        let mut last = [0.0_f32; 2];
        let mut dq = [0.0_f32; 2];
        let mut history: Vec<Vec<u8>> = Vec::new();
        for (fate, times) in fates {
            for _ in 0..times {
                command(&mut side);
                for (value, bound) in dq.iter_mut().zip([0.5, 0.25]) {
                    *value = (*value + 0.002 * pace).clamp(-bound, bound);
                }
                let sound = answer(side.count.wrapping_sub(1), dq);
                history.push(sound.clone());
                let back = |n: usize| history.get(history.len().wrapping_sub(1 + n)).cloned();
                let bytes = match &fate {
                    Fate::Comes => sound,
                    Fate::Lost => Vec::new(),
                    Fate::Damaged(bit) => {
                        let mut bytes = sound;
                        bytes[bit / 8] ^= 1 << (bit % 8);
                        bytes
                    }
                    Fate::Repeated => back(1).unwrap_or_default(),
                    Fate::Delayed(by) => back(usize::from(*by)).unwrap_or_default(),
                    Fate::Noise(bytes) => bytes.clone(),
                    Fate::Wild(dq, count) => answer(*count, *dq),
                    Fate::Restart => {
                        dq = [0.0; 2];
                        Answer::<[f32; 2]>::NOTHING.put(&mut [0; MOST]).unwrap().to_vec()
                    }
                };
                let applied = side.answer(&bytes, true);
                for (k, last) in last.iter().enumerate() {
                    let change = (applied.dq[k] - last).abs();
                    prop_assert!(change <= BOUNDS.step[k] + ROUNDING, "axis {k}: {change}");
                    prop_assert!(applied.dq[k].abs() <= BOUNDS.value[k] + ROUNDING);
                }
                last = applied.dq;
            }
        }
        // Whatever happened: without answers it ends at zero, after the hold and the longest distance.
        for _ in 0..BOUNDS.hold + 1 + 500 {
            last = silence(&mut side).dq;
        }
        prop_assert_eq!(last, [0.0; 2]);
        // And with answers it follows again.
        for _ in 0..Two::STEADY + 500 {
            last = period(&mut side, 0, [0.1, -0.1]).dq;
        }
        prop_assert_eq!(last, [0.1, -0.1]);
    }
}
