//! Circles in LinuxCNC on a machine with play: what its own `BACKLASH` leaves of the contour, and what the compensation
//! leaves that `setup` makes of it, in the same run. Both corrections of every period are recorded, and go to a model of
//! play.

use super::bench::LinuxCncBench;
use super::rows::RecordedRows;
use crate::csv;
use crate::files;
use crate::process::run;
use std::process::Command;

const FOLDER: &str = "contour";
/// The machine's play on X and Y, mm.
const PLAY: f64 = 0.03;
/// Contour errors up to this (mm) are not counted.
const ALLOWED: f64 = 2e-3;
/// How much longer than with `BACKLASH` they may last.
const LONGER: f64 = 1.2;
/// A circle begins with the play made up; corrections of f32, mm.
const BEGINS: f64 = 1e-6;
/// Recorded of each of the two joints.
const OF_JOINT: [&str; 4] = [
    "joint.N.pos-cmd",
    "joint.N.motor-pos-cmd",
    "joint.N.motor-offset",
    "trueaxis.joint.N.correction",
];
/// Longer than all circles, in periods of a millisecond.
const MOST_ROWS: usize = 60_000;

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    files::folder(bench.file(FOLDER))?;
    bench.copy("firmware/linuxcnc/tests/contour.py", "contour.py")?;
    bench.copy("firmware/linuxcnc/tests/tool.tbl", "tool.tbl")?;
    let ini = &format!("{FOLDER}/machine.ini");
    bench.write(&format!("{FOLDER}/machine.hal"), connections())?;
    bench.write(ini, configuration(FOLDER, "machine.hal", PLAY, None))?;
    let [machine, errors, trax] =
        ["machine.toml", "errors.toml", "machine.trax"].map(|name| format!("{FOLDER}/new/{name}"));
    let new = &format!("{FOLDER}/new");
    let in_hal = "/tmp/contour/new/machine.trax";
    bench.trueaxis(&["linuxcnc", "setup", ini, "-o", new, "--file", in_hal])?;
    bench.trueaxis(&[
        "compile", &machine, &errors, "-o", &trax, "--random", "1000",
    ])?;
    // BACKLASH stays, so that both act in every period; the component's command goes nowhere but to the drive.
    bench.write(&format!("{FOLDER}/tape.hal"), tape())?;
    bench.write(
        ini,
        configuration(
            FOLDER,
            "machine.hal\nHALFILE = new/trueaxis.hal\nHALFILE = tape.hal",
            PLAY,
            None,
        ),
    )?;
    run(Command::new("chmod")
        .args(["-R", "a+rwX"])
        .arg(bench.file(FOLDER)))?;
    // The results of an earlier run must not be used instead.
    for name in ["circles.csv", "record"] {
        let _ = std::fs::remove_file(bench.file(&format!("{FOLDER}/{name}")));
    }
    let said = bench.inside(&["linuxcnc", "/tmp/contour/machine.ini"])?;
    let circles =
        files::read_text(&bench.file("contour/circles.csv")).map_err(|e| format!("{e}\n{said}"))?;
    let names: Vec<String> = ["0", "1"]
        .iter()
        .flat_map(|joint| OF_JOINT.map(|name| name.replace('N', joint)))
        .collect();
    let rows = RecordedRows::read(bench, "contour/record", &names)?;
    for circle in csv::numbers(&circles)? {
        let [feed, first, end] = circle[..] else {
            return Err(format!("a circle is {circle:?}"));
        };
        judge(&rows, feed, first as usize..end as usize)?;
    }
    Ok(())
}

/// One circle.
fn judge(rows: &RecordedRows, feed: f64, range: std::ops::Range<usize>) -> Result<(), String> {
    let (mut lasts, mut most) = ([0; 2], [0.0_f64; 2]);
    for joint in ["0", "1"] {
        let of = |name: &str| rows.of(&name.replace('N', joint))[range.clone()].to_vec();
        let [command, motor, offset, ours] = OF_JOINT.map(of);
        let own: Vec<f64> = (0..command.len())
            .map(|k| motor[k] - offset[k] - command[k])
            .collect();
        let reversals = own
            .windows(2)
            .filter(|w| (w[0] > 0.0) != (w[1] > 0.0))
            .count();
        if reversals != 2 {
            return Err(format!(
                "F{feed}: joint {joint} reverses {reversals} times on a circle"
            ));
        }
        for (k, correction) in [&own, &ours].into_iter().enumerate() {
            let off = (correction[0].abs() - 0.5 * PLAY).abs();
            if off > BEGINS {
                return Err(format!(
                    "F{feed}: joint {joint} begins with a correction of {}",
                    correction[0]
                ));
            }
            let errors = with_play(&command, correction);
            lasts[k] += errors.iter().filter(|e| e.abs() > ALLOWED).count();
            most[k] = errors.iter().fold(most[k], |most, e| most.max(e.abs()));
        }
    }
    let [own, ours] = lasts;
    println!(
        "contour: R 30 mm at F{feed} with {:.0} µm of play: BACKLASH leaves up to {:.1} µm and more than {:.0} for {own} \
         ms, the compensation {:.1} µm and {ours} ms",
        PLAY * 1e3,
        most[0] * 1e3,
        ALLOWED * 1e3,
        most[1] * 1e3,
    );
    match ours as f64 <= LONGER * own as f64 {
        true => Ok(()),
        false => Err(format!("F{feed}: {ours} ms, with BACKLASH {own} ms")),
    }
}

/// How far the carriage is from its command: it rests until the drive has gone through the play.
fn with_play(command: &[f64], correction: &[f64]) -> Vec<f64> {
    let mut carriage = command[0];
    let periods = command.iter().zip(correction);
    let errors = periods.map(|(command, correction)| {
        let drive = command + correction;
        carriage = carriage.clamp(drive - 0.5 * PLAY, drive + 0.5 * PLAY);
        carriage - command
    });
    errors.collect()
}

/// Three drives that are where they are commanded to be.
pub fn connections() -> String {
    let mut hal = String::from(
        "loadrt [KINS]KINEMATICS\n\
         loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS\n\
         addf motion-command-handler servo-thread\naddf motion-controller servo-thread\n\
         net enabled iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in\n",
    );
    for joint in 0..3 {
        hal += &format!(
            "net drive-{joint} joint.{joint}.motor-pos-cmd => joint.{joint}.motor-pos-fb\n"
        );
    }
    hal
}

/// Records both joints after the component.
fn tape() -> String {
    let mut hal = format!(
        "loadrt tape record=/tmp/contour/record in={} rows={MOST_ROWS}\n",
        "f".repeat(2 * OF_JOINT.len())
    );
    let pins = [0, 1]
        .into_iter()
        .flat_map(|joint| OF_JOINT.map(|name| name.replace('N', &joint.to_string())));
    for (number, pin) in pins.enumerate() {
        // A pin may have its signal already.
        hal += &format!("net {} => tape.in-{number:02}\n", signal(&pin));
    }
    // The program switches the corrections: M64 P0 and M65 P0.
    hal + "addf tape.record servo-thread\nnet compensate motion.digital-out-00 => trueaxis.enable\n"
}

/// A signal with its writer, as `setup` calls it if it does.
fn signal(pin: &str) -> String {
    let parts: Vec<&str> = pin.split('.').collect();
    match parts[..] {
        ["joint", joint, name @ "pos-cmd"] => format!("trueaxis-{joint}-{name}"),
        ["joint", joint, "motor-pos-cmd"] => format!("trueaxis-{joint}-cmd"),
        _ => format!("{} {pin}", pin.replace('.', "-")),
    }
}

/// A machine with three axes that `NAME.py` drives, with play on X and Y; homed in the middle of its travels, or where it
/// stands, at `home`.
pub fn configuration(name: &str, halfiles: &str, play: f64, home: Option<f64>) -> String {
    let mut text = format!(
        "[EMC]\nVERSION = 1.1\nMACHINE = {name}\n[DISPLAY]\nDISPLAY = /tmp/{name}.py\n\
         [TASK]\nTASK = milltask\nCYCLE_TIME = 0.010\n[RS274NGC]\nPARAMETER_FILE = {name}.var\n\
         [EMCMOT]\nEMCMOT = motmod\nCOMM_TIMEOUT = 1.0\nSERVO_PERIOD = 1000000\n\
         [HAL]\nHALFILE = {halfiles}\n\
         [TRAJ]\nCOORDINATES = XYZ\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\n\
         DEFAULT_LINEAR_VELOCITY = 50\nMAX_LINEAR_VELOCITY = 150\n\
         [EMCIO]\nEMCIO = io\nCYCLE_TIME = 0.100\nTOOL_TABLE = /tmp/tool.tbl\n\
         [KINS]\nKINEMATICS = trivkins coordinates=XYZ\nJOINTS = 3\n"
    );
    for (joint, (axis, low, high, backlash)) in [
        ("X", 0.0, 200.0, play),
        ("Y", 0.0, 150.0, play),
        ("Z", -150.0, 0.0, 0.0),
    ]
    .into_iter()
    .enumerate()
    {
        let limits = format!(
            "MIN_LIMIT = {low}\nMAX_LIMIT = {high}\nMAX_VELOCITY = 150\nMAX_ACCELERATION = 1000\n"
        );
        let home = home.unwrap_or(0.5 * (low + high));
        text += &format!(
            "[AXIS_{axis}]\n{limits}[JOINT_{joint}]\nTYPE = LINEAR\n{limits}BACKLASH = {backlash}\n\
             FERROR = 1\nMIN_FERROR = 1\nHOME = {home}\nHOME_OFFSET = {home}\nHOME_SEARCH_VEL = 0\nHOME_SEQUENCE = 0\n"
        );
    }
    text
}
