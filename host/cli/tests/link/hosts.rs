//! Two hosts on one line.

use crate::command::{Files, desktop, has};
use crate::served::Served;
use crate::specimen::blob;
use crate::wire::Wire;
use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;
use trueaxis::link::{Refusal, Request, SlotState, Upload};
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::device::GIVEN_UP;
use trueaxis_firmware::mock_flash::MockFlash;
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_link::{Client, LinkError, Port, Tcp, UploadError, flash};

/// One line that several programs write to. Each reads all answers, including those for others.
#[derive(Clone)]
struct Common(Rc<RefCell<Wire>>);

impl Port for Common {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.borrow_mut().send(bytes)
    }
    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.0.borrow_mut().receive(buffer, patience)
    }
    fn wait(&mut self, time: Duration) {
        self.0.borrow_mut().wait(time);
    }
}

fn common() -> Common {
    let flash = MockFlash::new(24).with_while_busy(WhileBusy::DualBank);
    Common(Rc::new(RefCell::new(Wire::good(Desktop::start(
        flash, 0.001,
    )))))
}

fn connect(line: &Common) -> Client<Common> {
    Client::connect_with(line.clone(), Duration::from_secs(5), 60)
        .unwrap()
        .0
}

fn announced(blob: &[u8]) -> (u32, u32) {
    let word = |at: usize| u32::from_le_bytes(blob[at..at + 4].try_into().unwrap());
    (word(8), word(12))
}

#[test]
fn the_second_of_two_uploads_is_refused_and_the_first_one_goes_through() {
    let line = common();
    let [first, second] = [0.1, 0.2].map(|scale| blob("m", b"XY", scale, 500));
    let (mut one, mut two) = (connect(&line), connect(&line));
    let (length, crc) = announced(&first);
    while !matches!(
        one.upload(&Request::Begin { length, crc }).unwrap(),
        Upload::Receiving { .. }
    ) {}
    for (number, bytes) in first.chunks(900).enumerate() {
        // In the middle of it, after every chunk, the other host intervenes.
        let controller = two.hello().unwrap();
        let refused = flash(&mut two, &controller, &second, false, true, &());
        let Err(UploadError::Link(LinkError::Refused(Refusal::Uploading { wait }))) = refused
        else {
            panic!("{refused:?}")
        };
        assert!(wait <= GIVEN_UP && wait + 2 > GIVEN_UP, "{wait}");
        let offset = 900 * number as u32;
        one.upload(&Request::Chunk { offset, bytes }).unwrap();
    }
    one.upload(&Request::CommitInUse { force: false }).unwrap();
    // Then the second host may do so.
    let controller = two.hello().unwrap();
    assert!(
        matches!(controller.slots[0].state, SlotState::Valid { crc: found, .. } if found == crc)
    );
    let outcome = flash(&mut two, &controller, &second, false, false, &()).unwrap();
    assert!(!outcome.already);
    assert_eq!(one.hello().unwrap().slots[1].erased, 1);
}

#[test]
fn a_host_that_only_looks_does_not_disturb_an_upload() {
    let line = common();
    let first = blob("m", b"XY", 0.1, 500);
    let (mut one, mut two) = (connect(&line), connect(&line));
    let (length, crc) = announced(&first);
    let mut next = 0;
    while next < length {
        assert!(matches!(
            two.status().unwrap().upload,
            Upload::None | Upload::Erasing { .. } | Upload::Receiving { .. }
        ));
        match one.upload(&Request::Begin { length, crc }).unwrap() {
            Upload::Receiving { next: wanted, .. } => next = wanted,
            _ => continue,
        }
        let bytes = &first[next as usize..first.len().min(next as usize + 300)];
        if !bytes.is_empty() {
            two.hello().unwrap();
            one.upload(&Request::Chunk {
                offset: next,
                bytes,
            })
            .unwrap();
        }
    }
    two.hello().unwrap();
    one.upload(&Request::Commit { force: false }).unwrap();
    assert!(two.hello().unwrap().slots[0].state.is_valid());
}

#[test]
fn the_command_says_who_is_before_it_and_for_how_long() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let address = served.port.strip_prefix("tcp:").unwrap();
    let (mut client, _) = Client::connect(Tcp::open(address).unwrap()).unwrap();
    let (length, crc) = (1000, 1);
    client.upload(&Request::Begin { length, crc }).unwrap();
    drop(client);
    let text = files.flash(2, "first", &served.port, "");
    has(
        &text,
        "another upload is under way; if it has died, it is given up in",
    );
    has(&text, "wait until the other upload is over");
    served.take();
}
