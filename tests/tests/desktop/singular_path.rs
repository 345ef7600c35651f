//! A path at top speed through the position where the tool is parallel to a rotary axis, on the servo: rotary
//! corrections are largest there and change fastest, and no limit may act.

use trueaxis::{Inputs, Largest, Servo};
use trueaxis_model::kinematics::Policy;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{self, Options};
use trueaxis_tables::schemes;
use trueaxis_tests::{errors, golden::load, machine};

/// Servo period (s).
const PERIOD: f64 = 0.001;
/// Number of initial periods in which directions of travel become known and the corrections of backlash come in: 50 ms
/// at the rate bound, and as long to accelerate and brake.
const SET_OUT: usize = 100;
/// Half the stroke of the rotary axes (deg), with the singular position in the middle.
const HALF: f64 = 30.0;

fn compensation(machine: &Machine, errors_file: &str, damping: f64) -> trueaxis::AlignedBlob {
    let errors = errors(errors_file, machine);
    let options = Options {
        tables: schemes::Options {
            policy: Policy::Direction { damping },
            ..schemes::Options::default()
        },
        allow_large: true,
        ..Options::default()
    };
    let built = compile::build(machine, &errors, &options, &()).unwrap_or_else(|e| panic!("{e}"));
    built.blob
}

/// Axis positions a time (s) after the start of a pass of the given duration: rotary axes through 0, linear ones
/// through part of their travel, each at its top speed; the bits of `way` select the directions.
fn position(machine: &Machine, time: f64, duration: f64, way: u32) -> Vec<f32> {
    let axes = machine.axes.iter().enumerate();
    axes.map(|(i, axis)| {
        let sign = if way >> i & 1 == 1 { 1.0 } else { -1.0 };
        let [low, high] = axis.travel;
        let middle = if axis.letter.is_rotary() {
            0.0
        } else {
            0.5 * (low + high)
        };
        let from_middle = sign * axis.max_speed * (time - 0.5 * duration);
        // At top speed until the travel ends.
        (middle + from_middle).clamp(low, high) as f32
    })
    .collect()
}

/// Number of periods in which a limit acts on passes in all directions, and the largest fraction of a rate bound
/// used by a rotary correction.
fn passes(machine: &Machine, c: &Largest<'_>) -> (usize, f64) {
    let fastest = machine.axes.iter().filter(|a| a.letter.is_rotary());
    let fastest = fastest.map(|a| a.max_speed).fold(0.0, f64::max);
    let duration = 2.0 * HALF / fastest;
    let (mut acting, mut taken) = (0, 0.0_f64);
    let mut last = None;
    for way in 0..1 << machine.axes.len() {
        let mut servo: Servo<&Largest<'_>> = Servo::new(c);
        let inputs = |time: f64| {
            let mut inputs = Inputs::at([0.0; 16]);
            let position = position(machine, time, duration, way);
            inputs.axes[..position.len()].copy_from_slice(&position);
            inputs
        };
        servo.enable();
        let mut waited = 0;
        while servo.factor() < 1.0 {
            servo.update(&inputs(0.0), u16::MAX, PERIOD as f32);
            waited += 1;
            assert!(waited < 10_000, "the corrections do not come in");
        }
        for period in 0..=(duration / PERIOD) as usize {
            let now = servo.update(&inputs(period as f64 * PERIOD), u16::MAX, PERIOD as f32);
            let status = now.status;
            if let Some(last) = last.replace(now.dq).filter(|_| period > 0) {
                for (i, axis) in machine.axes.iter().enumerate() {
                    if axis.letter.is_rotary() {
                        let rate = f64::from((now.dq[i] - last[i]).abs()) / PERIOD;
                        taken = taken.max(rate / f64::from(c.axes()[i].rate_bound));
                    }
                }
            }
            let limits = status.saturated | status.rate_limited | status.travel_limited;
            // When axes start to move, the corrections of their backlash come in.
            acting += usize::from(limits != 0 && period > SET_OUT);
        }
    }
    (acting, taken)
}

#[test]
fn no_limits_acts_at_top_speed_through_a_singular_position() {
    for (folder, file, damping) in [
        ("huron-k2x8", "errors-13", 0.1),
        ("huron-k2x8", "errors-13", 0.01),
        ("kolibri", "errors-10", 0.1),
        ("hu40", "errors-13", 0.1),
        ("fork-head", "errors-13", 0.1),
        ("table-head", "errors-13", 0.1),
    ] {
        let machine = machine(&format!("examples/{folder}/machine.toml"));
        let blob = compensation(&machine, &format!("examples/{folder}/{file}.toml"), damping);
        let c = load(&blob);
        let (acting, taken) = passes(&machine, &c);
        println!("{folder} {damping}: {taken:.2} of a rate bound");
        assert_eq!(acting, 0, "{folder} {file} {damping}");
        // The peak is on the path: a bound is 1.25 times the sum over all axes, plus a ramp; at least 0.1 degrees per
        // second, which is twice the need of the smallest of these corrections.
        assert!(taken > 0.3, "{folder} {file} {damping}: {taken}");
    }
}
