//! What `plan` proposes is accepted by everything that takes a plan, on random machines with and without solids.

use std::fmt::Write;
use trueaxis_identify::Model;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_probing::plan::{
    Allowed, Feeds, Probe, Setup, WantedDesign, collision, design, judge, linuxcnc, steps, table,
};
use trueaxis_tests::{Fixed, random_machines, read, usual_or_all};

/// The example's trunnion with other arms, spindle and balls: often too narrow for half of its rows.
fn trunnion(random: &mut Fixed) -> (Machine, String) {
    let text = read("examples/linuxcnc-xyzac-trt/machine-solids.toml");
    let arm = random.within(85.0, 130.0);
    let spindle = random.within(40.0, 150.0);
    let text = text
        .replace("-115.0, 0.0, 40.0", &format!("-{arm:.1}, 0.0, 40.0"))
        .replace("115.0, 0.0, 40.0", &format!("{arm:.1}, 0.0, 40.0"))
        .replace(
            "diameter_mm = 110.0",
            &format!("diameter_mm = {spindle:.1}"),
        );
    let mut artefact = String::from(
        "[stylus]\nshaft_diameter_mm = 4.0\nlength_mm = 40.0\nshank_diameter_mm = 20.0\n",
    );
    for name in 1..=3 {
        let (x, y) = (random.within(180.0, 260.0), random.within(130.0, 210.0));
        let post = random.within(40.0, 80.0);
        let _ = write!(
            artefact,
            "[[ball]]\nname = \"{name}\"\nnominal_mm = [{x:.1}, {y:.1}, {:.1}]\npost_diameter_mm = 8.0\npost_height_mm = {post:.1}\n",
            post - 300.0
        );
    }
    (Machine::from_toml(&text).unwrap(), artefact)
}

/// Three balls about the middle of the travel of any machine.
fn anywhere(machine: Machine, random: &mut Fixed) -> (Machine, String) {
    let mut middle = PerAxis::default();
    for (at, axis) in middle.iter_mut().zip(&machine.axes) {
        *at = 0.5 * (axis.travel[0] + axis.travel[1]);
    }
    let perfect = ErrorModel::perfect(&machine);
    let kinematics = Kinematics::new(&machine, &perfect);
    let tip = kinematics.nominal(&machine.to_kinematic(&middle), None).t;
    let mut artefact = String::new();
    for name in 1..=3 {
        let [x, y, z] = [0, 1, 2].map(|k| tip[k] + random.within(-60.0, 60.0));
        let _ = write!(
            artefact,
            "[[ball]]\nname = \"{name}\"\nnominal_mm = [{x:.1}, {y:.1}, {z:.1}]\n"
        );
    }
    (machine, artefact)
}

#[test]
fn a_proposal_is_accepted_by_judge_program_and_check_of_collisions() {
    let mut random = Fixed::new(11);
    let count = usual_or_all(6, 60);
    let others = random_machines::cases(count).into_iter();
    let mut all: Vec<(Machine, String)> = others
        .map(|case| anywhere(case.machine, &mut random))
        .collect();
    all.extend((0..count).map(|_| trunnion(&mut random)));
    let (mut planned, mut refused) = (0, 0);
    for (number, (machine, artefact)) in all.iter().enumerate() {
        let artefact = Artefact::from_toml(artefact, machine.tool_axis).unwrap();
        let setup = Setup {
            machine,
            artefact: &artefact,
            balls: artefact.balls.iter().map(|b| b.name.clone()).collect(),
            probe: Probe::default(),
            sigma: 1e-3,
            observations: None,
        };
        let rotary: Vec<bool> = (machine.axes.iter())
            .map(|a| a.letter.is_rotary() && number % 3 == 0)
            .collect();
        let model = if number % 2 == 0 { "auto" } else { "10" };
        let model: Model = model.parse().unwrap();
        let Ok(parameters) = model.parameters(machine, 1, &rotary) else {
            continue;
        };
        let allowed = Allowed::of(machine, &rotary);
        let perfect = ErrorModel::perfect(machine);
        let wanted = |enough| WantedDesign {
            probings: enough,
            criterion: Default::default(),
        };
        let plan = match design(&setup, &allowed, &parameters, &perfect, wanted) {
            Ok(plan) => plan,
            Err(error) => {
                // Nothing is proposed where nothing can be: with a reason.
                assert!(!error.to_string().is_empty());
                refused += 1;
                continue;
            }
        };
        // As a file that is read again.
        let text = probings::write_plan(&plan, machine);
        let again = probings::read(&text, machine, false).unwrap();
        let judged = judge(&setup, &parameters, &again, &perfect)
            .unwrap_or_else(|error| panic!("{number} {}: {error}", machine.name));
        let plan = &judged.plan;
        assert!(judged.unreachable.is_empty(), "{number}");
        let feeds = Feeds {
            touch: 60.0,
            near: 1000.0,
        };
        assert!(table(&setup, plan).is_ok(), "{number}");
        assert!(linuxcnc(&setup, plan, feeds, "log").is_ok(), "{number}");
        let steps = steps(&setup, plan).unwrap();
        assert_eq!(collision(&setup, plan, &steps), None, "{number}");
        planned += 1;
    }
    assert!(planned >= count, "{planned} planned, {refused} refused");
}
