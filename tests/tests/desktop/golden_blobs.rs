//! Blobs written by released versions of the format stay readable and keep their meaning.
//!
//! Their evaluation is checked by `bit_identical.rs`.

use trueaxis::{Notes, SampleFormat, VERSION};
use trueaxis_tests::golden::{blob, everything, lag, load};

#[test]
fn the_golden_blobs_of_version_1_load() {
    for (name, machine, axes) in [
        ("everything", "Everything", "XYZC"),
        ("lag", "Everything", "XYZC"),
        ("huron-13", "Huron K2X8-Five", "YACXZ"),
        ("router-10", "Router", "YXZ"),
        ("table-head-13", "Table and head", "YCXZB"),
    ] {
        let blob = blob(name);
        assert_eq!(blob[4], 1, "{name} is of another version");
        let c = load(&blob);
        assert_eq!(c.machine(), machine);
        let letters: String = c.axes().iter().map(|a| char::from(a.name)).collect();
        assert_eq!(letters, axes);
        assert_eq!(c.blob_len(), blob.len());
    }
}

#[test]
fn a_golden_blob_with_one_of_everything_holds_what_was_put_in() {
    let blob = blob("everything");
    let c = load(&blob);
    let draft = everything();
    assert_eq!(c.policy(), draft.policy);
    assert_eq!(c.axes(), draft.axes);
    assert_eq!(c.auxiliaries(), draft.auxiliaries);
    assert_eq!(c.terms().len(), draft.terms.len());
    for (view, term) in c.terms().zip(&draft.terms) {
        let found = (view.output, view.weight, view.limits, view.factors);
        assert_eq!(
            found,
            (term.output, term.weight, term.limits, &term.factors[..])
        );
    }
    // An integer is off by half a scale, where the scale is the largest value / 32767.
    let close = |found: f32, put: f32, format, largest: f32| match format {
        SampleFormat::F32 => found == put,
        SampleFormat::I16 => (found - put).abs() <= 0.501 / 32767.0 * largest,
    };
    let mut table = 0;
    assert_eq!(c.banks().len(), draft.banks.len());
    for (bank, put) in c.banks().iter().zip(&draft.banks) {
        assert_eq!(
            (bank.input, bank.start, bank.step),
            (put.input, put.start, put.step)
        );
        let kind = (bank.modulo, bank.direction, bank.interpolation, bank.format);
        assert_eq!(
            kind,
            (put.modulo, put.direction, put.interpolation, put.format)
        );
        for column in &put.columns {
            let largest = column.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            for (point, &value) in column.iter().enumerate() {
                assert!(close(
                    c.sample(table, point).unwrap(),
                    value,
                    bank.format,
                    largest
                ));
            }
            table += 1;
        }
    }
    assert_eq!(c.tables(), table);
    assert_eq!(c.grids().len(), draft.grids.len());
    for (number, (grid, put)) in c.grids().iter().zip(&draft.grids).enumerate() {
        assert_eq!(
            (&grid.axes[..], &grid.outputs[..]),
            (&put.axes[..], &put.outputs[..])
        );
        let largest = put.values.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        for (place, &value) in put.values.iter().enumerate() {
            let (node, output) = (place / put.outputs.len(), place % put.outputs.len());
            assert!(close(
                c.grid_sample(number, node, output).unwrap(),
                value,
                grid.format,
                largest
            ));
        }
    }
}

#[test]
fn what_is_written_today_is_version_1_byte_for_byte() {
    assert_eq!(VERSION, 1, "a new version needs golden blobs of its own");
    assert_eq!(&*everything().encode().unwrap(), &*blob("everything"));
    assert_eq!(&*lag().encode().unwrap(), &*blob("lag"));
}

#[test]
fn blobs_with_and_without_a_lag_differ_in_its_rate_alone() {
    let (with, without) = (blob("lag"), blob("everything"));
    let name = without.windows(4).position(|w| w == b"\x03bed").unwrap();
    // Kind, name, reference, and then the rate.
    assert_eq!(without[name - 1], 1);
    let rate = name + 8..name + 12;
    assert_eq!(with[rate.clone()], 0.015_625_f32.to_le_bytes());
    assert_eq!(without[rate.clone()], [0; 4]);
    assert_eq!(with[16..rate.start], without[16..rate.start]);
    assert_eq!(with[rate.end..], without[rate.end..]);
    assert_eq!(load(&with).auxiliaries()[1].sensor.lag_rate, 0.015_625);
}

#[test]
fn the_notes_of_a_golden_blob_are_what_was_put_in() {
    assert_eq!(Notes::of(&blob("everything")), Some(everything().notes));
    assert_eq!(Notes::of(&blob("huron-13")), None);
}
