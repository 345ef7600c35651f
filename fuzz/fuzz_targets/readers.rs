//! Arbitrary text as each of the files that others write: never a panic, and what is accepted has finite numbers. The first
//! byte chooses the reader.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use trueaxis_direct::formats::{displacements, radii, runs};
use trueaxis_export::height_map::HeightMap;
use trueaxis_export::isg::IsgParameters;
use trueaxis_export::klipper::{bed_mesh, twist};
use trueaxis_export::reprapfirmware;
use trueaxis_identify::formats::{observations, probings, temperatures};
use trueaxis_model::machine::Machine;

static MACHINE: LazyLock<Machine> = LazyLock::new(|| {
    let text = include_str!("../../examples/kolibri/machine.toml");
    Machine::from_toml(text).expect("an example")
});

fn finite(map: &HeightMap) {
    let touches = map.touches();
    assert!(touches.iter().flatten().all(|value| value.is_finite()));
}

fuzz_target!(|data: &[u8]| {
    let Some((reader, text)) = data.split_first() else {
        return;
    };
    let text = &*String::from_utf8_lossy(text);
    match reader % 11 {
        0 => {
            if let Ok(map) = bed_mesh::read(text, None) {
                finite(&map);
            }
        }
        1 => {
            if let Ok(map) = reprapfirmware::read(text) {
                finite(&map);
            }
        }
        2 => drop(twist::read(text)),
        3 => {
            if let Ok(parameters) = IsgParameters::read_csv(text) {
                drop(parameters.motions(&MACHINE));
            }
        }
        4 => {
            if let Ok(parameters) = IsgParameters::read_etalon(text) {
                drop(parameters.motions(&MACHINE));
            }
        }
        5 => drop(observations::read(text, "fuzz.csv", &MACHINE)),
        6 => drop(probings::read(text, &MACHINE, false)),
        7 => drop(runs::read(text, &MACHINE)),
        8 => drop(radii::read(text)),
        9 => drop(temperatures::read(text)),
        _ => drop(displacements::read(text)),
    }
});
