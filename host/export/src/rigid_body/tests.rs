use super::*;

/// Machines with each kind of branch, and a tilted axis.
pub(crate) const MACHINES: [(&str, &str); 4] = [
    (
        include_str!("../../../../examples/router/machine.toml"),
        include_str!("../../../../examples/router/errors-10.toml"),
    ),
    (
        include_str!("../../../../examples/kolibri/machine.toml"),
        include_str!("../../../../examples/kolibri/errors-10.toml"),
    ),
    (
        include_str!("../../../../examples/huron-k2x8/machine.toml"),
        include_str!("../../../../examples/huron-k2x8/errors-13.toml"),
    ),
    (
        include_str!("../../../../examples/fork-head/machine.toml"),
        include_str!("../../../../examples/fork-head/errors-13.toml"),
    ),
];

/// The product over the foundation has the pose of the chain of frames, with errors of every kind.
#[test]
fn the_chain_has_the_exact_pose_of_the_machine() {
    for (machine, errors) in MACHINES {
        let machine = Machine::from_toml(machine).unwrap();
        let errors = ErrorModel::from_toml(errors, &machine).unwrap();
        let kinematics = Kinematics::new(&machine, &errors);
        let chain = Chain::new(&machine);
        // At a node, tables are exact.
        let motions = chain.motions(&errors, 3);
        let command: PerAxis = std::array::from_fn(|i| {
            motions
                .get(i)
                .map_or(0.0, |m| m.at[[0, m.at.len() - 1, m.at.len() / 2][i % 3]])
        });
        let q = machine.to_kinematic(&command[..machine.axes.len()]);
        let situation = Situation::default();
        let actual = kinematics.actual(&q, &situation, &Switches::ALL);
        let nominal = kinematics.nominal(&q, None);
        let correction = chain.correction(&motions, &command);
        let jacobian = kinematics.jacobian(&q, None);
        // To first order, the correction moves the tip by its error; what it is off is that times the errors' angles.
        let dq = machine.to_kinematic(&correction[..machine.axes.len()]);
        let [moved, _] = jacobian.moved(&dq);
        let error = (actual.t - nominal.t).norm();
        assert!(
            (moved - error).abs() < 1e-3 * error + 1e-9,
            "{} {moved} {error}",
            machine.name
        );
    }
}

#[test]
fn an_error_is_the_same_about_another_point() {
    let placed = PlacedAxis {
        direction: Vector3::z(),
        point: Vector3::new(100.0, -50.0, 20.0),
        rotary: true,
        tool: true,
        frame: Htm::identity(),
    };
    let error = [0.01, -0.02, 0.03, 1e-4, -2e-4, 3e-4];
    let again = placed.components(placed.error(error));
    for (one, other) in error.iter().zip(again) {
        // Rounding of levers of 100 mm.
        assert!((one - other).abs() < 1e-13, "{error:?} {again:?}");
    }
}
