//! Programs for the Cortex-M as they were linked: their size, and who calls whom.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A program: ELF, 32 bits, little-endian.
pub struct Program {
    bytes: Vec<u8>,
    sections: Vec<Section>,
    /// By address, without the bit that marks Thumb code.
    functions: BTreeMap<u32, Function>,
    /// From each address on there is code (true) or data between code.
    map: BTreeMap<u32, bool>,
}

struct Section {
    name: String,
    address: u32,
    offset: u32,
    size: u32,
    /// Takes room in flash.
    loaded: bool,
}

struct Function {
    name: String,
    size: u32,
}

/// What can be reached from somewhere.
#[derive(Default)]
pub struct Reach {
    /// All functions, each with the one from which it was come to.
    pub functions: BTreeMap<String, Option<String>>,
    /// Names of those that call through a pointer, whose ends are not known.
    pub through_pointers: BTreeSet<String>,
    /// Bytes of all functions.
    pub size: u32,
}

impl Program {
    /// # Errors
    /// The file cannot be read or is no such program.
    pub fn read(path: &Path) -> Result<Self, String> {
        let shown = path.display();
        let bytes = std::fs::read(path).map_err(|e| format!("{shown}: {e}"))?;
        Self::parse(bytes).ok_or_else(|| format!("{shown} is no 32-bit little-endian ELF"))
    }

    fn parse(bytes: Vec<u8>) -> Option<Self> {
        if bytes.get(..6)? != [0x7F, b'E', b'L', b'F', 1, 1] {
            return None;
        }
        let mut program = Self {
            sections: Vec::new(),
            functions: BTreeMap::new(),
            map: BTreeMap::new(),
            bytes,
        };
        let (headers, count) = (program.word(32)?, program.half(48)?);
        let header = |index: u32| headers + 40 * index;
        let names = program.word(header(program.half(50)?.into()) + 16)?;
        let mut symbols = None;
        for at in (0..count.into()).map(header) {
            let [kind, flags, address, offset, size, link] =
                [4, 8, 12, 16, 20, 24].map(|k| program.word(at + k));
            if kind? == 2 {
                symbols = Some((offset?, size?, program.word(header(link?) + 16)?));
            }
            let name = program.text(names + program.word(at)?)?;
            program.sections.push(Section {
                name,
                address: address?,
                offset: offset?,
                size: size?,
                // Allocated, and not only zeros.
                loaded: flags? & 2 != 0 && kind? != 8,
            });
        }
        let (offset, size, strings) = symbols?;
        for at in (offset..offset + size).step_by(16) {
            let name = program.text(strings + program.word(at)?)?;
            let (value, size) = (program.word(at + 4)?, program.word(at + 8)?);
            let kind = program.bytes.get(at as usize + 12)? & 15;
            match name.as_str() {
                "$t" => drop(program.map.insert(value, true)),
                "$d" => drop(program.map.insert(value, false)),
                _ if kind == 2 => {
                    program
                        .functions
                        .insert(value & !1, Function { name, size });
                }
                _ => {}
            }
        }
        Some(program)
    }

    fn half(&self, offset: u32) -> Option<u16> {
        let bytes = self.bytes.get(offset as usize..)?.first_chunk()?;
        Some(u16::from_le_bytes(*bytes))
    }

    fn word(&self, offset: u32) -> Option<u32> {
        let bytes = self.bytes.get(offset as usize..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    }

    fn text(&self, offset: u32) -> Option<String> {
        let bytes = self.bytes.get(offset as usize..)?;
        let end = bytes.iter().position(|b| *b == 0)?;
        Some(String::from_utf8_lossy(&bytes[..end]).into_owned())
    }

    /// Bytes of the sections that are stored in flash.
    pub fn flash(&self) -> u32 {
        let stored = self.sections.iter().filter(|s| s.loaded);
        stored.map(|s| s.size).sum()
    }

    /// Bytes of its functions.
    pub fn code_size(&self) -> u32 {
        let code = self.sections.iter().filter(|s| s.name == ".text");
        code.map(|s| s.size).sum()
    }

    /// Bytes of stack of each function of which that is known (`-Zemit-stack-sizes`).
    pub fn frames(&self) -> Vec<(String, u64)> {
        let mut found = Vec::new();
        for section in self.sections.iter().filter(|s| s.name == ".stack_sizes") {
            let (mut at, end) = (section.offset, section.offset + section.size);
            while let (true, Some(address)) = (at + 4 < end, self.word(at)) {
                at += 4;
                // LEB128
                let (mut bytes, mut shift) = (0, 0);
                while let Some(&byte) = self.bytes.get(at as usize) {
                    at += 1;
                    bytes |= u64::from(byte & 0x7F) << shift;
                    shift += 7;
                    if byte & 0x80 == 0 {
                        break;
                    }
                }
                if let Some(function) = self.functions.get(&(address & !1)) {
                    found.push((function.name.clone(), bytes));
                }
            }
        }
        found
    }

    /// Everything that functions whose name contains `root` can come to by calls and jumps.
    ///
    /// # Errors
    /// There is no such function, or its code cannot be read.
    pub fn reach(&self, root: &str) -> Result<Reach, String> {
        self.reach_where(root, |name| name.contains(root))
    }

    /// As [`reach`](Self::reach), of the function of this name.
    ///
    /// # Errors
    /// There is no such function, or its code cannot be read.
    pub fn reach_from(&self, root: &str) -> Result<Reach, String> {
        self.reach_where(root, |name| name == root)
    }

    fn reach_where(&self, root: &str, is_root: impl Fn(&str) -> bool) -> Result<Reach, String> {
        let roots = self.functions.iter().filter(|(_, f)| is_root(&f.name));
        let mut open: Vec<(u32, Option<String>)> = roots.map(|(&at, _)| (at, None)).collect();
        if open.is_empty() {
            return Err(format!("the program has no function `{root}`"));
        }
        let mut seen = BTreeSet::new();
        let mut reach = Reach::default();
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

    /// The halfword of code at an address, and the one behind it (0 at the end of a section).
    pub fn code(&self, address: u32) -> Option<(u16, u16)> {
        let inside = |s: &&Section| s.loaded && (s.address..s.address + s.size).contains(&address);
        let section = self.sections.iter().find(inside)?;
        let offset = section.offset + (address - section.address);
        Some((self.half(offset)?, self.half(offset + 2).unwrap_or(0)))
    }

    /// Functions outside `start..start + size` that the code there calls or jumps to, and whether
    /// it calls through pointers.
    fn calls(&self, start: u32, size: u32) -> Option<(Vec<u32>, bool)> {
        let inside = |s: &&Section| s.loaded && (s.address..s.address + s.size).contains(&start);
        let section = self.sections.iter().find(inside)?;
        let mut targets = Vec::new();
        let mut pointers = false;
        let mut at = start;
        while at < start + size {
            let is_code = self
                .map
                .range(..=at)
                .next_back()
                .is_none_or(|(_, code)| *code);
            if !is_code {
                at += 2;
                continue;
            }
            let offset = section.offset + (at - section.address);
            let first = self.half(offset)?;
            // `blx register`; `bx` to anything but the return address.
            pointers |= first & 0xFF87 == 0x4780;
            pointers |= first & 0xFF87 == 0x4700 && first != 0x4770;
            if first >> 11 < 0b11101 {
                at += 2;
                continue;
            }
            let second = self.half(offset + 2)?;
            if let Some(distance) = branch(first, second) {
                let target = at.wrapping_add(4).wrapping_add_signed(distance);
                if !(start..start + size).contains(&target) {
                    // Into the middle of a function too.
                    let (&function, _) = self.functions.range(..=target).next_back()?;
                    targets.push(function);
                }
            }
            at += 4;
        }
        Some((targets, pointers))
    }
}

/// How far `bl`, `b.w` and conditional `b.w` jump, from 4 bytes behind their address (Arm v7-M
/// reference manual, A7.7.12 and A7.7.18); `None` for other instructions.
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
    use super::branch;

    /// Encodings as GNU as gives them.
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
