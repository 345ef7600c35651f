//! Distinguishes new requests from repeated and late ones.

use trueaxis::link::Header;

/// The session with one host. Another hello ends it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Session {
    /// Name of the session, from the host's hello.
    name: u32,
    /// Name of the previous session.
    retired: Option<u32>,
    /// Session number carried by its requests; 0 if none is open.
    id: u32,
    /// Sequence number of the last request.
    last: Option<u16>,
    /// Number of sessions so far.
    count: u32,
}

/// What to do with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// It is new: execute it.
    Next,
    /// It was already executed: send the same answer again.
    Again,
    /// An earlier request, delayed on its way: nobody waits for the answer.
    Old,
    /// The session of the request is not open.
    NoSession,
}

/// Session number, never 0. It differs for each start, name and session, except with a probability of one in 2³².
fn number(nonce: u64, name: u32, count: u32) -> u32 {
    // The finaliser of SplitMix64, which is a bijection.
    let mix = |mut bits: u64| {
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^ (bits >> 31)
    };
    let session = u64::from(name) << 32 | u64::from(count);
    let number = (mix(mix(nonce) ^ session) >> 32) as u32;
    number.max(1)
}

impl Session {
    pub(super) const NONE: Self = Self {
        name: 0,
        retired: None,
        id: 0,
        last: None,
        count: 0,
    };

    /// Opens the session that a host calls `name`; returns its number and whether it is new. `nonce` is that of this
    /// start.
    ///
    /// A repeated hello finds its session open. A hello of the previous session is late, and nobody waits for its
    /// answer: `None`. An even later one opens a session that nobody uses. Requests delayed together with it do not
    /// have its number, so none is executed twice.
    pub(super) fn open(&mut self, nonce: u64, name: u32) -> Option<(u32, bool)> {
        let new = self.id == 0 || self.name != name;
        if new {
            if self.retired == Some(name) {
                return None;
            }
            self.retired = (self.id != 0).then_some(self.name);
            self.count = self.count.wrapping_add(1);
            self.name = name;
            self.id = number(nonce, name, self.count);
            self.last = None;
        }
        Some((self.id, new))
    }

    /// Classifies and records a request.
    pub(super) fn turn(&mut self, header: Header) -> Turn {
        if self.id == 0 || header.session != self.id {
            return Turn::NoSession;
        }
        match self.last {
            Some(last) if header.sequence == last => Turn::Again,
            // Ahead by less than half the range of numbers.
            Some(last) if header.sequence.wrapping_sub(last) > u16::MAX / 2 => Turn::Old,
            _ => {
                self.last = Some(header.sequence);
                Turn::Next
            }
        }
    }
}
