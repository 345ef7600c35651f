//! What a host and a controller of version 0.1 said to each other (`tests/frozen/0.1/link.txt`) is still answered, and still
//! understood.

use crate::command::desktop;
use crate::wire::Wire;
use std::collections::{HashMap, VecDeque};
use std::io;
use std::time::Duration;
use trueaxis::link::{
    EvaluateRow, Framed, Hello, MOST_WIRE, PROTOCOL, Received, Receiver, Refusal, Reply, Request,
    Slot, WhileBusy, encode_frame,
};
use trueaxis::{AlignedBlob, Inputs, Travel, Travelling, WeightError};
use trueaxis_link::{Client, LinkError, Port};
use trueaxis_tests::golden::load;

/// Two bodies, without what belongs to the session that they were sent in.
struct Exchange {
    /// How often the host let time pass before it.
    waits: usize,
    request: Vec<u8>,
    answer: Vec<u8>,
}

/// The body of the one frame in these bytes.
fn body(bytes: &[u8]) -> Vec<u8> {
    let mut receiver = Receiver::new();
    let last = bytes.iter().map(|&byte| receiver.push(byte)).last();
    assert_eq!(last, Some(Received::Frame));
    match receiver.frame() {
        Some(Framed::Message(_, body)) => body.to_vec(),
        other => panic!("{other:?}"),
    }
}

/// The lines of the file in its order: `> ` bytes to the controller, `< ` bytes to the host, `wait`.
fn recorded() -> Vec<Exchange> {
    let text = include_str!("../../../../tests/frozen/0.1/link.txt");
    let frame = |line: &str, sign: &str| {
        let digits = line.strip_prefix(sign).unwrap_or_else(|| panic!("{line}"));
        let byte = |k| u8::from_str_radix(&digits[k..k + 2], 16).unwrap();
        body(&(0..digits.len()).step_by(2).map(byte).collect::<Vec<_>>())
    };
    let (mut exchanges, mut waits) = (vec![], 0);
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line == "wait" {
            waits += 1;
            continue;
        }
        exchanges.push(Exchange {
            waits,
            request: frame(line, "> "),
            answer: frame(lines.next().unwrap(), "< "),
        });
        waits = 0;
    }
    exchanges
}

/// A frame of this version around a body.
fn framed(session: u32, sequence: u16, body: &[u8]) -> Vec<u8> {
    let head = [
        &[PROTOCOL][..],
        &session.to_le_bytes(),
        &sequence.to_le_bytes(),
    ]
    .concat();
    let mut out = [0; MOST_WIRE];
    encode_frame(&head, body, &mut out).unwrap().to_vec()
}

#[test]
fn a_host_of_version_0_1_gets_the_answers_that_it_got_then() {
    let mut wire = Wire::good(desktop(WhileBusy::DualBank));
    let mut session = 1;
    for (number, exchange) in recorded().into_iter().enumerate() {
        for _ in 0..exchange.waits {
            wire.wait(Duration::ZERO);
        }
        let request = framed(session, number as u16, &exchange.request);
        wire.send(&request).unwrap();
        let mut buffer = [0; 2048];
        let count = wire.receive(&mut buffer, Duration::ZERO).unwrap();
        let answer = body(&buffer[..count]);
        let was = postcard::from_bytes(&exchange.answer).unwrap();
        match (postcard::from_bytes(&answer).unwrap(), was) {
            (Reply::Hello(now), Reply::Hello(was)) => {
                session = now.session;
                // Each session has its number, each firmware its version.
                let (session, firmware) = (was.session, was.firmware);
                let now = Hello {
                    session,
                    firmware,
                    ..now
                };
                assert_eq!(now, was);
            }
            (now, was) => assert_eq!(answer, exchange.answer, "{now:?} in place of {was:?}"),
        }
    }
}

/// A controller of version 0.1, as far as it was recorded: gives the next answer to the same request.
struct Recorded {
    answers: HashMap<Vec<u8>, VecDeque<Vec<u8>>>,
    inbox: Vec<u8>,
}

impl Port for Recorded {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut receiver = Receiver::new();
        for &byte in bytes {
            if receiver.push(byte) == Received::Frame
                && let Some(Framed::Message(header, body)) = receiver.frame()
            {
                let answer = self.answers.get_mut(body).and_then(VecDeque::pop_front);
                let answer = answer.unwrap_or_else(|| panic!("{body:?} was not asked then"));
                let answer = framed(header.session, header.sequence, &answer);
                self.inbox.extend(answer);
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
        let count = self.inbox.len();
        buffer[..count].copy_from_slice(&self.inbox);
        self.inbox.clear();
        Ok(count)
    }
}

#[test]
fn a_controller_of_version_0_1_is_understood() {
    let exchanges = recorded();
    // What it was given to correct with.
    let mut blob = vec![];
    let mut answers: HashMap<_, VecDeque<_>> = HashMap::new();
    for exchange in exchanges {
        if let Request::Chunk { bytes, .. } = postcard::from_bytes(&exchange.request).unwrap() {
            blob.extend(bytes);
        }
        answers
            .entry(exchange.request)
            .or_default()
            .push_back(exchange.answer);
    }
    let blob = AlignedBlob::from_bytes(&blob);
    let compensation = load(&blob);
    let inbox = vec![];
    let (mut client, empty) = Client::connect(Recorded { answers, inbox }).unwrap();
    assert_eq!(
        (&*empty.firmware, &*empty.board),
        ("trueaxis-firmware 0.1.0", "desktop")
    );
    assert_eq!((empty.formats, empty.period), ([1, 1], 0.001));
    assert_eq!((&*empty.machine, empty.active), ("", None));
    // Once it was written, and once it was in use.
    let written = client.hello().unwrap();
    assert!(written.slots[0].state.is_valid());
    let controller = client.hello().unwrap();
    assert_eq!((&*controller.machine, &*controller.axes), ("m", "XY"));
    assert_eq!(
        (controller.auxiliaries, controller.active),
        (1, Some(Slot::A))
    );
    let weights = client.weights().unwrap();
    assert_eq!(
        (weights.len(), weights[0].term, weights[0].value),
        (1, 1, 0.25)
    );
    let at_start = [(); 2].map(|()| client.at_start().unwrap());
    assert_eq!(at_start.map(|at| at.in_use), [Some(Slot::A); 2]);
    assert_eq!(at_start.map(|at| at.enable), [false, true]);
    assert!(client.health().unwrap().unwrap().healthy);
    let Err(LinkError::Refused(refusal)) = client.set(&Request::SetWeight {
        term: 0,
        value: 0.25,
    }) else {
        panic!("the weight of a term that is not adjustable was set");
    };
    assert_eq!(refusal, Refusal::Weight(WeightError::NotAdjustable));
    // The corrections are those of the blob, to the last bit.
    let row = row();
    let mut weights = compensation.weights();
    weights.set(1, 0.25).unwrap();
    let right = compensation.evaluate(&row.inputs, &row.travelling, &weights);
    assert_eq!(client.evaluate(&[row], 2, 1).unwrap(), [right]);
}

/// Where the recorded host asked for corrections.
fn row() -> EvaluateRow<[f32; 16], [Travel; 16]> {
    let mut q = [0.0; 16];
    q[..2].copy_from_slice(&[137.5, -20.0]);
    let mut inputs = Inputs::at(q);
    inputs.auxiliaries[0] = 61.5;
    let travelling = Travelling([Travel::Unknown; 16]);
    EvaluateRow { inputs, travelling }
}
