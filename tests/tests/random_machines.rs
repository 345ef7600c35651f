//! The scheme `exact` on machines nobody drew: it meets its tolerance, or says that it does not.

use proptest::prelude::*;
use trueaxis_host::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_host::machine::Machine;
use trueaxis_host::schemes::exact::{Minimize, Options, compile};
use trueaxis_host::validate::{Region, Runtime, random_commands, verify};

/// A random serial machine: three linear axes and up to three rotary ones in either branch, in
/// any order, with tilted frames and offsets, reversed or not.
fn machine() -> impl Strategy<Value = String> {
    let axis = (
        any::<bool>(),
        any::<bool>(),
        prop::array::uniform3(-60.0..60.0_f64),
        prop::array::uniform3(-50.0..50.0_f64),
        (50.0..400.0_f64, 50.0..400.0_f64),
        any::<u32>(),
    );
    let letters = prop::sample::select(vec!["XYZ", "XYZA", "XYZB", "XYZC", "XYZAC", "XYZBC", "XYZAB", "XYZABC", "XYZUC"]);
    (letters, prop::collection::vec(axis, 6), any::<bool>(), prop::option::of(20.0..80.0_f64)).prop_map(
        |(letters, axes, tilted, length)| {
            let mut order: Vec<usize> = (0..letters.len()).collect();
            order.sort_by_key(|i| axes[*i].5);
            let mut text = String::from("name = \"any\"\n");
            for i in order {
                let (tool, reversed, origin, tilt, (low, high), _) = &axes[i];
                let letter = &letters[i..=i];
                let rotary = "ABC".contains(letter);
                let (low, high) = if rotary { (low * 0.3, high * 0.3) } else { (*low, *high) };
                let branch = if *tool { "tool" } else { "workpiece" };
                let tilt = if tilted && rotary { *tilt } else { [0.0; 3] };
                text += &format!(
                    "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = [{:?}, {high:?}]\n\
                     reversed = {reversed}\norigin_mm = {origin:?}\norientation_deg = {tilt:?}\n",
                    -low
                );
            }
            text += "[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -120.0]\n";
            if let Some(length) = length {
                text += &format!("length_range_mm = [{:?}, {:?}]\n", 120.0 - length, 120.0 + length);
            }
            text
        },
    )
}

/// How large each kind of error is, in parts of what machines have.
const KINDS: usize = 6;

fn errors(machine: &Machine, sizes: &[f64], density: f64, kinds: u8) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    let mut next = sizes.iter().cycle();
    let mut draw = || *next.next().unwrap();
    let letters: Vec<char> = machine.axes.iter().map(|a| a.letter.char()).chain(['S']).collect();
    for axis in letters {
        let index = machine.index(axis);
        // The largest position, in mm or rad: a coefficient of degree k has its effect there.
        let reach = index.map_or(1.0, |i| machine.axes[i].travel.iter().fold(0.0_f64, |m, t| m.max(machine.axes[i].to_kinematic(*t).abs())));
        for component in 0..6 {
            let size = if component < 3 { 0.03 } else { 8e-5 };
            for kind in 0..KINDS {
                let (value, there) = (draw(), draw());
                if there.abs() > density || kinds >> kind & 1 == 0 {
                    continue;
                }
                let kind = match (kind, index) {
                    (0, _) => ParameterKind::Inter,
                    (_, None) => continue,
                    (5, _) => ParameterKind::Backlash,
                    (k, _) => ParameterKind::Degree(k as u8 - 1),
                };
                let scale = match kind {
                    ParameterKind::Degree(k) => reach.powi(i32::from(k)),
                    ParameterKind::Backlash => 5.0,
                    ParameterKind::Inter => 1.0,
                };
                assert!(errors.set(machine, Parameter { component, axis, kind }, size * value / scale));
            }
        }
    }
    errors
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, max_shrink_iters: 0, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn exact_meets_its_tolerance_or_says_what_it_achieves(
        text in machine(),
        sizes in prop::collection::vec(-1.0..1.0_f64, 97),
        density in 0.05..0.5_f64,
        kinds in any::<u8>(),
    ) {
        // Machines that cannot be corrected (parallel or dependent rotary axes) are refused.
        let Ok(machine) = Machine::from_toml(&text) else { return Ok(()) };
        let errors = errors(&machine, &sizes, density, kinds);
        let options = Options { minimize: Minimize::Cost, capacity: (250, 4096), ..Options::default() };
        let found = compile(&machine, &errors, &options).unwrap();
        let mut draft = found.draft;
        for axis in &mut draft.axes {
            axis.value_bound = 100.0;
        }
        let blob = draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        let commands = random_commands(&machine, &errors, Region::Travel, 400, 5).unwrap();
        let proof = verify(&machine, &errors, &runtime, &[0.0; 6], &commands, || {}).unwrap();
        let achieved = (proof.difference_um / 0.05).max(proof.difference_urad / 0.05);
        // The promise: below 1, or announced. What is announced comes from 160 other positions,
        // so the largest of these 400 may exceed it; twice covers that.
        prop_assert!(
            achieved <= 1.0 || (found.structure_error > 0.4 && achieved < 2.0 * found.structure_error + 1.0),
            "{achieved} of the tolerance achieved, {} announced, {:?}\n{text}",
            found.structure_error,
            proof
        );
    }
}
