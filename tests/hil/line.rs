//! Garbage on the line, truncated or damaged frames, and another version do no harm.

use crate::board::Setup;
use crate::cases;
use crate::same::evaluations;
use crate::{Failure, Seen};
use std::time::{Duration, Instant};
use trueaxis::link::{
    Framed, Header, MOST_BODY, MOST_WIRE, PROTOCOL, Received, Receiver, Request, encode,
    encode_frame,
};
use trueaxis_link::{Client, Port, Tcp, flash};
use trueaxis_tests::Fixed;

/// Number of noise bytes.
const NOISE: usize = 64 * 1024;
/// Number of damaged frames of each kind.
const FRAMES: usize = 300;

pub fn run(setup: &Setup<'_>) -> Seen {
    let case = cases::compile(setup, "huron-13")?;
    let c = case.load()?;
    let mut board = setup.board("line")?;
    board.start()?;
    board.flash(&case.path, &["--activate"])?;
    let mut random = Fixed::new(13);

    let mut line = board.line()?;
    let noise: Vec<u8> = (0..NOISE).map(|_| random.bits() as u8).collect();
    say(&mut line, &noise)?;
    for _ in 0..FRAMES {
        let frame = frame(&mut random)?;
        // Cut off, with and without its end; one bit flipped; sent twice in a row.
        let cut = random.bits() as usize % frame.len();
        say(&mut line, &frame[..cut])?;
        say(&mut line, &[0])?;
        let mut flipped = frame.clone();
        let bit = random.bits() as usize % (8 * frame.len());
        flipped[bit / 8] ^= 1 << (bit % 8);
        say(&mut line, &flipped)?;
        say(&mut line, &frame)?;
        say(&mut line, &frame)?;
    }
    other_version(&mut line)?;
    drop(line);

    let (mut client, controller) = board.connect()?;
    if controller.active.is_none() || controller.fault.is_some() {
        return Err(format!("{controller:?}").into());
    }
    let status = client.status()?;
    if status.enabled || status.dry_run || status.updates != 0 {
        return Err(format!("something was taken for a request: {status:?}").into());
    }
    evaluations(&mut client, &c, &mut random)?;
    drop(client);

    // An upload over a bad line: lost or damaged data is requested again.
    let next = cases::compile(setup, "kolibri-12")?;
    let line = Noisy {
        line: board.line()?,
        random,
    };
    let (mut client, controller) = Client::connect_with(line, Duration::from_millis(150), 60)?;
    flash(&mut client, &controller, &next.blob, true, true, &())?;
    drop(client);
    let (mut client, _) = board.connect()?;
    evaluations(&mut client, &next.load()?, &mut Fixed::new(14))?;
    Ok(format!(
        "{NOISE} bytes of noise, {} bad frames, another version: answered or dropped; \
         an upload over a bad line",
        4 * FRAMES
    ))
}

/// Sends bytes and discards the answer.
fn say(line: &mut Tcp, bytes: &[u8]) -> Result<(), Failure> {
    for piece in bytes.chunks(1024) {
        line.send(piece)?;
        let mut answers = [0; 4096];
        line.receive(&mut answers, Duration::from_millis(1))?;
    }
    Ok(())
}

/// A request of a session that does not exist.
fn frame(random: &mut Fixed) -> Result<Vec<u8>, Failure> {
    let header = Header {
        session: random.bits(),
        sequence: random.bits() as u16,
    };
    let bytes: Vec<u8> = (0..random.bits() % 200)
        .map(|_| random.bits() as u8)
        .collect();
    let request = match random.bits() % 6 {
        0 => Request::Enable(true),
        1 => Request::DryRun(true),
        2 => Request::Motion(&bytes),
        3 => Request::Chunk {
            offset: random.bits(),
            bytes: &bytes,
        },
        4 => Request::Commit { force: true },
        _ => Request::Begin {
            length: random.bits() % 100_000,
            crc: random.bits(),
        },
    };
    let (mut scratch, mut wire) = ([0; MOST_BODY], [0; MOST_WIRE]);
    let sent = encode(header, &request, &mut scratch, &mut wire).map_err(|e| format!("{e:?}"))?;
    Ok(sent.to_vec())
}

/// A frame of a future version is answered with the supported versions.
fn other_version(line: &mut Tcp) -> Result<(), Failure> {
    let mut wire = [0; 1 + MOST_WIRE];
    let content = [PROTOCOL + 40, 1, 2, 3, 4, 5, 6];
    let sent = encode_frame(&content, &[], &mut wire[1..]).map_err(|e| format!("{e:?}"))?;
    let length = 1 + sent.len();
    let mut receiver = Receiver::new();
    // The previous frames are still being answered, and the line has no flow control, so this one may be lost.
    let end = Instant::now() + Duration::from_secs(20);
    while Instant::now() < end {
        line.send(&wire[..length])?;
        let mut answer = [0; 4096];
        let count = line.receive(&mut answer, Duration::from_millis(100))?;
        for &byte in &answer[..count] {
            if receiver.push(byte) == Received::Frame
                && let Some(Framed::VersionAnswer(versions)) = receiver.frame()
            {
                if versions.lowest <= PROTOCOL && PROTOCOL <= versions.highest {
                    return Ok(());
                }
                return Err(format!("{versions:?}").into());
            }
        }
    }
    Err("another version is not answered".into())
}

/// A line that loses and damages bytes, in both directions.
struct Noisy {
    line: Tcp,
    random: Fixed,
}

impl Noisy {
    /// One of about 3000 bytes is damaged, however they are split: one in three chunks of an upload does not arrive.
    fn spoil(&mut self, bytes: &mut Vec<u8>) {
        if self.random.bits() as usize % 3000 >= bytes.len() {
            return;
        }
        let at = self.random.bits() as usize % bytes.len();
        match self.random.bits() % 3 {
            0 => bytes[at] ^= 1 << (self.random.bits() % 8),
            1 => drop(bytes.remove(at)),
            _ => bytes.truncate(at),
        }
    }
}

impl Port for Noisy {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let mut bytes = bytes.to_vec();
        self.spoil(&mut bytes);
        self.line.send(&bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        let count = self.line.receive(buffer, patience)?;
        let mut bytes = buffer[..count].to_vec();
        self.spoil(&mut bytes);
        buffer[..bytes.len()].copy_from_slice(&bytes);
        Ok(bytes.len())
    }
}
