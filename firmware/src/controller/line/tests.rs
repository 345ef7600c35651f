use std::boxed::Box;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::vec::Vec;

use embedded_io::{Read, ReadReady, Write};

use super::*;

/// The hardware: received bytes, and bytes being sent.
#[derive(Default)]
struct Wires {
    /// Total number of bytes received.
    come: Cell<usize>,
    sent: RefCell<Vec<u8>>,
    /// Number of queries until sending is complete.
    busy: Cell<u32>,
    on_their_way: Cell<Option<&'static [AtomicU8]>>,
}

impl Wires {
    /// Receives bytes.
    fn put(&self, memory: &'static LineMemory, bytes: impl IntoIterator<Item = u8>) {
        for byte in bytes {
            memory.ring()[self.come.get() % RING].store(byte, Ordering::Relaxed);
            self.come.set(self.come.get() + 1);
        }
    }
}

impl LineDma for Rc<Wires> {
    fn left(&self) -> usize {
        RING - self.come.get() % RING
    }

    fn is_sending(&self) -> bool {
        let busy = self.busy.get();
        self.busy.set(busy.saturating_sub(1));
        if busy > 1 {
            return true;
        }
        // The hardware reads them until sending is complete.
        for byte in self.on_their_way.take().unwrap_or_default() {
            self.sent.borrow_mut().push(byte.load(Ordering::Relaxed));
        }
        false
    }

    fn send(&mut self, bytes: &'static [AtomicU8]) {
        assert!(
            self.on_their_way.take().is_none(),
            "the last are still being sent"
        );
        self.on_their_way.set(Some(bytes));
        self.busy.set(3);
    }
}

fn line(wait: fn()) -> (Rc<Wires>, &'static LineMemory, Line<Rc<Wires>>) {
    let memory: &'static LineMemory = Box::leak(Box::new(LineMemory::new()));
    let wires = Rc::new(Wires::default());
    (wires.clone(), memory, Line::start(wires, memory, wait))
}

fn never() {
    unreachable!("bytes are there");
}

#[test]
fn what_comes_is_read_in_order_round_and_round_however_it_is_cut() {
    let (wires, memory, mut line) = line(never);
    let (mut next, mut expected) = (0_u32, 0_u32);
    for round in 0..400 {
        let count = round * 37 % 251 + 1;
        wires.put(memory, (next..next + count).map(|n| (n % 253) as u8));
        next += count;
        while line.read_ready().unwrap() {
            let mut bytes = [0; 101];
            let count = line.read(&mut bytes).unwrap();
            assert!(count > 0);
            for byte in &bytes[..count] {
                assert_eq!(u32::from(*byte), expected % 253);
                expected += 1;
            }
        }
        assert_eq!(next, expected);
    }
    assert!(next as usize > 10 * RING);
}

#[test]
fn three_frames_wait_for_a_main_loop_that_is_away() {
    let (wires, memory, mut line) = line(never);
    // Across the end of the ring.
    wires.put(memory, [0; 3000]);
    assert_eq!(line.read(&mut [0; 3000]), Ok(3000));
    const FRAMES: usize = 3 * trueaxis::link::MOST_WIRE;
    wires.put(memory, (0..FRAMES).map(|n| n as u8));
    let mut bytes = [0; FRAMES];
    assert_eq!(line.read(&mut bytes), Ok(FRAMES));
    assert!(bytes.iter().enumerate().all(|(n, byte)| *byte == n as u8));
    assert_eq!(line.read_ready(), Ok(false));
}

std::thread_local! {
    /// Bytes that arrive during a wait, and the number of waits.
    static LATER: RefCell<Option<(Rc<Wires>, &'static LineMemory)>> = const { RefCell::new(None) };
    static WAITED: Cell<u32> = const { Cell::new(0) };
}

#[test]
fn a_read_waits_for_the_first_byte_and_for_no_other() {
    fn wait() {
        WAITED.set(WAITED.get() + 1);
        if WAITED.get() == 3 {
            LATER.with_borrow(|later| {
                let (wires, memory) = later.as_ref().unwrap();
                wires.put(memory, [7]);
            });
        }
    }
    let (wires, memory, mut line) = line(wait);
    LATER.set(Some((wires, memory)));
    assert_eq!(line.read(&mut []), Ok(0));
    assert_eq!(WAITED.get(), 0, "nothing is asked for");
    let mut bytes = [0; 4];
    assert_eq!(line.read(&mut bytes), Ok(1));
    assert_eq!((bytes, WAITED.get()), ([7, 0, 0, 0], 3));
}

#[test]
fn what_is_written_goes_out_whole_and_in_order_while_the_next_is_collected() {
    let (wires, _, mut line) = line(never);
    let all: Vec<u8> = (0..5 * BUFFER + 17).map(|n| (n % 251) as u8).collect();
    for piece in all.chunks(333) {
        line.write_all(piece).unwrap();
    }
    line.flush().unwrap();
    while wires.is_sending() {}
    assert_eq!(*wires.sent.borrow(), all);
}

#[test]
fn nothing_is_sent_before_it_is_flushed_or_a_buffer_is_full_and_nothing_twice() {
    let (wires, _, mut line) = line(never);
    line.flush().unwrap();
    assert!(wires.on_their_way.take().is_none(), "there is nothing");
    line.write_all(&[1, 2, 3]).unwrap();
    assert!(wires.on_their_way.take().is_none());
    line.flush().unwrap();
    line.flush().unwrap();
    while wires.is_sending() {}
    assert_eq!(*wires.sent.borrow(), [1, 2, 3]);
    // As much as fits, and the rest with the next call.
    assert_eq!(line.write(&[5; BUFFER + 1]), Ok(BUFFER));
    assert!(wires.on_their_way.take().is_none());
    assert_eq!(line.write(&[6; 2]), Ok(2));
    while wires.is_sending() {}
    assert_eq!(wires.sent.borrow().len(), 3 + BUFFER);
}
