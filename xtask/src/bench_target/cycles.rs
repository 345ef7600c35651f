//! Cycles of a sequence of instructions according to the technical reference manual of the Cortex-M4: no wait states of
//! a flash or a bus. A model, not a measurement.
//!
//! Not counted: a cycle for an address computed by the previous instruction, contention between loads and instruction
//! fetch, IT instructions that take no cycle. Counted in full: instructions skipped by the condition of an IT.

use super::instruction::{Instruction, InstructionKind};
use std::collections::BTreeMap;

/// Cycles needed to refill the pipeline after a taken branch: 1 to 3 according to the manual.
const REFILL: u32 = 2;

/// Cost of a sequence.
#[derive(Clone, Default, PartialEq, Eq, Debug)]
pub struct Cost {
    pub instructions: u32,
    pub cycles: u32,
    /// Number of instructions of each kind, and their cycles.
    pub kinds: BTreeMap<InstructionKind, (u32, u32)>,
    /// Cycles spent waiting for a floating-point result.
    pub waits: u32,
    /// Cycles spent after taken branches.
    pub refills: u32,
}

/// Cost of `steps`, instructions with their addresses in the order of execution, until `end` is executed.
pub fn cost(steps: &[(u32, Instruction)], end: u32) -> Cost {
    let mut cost = Cost::default();
    let next = steps.iter().skip(1).map(|(address, _)| *address);
    let mut before: Option<Instruction> = None;
    for ((address, step), next) in steps.iter().zip(next.chain([end])) {
        let mut cycles = step.cycles;
        if let Some(before) = before {
            let free = before.loads & step.address == 0;
            if step.overlaps && before.lets_overlap && free {
                cycles -= 1;
            }
            if before.result & step.reads != 0 {
                cycles += 1;
                cost.waits += 1;
            }
        }
        if next != address + step.bytes {
            cycles += REFILL;
            cost.refills += REFILL;
        }
        let (count, sum) = cost.kinds.entry(step.kind).or_default();
        *count += 1;
        *sum += cycles;
        cost.instructions += 1;
        cost.cycles += cycles;
        before = Some(*step);
    }
    cost
}

#[cfg(test)]
mod tests {
    use super::{InstructionKind, cost};
    use crate::bench_target::instruction::Instruction;

    /// Consecutive encodings, starting at address 0.
    fn run(code: &[(u16, u16)]) -> super::Cost {
        let mut address = 0;
        let mut steps = Vec::new();
        for &(first, second) in code {
            let step = Instruction::decode(first, second).unwrap();
            steps.push((address, step));
            address += step.bytes;
        }
        cost(&steps, address)
    }

    const LOAD: (u16, u16) = (0x6808, 0); // ldr r0, [r1]
    const ADD: (u16, u16) = (0xEE30, 0x0A20); // vadd.f32 s0, s0, s1

    #[test]
    fn a_load_directly_behind_another_load_or_store_takes_one_cycle() {
        // ldr r2, [r1]; ldr r2, [r0]; str r3, [r1]; str r3, [r1, r2]; movs r3, #0
        let (other, depends) = ((0x680A, 0), (0x6802, 0));
        let (store, indexed, data) = ((0x600B, 0), (0x508B, 0), (0x2300, 0));
        for (code, cycles) in [
            (vec![LOAD], 2),
            (vec![LOAD, other, other], 4),
            (vec![LOAD, depends], 4),
            (vec![LOAD, data, other], 5),
            (vec![store, LOAD], 2),
            (vec![LOAD, store], 3),
            (vec![indexed, LOAD], 4),
            (vec![LOAD, indexed], 3),
        ] {
            assert_eq!(run(&code).cycles, cycles, "{code:04x?}");
        }
    }

    #[test]
    fn who_uses_a_floating_point_result_at_once_waits_a_cycle() {
        // vmul.f32 s2, s3, s4; vstr s0, [r1]; vmov r0, s1
        let (other, store, unrelated) = ((0xEE21, 0x1A82), (0xED81, 0x0A00), (0xEE10, 0x0A90));
        assert_eq!((run(&[ADD, ADD]).cycles, run(&[ADD, ADD]).waits), (3, 1));
        assert_eq!(run(&[ADD, other, ADD]).cycles, 3);
        assert_eq!(run(&[ADD, store]).cycles, 4);
        assert_eq!(run(&[ADD, unrelated]).cycles, 2);
    }

    #[test]
    fn a_branch_that_is_taken_fills_the_pipeline_anew() {
        let branch = Instruction::decode(0xD1FE, 0).unwrap();
        let taken = cost(&[(8, branch)], 8);
        let passed = cost(&[(8, branch)], 10);
        assert_eq!((taken.cycles, taken.refills), (3, 2));
        assert_eq!((passed.cycles, passed.refills), (1, 0));
    }

    #[test]
    fn each_kind_has_its_share() {
        let cost = run(&[LOAD, ADD, ADD]);
        assert_eq!((cost.instructions, cost.cycles), (3, 5));
        assert_eq!(cost.kinds[&InstructionKind::Load], (1, 2));
        assert_eq!(cost.kinds[&InstructionKind::FloatArithmetic], (2, 3));
    }
}
