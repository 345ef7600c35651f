//! Input files that are too large, and lines that are too long to print.

use std::fs::File;
use std::time::{Duration, Instant};

use trueaxis::LARGEST_BLOB;

use crate::program::{Folder, blob, example, refused, trueaxis};

/// A file of zeros that takes no space on the disk.
fn sparse(folder: &Folder, name: &str, length: u64) -> String {
    let path = folder.at(name);
    File::create(&path).unwrap().set_len(length).unwrap();
    path
}

#[test]
fn a_file_of_6_gb_is_refused_before_it_is_read() {
    let folder = Folder::new();
    let large = sparse(&folder, "x.large", 6_000_000_000);
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-10.toml"),
    );
    let huron = blob("huron");
    let out = folder.at("out");
    for arguments in [
        &["inspect", &large][..],
        &["verify", &machine, &errors, &large],
        &["eval", &huron, "--positions", &large],
        &["compile", &large, &errors, "-o", &out],
        &["compile", &machine, &large, "-o", &out],
        &["linuxcnc", "check", &large, &huron],
    ] {
        let started = Instant::now();
        refused(
            arguments,
            &[
                "x.large: cannot be read: it is larger than 64 MiB",
                "right file",
            ],
        );
        assert!(started.elapsed() < Duration::from_secs(10), "{arguments:?}");
    }
}

#[test]
fn a_file_of_64_mib_is_read_and_one_more_byte_is_not() {
    let folder = Folder::new();
    let largest = LARGEST_BLOB as u64;
    refused(
        &["inspect", &sparse(&folder, "most.trax", largest)],
        &["it does not start with TRAX"],
    );
    refused(
        &["inspect", &sparse(&folder, "more.trax", largest + 1)],
        &["it is larger than 64 MiB"],
    );
}

#[test]
fn a_message_shows_at_most_200_characters_of_a_line() {
    let folder = Folder::new();
    let long = "x".repeat(2_000_000);
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-10.toml"),
    );
    let text = std::fs::read_to_string(&machine).unwrap();
    let out = folder.at("out");
    let huron = blob("huron");
    let key = folder.file("key.toml", format!("{text}\n{long} = 1\n"));
    let name = folder.file("errors.toml", format!("machine = \"{long}\"\n"));
    let cell = folder.file("p.csv", format!("X,Y,Z,A,C\n1,2,{long},4,5\n"));
    let column = folder.file("q.csv", format!("X,Y,{long},A,C\n1,2,3,4,5\n"));
    for arguments in [
        &["compile", &key, &errors, "-o", &out][..],
        &["compile", &machine, &name, "-o", &out],
        &["eval", &huron, "--positions", &cell],
        &["eval", &huron, "--positions", &column],
    ] {
        let output = trueaxis(arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        // The message, the line, and the frame around them.
        assert!(said.len() < 4000, "{} bytes", said.len());
        assert!(!said.contains(&"x".repeat(201)), "{said}");
        assert!(said.contains("line"), "{said}");
    }
}
