//! Arbitrary flash contents, any order of operations, power cuts and bit flips: no panic, a valid slot holds a
//! committed blob, unreadable data is not read in place, and with power back an upload succeeds.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use trueaxis::{AlignedBlob, Axis, Draft, Header};
use trueaxis_firmware::mock_flash::{CutErase, MockFlash};
use trueaxis_firmware::slots::{Choice, Progress, Slot, SlotError, SlotState, Slots, WhileBusy};
use trueaxis_fuzz::Bytes;

const BLOCK: usize = 64;
const BLOCKS: usize = 9;
type Flash = MockFlash<8, BLOCK>;

/// Two blobs without tables, of different machines.
static BLOBS: LazyLock<[AlignedBlob; 2]> = LazyLock::new(|| {
    ["one", "the other"].map(|machine| {
        let axis = Axis {
            name: b'X',
            travel: [-1.0, 1.0],
            period: 0.0,
            value_bound: 1.0,
            rate_bound: 1.0,
            reversal_threshold: 0.1,
            ramp_rate: 1.0,
            reversal_rate: 1.0,
            reversal_acceleration: 20.0,
        };
        let draft = Draft {
            machine: machine.into(),
            axes: vec![axis],
            ..Draft::default()
        };
        draft.encode().expect("a valid draft")
    })
});

fuzz_target!(|data: &[u8]| {
    let mut input = Bytes(data);
    let mut flash = Flash::new(BLOCKS).with_while_busy(WhileBusy::ServoInRam);
    if input.flag() {
        flash = flash.with_code();
    }
    // Initial contents: blank, or arbitrary.
    let given = input.flag();
    if given {
        for byte in flash.image() {
            *byte = !input.byte();
        }
    }
    let mut slots = open(flash);
    let mut blob = &*BLOBS[0];
    for _ in 0..64 {
        if input.is_empty() {
            break;
        }
        match input.below(12) {
            0 => {
                blob = &BLOBS[usize::from(input.flag())];
                let Header { length, crc } = Header::read(blob).expect("a blob");
                let _ = slots.begin(length, crc);
            }
            // Any blob at all.
            1 => drop(slots.begin(u32::from(input.byte()), u32::from(input.byte()))),
            2 => drop(slots.erase_step()),
            3 => {
                let end = usize::from(input.byte()).min(blob.len());
                let start = usize::from(input.byte()).min(end);
                let _ = slots.write(start as u32, &blob[start..end]);
            }
            4 => drop(slots.write(u32::from(input.byte()), &[input.byte(); 9])),
            5 => drop(slots.commit(|_| true)),
            6 => slots.abort(),
            7 => {
                let blob = &BLOBS[usize::from(input.flag())];
                let _ = upload(&mut slots, blob);
            }
            8 => {
                let slot = if input.flag() { Slot::A } else { Slot::B };
                let _ = slots.choose(slots.choosing(slot));
            }
            9 => {
                let enable = input.flag();
                let _ = slots.choose(Choice {
                    enable,
                    ..slots.choice()
                });
            }
            10 => {
                let mut flash = slots.close();
                let fuel = u64::from(input.byte()) * 8 + u64::from(input.byte() % 8);
                flash.set_cut_erase(CutErase::Scattered(fuel));
                flash.set_fuel((fuel > 0).then_some(fuel));
                slots = open(flash);
            }
            _ => {
                let mut flash = slots.close();
                let bit = usize::from(input.byte()) << 8 | usize::from(input.byte());
                let slot = if input.flag() { Slot::A } else { Slot::B };
                flash.flip(slot, bit % (8 * BLOCK * BLOCKS));
                slots = open(flash);
            }
        }
        let active = slots.active().map(|slot| slots.flash().bytes(slot)[0]);
        assert_eq!(active.unwrap_or(b'T'), b'T');
        for slot in Slot::BOTH {
            if let SlotState::Valid { length, .. } = slots.state(slot) {
                let bytes = &slots.flash().bytes(slot)[..length as usize];
                assert!(given || BLOBS.iter().any(|blob| **blob == *bytes));
                let all = |at: u32, out: &mut [u8]| -> Result<(), ()> {
                    let bytes = &bytes[at as usize..];
                    out.copy_from_slice(&bytes[..out.len()]);
                    Ok(())
                };
                assert!(matches!(Header::check_pieces(length, all), Ok(Ok(_))));
            }
        }
    }
    let mut flash = slots.close();
    flash.set_fuel(None);
    let mut slots = open(flash);
    // The second attempt erases the obstacles found by the first.
    let slot = upload(&mut slots, &BLOBS[1])
        .or_else(|_| upload(&mut slots, &BLOBS[1]))
        .expect("an upload goes through");
    assert_eq!(slots.newest(), Some(slot));
    assert_eq!(slots.blob(slot), Some(&*BLOBS[1]));
    assert_eq!(slots.flash().refused(), 0);
});

/// A start: the slot selected for use becomes active, or the one before it.
fn open(flash: Flash) -> Slots<Flash> {
    let mut slots = Slots::open(flash);
    slots.set_active(slots.in_use().or_else(|| slots.before()));
    slots
}

fn upload(slots: &mut Slots<Flash>, blob: &[u8]) -> Result<Slot, SlotError> {
    let Header { length, crc } = Header::read(blob).expect("a blob");
    let mut progress = slots.begin(length, crc)?;
    while matches!(progress, Progress::Erasing { .. }) {
        progress = slots.erase_step()?;
    }
    slots.write(0, blob)?;
    slots.commit(|_| true)
}
