//! A machine with random errors for LinuxCNC, which plays it: `cargo xtask linuxcnc calibrate` and `calibrate-all`.
//!
//! Writes into a folder the configuration of LinuxCNC, what plays the real machine (errors and balls), and what its owner
//! knows (machine and artefact).

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use trueaxis_model::machine::Machine;
use trueaxis_tests::drawn_machines::DrawnMachine;

const USAGE: &str = "usage: calibration-machine SEED FOLDER [outside]";
/// Diameter of the balls (mm).
const BALL: f64 = 20.0;

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
    let drawn = DrawnMachine::new(seed, outside)?;
    fs::create_dir_all(folder)?;
    let put = |name: &str, text: &str| fs::write(folder.join(name), text);
    put("machine.toml", drawn.text)?;
    put("errors.toml", &drawn.errors)?;
    put("artefact.toml", &drawn.artefact())?;
    let balls = drawn.balls().iter();
    let list = balls.map(|ball| format!("{} {} {} {BALL}\n", ball.x, ball.y, ball.z));
    put("balls.txt", &list.collect::<String>())?;
    put("machine.ini", &ini(&drawn.machine))?;
    put("machine.hal", &hal(&drawn.machine))?;
    put("tool.tbl", "")?;
    Ok(drawn.about)
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
