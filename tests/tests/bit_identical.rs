//! One blob gives equal bits in every build and on every machine.
//!
//! `cargo xtask test` runs this in debug and in release, `cargo xtask prove` in release with `-C target-cpu=native`, always
//! against the same stored hashes.

use trueaxis_tests::golden::{blob, hash_of_evaluation, hash_of_servo, load};

#[track_caller]
fn same(found: u64, stored: u64) {
    assert!(
        found == stored,
        "the bits have changed: 0x{found:016X} instead of 0x{stored:016X}"
    );
}

#[test]
fn corrections_of_the_huron_are_the_stored_bits() {
    same(
        hash_of_evaluation(&load(&blob("huron-13"))),
        0x4ADC_0DF7_995B_E224,
    );
}

#[test]
fn corrections_of_everything_are_the_stored_bits() {
    same(
        hash_of_evaluation(&load(&blob("everything"))),
        0x79C8_34D7_09FA_66CD,
    );
}

#[test]
fn corrections_through_the_servo_are_the_stored_bits() {
    same(
        hash_of_servo(&load(&blob("everything"))),
        0x0E18_6A4F_E9CE_D856,
    );
}

#[test]
fn corrections_with_a_lag_are_the_stored_bits() {
    same(hash_of_servo(&load(&blob("lag"))), 0x7144_4B95_FF54_56AD);
}
