//! Every correction through the C interface equals that of the Rust servo in every bit.

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};
use trueaxis::{AlignedBlob, Compensation, Inputs, Servo, Usual};
use trueaxis_capi::border::*;
use trueaxis_capi::{Code, ServoMemory, StatusFacts, TRUEAXIS_HEADER as HEADER, TablesMemory};

const PERIOD: f64 = 0.00025;

fn blob(name: &str) -> AlignedBlob {
    let path = format!(
        "{}/../../tests/golden/v1/{name}.trax",
        env!("CARGO_MANIFEST_DIR")
    );
    AlignedBlob::from_bytes(&std::fs::read(path).unwrap())
}

/// A servo behind the C interface, and its memory.
struct Behind {
    tables: *mut trueaxis_capi::Tables,
    servo: *mut trueaxis_capi::Servo,
    /// Uninitialised.
    memory: (
        *mut MaybeUninit<TablesMemory>,
        *mut MaybeUninit<ServoMemory>,
    ),
}

impl Behind {
    fn new(blob: &[u8]) -> Self {
        let memory = (
            Box::into_raw(Box::new_uninit()),
            Box::into_raw(Box::new_uninit()),
        );
        let (mut tables, mut servo) = (null_mut(), null_mut());
        let size = size_of::<TablesMemory>();
        // SAFETY: all memory exists, and nothing else uses it.
        unsafe {
            let place = memory.0.cast();
            assert_eq!(
                trueaxis_tables_new(HEADER, place, size, &mut tables),
                Code::Ok
            );
            let code = trueaxis_tables_load(tables, blob.as_ptr().cast(), blob.len());
            assert_eq!(code, Code::Ok);
            let place = memory.1.cast();
            let size = size_of::<ServoMemory>();
            assert_eq!(
                trueaxis_servo_new(place, size, tables, &mut servo),
                Code::Ok
            );
        }
        Self {
            tables,
            servo,
            memory,
        }
    }

    fn update(&self, commands: &[f64], referenced: u32) -> Vec<f64> {
        let mut values = commands.to_vec();
        let (from, to) = (values.as_ptr(), values.as_mut_ptr());
        // SAFETY: the arrays have the stated lengths; commands and corrections may be the same.
        let code = unsafe {
            trueaxis_servo_update(self.servo, from, commands.len(), referenced, PERIOD, to)
        };
        assert_eq!(code, Code::Ok);
        values
    }

    fn update_f32(&self, commands: &[f32], referenced: u32) -> Vec<f32> {
        let mut values = commands.to_vec();
        let (from, to) = (values.as_ptr(), values.as_mut_ptr());
        let (axes, period) = (commands.len(), PERIOD as f32);
        // SAFETY: the arrays have the stated lengths; commands and corrections may be the same.
        let code =
            unsafe { trueaxis_servo_update_f32(self.servo, from, axes, referenced, period, to) };
        assert_eq!(code, Code::Ok);
        values
    }

    fn status(&self) -> StatusFacts {
        let mut status = StatusFacts::default();
        // SAFETY: all memory exists.
        let code = unsafe { trueaxis_servo_status(self.servo, &mut status) };
        assert_eq!(code, Code::Ok);
        status
    }
}

impl Drop for Behind {
    fn drop(&mut self) {
        // SAFETY: they came from boxes, and nothing else points there any more.
        drop(unsafe { (Box::from_raw(self.memory.0), Box::from_raw(self.memory.1)) });
    }
}

/// A pseudo-random number from 0 to 1, always the same sequence.
fn draw(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f64 / f64::from(1 << 24)
}

#[test]
fn every_correction_is_that_of_the_rust_servo_to_the_last_bit() {
    for name in ["huron-13", "table-head-13", "router-10", "everything"] {
        let blob = blob(name);
        let compensation = Compensation::<'_, Usual>::from_blob(&blob).unwrap();
        let mut rust = Servo::new(&compensation);
        let (behind, single) = (Behind::new(&blob), Behind::new(&blob));
        let axes = compensation.axes();
        let mut state = 7;
        let mut inputs = Inputs::at([0.0; 8]);
        let mut corrected = 0;
        for period in 0..40_000_u32 {
            let event = draw(&mut state);
            // SAFETY: the servo exists.
            unsafe {
                if period == 10 || event < 0.000_2 {
                    rust.enable();
                    trueaxis_servo_enable(behind.servo, 1);
                    trueaxis_servo_enable(single.servo, 1);
                } else if event < 0.000_3 {
                    rust.disable();
                    trueaxis_servo_enable(behind.servo, 0);
                    trueaxis_servo_enable(single.servo, 0);
                } else if event < 0.000_4 {
                    rust.dry_run(true);
                    trueaxis_servo_dry_run(behind.servo, 1);
                    trueaxis_servo_dry_run(single.servo, 1);
                } else if event < 0.000_7 {
                    rust.dry_run(false);
                    trueaxis_servo_dry_run(behind.servo, 0);
                    trueaxis_servo_dry_run(single.servo, 0);
                } else if event < 0.001 || period == 0 {
                    for (k, auxiliary) in compensation.auxiliaries().iter().enumerate() {
                        let value = 150.0 * draw(&mut state);
                        let own = match auxiliary.kind {
                            trueaxis::AuxiliaryKind::ToolLength => value,
                            trueaxis::AuxiliaryKind::Temperature => {
                                value - f64::from(auxiliary.reference)
                            }
                        };
                        inputs.auxiliaries[k] = own as f32;
                        for servo in [behind.servo, single.servo] {
                            let code = trueaxis_servo_set_auxiliary(servo, k, value);
                            assert_eq!(code, Code::Ok);
                        }
                    }
                }
            }
            let time = f64::from(period) * PERIOD;
            let commands: Vec<f64> = (0..axes.len())
                .map(|k| {
                    let [low, high] = axes[k]
                        .travel
                        .map(|end| f64::from(end.clamp(-300.0, 300.0)));
                    let phase = (1.0 + 0.37 * k as f64) * time;
                    0.5 * (low + high) + 0.45 * (high - low) * phase.sin()
                })
                .collect();
            for (to, q) in inputs.axes.iter_mut().zip(&commands) {
                *to = *q as f32;
            }
            // Occasionally an axis has no reference.
            let referenced = if period % 8_000 > 7_900 {
                0b1_1110
            } else {
                0xFFFF
            };
            let expected = rust.update(&inputs, referenced, PERIOD as f32);
            let found = behind.update(&commands, referenced.into());
            let count = axes.len();
            let found_f32 = single.update_f32(&inputs.axes[..count], referenced.into());
            assert_eq!(found_f32, expected.dq[..count], "{name}, {period}");
            for (found, expected) in found.iter().zip(&expected.dq) {
                assert_eq!(
                    found.to_bits(),
                    f64::from(*expected).to_bits(),
                    "{name}, {period}"
                );
            }
            corrected += u32::from(expected.dq.iter().any(|dq| *dq != 0.0));
            let status = behind.status();
            assert_eq!(status.conditions, expected.status.conditions.0);
            assert_eq!(status.rate_limited, expected.status.rate_limited);
            assert_eq!(status.factor.to_bits(), rust.factor().to_bits());
        }
        assert!(
            corrected > 2_000,
            "{name}: only {corrected} periods are corrected"
        );
    }
}

#[test]
fn a_million_turns_give_the_correction_of_none() {
    let blob = blob("table-head-13");
    let compensation = Compensation::<'_, Usual>::from_blob(&blob).unwrap();
    let endless = compensation
        .axes()
        .iter()
        .position(|axis| axis.period > 0.0);
    let Some(endless) = endless else {
        panic!("no axis without end");
    };
    let (near, far) = (Behind::new(&blob), Behind::new(&blob));
    for behind in [&near, &far] {
        // SAFETY: the servo exists.
        unsafe { trueaxis_servo_enable(behind.servo, 1) };
    }
    let mut other = 0;
    for period in 0..20_000_u32 {
        // A multiple of 2⁻¹⁶, so that a million turns more are still exact in a double.
        let angle = f64::from(period % 11_000) / 32.0;
        let mut commands = vec![10.0; compensation.axes().len()];
        commands[endless] = angle;
        let expected = near.update(&commands, 0xFFFF);
        commands[endless] = angle + 360.0 * 1e6;
        assert_eq!(far.update(&commands, 0xFFFF), expected);
        other += u32::from(expected.iter().any(|dq| *dq != 0.0));
    }
    assert!(other > 10_000);
}

#[test]
fn a_measured_position_leads_back_to_its_command() {
    let blob = blob("huron-13");
    let behind = Behind::new(&blob);
    let commands = [100.0, 30.0, 45.0, -50.0, -120.0];
    let mut back = [0.0; 5];
    // SAFETY: all memory exists.
    unsafe {
        // While disabled there is nothing to remove.
        behind.update(&commands, 0xFFFF);
        let (from, to) = (commands.as_ptr(), back.as_mut_ptr());
        assert_eq!(trueaxis_servo_measured(behind.servo, from, 5, to), Code::Ok);
        assert_eq!(back, commands);
        trueaxis_servo_enable(behind.servo, 1);
        behind.update(&commands, 0xFFFF);
        behind.update(&commands, 0xFFFF);
        assert_eq!(
            trueaxis_servo_measured(behind.servo, from, 5, to),
            Code::Moving
        );
        for _ in 0..20_000 {
            behind.update(&commands, 0xFFFF);
        }
        let dq = behind.update(&commands, 0xFFFF);
        assert!(dq.iter().any(|dq| dq.abs() > 1e-3));
        let measured: [f64; 5] = std::array::from_fn(|k| commands[k] + dq[k]);
        assert_eq!(
            trueaxis_servo_measured(behind.servo, measured.as_ptr(), 5, to),
            Code::Ok
        );
    }
    for (back, command) in back.iter().zip(commands) {
        // Positions below 128 are 2⁻¹⁷ apart in f32, times a slope of 1e-3: below 1e-8.
        assert!((back - command).abs() < 1e-8, "{back} {command}");
    }
}

#[test]
fn what_is_not_there_is_refused() {
    let blob = blob("huron-13");
    let behind = Behind::new(&blob);
    let mut values = [0.0; 5];
    let (from, to) = (values.as_ptr(), values.as_mut_ptr());
    let mut other = Box::<ServoMemory>::new_uninit();
    let place = (&raw mut *other).cast::<trueaxis_capi::Servo>();
    let mut made = null_mut();
    // SAFETY: all memory exists, or is null.
    unsafe {
        let update =
            |servo, from, axes, to| trueaxis_servo_update(servo, from, axes, 31, PERIOD, to);
        assert_eq!(update(null_mut(), from, 5, to), Code::NullPointer);
        assert_eq!(update(behind.servo, null(), 5, to), Code::NullPointer);
        assert_eq!(update(behind.servo, from, 5, null_mut()), Code::NullPointer);
        assert_eq!(update(behind.servo, from, 4, to), Code::Count);
        assert_eq!(update(behind.servo, from.byte_add(1), 4, to), Code::Count);
        assert_eq!(update(behind.servo, from.byte_add(1), 5, to), Code::Memory);
        let size = size_of::<ServoMemory>();
        let new = |size, made| trueaxis_servo_new(place.cast(), size, behind.tables, made);
        assert_eq!(new(size, &mut made), Code::InUse);
        assert_eq!(new(100, &mut made), Code::Memory);
        assert_eq!(new(size, null_mut()), Code::NullPointer);
        let bytes = blob.as_ptr().cast();
        assert_eq!(
            trueaxis_tables_load(behind.tables, bytes, blob.len()),
            Code::InUse
        );
        assert_eq!(trueaxis_servo_release(behind.servo), Code::Ok);
        assert_eq!(trueaxis_servo_release(behind.servo), Code::Released);
        assert_eq!(update(behind.servo, from, 5, to), Code::Released);
        assert_eq!(
            trueaxis_tables_load(behind.tables, bytes, 20),
            Code::Damaged
        );
        assert_eq!(new(size, &mut made), Code::NotLoaded);
        assert_eq!(
            trueaxis_tables_load(behind.tables, bytes, blob.len()),
            Code::Ok
        );
        assert_eq!(new(size, &mut made), Code::Ok);
    }
}

#[test]
fn a_program_for_other_capacities_is_refused_before_anything_is_written() {
    let mut memory = Box::new(TablesMemory { words: [7; _] });
    let (place, size) = ((&raw mut *memory).cast(), size_of::<TablesMemory>());
    let mut made = null_mut();
    // SAFETY: the memory exists.
    unsafe {
        for (shift, code) in [
            (56, Code::HeaderVersion),
            (48, Code::HeaderAxes),
            (40, Code::HeaderBanks),
            (32, Code::HeaderTables),
            (16, Code::HeaderTerms),
            (0, Code::HeaderGrids),
        ] {
            let other = HEADER + (1 << shift);
            assert_eq!(trueaxis_tables_new(other, place, size, &mut made), code);
        }
    }
    assert!(made.is_null() && memory.words.iter().all(|word| *word == 7));
}

#[test]
fn tables_that_have_retired_are_not_lost_to_a_pointer_that_is_not_aligned() {
    let blob = blob("huron-13");
    let (behind, second) = (Behind::new(&blob), Behind::new(&blob));
    let first = behind.tables;
    let mut place = [null_mut(); 2];
    let retired = place.as_mut_ptr();
    // SAFETY: all memory exists.
    unsafe {
        assert_eq!(trueaxis_servo_release(second.servo), Code::Ok);
        let swap = |to, retired| trueaxis_servo_swap(behind.servo, to, retired);
        assert_eq!(swap(second.tables, retired), Code::Ok);
        for _ in 0..1000 {
            behind.update(&[0.0; 5], 0xFFFF);
        }
        // Nothing happens: the retired tables can still be taken, and the others stay in use.
        assert_eq!(swap(first, retired.byte_add(1)), Code::Memory);
        assert_eq!(trueaxis_servo_take_retired(behind.servo, retired), Code::Ok);
        assert_eq!(place[0], first);
        let bytes = blob.as_ptr().cast();
        let load = |to| trueaxis_tables_load(to, bytes, blob.len());
        assert_eq!(load(second.tables), Code::InUse);
        assert_eq!(load(first), Code::Ok);
        assert_eq!(trueaxis_servo_release(behind.servo), Code::Ok);
    }
}
