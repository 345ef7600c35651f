use std::boxed::Box;
use std::sync::LazyLock;
use std::vec;

use proptest::prelude::*;

use crate::specimen::{adjustable, bank, bare, term};
use crate::*;

type C = Compensation<'static, 3, 8, 16, 1>;
type S = Servo<'static, 3, 8, 16, 1>;

const DT: f32 = 0.001;
const ALL: u16 = 0b111;

/// X from X (with backlash) and C, Y from X·C, C from C by an adjustable weight. Y feeds nothing.
fn draft(scale: f32) -> Draft {
    let mut draft = bare();
    for (axis, (travel, value)) in
        draft
            .axes
            .iter_mut()
            .zip([(100.0, 0.1), (50.0, 0.2), (f32::MAX, 0.05)])
    {
        axis.travel = [-travel, travel];
        axis.value_bound = value * scale;
        axis.rate_bound = 2.0;
        axis.ramp_rate = 0.4;
    }
    draft.axes[2].period = 360.0;
    draft.banks = vec![
        bank(
            0,
            -100.0,
            50.0,
            vec![
                vec![-0.05, 0.02, 0.06, 0.03, -0.02],
                vec![-1.0, -0.5, 0.0, 0.5, 1.0],
            ],
        ),
        DraftBank {
            modulo: true,
            ..bank(2, 0.0, 90.0, vec![vec![0.0, 0.02, 0.0, -0.02]])
        },
        DraftBank {
            direction: Direction::Positive,
            ..bank(0, -100.0, 200.0, vec![vec![0.01, 0.01]])
        },
        DraftBank {
            direction: Direction::Negative,
            ..bank(0, -100.0, 200.0, vec![vec![-0.01, -0.01]])
        },
    ];
    draft.terms = vec![
        term(0, scale, &[0]),
        term(0, scale, &[3]),
        term(0, scale, &[4]),
        term(1, 8.0 * scale, &[1, 2]),
        term(1, 0.05 * scale, &[]),
        adjustable(2, 1.0, [-2.0, 4.0], &[2]),
        term(2, 0.01, &[]),
    ];
    draft
}

fn leak(draft: &Draft) -> &'static C {
    let blob: &'static AlignedBlob = Box::leak(Box::new(draft.encode().unwrap()));
    Box::leak(Box::new(C::decode(blob).unwrap()))
}

static A: LazyLock<&'static C> = LazyLock::new(|| leak(&draft(1.0)));
/// Other values, other bounds, and a tool length that A does not know.
static B: LazyLock<&'static C> = LazyLock::new(|| {
    let mut draft = draft(-1.5);
    for axis in &mut draft.axes {
        axis.value_bound = -axis.value_bound;
        axis.rate_bound = 3.0;
        axis.ramp_rate = 0.3;
    }
    draft.auxiliaries = specimen::everything().auxiliaries;
    draft.banks.push(bank(3, 0.0, 100.0, vec![vec![0.0, 0.02]]));
    draft.terms.push(term(1, 1.0, &[5]));
    leak(&draft)
});

fn at(x: f32, y: f32, c: f32) -> Inputs<3> {
    let mut inputs = Inputs::at([x, y, c]);
    inputs.auxiliaries[0] = 50.0;
    inputs
}

/// Runs until nothing moves any more.
fn settle(servo: &mut S, inputs: &Inputs<3>) -> Correction<3> {
    for _ in 0..8000 {
        servo.update(inputs, ALL, DT);
    }
    servo.update(inputs, ALL, DT)
}

fn settled(inputs: &Inputs<3>) -> S {
    let mut servo = S::new(*A);
    servo.enable();
    let correction = settle(&mut servo, inputs);
    assert_eq!(correction.dq, correction.computed);
    assert_eq!(correction.status, Status::default());
    assert!(correction.dq.iter().all(|&v| v != 0.0));
    servo
}

#[test]
fn nothing_is_corrected_before_it_is_enabled() {
    let mut servo = S::new(*A);
    let correction = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_eq!(correction.dq, [0.0; 3]);
    assert_ne!(correction.computed, [0.0; 3]);
    assert!(correction.status.is(Conditions::DISABLED));
    servo.enable();
    let correction = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_eq!(correction.dq, correction.computed);
    servo.disable();
    let correction = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_eq!(correction.dq, [0.0; 3]);
}

#[test]
fn a_dry_run_computes_and_outputs_zero() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    servo.dry_run(true);
    let correction = settle(&mut servo, &at(30.0, 10.0, 45.0));
    assert_eq!(correction.dq, [0.0; 3]);
    let travel = servo.travelling();
    let expected = A.evaluate(&at(30.0, 10.0, 45.0), &travel, &A.weights());
    assert_eq!(correction.computed, expected);
    assert!(correction.status.is(Conditions::DRY_RUN));
    servo.dry_run(false);
    let correction = settle(&mut servo, &at(30.0, 10.0, 45.0));
    assert_eq!(correction.dq, expected);
}

#[test]
fn the_ratio_of_the_corrections_holds_through_enable_and_disable() {
    let mut servo = S::new(*A);
    let inputs = at(20.0, 10.0, 45.0);
    let mut between = 0;
    for step in 0..2000 {
        if step < 1000 {
            servo.enable();
        } else {
            servo.disable();
        }
        let correction = servo.update(&inputs, ALL, DT);
        let s = servo.factor();
        assert_eq!(correction.dq, correction.computed.map(|v| s * v));
        between += u32::from(s > 0.0 && s < 1.0);
    }
    // 0.2 mm at 0.4 mm/s: half a second, and 0.05 s for rise and braking, both ways.
    assert!((1090..1110).contains(&between), "{between}");
}

#[test]
fn unusable_inputs_hold_the_correction_for_10_ms_and_then_ramp_it_to_zero() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut servo = settled(&at(20.0, 10.0, 45.0));
            let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
            let mut inputs = at(20.0, 10.0, 45.0);
            inputs.axes[axis] = bad;
            for _ in 0..9 {
                let correction = servo.update(&inputs, ALL, DT);
                assert_eq!(correction.dq, before.dq);
                let expected = Conditions::BAD_INPUT | Conditions::HELD;
                assert_eq!(correction.status.conditions, expected);
            }
            // The tenth is on the edge: the sum of ten times 1 ms in f32 may be above 10 ms.
            servo.update(&inputs, ALL, DT);
            let mut correction = servo.update(&inputs, ALL, DT);
            assert!(
                correction
                    .status
                    .is(Conditions::FROZEN | Conditions::RAMPING)
            );
            // Good again, elsewhere: still the old vector until s = 0.
            let mut last = servo.factor();
            while servo.factor() > 0.0 {
                correction = servo.update(&at(-60.0, 10.0, 200.0), ALL, DT);
                assert_eq!(correction.computed, before.computed);
                assert!(servo.factor() < last);
                last = servo.factor();
            }
            assert_eq!(correction.dq, [0.0; 3]);
            let correction = settle(&mut servo, &at(-60.0, 10.0, 200.0));
            assert_eq!(correction.dq, correction.computed);
            assert_ne!(correction.computed, before.computed);
        }
    }
}

#[test]
fn a_short_fault_is_over_with_the_next_usable_inputs() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    for _ in 0..9 {
        servo.update(&at(f32::NAN, 10.0, 45.0), ALL, DT);
    }
    let correction = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    assert_eq!(correction.status, Status::default());
    assert_eq!(servo.factor(), 1.0);
}

#[test]
fn a_position_beyond_8192_turns_is_unusable() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let limit = MOST_PERIODS * 360.0;
    let status = |servo: &mut S, c| servo.update(&at(20.0, 10.0, c), ALL, DT).status;
    assert!(!status(&mut servo, limit).is(Conditions::BAD_INPUT));
    assert!(status(&mut servo, limit + 1.0).is(Conditions::BAD_INPUT));
    assert!(!status(&mut servo, -limit).is(Conditions::BAD_INPUT));
    assert!(status(&mut servo, -limit - 1.0).is(Conditions::BAD_INPUT));
}

#[test]
fn periods_that_cannot_be_right_hold_the_correction() {
    for bad in [
        f32::NAN,
        f32::INFINITY,
        0.0,
        -0.001,
        0.010_001,
        -f32::INFINITY,
    ] {
        let mut servo = settled(&at(20.0, 10.0, 45.0));
        let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
        let correction = servo.update(&at(20.5, 10.0, 45.0), ALL, bad);
        assert_eq!(correction.dq, before.dq);
        assert!(
            correction
                .status
                .is(Conditions::BAD_PERIOD | Conditions::HELD)
        );
        for _ in 0..2000 {
            servo.update(&at(20.5, 10.0, 45.0), ALL, bad);
        }
        assert_eq!(servo.factor(), 0.0);
    }
}

#[test]
fn without_a_reference_the_set_goes_to_zero_with_the_vector_it_had() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    for step in 0..2000 {
        // Homing sets another position.
        let correction = servo.update(&at(step as f32 * 0.02, 10.0, 45.0), 0b110, DT);
        assert_eq!(correction.computed, before.computed);
        let s = servo.factor();
        assert_eq!(correction.dq, before.computed.map(|v| s * v));
        assert!(
            correction
                .status
                .is(Conditions::UNREFERENCED | Conditions::FROZEN)
        );
    }
    assert_eq!(servo.factor(), 0.0);
    // Its direction is forgotten with its position.
    assert_eq!(servo.travelling().0[0], Travel::Unknown);
    let correction = settle(&mut servo, &at(-60.0, 10.0, 45.0));
    assert_eq!(correction.dq, correction.computed);
}

#[test]
fn an_axis_that_feeds_no_table_need_not_be_referenced() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let correction = servo.update(&at(20.0, 10.0, 45.0), 0b101, DT);
    assert_eq!(correction.status, Status::default());
}

#[test]
fn a_swap_fades_from_the_old_compensation_to_the_new() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = settled(&inputs);
    let old = servo.update(&inputs, ALL, DT).dq;
    servo.swap(*B).unwrap();
    assert!(servo.is_swapping());
    assert_eq!(servo.swap(*B), Err(Refused::Busy));
    let mut last = old;
    let travel = servo.travelling();
    let new = B.evaluate(&inputs, &travel, &B.weights());
    let mut steps = 0;
    while servo.is_swapping() {
        assert!(core::ptr::eq(servo.compensation(), *A));
        let dq = servo.update(&inputs, ALL, DT).dq;
        // On the line from the old to the new, and never back. Each blend rounds twice.
        let fraction = (dq[1] - old[1]) / (new[1] - old[1]);
        for k in 0..3 {
            assert!((dq[k] - old[k] - (new[k] - old[k]) * fraction).abs() < 1e-7);
            assert!((dq[k] - last[k]) * (new[k] - old[k]) >= -1e-9);
        }
        last = dq;
        steps += 1;
    }
    assert!(core::ptr::eq(servo.compensation(), *B));
    assert_eq!(settle(&mut servo, &inputs).dq, new);
    // 0.5 mm (both bounds of Y) at half of 0.3 mm/s, and 0.05 s.
    assert!((3370..3400).contains(&steps), "{steps}");
}

#[test]
fn a_swap_waits_until_the_new_inputs_are_usable() {
    let mut inputs = at(20.0, 10.0, 45.0);
    inputs.auxiliaries[0] = f32::NAN;
    let mut servo = settled(&inputs);
    servo.swap(*B).unwrap();
    let correction = settle(&mut servo, &inputs);
    assert_eq!(correction.dq, correction.computed);
    assert_eq!(correction.status.conditions, Conditions::FADING);
    settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert!(core::ptr::eq(servo.compensation(), *B));
}

#[test]
fn a_swap_while_nothing_is_output_is_immediate() {
    let mut servo = S::new(*A);
    servo.swap(*B).unwrap();
    servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    assert!(core::ptr::eq(servo.compensation(), *B));
    assert!(!servo.is_swapping());
}

#[test]
fn a_compensation_of_another_machine_is_refused() {
    let mut servo = S::new(*A);
    let mut other = draft(1.0);
    other.axes[1].name = b'Z';
    assert_eq!(servo.swap(leak(&other)), Err(Refused::Axes));
    let mut other = draft(1.0);
    other.axes[1].travel[1] = 60.0;
    assert_eq!(servo.swap(leak(&other)), Err(Refused::Axes));
    let mut other = draft(1.0);
    other.axes[2].period = 720.0;
    assert_eq!(servo.swap(leak(&other)), Err(Refused::Axes));
    servo.swap(*B).unwrap();
    servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    let mut other = draft(1.0);
    other.auxiliaries = specimen::everything().auxiliaries;
    other.auxiliaries[0].kind = AuxiliaryKind::Temperature;
    assert_eq!(servo.swap(leak(&other)), Err(Refused::Auxiliaries));
}

#[test]
fn weights_fade_in_and_later_ones_follow() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = settled(&inputs);
    assert_eq!(servo.set_weight(0, 1.0), Err(WeightError::NotAdjustable));
    assert!(servo.set_weight(5, 4.5).is_err());
    servo.set_weight(5, 2.0).unwrap();
    let before = servo.update(&inputs, ALL, DT);
    assert!(before.status.is(Conditions::FADING));
    servo.set_weight(5, 3.0).unwrap();
    assert_eq!(servo.wanted_weights().get(5), Some(3.0));
    let correction = settle(&mut servo, &inputs);
    let mut weights = A.weights();
    weights.set(5, 3.0).unwrap();
    let expected = A.evaluate(&inputs, &servo.travelling(), &weights);
    assert_eq!(correction.dq, expected);
    assert_eq!(correction.status, Status::default());
}

#[test]
fn a_backlash_step_is_spread_by_the_rate_bound() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let up = settle(&mut servo, &at(20.5, 10.0, 45.0)).dq[0];
    let at_reversal = servo.update(&at(20.25, 10.0, 45.0), ALL, DT);
    assert_eq!(servo.travelling().0[0], Travel::Negative);
    assert_eq!(at_reversal.status.rate_limited, 0b001);
    // 2 mm/s for 1 ms, rounded.
    assert!((up - at_reversal.dq[0] - 0.002).abs() < 1e-8);
    assert_eq!(
        settle(&mut servo, &at(20.25, 10.0, 45.0)).status,
        Status::default()
    );
}

#[test]
fn an_endless_axis_keeps_its_direction_over_the_turn_whatever_its_tables() {
    let backlash = DraftBank {
        direction: Direction::Signed,
        ..bank(2, 0.0, 360.0, vec![vec![0.02, 0.02]])
    };
    let mut alone = bare();
    (alone.axes[2].travel, alone.axes[2].period) = ([-f32::MAX, f32::MAX], 360.0);
    alone.banks = vec![backlash];
    alone.terms = vec![term(2, 1.0, &[0])];
    let mut with_a_plain_table = alone.clone();
    let plain = bank(2, 0.0, 180.0, vec![vec![0.0, 0.01, 0.0]]);
    with_a_plain_table.banks.push(plain);
    with_a_plain_table.terms.push(term(0, 1.0, &[1]));
    let mut with_a_third_of_a_turn = alone.clone();
    with_a_third_of_a_turn.banks.push(DraftBank {
        modulo: true,
        ..bank(2, 0.0, 60.0, vec![vec![0.0, 0.01]])
    });
    with_a_third_of_a_turn.terms.push(term(0, 1.0, &[1]));
    for draft in [alone, with_a_plain_table, with_a_third_of_a_turn] {
        let c = leak(&draft);
        for (step, travel, dq) in [
            (1_i16, Travel::Positive, 0.02),
            (-1, Travel::Negative, -0.02),
        ] {
            let mut servo = S::new(c);
            servo.enable();
            let mut tenths = 0_i16;
            for update in 0..8000 {
                tenths = (tenths + step).rem_euclid(3600);
                let correction = servo.update(&at(0.0, 0.0, f32::from(tenths) * 0.1), ALL, DT);
                if update > 0 {
                    assert_eq!(servo.travelling().0[2], travel, "at {tenths}");
                }
                if update > 4000 {
                    assert_eq!(correction.dq[2], dq, "at {tenths}");
                }
            }
        }
    }
}

#[test]
fn an_endless_axis_without_modulo_tables_has_8192_turns_too() {
    let mut draft = bare();
    (draft.axes[2].travel, draft.axes[2].period) = ([-f32::MAX, f32::MAX], 360.0);
    let c = leak(&draft);
    assert_eq!(c.farthest(0), Some(f32::MAX));
    assert_eq!(c.farthest(2), Some(MOST_PERIODS * 360.0));
    assert_eq!(c.farthest(3), None);
}

#[test]
fn an_empty_compensation_can_run() {
    let mut servo = S::new(Box::leak(Box::new(C::empty())));
    servo.enable();
    assert_eq!(settle(&mut servo, &at(1.0, 2.0, 3.0)).dq, [0.0; 3]);
}

#[derive(Clone, Copy, Debug)]
enum Event {
    Enable,
    Disable,
    DryRun(bool),
    Swap(bool),
    Weight(f32),
    Reference(u16),
    BadInput(usize, f32),
    BadPeriod(f32),
    Move([f32; 3]),
    Jump([f32; 3]),
    Length(f32),
    Rest,
}

fn not_a_position() -> impl Strategy<Value = f32> {
    prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(f32::NEG_INFINITY)]
}

/// Transitions and faults at rest.
fn transition() -> impl Strategy<Value = Event> {
    prop_oneof![
        3 => Just(Event::Enable),
        1 => Just(Event::Disable),
        1 => any::<bool>().prop_map(Event::DryRun),
        2 => any::<bool>().prop_map(Event::Swap),
        2 => (-2.5_f32..4.5).prop_map(Event::Weight),
        1 => (0_u16..8).prop_map(Event::Reference),
        2 => Just(Event::Reference(ALL)),
        1 => (0..4_usize, not_a_position()).prop_map(|(k, v)| Event::BadInput(k, v)),
        // Beyond 8192 turns: a position to a linear axis, a fault to C.
        1 => prop_oneof![Just(3e38_f32), Just(-1e7)].prop_map(|v| Event::BadInput(2, v)),
        3 => Just(Event::Rest),
    ]
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        12 => transition(),
        1 => prop_oneof![not_a_position(), Just(0.0_f32), Just(-0.001), Just(0.02)].prop_map(Event::BadPeriod),
        1 => (0..4_usize, prop_oneof![Just(3e38_f32), Just(-1e7)]).prop_map(|(k, v)| Event::BadInput(k, v)),
        // Up to 300 mm/s: beyond the travel of 100 within a few hundred periods.
        6 => prop::array::uniform3(-300.0_f32..300.0).prop_map(Event::Move),
        1 => prop::array::uniform3(-120.0_f32..120.0).prop_map(Event::Jump),
        1 => (0.0_f32..100.0).prop_map(Event::Length),
    ]
}

/// The events that are calls of the servo.
fn command(servo: &mut S, event: &Event) {
    match *event {
        Event::Enable => servo.enable(),
        Event::Disable => servo.disable(),
        Event::DryRun(on) => servo.dry_run(on),
        Event::Swap(b) => match servo.swap(if b { *B } else { *A }) {
            Ok(()) | Err(Refused::Busy) => {}
            Err(refused) => panic!("{refused}"),
        },
        Event::Weight(weight) => {
            let _ = servo.set_weight(5, weight);
        }
        _ => {}
    }
}

/// A machine around the servo.
struct Plant {
    servo: S,
    inputs: Inputs<3>,
    velocity: [f32; 3],
    referenced: u16,
}

impl Plant {
    fn new() -> Self {
        Self {
            servo: S::new(*A),
            inputs: at(0.0, 0.0, 0.0),
            velocity: [0.0; 3],
            referenced: ALL,
        }
    }

    /// What lasts of an event; what does not is returned: an input and a period in place of ours.
    fn apply(&mut self, event: Event) -> (Option<(usize, f32)>, Option<f32>) {
        command(&mut self.servo, &event);
        match event {
            Event::Reference(mask) => self.referenced = mask,
            Event::BadInput(k, v) => return (Some((k, v)), None),
            Event::BadPeriod(dt) => return (None, Some(dt)),
            Event::Move(velocity) => self.velocity = velocity,
            Event::Jump(position) => self.inputs.axes = position,
            Event::Length(length) => self.inputs.auxiliaries[0] = length,
            Event::Rest => self.velocity = [0.0; 3],
            _ => {}
        }
        (None, None)
    }

    fn travel_on(&mut self, dt: f32) {
        for (q, v) in self.inputs.axes.iter_mut().zip(&mut self.velocity) {
            *q += *v * dt;
            if *q > 110.0 || *q < -110.0 {
                *v = -*v;
            }
        }
    }
}

fn with(mut inputs: Inputs<3>, other: Option<(usize, f32)>) -> Inputs<3> {
    match other {
        Some((3, v)) => inputs.auxiliaries[0] = v,
        Some((k, v)) => inputs.axes[k] = v,
        None => {}
    }
    inputs
}

proptest! {
    // 3000 cases of 40 events on average: 120 000 events.
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_guard_rails_hold(
        base in 1.0 / 8192.0_f32..0.01,
        plan in prop::collection::vec((event(), 1_usize..60, 0.1875_f32..1.0), 20..60),
    ) {
        let mut plant = Plant::new();
        let mut dq = [0.0_f32; 3];
        let mut guarded = [0.0_f32; 3];
        let mut period = 0.0_f32;
        let mut twin = S::new(*A);
        for (event, steps, share) in plan {
            command(&mut twin, &event);
            let (other, wrong) = plant.apply(event);
            let mut held = false;
            for step in 0..steps {
                let dt = wrong.unwrap_or(base * share);
                if dt > 0.0 && dt <= LONGEST_PERIOD {
                    period = dt;
                }
                plant.travel_on(base * share);
                let inputs = with(plant.inputs, other);
                let correction = plant.servo.update(&inputs, plant.referenced, dt);
                // The short way does what the long way does, to the bit.
                twin.unsettle();
                let same = twin.update(&inputs, plant.referenced, dt);
                prop_assert_eq!(correction, same);
                prop_assert_eq!(plant.servo.travelling(), twin.travelling());
                let status = correction.status;
                let s = plant.servo.factor();
                prop_assert!((0.0..=1.0).contains(&s));
                for k in 0..3 {
                    let (now, before) = (correction.dq[k], dq[k]);
                    // Never not-a-number, never above the larger of both value bounds (B's).
                    let bound = B.axes()[k].value_bound;
                    prop_assert!(now.abs() <= bound, "{now} beyond {bound}");
                    prop_assert!(correction.computed[k].abs() <= bound);
                    let q = inputs.axes[k];
                    let moved = if q.is_finite() {
                        let moved = (f64::from(q) - f64::from(guarded[k])).abs();
                        guarded[k] = q;
                        moved
                    } else { 0.0 };
                    // The travel, without any tolerance: where it acts, end − q is below 0.3 at
                    // positions of at least 50, so neither that nor the sum in f64 rounds.
                    let [low, high] = A.axes()[k].travel.map(f64::from);
                    let (at, sum) = (f64::from(guarded[k]), f64::from(guarded[k]) + f64::from(now));
                    if at > high {
                        prop_assert!(now <= 0.0);
                    } else if at < low {
                        prop_assert!(now >= 0.0);
                    } else {
                        prop_assert!(sum <= high && sum >= low, "{at} + {now} leaves {low}..{high}");
                    }
                    // The rate bound (B's is the larger); at the end of the travel the command's
                    // own speed if that is more. `last ± most` rounds by half an ulp of 0.3.
                    let mut most = 3.0 * f64::from(period);
                    if status.travel_limited & (1 << k) != 0 {
                        most = most.max(moved);
                    }
                    let change = (f64::from(now) - f64::from(before)).abs();
                    prop_assert!(change <= most * (1.0 + 1e-6) + 1.5e-8, "{change} beyond {most}");
                }
                if status.rate_limited | status.travel_limited == 0 {
                    // No bound acts: exactly one factor for all axes.
                    prop_assert_eq!(correction.dq, correction.computed.map(|v| s * v));
                }
                let bad = Conditions::BAD_INPUT | Conditions::BAD_PERIOD;
                let fault = status.conditions.0 & bad.0 != 0;
                prop_assert!(!fault || status.is(Conditions::HELD));
                if step > 0 && held && s == 1.0 && dq == correction.computed && status.conditions == Conditions::HELD | Conditions::BAD_INPUT && status.travel_limited == 0 {
                    prop_assert_eq!(correction.dq, dq);
                }
                held = status.is(Conditions::HELD);
                dq = correction.dq;
            }
        }
        // And it always recovers.
        plant.velocity = [0.0; 3];
        plant.inputs.axes = [20.0, 10.0, 45.0];
        plant.servo.dry_run(false);
        plant.servo.enable();
        for _ in 0..3 {
            settle(&mut plant.servo, &plant.inputs);
        }
        let correction = plant.servo.update(&plant.inputs, ALL, DT);
        prop_assert_eq!(correction.dq, correction.computed);
        prop_assert_eq!(correction.status.conditions, Conditions::default());
        plant.servo.disable();
        prop_assert_eq!(settle(&mut plant.servo, &plant.inputs).dq, [0.0; 3]);
    }

    #[test]
    fn at_rest_no_transition_is_a_step_in_position_or_velocity(
        plan in prop::collection::vec((transition(), 1_usize..400), 10..30),
        x in -90.0_f32..90.0,
        c in -400.0_f32..400.0,
    ) {
        let mut plant = Plant::new();
        plant.inputs = at(x, 10.0, c);
        let mut dq = [0.0_f64; 3];
        let mut velocity = [0.0_f64; 3];
        for (event, steps) in plan {
            let (other, _) = plant.apply(event);
            for _ in 0..steps {
                let correction = plant.servo.update(&with(plant.inputs, other), plant.referenced, DT);
                // Both paces are those of A or slower: A's ramp rate is the larger.
                let (ramp, dt) = (0.4, f64::from(DT));
                for k in 0..3 {
                    let now = f64::from(correction.dq[k]);
                    let speed = (now - dq[k]) / dt;
                    // s and f each round by 2⁻²⁴ (twice in a difference), products and the blend
                    // of values below 0.3 by six more halves of their ulp of 2⁻²⁵.
                    let rounding = 0.6 * 10.0 * 2.0_f64.powi(-24) / dt;
                    // s and f may move at once: s'·C + s·(b − a)·f', then each at half the ramp rate.
                    prop_assert!(speed.abs() <= ramp + rounding, "velocity {speed}");
                    // Together they may change by ramp/RISE, and their product by 2·s'·f'·(b − a),
                    // where s' is at most 0.2 / 0.2 per second.
                    let most = dt * (ramp / f64::from(RISE) + 2.0 * ramp);
                    let change = (speed - velocity[k]).abs();
                    prop_assert!(change <= most + 2.0 * rounding, "velocity changes by {change}, not {most}");
                    (dq[k], velocity[k]) = (now, speed);
                }
            }
        }
    }
}
