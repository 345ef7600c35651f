//! Random operations, power cuts and flips, compared with a model of the expected state.

use std::sync::LazyLock;

use proptest::prelude::*;

use super::*;
use crate::mock_flash::{CutErase, MockFlash};
use crate::slots::{Choice, Damage, SlotState};

const WORDS: usize = 8;
type Flash = MockFlash<WORDS, 128>;
const BLOCKS: usize = 5;
/// Length of a slot in bytes, and start of its trailer.
const SLOT: usize = 128 * BLOCKS;
const TRAILER: usize = SLOT - 128;
/// After the longest blob; the choices begin here.
const CHOICES: usize = 256;
const BITS: usize = 8 * 128 * BLOCKS;

static BLOBS: LazyLock<Vec<AlignedBlob>> = LazyLock::new(|| blobs(4, 40));

#[derive(Clone, Copy, Debug)]
enum Step {
    Begin(usize),
    Erase,
    /// The next bytes, starting slightly before the first missing one.
    Write {
        count: usize,
        before: usize,
    },
    Commit,
    Abort,
    /// A complete upload, to be used from then on.
    Upload(usize),
    /// Puts this slot into use, if it is valid.
    Choose(Slot),
    /// Enables or disables corrections at start.
    Enable(bool),
    /// Makes this slot active if it is valid.
    Activate(Slot),
    Deactivate,
    Restart,
    /// Cuts the power after this many bytes, and restarts.
    Cut(u64, CutErase),
    Flip(Slot, usize),
}

fn slot() -> impl Strategy<Value = Slot> {
    prop_oneof![Just(Slot::A), Just(Slot::B)]
}

fn step() -> impl Strategy<Value = Step> {
    let cut = prop_oneof![
        Just(CutErase::Ascending),
        Just(CutErase::Descending),
        any::<u64>().prop_map(CutErase::Scattered),
    ];
    prop_oneof![
        6 => (0..4_usize).prop_map(Step::Begin),
        6 => Just(Step::Erase),
        12 => (1..300_usize, 0..20_usize)
            .prop_map(|(count, before)| Step::Write { count, before }),
        6 => Just(Step::Commit),
        1 => Just(Step::Abort),
        6 => (0..4_usize).prop_map(Step::Upload),
        3 => slot().prop_map(Step::Activate),
        3 => slot().prop_map(Step::Choose),
        2 => any::<bool>().prop_map(Step::Enable),
        1 => Just(Step::Deactivate),
        2 => Just(Step::Restart),
        6 => (1..900_u64, cut).prop_map(|(fuel, cut)| Step::Cut(fuel, cut)),
        2 => (slot(), 0..BITS).prop_map(|(slot, bit)| Step::Flip(slot, bit)),
    ]
}

/// Expected content of a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Holds {
    /// No valid blob.
    Nothing,
    /// This blob, with this sequence number.
    Blob(usize, u32),
    /// That blob, or nothing valid: one of its bits has flipped, or power was lost during an operation.
    Perhaps(usize, u32),
}

struct Model {
    slots: Option<Slots<Flash>>,
    holds: [Holds; 2],
    /// The blob being uploaded, from the last begin.
    coming: usize,
    /// Possible stored choices: one, or two after a cut; empty if two faults have hit them.
    choices: Vec<Choice>,
    /// Blobs that were ever selected for use.
    ever: Vec<usize>,
    /// Something has happened to choices that each of them survives once.
    hit: bool,
}

impl Model {
    fn slots(&mut self) -> &mut Slots<Flash> {
        self.slots.as_mut().expect("only restart takes it")
    }

    fn restart(&mut self) {
        let mut flash = self.slots.take().expect("it is there").close();
        flash.set_fuel(None);
        self.slots = Some(Slots::open(flash));
        self.started();
    }

    /// A start: the stored choice is known from here on.
    fn started(&mut self) {
        start(self.slots());
        let found = self.slots().choice();
        assert!(
            self.choices.is_empty() || self.choices.contains(&found),
            "{found:?} of {:?}",
            self.choices
        );
        if !self.choices.is_empty() {
            self.choices = vec![found];
        }
    }

    /// The blob in a slot, if any.
    fn number_in(&self, slot: Slot) -> Option<usize> {
        match self.holds[slot.index()] {
            Holds::Blob(number, _) | Holds::Perhaps(number, _) => Some(number),
            Holds::Nothing => None,
        }
    }

    /// The slot that an upload changes.
    fn target(&mut self) -> Slot {
        self.slots().target()
    }

    fn begin(&mut self, number: usize) {
        let header = Header::read(&BLOBS[number]).expect("a blob");
        let target = self.target();
        self.coming = number;
        // If the other slot is not valid, there is no place for the settings of the start.
        let (slots, other) = (self.slots(), target.other());
        if slots.newest_choice().is_some_and(|found| found.0 == target)
            && slots.places_left(other) == 0
        {
            self.choices.clear();
        }
        // Otherwise they are stored there, without the slot that is lost.
        let slots = self.slots();
        let mut secured = slots.choice();
        let secures = slots.must_secure(target);
        if slots.active() == Some(other) && slots.in_use() != Some(other) {
            secured = Choice {
                in_use: slots.choosing(other).in_use,
                ..Choice::default()
            };
            // It was activated, which chooses it, even if that is only stored now.
            if secures {
                self.ever.extend(self.number_in(other));
            }
        }
        if secures && !self.choices.is_empty() {
            // It may be the last one that succeeds.
            self.choices.push(secured);
            self.hit = true;
        }
        let was_valid = self.slots().state(target).is_valid();
        match self.slots().begin(header.length, header.crc) {
            Ok(_) => {
                // Without a mark, which the power cut may have prevented, the blob is there until it is erased.
                let marked = self.slots().flash().bytes(target)[TRAILER + 64..][..32] != [0xFF; 32];
                // An invalid slot needs no mark before it is erased: if a single bit made it invalid, the same bit
                // makes it valid again.
                if was_valid && !marked {
                    self.doubt(target);
                } else if was_valid || !matches!(self.holds[target.index()], Holds::Perhaps(..)) {
                    self.holds[target.index()] = Holds::Nothing;
                }
                if secures && !self.choices.is_empty() {
                    self.choices = vec![secured];
                }
            }
            Err(_) => self.doubt(target),
        }
    }

    /// An operation on this slot was interrupted, so a valid blob may no longer be valid.
    fn doubt(&mut self, slot: Slot) {
        let holds = &mut self.holds[slot.index()];
        if let Holds::Blob(number, order) = *holds {
            *holds = Holds::Perhaps(number, order);
        }
    }

    /// The sequence number of a slot, 0 if it has none that can be read because a bit in its trailer has flipped.
    ///
    /// Commits beside such a slot start again at 1. If the bit flips back, the older one may be the newest; which one a
    /// start uses does not depend on that.
    fn numbered(&mut self, slot: Slot) -> u32 {
        use Damage::{Blob, OtherBlob, Unreadable};
        match (self.slots().state(slot), self.holds[slot.index()]) {
            (
                SlotState::Valid { .. } | SlotState::Damaged(Blob(_) | OtherBlob | Unreadable),
                Holds::Blob(_, sequence) | Holds::Perhaps(_, sequence),
            ) => sequence,
            _ => 0,
        }
    }

    /// The slot that holds the received blob, if it was committed.
    fn commit(&mut self) -> Option<Slot> {
        let coming = self.coming;
        let slot = self.slots().upload()?.slot;
        let sequence = self.numbered(slot.other()) + 1;
        match self.slots().commit(|bytes| loads(bytes).is_ok()) {
            Ok(slot) => {
                self.holds[slot.index()] = Holds::Blob(coming, sequence);
                Some(slot)
            }
            // The last byte of the commit may have used the last of the fuel.
            Err(SlotError::Flash(_) | SlotError::Unusable { .. }) => {
                self.holds[slot.index()] = Holds::Perhaps(coming, sequence);
                None
            }
            Err(_) => None,
        }
    }

    fn write(&mut self, count: usize, before: usize) {
        let blob = &BLOBS[self.coming];
        if let Some(Progress::Receiving { next }) = self.slots().upload().map(|u| u.progress) {
            let next = next as usize;
            let from = next.saturating_sub(before);
            let end = blob.len().min(next + count);
            let _ = self.slots().write(from as u32, &blob[from..end]);
        }
    }

    fn upload(&mut self, number: usize) {
        self.begin(number);
        for _ in 0..BLOCKS {
            let _ = self.slots().erase_step();
        }
        self.write(usize::MAX / 2, 0);
        if let Some(slot) = self.commit() {
            self.choose(self.slots.as_ref().map(|slots| slots.choosing(slot)));
        }
    }

    fn choose(&mut self, choice: Option<Choice>) {
        let choice = choice.expect("there are slots");
        match self.slots().choose(choice) {
            // Nothing is in use, and nothing was written for that. If the choice was lost with its slot, an interrupted
            // erase may have left part of it, and a flipped bit can bring it back. Its slot is not valid before the
            // next complete erase.
            Ok(()) if choice.in_use.is_none() && self.choices.is_empty() => {}
            Ok(()) => {
                self.choices = vec![choice];
                // Half of it is enough, but does not survive a flip.
                self.hit |= self.slots().is_choice_halved();
                let used = self.slots().in_use();
                self.ever.extend(used.and_then(|slot| self.number_in(slot)));
            }
            // Half of it may be enough.
            Err(SlotError::Unusable { .. }) => {
                if !self.choices.is_empty() {
                    self.choices.push(choice);
                }
                self.hit = true;
                let both = Slot::BOTH.map(|slot| self.number_in(slot));
                self.ever.extend(both.into_iter().flatten());
            }
            Err(_) => {}
        }
    }

    fn play(&mut self, step: Step) {
        match step {
            Step::Begin(number) => self.begin(number),
            Step::Erase => drop(self.slots().erase_step()),
            Step::Write { count, before } => self.write(count, before),
            Step::Commit => drop(self.commit()),
            Step::Abort => self.slots().abort(),
            Step::Upload(number) => self.upload(number),
            Step::Activate(slot) => {
                if self.slots().state(slot).is_valid() {
                    self.slots().set_active(Some(slot));
                }
            }
            Step::Choose(slot) => {
                if self.slots().state(slot).is_valid() {
                    self.choose(self.slots.as_ref().map(|slots| slots.choosing(slot)));
                }
            }
            Step::Enable(enable) => {
                let choice = self.slots().choice();
                self.choose(Some(Choice { enable, ..choice }));
            }
            Step::Deactivate => self.slots().set_active(None),
            Step::Restart => self.restart(),
            Step::Cut(..) => unreachable!("played by the caller"),
            Step::Flip(slot, bit) => {
                let mut flash = self.slots.take().expect("it is there").close();
                flash.flip(slot, bit);
                self.slots = Some(Slots::open(flash));
                if (CHOICES..TRAILER).contains(&(bit / 8)) {
                    // It survives one flip, but not two in the same choice.
                    if self.hit {
                        self.choices.clear();
                    }
                    self.hit = true;
                }
                self.started();
                self.doubt(slot);
            }
        }
    }

    /// Compares the actual state with the expected one.
    fn check(&mut self) {
        let holds = self.holds;
        for slot in Slot::BOTH {
            let blob = self.slots().blob(slot);
            match (blob, holds[slot.index()]) {
                (None, Holds::Nothing | Holds::Perhaps(..)) => {}
                (Some(bytes), Holds::Blob(number, _) | Holds::Perhaps(number, _)) => {
                    assert!(*bytes == *BLOBS[number], "a mix");
                }
                (blob, holds) => panic!("{:?}, expected {holds:?}", blob.map(<[u8]>::len)),
            }
        }
        // The newest is the valid one with the newer number: the last one committed, if the content of the other slot
        // was known then.
        let numbers =
            Slot::BOTH.map(
                |slot| match (self.slots().state(slot), holds[slot.index()]) {
                    (
                        SlotState::Valid { sequence, .. },
                        Holds::Blob(_, order) | Holds::Perhaps(_, order),
                    ) => {
                        assert_eq!(sequence, order);
                        Some(order)
                    }
                    _ => None,
                },
            );
        let newest = match numbers {
            [None, None] => None,
            [a, b] => Some(if b > a { Slot::B } else { Slot::A }),
        };
        assert_eq!(self.slots().newest(), newest);
        // Whatever a start would use was selected for use once.
        for slot in [self.slots().in_use(), self.slots().before()]
            .into_iter()
            .flatten()
        {
            let (Holds::Blob(number, _) | Holds::Perhaps(number, _)) = holds[slot.index()] else {
                panic!("in use without being there");
            };
            assert!(self.ever.contains(&number), "never chosen: {number}");
        }
        let slots = &*self.slots();
        let flash = slots.flash();
        assert_eq!((flash.refused(), flash.programmed_weak()), (0, 0));
        for slot in Slot::BOTH {
            assert!(Some(slots.wear(slot)) <= flash.erases(slot).last().copied());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_was_committed_stays_and_nothing_else_is_valid(
        steps in prop::collection::vec(step(), 1..60),
        code in any::<bool>(),
    ) {
        run(&steps, code);
    }
}

/// An erase from the end, interrupted between mark and record, looks like an upload that has begun.
#[test]
fn an_erase_cut_before_the_record_is_no_upload_to_go_on_with() {
    use Step::{Cut, Flip, Restart, Upload};
    let flipped = Flip(Slot::A, 4683);
    let cut = Cut(567, CutErase::Descending);
    let steps = [
        Upload(0),
        Upload(0),
        flipped,
        cut,
        Upload(0),
        Restart,
        Upload(0),
    ];
    run(&steps, false);
}

/// A flip makes the blank commit of such a slot non-blank, which proves nothing either.
#[test]
fn a_commit_that_belongs_to_no_record_proves_no_erase() {
    use Step::{Begin, Cut, Erase, Flip, Restart, Upload};
    let cut = Cut(833, CutErase::Ascending);
    let (first, commit) = (Flip(Slot::A, 256), Flip(Slot::A, 4864));
    let steps = [&[cut, Begin(0)][..], &[Erase; BLOCKS], &[first, Upload(0)]].concat();
    run(
        &[&steps[..], &[Begin(0), Restart, commit, Upload(0)]].concat(),
        false,
    );
}

/// Nor does a commit after an erased blob: an invalid slot gets no mark before the erase, and the erase may restore the
/// bit that made it invalid and then be interrupted.
#[test]
fn a_commit_that_an_erase_has_mended_proves_no_erase() {
    use Step::{Cut, Flip, Restart, Upload};
    let commit = Flip(Slot::A, 5057);
    let cut = Cut(520, CutErase::Descending);
    let steps = [
        Upload(0),
        commit,
        Restart,
        cut,
        Upload(0),
        Restart,
        Upload(0),
    ];
    run(&steps, false);
}

/// With no valid slot, what an interrupted erase leaves of a choice may be hidden and reappear: nothing is used.
#[test]
fn what_a_cut_erase_leaves_of_a_choice_takes_nothing() {
    use Step::{Begin, Cut, Enable, Flip, Restart, Upload};
    let (first, cut) = (Cut(1, CutErase::Ascending), Cut(449, CutErase::Descending));
    let lost = [Upload(0), Enable(true), first, Flip(Slot::A, 0), Begin(0)];
    let hidden = [Restart, cut, Upload(0), Enable(false)];
    run(
        &[&lost[..], &hidden, &[Flip(Slot::A, 3584)]].concat(),
        false,
    );
}

fn run(steps: &[Step], code: bool) {
    let flash = Flash::new(BLOCKS);
    let flash = if code { flash.with_code() } else { flash };
    let mut model = Model {
        slots: Some(Slots::open(flash)),
        holds: [Holds::Nothing; 2],
        coming: 0,
        choices: vec![Choice::default()],
        ever: vec![],
        hit: false,
    };
    let mut cut = false;
    for &step in steps {
        if let Step::Cut(fuel, cut_erase) = step {
            if !cut {
                let mut flash = model.slots.take().expect("it is there").close();
                flash.set_cut_erase(cut_erase);
                flash.set_fuel(Some(fuel));
                model.slots = Some(Slots::open(flash));
                model.started();
                cut = true;
                continue;
            }
            cut = false;
            model.restart();
        } else {
            let active = model.slots().active();
            // Everything except the choices, which are after the blob.
            let kept = |model: &mut Model, slot| {
                let bytes = model.slots().flash().bytes(slot);
                [&bytes[..CHOICES], &bytes[TRAILER..]].concat()
            };
            let before = active.map(|slot| kept(&mut model, slot));
            model.play(step);
            if matches!(step, Step::Restart | Step::Flip(..)) {
                cut &= !matches!(step, Step::Restart);
            } else if let (Some(slot), Some(before)) = (active, before) {
                assert_eq!(kept(&mut model, slot), before);
            }
        }
        model.check();
    }
    // With power back, an upload succeeds, whatever happened before.
    model.restart();
    model.check();
    let slot = upload(model.slots(), &BLOBS[3], 64);
    assert_eq!(model.slots().blob(slot), Some(&*BLOBS[3]));
    assert!(model.slots().state(slot).is_valid());
    assert_eq!(model.slots().newest(), Some(slot));
}
