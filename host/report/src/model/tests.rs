use super::*;
use trueaxis_model::errors::Parameter;

fn example(machine: &str, errors: &str) -> (Machine, ErrorModel) {
    let machine = Machine::from_toml(machine).unwrap();
    let errors = ErrorModel::from_toml(errors, &machine).unwrap();
    (machine, errors)
}

fn xyzac() -> (Machine, ErrorModel) {
    example(
        include_str!("../../../../examples/linuxcnc-xyzac-trt/machine.toml"),
        include_str!("../../../../examples/linuxcnc-xyzac-trt/errors-11.toml"),
    )
}

#[test]
fn a_hundred_positions_lie_all_over_the_travel_in_both_directions() {
    let (machine, errors) = xyzac();
    let model = PageModel::new(&machine, &errors, None);
    assert_eq!(model.checks.len(), 100);
    for (i, axis) in machine.axes.iter().enumerate() {
        let [low, high] = axis.travel;
        let tenth = 0.1 * (high - low);
        let at = |check: &PageCheck| check.position[i];
        assert!(model.checks.iter().any(|c| at(c) < low + tenth));
        assert!(model.checks.iter().any(|c| at(c) > high - tenth));
        for direction in [-1, 0, 1] {
            assert!(model.checks.iter().any(|c| c.direction[i] == direction));
        }
    }
    assert!(model.checks.iter().all(|c| c.after.is_none()));
}

/// Converts rows of `[R | t]` to a pose.
fn pose(frame: &PoseRows) -> Htm {
    Htm {
        r: nalgebra::Matrix3::from_fn(|row, column| frame[4 * row + column]),
        t: nalgebra::Vector3::from_fn(|row, _| frame[4 * row + 3]),
    }
}

/// The tool pose computed only from the numbers of a model, for coefficients and backlash.
fn rebuilt(model: &PageModel, check: &PageCheck, wrong: bool) -> Htm {
    let mut ends = ["workpiece", "tool"].map(|branch| {
        let mut before = Htm::identity();
        let mut now = Htm::identity();
        for (i, axis) in model.axes.iter().enumerate() {
            if axis.carries != branch {
                continue;
            }
            let at = pose(&axis.frame);
            now = now * before.inverse() * at;
            before = at;
            let mut q = check.position[i];
            if axis.rotary {
                q = q.to_radians();
            }
            if wrong {
                now = now * Htm::from_xyz_abc(model.locations[i]);
            }
            let mut step = [0.0; 6];
            step[axis.component + if axis.rotary { 3 } else { 0 }] = axis.sense * q;
            now = now * Htm::from_xyz_abc(step);
            if wrong {
                let error = axis.motions.each_ref().map(|motion| {
                    motion.as_ref().map_or(0.0, |m| {
                        let powers = m.coefficients.iter().enumerate();
                        powers.map(|(k, c)| c * q.powi(k as i32)).sum::<f64>()
                            + m.backlash * f64::from(check.direction[i])
                    })
                });
                now = now * Htm::from_xyz_abc(error);
            }
        }
        now * before.inverse()
    });
    let [workpiece, tool] = &mut ends;
    *tool = *tool * pose(&model.spindle);
    if wrong {
        *tool = *tool * Htm::from_xyz_abc(model.locations[model.axes.len()]);
    }
    let tip = Htm::translation(nalgebra::Vector3::from(model.tip));
    (*workpiece * pose(&model.workpiece)).inverse() * *tool * tip
}

#[test]
fn the_numbers_of_a_model_are_enough_for_its_poses() {
    let (machine, errors) = xyzac();
    let model = PageModel::new(&machine, &errors, None);
    for check in &model.checks {
        for (expected, wrong) in [(check.nominal, false), (check.actual, true)] {
            let found = frame(&rebuilt(&model, check, wrong));
            let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
            // A dozen matrix products with numbers of size 1000: a few units in the last place.
            assert!(off.fold(0.0, f64::max) < 1e-11, "{check:?}");
        }
    }
}

#[test]
fn what_is_left_is_the_twist_between_both_poses() {
    let (machine, errors) = xyzac();
    for check in PageModel::new(&machine, &errors, None).checks {
        let twist = (pose(&check.nominal).inverse() * pose(&check.actual)).twist();
        let twist = twist.to_array();
        let off = twist.iter().zip(check.before.twist);
        // The difference of two positions some hundred mm away.
        assert!(off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-12);
        let [x, y, z, a, b, _] = check.before.twist;
        assert_eq!(check.before.tip_mm, nalgebra::Vector3::new(x, y, z).norm());
        // The last digit: squares and root in another order.
        let apart = check.before.direction_rad - libm::hypot(a, b);
        assert!(apart.abs() <= 1e-15 * libm::hypot(a, b), "{apart}");
    }
}

#[test]
fn errors_that_are_not_there_are_left_out() {
    let (machine, _) = xyzac();
    let mut errors = ErrorModel::perfect(&machine);
    let model = PageModel::new(&machine, &errors, None);
    assert!(
        model
            .axes
            .iter()
            .all(|a| a.motions.iter().all(Option::is_none))
    );
    assert!(model.checks.iter().all(|c| c.before.tip_mm == 0.0));
    assert!(errors.set(&machine, Parameter::parse("EXCs2").unwrap(), 1e-3));
    let model = PageModel::new(&machine, &errors, None);
    let c = machine.index('C').unwrap();
    let motion = model.axes[c].motions[0].as_ref().unwrap();
    assert_eq!(motion.harmonics, [[0.0, 0.0], [0.0, 1e-3]]);
}
