//! Seeds of everything that is drawn, from the seed of a round.

use rand::Rng;
use rand::SeedableRng;
use rand::rngs::ChaCha12Rng;
use trueaxis_tests::Fixed;

/// What is drawn. Each has a stream of its own, because what is public must not reveal what is hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The machine file.
    Machine,
    /// Errors.
    Errors,
    /// The places of measurements.
    Strategy,
    /// The noise of readings.
    Noise,
    /// The positions to answer.
    Positions,
    /// Where instruments stand.
    Setups,
}

/// The seed for one purpose on one machine of a round. ChaCha with the seed of the round as its key: from one of them
/// neither that nor another can be computed.
#[must_use]
pub fn of(round: u64, machine: usize, purpose: Purpose) -> u64 {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&round.to_le_bytes());
    let mut random = ChaCha12Rng::from_seed(key);
    random.set_stream(8 * machine as u64 + purpose as u64);
    random.next_u64()
}

/// Random numbers for one purpose on one machine of a round.
#[must_use]
pub fn random(round: u64, machine: usize, purpose: Purpose) -> Fixed {
    let mut random = Fixed::new(of(round, machine, purpose));
    // Similar seeds begin with similar numbers.
    for _ in 0..16 {
        random.bits();
    }
    random
}
