//! Every accepted request completes within a stated time, whatever noise the inputs have.

use super::*;

/// Every axis on every other one, a tool length, and two temperatures, one of them with a lag; an adjustable weight.
fn noisy(scale: f32) -> &'static C {
    let mut draft = limited(0.4, 2.0, 0.4);
    draft.auxiliaries = specimen::everything().auxiliaries;
    for (name, lag_rate) in [("bed", 0.0), ("column", 0.01)] {
        draft.auxiliaries.push(Auxiliary {
            kind: AuxiliaryKind::Temperature,
            name: name.try_into().unwrap(),
            reference: 20.0,
            sensor: Sensor {
                lag_rate,
                ..Sensor::USUAL
            },
        });
    }
    draft.banks = (0..6)
        .map(|input| bank(input, -500.0, 1000.0, vec![vec![-0.1, 0.1]]))
        .collect();
    draft.banks[0].direction = Direction::Signed;
    draft.terms = (0..3).map(|k| term(k, scale, &[k])).collect();
    draft
        .terms
        .extend((3..6).map(|k| term(k - 3, 40.0 * scale, &[k])));
    draft.terms.push(adjustable(2, 0.01, [-0.05, 0.05], &[]));
    leak(&draft)
}

static NOISY: LazyLock<[&'static C; 2]> = LazyLock::new(|| [noisy(1.0), noisy(-0.9)]);

/// The time (s) within which a request completes: a fade under way and the one that waits (2 × 0.4 mm at half of
/// 0.4 mm/s), a ramp at half its rate (0.4 mm at 0.2 mm/s), each with a `RISE` to begin and end, and the fade asked
/// for.
const MOST: f32 = 3.0 * (4.0 + RISE) + 2.0 + RISE + 0.1;

#[derive(Clone, Copy, Debug)]
enum Request {
    Swap,
    Enable(bool),
    DryRun(bool),
    Weight(f32),
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        2 => Just(Request::Swap),
        1 => any::<bool>().prop_map(Request::Enable),
        1 => any::<bool>().prop_map(Request::DryRun),
        1 => (-0.05_f32..0.05).prop_map(Request::Weight),
    ]
}

/// A number from −1 to 1, and the next seed.
fn draw(seed: &mut u32) -> f32 {
    *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    (*seed >> 8) as f32 / 8_388_608.0 - 1.0
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_request_completes_in_time_with_noise_on_every_input(
        requests in prop::collection::vec(request(), 1..4),
        kilohertz in prop_oneof![Just(1_u16), Just(4), Just(20)],
        // Of positions (mm or degrees), of the tool length (mm), of temperatures (K).
        noise in (0.0_f32..0.1, prop_oneof![Just(0.0_f32), 0.0_f32..10.0], prop_oneof![Just(0.01_f32), Just(0.0625), 0.0_f32..5.0]),
        drift in prop_oneof![Just(0.0_f32), Just(30.0 / 3600.0), -0.09_f32..0.09],
        seed in any::<u32>(),
    ) {
        let (mut seed, dt) = (seed, 0.001 / f32::from(kilohertz));
        let mut servo = S::new(NOISY[0]);
        let mut next = 1;
        let mut time = 0.0_f64;
        let mut inputs = at(0.0, 0.0, 0.0);
        let mut update = |servo: &mut S, time: &mut f64| {
            // Readings of sensors come every 20 ms.
            let reads = (*time / 0.02) as u64 != ((*time - f64::from(dt)) / 0.02) as u64;
            *time += f64::from(dt);
            for q in &mut inputs.axes {
                *q = 20.0 + noise.0 * draw(&mut seed);
            }
            inputs.auxiliaries[0] = 130.0 + noise.1 * draw(&mut seed);
            if reads {
                for kelvin in &mut inputs.auxiliaries[1..3] {
                    let drift = (f64::from(drift) * *time).clamp(-3.0, 3.0) as f32;
                    *kelvin = drift + noise.2 * draw(&mut seed);
                }
            }
            servo.update(&inputs, ALL, dt)
        };
        inputs_are_set(&mut servo, &mut update, &mut time);
        servo.enable();
        for request in requests {
            match request {
                Request::Swap => {
                    let taken = servo.swap(NOISY[next]);
                    prop_assert!(taken.is_ok());
                    next = 1 - next;
                }
                Request::Enable(true) => servo.enable(),
                Request::Enable(false) => servo.disable(),
                Request::DryRun(on) => servo.dry_run(on),
                Request::Weight(weight) => servo.set_weight(6, weight).unwrap(),
            }
            let wanted = servo.wanted;
            let begin = time;
            loop {
                let correction = update(&mut servo, &mut time);
                let bad = Conditions::BAD_INPUT.0 | Conditions::BAD_PERIOD.0;
                prop_assert_eq!(correction.status.conditions.0 & bad, 0);
                let up = servo.switches == Conditions::default();
                let done = servo.factor.at_rest() && servo.factor() == f32::from(u8::from(up));
                if done && !servo.is_swapping() && servo.weights.values() == wanted.values() {
                    break;
                }
                let waited = time - begin;
                prop_assert!(waited < f64::from(MOST), "{request:?} takes {waited} s");
            }
        }
    }
}

/// A first period with all inputs.
fn inputs_are_set(
    servo: &mut S,
    update: &mut impl FnMut(&mut S, &mut f64) -> Correction<[f32; 3]>,
    time: &mut f64,
) {
    update(servo, time);
    // The first reading of a sensor is that of the next 20 ms.
    while *time < 0.05 {
        update(servo, time);
    }
}
