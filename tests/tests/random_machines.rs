//! The scheme `exact` on machines nobody drew: it meets its tolerance, or says that it does not.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_host::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_host::machine::Machine;
use trueaxis_host::schemes::{Options, Scheme, find};
use trueaxis_host::target::Target;
use trueaxis_host::validate::{Region, Runtime, random_commands, verify};

/// A random serial machine: three or four linear axes and up to three rotary ones, each in either
/// branch and anywhere in it, with tilted frames and offsets, reversed or not.
fn machine(random: &mut Pcg64Mcg) -> String {
    const LETTERS: [&str; 9] = [
        "XYZ", "XYZA", "XYZB", "XYZC", "XYZAC", "XYZBC", "XYZAB", "XYZABC", "XYZUC",
    ];
    let letters = LETTERS[random.random_range(0..LETTERS.len())];
    let tilted = random.random::<bool>();
    let mut order: Vec<char> = letters.chars().collect();
    for i in (1..order.len()).rev() {
        order.swap(i, random.random_range(0..=i));
    }
    let mut text = String::from("name = \"any\"\n");
    for letter in order {
        let rotary = "ABC".contains(letter);
        let reach = if rotary { 15.0..120.0 } else { 50.0..400.0 };
        let (low, high) = (
            -random.random_range(reach.clone()),
            random.random_range(reach),
        );
        let branch = if random.random() { "tool" } else { "workpiece" };
        let mut three =
            |size: f64| -> [f64; 3] { std::array::from_fn(|_| random.random_range(-size..size)) };
        let (origin, tilt) = (three(60.0), three(50.0));
        let tilt = if tilted && rotary { tilt } else { [0.0; 3] };
        let reversed = random.random::<bool>();
        text += &format!(
            "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = [{low:?}, {high:?}]\n\
             reversed = {reversed}\norigin_mm = {origin:?}\norientation_deg = {tilt:?}\n"
        );
    }
    text += "[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -120.0]\n";
    if random.random() {
        text += "length_range_mm = [70.0, 190.0]\n";
    }
    text
}

/// Inter-axis errors, degrees 0 to 3, backlash.
const KINDS: usize = 6;

fn errors(machine: &Machine, random: &mut Pcg64Mcg) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    let (density, kinds) = (random.random_range(0.05..0.5), random.random::<u8>());
    let mut draw = || random.random_range(-1.0..1.0_f64);
    let letters: Vec<char> = machine
        .axes
        .iter()
        .map(|a| a.letter.char())
        .chain(['S'])
        .collect();
    for axis in letters {
        let index = machine.index(axis);
        // The largest position, in mm or rad: a coefficient of degree k has its effect there.
        let reach = index.map_or(1.0, |i| {
            machine.axes[i].travel.iter().fold(0.0_f64, |m, t| {
                m.max(machine.axes[i].to_kinematic(*t).abs())
            })
        });
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
                    _ => 1.0,
                };
                assert!(errors.set(
                    machine,
                    Parameter {
                        component,
                        axis,
                        kind
                    },
                    size * value / scale
                ));
            }
        }
    }
    errors
}

#[test]
fn exact_meets_its_tolerance_or_says_what_it_achieves() {
    let (mut corrected, mut met) = (0, 0);
    for seed in 0..45 {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let text = machine(&mut random);
        // Machines that cannot be corrected (parallel or dependent rotary axes) are refused.
        let Ok(machine) = Machine::from_toml(&text) else {
            continue;
        };
        let errors = errors(&machine, &mut random);
        let options = Options {
            target: Target {
                tables: 250,
                terms: 2000,
                ..Target::default()
            },
            ..Options::default()
        };
        let started = std::time::Instant::now();
        let found = find(&machine, &errors, &Scheme::default(), &options)
            .unwrap_or_else(|e| panic!("seed {seed}: {e}\n{text}{:?}", errors.parameters));
        let elapsed = started.elapsed();
        let announced = found.structure_error.unwrap();
        let mut draft = found.draft;
        for axis in &mut draft.axes {
            axis.value_bound = 100.0;
        }
        let blob = draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        let commands = random_commands(&machine, &errors, Region::Travel, 400, 5).unwrap();
        let proof = verify(&machine, &errors, &runtime, &[0.0; 6], &commands, || {}).unwrap();
        let achieved = (proof.difference_um / 0.05).max(proof.difference_urad / 0.05);
        println!(
            "{seed}: {}, {} errors, {} tables, {} terms: {achieved:.2} of the tolerance, {:.2} announced, {elapsed:.1?}",
            machine.topology(),
            errors.parameters.len(),
            runtime.compensation().tables(),
            draft.terms.len(),
            announced
        );
        // Above 0.4 the scheme itself says that the tolerance is not met; how far, the
        // verification of the blob tells (here `achieved`), with which every `compile` ends.
        assert!(
            achieved <= 1.0 || announced > 0.4,
            "neither met nor announced, seed {seed}:\n{text}{:?}",
            errors.parameters
        );
        corrected += 1;
        met += usize::from(achieved <= 1.0);
    }
    println!("{met} of {corrected} machines met the tolerance");
    assert!(
        corrected >= 20,
        "only {corrected} machines can be corrected"
    );
}
