//! Which inputs matter, and for how long they may be unusable.

use super::*;

/// X from X; with `more` also from the tool length, Y with backlash, and C, with modulo.
fn machine(more: bool) -> &'static C {
    let mut draft = bare();
    draft.auxiliaries = specimen::everything().auxiliaries;
    draft.banks = vec![bank(0, -100.0, 200.0, vec![vec![0.02, 0.04]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    if more {
        draft.banks.extend([
            bank(3, 0.0, 100.0, vec![vec![0.0, 0.02]]),
            DraftBank {
                direction: Direction::Signed,
                ..bank(1, -100.0, 200.0, vec![vec![0.01, 0.01]])
            },
            DraftBank {
                modulo: true,
                ..bank(2, 0.0, 90.0, vec![vec![0.0, 0.02, 0.0, -0.02]])
            },
        ]);
        let terms = [term(0, 1.0, &[1]), term(1, 1.0, &[2]), term(2, 1.0, &[3])];
        draft.terms.extend(terms);
    }
    draft.axes[2].travel = [-1e7, 1e7];
    leak(&draft)
}

#[test]
fn during_a_fade_the_inputs_of_both_compensations_matter() {
    let good = at(20.0, 10.0, 45.0);
    for more in [false, true] {
        let (from, to) = (machine(more), machine(!more));
        let update = |inputs: &Inputs<[f32; 3]>, referenced| {
            let mut servo = S::new(from);
            servo.enable();
            settle(&mut servo, &good);
            servo.swap(to).unwrap();
            for _ in 0..100 {
                let status = servo.update(&good, ALL, DT).status;
                assert_eq!(status.conditions, Conditions::FADING);
            }
            servo.update(inputs, referenced, DT).status
        };
        let mut inputs = good;
        inputs.auxiliaries[0] = f32::NAN;
        let status = update(&inputs, ALL);
        assert!(status.is(Conditions::BAD_AUXILIARY | Conditions::HELD));
        // Farther than the modulo table can tell, and not so far.
        let most = MOST_PERIODS * 360.0;
        assert!(update(&at(20.0, 10.0, most + 1.0), ALL).is(Conditions::BAD_INPUT));
        assert!(!update(&at(20.0, 10.0, most), ALL).is(Conditions::BAD_INPUT));
        assert!(update(&good, 0b101).is(Conditions::UNREFERENCED));
        assert!(!update(&good, ALL).is(Conditions::UNREFERENCED));
        // The backlash of Y is worked off, also where it is little so far.
        assert_eq!(update(&at(20.0, 9.0, 45.0), ALL).rate_limited, 0b010);
    }
}

#[test]
fn an_axis_that_does_not_matter_may_be_anywhere_but_at_no_number() {
    let mut draft = bare();
    (draft.axes[2].travel, draft.axes[2].period) = ([-f32::MAX, f32::MAX], 360.0);
    draft.banks = vec![bank(0, -100.0, 200.0, vec![vec![0.02, 0.04]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    let c = leak(&draft);
    // On the short way and on the long one.
    for long in [false, true] {
        let status = |place: f32, referenced| {
            let mut servo = S::new(c);
            servo.enable();
            for _ in 0..8000 {
                servo.update(&at(20.0, 10.0, 45.0), referenced, DT);
            }
            if long {
                servo.unsettle();
            }
            servo.update(&at(20.0, 10.0, place), referenced, DT).status
        };
        assert_eq!(status(1e7, 0b011), Status::default());
        assert!(status(1e7, ALL).is(Conditions::BAD_INPUT));
        for no_number in [f32::NAN, f32::INFINITY] {
            assert!(status(no_number, 0b011).is(Conditions::BAD_INPUT));
        }
    }
}

#[test]
fn what_is_over_after_exactly_10_ms_was_only_held() {
    let good = at(20.0, 10.0, 45.0);
    let mut servo = settled(&good);
    let before = servo.update(&good, ALL, PATIENCE);
    let held = Conditions::BAD_INPUT | Conditions::HELD;
    let status = servo
        .update(&at(f32::NAN, 10.0, 45.0), ALL, PATIENCE)
        .status;
    assert_eq!(status.conditions, held);
    assert_eq!(servo.update(&good, ALL, PATIENCE), before);
    servo.update(&at(f32::NAN, 10.0, 45.0), ALL, PATIENCE);
    let status = servo
        .update(&at(f32::NAN, 10.0, 45.0), ALL, SHORTEST_PERIOD)
        .status;
    assert!(status.is(held | Conditions::FROZEN));
}
