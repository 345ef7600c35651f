//! Two servos of the C interface over the same moves, one with tables and one with generated C.

use crate::{Random, same};
use std::mem::MaybeUninit;
use std::ptr::null_mut;
use trueaxis::{Auxiliary, AuxiliaryKind, Axis};
use trueaxis_capi::border::*;
use trueaxis_capi::{
    Adjustable, Code, Generated, Servo, ServoMemory, StatusFacts, TRUEAXIS_HEADER, Tables, TablesMemory,
};

/// What the moves depend on.
pub struct Machine<'a> {
    pub axes: &'a [Axis],
    pub auxiliaries: &'a [Auxiliary],
}

/// A servo, what it holds, and other tables of the same machine.
struct Behind {
    servo: *mut Servo,
    tables: *mut Tables,
    others: *mut Tables,
}

impl Behind {
    /// The memory is never freed.
    fn new(load: impl FnOnce(*mut Tables) -> Code, blob: &[u8]) -> Self {
        let memory = || Box::into_raw(Box::<TablesMemory>::new_uninit());
        let servo_memory: *mut MaybeUninit<ServoMemory> = Box::into_raw(Box::new_uninit());
        let (mut tables, mut others, mut servo) = (null_mut(), null_mut(), null_mut());
        let (size, servo_size) = (size_of::<TablesMemory>(), size_of::<ServoMemory>());
        for made in [&mut tables, &mut others] {
            must(unsafe { trueaxis_tables_new(TRUEAXIS_HEADER, memory().cast(), size, made) });
        }
        must(load(tables));
        must(unsafe { trueaxis_tables_load(others, blob.as_ptr().cast(), blob.len()) });
        must(unsafe { trueaxis_servo_new(servo_memory.cast(), servo_size, tables, &mut servo) });
        Self { servo, tables, others }
    }

    /// Takes the other tables.
    fn swap(&mut self) -> Code {
        let mut retired = null_mut();
        let code = unsafe { trueaxis_servo_swap(self.servo, self.others, &mut retired) };
        if code == Code::Ok {
            std::mem::swap(&mut self.tables, &mut self.others);
        }
        code
    }

    fn status(&self) -> StatusFacts {
        let mut status = StatusFacts::default();
        must(unsafe { trueaxis_servo_status(self.servo, &mut status) });
        status
    }
}

fn must(code: Code) {
    assert_eq!(code, Code::Ok);
}

/// Every correction, condition and result.
pub fn compare(name: &str, machine: &Machine<'_>, blob: &[u8], generated: &Generated) -> bool {
    let tables = |to| unsafe { trueaxis_tables_load(to, blob.as_ptr().cast(), blob.len()) };
    let code = |to| unsafe { trueaxis_tables_load_generated(to, generated) };
    let mut both = [Behind::new(tables, blob), Behind::new(code, blob)];
    let facts = both.each_ref().map(|servo| {
        let mut facts = MaybeUninit::uninit();
        must(unsafe { trueaxis_tables_facts(servo.tables, facts.as_mut_ptr()) });
        let facts = unsafe { facts.assume_init() };
        (facts.bytes, facts.checksum, facts.axes, facts.adjustable, facts.inputs_used)
    });
    if facts[0] != facts[1] {
        println!("{name}: the facts of generated C are {:?}, not {:?}", facts[1], facts[0]);
        return false;
    }
    let mut adjustable = Vec::new();
    let mut term = Adjustable::default();
    while unsafe { trueaxis_tables_adjustable(both[0].tables, adjustable.len(), &mut term) } == Code::Ok {
        adjustable.push(term);
    }
    let servos = both.each_ref().map(|behind| behind.servo);
    let each = |call: &dyn Fn(*mut Servo) -> Code| servos.map(call);
    let auxiliary = |k: usize, beyond: f32| {
        let of = &machine.auxiliaries[k];
        let reference = match of.kind {
            AuxiliaryKind::ToolLength => of.reference,
            // The reference temperature is subtracted behind the interface.
            AuxiliaryKind::Temperature => of.reference * 2.0,
        };
        each(&|servo| unsafe { trueaxis_servo_set_auxiliary(servo, k, f64::from(reference + beyond)) })
    };
    for k in 0..machine.auxiliaries.len() {
        auxiliary(k, 0.0);
    }
    let axes = machine.axes.len();
    let all = (1_u32 << axes) - 1;
    let mut random = Random(5);
    let (mut at, mut speed) = ([0.0_f32; 16], [0.0_f32; 16]);
    let mut swaps = 0;
    let mut is_corrected = false;
    for period in 0..200_000_u32 {
        if period % 977 == 0 {
            for (axis, speed) in machine.axes.iter().zip(&mut speed) {
                let range = axis.travel[1].min(1e3) - axis.travel[0].max(-1e3);
                *speed = (random.part() - 0.5) * range * 1e-3;
            }
        }
        for ((axis, speed), q) in machine.axes.iter().zip(&speed).zip(&mut at) {
            *q = (*q + speed).clamp(axis.travel[0].max(-1e4), axis.travel[1].min(1e4));
        }
        let codes = match random.below(4000) {
            0 => each(&|servo| unsafe { trueaxis_servo_enable(servo, 0) }),
            1..8 => each(&|servo| unsafe { trueaxis_servo_enable(servo, 1) }),
            8 => each(&|servo| unsafe { trueaxis_servo_dry_run(servo, 1) }),
            9..12 => each(&|servo| unsafe { trueaxis_servo_dry_run(servo, 0) }),
            12..20 if !adjustable.is_empty() => {
                let term = adjustable[random.below(adjustable.len() as u32) as usize];
                let value = f64::from(term.lower + (term.upper - term.lower) * random.part());
                each(&|servo| unsafe { trueaxis_servo_set_weight(servo, term.term as usize, value) })
            }
            20..24 if !machine.auxiliaries.is_empty() => auxiliary(0, random.part() * 10.0),
            24 | 25 => {
                swaps += 1;
                both.each_mut().map(Behind::swap)
            }
            _ => [Code::Ok; 2],
        };
        let mut now = at;
        if random.below(5000) == 0 {
            now[0] = f32::NAN;
        }
        let mask = if random.below(3000) == 0 { all >> 1 } else { all };
        let mut dq = [[0.0_f32; 16]; 2];
        for (servo, dq) in servos.iter().zip(&mut dq) {
            must(unsafe { trueaxis_servo_update_f32(*servo, now.as_ptr(), axes, mask, 0.001, dq.as_mut_ptr()) });
        }
        let mut commands = [[0.0_f64; 16]; 2];
        let measured = [0, 1].map(|k| {
            let from = at.map(f64::from);
            unsafe { trueaxis_servo_measured(servos[k], from.as_ptr(), axes, commands[k].as_mut_ptr()) }
        });
        let alike = codes[0] == codes[1]
            && dq[0].iter().zip(&dq[1]).all(|(a, b)| same(*a, *b))
            && both[0].status() == both[1].status()
            && measured[0] == measured[1]
            && commands[0] == commands[1];
        is_corrected |= dq[1].iter().any(|dq| *dq != 0.0);
        if !alike {
            println!("{name}: a servo with generated C in period {period}: {:?}, not {:?}", dq[1], dq[0]);
            return false;
        }
    }
    swaps > 0 && is_corrected
}
