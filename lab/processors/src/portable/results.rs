//! What the program prints.

/// Number of calls counted by the program.
const CALLS: u64 = 100;

/// Output of the program: the bits of corrections, and the cost of calls.
pub struct TargetOutput {
    bits: Vec<u8>,
    /// Instructions of an evaluation, of one by generated code and of a servo update, if counted.
    pub instructions: Option<[u64; 3]>,
}

impl TargetOutput {
    /// Splits the bytes that it prints.
    pub fn split(mut bytes: Vec<u8>) -> Option<Self> {
        let figures = bytes.split_off(bytes.len().checked_sub(16)?);
        let mut figures = figures.chunks(4).map(|bytes| {
            let number = bytes.try_into().map(u32::from_le_bytes);
            number.map_or(0, u64::from)
        });
        let thousand = figures.next()?;
        let calls = [figures.next()?, figures.next()?, figures.next()?];
        let counted = |ticks| (ticks * 1000 + thousand * CALLS / 2) / (thousand * CALLS);
        Some(Self {
            bits: bytes,
            instructions: (thousand > 0).then(|| calls.map(counted)),
        })
    }

    /// Describes the first difference from the bits of `desktop`.
    pub fn difference(&self, desktop: &Self) -> Option<String> {
        if self.bits.len() != desktop.bits.len() {
            let [ours, theirs] = [self, desktop].map(|results| results.bits.len());
            return Some(format!("{ours} bytes instead of {theirs}"));
        }
        let mut numbers = self.bits.chunks(4).zip(desktop.bits.chunks(4));
        let place = numbers.position(|(ours, theirs)| ours != theirs)?;
        let [ours, theirs] = [self, desktop].map(|r| r.bits.chunks(4).nth(place));
        Some(format!(
            "number {place} has the bytes {ours:02X?} instead of {theirs:02X?}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(bits: [u32; 3]) -> TargetOutput {
        let figures = [16_416, 15_898_623, 8_208_000, 23_423_228];
        let numbers = bits.into_iter().chain(figures);
        TargetOutput::split(numbers.flat_map(u32::to_le_bytes).collect()).unwrap()
    }

    #[test]
    fn one_other_bit_is_a_difference_and_a_figure_is_none() {
        let desktop = results([1, 2, 3]);
        assert_eq!(desktop.difference(&desktop), None);
        let found = results([1, 2 | 1 << 31, 3]).difference(&desktop).unwrap();
        assert_eq!(
            found,
            "number 1 has the bytes Some([02, 00, 00, 80]) instead of Some([02, 00, 00, 00])"
        );
        let short = TargetOutput::split(vec![0; 24]).unwrap();
        let found = short.difference(&desktop).unwrap();
        assert_eq!(found, "8 bytes instead of 12");
        assert!(TargetOutput::split(vec![0; 15]).is_none());
    }

    #[test]
    fn ticks_become_instructions_of_one_call() {
        assert_eq!(results([0; 3]).instructions, Some([9685, 5000, 14_269]));
        let without = TargetOutput::split(vec![0; 20]).unwrap();
        assert_eq!(without.instructions, None);
    }
}
