//! Linked programs for the Cortex-M: their size, and their call graph.

use object::elf::SHF_ALLOC;
use object::read::Bytes;
use object::read::elf::{ElfFile32, SectionHeader};
use object::{LittleEndian, Object, ObjectSection, ObjectSymbol, SymbolKind, U32};
use programs::files;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A program: ELF, 32 bits, little-endian.
pub struct ElfProgram {
    sections: Vec<Section>,
    /// By address, without the Thumb bit.
    functions: BTreeMap<u32, ElfFunction>,
    /// From each address on: code (true) or data within code.
    map: BTreeMap<u32, bool>,
}

struct Section {
    name: String,
    address: u32,
    /// Empty if the section is all zeros.
    bytes: Vec<u8>,
    /// Has an address in the program.
    allocated: bool,
}

struct ElfFunction {
    name: String,
    size: u32,
}

/// The reachable part of a program.
#[derive(Default)]
pub struct CallReach {
    /// All functions, each with the one from which it was reached.
    functions: BTreeMap<String, Option<String>>,
    /// Names of functions that call through a pointer, whose targets are unknown.
    through_pointers: BTreeSet<String>,
    /// Size of all functions in bytes.
    pub size: u32,
}

impl CallReach {
    /// Without the calls through pointers in functions whose name contains this.
    pub fn may_call_through_a_pointer(mut self, function: &str) -> Self {
        self.through_pointers.retain(|f| !f.contains(function));
        self
    }

    /// Violations reachable from the function `root`, which must not occur in a servo loop: a panic, or a call through
    /// a pointer, which this check cannot follow.
    pub fn faults(&self, root: &str) -> Vec<String> {
        let panics = self.functions.iter().filter(|(f, _)| f.contains("panic"));
        let panics = panics.map(|(function, from)| {
            let from = from.as_deref().unwrap_or_default();
            format!("{root} can panic: {from} calls {function}")
        });
        let pointers = self.through_pointers.iter();
        let pointers = pointers.map(|f| format!("{root} calls through a pointer in {f}"));
        panics.chain(pointers).collect()
    }
}

impl ElfProgram {
    /// # Errors
    /// If the file cannot be read or is not such a program.
    pub fn read(path: &Path) -> Result<Self, String> {
        let bytes = files::read(path)?;
        let failed = |e| format!("{}: not a 32-bit little-endian ELF: {e}", path.display());
        Self::parse(&bytes).map_err(failed)
    }

    fn parse(bytes: &[u8]) -> object::Result<Self> {
        let file = ElfFile32::<LittleEndian>::parse(bytes)?;
        let mut program = Self {
            sections: Vec::new(),
            functions: BTreeMap::new(),
            map: BTreeMap::new(),
        };
        for section in file.sections() {
            let flags = section.elf_section_header().sh_flags(LittleEndian);
            program.sections.push(Section {
                name: section.name()?.to_owned(),
                address: section.address() as u32,
                bytes: section.data()?.to_vec(),
                allocated: flags.contains(SHF_ALLOC),
            });
        }
        for symbol in file.symbols() {
            let (name, address) = (symbol.name()?, symbol.address() as u32);
            match name {
                "$t" | "$d" => drop(program.map.insert(address, name == "$t")),
                _ if symbol.kind() == SymbolKind::Text => {
                    let (name, size) = (name.to_owned(), symbol.size() as u32);
                    let function = ElfFunction { name, size };
                    program.functions.insert(address & !1, function);
                }
                _ => {}
            }
        }
        Ok(program)
    }

    /// Size of the sections stored in flash, bytes.
    pub fn flash(&self) -> u32 {
        let stored = self.sections.iter().filter(|s| s.allocated);
        stored.map(|s| s.bytes.len() as u32).sum()
    }

    /// Size of its functions, bytes.
    pub fn code_size(&self) -> u32 {
        let code = self.sections.iter().filter(|s| s.name == ".text");
        code.map(|s| s.bytes.len() as u32).sum()
    }

    /// Stack size of each function, where known (`-Zemit-stack-sizes`), bytes.
    pub fn frames(&self) -> Vec<(String, u64)> {
        let mut found = Vec::new();
        for section in self.sections.iter().filter(|s| s.name == ".stack_sizes") {
            let mut entries = Bytes(&section.bytes);
            while let Ok(address) = entries.read::<U32<LittleEndian>>()
                && let Ok(bytes) = entries.read_uleb128()
            {
                if let Some(function) = self.functions.get(&(address.get(LittleEndian) & !1)) {
                    found.push((function.name.clone(), bytes));
                }
            }
        }
        found
    }

    /// Everything reachable by calls and jumps from functions whose name contains `root`.
    ///
    /// # Errors
    /// If there is no such function, or its code cannot be read.
    pub fn reach(&self, root: &str) -> Result<CallReach, String> {
        self.reach_where(root, |name| name.contains(root))
    }

    /// Like [`reach`](Self::reach), for the function with exactly this name.
    ///
    /// # Errors
    /// If there is no such function, or its code cannot be read.
    pub fn reach_from(&self, root: &str) -> Result<CallReach, String> {
        self.reach_where(root, |name| name == root)
    }

    fn reach_where(&self, root: &str, is_root: impl Fn(&str) -> bool) -> Result<CallReach, String> {
        let roots = self.functions.iter().filter(|(_, f)| is_root(&f.name));
        let mut open: Vec<(u32, Option<String>)> = roots.map(|(&at, _)| (at, None)).collect();
        if open.is_empty() {
            return Err(format!("the program has no function `{root}`"));
        }
        let mut seen = BTreeSet::new();
        let mut reach = CallReach::default();
        while let Some((address, from)) = open.pop() {
            if !seen.insert(address) {
                continue;
            }
            let function = &self.functions[&address];
            reach.functions.insert(function.name.clone(), from);
            reach.size += function.size;
            let (targets, pointers) = self
                .calls(address, function.size)
                .ok_or_else(|| format!("the code of `{}` cannot be read", function.name))?;
            let from = |target| (target, Some(function.name.clone()));
            open.extend(targets.into_iter().map(from));
            if pointers {
                reach.through_pointers.insert(function.name.clone());
            }
        }
        Ok(reach)
    }

    /// The halfword of code at an address, and the next one (0 at the end of a section).
    fn code(&self, address: u32) -> Option<(u16, u16)> {
        let mut after = self.sections.iter().filter_map(|section| {
            let offset = address.checked_sub(section.address)? as usize;
            section.bytes.get(offset..).filter(|_| section.allocated)
        });
        let (first, after) = after.find_map(|bytes| bytes.split_first_chunk())?;
        let second = after.first_chunk().copied().unwrap_or_default();
        Some((u16::from_le_bytes(*first), u16::from_le_bytes(second)))
    }

    /// Functions outside `start..start + size` that the code there calls or jumps to, and whether it calls through
    /// pointers.
    fn calls(&self, start: u32, size: u32) -> Option<(Vec<u32>, bool)> {
        let mut targets = Vec::new();
        let mut pointers = false;
        let mut at = start;
        while at < start + size {
            let before = self.map.range(..=at).next_back();
            if before.is_some_and(|(_, code)| !code) {
                at += 2;
                continue;
            }
            let (first, second) = self.code(at)?;
            // `blx register`; `bx` to anything but the return address.
            pointers |= first & 0xFF87 == 0x4780;
            pointers |= first & 0xFF87 == 0x4700 && first != 0x4770;
            if first >> 11 < 0b11101 {
                at += 2;
                continue;
            }
            if let Some(distance) = branch(first, second) {
                let target = at.wrapping_add(4).wrapping_add_signed(distance);
                if !(start..start + size).contains(&target) {
                    // Includes jumps into the middle of a function.
                    let (&function, _) = self.functions.range(..=target).next_back()?;
                    targets.push(function);
                }
            }
            at += 4;
        }
        Some((targets, pointers))
    }
}

/// Jump distance of `bl`, `b.w` and conditional `b.w`, relative to 4 bytes after their address (Arm v7-M reference
/// manual, A7.7.12 and A7.7.18); `None` for other instructions.
fn branch(first: u16, second: u16) -> Option<i32> {
    let (first, second) = (i32::from(first), i32::from(second));
    if first & 0xF800 != 0xF000 || second & 0x8000 == 0 {
        return None;
    }
    let s = first >> 10 & 1;
    let (j1, j2) = (second >> 13 & 1, second >> 11 & 1);
    let low = (second & 0x7FF) << 1;
    if second & 0x5000 == 0x5000 || second & 0x5000 == 0x1000 {
        // `bl`, `b.w`: 25 bits.
        let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
        let high = (first & 0x3FF) << 12;
        return Some(-(s << 24) | i1 << 23 | i2 << 22 | high | low);
    }
    // Conditions 14 and 15 are other instructions.
    let condition = first >> 6 & 15;
    if second & 0x5000 == 0 && condition < 14 {
        let high = (first & 0x3F) << 12;
        return Some(-(s << 20) | j2 << 19 | j1 << 18 | high | low);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Code and data starting at address 0, and the frame of the function at 0.
    fn program() -> ElfProgram {
        let halfwords = [
            // 0: bl .+12, to `called`; bx lr; data that would be `bl .+12` to `unused`
            0xF000, 0xF804, 0x4770, 0xF000, 0xF804, 0x4770, //
            // 12, `called`: blx r3; b.n .-2; bne.w .+6, into the middle of `panics`
            0x4798, 0xE7FD, 0xF040, 0x8001, //
            // 20, `panics`, and 24, `unused`: bx lr
            0x4770, 0x4770, 0x4770_u16,
        ];
        let bytes: Vec<u8> = halfwords.into_iter().flat_map(u16::to_le_bytes).collect();
        let section = |name: &str, bytes: &[u8], allocated| Section {
            name: name.to_owned(),
            address: 0,
            bytes: bytes.to_vec(),
            allocated,
        };
        let functions = [
            (0, "root", 12),
            (12, "called", 8),
            (20, "panics", 4),
            (24, "unused", 2),
        ];
        let function = |(address, name, size): (u32, &str, u32)| {
            let name = name.to_owned();
            (address, ElfFunction { name, size })
        };
        ElfProgram {
            // 300 bytes of stack, in LEB128.
            sections: vec![
                section(".stack_sizes", &[1, 0, 0, 0, 0xAC, 2], false),
                section(".text", &bytes, true),
            ],
            functions: functions.map(function).into(),
            map: [(0, true), (6, false), (12, true)].into(),
        }
    }

    #[test]
    fn what_calls_and_jumps_reach_is_found_but_not_what_data_looks_like() {
        let reach = program().reach("roo").unwrap();
        let names: Vec<&str> = reach.functions.keys().map(String::as_str).collect();
        assert_eq!(names, ["called", "panics", "root"]);
        assert_eq!(reach.size, 24);
        assert_eq!(
            reach.faults("root"),
            [
                "root can panic: called calls panics",
                "root calls through a pointer in called"
            ]
        );
        let reach = reach.may_call_through_a_pointer("called");
        assert_eq!(
            reach.faults("root"),
            ["root can panic: called calls panics"]
        );
        assert!(program().reach_from("roo").is_err());
        let reach = program().reach_from("unused").unwrap();
        assert!(reach.faults("unused").is_empty() && reach.size == 2);
    }

    #[test]
    fn only_what_is_in_flash_counts() {
        assert_eq!((program().flash(), program().code_size()), (26, 26));
        assert_eq!(program().code(24), Some((0x4770, 0)));
        assert_eq!(program().code(26), None);
    }

    #[test]
    fn frames_have_the_names_of_their_functions() {
        assert_eq!(program().frames(), [("root".to_owned(), 300)]);
    }

    /// Encodings as produced by GNU as.
    #[test]
    fn branches_are_decoded() {
        // bl .+4, bl ., b.w ., bne.w ., bl .+0x1000
        assert_eq!(branch(0xF000, 0xF800), Some(0));
        assert_eq!(branch(0xF7FF, 0xFFFE), Some(-4));
        assert_eq!(branch(0xF7FF, 0xBFFE), Some(-4));
        assert_eq!(branch(0xF47F, 0xAFFE), Some(-4));
        assert_eq!(branch(0xF000, 0xFFFE), Some(0xFFC));
        // mrs r0, apsr; dmb; ldr.w r0, [r0]
        assert_eq!(branch(0xF3EF, 0x8000), None);
        assert_eq!(branch(0xF3BF, 0x8F5F), None);
        assert_eq!(branch(0xF8D0, 0x0000), None);
    }
}
