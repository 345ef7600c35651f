//! Instructions of the Cortex-M4F as far as needed for timing: kind, cycles, relevant registers (encodings: Arm v7-M
//! architecture reference manual, A5 and A7; cycles: technical reference manual of the Cortex-M4, instruction set
//! summary and floating-point unit).

/// Kind of an instruction, for a table of costs.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum InstructionKind {
    Data,
    Load,
    Store,
    Several,
    Branch,
    FloatLoad,
    FloatStore,
    FloatSeveral,
    FloatArithmetic,
    FloatMove,
}

impl InstructionKind {
    pub const ALL: [Self; 10] = [
        Self::Data,
        Self::Load,
        Self::Store,
        Self::Several,
        Self::Branch,
        Self::FloatLoad,
        Self::FloatStore,
        Self::FloatSeveral,
        Self::FloatArithmetic,
        Self::FloatMove,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Data => "data processing, compare, IT",
            Self::Load => "LDR",
            Self::Store => "STR",
            Self::Several => "LDM, STM, LDRD, STRD, PUSH, POP",
            Self::Branch => "branches",
            Self::FloatLoad => "VLDR",
            Self::FloatStore => "VSTR",
            Self::FloatSeveral => "VLDM, VSTM, VPUSH, VPOP",
            Self::FloatArithmetic => "floating-point arithmetic, conversion",
            Self::FloatMove => "VMOV, VCMP, VABS, VNEG, VMRS",
        }
    }
}

/// One instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Instruction {
    /// Length in bytes.
    pub bytes: u32,
    pub kind: InstructionKind,
    /// Cycles without the effects of neighbouring instructions.
    pub cycles: u32,
    /// Takes one cycle less directly after a load or store that permits it.
    pub overlaps: bool,
    /// Permits the following load or store to overlap.
    pub lets_overlap: bool,
    /// Core registers that it loads, one bit each.
    pub loads: u16,
    /// Core registers used for its address.
    pub address: u16,
    /// Floating-point registers written by arithmetic: the next user waits.
    pub result: u32,
    /// Floating-point registers that it reads.
    pub reads: u32,
}

/// Cycles of UDIV and SDIV, 2 to 12 depending on the operands: the maximum.
const DIVIDE: u32 = 12;

impl Instruction {
    fn new(bytes: u32, kind: InstructionKind, cycles: u32) -> Self {
        Self {
            bytes,
            kind,
            cycles,
            overlaps: false,
            lets_overlap: false,
            loads: 0,
            address: 0,
            result: 0,
            reads: 0,
        }
    }

    /// Decodes the first halfword and the next one; `None` if no timing is known.
    pub fn decode(first: u16, second: u16) -> Option<Self> {
        if first >> 11 < 0b11101 {
            narrow(first)
        } else {
            wide(first, second)
        }
    }

    /// A load or store of one core register, `offset` by an immediate or, with its bit, a register.
    fn single(bytes: u32, loads: Option<u32>, base: u16, offset: u16) -> Self {
        let (kind, cycles) = match (loads, offset) {
            (Some(_), _) => (InstructionKind::Load, 2),
            (None, 0) => (InstructionKind::Store, 1),
            (None, _) => (InstructionKind::Store, 2),
        };
        Self {
            overlaps: cycles == 2,
            lets_overlap: loads.is_some() || offset == 0,
            loads: loads.map_or(0, |register| 1 << register),
            address: base | offset,
            ..Self::new(bytes, kind, cycles)
        }
    }
}

fn narrow(word: u16) -> Option<Instruction> {
    let field = |shift: u32| 1_u16 << (word >> shift & 7);
    let register = |shift: u32| u32::from(word >> shift & 7);
    let list = u32::from(word & 0xFF).count_ones() + u32::from(word >> 8 & 1);
    let single = Instruction::single;
    let new = |kind, cycles| Instruction::new(2, kind, cycles);
    Some(match word >> 12 {
        4 if word & 0x0800 != 0 => single(2, Some(register(8)), 0, 0),
        4 if word & 0x0F00 == 0x0700 => new(InstructionKind::Branch, 1),
        5 => {
            // STR, STRH and STRB come first.
            let load = (word >> 9 & 7 > 2).then(|| register(0));
            single(2, load, field(3), field(6))
        }
        6..=8 => single(2, (word & 0x0800 != 0).then(|| register(0)), field(3), 0),
        9 => single(2, (word & 0x0800 != 0).then(|| register(8)), 1 << 13, 0),
        // CBZ and CBNZ; PUSH and POP; BKPT.
        0xB if word & 0x0500 == 0x0100 => new(InstructionKind::Branch, 1),
        0xB if word & 0x0600 == 0x0400 => new(InstructionKind::Several, 1 + list),
        0xB if word & 0x0F00 == 0x0E00 => return None,
        0xC => new(
            InstructionKind::Several,
            1 + u32::from(word & 0xFF).count_ones(),
        ),
        // Without UDF and SVC.
        0xD if word & 0x0E00 != 0x0E00 => new(InstructionKind::Branch, 1),
        0xD => return None,
        0xE => new(InstructionKind::Branch, 1),
        _ => new(InstructionKind::Data, 1),
    })
}

fn wide(first: u16, second: u16) -> Option<Instruction> {
    let new = |kind, cycles| Instruction::new(4, kind, cycles);
    let top = u32::from(second >> 12);
    Some(match first >> 9 & 0x3F {
        // 0xE8, 0xE9
        0b110100 => match first & 0x0040 {
            0 => new(InstructionKind::Several, 1 + second.count_ones()),
            _ if first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000 => {
                new(InstructionKind::Branch, 2)
            }
            // Exclusive ones: no P, no W.
            _ if first & 0x0120 == 0 => new(InstructionKind::Load, 2),
            _ => new(InstructionKind::Several, 3),
        },
        // 0xEA, 0xEB
        0b110101 => new(InstructionKind::Data, 1),
        0b110110 | 0b110111 => return float(first, second),
        // 0xF0 to 0xF7
        0b111000..=0b111011 if second & 0x8000 == 0 => new(InstructionKind::Data, 1),
        0b111000..=0b111011 => {
            // MSR, hints, barriers, MRS have the conditions 14 and 15 of a branch.
            let other = second & 0x5000 == 0 && first & 0x0380 == 0x0380;
            new(
                if other {
                    InstructionKind::Data
                } else {
                    InstructionKind::Branch
                },
                1,
            )
        }
        // 0xF8, 0xF9
        0b111100 => {
            let load = (first & 0x0010 != 0).then_some(top);
            let base = 1 << (first & 15);
            let by_register = first & 0x0080 == 0 && second & 0x0FC0 == 0 && first & 15 != 15;
            let offset = if by_register { 1 << (second & 15) } else { 0 };
            let mut single = Instruction::single(4, load, base, offset);
            // With a base that is changed: not pipelined.
            if first & 0x0080 == 0 && second & 0x0900 == 0x0900 && first & 15 != 15 {
                single.overlaps = false;
            }
            single
        }
        // 0xFA; 0xFB: multiplications, long ones, divisions
        0b111101 if first & 0x0100 == 0 => new(InstructionKind::Data, 1),
        0b111101 => match (first >> 4 & 15, second >> 4 & 15) {
            (9 | 11, 15) => new(InstructionKind::Data, DIVIDE),
            // With an accumulator: MLA, MLS.
            (0, _) if top != 15 => new(InstructionKind::Data, 2),
            _ => new(InstructionKind::Data, 1),
        },
        _ => return None,
    })
}

/// `count` floating-point registers from `number` on.
fn floats(number: u32, count: u32) -> u32 {
    let ones = 1_u64.checked_shl(count).map_or(u64::MAX, |bit| bit - 1);
    (ones << number) as u32
}

fn float(first: u16, second: u16) -> Option<Instruction> {
    if second & 0x0E00 != 0x0A00 {
        return None;
    }
    let (f, s) = (u32::from(first), u32::from(second));
    let double = s & 0x0100 != 0;
    let new = |kind, cycles| Instruction::new(4, kind, cycles);
    // Numbers of single registers have their low bit in a separate place.
    let d = if double {
        2 * (s >> 12 | (f >> 6 & 1) << 4)
    } else {
        (s >> 12) << 1 | f >> 6 & 1
    };
    let n = (f & 15) << 1 | s >> 7 & 1;
    let m = (s & 15) << 1 | s >> 5 & 1;
    if f & 0xFE00 == 0xEC00 {
        let load = f & 0x0010 != 0;
        let mut found = if f & 0xFFE0 == 0xEC40 {
            // Two core registers, and a double or two singles.
            let read = if load {
                floats(m & !u32::from(double), 2)
            } else {
                0
            };
            return Some(Instruction {
                reads: read,
                ..new(InstructionKind::FloatMove, 2)
            });
        } else if f & 0x0120 == 0x0100 {
            let words = if double { 2 } else { 1 };
            let kind = if load {
                InstructionKind::FloatLoad
            } else {
                InstructionKind::FloatStore
            };
            let stored = if load { 0 } else { floats(d, words) };
            Instruction {
                reads: stored,
                ..new(kind, 1 + words)
            }
        } else {
            let words = s & 0xFF;
            let stored = if load { 0 } else { floats(d, words) };
            Instruction {
                reads: stored,
                ..new(InstructionKind::FloatSeveral, 1 + words)
            }
        };
        found.address = 1 << (first & 15);
        return Some(found);
    }
    if f & 0xFF00 != 0xEE00 || double {
        return None;
    }
    if s & 0x0010 != 0 {
        // One core register; or VMRS, VMSR.
        let from_float = f & 0x00F0 == 0x0010;
        let reads = if from_float { floats(n, 1) } else { 0 };
        return Some(Instruction {
            reads,
            ..new(InstructionKind::FloatMove, 1)
        });
    }
    let arithmetic = |cycles, reads| Instruction {
        result: floats(d, 1),
        reads,
        ..new(InstructionKind::FloatArithmetic, cycles)
    };
    let moves = |reads| Instruction {
        reads,
        ..new(InstructionKind::FloatMove, 1)
    };
    let both = floats(n, 1) | floats(m, 1);
    Some(match f >> 4 & 0b1011 {
        0b0000 | 0b0001 | 0b1001 | 0b1010 => arithmetic(3, both | floats(d, 1)),
        0b0010 | 0b0011 => arithmetic(1, both),
        0b1000 => arithmetic(14, both),
        _ if s & 0x0040 == 0 => moves(0),
        _ => match (f & 15, s >> 7 & 1) {
            (0, _) | (1, 0) => moves(floats(m, 1)),
            (1, _) => arithmetic(14, floats(m, 1)),
            (4, _) => moves(floats(d, 1) | floats(m, 1)),
            (5, _) => moves(floats(d, 1)),
            (2 | 3 | 8 | 10..=15, _) => arithmetic(1, floats(m, 1)),
            _ => return None,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::{Instruction, InstructionKind};

    /// Kind and cycles of an encoding.
    fn of(first: u16, second: u16) -> Option<(InstructionKind, u32)> {
        Instruction::decode(first, second).map(|i| (i.kind, i.cycles))
    }

    /// Encodings as produced by GNU as.
    #[test]
    fn integer_instructions_have_the_cycles_of_the_manual() {
        for (encoding, expected) in [
            ([0x1840, 0], (InstructionKind::Data, 1)), // adds r0, r0, r1
            ([0xBF18, 0], (InstructionKind::Data, 1)), // it ne
            ([0xEB00, 0x0081], (InstructionKind::Data, 1)), // add.w r0, r0, r1, lsl #2
            ([0xF3C0, 0x0107], (InstructionKind::Data, 1)), // ubfx r1, r0, #0, #8
            ([0xF3EF, 0x8000], (InstructionKind::Data, 1)), // mrs r0, apsr
            ([0xFB00, 0xF101], (InstructionKind::Data, 1)), // mul r1, r0, r1
            ([0xFB00, 0x2101], (InstructionKind::Data, 2)), // mla r1, r0, r1, r2
            ([0xFB00, 0x2111], (InstructionKind::Data, 2)), // mls r1, r0, r1, r2
            ([0xFBA0, 0x2301], (InstructionKind::Data, 1)), // umull r2, r3, r0, r1
            ([0xFBB0, 0xF0F1], (InstructionKind::Data, 12)), // udiv r0, r0, r1
            ([0x6808, 0], (InstructionKind::Load, 2)), // ldr r0, [r1]
            ([0x6008, 0], (InstructionKind::Store, 1)), // str r0, [r1]
            ([0x5088, 0], (InstructionKind::Store, 2)), // str r0, [r1, r2]
            ([0x7808, 0], (InstructionKind::Load, 2)), // ldrb r0, [r1]
            ([0x4801, 0], (InstructionKind::Load, 2)), // ldr r0, [pc, #4]
            ([0x9801, 0], (InstructionKind::Load, 2)), // ldr r0, [sp, #4]
            ([0xF8D1, 0x0100], (InstructionKind::Load, 2)), // ldr.w r0, [r1, #256]
            ([0xE9D0, 0x1200], (InstructionKind::Several, 3)), // ldrd r1, r2, [r0]
            ([0xC807, 0], (InstructionKind::Several, 4)), // ldmia r0!, {r0, r1, r2}
            ([0xB5F0, 0], (InstructionKind::Several, 6)), // push {r4-r7, lr}
            ([0xE92D, 0x4FF0], (InstructionKind::Several, 10)), // push.w {r4-r11, lr}
            ([0xBDF0, 0], (InstructionKind::Several, 6)), // pop {r4-r7, pc}
            ([0xE7FE, 0], (InstructionKind::Branch, 1)), // b .
            ([0xD1FE, 0], (InstructionKind::Branch, 1)), // bne .
            ([0xB108, 0], (InstructionKind::Branch, 1)), // cbz r0, .+6
            ([0x4770, 0], (InstructionKind::Branch, 1)), // bx lr
            ([0xF7FF, 0xFFFE], (InstructionKind::Branch, 1)), // bl .
            ([0xF47F, 0xAFFE], (InstructionKind::Branch, 1)), // bne.w .
            ([0xE8DF, 0xF000], (InstructionKind::Branch, 2)), // tbb [pc, r0]
        ] {
            assert_eq!(
                of(encoding[0], encoding[1]),
                Some(expected),
                "{encoding:04x?}"
            );
        }
        // bkpt 0xab, svc 0, udf 0
        for word in [0xBEAB, 0xDF00, 0xDE00] {
            assert_eq!(of(word, 0), None);
        }
    }

    #[test]
    fn floating_point_instructions_have_the_cycles_of_the_manual() {
        for (encoding, expected) in [
            ([0xED91, 0x0A02], (InstructionKind::FloatLoad, 2)), // vldr s0, [r1, #8]
            ([0xED81, 0x0A02], (InstructionKind::FloatStore, 2)), // vstr s0, [r1, #8]
            ([0xED91, 0x0B02], (InstructionKind::FloatLoad, 3)), // vldr d0, [r1, #8]
            ([0xEC91, 0x0A04], (InstructionKind::FloatSeveral, 5)), // vldmia r1, {s0-s3}
            ([0xED2D, 0x8B04], (InstructionKind::FloatSeveral, 5)), // vpush {d8-d9}
            ([0xEE30, 0x0A20], (InstructionKind::FloatArithmetic, 1)), // vadd.f32 s0, s0, s1
            ([0xEE20, 0x0A20], (InstructionKind::FloatArithmetic, 1)), // vmul.f32 s0, s0, s1
            ([0xEE00, 0x0A81], (InstructionKind::FloatArithmetic, 3)), // vmla.f32 s0, s1, s2
            ([0xEE80, 0x0A20], (InstructionKind::FloatArithmetic, 14)), // vdiv.f32 s0, s0, s1
            ([0xEEB1, 0x0AC0], (InstructionKind::FloatArithmetic, 14)), // vsqrt.f32 s0, s0
            ([0xEEB8, 0x0AC0], (InstructionKind::FloatArithmetic, 1)), // vcvt.f32.s32 s0, s0
            ([0xEEBD, 0x0AC0], (InstructionKind::FloatArithmetic, 1)), // vcvt.s32.f32 s0, s0
            ([0xEEB4, 0x0A60], (InstructionKind::FloatMove, 1)), // vcmp.f32 s0, s1
            ([0xEEB0, 0x0AE0], (InstructionKind::FloatMove, 1)), // vabs.f32 s0, s1
            ([0xEEB7, 0x0A00], (InstructionKind::FloatMove, 1)), // vmov.f32 s0, #1
            ([0xEEF1, 0xFA10], (InstructionKind::FloatMove, 1)), // vmrs APSR_nzcv, fpscr
            ([0xEE10, 0x0A90], (InstructionKind::FloatMove, 1)), // vmov r0, s1
            ([0xEC51, 0x0A10], (InstructionKind::FloatMove, 2)), // vmov r0, r1, s0, s1
        ] {
            assert_eq!(
                of(encoding[0], encoding[1]),
                Some(expected),
                "{encoding:04x?}"
            );
        }
        // vadd.f64 d0, d0, d1: does not exist on a Cortex-M4F.
        assert_eq!(of(0xEE30, 0x0B01), None);
    }

    #[test]
    fn registers_that_make_others_wait_are_found() {
        let decode = |first, second| Instruction::decode(first, second).unwrap();
        // vadd.f32 s3, s0, s1; vstr s3, [r1]; vmov r0, s1; vcmp.f32 s0, s1; vstmia r1, {s1-s3}
        let add = decode(0xEE70, 0x1A20);
        assert_eq!((add.result, add.reads), (0b1000, 0b11));
        assert_eq!(decode(0xEDC1, 0x1A00).reads, 0b1000);
        assert_eq!(decode(0xEE10, 0x0A90).reads, 0b10);
        assert_eq!(decode(0xEEB4, 0x0A60).reads, 0b11);
        assert_eq!(decode(0xECC1, 0x0A03).reads, 0b1110);
        // ldr r0, [r1]; ldr r2, [r0, r3]
        assert_eq!(decode(0x6808, 0).loads, 0b1);
        assert_eq!(decode(0x58C2, 0).address, 0b1001);
    }
}
