//! A machine with random errors for LinuxCNC, which plays it: `cargo xtask linuxcnc calibrate` and `calibrate-all`.
//!
//! Writes into a folder the configuration of LinuxCNC, what plays the real machine (errors and balls), and what its owner
//! knows (machine and artefact).

use nalgebra::Vector3;
use std::error::Error;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::identify::Model;
use trueaxis_measure::plan::{Allowed, Probe, Setup};
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_tests::fixed::Fixed;

const USAGE: &str = "usage: calibration-machine SEED FOLDER [outside]";
/// Layouts: a trunnion, table and head, a fork head, a trunnion with an inclined axis, and two trunnions of other sizes.
const MACHINES: [(&str, &str); 6] = [
    (
        "linuxcnc-xyzac-trt",
        include_str!("../../examples/linuxcnc-xyzac-trt/machine.toml"),
    ),
    (
        "table-head",
        include_str!("../../examples/table-head/machine.toml"),
    ),
    (
        "fork-head",
        include_str!("../../examples/fork-head/machine.toml"),
    ),
    (
        "huron-k2x8",
        include_str!("../../examples/huron-k2x8/machine.toml"),
    ),
    (
        "kolibri",
        include_str!("../../examples/kolibri/machine.toml"),
    ),
    ("hu40", include_str!("../../examples/hu40/machine.toml")),
];
/// Ordinary errors; they are drawn, and all multiplied by a factor from a tenth to ten.
const ANGLE: f64 = 40e-6;
const LENGTH: f64 = 15e-3;
const SCALE: f64 = 40e-6;
/// Largest errors outside the model (mm): reversal value, amplitudes of run-out and of waves of straightness with so many
/// pieces.
const BACKLASH: f64 = 4e-3;
const RUN_OUT: f64 = 2e-3;
const STRAIGHTNESS: f64 = 3e-3;
const POINTS: usize = 24;
/// Balls that can be reached at fewer rotary positions than this are placed elsewhere.
const LEAST: usize = 40;
const TRIES: usize = 500;
/// Diameter of the balls (mm).
const BALL: f64 = 20.0;

/// Random numbers.
struct Random(Fixed);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.bits()) / f64::from(u32::MAX)
    }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (seed, folder, outside) = match &words[..] {
        [seed, folder] => (seed, folder, false),
        [seed, folder, word] if word == "outside" => (seed, folder, true),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match seed
        .parse()
        .map_err(Into::into)
        .and_then(|seed| write(seed, Path::new(folder), outside))
    {
        Ok(said) => {
            println!("{said}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn write(seed: u64, folder: &Path, outside: bool) -> Result<String, Box<dyn Error>> {
    let mut random = Random(Fixed::new(seed + 1));
    // Seeds that are close to each other begin alike.
    for _ in 0..20 {
        random.0.bits();
    }
    let (name, text) = MACHINES[seed as usize % MACHINES.len()];
    let machine = Machine::from_toml(text).map_err(|e| e.message)?;
    fs::create_dir_all(folder)?;
    let put = |name: &str, text: &str| fs::write(folder.join(name), text);
    put("machine.toml", text)?;
    let factor = 10.0_f64.powf(random.within(-1.0, 1.0));
    let mut text = errors(&machine, factor, &mut random)?;
    if outside {
        // Drawn apart, so that the rest of the machine is the same.
        text += &errors_outside(&machine, &mut Random(Fixed::new(seed + 1001)));
    }
    put("errors.toml", &text)?;
    let errors = ErrorModel::from_toml(&text, &machine).map_err(|e| e.message)?;
    let [(one, real_one), (two, real_two)] = balls(&machine, &errors, &mut random)?;
    let real = [real_one, real_two].map(|ball| ball.map(|at| at + random.within(-0.05, 0.05)));
    let length = (real[1] - real[0]).norm();
    let mut artefact = String::new();
    let mut list = String::new();
    for (name, stated, real) in [("one", one, real[0]), ("two", two, real[1])] {
        artefact += &format!(
            "[[ball]]\nname = \"{name}\"\nnominal_mm = [{:.1}, {:.1}, {:.1}]\n\n",
            stated.x, stated.y, stated.z
        );
        list += &format!("{} {} {} {BALL}\n", real.x, real.y, real.z);
    }
    artefact += &format!(
        "[[bar]]\nballs = [\"one\", \"two\"]\nlength_mm = {length:.4}\nstandard_uncertainty_mm = 0.0005\n"
    );
    put("artefact.toml", &artefact)?;
    put("balls.txt", &list)?;
    put("machine.ini", &ini(&machine))?;
    put("machine.hal", &hal(&machine))?;
    put("tool.tbl", "")?;
    Ok(format!(
        "{name}, errors {factor:.2} times the ordinary ones"
    ))
}

/// The errors of models 12 and of scale, without backlash, which is drawn apart.
fn errors(machine: &Machine, factor: f64, random: &mut Random) -> Result<String, Box<dyn Error>> {
    let parameters = Model::Thirteen
        .parameters(machine, 0, &[])
        .map_err(|e| e.reason)?;
    let mut text = format!("machine = \"{}\"\n\n[parameters]\n", machine.name);
    for parameter in parameters {
        let name = parameter.to_string();
        if name.ends_with('S') {
            continue; // The spindle turns with no machine here: part of the stylus.
        }
        let ordinary = match (parameter.is_angular(), name.ends_with('1')) {
            (_, true) => SCALE,
            (true, _) => ANGLE,
            (false, _) => LENGTH,
        };
        text += &format!(
            "{name} = {:e}\n",
            factor * ordinary * random.within(-1.0, 1.0)
        );
    }
    Ok(text)
}

/// Errors that no model of the loop has: backlash of linear axes, run-out and wobble of rotary ones, and straightness.
fn errors_outside(machine: &Machine, random: &mut Random) -> String {
    let (mut parameters, mut tables) = (String::new(), String::new());
    for axis in &machine.axes {
        let letter = axis.letter.char();
        let along = axis.letter.component();
        let across = (0..3).filter(|k| *k != along).map(|k| ["X", "Y", "Z"][k]);
        if axis.letter.is_rotary() {
            for (component, harmonic) in across.flat_map(|k| [(k, 'c'), (k, 's')]) {
                let amplitude = RUN_OUT * random.within(-1.0, 1.0);
                parameters += &format!("E{component}{letter}{harmonic}1 = {amplitude:e}\n");
            }
            continue;
        }
        // Half of the reversal value; lost motion is negative.
        let half = -0.5 * BACKLASH * random.within(0.3, 1.0);
        parameters += &format!("E{letter}{letter}b = {half:e}\n");
        let [low, high] = axis.travel;
        for component in across {
            let amplitude = STRAIGHTNESS * random.within(0.3, 1.0);
            let (waves, begins) = (random.within(0.7, 2.0), random.within(0.0, TAU));
            let parts = (0..=POINTS).map(|k| k as f64 / POINTS as f64);
            let value = |part: f64| amplitude * (TAU * waves * part + begins).sin();
            let list = |of: &dyn Fn(f64) -> f64| {
                let all: Vec<String> = parts
                    .clone()
                    .map(|part| format!("{:?}", of(part)))
                    .collect();
                all.join(", ")
            };
            tables += &format!(
                "\n[tabulated.E{component}{letter}]\nat = [{}]\nvalue = [{}]\nunit = \"mm\"\n",
                list(&|part| low + part * (high - low)),
                list(&value)
            );
        }
    }
    parameters + &tables
}

/// A ball: where its owner says it is, having driven there, and where that really is.
type Ball = (Vector3<f64>, Vector3<f64>);

/// Two balls that the stylus reaches at many rotary positions, 60 to 200 mm apart.
fn balls(
    machine: &Machine,
    errors: &ErrorModel,
    random: &mut Random,
) -> Result<[Ball; 2], Box<dyn Error>> {
    let real = Kinematics::new(machine, errors);
    let tip = Vector3::from(machine.tip);
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let allowed = Allowed::of(machine, &vec![false; machine.axes.len()]);
    let is_reached = |place: &Vector3<f64>| {
        let text = format!(
            "[[ball]]\nname = \"one\"\nnominal_mm = [{}, {}, {}]\n",
            place.x, place.y, place.z
        );
        let artefact = Artefact::from_toml(&text, machine.tool_axis).ok()?;
        let setup = Setup {
            machine,
            artefact: &artefact,
            balls: vec!["one".to_owned()],
            probe: Probe::default(),
            sigma: 1e-3,
            observations: None,
        };
        (setup.candidates(&allowed).0.rows.len() >= LEAST).then_some(())
    };
    let mut found: Vec<Ball> = Vec::new();
    for _ in 0..TRIES {
        let mut command = PerAxis::default();
        for (at, axis) in command.iter_mut().zip(&machine.axes) {
            let [low, high] = axis.travel;
            let middle = (low + high) / 2.0;
            *at = match axis.letter.is_rotary() {
                true => 0.0_f64.clamp(low, high),
                false => middle + random.within(-0.25, 0.25) * (high - low),
            };
        }
        let q = machine.to_kinematic(&command);
        let place = kinematics.nominal(&q, None).t;
        let place = place.map(|at| (at * 10.0).round() / 10.0);
        let fits = found
            .first()
            .is_none_or(|(first, _)| (60.0..200.0).contains(&(place - first).norm()));
        if fits && is_reached(&place).is_some() {
            let there = real.sensitivity(&q, &Situation::default(), &tip).point;
            found.push((place, there));
        }
        if let [one, two] = found[..] {
            return Ok([one, two]);
        }
    }
    Err("no two balls can be reached at many positions".into())
}

fn letters(machine: &Machine) -> String {
    "XYZABCUVW"
        .chars()
        .filter(|letter| machine.index(*letter).is_some())
        .collect()
}

/// A configuration without a screen; `/tmp/unattended.py` takes its place. Faster than machines are: the tests wait.
fn ini(machine: &Machine) -> String {
    let letters = letters(machine);
    let joints = letters.len();
    let mut text = format!(
        "[EMC]\nVERSION = 1.1\nMACHINE = {}\n\n[DISPLAY]\nDISPLAY = /tmp/unattended.py\n\n\
         [TASK]\nTASK = milltask\nCYCLE_TIME = 0.001\n\n[RS274NGC]\nPARAMETER_FILE = machine.var\n\n\
         [EMCMOT]\nEMCMOT = motmod\nCOMM_TIMEOUT = 1.0\nSERVO_PERIOD = 1000000\n\n[HAL]\nHALFILE = machine.hal\n\n\
         [TRAJ]\nCOORDINATES = {letters}\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\nDEFAULT_LINEAR_VELOCITY = 50\n\
         MAX_LINEAR_VELOCITY = 1000\nMAX_LINEAR_ACCELERATION = 20000\nMAX_ANGULAR_VELOCITY = 900\n\n\
         [EMCIO]\nEMCIO = io\nCYCLE_TIME = 0.01\nTOOL_TABLE = tool.tbl\n\n\
         [KINS]\nKINEMATICS = trivkins coordinates={letters}\nJOINTS = {joints}\n",
        machine.name
    );
    for (joint, letter) in letters.chars().enumerate() {
        let axis = &machine.axes[machine.index(letter).unwrap_or(0)];
        // A machine that turns endlessly may go anywhere; others end with their travel.
        let [low, high] = match axis.modulo {
            true => [-1e5, 1e5],
            false => [axis.travel[0] - 0.001, axis.travel[1] + 0.001],
        };
        let (kind, velocity, acceleration) = match axis.letter.is_rotary() {
            true => ("ANGULAR", 900, 20000),
            false => ("LINEAR", 1000, 20000),
        };
        let home = 0.0_f64.clamp(axis.travel[0], axis.travel[1]);
        let limits = format!(
            "MIN_LIMIT = {low}\nMAX_LIMIT = {high}\nMAX_VELOCITY = {velocity}\nMAX_ACCELERATION = {acceleration}\n"
        );
        text += &format!(
            "\n[AXIS_{letter}]\n{limits}\n[JOINT_{joint}]\nTYPE = {kind}\n{limits}HOME = {home}\nHOME_OFFSET = {}\n\
             HOME_SEARCH_VEL = 0\nHOME_SEQUENCE = 0\nFERROR = 1\nMIN_FERROR = 1\n",
            // Positions of motors are other numbers than those of joints.
            home + 1.25 + joint as f64
        );
    }
    text
}

/// The HAL file: ideal drives, the compensation, and the component that simulates the real machine.
fn hal(machine: &Machine) -> String {
    let letters = letters(machine);
    let mut text = format!(
        "loadrt [KINS]KINEMATICS\n\
         loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS\n\
         loadrt trueaxis file=machine.trax axes={letters} units=mm\n\
         loadrt trueaxis_model file=machine.model axes={letters} units=mm balls=balls.txt\n\
         addf trueaxis.read servo-thread\naddf motion-command-handler servo-thread\n\
         addf motion-controller servo-thread\naddf trueaxis.write servo-thread\naddf trueaxis-model servo-thread\n\
         setp trueaxis-model.pretravel 5\nsetp trueaxis-model.lobing 1\nsetp trueaxis-model.noise 1\n\
         net probe trueaxis-model.touching => motion.probe-input\n\
         net enabled iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in\n\
         net orient spindle.0.orient => spindle.0.is-oriented\n\
         net tool-prepared iocontrol.0.tool-prepare => iocontrol.0.tool-prepared\n\
         net tool-changed iocontrol.0.tool-change => iocontrol.0.tool-changed\n"
    );
    for n in 0..letters.len() {
        text += &format!(
            "net pos-{n} joint.{n}.pos-cmd => trueaxis.joint.{n}.pos-in trueaxis-model.joint.{n}.pos-in\n\
             net homed-{n} joint.{n}.homed => trueaxis.joint.{n}.homed\n\
             net homing-{n} joint.{n}.homing => trueaxis.joint.{n}.homing\n\
             net cmd-{n} joint.{n}.motor-pos-cmd => trueaxis.joint.{n}.motor-cmd-in\n\
             net drive-{n} trueaxis.joint.{n}.motor-cmd-out => trueaxis.joint.{n}.motor-fb-in trueaxis-model.joint.{n}.motor-in\n\
             net fb-{n} trueaxis.joint.{n}.motor-fb-out => joint.{n}.motor-pos-fb\n\
             net offset-{n} joint.{n}.motor-offset => trueaxis-model.joint.{n}.motor-offset\n"
        );
    }
    text
}
