//! Checks with every short stream of bytes (`cargo xtask prove`).

use super::frame::{Received, Receiver};
use std::vec::Vec;

/// Every stream of three bytes after every one of some beginnings, and then a frame end: the receiver returns, and
/// a frame only where there are as many bytes as its check needs.
#[test]
fn every_three_bytes_after_any_beginning_are_taken() {
    let beginnings: [&[u8]; 5] = [&[], &[1], &[0], &[2, 7], &[255, 1, 2]];
    for beginning in beginnings {
        for bits in 0..1_u32 << 24 {
            let [a, b, c, _] = bits.to_le_bytes();
            let mut receiver = Receiver::new();
            let stream: Vec<u8> = [beginning, &[a, b, c, 0]].concat();
            for byte in stream {
                let received = receiver.push(byte);
                assert!(received != Received::Frame || receiver.frame().is_some());
            }
        }
    }
}
