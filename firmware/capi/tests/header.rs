//! `trueaxis.h` matches the source. `UPDATE_HEADER=1` rewrites it; review the diff.

use std::fs;
use std::path::Path;
use trueaxis::{Conditions, Room, Usual};

const COMMITTED: &str = include_str!("../trueaxis.h");

#[test]
fn every_condition_has_a_constant() {
    let documented = COMMITTED.split("\n Condition: ").skip(1);
    let found: Vec<(&str, u32)> = documented
        .map(|text| {
            let defined = text.lines().find_map(|line| line.strip_prefix("#define "));
            let (name, value) = defined.unwrap().split_once(' ').unwrap();
            let bit = value.trim_matches(['(', ')']).strip_prefix("1 << ");
            (name, bit.map_or(0, |bit| bit.parse().unwrap()))
        })
        .collect();
    for bit in 0..16 {
        let name = Conditions(1 << bit).names().next();
        let constants = found.iter().filter(|(_, of)| *of == bit).count();
        assert_eq!(
            constants,
            usize::from(name.is_some()),
            "bit {bit} of the runtime's conditions ({name:?}) needs a constant in src/facts.rs, documented as \
             `Condition: …`; there are {found:?}"
        );
    }
}

#[test]
fn the_capacities_of_the_header_are_the_usual_ones() {
    let usual = [
        ("TRUEAXIS_AXES", Usual::AXES),
        ("TRUEAXIS_BANKS", Usual::BANKS),
        ("TRUEAXIS_TABLES", Usual::TABLES),
        ("TRUEAXIS_TERMS", Usual::TERMS),
        ("TRUEAXIS_GRIDS", Usual::GRIDS),
    ];
    for (name, expected) in usual {
        let line = COMMITTED.lines().find_map(|line| {
            line.strip_prefix("#define ")?
                .strip_prefix(name)?
                .strip_prefix(' ')
        });
        let number = line.and_then(|line| line.split(' ').next());
        assert_eq!(number, Some(&*expected.to_string()), "{name}");
    }
}

#[test]
fn the_header_is_that_of_the_source() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::Builder::new()
        .with_crate(folder)
        .with_config(config)
        .generate()
        .unwrap();
    let mut bytes = Vec::new();
    bindings.write(&mut bytes);
    let header = String::from_utf8(bytes).unwrap();
    let path = folder.join("trueaxis.h");
    if std::env::var_os("UPDATE_HEADER").is_some() {
        fs::write(&path, &header).unwrap();
    }
    let committed = fs::read_to_string(&path).unwrap();
    assert_eq!(committed, header, "write it with UPDATE_HEADER=1");
}
