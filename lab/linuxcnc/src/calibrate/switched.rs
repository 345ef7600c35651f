//! One machine whose kinematics are switched: held, interrupted, continued, and loaded.

use super::operated::{NO_FILE, OF_BAND, PROBING, left, number, operate, until};
use crate::bench::{LinuxCncBench, without_panels};
use crate::motion::example;
use programs::files;

/// The simulated machine.
const MACHINE: &str = "configs/xyzac-trt";
/// What its owner can identify with a stylus that runs true: model 12, a length, and where the trunnion stands.
const LOCATIONS: &str = "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z,EXX1,EYY1,EZZ1,ECCb,EX0C,EY0A";
/// Exit codes of a program that a signal ended: SIGTERM, and SIGINT.
const TERMINATED: i32 = 143;
const INTERRUPTED: i32 = 130;

/// Calibrates it; returns what is left.
///
/// # Errors
/// The violated condition.
pub fn calibrate(bench: &LinuxCncBench) -> Result<String, String> {
    let bench = bench.apart("switched")?;
    configure(&bench)?;
    let trueaxis = bench.program()?;
    let calibrate = format!(
        "{trueaxis} linuxcnc calibrate machine.toml --artefact artefact.toml {PROBING} \
         --indexings A=-60:60:20,C=-180:150:30 --model {LOCATIONS} --folder run"
    );
    bench.write("hold", hold(&calibrate))?;
    let (lines, expected): (Vec<String>, Vec<i32>) =
        steps(&calibrate, trueaxis).into_iter().unzip();
    let (printed, codes) = operate(&bench, MACHINE, "xyzac-trt.ini", &lines)?;
    if codes != expected {
        return Err(format!("{printed}\n{codes:?}"));
    }
    if printed.matches("stopped: the machine stands").count() != 2 {
        return Err(format!("{printed}\nit does not say that it stops"));
    }
    let read = |name: &str| files::read_text(&bench.file(&format!("{MACHINE}/{name}")));
    let (interrupted, whole) = (read("interrupted.csv")?, read("run/touches.csv")?);
    let rows = interrupted.lines().count().saturating_sub(1) / 5;
    let first: Vec<&str> = whole.lines().take(1 + 5 * rows).collect();
    if !interrupted.starts_with(&first.join("\n")) || whole.lines().count() != 161 {
        return Err(format!(
            "the log was not continued:\n{interrupted}\n{whole}"
        ));
    }
    let band = number(&read("run/validation.json")?, "coverage_um")?;
    let [untreated, treated] = left(&bench, MACHINE)?;
    if treated > OF_BAND * band {
        return Err(format!(
            "{printed}\n{treated} µm are left, {band} were predicted"
        ));
    }
    Ok(format!(
        "interrupted, continued, and calibrated: tip {untreated:.2} → {treated:.2} µm, band {band:.2}"
    ))
}

/// The configuration without a screen and several times as fast, its machine and its errors.
fn configure(bench: &LinuxCncBench) -> Result<(), String> {
    bench.configurations()?;
    let file = |name: &str| format!("{MACHINE}/{name}");
    let ini = file("xyzac-trt.ini");
    let text = without_panels(&files::read_text(&bench.file(&ini))?)
        .replace("DISPLAY = axis", "DISPLAY = /tmp/unattended.py")
        .replace("CYCLE_TIME = 0.010", "CYCLE_TIME = 0.001")
        .replace("_VELOCITY = 100", "_VELOCITY = 400")
        .replace("_VELOCITY = 60", "_VELOCITY = 200")
        .replace("_ACCELERATION = 1000", "_ACCELERATION = 8000")
        .replace("_ACCELERATION = 600", "_ACCELERATION = 4000");
    bench.write(&ini, text)?;
    let (machine, errors) = (file("machine.toml"), file("errors.toml"));
    files::copy(example("machine.toml").as_ref(), &bench.file(&machine))?;
    // Without the backlash of X: balls are touched from both sides, which hides it from every model.
    let text = files::read_text(example("errors-11.toml").as_ref())?;
    let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with("EXXb")).collect();
    bench.write(&errors, lines.join("\n") + "\n")?;
    bench.model(&machine, &errors, &file("xyzac-trt.model"))
}

/// What an operator does, with the exit codes.
fn steps(calibrate: &str, trueaxis: &str) -> Vec<(String, i32)> {
    let is_one = |pin: &str| format!("halcmd getp {pin} | grep -qE '^(1|TRUE)$'");
    let (enabled, is_in) = (is_one("trueaxis.enable"), is_one("trueaxis.factor"));
    let switched_back = is_one("kinstype.is-0");
    vec![
        ("halcmd setp trueaxis.enable 1".to_owned(), 0),
        // Feed override 0 holds it for as long as it lasts; an operator who stops the machine ends the command.
        ("sh /tmp/hold".to_owned(), 0),
        // Ended in the middle of probing without corrections, as by a terminal that is closed.
        (
            format!(
                "{calibrate} --from probe & {}; kill $!; wait $!",
                until("touches.csv", 20)
            ),
            TERMINATED,
        ),
        // When the command has ended, the machine stands still; its kinematics and the component are as they were.
        (
            format!(
                "{switched_back} && {} && {enabled}",
                is_one("motion.in-position")
            ),
            0,
        ),
        (format!("{NO_FILE} && test ! -e xyzac-trt.trax"), 0),
        ("cp run/touches.csv interrupted.csv".to_owned(), 0),
        (format!("{calibrate} --from probe"), 0),
        (format!("{is_in} && {switched_back}"), 0),
        // Another compensation, interrupted in the middle of its validation, by a shell that ignores Ctrl-C: the first
        // one is in use again.
        (
            format!(
                "cp xyzac-trt.trax first.trax; halcmd getp trueaxis.checksum > first; rm run/after.csv; \
                 {trueaxis} compile machine.toml run/errors.toml --tolerance 5 -o run/machine.trax"
            ),
            0,
        ),
        (
            format!(
                "! cmp -s first.trax run/machine.trax && \
                 ({calibrate} --from load & {}; ! cmp -s first.trax xyzac-trt.trax || exit 1; kill -INT $!; wait $!)",
                until("after.csv", 8)
            ),
            INTERRUPTED,
        ),
        (
            format!(
                "cmp first.trax xyzac-trt.trax && halcmd getp trueaxis.checksum | cmp first - && {enabled} && \
                 sleep 2 && {is_in}"
            ),
            0,
        ),
    ]
}

/// A script of the shell: holds the machine by the feed override, lets it go on, and stops it as an operator does.
///
/// A touch under way when it is held, and one whose row is being written, are still logged; then the log stands still.
/// Whatever fails, the calibration is ended: left running, it would keep the later ones out.
fn hold(calibrate: &str) -> String {
    let python = |what: &str| format!("python3 -c 'import linuxcnc; linuxcnc.command().{what}'");
    let (hold, go, stop) = (
        python("feedrate(0)"),
        python("feedrate(1)"),
        python("abort()"),
    );
    let rows = "$(wc -l < run/before.csv)";
    format!(
        "{calibrate} > held 2>&1 &\ntrap 'kill $! 2>/dev/null; wait $!' EXIT\n\
         fail() {{ echo \"$1\"; cat held; exit 1; }}\n{}\n{hold}\nheld={rows}\n\
         for k in 1 2 3; do now={rows}; sleep 4; [ $now = {rows} ] && break; done\n\
         [ $now = {rows} ] && [ $now -le $((held + 2)) ] || fail \"held at $held rows, there are {rows}\"\n{go}\n{}\n\
         for k in $(seq 100); do kill -0 $! 2>/dev/null || break; {stop}; sleep 0.1; done\n\
         wait $!\ncode=$?\n[ $code = 2 ] && grep -q 'somebody stopped it' held || fail \"exit code $code\"\n",
        until("before.csv", 6),
        until("before.csv", 11)
    )
}
