//! Any bytes as a program: never a panic, and nothing is written that the check does not accept.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;
use trueaxis::AlignedBlob;
use trueaxis_host::gcode::check::check;
use trueaxis_host::gcode::modal::Units;
use trueaxis_host::gcode::offsets::System;
use trueaxis_host::gcode::{Corrector, Dialect, Options, Rules, Setup, Tables, stream};
use trueaxis_host::validate::Runtime;

fn blob() -> &'static AlignedBlob {
    static BLOB: OnceLock<AlignedBlob> = OnceLock::new();
    BLOB.get_or_init(|| AlignedBlob::from_bytes(include_bytes!("../../shared/examples/huron-13.trax")))
}

fuzz_target!(|data: &[u8]| {
    let Some((mode, program)) = data.split_first() else {
        return;
    };
    let Ok(runtime) = Runtime::load(blob()) else {
        return;
    };
    let Ok(tables) = Tables::new(runtime.compensation()) else {
        return;
    };
    let mut setup = Setup {
        units: Some(Units::Millimetre),
        ..Setup::default()
    };
    for axis in 0..6 {
        if let Some([low, high]) = tables.travel[axis] {
            setup.start.set(axis, 0.5 * (low + high));
        }
    }
    setup.systems.insert(1, System::default());
    setup.systems.insert(
        2,
        System {
            rotation: 30.0,
            ..System::default()
        },
    );
    setup.tools.insert(1, [0.0; 9]);
    let dialect = [Dialect::LinuxCnc, Dialect::Grbl, Dialect::Fanuc][usize::from(mode % 3)];
    let rules = Rules {
        dialect,
        setup,
        axes: tables.axes,
        block_delete: Some(mode & 0x40 != 0),
        least_increments: mode & 0x80 != 0,
        ..Rules::default()
    };
    let options = Options::default();
    let Ok(mut corrector) = Corrector::new(&rules, &tables, None, options, None) else {
        return;
    };
    let mut written = Vec::new();
    if stream::correct(program, &mut written, &mut corrector, |_| {}).is_ok() {
        let found = check(program, written.as_slice(), &rules, &tables, None, None, options);
        if let Err(error) = found {
            panic!("{error}:\n{}", String::from_utf8_lossy(&written));
        }
    }
});
