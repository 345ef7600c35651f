use std::vec;
use std::vec::Vec;

use trueaxis::link::{
    END, Framed, Header, MOST_BODY, MOST_WIRE, PROTOCOL, Received, Receiver, Refusal, Reply,
    Request, VersionAnswer, encode,
};

use crate::desktop::Desktop;
use crate::device::tests::{blob, flashed};
use crate::link::{BootNonce, Link};
use crate::mock_flash::MockFlash;

fn desktop() -> Desktop {
    Desktop::start(MockFlash::new(8), 0.001)
}

fn frame(session: u32, sequence: u16, request: &impl serde::Serialize) -> Vec<u8> {
    let header = Header { session, sequence };
    let (mut scratch, mut out) = ([0; MOST_BODY], [0; MOST_WIRE]);
    encode(header, request, &mut scratch, &mut out)
        .unwrap()
        .to_vec()
}

/// The response to these bytes.
fn exchange(desktop: &mut Desktop, bytes: &[u8]) -> Vec<u8> {
    desktop.line.incoming.extend(bytes);
    while !desktop.line.incoming.is_empty() {
        desktop.turn(1);
    }
    std::mem::take(&mut desktop.line.outgoing)
}

/// Calls `look` with every frame in `bytes`.
fn frames(bytes: &[u8], mut look: impl FnMut(Framed<'_>)) -> usize {
    let mut receiver = Receiver::new();
    let mut count = 0;
    for &byte in bytes {
        if receiver.push(byte) == Received::Frame {
            look(receiver.frame().unwrap());
            count += 1;
        }
    }
    count
}

/// The only reply in `bytes`, to this request.
fn reply(bytes: &[u8], wanted: (u32, u16)) -> Vec<u8> {
    let mut bodies = vec![];
    frames(bytes, |framed| match framed {
        Framed::Message(Header { session, sequence }, body) => {
            assert_eq!((session, sequence), wanted);
            bodies.push(body.to_vec());
        }
        other => panic!("{other:?}"),
    });
    assert_eq!(bodies.len(), 1);
    bodies.remove(0)
}

fn session(desktop: &mut Desktop, name: u32) -> u32 {
    let answer = exchange(desktop, &frame(name, 0, &Request::Hello));
    let body = reply(&answer, (name, 0));
    match postcard::from_bytes(&body).unwrap() {
        Reply::Hello(hello) => hello.session,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_request_that_comes_again_is_answered_again_and_not_done_again() {
    let mut desktop = desktop();
    let s = session(&mut desktop, 17);
    let enable = frame(s, 1, &Request::Enable(true));
    let first = exchange(&mut desktop, &enable);
    assert_eq!(
        postcard::from_bytes(&reply(&first, (s, 1))),
        Ok(Reply::Done)
    );
    // Corrections are disabled otherwise: the repetition does not undo that.
    desktop.servo.lock(|side| side.enable(false));
    assert_eq!(exchange(&mut desktop, &enable), first);
    assert!(!desktop.servo.lock(|side| side.snapshot().enabled));
    // The next one counts, and then the first one is too late.
    let status = frame(s, 2, &Request::Status);
    assert_ne!(exchange(&mut desktop, &status), first);
    assert_eq!(exchange(&mut desktop, &enable), []);
    // The numbers start again after the last one.
    let mut sequence = 2_u16;
    for _ in 0..20 {
        sequence = sequence.wrapping_add(9000);
        let status = frame(s, sequence, &Request::Status);
        reply(&exchange(&mut desktop, &status), (s, sequence));
    }
}

#[test]
fn only_the_last_session_is_open() {
    let mut desktop = desktop();
    let none = frame(99, 1, &Request::Status);
    let refused = Reply::Refused(Refusal::NoSession);
    let answer = reply(&exchange(&mut desktop, &none), (99, 1));
    assert_eq!(postcard::from_bytes(&answer), Ok(refused.clone()));
    let first = session(&mut desktop, 17);
    assert_eq!(session(&mut desktop, 17), first, "the same hello again");
    let second = session(&mut desktop, 18);
    assert_ne!(first, second);
    let old = frame(first, 1, &Request::Enable(true));
    let answer = reply(&exchange(&mut desktop, &old), (first, 1));
    assert_eq!(postcard::from_bytes(&answer), Ok(refused));
    // The first hello arrives late: it is not answered, and the second session stays open.
    let late = frame(17, 0, &Request::Hello);
    assert_eq!(exchange(&mut desktop, &late), []);
    let status = frame(second, 1, &Request::Status);
    reply(&exchange(&mut desktop, &status), (second, 1));
}

#[test]
fn another_version_is_answered_with_ours() {
    let mut desktop = desktop();
    // Any frame of that version: the bytes after the version byte are ignored.
    for body in [&[][..], &[1; 100]] {
        let mut plain = vec![PROTOCOL + 1];
        plain.extend(body);
        let check = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&plain);
        plain.extend(check.to_le_bytes());
        let mut bytes = vec![];
        // COBS, one block at a time; no byte of `plain` needs another encoding.
        for block in plain.split(|byte| *byte == 0) {
            bytes.push(block.len() as u8 + 1);
            bytes.extend(block);
        }
        bytes.push(END);
        let answer = exchange(&mut desktop, &bytes);
        let count = frames(&answer, |framed| {
            let versions = VersionAnswer {
                lowest: PROTOCOL,
                highest: PROTOCOL,
            };
            assert_eq!(framed, Framed::VersionAnswer(versions));
        });
        assert_eq!(count, 1);
    }
}

#[test]
fn what_cannot_be_read_is_refused_and_garbage_is_dropped() {
    let mut desktop = desktop();
    let s = session(&mut desktop, 17);
    // A request of later firmware, and one that is cut off within its body.
    for (sequence, body) in [(1_u16, &[200_u8][..]), (2, &[3, 5, 20])] {
        struct Raw<'a>(&'a [u8]);
        impl serde::Serialize for Raw<'_> {
            fn serialize<S: serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                use serde::ser::SerializeTuple;
                let mut tuple = s.serialize_tuple(self.0.len())?;
                for byte in self.0 {
                    tuple.serialize_element(byte)?;
                }
                tuple.end()
            }
        }
        let answer = exchange(&mut desktop, &frame(s, sequence, &Raw(body)));
        let answer = reply(&answer, (s, sequence));
        assert_eq!(
            postcard::from_bytes(&answer),
            Ok(Reply::Refused(Refusal::Unknown))
        );
    }
    let whole = frame(s, 3, &Request::Enable(true));
    for length in 1..whole.len() - 1 {
        let mut cut = whole[..length].to_vec();
        cut.push(END);
        assert_eq!(exchange(&mut desktop, &cut), []);
    }
    let garbage = desktop.link.counts().garbage;
    assert_eq!(garbage as usize, whole.len() - 2);
    // Longer than any frame.
    assert_eq!(exchange(&mut desktop, &[7; 5000]), []);
    assert_eq!(exchange(&mut desktop, &[END]), []);
    assert_eq!(desktop.link.counts().garbage, garbage + 1);
    assert!(!desktop.servo.lock(|side| side.snapshot().enabled));
    reply(&exchange(&mut desktop, &whole), (s, 3));
    assert!(desktop.servo.lock(|side| side.snapshot().enabled));
}

#[test]
fn a_motion_is_answered_once_the_servo_has_taken_it_and_not_before() {
    let mut desktop = desktop();
    flashed(&mut desktop, &blob("m", b"XY", 0.1));
    let s = session(&mut desktop, 17);
    let before = exchange(&mut desktop, &frame(s, 1, &Request::Status));
    reply(&before, (s, 1));
    let motion = frame(s, 2, &Request::Motion(&[0; 8]));
    let look = |desktop: &mut Desktop, bytes: &[u8], ticks| {
        desktop.line.incoming.extend(bytes);
        while !desktop.line.incoming.is_empty() {
            desktop.turn(0);
        }
        desktop.turn(ticks);
        desktop.turn(0);
        std::mem::take(&mut desktop.line.outgoing)
    };
    // Repeated while it waits: neither executed again nor answered with an earlier answer.
    for _ in 0..3 {
        assert_eq!(look(&mut desktop, &motion, 0), []);
    }
    let answer = look(&mut desktop, &[], 1);
    let body = reply(&answer, (s, 2));
    assert!(matches!(postcard::from_bytes(&body), Ok(Reply::Motion(_))));
    let updates = desktop.servo.lock(|side| side.counters().updates);
    assert_eq!(look(&mut desktop, &motion, 1), answer);
    assert_eq!(desktop.servo.lock(|side| side.counters().updates), updates);
    assert_eq!(desktop.link.counts().repeated, 1);
    // Another session: nobody waits any more.
    let motion = frame(s, 3, &Request::Motion(&[0; 8]));
    assert_eq!(look(&mut desktop, &motion, 0), []);
    session(&mut desktop, 18);
    assert_eq!(look(&mut desktop, &[], 3), []);
}

/// A serial driver that reports this many errors, then works.
struct Noisy(u32, crate::desktop::Line);

impl embedded_io::ErrorType for Noisy {
    type Error = embedded_io::ErrorKind;
}

impl embedded_io::ReadReady for Noisy {
    fn read_ready(&mut self) -> Result<bool, Self::Error> {
        Ok(true)
    }
}

impl embedded_io::Read for Noisy {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        if self.0 > 0 {
            self.0 -= 1;
            return Err(embedded_io::ErrorKind::Other);
        }
        let Ok(count) = self.1.read(buffer);
        Ok(count)
    }
}

impl embedded_io::Write for Noisy {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        let Ok(count) = self.1.write(bytes);
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

#[test]
fn errors_of_the_driver_are_counted_and_the_next_frame_is_answered() {
    let Desktop {
        mut device,
        mut link,
        ..
    } = desktop();
    let mut port = Noisy(3, crate::desktop::Line::default());
    port.1.incoming.extend(frame(17, 0, &Request::Hello));
    for errors in 1..=3 {
        link.poll(&mut port, &mut device).unwrap();
        assert_eq!(link.counts().errors, errors);
    }
    link.poll(&mut port, &mut device).unwrap();
    assert_eq!(link.counts().errors, 3);
    assert_eq!(link.counts().frames, 1);
    reply(&port.1.outgoing, (17, 0));
}

/// A source that gives a preset nonce.
struct Given(Option<u64>);

impl BootNonce for Given {
    fn boot_nonce(&mut self) -> Option<u64> {
        self.0
    }
}

/// Sends hello and enables the corrections; returns all bytes sent by the host.
fn recorded(desktop: &mut Desktop) -> Vec<u8> {
    let number = session(desktop, 17);
    let enable = frame(number, 1, &Request::Enable(true));
    let done = reply(&exchange(desktop, &enable), (number, 1));
    assert_eq!(postcard::from_bytes(&done), Ok(Reply::Done));
    assert!(desktop.servo.lock(|side| side.snapshot().enabled));
    [frame(17, 0, &Request::Hello), enable].concat()
}

#[test]
fn recorded_frames_of_one_start_are_not_obeyed_after_the_next() {
    let mut desktop = desktop();
    let mut recordings: Vec<Vec<u8>> = vec![];
    for _ in 0..20 {
        for recording in &recordings {
            exchange(&mut desktop, recording);
            assert!(!desktop.servo.lock(|side| side.snapshot().enabled));
        }
        recordings.push(recorded(&mut desktop));
        desktop = desktop.restart();
    }
}

#[test]
fn a_session_of_another_nonce_is_not_open() {
    // As produced by a generator and by a counter.
    for [one, other] in [[7, 8], [u64::MAX, 0], [1 << 63, 0xFEED_F00D_1234_5678]] {
        let mut desktop = desktop();
        desktop.link = Link::new(&mut Given(Some(one)));
        let recording = recorded(&mut desktop);
        // With the same nonce nothing distinguishes the two starts.
        let mut again = self::desktop();
        again.link = Link::new(&mut Given(Some(one)));
        exchange(&mut again, &recording);
        assert!(again.servo.lock(|side| side.snapshot().enabled));
        // Hello again and again, as an attacker would: the session never equals the recorded one.
        for name in 0..50 {
            let mut restarted = self::desktop();
            restarted.link = Link::new(&mut Given(Some(other)));
            for name in 0..name {
                session(&mut restarted, name);
            }
            exchange(&mut restarted, &recording);
            assert!(!restarted.servo.lock(|side| side.snapshot().enabled));
        }
    }
}

#[test]
fn without_a_nonce_no_session_is_opened_and_nothing_is_done() {
    let mut with = desktop();
    let recording = recorded(&mut with);
    let mut desktop = desktop();
    desktop.link = Link::new(&mut Given(None));
    exchange(&mut desktop, &recording);
    for number in [0, 1, 17] {
        exchange(&mut desktop, &frame(number, 1, &Request::Enable(true)));
    }
    assert!(!desktop.servo.lock(|side| side.snapshot().enabled));
    let answer = exchange(&mut desktop, &frame(18, 0, &Request::Hello));
    let refused = Reply::Refused(Refusal::NoNonce);
    let body = reply(&answer, (18, 0));
    assert_eq!(postcard::from_bytes(&body), Ok(refused));
}
