//! A client and a device in one thread, connected by an unreliable line. Time passes while they wait.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;
use trueaxis_firmware::desktop::Desktop;
use trueaxis_link::Port;

/// Error rates of the line: chances in 256 for each frame.
#[derive(Clone, Copy, Debug)]
pub struct Badness {
    pub lost: u8,
    pub doubled: u8,
    pub delayed: u8,
    pub damaged: u8,
}

impl Badness {
    pub const NONE: Self = Self {
        lost: 0,
        doubled: 0,
        delayed: 0,
        damaged: 0,
    };
}

/// One direction of the line.
struct Direction {
    badness: Badness,
    seed: u64,
    /// Bytes of an incomplete frame.
    partial: Vec<u8>,
    /// Delayed frames, with the number of frames that overtake them.
    late: Vec<(u8, Vec<u8>)>,
}

impl Direction {
    fn new(badness: Badness, seed: u64) -> Self {
        Self {
            badness,
            seed,
            partial: vec![],
            late: vec![],
        }
    }

    /// SplitMix64.
    fn draw(&mut self) -> u64 {
        self.seed = self.seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.seed;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^ (bits >> 31)
    }

    fn happens(&mut self, chance: u8) -> bool {
        (self.draw() & 0xFF) < u64::from(chance)
    }

    /// What arrives when `bytes` are sent.
    fn pass(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut arrived = vec![];
        for &byte in bytes {
            self.partial.push(byte);
            if byte == 0 {
                let frame = std::mem::take(&mut self.partial);
                self.frame(frame, &mut arrived);
            }
        }
        arrived
    }

    fn frame(&mut self, mut frame: Vec<u8>, arrived: &mut Vec<u8>) {
        let Badness {
            lost,
            doubled,
            delayed,
            damaged,
        } = self.badness;
        let copies = 1 + usize::from(self.happens(doubled));
        if self.happens(damaged) {
            let place = self.draw() as usize % frame.len();
            match self.draw() % 3 {
                0 => frame[place] ^= 1 << (self.draw() % 8),
                1 => frame.truncate(place),
                // Like a frame that ends too early, followed by garbage.
                _ => frame[place] = 0,
            }
        }
        for _ in 0..copies {
            if self.happens(lost) {
                continue;
            }
            if self.happens(delayed) {
                let overtaking = (self.draw() % 8) as u8 + 1;
                self.late.push((overtaking, frame.clone()));
            } else {
                arrived.extend(&frame);
            }
        }
        self.late.retain_mut(|(overtaking, frame)| {
            *overtaking -= 1;
            if *overtaking == 0 {
                arrived.extend(&*frame);
            }
            *overtaking > 0
        });
    }
}

/// A device and the line to it.
pub struct Wire {
    /// `None` only during a restart.
    desktop: Option<Desktop>,
    to_device: Direction,
    to_host: Direction,
    inbox: VecDeque<u8>,
    /// The device loses power after this many sends.
    restart_after: Option<u32>,
}

impl Wire {
    pub fn new(desktop: Desktop, badness: Badness, seed: u64) -> Self {
        Self {
            desktop: Some(desktop),
            to_device: Direction::new(badness, seed),
            to_host: Direction::new(badness, seed ^ 0x5555),
            inbox: VecDeque::new(),
            restart_after: None,
        }
    }

    pub fn good(desktop: Desktop) -> Self {
        Self::new(desktop, Badness::NONE, 0)
    }

    pub fn restart_after(mut self, sends: u32) -> Self {
        self.restart_after = Some(sends);
        self
    }

    pub fn desktop(&mut self) -> &mut Desktop {
        self.desktop.as_mut().unwrap()
    }

    pub fn into_desktop(self) -> Desktop {
        self.desktop.unwrap()
    }

    fn turns(&mut self, turns: u32) {
        for _ in 0..turns {
            let desktop = self.desktop.as_mut().unwrap();
            desktop.turn(1);
            let sent = std::mem::take(&mut desktop.line.outgoing);
            self.inbox.extend(self.to_host.pass(&sent));
        }
    }
}

impl Port for Wire {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let arrived = self.to_device.pass(bytes);
        self.desktop().line.incoming.extend(arrived);
        if let Some(left) = &mut self.restart_after {
            *left = left.saturating_sub(1);
            if *left == 0 {
                self.restart_after = None;
                self.desktop = self.desktop.take().map(Desktop::restart);
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
        // Until everything has been read and the servo has executed the longest motion.
        for _ in 0..100 {
            self.turns(1);
            if !self.inbox.is_empty() {
                break;
            }
        }
        let count = buffer.len().min(self.inbox.len());
        for (place, byte) in buffer.iter_mut().zip(self.inbox.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn wait(&mut self, _: Duration) {
        self.turns(50);
    }
}
