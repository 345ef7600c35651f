//! The reason for the last stop of the program, in memory that survives a reset.
//!
//! A fault handler has no time, no stack to rely on and no log: it writes a few words, and the next start reads them. A
//! board places them in memory that is never initialised.

use trueaxis::Checksum;
use trueaxis::link::{Restart, Tail};

/// Number of words in a record.
pub const WORDS: usize = 10;
/// The first word, including the version of the rest.
const MARK: u32 = 0x7472_7801;

const SOFTWARE: u32 = 1;
const MAIN_LOOP: u32 = 2;
const EXCEPTION: u32 = 3;
const PANIC: u32 = 4;
const CLOCK: u32 = 5;

/// The record written before a reset.
pub type Words = [u32; WORDS];

/// Words that [`read`] ignores; write them after reading the record.
pub const NONE: Words = [0; WORDS];

/// Encodes a reason. Reasons that a program cannot know give [`NONE`].
#[must_use]
pub fn write(reason: &Restart) -> Words {
    let mut words = NONE;
    let [mark, kind, a, b, text @ .., _] = &mut words;
    *mark = MARK;
    match *reason {
        Restart::Software => *kind = SOFTWARE,
        Restart::MainLoopStopped => *kind = MAIN_LOOP,
        Restart::ClockStopped => *kind = CLOCK,
        Restart::Exception { address, status } => (*kind, *a, *b) = (EXCEPTION, address, status),
        Restart::Panic { line, file } => {
            (*kind, *a) = (PANIC, line);
            // The first bytes of the tail go into `b`, which is unused.
            let places = core::iter::once(b).chain(text);
            for (place, bytes) in places.zip(file.0.chunks_exact(4)) {
                *place = word(bytes);
            }
        }
        _ => return NONE,
    }
    let sum = checksum(&words);
    words[WORDS - 1] = sum;
    words
}

/// Decodes a record if it is intact.
#[must_use]
pub fn read(words: &Words) -> Option<Restart> {
    let [mark, kind, a, b, text @ .., check] = *words;
    if mark != MARK || check != checksum(words) {
        return None;
    }
    Some(match kind {
        SOFTWARE => Restart::Software,
        MAIN_LOOP => Restart::MainLoopStopped,
        CLOCK => Restart::ClockStopped,
        EXCEPTION => Restart::Exception {
            address: a,
            status: b,
        },
        PANIC => {
            let mut file = [0; Tail::MOST];
            let places = core::iter::once(b).chain(text);
            for (place, word) in file.chunks_exact_mut(4).zip(places) {
                place.copy_from_slice(&word.to_le_bytes());
            }
            Restart::Panic {
                line: a,
                file: Tail(file),
            }
        }
        _ => return None,
    })
}

/// Reset flags of the hardware; several may be set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Flags {
    /// The supply was switched on. The memory contents are random then.
    pub power_on: bool,
    /// The supply was too low.
    pub brown_out: bool,
    /// The watchdog was not fed.
    pub watchdog: bool,
    /// Requested by the program or a probe.
    pub software: bool,
    /// The reset pin was low.
    pub pin: bool,
}

/// Why the controller started.
#[must_use]
pub fn reason(flags: Flags, words: &Words) -> Restart {
    if flags.power_on {
        return Restart::PowerOn;
    }
    if let Some(reason) = read(words) {
        return reason;
    }
    // A power-on and a watchdog also pull the reset pin, so it is checked last.
    match flags {
        Flags { watchdog: true, .. } => Restart::ServoStopped,
        Flags {
            brown_out: true, ..
        } => Restart::BrownOut,
        Flags { software: true, .. } => Restart::Software,
        Flags { pin: true, .. } => Restart::Pin,
        _ => Restart::Unknown,
    }
}

fn word(bytes: &[u8]) -> u32 {
    bytes
        .first_chunk()
        .map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

/// Checksum of all words but the last.
fn checksum(words: &Words) -> u32 {
    let mut digest = Checksum::new();
    for word in words.iter().take(WORDS - 1) {
        digest.add(&word.to_le_bytes());
    }
    digest.value()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec;

    fn reasons() -> impl Strategy<Value = Restart> {
        prop_oneof![
            Just(Restart::Software),
            Just(Restart::MainLoopStopped),
            Just(Restart::ClockStopped),
            any::<[u32; 2]>().prop_map(|[address, status]| Restart::Exception { address, status }),
            (any::<u32>(), any::<[u8; 24]>()).prop_map(|(line, file)| Restart::Panic {
                line,
                file: Tail(file)
            }),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn what_is_written_is_read_and_a_changed_bit_makes_it_nothing(
            reason in reasons(),
            bit in 0..WORDS * 32,
        ) {
            let mut words = write(&reason);
            prop_assert_eq!(read(&words), Some(reason));
            words[bit / 32] ^= 1 << (bit % 32);
            prop_assert_eq!(read(&words), None);
        }

        #[test]
        fn chance_is_no_record(words: [u32; WORDS]) {
            prop_assert_eq!(read(&words), None);
        }
    }

    #[test]
    fn memory_that_is_all_zeros_or_ones_is_no_record_nor_is_what_no_program_can_know() {
        assert_eq!(read(&NONE), None);
        assert_eq!(read(&[u32::MAX; WORDS]), None);
        for reason in [
            Restart::Unknown,
            Restart::PowerOn,
            Restart::BrownOut,
            Restart::Pin,
            Restart::ServoStopped,
        ] {
            assert_eq!(write(&reason), NONE);
        }
    }

    #[test]
    fn a_record_of_another_kind_is_none() {
        for kind in [0, 6, u32::MAX] {
            let mut words = write(&Restart::Software);
            words[1] = kind;
            words[WORDS - 1] = checksum(&words);
            assert_eq!(read(&words), None);
        }
        let mut words = write(&Restart::Software);
        words[0] ^= 1;
        words[WORDS - 1] = checksum(&words);
        assert_eq!(read(&words), None);
    }

    #[test]
    fn a_record_counts_more_than_flags_but_not_after_power_on() {
        let panic = Restart::Panic {
            line: 12,
            file: Tail::of("src/spi.rs"),
        };
        let words = write(&panic);
        let flags = Flags {
            software: true,
            pin: true,
            ..Flags::default()
        };
        assert_eq!(reason(flags, &words), panic);
        assert_eq!(reason(Flags::default(), &words), panic);
        let power = Flags {
            power_on: true,
            brown_out: true,
            pin: true,
            ..Flags::default()
        };
        assert_eq!(reason(power, &words), Restart::PowerOn);
    }

    #[test]
    fn without_a_record_the_flags_say_it_and_the_pin_comes_last() {
        let set = |f: fn(&mut Flags)| {
            let mut flags = Flags {
                pin: true,
                ..Flags::default()
            };
            f(&mut flags);
            reason(flags, &NONE)
        };
        let seen = vec![
            set(|f| f.watchdog = true),
            set(|f| f.brown_out = true),
            set(|f| f.software = true),
            set(|_| ()),
            set(|f| f.pin = false),
        ];
        let expected = vec![
            Restart::ServoStopped,
            Restart::BrownOut,
            Restart::Software,
            Restart::Pin,
            Restart::Unknown,
        ];
        assert_eq!(seen, expected);
    }
}
