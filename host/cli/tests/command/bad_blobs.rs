//! Damaged blobs are refused, with cause and remedy.

use crate::program::{Folder, blob, example, refused};

/// CRC-32/ISO-HDLC of everything except the checksum itself, bit by bit.
fn checksum(blob: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in blob[..12].iter().chain(&blob[16..]) {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
        }
    }
    !crc
}

/// Checks that every command that reads a blob refuses the damaged one.
fn refuses(damage: impl Fn(&mut Vec<u8>), cause: &str, remedy: &str) {
    let mut bytes = std::fs::read(blob("huron")).unwrap();
    damage(&mut bytes);
    let folder = Folder::new();
    let path = folder.file("x.trax", bytes);
    let positions = folder.file("p.csv", "X,Y,Z,A,C\n1,2,3,4,5\n");
    let (machine, errors) = (
        example("huron-k2x8/machine.toml"),
        example("huron-k2x8/errors-13.toml"),
    );
    let parts = ["x.trax: ", cause, remedy];
    refused(&["inspect", &path], &parts);
    refused(&["eval", &path, "--positions", &positions], &parts);
    refused(&["verify", &machine, &errors, &path], &parts);
}

#[test]
fn what_is_no_blob_is_refused() {
    refuses(
        Vec::clear,
        "fewer than the 16 bytes of a header",
        "give a .trax file",
    );
    refuses(
        |b| b[0] = b'X',
        "it does not start with TRAX",
        "give a .trax file",
    );
}

#[test]
fn another_version_is_refused() {
    refuses(
        |b| b[4] = 9,
        "format version 9 is unknown here",
        "the version of trueaxis that wrote the file",
    );
}

#[test]
fn damaged_bytes_are_refused() {
    // The length of the notes, which nothing but the checksum covers.
    refuses(
        |b| b[6] ^= 1,
        "the checksum does not match",
        "copy it again",
    );
    refuses(
        |b| b.truncate(b.len() - 1),
        "the header states",
        "copy it again",
    );
    refuses(|b| b.push(0), "the header states", "copy it again");
    refuses(
        |b| *b.last_mut().unwrap() ^= 1,
        "the checksum does not match",
        "copy it again",
    );
}

#[test]
fn wrong_contents_with_a_right_checksum_are_refused() {
    let seal = |b: &mut Vec<u8>| {
        let crc = checksum(b);
        b[12..16].copy_from_slice(&crc.to_le_bytes());
    };
    // The header is followed by the length of the name, the name, and the policy.
    let policy = 16 + 1 + "Huron K2X8-Five".len();
    refuses(
        |b| {
            b[policy] = 7;
            seal(b);
        },
        "variant 7 is unknown: policy",
        "the version of trueaxis that wrote the file",
    );
    refuses(
        |b| {
            let end = b.len();
            b[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
            seal(b);
        },
        "is not finite",
        "the program that wrote the file is wrong",
    );
}

#[test]
fn a_blob_of_another_machine_is_refused() {
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    refused(
        &["verify", &machine, &errors, &blob("huron")],
        &[
            "made for the machine `Huron K2X8-Five`, not for the machine `Kolibri`",
            "from which the blob was compiled",
        ],
    );
    let (machine, errors) = (
        example("huron-k2x8/machine.toml"),
        example("huron-k2x8/errors-13.toml"),
    );
    refused(
        &["verify", &machine, &errors, &blob("length")],
        &["made for auxiliary inputs the tool length, not for no auxiliary inputs"],
    );
}

#[test]
fn a_blob_with_other_axes_is_refused() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(example("huron-k2x8/machine.toml")).unwrap();
    let other = text
        .replace("name = \"Z\"", "name = \"W\"")
        .replace("wCAYFXZSt", "wCAYFXWSt");
    let machine = folder.file("machine.toml", other);
    let errors = folder.file(
        "errors.toml",
        "machine = \"Huron K2X8-Five\"\n[parameters]\nEXX1 = 1e-5\n",
    );
    refused(
        &["verify", &machine, &errors, &blob("huron")],
        &["made for the axes YACXZ, not for the axes YACXW"],
    );
}
