//! Eq. 1 of the source document, N = 4R + 2P + 6, beside the rank of what is to be identified.

use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::{Problem, identify};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::MinimalParameters;
use trueaxis_model::machine::Machine;
use trueaxis_tests::Fixed;
use trueaxis_tests::observed::{Strategy, observed};

/// Axes in the order of the file: those with `w` in the workpiece branch, others in the tool branch.
const LAYOUTS: [&str; 10] = [
    "Xw Y Z",
    "Yw Xw Z",
    "Xw Yw Cw Z",
    "Yw Aw Cw X Z",
    "Xw Bw Cw Z Y",
    "X Y Z C A",
    "Xw Cw Z Y B",
    "Yw Xw Z W A C",
    "Yw Cw X Z B A",
    "Xw Aw Cw Y Z B",
];

fn machine(layout: &str) -> Machine {
    let axis = |name: &str| {
        let branch = if name.ends_with('w') {
            "workpiece"
        } else {
            "tool"
        };
        let letter = &name[..1];
        let half = if "ABC".contains(letter) { 80.0 } else { 250.0 };
        format!(
            "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = [-{half:?}, {half:?}]\n"
        )
    };
    let axes: String = layout.split(' ').map(axis).collect();
    let text = format!(
        "name = \"{layout}\"\n{axes}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [11.0, -7.0, -120.0]\n"
    );
    Machine::from_toml(&text).unwrap()
}

/// All location errors of all axes.
fn locations(machine: &Machine) -> Vec<Parameter> {
    let letters = machine.axes.iter().map(|axis| axis.letter.char());
    let all = letters.flat_map(|axis| {
        (0..6).map(move |component| Parameter {
            component,
            axis,
            kind: ParameterKind::Inter,
        })
    });
    all.collect()
}

#[test]
fn the_minimal_number_of_parameters_is_the_rank_of_ten_layouts() {
    let nothing = Probings::default();
    let artefact = Artefact::default();
    for layout in LAYOUTS {
        let machine = machine(layout);
        let minimal = MinimalParameters::of(&machine);
        let mut random = Fixed::new(3);
        let mut plan = Strategy::new(&machine, "");
        for _ in 0..80 {
            let position = plan.anywhere(0.95, &mut random);
            plan.add("point", "tracker", &position, "", 1.0);
        }
        let perfect = ErrorModel::perfect(&machine);
        let parameters = locations(&machine);
        let mut errors = perfect.clone();
        for parameter in &parameters {
            let size = if parameter.is_angular() { 1e-5 } else { 1e-2 };
            assert!(errors.set(&machine, *parameter, random.within(-size, size)));
        }
        let all = observed(&machine, &errors, &plan, "", 0.0, 1);
        let problem = Problem::new(&machine, &nothing, &artefact, &parameters, &perfect).with(&all);
        // Points do not show the three angles of the tool.
        let found = problem.foresee(&perfect).unwrap();
        assert_eq!(found.rank + 3, minimal.all(), "{layout}");
        // The place and orientation of the tracker and the tool point alone.
        let free = Problem::new(&machine, &nothing, &artefact, &[], &perfect).with(&all);
        let set_up = free.foresee(&perfect).unwrap().rank;
        assert_eq!(found.rank - set_up, minimal.locations(), "{layout}");
        let identified = identify(&problem, Default::default()).unwrap();
        assert_eq!(
            identified.parameters.len(),
            found.parameters.len(),
            "{layout}"
        );
    }
}
