//! The tool of a simulated machine, through the C interface, equals that of the exact kinematics.

use std::ptr::{null, null_mut};
use trueaxis_capi::border::*;
use trueaxis_capi::{Code, Model, ModelMemory, ModelPose, TRUEAXIS_HEADER as HEADER};
use trueaxis_kinematics::{
    Axis, Branch, ErrorModel, Kinematics, Letter, Machine, Parameter, Sensor, Situation, Stored,
    Switches, Table,
};

fn machine() -> Machine {
    let mut machine = Machine::new(&[
        Axis::new(Letter::X, Branch::Workpiece, [-250.0, 250.0]),
        Axis {
            modulo: true,
            ..Axis::new(Letter::C, Branch::Workpiece, [0.0, 360.0])
        },
        Axis::new(Letter::Y, Branch::Tool, [-150.0, 150.0]),
        Axis::new(Letter::Z, Branch::Tool, [0.0, 300.0]),
    ])
    .unwrap();
    machine.tip = [0.0, 0.0, -100.0];
    machine
}

fn errors(machine: &Machine) -> ErrorModel<Vec<f64>> {
    let mut errors = ErrorModel::new(machine);
    let parameter = |name| Parameter::parse(name).unwrap();
    for (name, value) in [
        ("EXX1", 5e-5),
        ("EXXb", 4e-3),
        ("EB0Z", 1e-4),
        ("EA0C", 7e-5),
    ] {
        assert!(errors.set(machine, parameter(name), value));
    }
    assert!(errors.set_per_kelvin(machine, parameter("EZ0S"), 0, 1e-3));
    let table = Table {
        at: vec![0.0, 3.0, 6.0],
        positive: vec![0.0, 1e-2, 0.0],
        negative: None,
    };
    assert!(errors.tabulate(1, 2, table));
    errors
}

/// The lag of its sensor (s).
const LAG: f64 = 200.0;

/// A file in words of 8 bytes, for the required alignment.
fn file() -> (Vec<u64>, usize) {
    let machine = machine();
    let sensor = Sensor {
        reading: 0,
        reference: 20.0,
        lag: LAG,
    };
    let bytes = Stored::write("Mill", &machine, &errors(&machine), &[sensor]).unwrap();
    let words = bytes.chunks(8).map(|chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        u64::from_ne_bytes(word)
    });
    (words.collect(), bytes.len())
}

fn made(memory: &mut ModelMemory) -> *mut Model {
    let mut model = null_mut();
    // SAFETY: the memory exists.
    let code = unsafe {
        trueaxis_model_new(
            HEADER,
            (&raw mut *memory).cast(),
            size_of::<ModelMemory>(),
            &mut model,
        )
    };
    assert_eq!(code, Code::Ok);
    model
}

fn pose(model: *mut Model, commands: [f64; 4], positions: [f64; 4], celsius: f64) -> ModelPose {
    let mut pose = ModelPose::default();
    // SAFETY: four values each.
    let code = unsafe {
        trueaxis_model_pose(
            model,
            commands.as_ptr(),
            positions.as_ptr(),
            4,
            f64::NAN,
            &celsius,
            1,
            &mut pose,
        )
    };
    assert_eq!(code, Code::Ok);
    pose
}

#[test]
fn the_tool_is_that_of_the_exact_kinematics() {
    let mut memory = Box::new(ModelMemory { words: [!0; _] });
    let model = made(&mut memory);
    let (words, length) = file();
    // SAFETY: the file outlives the model.
    unsafe {
        assert_eq!(
            trueaxis_model_load(model, words.as_ptr().cast(), length),
            Code::Ok
        );
        let mut letters = [0; 8];
        assert_eq!(trueaxis_model_axes(model, letters.as_mut_ptr(), 8), 4);
        assert_eq!(&letters.map(|c| c as u8)[..5], b"XCYZ\0");
    }
    let machine = machine();
    let errors = errors(&machine);
    let kinematics = Kinematics::new(&machine, &errors);
    let mut situation = Situation::default();
    situation.kelvin[0] = 5.0;
    // C continues to turn: 400° is 40°, and there is no reversal. X comes back.
    let along = [
        ([10.0, 350.0, 5.0, 7.0], [0.0; 4]),
        ([20.0, 400.0, 5.0, 7.0], [1.0, 1.0, 0.0, 0.0]),
        ([19.0, 40.5, 4.0, 7.0], [-1.0, 1.0, -1.0, 0.0]),
    ];
    for (commands, sign) in along {
        let positions = [
            commands[0] + 0.03,
            commands[1],
            commands[2],
            commands[3] - 0.02,
        ];
        let found = pose(model, commands, positions, 25.0);
        situation.sign[..4].copy_from_slice(&sign);
        let q = |mut position: [f64; 4]| {
            position[1] %= 360.0;
            machine.to_kinematic(&position)
        };
        let actual = kinematics.actual(&q(positions), &situation, &Switches::ALL);
        let nominal = kinematics.nominal(&q(commands), None);
        for (a, b) in [(found.tip, actual.t), (found.nominal_tip, nominal.t)] {
            // A position of C in another turn is reduced differently: units in the last place of 400°, 1e-15 rad, at
            // 250 mm.
            assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-11), "{a:?} {b}");
        }
        for (a, b) in [
            (found.direction, actual),
            (found.nominal_direction, nominal),
        ] {
            let b = machine.direction(&b);
            assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-14), "{a:?} {b:?}");
        }
    }
}

#[test]
fn errors_follow_temperatures_with_their_lag() {
    let mut memory = Box::new(ModelMemory { words: [!0; _] });
    let model = made(&mut memory);
    let (words, length) = file();
    // SAFETY: the file outlives the model.
    let code = unsafe { trueaxis_model_load(model, words.as_ptr().cast(), length) };
    assert_eq!(code, Code::Ok);
    let height = || {
        let mut pose = ModelPose::default();
        let at = [0.0; 4].as_ptr();
        // SAFETY: four values each, and no temperatures.
        let code = unsafe { trueaxis_model_pose(model, at, at, 4, f64::NAN, null(), 0, &mut pose) };
        assert_eq!(code, Code::Ok);
        pose.tip[2]
    };
    // SAFETY: one value.
    let warm = |celsius: f64, seconds| unsafe { trueaxis_model_warm(model, &celsius, 1, seconds) };
    let cold = height();
    // The first reading counts at once, and a lost one is kept. EZ0S grows by 1 µm/K.
    assert_eq!(warm(f64::NAN, 1.0), Code::Ok);
    assert_eq!(height(), cold);
    assert_eq!(warm(21.0, 1e-3), Code::Ok);
    // The cosine of 0.1 mrad, by which EB0Z tilts Z, less 1 is 5e-9.
    assert!((height() - cold - 1e-3).abs() < 1e-11);
    for _ in 0..200_000 {
        assert_eq!(warm(31.0, 1e-3), Code::Ok);
    }
    assert_eq!(warm(f64::NAN, 50.0), Code::Ok);
    let after = 1.0 + 10.0 * (1.0 - (-200.0 / LAG).exp());
    // Half a step over τ of the way that is left, 2.5e-6 of 4 µm.
    let off = height() - cold - after * 1e-3;
    assert!(off.abs() < 1e-7, "{off}");
    // SAFETY: too many, none of which is read.
    let many = unsafe { trueaxis_model_warm(model, null(), 100, 1.0) };
    assert_eq!(many, Code::Count);
}

#[test]
fn what_is_no_model_is_refused_and_leaves_none() {
    let mut memory = Box::new(ModelMemory { words: [!0; _] });
    let model = made(&mut memory);
    let (mut words, length) = file();
    let values = [0.0; 4];
    let mut found = ModelPose::default();
    // SAFETY: all memory exists, with the stated lengths.
    unsafe {
        let ask = |count, found: *mut ModelPose| {
            let (commands, positions) = (values.as_ptr(), values.as_ptr());
            trueaxis_model_pose(model, commands, positions, count, 0.0, null(), 0, found)
        };
        assert_eq!(ask(4, &mut found), Code::NotLoaded);
        let load = |from: *const u64, length| trueaxis_model_load(model, from.cast(), length);
        assert_eq!(load(words.as_ptr(), length), Code::Ok);
        assert_eq!(ask(4, &mut found), Code::Ok);
        assert_eq!(ask(3, &mut found), Code::Count);
        assert_eq!(ask(4, null_mut()), Code::NullPointer);
        assert_eq!(load(null(), length), Code::NullPointer);
        assert_eq!(load(words.as_ptr(), length - 1), Code::Damaged);
        assert_eq!(ask(4, &mut found), Code::NotLoaded);
        assert_eq!(trueaxis_model_axes(model, null_mut(), 0), 0);
        words[3] ^= 1;
        assert_eq!(load(words.as_ptr(), length), Code::Damaged);
        words[0] ^= 1;
        assert_eq!(load(words.as_ptr(), length), Code::NotAModel);
        let mut other = null_mut();
        let place = (&raw mut *memory).cast();
        let size = size_of::<ModelMemory>();
        assert_eq!(
            trueaxis_model_new(HEADER, place, 1000, &mut other),
            Code::Memory
        );
        assert_eq!(
            trueaxis_model_new(HEADER, null_mut(), size, &mut other),
            Code::NullPointer
        );
        assert_eq!(
            trueaxis_model_new(HEADER - (1 << 48), place, size, &mut other),
            Code::HeaderAxes
        );
    }
}
