//! Two servos of the C interface over the same moves, one with tables and one with generated C.

use crate::{Moves, PERIODS, Random, same};
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
    let mut pair = Pair::new([Behind::new(tables, blob), Behind::new(code, blob)]);
    if !pair.have_equal_facts(name) {
        return false;
    }
    for k in 0..machine.auxiliaries.len() {
        pair.set_auxiliary(machine, k, 0.0);
    }
    let axes = machine.axes.len();
    let all = (1_u32 << axes) - 1;
    let mut random = Random(5);
    let mut moves = Moves::default();
    for period in 0..PERIODS {
        moves.advance(machine.axes, period, &mut random);
        let codes = pair.operate(machine, &mut random);
        let now = moves.shown(&mut random);
        let mask = if random.below(3000) == 0 { all >> 1 } else { all };
        if codes[0] != codes[1] || !pair.update(name, [&now, &moves.at], axes, mask) {
            println!("{name}: a servo with generated C in period {period}");
            return false;
        }
    }
    pair.swaps > 0 && pair.is_corrected
}

/// A servo with tables, and one with generated C.
struct Pair {
    both: [Behind; 2],
    adjustable: Vec<Adjustable>,
    swaps: usize,
    is_corrected: bool,
}

impl Pair {
    fn new(both: [Behind; 2]) -> Self {
        let mut adjustable = Vec::new();
        let mut term = Adjustable::default();
        while unsafe { trueaxis_tables_adjustable(both[0].tables, adjustable.len(), &mut term) } == Code::Ok {
            adjustable.push(term);
        }
        Self { both, adjustable, swaps: 0, is_corrected: false }
    }

    fn have_equal_facts(&self, name: &str) -> bool {
        let [tables, code] = self.both.each_ref().map(|servo| {
            let mut facts = MaybeUninit::uninit();
            must(unsafe { trueaxis_tables_facts(servo.tables, facts.as_mut_ptr()) });
            let facts = unsafe { facts.assume_init() };
            (facts.bytes, facts.checksum, facts.axes, facts.adjustable, facts.inputs_used)
        });
        if tables != code {
            println!("{name}: the facts of generated C are {code:?}, not {tables:?}");
        }
        tables == code
    }

    fn each(&self, call: impl Fn(*mut Servo) -> Code) -> [Code; 2] {
        self.both.each_ref().map(|behind| call(behind.servo))
    }

    /// Sets an auxiliary input to so much more than its reference.
    fn set_auxiliary(&self, machine: &Machine<'_>, k: usize, beyond: f32) -> [Code; 2] {
        let of = &machine.auxiliaries[k];
        let reference = match of.kind {
            AuxiliaryKind::ToolLength => of.reference,
            // The reference temperature is subtracted behind the interface.
            AuxiliaryKind::Temperature => of.reference * 2.0,
        };
        self.each(|servo| unsafe { trueaxis_servo_set_auxiliary(servo, k, f64::from(reference + beyond)) })
    }

    /// Mostly nothing, or something that an operator does.
    fn operate(&mut self, machine: &Machine<'_>, random: &mut Random) -> [Code; 2] {
        match random.below(4000) {
            0 => self.each(|servo| unsafe { trueaxis_servo_enable(servo, 0) }),
            1..8 => self.each(|servo| unsafe { trueaxis_servo_enable(servo, 1) }),
            8 => self.each(|servo| unsafe { trueaxis_servo_dry_run(servo, 1) }),
            9..12 => self.each(|servo| unsafe { trueaxis_servo_dry_run(servo, 0) }),
            12..20 if !self.adjustable.is_empty() => {
                let term = self.adjustable[random.below(self.adjustable.len() as u32) as usize];
                let value = f64::from(term.lower + (term.upper - term.lower) * random.part());
                self.each(|servo| unsafe { trueaxis_servo_set_weight(servo, term.term as usize, value) })
            }
            20..24 if !machine.auxiliaries.is_empty() => self.set_auxiliary(machine, 0, random.part() * 10.0),
            24 | 25 => {
                self.swaps += 1;
                self.both.each_mut().map(Behind::swap)
            }
            _ => [Code::Ok; 2],
        }
    }

    /// Whether both give the same corrections, conditions and commands, at the positions `now` with feedback `at`.
    fn update(&mut self, name: &str, [now, at]: [&[f32; 16]; 2], axes: usize, mask: u32) -> bool {
        let [tables, code] = self.both.each_ref().map(|behind| {
            let mut dq = [0.0_f32; 16];
            must(unsafe { trueaxis_servo_update_f32(behind.servo, now.as_ptr(), axes, mask, 0.001, dq.as_mut_ptr()) });
            let (from, mut commands) = (at.map(f64::from), [0.0_f64; 16]);
            let measured =
                unsafe { trueaxis_servo_measured(behind.servo, from.as_ptr(), axes, commands.as_mut_ptr()) };
            (dq, behind.status(), measured, commands)
        });
        self.is_corrected |= code.0.iter().any(|dq| *dq != 0.0);
        let alike = tables.0.iter().zip(&code.0).all(|(a, b)| same(*a, *b))
            && tables.1 == code.1
            && tables.2 == code.2
            && tables.3 == code.3;
        if !alike {
            println!("{name}: {:?}, not {:?}", code.0, tables.0);
        }
        alike
    }
}
