//! Which requests are new, which come again, and which come too late.

use trueaxis::link::Header;

/// The conversation with one host. Another hello ends it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Session {
    /// What the host called it in its hello.
    name: u32,
    /// What the host of the session before called that.
    retired: Option<u32>,
    /// What its requests carry; 0: none is open.
    id: u32,
    /// Sequence number of the last request.
    last: Option<u16>,
    /// Sessions so far.
    count: u32,
}

/// What to do with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// Do it.
    Next,
    /// It has been done: the same answer again.
    Again,
    /// One before it, delayed on its way: nobody waits for the answer.
    Old,
    /// Its session is not open.
    NoSession,
}

/// The number of a session, not 0: another one for each start, each name and each session, but for one
/// chance in 2³².
fn number(nonce: u64, name: u32, count: u32) -> u32 {
    // The finaliser of SplitMix64, which maps no two numbers to the same.
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

    /// Opens the session that a host calls `name`; returns its number and whether it is new. `nonce` is
    /// that of this start.
    ///
    /// A hello that comes again finds its session open; one of the session before is late, and
    /// nobody waits for its answer: `None`. One that is later still opens a session that nobody
    /// uses: no request that was delayed with it has its number, so none is done twice.
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

    /// Takes note of a request.
    pub(super) fn turn(&mut self, header: Header) -> Turn {
        if self.id == 0 || header.session != self.id {
            return Turn::NoSession;
        }
        match self.last {
            Some(last) if header.sequence == last => Turn::Again,
            // Less than half the numbers ahead.
            Some(last) if header.sequence.wrapping_sub(last) > u16::MAX / 2 => Turn::Old,
            _ => {
                self.last = Some(header.sequence);
                Turn::Next
            }
        }
    }
}
