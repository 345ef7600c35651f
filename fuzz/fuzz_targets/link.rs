//! Arbitrary bytes on the line, as they are or in valid frames: no panic, the active slot does not change, corrections
//! stay finite, and the next host gets an answer.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use trueaxis::link::{
    Framed, Header, MOST_BODY, MOST_WIRE, Received, Receiver, Reply, Request, Slot, encode,
};
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::mock_flash::MockFlash;
use trueaxis_firmware::slots::{Progress, Slots, WhileBusy};
use trueaxis_fuzz::{Bytes, Raw};

const BLOCK: usize = 512;
const BLOCKS: usize = 16;
type Flash = MockFlash<8, BLOCK>;

/// Two compensations of the five-axis machine.
static BLOBS: [&[u8]; 2] = [
    include_bytes!("../../tests/golden/v1/huron-13.trax"),
    include_bytes!("../../tests/golden/v1/everything.trax"),
];

/// A flash with the first blob in slot A.
static IMAGE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut slots = Slots::open(Flash::new(BLOCKS).with_while_busy(WhileBusy::DualBank));
    let header = trueaxis::Header::read(BLOBS[0]).expect("a blob");
    let mut progress = slots.begin(header.length, header.crc).expect("it fits");
    while matches!(progress, Progress::Erasing { .. }) {
        progress = slots.erase_step().expect("the flash works");
    }
    slots.write(0, BLOBS[0]).expect("the flash works");
    slots.commit(|_| true).expect("the flash works");
    slots.close().image().to_vec()
});

fuzz_target!(|data: &[u8]| {
    let mut input = Bytes(data);
    let mode = input.byte();
    let while_busy = match mode & 1 {
        0 => WhileBusy::DualBank,
        _ => WhileBusy::Standstill,
    };
    let mut flash = Flash::new(BLOCKS).with_while_busy(while_busy);
    flash.image().copy_from_slice(&IMAGE);
    let mut desktop = Desktop::start(flash, 0.001);
    if mode & 2 == 0 {
        desktop.line.incoming.extend(input.0);
        while !desktop.line.incoming.is_empty() {
            desktop.turn(1);
            check(&desktop);
        }
    } else {
        requests(&mut desktop, &mut input);
    }
    let session = hello(&mut desktop, 2);
    assert!(session != 0);
    drop(desktop.stop());
});

/// All chunks of a blob, whether it accepts them or not.
fn upload(desktop: &mut Desktop<8, BLOCK>, blob: &[u8]) {
    for (k, bytes) in blob.chunks(900).enumerate() {
        let offset = 900 * k as u32;
        let _ = trueaxis_firmware::link::Controller::answer(
            &mut desktop.device,
            &Request::Chunk { offset, bytes },
            &mut [0; MOST_BODY],
        );
    }
}

/// Valid frames of one session with arbitrary bodies, and requests that reach deeper code.
fn requests(desktop: &mut Desktop<8, BLOCK>, input: &mut Bytes<'_>) {
    let session = hello(desktop, 1);
    for sequence in 0..64 {
        if input.is_empty() {
            break;
        }
        let blob = BLOBS[usize::from(input.flag())];
        let trueaxis::Header { length, crc } = trueaxis::Header::read(blob).expect("a blob");
        let slot = [Slot::A, Slot::B][usize::from(input.flag())];
        let force = input.flag();
        match input.below(12) {
            0 => send(desktop, session, sequence, &Request::Begin { length, crc }),
            1 => upload(desktop, blob),
            2 => send(desktop, session, sequence, &Request::Commit { force }),
            3 => {
                // A fade or a ramp lasts several hundred periods.
                let request = Request::Activate { slot, force };
                send(desktop, session, sequence, &request);
                desktop.turn(1000);
            }
            4 => (0..input.byte()).for_each(|_| desktop.turn(1)),
            5 => send(desktop, session, sequence, &Request::Referenced(0xFFFF)),
            6 => send(desktop, session, sequence, &Request::Enable(force)),
            7 => {
                let rows: Vec<u8> = (0..40).map(|_| input.byte()).collect();
                send(desktop, session, sequence, &Request::Motion(&rows));
            }
            8 => desktop.standstill.set(force),
            9 => {
                let rows: Vec<u8> = (0..24).map(|_| input.byte()).collect();
                send(desktop, session, sequence, &Request::Evaluate(&rows));
            }
            _ => {
                let length = usize::from(input.byte());
                let body: Vec<u8> = (0..length).map(|_| input.byte()).collect();
                send(desktop, session, sequence, &Raw(&body));
            }
        }
        desktop.turn(3);
        check(desktop);
    }
}

fn send(
    desktop: &mut Desktop<8, BLOCK>,
    session: u32,
    sequence: u16,
    message: &impl serde::Serialize,
) {
    let (mut scratch, mut out) = ([0; MOST_BODY], [0; MOST_WIRE]);
    let header = Header { session, sequence };
    let bytes = encode(header, message, &mut scratch, &mut out).expect("it fits");
    desktop.line.incoming.extend(bytes.iter());
    while !desktop.line.incoming.is_empty() {
        desktop.turn(1);
    }
}

/// Invariants.
fn check(desktop: &Desktop<8, BLOCK>) {
    let slots = desktop.device.slots();
    if let Some(active) = slots.active() {
        let blob = slots.blob(active).expect("the active slot is valid");
        assert!(BLOBS.contains(&blob), "it holds one of the blobs");
    }
    let dq = desktop.servo.lock(|side| side.last().dq);
    assert!(dq.iter().all(|dq| dq.is_finite()));
}

/// A new host connects: it must get an answer, whatever happened before.
fn hello(desktop: &mut Desktop<8, BLOCK>, name: u32) -> u32 {
    desktop.line.outgoing.clear();
    // Ends any incomplete frame.
    desktop.line.incoming.push_back(0);
    send(desktop, name, 0, &Request::Hello);
    let mut receiver = Receiver::new();
    let mut session = 0;
    for &byte in &desktop.line.outgoing {
        if receiver.push(byte) == Received::Frame
            && let Some(Framed::Message(header, body)) = receiver.frame()
            && header.session == name
            && let Ok(Reply::Hello(hello)) = postcard::from_bytes(body)
        {
            session = hello.session;
        }
    }
    session
}
